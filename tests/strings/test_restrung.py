"""Strings of other lengths and in other mud, in the units of one of them."""

import math

import numpy as np
import pytest

from drillctrl import (
    Axis,
    Case,
    Drilling,
    InputError,
    RigPoint,
    WorstCase,
    analyze,
    as_case,
    changed_rig,
    characteristic_roots,
    design,
    exact_loop,
    load_table,
    rig_grid,
    save_table,
    string_preset,
    table,
)
from drillctrl.drilling.plant import paper_plant
from drillctrl.strings.changed import restrung
from drillctrl.strings.model import PipeString

RIG = string_preset("paper-string")
SPEED, RATE = 180 * math.pi / 30, 5 / 3600


def coarse(rig):
    """Few modes, so that all of it takes seconds."""
    return as_case(
        RigPoint(rig, SPEED, RATE), paper_plant(string=PipeString(rig.string, 2.0, 3.0, 0.5))
    )


def test_roots_of_a_longer_string_are_its_own_in_other_units():
    longer = changed_rig(RIG, depth=1500.0)
    own = as_case(RigPoint(longer, SPEED, RATE))
    known = as_case(RigPoint(RIG, SPEED, RATE))
    there = Case(restrung(known.plant, depth=1500.0), known.point)
    line = -0.3 * RIG.time_scale
    mine = np.array([root.value for root in characteristic_roots(there.system(), line)])
    other = characteristic_roots(own.system(), -0.4 * longer.time_scale)
    other = np.array([root.value for root in other]) / longer.time_scale
    assert mine.size
    for root in mine / RIG.time_scale:
        assert np.abs(other - root).min() < 1e-9 * abs(root)
    # By the second route to a string too, whose counts know no units.
    loop = exact_loop(there)
    top = mine[np.argmax(mine.real)]
    assert loop.root(top) == pytest.approx(top, rel=1e-4)
    assert loop.count_right_of(0.0) == exact_loop(own).count_right_of(0.0)


def test_mud_bears_on_no_root_and_a_lumped_rig_has_no_depth():
    case = coarse(RIG)
    heavy = Case(restrung(case.plant, mud=1800.0), case.point)
    assert heavy.plant.string.string.submerged_weight < RIG.string.submerged_weight
    assert np.array_equal(heavy.system().A0, case.system().A0)
    with pytest.raises(InputError, match="depth and mud"):
        restrung(paper_plant(), depth=1500.0)
    with pytest.raises(InputError, match="depth"):
        restrung(case.plant, depth=50.0)


@pytest.mark.long
def test_the_worst_of_several_lengths_is_what_each_of_them_gives():
    case = coarse(RIG)
    found = design(case, "p", objective=WorstCase(psi=0.0, depth=0.1), trials=False)
    assert len(WorstCase(psi=0.0, depth=0.1, mud=0.1).around(case)) == 9
    alphas = []
    for share in (0.9, 1.0, 1.1):
        rig = changed_rig(RIG, depth=share * RIG.string.length)
        # One torque for one angle, whatever string: gains are over the lumped stiffness.
        gain = found.K1[0, 0] * RIG.torsional_stiffness / rig.torsional_stiffness
        alpha = analyze(coarse(rig), "p", gain, 0.0).spectral_abscissa
        alphas.append(alpha * RIG.time_scale / rig.time_scale)
    assert found.objective_value == pytest.approx(max(alphas), rel=1e-6)
    nominal = design(case, "p", trials=False)
    assert found.spectral_abscissa >= nominal.spectral_abscissa - 1e-9


def test_a_design_on_the_motion_looks_at_all_corners_of_the_box():
    around = Drilling(omega0=0.1, delta0=0.2, psi=0.1, depth=0.2).around(coarse(RIG))
    lengths = [case.plant.string.string.length for case in around]
    assert len(around) == 81
    assert sorted(set(lengths)) == pytest.approx([960.0, 1200.0, 1440.0])
    assert around[0].rig_point is not None


def test_a_table_over_depth_holds_for_each_string(tmp_path):
    case = coarse(RIG)
    grid = rig_grid(case, SPEED, penetration_rate=RATE, depth=Axis("depth", (1150.0, 1200.0)))
    made = table(grid, "p", trials=False)
    for depth, gains, alpha in zip(
        (1150.0, 1200.0), made.gains, made.spectral_abscissa, strict=True
    ):
        rig = changed_rig(RIG, depth=depth)
        own = gains * RIG.torsional_stiffness / rig.torsional_stiffness
        expected = analyze(coarse(rig), "p", own, 0.0).spectral_abscissa / rig.time_scale
        assert alpha / RIG.time_scale == pytest.approx(expected, rel=1e-6)
    assert made.columns[2] == "depth"
    path = tmp_path / "gains.csv"
    save_table(made, path)
    again = load_table(path, case.plant)
    assert np.array_equal(again.gains, made.gains)
    place = grid.place_of(case)
    assert place[2] == pytest.approx(1200.0)
    assert again.gains_at(*place)[0] == pytest.approx(made.gains[1][0])


def test_what_varies_first_stands_in_the_place_of_the_rock():
    two = Axis("depth", (1150.0, 1200.0)), Axis("mud", (1000.0, 1200.0))
    grid = rig_grid(RIG, SPEED, penetration_rate=RATE, depth=two[0], mud=two[1])
    assert [axis.name for axis in grid.axes[2:]] == ["depth", "mud"]
    grid = rig_grid(RIG, SPEED, penetration_rate=RATE, depth=1300.0, mud=two[1])
    assert grid.plant.string.string.length == pytest.approx(1300.0)
    assert [axis.name for axis in grid.axes] == ["rotary_speed", "penetration_rate", "mud"]
    with pytest.raises(InputError, match="depth"):
        rig_grid(RIG, SPEED, penetration_rate=RATE, depth=Axis("depth", (50.0, 1200.0)))
