import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drillctrl import DelaySystem, InputError, dominant_roots
from drillctrl.delay.system import low_rank_factors

from ..strategies import loops


@given(loops(), st.floats(0.1, 10.0))
def test_scaling_time_scales_the_roots(loop, unit):
    roots = dominant_roots(loop)
    scaled = dominant_roots(loop.scaled_time(unit))
    assert scaled[0].rightmost == pytest.approx(
        unit * roots[0].rightmost, abs=unit * (1e-9 + 10 * roots[0].error)
    )


@given(st.integers(1, 6), st.integers(0, 6), st.integers(0, 10**6))
def test_factors_have_the_rank_and_multiply_back(size, rank, seed):
    rng = np.random.default_rng(seed)
    rank = min(rank, size)
    matrix = rng.normal(size=(size, rank)) @ rng.normal(size=(rank, size))
    left, right = low_rank_factors(matrix)
    assert left.shape == (size, rank)
    assert right.shape == (rank, size)
    assert np.allclose(left @ right, matrix, atol=1e-12 * (1 + np.abs(matrix).max()))


def test_the_plant_delays_one_signal(plant_c):
    left, right = plant_c.factors[0]
    assert right.shape == (1, 4)
    assert (left @ right).tolist() == plant_c.delayed[0].tolist()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"A0": np.zeros((2, 3))}, "A0"),
        ({"A0": np.array([[np.nan, 0], [0, 0]])}, "A0"),
        ({"A0": [["a", "b"], ["c", "d"]]}, "A0"),
        ({"delays": (-1.0,)}, "delays"),
        ({"delays": (float("nan"),)}, "delays"),
        ({"delays": (1.0, 2.0)}, "delayed"),
        ({"B": np.zeros((3, 1))}, "B"),
        ({"C": np.zeros((1, 3))}, "C"),
        ({"state_names": ("a", "a")}, "state_names"),
    ],
)
def test_what_does_not_fit_is_refused(change, message):
    good = {
        "A0": np.zeros((2, 2)),
        "delayed": (np.eye(2),),
        "delays": (1.0,),
        "B": np.zeros((2, 1)),
        "C": np.eye(2),
    }
    with pytest.raises(InputError, match=f"^{message} = "):
        DelaySystem(**{**good, **change})


def test_delays_are_put_in_order():
    one, two, three, four = (k * np.eye(2) for k in (1.0, 2.0, 3.0, 4.0))
    system = DelaySystem(one, (two, three, four, one), (5.0, 0.0, 1.0, 5.0))
    assert system.delays == (1.0, 5.0)
    assert (4.0 * np.eye(2) == system.A0).all()
    assert [float(a[0, 0]) for a in system.delayed] == [4.0, 3.0]
    with pytest.raises(ValueError, match="read-only"):
        system.A0[0, 0] = 0.0


def test_inputs_and_outputs_may_be_left_out():
    system = DelaySystem([[0.0, 1.0], [-1.0, 0.0]], state_names=("x", "v"))
    assert system.B.shape == (2, 0)
    assert system.C.tolist() == [[1.0, 0.0], [0.0, 1.0]]
    assert system.output_names == ("x", "v")
    assert system.delays == ()


def test_balancing_keeps_the_response():
    rng = np.random.default_rng(0)
    units = np.array([1e-5, 1.0, 1e4])
    a0, a1 = rng.normal(size=(2, 3, 3)) * units[:, None] / units
    system = DelaySystem(a0, (a1,), (0.7,), rng.normal(size=(3, 2)) * units[:, None])
    other = system.balanced
    assert np.abs(other.A0).max() < 1e2 < np.abs(system.A0).max()
    s = 0.3 + 1.1j
    one, two = (
        p.C @ np.linalg.solve(s * np.eye(3) - p.A0 - np.exp(-0.7 * s) * p.delayed[0], p.B)
        for p in (system, other)
    )
    assert np.allclose(one, two, rtol=1e-9)


def test_values_cannot_be_changed_afterwards(plant_c):
    with pytest.raises(ValueError, match="read-only"):
        plant_c.A0[0, 0] = 1.0
