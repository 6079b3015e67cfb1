"""Outcomes and basins over a plane, whoever computes them and however often it is begun."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

from drillctrl import dimensionless_grid, linear_axis, table
from drillctrl.base.checkpoint import Checkpoint
from drillctrl.base.errors import InputError
from drillctrl.delay.closing import close_loop
from drillctrl.drilling.case import plant_system
from drillctrl.drilling.point import OperatingPoint
from drillctrl.drilling.structures import preset_structure
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.run import simulate
from drillctrl.spectrum.roots import spectral_abscissa
from drillctrl.studies.campaign import campaign

GRID = dimensionless_grid(linear_axis("omega0", 8, 14, 3), linear_axis("delta0", 1, 8, 3), 14.0)
CONTROLLER = Controller("case1", [-3.82], [3.61])
QUICK = {"sizes": (0.01, 1.0), "largest": 4.0, "sharpness": 2.0}


@pytest.fixture(scope="module")
def found():
    return campaign(GRID, CONTROLLER, **QUICK)


def test_settles_where_the_linear_loop_is_stable(found):
    feedback = preset_structure("case1")
    for i, point in enumerate(GRID.points):
        alpha = spectral_abscissa(close_loop(plant_system(point), feedback, [-3.82], [3.61]))
        assert found.spectral_abscissa[i] == pytest.approx(alpha, abs=1e-9)
        assert abs(alpha) > 0.02
        assert (found.outcomes[i, 0] == "settled") == (alpha < 0.0)
        assert np.isnan(found.settling_times[i, 0]) == (alpha >= 0.0)
    counts = found.settled_counts()[0]
    assert counts["stable"] == counts["stable_settled"] > 0
    assert counts["unstable"] > counts["unstable_settled"] == 0


def test_the_edge_of_the_basin_is_an_edge():
    # A narrow torque limit: large motion is beyond what the controller can hold.
    grid = dimensionless_grid(10.0, 2.5, 14.0)
    limited = Controller("case1", [-3.82], [3.61], limit=0.5)
    result = campaign(grid, limited, sizes=(0.01,), largest=20.0, sharpness=1.05, duration=80.0)
    low, high = result.basin[0]
    assert 0.01 < low < high <= 1.05 * low
    for size, settles in ((0.98 * low, True), (1.02 * high, False)):
        start = {"dx": size, "dtheta": size}
        run = simulate(OperatingPoint(10.0, 2.5, 14.0), limited, duration=80.0, initial=start)
        assert run.summary.settled == settles


@pytest.mark.long
def test_a_run_that_was_cut_short_goes_on(found, tmp_path):
    path = tmp_path / "campaign.checkpoint"
    with Checkpoint(path) as first:
        campaign(GRID, CONTROLLER, **QUICK, checkpoint=first)
    lines = path.read_bytes().splitlines(keepends=True)
    # The header and six of nine points.
    path.write_bytes(b"".join(lines[:7]) + lines[7][:20])
    seen = []
    with Checkpoint(path) as second:
        tell = lambda *told: seen.append(told)  # noqa: E731
        again = campaign(GRID, CONTROLLER, **QUICK, checkpoint=second, progress=tell)
    assert again.rows() == found.rows()
    assert seen == [("simulate", k, 3) for k in (1, 2, 3)]
    changed = Controller("case1", [-3.82], [3.61], limit=3.0)
    with Checkpoint(path) as third:
        del seen[:]
        campaign(GRID, changed, **QUICK, checkpoint=third, progress=tell)
    assert len(seen) == 9


def test_the_order_of_points_changes_nothing(found):
    class Backwards:
        def submit(self, work, *arguments):
            from concurrent.futures import Future

            future = Future()
            future.set_result(list(reversed(work(*arguments))))
            return future

    assert campaign(GRID, CONTROLLER, **QUICK, executor=Backwards()).rows() == found.rows()


def test_gains_of_a_table_are_those_of_each_point():
    grid = dimensionless_grid(linear_axis("omega0", 8, 14, 2), linear_axis("delta0", 2, 6, 2), 14.0)
    gains = table(grid, "case1", trials=False)
    result = campaign(grid, gains, sizes=(0.01,), sharpness=np.inf)
    np.testing.assert_allclose(result.spectral_abscissa, gains.spectral_abscissa, atol=1e-7)
    assert (result.outcomes == "settled").all()


def test_without_control_the_orbit_is_named():
    result = campaign(dimensionless_grid(10.0, 2.5, 14.0), sizes=(0.5,), duration=200.0)
    assert result.outcomes.tolist() == [["orbit"]]
    assert np.isnan(result.basin).all()


def test_files_hold_the_rows(found, tmp_path):
    found.save(tmp_path / "c.csv")
    found.save(tmp_path / "c.json")
    lines = (tmp_path / "c.csv").read_text().splitlines()
    assert lines[0].startswith("#")
    rows = list(csv.DictReader(lines[1:]))
    whole = json.loads((tmp_path / "c.json").read_text())
    assert len(rows) == len(whole["rows"]) == 9
    assert [float(r["spectral_abscissa"]) for r in rows] == found.spectral_abscissa.tolist()
    assert [r["outcome_1"] for r in whole["rows"]] == found.outcomes[:, 1].tolist()
    with pytest.raises(InputError, match="path"):
        found.save(tmp_path / "c.xls")
    figure = found.plot()
    assert [ax.get_title() for ax in figure.axes[:3]] == ["size 0.01", "size 1", "basin"]
    assert "settles at" in found.summary()


@pytest.mark.parametrize(
    "wrong",
    [
        {"sizes": ()},
        {"sizes": (1.0, 0.5)},
        {"sizes": (0.0, 0.5)},
        {"largest": 0.1},
        {"sharpness": 0.5},
        {"duration": 0.0},
        {"disturbance": {"speed": 1.0}},
        {"disturbance": {"dx": 0.0}},
        {"disturbance": {"dtheta": -3.0}},
        {"disturbance": {"dtheta": float("nan")}},
    ],
    ids=str,
)
def test_bad_input_is_refused(wrong):
    with pytest.raises(InputError) as caught:
        campaign(GRID, CONTROLLER, **wrong)
    assert "\n" not in str(caught.value)
