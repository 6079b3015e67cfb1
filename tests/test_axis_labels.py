"""Every axis of every figure names what is drawn and in which unit; a rig's in its own units."""

from __future__ import annotations

import re
from math import pi
from pathlib import Path

import numpy as np
import pytest

from drillctrl import (
    Controller,
    OperatingPoint,
    RigPoint,
    analyze,
    campaign,
    chart,
    check_rig,
    compare,
    compare_drives,
    dimensionless_grid,
    example_path,
    gain_surface,
    linear_axis,
    load_rig,
    read_record,
    rig_grid,
    root_locus,
    simulate,
    stabilisable_chart,
    stability_volume,
    study_record,
    table,
    table1,
    vibration_map,
)
from drillctrl.base.language import FIELD
from drillctrl.motion.figure import plot_damping, plot_damping_along, plot_response
from drillctrl.simulation.figure import (
    plot_against_linear,
    plot_phase_portrait,
    plot_rock_face,
    plot_signal,
)
from drillctrl.strings.figure import plot_rig
from drillctrl.studies.rig_report_figure import Line, plot_courses, plot_thresholds

OF_RIGS = (
    "rpm",
    "m/h",
    "kN",
    "kN·m",
    "s",
    "Hz",
    "1/s",
    "mm",
    "m",
    "MPa",
    "rad",
    "N·m/rad",
    "N·m·s/rad",
    "kN·m/√Hz",
)
PLAIN = ("%", "% of critical", "°", "share of Ω0", "multiples of the disturbance", "dimensionless")
RIG = table1()
DRILLING = RigPoint(RIG, 120 * pi / 30, 20 / 3600)
POINT = OperatingPoint(10.0, 2.5, 14.0)
KICK = {"dx": 1.0, "dtheta": 1.0}


def labels(drawn):
    """Return the labels of all axes of a figure; those that share one show it once."""
    figure = drawn if hasattr(drawn, "suptitle") else drawn.get_figure(root=True)
    found = []
    for ax in figure.axes:
        if not ax.axison and not hasattr(ax, "get_zlabel"):
            continue
        if ax.get_label() == "<colorbar>":
            found.append(ax.get_xlabel() or ax.get_ylabel())
            continue
        for axis in "xy":
            together = getattr(ax, f"get_shared_{axis}_axes")().get_siblings(ax)
            texts = [getattr(other, f"get_{axis}label")() for other in together]
            found.append(next((text for text in texts if text), ""))
        if hasattr(ax, "get_zlabel"):
            found.append(ax.get_zlabel())
        for twin in ax.child_axes:
            found.append(twin.get_xlabel() or twin.get_ylabel())
    return found


def check(drawn, *units):
    """Check quantity and unit of all labels, and that these units are among them."""
    found = labels(drawn)
    assert len(found) >= 2
    told = set()
    for label in found:
        quantity, comma, unit = label.replace("\n", " ").rpartition(", ")
        assert comma, label
        assert unit in (*OF_RIGS, *PLAIN), label
        assert sum(letter.isalpha() for letter in quantity) >= 1, label
        told.add(unit)
    assert set(units) <= told
    return told


def run_of(where, controller=None):
    return simulate(where, controller, duration=30.0, initial=KICK, rtol=1e-6)


@pytest.mark.parametrize("where", [POINT, DRILLING], ids=["dimensionless", "rig"])
def test_of_a_simulation(where):
    of_rig = where is DRILLING
    run = run_of(where, Controller("p", [-2.0]))
    drawings = {
        "motion": (run.plot("my rig"), ("s", "mm", "rpm", "kN·m")),
        "phase": (plot_phase_portrait(run), ("rad", "rpm")),
        "axial": (plot_phase_portrait(run, "axial"), ("mm", "m/h")),
        "linear": (plot_against_linear(run, run, "theta"), ("s", "rad")),
        "face": (plot_rock_face(run), ("°", "mm")),
        "weight": (plot_signal(run, "weight_on_bit"), ("s", "kN")),
        "delay": (plot_signal(run, "delay"), ("s",)),
    }
    for name, (drawn, units) in drawings.items():
        told = check(drawn, *(units if of_rig else ()))
        assert of_rig or told <= {"dimensionless", "°"}, name
        assert not of_rig or "dimensionless" not in told, name
    title = drawings["motion"][0].axes[0].get_title()
    wanted = ("my rig", "120 rpm", "20 m/h", "60 MPa", "p: K1", "kN·m/rad") if of_rig else ("ω0",)
    assert all(word in title for word in wanted)


