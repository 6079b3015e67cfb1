"""A vibration map says of each point what runs from there say, however it was computed."""

from __future__ import annotations

import csv
import json
from math import pi

import numpy as np
import pytest

from drillctrl import (
    Checkpoint,
    Controller,
    InputError,
    OperatingPoint,
    RigPoint,
    dimensionless_grid,
    linear_axis,
    simulate,
    table,
    table1,
    vibration_map,
)
from drillctrl.cli import main
from drillctrl.simulation.scenario import Scenario

RIG = table1()
POINT = RigPoint(RIG, 120 * pi / 30, 20 / 3600)
X, Y = ("speed", 60.0, 180.0), ("rop", 10.0, 30.0)
QUICK = {"counts": (3, 3), "refine": 0, "starts": ("small", "back")}


@pytest.fixture(scope="module")
def found():
    return vibration_map(POINT, X, Y, Controller("pd", [-2.0, -1.0], limit=5.0), **QUICK)


def kicked(rpm, rop, feed, speed, controller):
    """Return swing and share of stick of one run, read off evenly spaced instants."""
    where = RigPoint(RIG, rpm * pi / 30, rop / 3600)
    point = where.operating_point()
    kick = {"dx": feed * point.delta0 * point.omega0, "dtheta": speed * point.omega0}
    run = simulate(where, controller, duration=200.0, scenario=Scenario("steady", kick), rtol=1e-6)
    times = np.linspace(150.0, 200.0, 40001)
    motion = run.at(times)
    bit = point.omega0 + motion.dtheta
    swing = (bit.max() - bit.min()) / (2.0 * bit.mean())
    return swing, float((np.abs(bit) < 1e-9).mean())


@pytest.mark.parametrize(("rpm", "rop"), [(60.0, 20.0), (120.0, 30.0), (180.0, 10.0)])
def test_a_point_is_judged_by_its_worst_start(found, rpm, rop):
    columns = found.columns()
    row = next(
        i for i, at in enumerate(zip(columns["speed"], columns["rop"], strict=True))
        if at == pytest.approx((rpm, rop))
    )  # fmt: skip
    for prefix, controller in (("uncontrolled_", None), ("", found.controller)):
        runs = [kicked(rpm, rop, *start, controller) for start in ((0.05, 0.1), (0.5, -0.5))]
        swing, stick = (max(values) for values in zip(*runs, strict=True))
        # Irregular motions differ in the long run by what they are rounded to at first.
        irregular = stick > 0.0
        near = {"rel": 0.15 if irregular else 2e-3, "abs": 1e-4}
        assert columns[f"{prefix}swing"][row] == pytest.approx(swing, **near)
        assert columns[f"{prefix}stick_fraction"][row] == pytest.approx(stick, abs=0.1)
        outcome = columns[f"{prefix}outcome"][row]
        assert (outcome in ("stick-slip", "does-not-keep-up")) == (stick > 0.0)


def test_smooth_drilling_begins_at_the_linear_boundary(found):
    free = found.uncontrolled
    assert {str(o) for o in free.outcomes[free.spectral_abscissa < 0.0]} == {"settles"}
    assert "settles" not in free.outcomes[free.spectral_abscissa > 0.0]
    (edge,) = free.boundary
    # One speed for all feeds, as the threshold of torsional damping has it.
    assert edge[:, 0].min() > 130.0
    assert edge[:, 0].max() < 150.0


@pytest.mark.long
def test_dense_where_the_outcome_changes_and_nowhere_else():
    coarse = {**QUICK, "starts": ("small",), "duration": 120.0}
    fine = vibration_map(POINT, ("speed", 110.0, 180.0), Y, **{**coarse, "refine": 2})
    word = dict(zip(fine.nodes, fine.uncontrolled.outcomes.tolist(), strict=True))
    assert 9 < len(word) < fine.shape[0] * fine.shape[1]
    for cell in fine.cells:
        assert cell.step == 1 or len({word[node] for node in cell.corners}) == 1
    assert min(cell.step for cell in fine.cells) == 1


def test_a_run_that_was_cut_short_goes_on(found, tmp_path):
    path = tmp_path / "map.checkpoint"
    quick = {**QUICK, "counts": (2, 2), "starts": ("small",), "duration": 60.0}
    with Checkpoint(path) as first:
        whole = vibration_map(POINT, X, Y, **quick, checkpoint=first)
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[:3]) + lines[3][:20])
    seen = []
    tell = lambda *told: seen.append(told)  # noqa: E731
    with Checkpoint(path) as second:
        again = vibration_map(POINT, X, Y, **quick, checkpoint=second, progress=tell)
    assert again.rows() == whole.rows()
    assert seen == [("simulate", 1, 2), ("simulate", 2, 2)]


@pytest.mark.long
def test_gains_of_a_table_are_those_of_each_point():
    grid = dimensionless_grid(linear_axis("omega0", 8, 12, 2), linear_axis("delta0", 1, 3, 2), 14.0)
    gains = table(grid, "p", trials=False)
    quick = {"counts": (2, 2), "refine": 0, "starts": ("small",), "duration": 40.0}
    axes = ("omega0", 8.0, 12.0), ("delta0", 1.0, 3.0)
    found = vibration_map(OperatingPoint(10, 2, 14), *axes, gains, **quick)
    np.testing.assert_allclose(
        found.controlled.spectral_abscissa, gains.spectral_abscissa, rtol=1e-6, atol=1e-7
    )
    corner = Controller("p", gains.gains_at(8.0, 1.0, 14.0)[0][0])
    one = vibration_map(OperatingPoint(10, 2, 14), *axes, corner, **quick)
    assert one.controlled.swing[0] == found.controlled.swing[0]
    assert found.unvouched() == int((~gains.sound).sum())
    beyond = vibration_map(
        OperatingPoint(10, 2, 14), ("omega0", 13.0, 14.0), axes[1], gains, **quick
    )
    assert beyond.unvouched() == 4


