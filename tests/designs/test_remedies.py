import json
import math

import numpy as np
import pytest

from drillctrl import (
    InputError,
    OperatingPoint,
    RigPoint,
    analyze,
    as_case,
    close_loop,
    design,
    dominant_roots,
    feed,
    plant_system,
    preset_structure,
    soft_torque,
    spectral_abscissa,
    table1,
    top_drive_plant,
)
from drillctrl.designs.remedies import remedies
from drillctrl.designs.report import boundary_decision, report
from drillctrl.spectrum.count import count_right_of

POINT_E = OperatingPoint(5.1, 0.25, 14.0)


def characteristic_by_hand(s, point, axial, torsional):
    """Eq. 22 with a force f(s) x on the bit and a torque c(s) θ."""
    blade = point.blades * (1.0 - np.exp(-s * point.delay))
    da = s * s + 2 * point.xi * point.eta * s + point.eta**2 - axial(s)
    dt = s * s + 2 * point.kappa * s + 1.0 - torsional(s)
    return (da + blade * point.psi) * dt - da * blade * point.delta0


def test_roots_with_feed_beside_torque_solve_the_equation_by_hand():
    structure = feed("case1")
    assert structure.inputs == ("torque", "axial")
    assert structure.outputs == ("theta", "x", "dx")
    now, past = [[-6.0, 0, 0], [0, -9.0, -4.0]], [[5.5, 0, 0], [0, 0, 0]]
    loop = close_loop(plant_system(POINT_E, structure.inputs), structure, now, past)

    def value(s):
        late = np.exp(-s * POINT_E.delay)
        return characteristic_by_hand(s, POINT_E, lambda s: -9 - 4 * s, lambda s: -6 + 5.5 * late)

    for root in dominant_roots(loop)[:6]:
        slope = abs(value(root.value + 1e-3)) / 1e-3
        assert abs(value(root.value)) < 1e-9 * max(1.0, slope)


def test_torque_cannot_stabilise_point_e_and_feed_beside_it_can():
    alone = design(POINT_E, "p", trials=False)
    assert not boundary_decision(alone).possible
    # A torque k θ beside a force d x': the best two gains, and no root right of their abscissa.
    result = design(POINT_E, feed("p", stiffness=0.0), trials=False)
    assert result.spectral_abscissa == pytest.approx(-0.01457, abs=3e-5)
    assert result.K1[0, 1:].tolist() == [0.0, 0.0]
    assert result.K1[1, :2].tolist() == [0.0, 0.0]
    assert count_right_of(result.system(), -0.0140).count == 0
    rng = np.random.default_rng(1)
    plant = plant_system(POINT_E, ("torque", "axial"))
    for k, d in zip(rng.uniform(-10, 10, 40), rng.uniform(-5, 5, 40), strict=True):
        loop = close_loop(plant, feed("p"), [[k, 0, 0], [0, 0, d]])
        assert spectral_abscissa(loop) > result.spectral_abscissa


@pytest.mark.long
def test_the_summary_of_point_e_says_what_would_stabilise_it():
    told = report(design(POINT_E, "case1", trials=False))
    text = told.summary()
    assert "Would stabilise" in text
    assert "an axial actuator, structure case1+feed" in text
    kinds = [remedy.kind for remedy in told.remedies]
    assert kinds == ["feed", "feed", "speed"]
    # Every remedy holds by the other route: the given gains, analysed again.
    for remedy in told.remedies:
        found = remedy.result
        again = (
            analyze(found.point, found.structure, found.K1, found.K2)
            if found.structure
            else (analyze(found.point))
        )
        assert again.stable
        assert again.loop.certificate.agrees
    fields = json.loads(json.dumps(told.to_dict(), allow_nan=False))
    assert fields["remedies"][2]["structure"] is None


@pytest.mark.long
def test_the_speed_is_the_lowest_stable_one_found():
    speed = remedies(design(POINT_E, "p", trials=False))[-1].result.point
    rate = POINT_E.penetration_rate
    assert speed.penetration_rate == pytest.approx(rate)
    for omega0 in np.linspace(POINT_E.omega0, 0.998 * speed.omega0, 12):
        slower = OperatingPoint(omega0, rate / omega0, 14.0)
        assert spectral_abscissa(plant_system(slower)) > 0


def test_a_richer_preset_is_named_at_point_f():
    told = report(design(OperatingPoint(10.0, 12.0, 14.0), "p", trials=False))
    first = told.remedies[0]
    assert (first.kind, first.name) == ("structure", "case1")
    assert first.spectral_abscissa == pytest.approx(-0.3698, abs=5e-5)
    assert "structure case1 within the paper's bounds" in told.summary()


@pytest.mark.long
def test_narrow_bounds_are_named_as_the_reason():
    narrow = {"K1": (-0.1, 0.1), "K2": (0.0, 0.1)}
    result = design(OperatingPoint(10.0, 12.0, 14.0), "case1", bounds=narrow, trials=False)
    assert not result.stable
    assert remedies(result)[0].name == "case1"


@pytest.mark.long
def test_rig_points_get_rpm():
    point = RigPoint(table1(), 120 * math.pi / 30, 20 / 3600)
    told = report(design(point, "p", trials=False))
    faster = told.remedies[-1].result
    assert faster.rig_point.penetration_rate == point.penetration_rate
    assert "144.1 rpm at this rate of penetration" in told.summary()


def test_a_stable_design_needs_none(told_c):
    assert told_c.remedies == ()
    assert "Would stabilise" not in told_c.summary()
    assert told_c.to_dict()["remedies"] == []


def test_structures_that_do_not_combine_are_refused():
    with pytest.raises(InputError, match="beside = feed"):
        feed(feed())
    with pytest.raises(InputError, match="damping"):
        feed(damping=-1.0)
    with pytest.raises(InputError, match="not both 0"):
        feed(stiffness=0.0, damping=0.0)
    assert feed(preset_structure("pd")).gain_names == ("K1_1_1", "K1_1_2", "K1_2_3", "K1_2_4")


@pytest.mark.long(but=1)
@pytest.mark.parametrize("rpm", [60, 90])
def test_more_speed_is_tried_with_the_structure_asked_for(rpm):
    # A free top drive turns away without control: no speed is stable then.
    point = RigPoint(table1(), rpm * math.pi / 30, 20 / 3600)
    told = report(design(as_case(point, top_drive_plant(1.0)), soft_torque(), trials=False))
    (remedy,) = told.remedies
    assert (remedy.kind, remedy.name) == ("speed", "soft-torque")
    assert remedy.result.stable
    found = remedy.result.rig_point
    assert found.penetration_rate == pytest.approx(point.penetration_rate)
    # The axial motion, which a drive can hardly reach, is stable from 144.05 rpm on.
    assert 144.05 < found.rotary_speed * 30 / math.pi < 1.03 * 144.05
    text = " ".join(told.summary().split())
    assert "at this rate of penetration, soft-torque: vibration dies away by" in text