def test_a_rig_is_drawn_in_its_units():
    run = run_of(DRILLING)
    speed = run.plot().axes[1].lines[0]
    seconds = run.in_rig_units(speed.get_xdata()[::50])
    np.testing.assert_allclose(speed.get_ydata()[::50], seconds.bit_speed * 30.0 / pi, rtol=1e-9)
    place = plot_signal(run, "x").lines[0]
    np.testing.assert_allclose(
        place.get_ydata()[::50], 1e3 * seconds.axial_displacement, rtol=1e-9, atol=1e-12
    )
    weight = plot_signal(run, "weight_on_bit").lines[0]
    # Where the bit starts or stops to slip there are two weights at one instant.
    same = np.isclose(weight.get_ydata()[::50], 1e-3 * seconds.weight_on_bit, rtol=1e-9)
    assert same.mean() > 0.9


def test_of_roots():
    free = analyze(DRILLING)
    told = check(free.plot(name="my rig"), "1/s", "Hz")
    assert "dimensionless" not in told
    drawn = free.plot()
    growth = float(drawn.lines[1].get_xdata()[0])
    assert growth == pytest.approx(free.spectral_abscissa / RIG.time_scale)
    # The torsional mode of the rig at about 0.45 Hz is the one that grows.
    places = drawn.collections[0].get_offsets()
    top = places[np.argmax(places[:, 0])]
    assert abs(top[1]) == pytest.approx(
        abs(free.loop.dominant_roots[0].imag) / RIG.time_scale / (2.0 * pi), rel=1e-3
    )
    assert check(analyze(POINT).plot()) == {"dimensionless"}


def test_of_charts(monkeypatch):
    monkeypatch.setattr("drillctrl.charts.chart.FIRST_LINES", 13)
    over = chart(DRILLING, ("speed", 60.0, 180.0), ("rop", 5.0, 30.0), tolerance=1e-2)
    drawn = over.plot(name="my rig")
    assert check(drawn, "rpm", "m/h", "Hz") == {"rpm", "m/h", "Hz"}
    assert "my rig" in drawn.get_title()
    assert "60 MPa" in drawn.get_title()
    hertz = drawn.collections[0].get_array()
    assert hertz.max() == pytest.approx(
        max(curve.omega.max() for curve in over.curves) / RIG.time_scale / (2.0 * pi)
    )
    twins = chart(DRILLING, ("omega0", 5.0, 20.0), ("delta0", 0.0, 5.0), tolerance=1e-2).plot()
    check(twins, "rpm", "m/h")
    gains = chart(POINT, ("K1_1", -5.0, 5.0), ("K2_1", -5.0, 5.0), "case1", tolerance=1e-2)
    check(gains.plot())
    check(stabilisable_chart(POINT, ("omega0", 8.0, 12.0), ("delta0", 0.0, 5.0), "p").plot())
    volume = stability_volume(
        POINT, ("omega0", 8.0, 12.0), ("delta0", 0.0, 5.0), ("psi", 10.0, 14.0), slices=3
    )
    check(volume.plot())
    check(volume.plot_slices(2))
    check(gain_surface(POINT, m=3, order=0, count=5).plot())
    check(root_locus(POINT, count=5).plot())


