"""A table's gains over the course of a simulated scenario."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import checked_number
from drillctrl.drilling.point import OperatingPoint
from drillctrl.simulation.controller import Controller, ScheduleEntry
from drillctrl.simulation.scenario import Scenario
from drillctrl.tables.gain_table import GainTable


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


def scheduled(
    table: GainTable,
    point: OperatingPoint,
    scenario: Scenario,
    *,
    interval: float = 0.5,
    late: float = 0.0,
    duration: float = 1e4,
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
        places[:, 2] = table.grid.plant.own[third]
    K1, K2 = table.gains_at(*places.T)
    fixed = options.get("delay", "fixed") == "fixed"
    entries = tuple(
        ScheduleEntry(
            float(t) + lateness,
            K1[i],
            K2[i],
            replace(point, omega0=float(places[i, 0])).delay if fixed else None,
        )
        for i, t in enumerate(times, 1)
    )
    return Controller(
        table.structure,
        K1[0],
        K2[0],
        schedule=entries,
        plant=table.grid.plant,
        **options,  # type: ignore[arg-type]
    )
