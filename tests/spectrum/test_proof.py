import math

import numpy as np
import pytest
from hypothesis import given, settings
from scipy.special import lambertw

from drillctrl import DelaySystem, InputError, close_loop, dominant_roots, preset_structure
from drillctrl.spectrum.count import count_right_of
from drillctrl.spectrum.proof import prove_count

from ..strategies import loops

pytest.importorskip("flint")


@pytest.mark.long
@settings(max_examples=25)
@given(loops())
def test_proof_and_count_agree(loop):
    roots = dominant_roots(loop)
    reals = [root.rightmost for root in roots]
    line = reals[0] - 0.5 * (reals[0] - reals[1] if len(reals) > 1 else 1.0)
    if min(abs(line - real) for real in reals) < 1e-3 or loop.max_delay > 2:
        return
    proof = prove_count(loop, line)
    assert proof.count == count_right_of(loop, line).count
    assert proof.count is not None


@pytest.mark.parametrize("line", [-3.0, -1.0, 0.0, 0.4])
def test_scalar_equation_against_lambert(line):
    a, b, tau = 0.3, -1.2, 1.5
    argument = b * tau * math.exp(-a * tau)
    exact = [a + lambertw(argument, k) / tau for k in range(-40, 41)]
    system = DelaySystem([[a]], ([[b]],), (tau,), [[1.0]], [[1.0]])
    assert prove_count(system, line).count == sum(s.real > line for s in exact)


def test_several_delays():
    rng = np.random.default_rng(3)
    system = DelaySystem(
        rng.normal(size=(3, 3)),
        (rng.normal(size=(3, 3)), rng.normal(size=(3, 3))),
        (0.4, 0.9),
        np.zeros((3, 1)),
        np.eye(3),
    )
    assert prove_count(system, 0.05).count == count_right_of(system, 0.05).count


def test_a_triple_root_is_proved_on_either_side(plant_c):
    gains = [-9.525113872283], [9.2200137104]
    loop = close_loop(plant_c, preset_structure("case1"), *gains)
    assert prove_count(loop, -0.8130).count == 3
    assert prove_count(loop, -0.8110).count == 0


def test_a_line_through_a_root_is_undecided():
    system = DelaySystem([[0.5]], (), (), [[1.0]], [[1.0]])
    assert prove_count(system, 0.5, most=500).count is None
    assert prove_count(system, 0.4999).count == 1


def test_bad_lines_are_refused(plant_c):
    with pytest.raises(InputError, match="line = nan"):
        prove_count(plant_c, math.nan)
