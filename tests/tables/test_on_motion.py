"""Tables on the motion that is drilled with: nodes, cells and files."""

import math

import numpy as np
import pytest

from drillctrl import (
    Axis,
    Controller,
    Drilling,
    InputError,
    dimensionless_grid,
    load_table,
    rig_grid,
    save_table,
    simulate,
    table,
    table1,
)
from drillctrl.designs.trials import STARTS, trial_run
from drillctrl.simulation.scenario import Scenario
from drillctrl.simulation.status import Status
from drillctrl.tables.cells import CellTask
from drillctrl.tables.crossings import crosses
from drillctrl.tables.export_c import export_c
from drillctrl.tables.scheduling import scheduled

QUICK = Drilling(kick=0.03)


@pytest.fixture(scope="module")
def made():
    """60 rpm, where nothing helps, and 110 and 120 rpm, where swings decay; 50 m/h."""
    grid = rig_grid(
        table1(),
        Axis("rotary_speed", tuple(np.array([60.0, 110.0, 120.0]) * math.pi / 30.0)),
        penetration_rate=50.0 / 3600.0,
    )
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("drillctrl.designs.motion_design.SHARES", (0.125,))
        return table(grid, "pd", objective=QUICK, surroundings={"limit": 1.0})


@pytest.mark.long
def test_nodes_are_vouched_for_by_runs(made):
    assert made.on_motion
    assert not made.stable.any()
    assert made.sound.tolist() == [False, True, True]
    assert set(made.refusals) == {0}
    assert not made.gains[0].any()
    assert (made.gains[1:, 1] < -0.1).all()
    text = made.summary()
    assert "2 unstable in smooth drilling, recommended" in text
    assert "1 not recommended by trial runs" in text
    assert "1 of 2 pass trial runs" in text


@pytest.mark.long
def test_gains_between_nodes_do_no_harm(made):
    middle = made.grid.case(115.0 * math.pi / 30.0, 50.0 / 3600.0, 60e6)
    _, point = middle.physics("a test")
    where = point.omega0, point.delta0, point.psi
    assert made.stable_at(*where).tolist() == [True]
    controller = scheduled(made, point, Scenario(), limit=1.0)
    for start in STARTS:
        mine, free = trial_run(middle, controller, start), trial_run(middle, None, start)
        assert mine.swing <= free.swing + 0.02


@pytest.mark.long
def test_gains_follow_the_point_across_a_cell(made):
    """From 110 to 120 rpm and back they do no harm; with their sign turned they do."""

    def task(gains):
        return CellTask(made.grid, made.structure, gains, made.sound, np.array([1]), {"limit": 1.0})

    assert crosses(task(made.gains), 1)
    assert not crosses(task(-2.0 * made.gains), 1)


@pytest.mark.long
def test_a_file_keeps_what_was_found(made, tmp_path):
    path = tmp_path / "gains.json"
    save_table(made, path)
    again = load_table(path)
    assert again.on_motion
    assert again.sound.tolist() == made.sound.tolist()
    assert again.refusals == made.refusals
    assert "Drilling(" in path.read_text()


def test_trials_are_needed():
    grid = rig_grid(table1(), 12.0, penetration_rate=0.01)
    with pytest.raises(InputError, match="trials"):
        table(grid, "pd", objective=QUICK, trials=False)
    with pytest.raises(InputError, match="limit"):
        table(grid, "pd", objective=QUICK, surroundings={"limit": -1.0})


def test_gains_that_turn_a_bit_back_from_rest_are_to_be_switched_on_later(tmp_path):
    grid = dimensionless_grid(Axis("omega0", (10.0,)), Axis("delta0", (1.75,)), 14.0)
    made = table(grid, "case2")
    assert set(made.cautions) == {0}
    assert "from rest" in made.cautions[0]
    controller = Controller("case2", *made.structure.gains(made.gains[0]))
    ends = [
        simulate(grid.points[0], c, duration=60.0, scenario=Scenario("rest"), backwards="stop")
        for c in (controller, None)
    ]
    assert ends[0].status == Status.REVERSED
    assert ends[1].status == Status.DONE
    # That is no reason to refuse them: a bit that turns they bring to rest.
    assert made.sound.tolist() == [True]
    assert "1 to be switched on once the bit turns" in made.summary()
    save_table(made, tmp_path / "t.csv")
    assert load_table(tmp_path / "t.csv").cautions == made.cautions
    header, _ = export_c(made, tmp_path, period=0.01, limit=5.0)
    words = header.read_text().replace("*", " ").split()
    assert "switch on once the bit turns" in " ".join(words)
