"""What happens to the rig: how it starts, and how speeds and rock change on the way."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.kinds import makes_of_kinds
from drillctrl.drilling.point import OperatingPoint
from drillctrl.simulation.past import Past

STARTS = ("steady", "rest", "stick")
# Dimensionless time for which a bit that starts from stick has stood still.
STOOD = 1.0


@makes_of_kinds
@dataclass(frozen=True)
class Change:
    """A step or ramp of what is imposed on the bit.

    Attributes
    ----------
    time : float
        When it begins.
    duration : float
        How long it takes; 0 is a step.
    omega0 : float, optional
        Rotary speed of the top end afterwards.
    penetration_rate : float, optional
        v0 of the top end afterwards, in the units of the starting point.
    psi : float, optional
        Rock strength afterwards, as the ψ of the starting point's rig in that rock. Both
        cutting force and torque change in proportion; the units stay the starting point's,
        and so does the wear flat.

    Raises
    ------
    InputError
        If a value is not finite or negative.
    """

    time: float
    duration: float = 0.0
    omega0: float | None = None
    penetration_rate: float | None = None
    psi: float | None = None

    def __post_init__(self) -> None:
        for name in ("time", "duration", "omega0", "penetration_rate", "psi"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, checked_number(name, value, 0.0, 1e9))


@makes_of_kinds
@dataclass(frozen=True)
class Scenario:
    """How the motion starts, and what changes.

    Attributes
    ----------
    start : {"steady", "rest", "stick"} or Past
        Steady drilling until t = 0; or a bit at rest that just touches flat rock, unloaded,
        whose top end sets off at t = 0; or a bit that has stood still for `STOOD` while the top
        end went on, and is let go at t = 0; or what another run left behind
        (`Simulation.past`).
    initial : mapping
        Perturbation by state name (x, dx, theta, dtheta of the bit) that is added at t = 0. Where
        the bit moves faster, by dx or dtheta, its string moves with it, as if the bit were led
        slowly, its top end unmoved: the bit alone has next to no inertia of a long string.
    changes : tuple of Change
        In order of time, none starting before the one before it is complete.
    kick : (float, float)
        By which shares of V0 and Ω0 the bit moves faster at t = 0, beside ``initial``.
    alone : bool
        Whether the states of ``initial`` are what moves, and no string with its bit.

    Raises
    ------
    InputError
        If a name is unknown, a value is not finite, or changes overlap.
    """

    start: str | Past = "steady"
    initial: Mapping[str, float] = field(default_factory=dict)
    changes: tuple[Change, ...] = ()
    kick: tuple[float, float] = (0.0, 0.0)
    alone: bool = False

    def __post_init__(self) -> None:
        for share in self.kick:
            checked_number("kick", share, -1e3, 1e3)
        if not isinstance(self.start, Past) and self.start not in STARTS:
            raise InputError("start", self.start, f"one of {', '.join(STARTS)}, or a Past")
        for name, value in self.initial.items():
            checked_number(f"initial {name}", value, -1e6, 1e6)
        changes = tuple(self.changes)
        for change in changes:
            if not isinstance(change, Change):
                raise InputError("changes", change, "each a Change")
        object.__setattr__(self, "changes", changes)
        for before, after in itertools.pairwise(changes):
            if after.time < before.time + before.duration:
                raise InputError("changes", after.time, "after the end of the change before")

    def perturbation(self, names: tuple[str, ...]) -> FloatArray:
        """Return what is added to the states of these names at t = 0, shape (n,).

        Raises
        ------
        InputError
            If another state is perturbed.
        """
        for name in self.initial:
            if name not in names:
                raise InputError("initial", name, f"one of {', '.join(names)}")
        return np.array([float(self.initial.get(name, 0.0)) for name in names])

    def drive(self, point: OperatingPoint) -> FloatArray:
        """Return the motion of the top end and the rock strength, piece by piece.

        Returns
        -------
        array, (m, 9)
            Start; offset, speed and acceleration of the top end beyond v0 t, then beyond
            ω0 t; strength relative to the point's, and its slope.
        """
        rows: list[list[float]] = []
        time, offsets = 0.0, np.zeros(2)
        now = np.array([point.penetration_rate, point.omega0, 1.0])
        usual = np.array([point.penetration_rate, point.omega0])

        def piece(start: float, end: float, target: FloatArray) -> None:
            nonlocal now, offsets, time
            span = end - start
            slope = (target - now) / span if span > 0.0 else np.zeros(3)
            if span > 0.0:
                beyond = now[:2] - usual
                axial = [offsets[0], beyond[0], slope[0]]
                torsional = [offsets[1], beyond[1], slope[1]]
                rows.append([start, *axial, *torsional, now[2], slope[2]])
                offsets = offsets + span * (beyond + 0.5 * span * slope[:2])
            now, time = target, end

        for change in self.changes:
            if change.psi is not None and point.psi == 0.0:
                raise InputError("psi", change.psi, "left out where the point's psi is 0")
            piece(time, change.time, now)
            target = now.copy()
            if change.penetration_rate is not None:
                target[0] = change.penetration_rate
            if change.omega0 is not None:
                target[1] = change.omega0
            if change.psi is not None:
                target[2] = change.psi / point.psi
            piece(time, time + change.duration, target)
        # The last piece has no end; its length does not enter its row.
        piece(time, time + 1.0, now)
        if self.changes and len(rows) == 1:
            # One piece alone is taken for a drive that nothing changes.
            rows.insert(0, [0.0] * 7 + [1.0, 0.0])
        return np.array(rows)
