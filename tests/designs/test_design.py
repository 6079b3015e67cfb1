import json

import numpy as np
import pytest

from drillctrl import (
    InputError,
    OperatingPoint,
    RigPoint,
    analyze,
    design,
    report,
    robust_alternative,
    table1,
)
from drillctrl.designs.robustness import robustness_of
from drillctrl.spectrum.count import count_right_of


def test_default_point_reaches_the_known_optima(point_c, best_c):
    case1, case2 = best_c, design(point_c, "case2", trials=False)
    assert case1.spectral_abscissa == pytest.approx(-0.811927438342, abs=1e-8)
    assert case1.K1[0, 0] == pytest.approx(-9.525113872, abs=1e-8)
    assert case1.K2[0, 0] == pytest.approx(9.220013710, abs=1e-8)
    assert case2.spectral_abscissa == pytest.approx(-1.392998065, abs=1e-8)
    assert case2.K1.ravel() == pytest.approx([-9.861254902, 3.695722915], abs=1e-8)
    assert case2.K2.ravel() == pytest.approx([10.0, -2.673320042], abs=1e-8)
    assert case2.optimality.active_bounds == ("K2_1",)
    for result in (case1, case2):
        assert result.stable
        loop = result.system()
        assert count_right_of(loop, result.spectral_abscissa + 1e-2).count == 0
        assert (result.structure.K1_lower <= result.K1).all()
        assert (result.structure.K2_upper >= result.K2).all()


def test_undelayed_feedback_cannot_stabilise_point_f():
    result = design(OperatingPoint(10.0, 12.0, 14.0), "p", trials=False)
    assert not result.stable
    assert result.spectral_abscissa == pytest.approx(0.0441, abs=5e-5)
    assert result.K1[0, 0] == pytest.approx(-1.555, abs=5e-4)
    assert "not stabilised: best α = 0.044" in result.summary()


def test_same_seed_same_gains(point_c):
    one, two = (design(point_c, "case1", seed=3, trials=False) for _ in range(2))
    assert one.K1.tobytes() == two.K1.tobytes()
    assert one.K2.tobytes() == two.K2.tobytes()


def test_bounds_bind(point_c, best_c):
    narrow = {"K1": (-2.0, 2.0), "K2_1": (0.0, 1.5)}
    result = design(point_c, "case1", bounds=narrow, trials=False)
    assert -2.0 <= result.K1[0, 0] <= 2.0
    assert 0.0 <= result.K2[0, 0] <= 1.5
    assert result.spectral_abscissa > best_c.spectral_abscissa


@pytest.mark.long
def test_rig_points_are_reported_in_rig_units():
    rig_point = RigPoint(table1(), 150 * np.pi / 30, 20 / 3600)
    result = design(rig_point, "case2")
    assert result.stable
    text = result.summary()
    for part in ("150 rpm", "20 m/h", "kN on bit", "kN·m on bit", "N·m/rad", "N·m·s/rad", " s"):
        assert part in text
    assert "stabilised" in text
    assert "torque = K1·(its angle, its speed) + K2·(the same, one delay ago)" in " ".join(
        text.split()
    )
    assert "rock strength between" in report(result).summary()
    rig = result.to_dict()["rig"]
    stiffness, time = rig_point.rig.torsional_stiffness, rig_point.rig.time_scale
    assert rig["K1"] == pytest.approx(
        [result.K1[0, 0] * stiffness, result.K1[0, 1] * stiffness * time]
    )
    assert rig["settling_time_seconds"] == pytest.approx(
        np.log(50) / -result.spectral_abscissa * time
    )


def test_open_and_given_loops_share_the_fields(point_c):
    open_loop = analyze(point_c).to_dict()
    given = analyze(point_c, "case1", [-5.17], [5.06], m=3, order=0).to_dict()
    assert open_loop.keys() == given.keys()
    assert report(analyze(point_c)).to_dict().keys() == open_loop.keys() | {"robustness"}
    assert open_loop["spectral_abscissa"] == pytest.approx(0.009760358069533952, abs=1e-12)
    assert not open_loop["stable"]
    assert given["stable"]
    assert given["spectral_radius"]["value"] == pytest.approx(0.97933, abs=5e-6)
    assert given["spectral_radius"]["m"] == 3
    assert given["spectral_abscissa"] == pytest.approx(-0.4652, abs=5e-5)
    assert given["certificate"]["agrees"]
    json.dumps(given, allow_nan=False)


def test_fragility_is_that_of_the_changed_loops(point_c):
    result = analyze(point_c, "case1", [-5.173], [5.064])
    rounded = analyze(point_c, "case1", [-5.17], [5.06])
    softer = analyze(point_c.with_changes(psi=13.3), "case1", [-5.173], [5.064])
    found = robustness_of(result).fragility
    assert found.rounded_gains == pytest.approx(rounded.spectral_abscissa)
    assert found.psi_low == pytest.approx(softer.spectral_abscissa)
    assert found.worst >= found.psi_high


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("case1",), "K1"),
        (("case1", [1.0]), "K2"),
        ((None, [1.0], [2.0]), "structure"),
        (("case1", [1.0, 2.0], [1.0]), "K1"),
        (("case9", [1.0]), "structure"),
    ],
)
def test_missing_or_surplus_gains_are_refused(point_c, arguments, message):
    with pytest.raises(InputError, match=f"^{message} = "):
        analyze(point_c, *arguments)


def test_other_objects_are_no_points():
    with pytest.raises(InputError, match="point = dict"):
        design({"omega0": 1})


def test_the_alternative_is_better_when_something_is_off(point_c, best_c):
    other = robust_alternative(best_c, 0.10)
    assert other.spectral_abscissa <= 0.9 * best_c.spectral_abscissa + 1e-6
    assert robustness_of(other).fragility.worst < robustness_of(best_c).fragility.worst
    assert (np.abs(other.K1) <= 10).all()
    with pytest.raises(InputError, match="give_up = 1.5"):
        robust_alternative(best_c, 1.5)
    with pytest.raises(InputError, match="not a stabilised loop"):
        robust_alternative(analyze(point_c))


def test_both_designs_are_reported(told_c):
    fields = told_c.to_dict()
    assert fields["alternative"]["give_up"] == 0.05
    assert fields["alternative"]["stable"]
    assert fields["robustness"]["stability_radius"] > 0
    assert fields["robustness"]["delay_margin"]["longer"] > 1
    assert fields["certificate"]["optimality"]["basins"] >= 1
    assert "More robust" in told_c.summary()
    json.dumps(fields, allow_nan=False)


def test_roots_are_drawn(point_c):
    result = analyze(point_c, "case1", [-5.17], [5.06])
    ax = result.plot()
    drawn = np.vstack([c.get_offsets() for c in ax.collections if len(c.get_offsets())])
    near = np.abs(drawn - [0.009760358, 0.8930716683]).sum(axis=1)
    assert near.min() < 1e-6
    assert ax.get_xlabel() == "growth rate Re s, dimensionless"