@pytest.mark.long
def test_of_tables_campaigns_and_maps():
    grid = dimensionless_grid(linear_axis("omega0", 8, 12, 2), linear_axis("delta0", 1, 3, 2), 14.0)
    check(table(grid, "p", trials=False).plot())
    check(table(dimensionless_grid(linear_axis("omega0", 8, 12, 2), 2.0), "p", trials=False).plot())
    check(campaign(grid, sizes=(0.1,), sharpness=np.inf, duration=60.0).plot())
    speeds = rig_grid(
        RIG,
        linear_axis("rotary_speed", 140 * pi / 30, 160 * pi / 30, 2),
        penetration_rate=linear_axis("penetration_rate", 10 / 3600, 20 / 3600, 2),
    )
    check(table(speeds, "p", trials=False).plot(), "rpm", "m/h")
    quick = {"counts": (2, 2), "refine": 0, "starts": ("small",), "duration": 20.0}
    shown = ("outcome", "swing", "stick_fraction", "off_rock_fraction", "feed", "weight_ratio")
    axes = ("speed", 100.0, 160.0), ("wob", 10.0, 20.0)
    check(vibration_map(DRILLING, *axes, **quick).plot(shown), "rpm", "kN", "%")
    check(vibration_map(POINT, ("omega0", 8.0, 12.0), ("psi", 8.0, 12.0), **quick).plot(shown))


@pytest.mark.parametrize("where", [POINT, DRILLING], ids=["dimensionless", "rig"])
def test_of_comparisons_and_bits(where):
    options = {"region": None, "trials": False, "duration": 40.0}
    found = compare(where, ["p"], given=[("weak", "p", [-0.1], None)], **options)
    for _, drawn in found.figures():
        told = check(drawn)
        nyquist = "Nyquist" in drawn.get_title()
        assert nyquist or ("dimensionless" in told) == (where is POINT)
    amplitudes = np.array([0.03, 0.3])
    unit = "N·m·s/rad" if where is DRILLING else ""
    check(plot_damping(amplitudes, amplitudes, amplitudes, unit=unit))
    answer = (amplitudes, amplitudes + 0j)
    of_rig = where is DRILLING
    units = ("Hz", "N·m·s/rad") if of_rig else ()
    for along, named in (("speed", "rpm"), ("rate", "m/h")):
        drawn = plot_damping_along(
            *(100.0 * amplitudes, amplitudes, amplitudes, [("above", 20.0)]),
            along=along, units=(named if of_rig else "", unit), label="mode 1",
        )  # fmt: skip
        check(drawn, *((named, "N·m·s/rad") if of_rig else ()))
    check(plot_response(*answer, amplitudes, answer, unit, "swing 0.03"), *units)


def test_of_strings():
    rig = load_rig("vertical-3000")
    check(plot_rig(check_rig(rig)), "m", "mm")
    drawn = compare_drives(rig, ["stiff"]).plot("my rig")
    check(drawn, "Hz")
    assert drawn.get_suptitle().startswith("my rig, 3000 m of string")


def test_of_a_report():
    times = np.linspace(0.0, 1.0, 5)
    drawn = plot_courses([Line("stiff", times, 12.0 + times, 1e3 * times)], 12.0, FIELD)
    assert {"time, s", "bit speed, rpm"} <= set(labels(drawn))
    assert "torque of control, kft·lbf" in labels(drawn)
    assert "fall of the bit's torque, kft·lbf" in labels(
        plot_thresholds({"stiff": 50.0}, 5.0, 2e3, 12.0, FIELD)
    )
    found = labels(plot_rig(check_rig(load_rig("paper-string")), FIELD))
    assert {"depth along the string, ft", "radius, in"} <= set(found)


def test_of_records():
    study = study_record(read_record(example_path("record")).part(300.0, 600.0), fit=False)
    check(study.plot(), "s", "rpm", "kN·m", "Hz", "kN·m/√Hz", "kN", "N·m·s/rad")
    rig = load_rig(example_path("rig"))
    carried = study_record(read_record(example_path("record")).part(0.0, 200.0), rig, fit=False)
    check(carried.plot(), "s", "rpm", "kN·m", "Hz", "kN")


def test_no_label_is_left_out_of_the_sources():
    """Labels come with a unit: no figure writes one by itself, bare."""
    package = Path(__file__).parents[1] / "drillctrl"
    bare = [
        (path.name, text)
        for path in package.rglob("*.py")
        for text in re.findall(r"set_[xyz]label\(f?\"([^\"]+)\"\)", path.read_text("utf-8"))
        if text.rpartition(", ")[2] not in (*OF_RIGS, *PLAIN)
    ]
    assert bare == []