def test_files_and_pictures_hold_the_rows(found, tmp_path):
    found.save(tmp_path / "m.csv")
    found.save(tmp_path / "m.json")
    lines = (tmp_path / "m.csv").read_text().splitlines()
    rows = list(csv.DictReader(lines[1:]))
    whole = json.loads((tmp_path / "m.json").read_text())
    assert "rpm" in lines[0]
    assert [row["outcome"] for row in rows] == [row["outcome"] for row in whole["rows"]]
    assert float(rows[0]["speed"]) == 60.0
    assert whole["K1"] == [-2.0, -1.0]
    figure = found.plot(("swing", "feed"), "table1")
    free, controlled = (ax.collections[0].get_array() for ax in figure.axes[:2])
    at = [whole["rows"][k] for k in (0, 8)]
    for drawn, name in ((free, "uncontrolled_swing"), (controlled, "swing")):
        assert drawn.ravel()[[0, 8]].tolist() == pytest.approx([row[name] for row in at])
    titles = [ax.get_title() for ax in figure.axes[:2]]
    factor = RIG.torsional_stiffness / 1e3
    assert titles[0] == "without control"
    assert f"{-2.0 * factor:.3g} kN·m/rad" in titles[1]
    assert "table1, rock of 60 MPa" in figure.get_suptitle()
    mark = next(line for line in figure.axes[0].lines if line.get_marker() == "*")
    assert (mark.get_xdata()[0], mark.get_ydata()[0]) == pytest.approx((120.0, 20.0))
    assert max(len(line) for line in found.summary().splitlines()) <= 80
    with pytest.raises(InputError, match="path"):
        found.save(tmp_path / "m.xls")


@pytest.mark.long
def test_the_verb_prints_what_the_function_finds(capsys, tmp_path):
    out = tmp_path / "m.csv"
    with pytest.raises(SystemExit) as stop:
        main([
            "map", "--rig", "table1", "--x", "speed=100:160:2 rpm", "--y", "wob=10:30:2 kN",
            "--refine", "0", "--starts", "small", "--duration", "20 s", "--workers", "1",
            "--out", str(out), "--plot", str(tmp_path / "m.png"), "--json",
        ])  # fmt: skip
    assert stop.value.code == 0
    told = json.loads(capsys.readouterr().out)
    wanted = vibration_map(
        POINT, ("speed", 100.0, 160.0), ("wob", 10.0, 30.0), counts=(2, 2), refine=0,
        starts=("small",), duration=20.0 / RIG.time_scale,
    )  # fmt: skip
    assert [row["swing"] for row in told["rows"]] == wanted.columns()["swing"]
    assert told["marked"] is None
    assert told["axes"]["y"] == {"name": "wob", "low": 10.0, "high": 30.0, "unit": "kN"}
    assert {path.name for path in tmp_path.iterdir()} == {"m.csv", "m.png"}


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("--x", "speed=50:180 rpm"), "speed"),
        (("--x", "omega0=4:20:1"), "--x or --y"),
        (("--x", "omega0=4:20:a"), "--x"),
        (("--x", "omega0=0:20:3"), "x axis = omega0 from 0: must be from above 0"),
        (("--starts", "nudge"), "--starts"),
        (("--show", "torque"), "--show"),
        (("--out", "map.xls"), "--out"),
        (("--K1", "-2"), "--structure"),
        (("--refine", "9"), "--refine"),
        (("--rig", "table1", "--wob", "20 kN", "--y", "rock_strength=20:90 MPa"), "--wob"),
        (("--rig", "table1", "--structure", "p", "--K1", "-2"), "--K1"),
    ],
)
def test_bad_input_is_refused(capsys, arguments, named):
    with pytest.raises(SystemExit) as stop:
        main(["map", *arguments])
    error = capsys.readouterr().err
    assert stop.value.code == 2
    assert named in error
    assert error.count("\n") == 1


def test_a_grid_for_other_programs_holds_the_points(found, tmp_path):
    xarray = pytest.importorskip("xarray")
    found.save(tmp_path / "map.nc")
    with xarray.open_dataset(tmp_path / "map.nc", engine="scipy", mask_and_scale=False) as data:
        columns, words = found.columns(), data["outcome"].attrs["flag_meanings"].split()
        for i, (x, y) in enumerate(zip(columns["speed"], columns["rop"], strict=True)):
            here = data.sel(speed=x, rop=y, method="nearest")
            assert words[int(here["outcome"])] == columns["outcome"][i]
            swing = columns["uncontrolled_swing"][i]
            assert float(here["uncontrolled_swing"]) == pytest.approx(
                np.nan if swing is None else swing, nan_ok=True
            )
        assert data["rop"].attrs["units"] == "m/h"


def test_what_control_changes_is_drawn_beside(found):
    figure = found.plot(("outcome", "swing"), difference=True)
    panels = [ax for ax in figure.axes if ax.get_label() != "<colorbar>"]
    changed = [ax for ax in panels if ax.get_subplotspec().colspan.start == 2]
    assert changed[0].get_title() == "change from left to right"
    swing = changed[1].collections[0].get_array().filled(np.nan).T.ravel()
    columns = found.columns()
    order = np.lexsort((columns["rop"], columns["speed"]))
    known = [np.array(columns[n], dtype=float)[order] for n in ("swing", "uncontrolled_swing")]
    np.testing.assert_allclose(swing, known[0] - known[1])
    alone = vibration_map(POINT, X, Y, **{**QUICK, "counts": (2, 2), "starts": ("small",)})
    with pytest.raises(InputError, match="difference"):
        alone.plot(difference=True)
