"""Chaos is told where neighbours come apart, and nowhere else."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from drillctrl.cli import main
from drillctrl.drilling.point import OperatingPoint, RigPoint
from drillctrl.drilling.rig import table1
from drillctrl.simulation import outcome
from drillctrl.simulation.irregular import irregular
from drillctrl.simulation.outcome import figures
from drillctrl.simulation.run import simulate
from drillctrl.simulation.scenario import Change, Scenario
from drillctrl.simulation.summary import period


def at(rpm, rop):
    return RigPoint(table1(), rpm * 2.0 * math.pi / 60.0, rop / 3600.0).operating_point()


def lasting(rpm, rop, **options):
    point = at(rpm, rop)
    kick = {"dx": 0.05 * point.penetration_rate, "dtheta": 0.1 * point.omega0}
    return simulate(point, duration=400.0, initial=kick, **options)


@pytest.mark.long(but=1)
@pytest.mark.parametrize(("rpm", "name"), [(70.0, "stick-slip"), (90.0, "bounces")])
def test_chaos_is_told(rpm, name):
    """There the tolerance decides where the bit is in the end, and not elsewhere."""
    run = lasting(rpm, 20.0)
    assert figures(run).outcome == name
    assert irregular(run)
    ends = [lasting(rpm, 20.0, rtol=rtol).at([390.0]).dtheta[0] for rtol in (1e-9, 1e-11)]
    assert abs(ends[1] - ends[0]) > 1e-2


def test_an_orbit_that_closes_is_none():
    run = simulate(
        OperatingPoint(10.0, 2.5, 14.0), duration=200.0, initial={"dx": 1.0, "dtheta": 1.0}
    )
    assert run.summary.period is not None
    assert not irregular(run)


@pytest.mark.parametrize("rpm", [70.0, 90.0])
def test_a_slow_orbit_that_has_not_closed_yet_is_none(rpm):
    run = lasting(rpm, 10.0)
    assert period(run, 300.0) is None
    assert figures(run).outcome == "orbit"
    assert not irregular(run)


def test_a_motion_that_grows_from_rest_is_none():
    """Its neighbours come apart as it grows; that is no chaos."""
    run = simulate(OperatingPoint(10.0, 2.2, 14.0), duration=150.0, initial={"dtheta": 1e-6})
    grown = [np.ptp(run.at(np.linspace(a, a + 30.0, 400)).dtheta) for a in (80.0, 115.0)]
    assert grown[1] > 1.8 * grown[0]
    assert not irregular(run)


def test_what_cannot_be_told_is_not_said():
    point = at(70.0, 20.0)
    changed = Scenario(
        initial={"dx": 0.05, "dtheta": 0.2}, changes=(Change(5.0, omega0=1.1 * point.omega0),)
    )
    assert not irregular(simulate(point, duration=100.0, scenario=changed))
    assert not irregular(simulate(point, duration=50.0, initial={"dx": 0.1}, max_steps=50))


def test_an_orbit_is_named_by_it_and_worse_motions_are_not(monkeypatch):
    run = lasting(70.0, 10.0)
    assert figures(run).outcome == "orbit"
    monkeypatch.setattr(outcome, "irregular", lambda run: True)
    found = figures(run).outcome
    assert found == "chaotic"
    assert found.calm
    assert figures(lasting(90.0, 20.0)).outcome == "bounces"


def test_text_and_json_say_the_same(capsys):
    words = ["simulate", "--rig", "table1", "--speed", "70 rpm", "--rop", "20 m/h"]
    words += ["--start", "small", "--duration", "400"]
    told = []
    for more in ([], ["--json"]):
        with pytest.raises(SystemExit) as ended:
            main([*words, *more])
        assert not ended.value.code
        told.append(capsys.readouterr().out)
    text, fields = told[0], json.loads(told[1])
    assert fields["outcome"] == "stick-slip"
    assert fields["irregular"] is True
    assert "the bit sticks and slips, irregularly" in text
