"""A table's gains over the course of a simulated scenario."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.drilling.case import Case
from drillctrl.drilling.point import OperatingPoint
from drillctrl.simulation.controller import Controller, ScheduleEntry
from drillctrl.simulation.scenario import Scenario
from drillctrl.tables.gain_table import GainTable
from drillctrl.tables.interpolation import BoolArray
from drillctrl.tables.settings import OUTSIDE

CLAMP = "clamp"


def course(point: OperatingPoint, scenario: Scenario, times: FloatArray) -> FloatArray:
    """Return ω0, δ0 and ψ as the top end and the rock impose them, (q, 3)."""
    knots: list[tuple[float, ...]] = [(0.0, point.omega0, point.penetration_rate, point.psi)]
    for change in scenario.changes:
        before = knots[-1][1:]
        after = tuple(
            old if new is None else new
            for old, new in zip(
                before, (change.omega0, change.penetration_rate, change.psi), strict=True
            )
        )
        # A step is a ramp too short to notice.
        end = change.time + max(change.duration, 1e-9)
        knots += [(change.time, *before), (end, *after)]
    table = np.array(knots)
    omega0, rate, psi = (np.interp(times, table[:, 0], table[:, i]) for i in (1, 2, 3))
    return np.column_stack([omega0, rate / omega0, psi])


@checks_kinds
def scheduled(
    table: GainTable,
    point: OperatingPoint,
    scenario: Scenario,
    *,
    interval: float = 0.5,
    late: float = 0.0,
    duration: float = 1e4,
    outside: str = "clamp",
    fade: int | None = None,
    **options: float | str | None,
) -> Controller:
    """Return a controller whose gains and delay follow a table through a scenario.

    The delayed outputs are those of τ0 ago at the rotary speed of each look-up, as in the
    exported controllers; with ``delay="current"`` those of the present delay τ(t) ago.

    Parameters
    ----------
    table : GainTable
        Looked up at the operating point that the top end and the rock impose.
    point : OperatingPoint
        Where the scenario starts.
    scenario : Scenario
        With its changes.
    interval : float
        How often gains are looked up while something changes.
    late : float
        By how much the controller learns of a change too late.
    duration : float
        Changes after this are left out.
    outside : {"clamp", "fade", "hold"}
        Where the table does not vouch, its gains there, clamped at its edges, are used all the
        same ("clamp"), or, as in the exported controllers, the last gains that it vouched for
        fade to zero or stay.
    fade : int, optional
        Samples of a fade (without ``period``: sixteenths of the longest delay); by default those
        of the longest delay.
    **options
        Of `Controller`: activation, period, limit and the rest.

    Returns
    -------
    Controller
        With the gains of the start and a schedule of later gains and delays.

    Raises
    ------
    InputError
        If a number is out of range.
    """
    spacing = checked_number("interval", interval, 0.0, 1e6, open_low=True)
    lateness = checked_number("late", late, 0.0, 1e6)
    times: list[float] = []
    for change in scenario.changes:
        end = change.time + change.duration
        count = max(1, int(np.ceil(change.duration / spacing)))
        times += [t for t in np.linspace(change.time, end, count + 1)[1:] if t <= duration]
        if change.duration == 0.0:
            # Looked up just behind the step.
            times[-1:] = [change.time]
    instants = np.array([0.0, *times])
    places = course(point, scenario, instants + 2e-9)
    third = table.grid.names[2]
    if third != "psi":
        # Nothing in a scenario changes the plant.
        places[:, 2] = table.grid.place_of(Case(table.grid.plant, point))[2]
    K1, K2 = table.gains_at(*places.T)
    vouched = table.stable_at(*places.T)
    fixed = options.get("delay", "fixed") == "fixed"
    longest = max(node.delay for node in table.grid.points)
    tick = float(options.get("period") or longest / 16)
    count = int(longest / tick) if fade is None else checked_integer("fade", fade, 0, 10**6)
    if outside not in (CLAMP, *OUTSIDE):
        raise InputError("outside", outside, f"one of {', '.join((CLAMP, *OUTSIDE))}")
    if outside == CLAMP:
        vouched = np.ones(len(places), dtype=bool)
    if outside == "fade":
        start = float(options.get("activation", 0.0) or 0.0)
        shares = _trust(vouched, instants + lateness * (instants > 0.0), start, tick, max(count, 1))
    else:
        shares = [(float(t), i, 1.0) for i, t in enumerate(instants + lateness * (instants > 0.0))]
    # The last place that the table vouched for; none before the first.
    last = np.maximum.accumulate(np.where(vouched, np.arange(len(vouched)), -1))
    entries = [
        ScheduleEntry(
            time,
            share * K1[max(last[i], 0)] * (last[i] >= 0),
            share * K2[max(last[i], 0)] * (last[i] >= 0),
            replace(point, omega0=float(places[i, 0])).delay if fixed else None,
        )
        for time, i, share in shares
    ]
    return Controller(
        table.structure,
        entries[0].K1,
        entries[0].K2,
        schedule=tuple(entries[1:]),
        plant=table.grid.plant,
        **options,  # type: ignore[arg-type]
    )


def _trust(
    vouched: BoolArray, times: FloatArray, start: float, tick: float, count: int
) -> list[tuple[float, int, float]]:
    """Return from when what share of the gains of which look-up is commanded.

    The share goes up or down by 1/count a sample, and stands where it is to go before the
    controller is switched on.
    """
    found: list[tuple[float, int, float]] = []
    trust = count if vouched[0] else 0
    for i, time in enumerate(times.tolist()):
        goal = count if vouched[i] else 0
        if time <= start:
            trust = goal
        sample = math.ceil((time - start) / tick - 1e-9)
        end = math.inf if i + 1 == len(times) else (float(times[i + 1]) - start) / tick - 1e-9
        if trust == goal:
            found.append((time, i, trust / count))
        while trust != goal and sample < end:
            trust += 1 if goal else -1
            found.append((start + sample * tick, i, trust / count))
            sample += 1
    return found
