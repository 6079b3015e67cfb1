import numpy as np
import pytest
from hypothesis import given

from drillctrl import InputError, close_loop, plant_system, preset_structure
from drillctrl.drilling.structures import STRUCTURE_NAMES

from ..strategies import points


@given(points)
def test_zero_gains_change_nothing(point):
    plant = plant_system(point)
    for name in STRUCTURE_NAMES:
        structure = preset_structure(name)
        loop = close_loop(plant, structure, *structure.gains(np.zeros(structure.lower.size)))
        assert loop.A0.tolist() == plant.A0.tolist()
        assert loop.delayed[0].tolist() == plant.delayed[0].tolist()
        assert loop.delays == plant.delays


def test_closing_the_loop_adds_b_k_c(plant_c):
    loop = close_loop(plant_c, preset_structure("case2"), [1.0, 2.0], [3.0, 4.0])
    assert (loop.A0 - plant_c.A0)[3].tolist() == [0, 0, 1, 2]
    assert (loop.delayed[0] - plant_c.delayed[0])[3].tolist() == [0, 0, 3, 4]
    assert not (loop.A0 - plant_c.A0)[:3].any()


def test_feedback_may_have_a_delay_of_its_own(plant_c):
    loop = close_loop(plant_c, preset_structure("case1"), [1.0], [3.0], delay=0.05)
    assert loop.delays == (0.05, plant_c.delays[0])
    assert loop.delayed[0][3, 2] == 3.0
    assert loop.delayed[1].tolist() == plant_c.delayed[0].tolist()


def test_presets_have_the_bounds_of_the_paper():
    bounds = {
        name: (preset_structure(name).gain_names, preset_structure(name).upper.tolist())
        for name in STRUCTURE_NAMES
    }
    assert bounds == {
        "p": (("K1_1",), [10]),
        "case1": (("K1_1", "K2_1"), [10, 10]),
        "pd": (("K1_1", "K1_2"), [10, 5]),
        "case2": (("K1_1", "K1_2", "K2_1", "K2_2"), [10, 5, 10, 5]),
    }


def test_single_bounds_overrule_those_of_the_matrix():
    structure = preset_structure("case2").with_bounds({"K1_2": (-1, 2), "K1": (-3, 3)})
    assert structure.lower.tolist() == [-3, -1, -10, -5]
    assert structure.upper.tolist() == [3, 2, 10, 5]


def test_equal_bounds_fix_a_gain():
    structure = preset_structure("case1").with_bounds({"K1": (-4, -4)})
    assert structure.gain_names == ("K2_1",)
    K1, K2 = structure.gains([2.0])
    assert (K1.tolist(), K2.tolist()) == ([[-4.0]], [[2.0]])


@pytest.mark.parametrize(
    ("bounds", "message"),
    [
        ({"K1": (1, -1)}, "bound K1 = 1:-1"),
        ({"K3": (-1, 1)}, "bound = K3"),
        ({"K1": (float("nan"), 1)}, "bound K1 = nan"),
        ({"K1": (0, float("inf"))}, "bound K1 = inf"),
    ],
)
def test_wrong_bounds_are_refused(bounds, message):
    with pytest.raises(InputError, match=message):
        preset_structure("case1").with_bounds(bounds)


@pytest.mark.parametrize(
    ("name", "K1", "K2", "message"),
    [
        ("case1", [1, 2], [3], "K1"),
        ("case2", [1, 2], [3], "K2"),
        ("case1", [np.nan], [3], "K1"),
        ("case1", ["a"], [3], "K1"),
        ("p", [1], [3], "K2"),
    ],
)
def test_gains_that_do_not_fit_are_refused(plant_c, name, K1, K2, message):
    with pytest.raises(InputError, match=f"^{message} = "):
        close_loop(plant_c, preset_structure(name), K1, K2)


def test_unknown_names_are_refused(plant_c):
    with pytest.raises(InputError, match="structure = case3"):
        preset_structure("case3")
    with pytest.raises(InputError, match="input = torque"):
        close_loop(plant_system_without_torque(plant_c), preset_structure("p"), [1.0])


def plant_system_without_torque(plant):
    from dataclasses import replace

    return replace(plant, input_names=("feed",))
