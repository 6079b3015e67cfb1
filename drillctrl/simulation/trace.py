"""A motion as the integrator left it: steps, dense output, events."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.drilling.point import OperatingPoint
from drillctrl.simulation.compile import kernel

Places = npt.NDArray[np.int64]
MOTION_COLUMNS = (
    "x",
    "dx",
    "theta",
    "dtheta",
    "ddx",
    "ddtheta",
    "delay",
    "depth",
    "pressed",
    "weight_on_bit",
    "torque_on_bit",
    "axial",
    "torque",
    "contact",
)


class Event(NamedTuple):
    """A change of mode.

    Attributes
    ----------
    time : float
        When.
    name : str
        ``"stick"``, ``"release"``, ``"reverse"`` (torsion); ``"hold"``, ``"advance"``,
        ``"lift"`` (Z' becomes 0, positive, negative in contact); ``"loss"``, ``"return"``
        (of contact); ``"saturate"``, ``"desaturate"`` (an input meets or leaves its limit, or
        an actuator its limit of rate; a sampled controller has no such instants).
    """

    time: float
    name: str


@dataclass(frozen=True, eq=False)
class Motion:
    """The motion at some instants; every array has the shape of ``times``.

    Attributes
    ----------
    times : array
        Dimensionless time.
    x, dx, theta, dtheta : array
        Perturbations of steady drilling at the starting point.
    ddx, ddtheta : array
        Accelerations.
    delay : array
        τ, the time since the blade ahead passed.
    depth : array
        d, total depth of cut; negative is clearance after a loss of contact.
    pressed : array
        Share of the wear-flat force that acts, 0 to 1.
    weight_on_bit, torque_on_bit : array
        What the rock bears; see `Simulation.steady_load` for the steady part.
    axial, torque : array
        Inputs from the controller, after its actuator.
    contact, stuck, held : bool array
        Bit in the rock; in torsional stick; held at Z' = 0 by the wear flat.
    """

    times: FloatArray
    x: FloatArray
    dx: FloatArray
    theta: FloatArray
    dtheta: FloatArray
    ddx: FloatArray
    ddtheta: FloatArray
    delay: FloatArray
    depth: FloatArray
    pressed: FloatArray
    weight_on_bit: FloatArray
    torque_on_bit: FloatArray
    axial: FloatArray
    torque: FloatArray
    contact: npt.NDArray[np.bool_]
    stuck: npt.NDArray[np.bool_]
    held: npt.NDArray[np.bool_]

    def columns(self) -> dict[str, npt.NDArray[Any]]:
        """Return the arrays by name, times first: the columns of a table."""
        return dict(vars(self))


@dataclass(frozen=True, eq=False, kw_only=True)
class Trace:
    """A motion that was integrated.

    Attributes
    ----------
    point : OperatingPoint
        The starting point; the motion is a perturbation of its steady drilling.
    model, cutting : str
        As given to `simulate`.
    duration : float
        As asked for; ``times[-1]`` is what was reached.
    status : str
        ``"done"``, or why it went no further: ``"step collapse"``, ``"reverse rotation"``,
        ``"step limit"``, ``"face too old"``, ``"not finite"``.
    elapsed_seconds : float
        Wall time of the integration.
    settings : mapping
        What the kernel was told, by name.
    history : mapping
        Columns of the steps as the kernel keeps them, by kind (``"real"``, ``"whole"``).
    first : int
        Place of the first step after t = 0 in it.
    """

    point: OperatingPoint
    model: str
    cutting: str
    duration: float
    status: str
    elapsed_seconds: float
    settings: Mapping[str, Any] = field(repr=False)
    history: Mapping[str, Any] = field(repr=False)
    first: int = field(default=1, repr=False)

    @functools.cached_property
    def _compiled(self) -> tuple[Any, Any]:
        # Plain mappings are kept, so that a run pickles without its generated classes.
        data = kernel("data")
        return data.Settings(**self.settings), data.History(**self.history)

    def __getstate__(self) -> dict[str, Any]:
        return {k: v for k, v in vars(self).items() if k != "_compiled"}

    def _column(self, name: str) -> npt.NDArray[Any]:
        """A column of the steps from t = 0 on and the one before, by its name in the kernel."""
        data = kernel("data")
        real = name in ("START", "LENGTH")
        column: npt.NDArray[Any] = self.history["real" if real else "whole"][
            self.first - 1 :, getattr(data, name)
        ]
        return column

    @property
    def steps(self) -> int:
        """Number of accepted steps."""
        return int(self.history["real"].shape[0]) - self.first

    @functools.cached_property
    def times(self) -> FloatArray:
        """Ends of the integrator's own steps, from 0 on, shape (steps + 1,)."""
        start, length = self._column("START"), self._column("LENGTH")
        end = start[-1] + length[-1] if self.steps else 0.0
        return np.append(start[1:], end)

    @functools.cached_property
    def motion(self) -> Motion:
        """The motion at `times`."""
        return self.at(self.times)

    def at(self, times: npt.ArrayLike) -> Motion:
        """Return the motion at any instants of the run, by the dense output of the steps.

        Parameters
        ----------
        times : array_like
            Within [0, ``times[-1]``]. Where a quantity jumps, its value after the jump.

        Raises
        ------
        InputError
            If an instant is outside the run.
        """
        when = np.atleast_1d(np.asarray(times, dtype=float))
        if when.size and not (when.min() >= 0.0 and when.max() <= self.times[-1]):
            raise InputError("times", f"{when.min():g} to {when.max():g}", self._span())
        places = np.searchsorted(self._column("START"), when, side="right") - 1
        return self._evaluate(np.clip(places, 0 if self.steps == 0 else 1, self.steps), when)

    def _span(self) -> str:
        return f"within [0, {self.times[-1]:g}]"

    def on_steps(self, per_step: int, since: float = 0.0) -> Motion:
        """Return the motion at equally spaced places of every step, ends included.

        At a jump both sides are there: the end of one step and the start of the next.
        """
        start, length = self._column("START"), self._column("LENGTH")
        first = max(1, int(np.searchsorted(start, since, side="right")) - 1)
        s = np.linspace(0.0, 1.0, per_step)
        grid = start[first:, None] + length[first:, None] * s
        index = np.broadcast_to(np.arange(first, start.size)[:, None], grid.shape)
        keep = grid.ravel() >= since
        return self._evaluate(index.ravel()[keep], grid.ravel()[keep])

    def _evaluate(self, places: Places, times: FloatArray) -> Motion:
        data = kernel("data")
        settings, history = self._compiled
        places = np.ascontiguousarray(places, dtype=np.int64)
        taken, before = history.real.shape[0], self.first - 1
        rows = kernel("sample").evaluate(settings, history, taken, places + before, times)
        stuck = self._column("TORSION")[places] == data.STUCK
        held = self._column("AXIAL")[places] == data.HELD
        nonlinear = self.model == "nonlinear"
        values = dict(zip(MOTION_COLUMNS, np.ascontiguousarray(rows.T), strict=True))
        on_rock = values.pop("contact") > 0.0
        modes = {"contact": on_rock, "stuck": stuck & nonlinear, "held": held & nonlinear}
        return Motion(times=times, **values, **modes)

    @functools.cached_property
    def steady_load(self) -> tuple[float, float]:
        """Weight and torque on bit of steady drilling at the starting point."""
        load = kernel("physics").load
        cut = 2.0 * np.pi * self.point.delta0
        weight, torque = load((cut, 1.0, 1.0), self.settings["p"])
        return float(weight), float(torque)

    @functools.cached_property
    def events(self) -> tuple[Event, ...]:
        """Changes of mode in order of time."""
        data = kernel("data")
        torsion = {data.STUCK: "stick", data.FORWARD: "release", data.REVERSE: "reverse"}
        axial = {data.HELD: "hold", data.DOWN: "advance", data.UP: "lift"}
        contact = {0: "loss", 1: "return"}
        found = []
        start, on_rock = self._column("START"), self._column("CONTACT")
        saturated = self._column("SATURATED")
        columns = {name: self._column(name.upper()) for name in ("contact", "torsion", "axial")}
        changed = np.zeros(self.steps + 1, dtype=bool)
        changed[2:] = saturated[2:] != saturated[1:-1]
        for column in columns.values():
            changed[2:] |= column[2:] != column[1:-1]
        for j in np.flatnonzero(changed):
            time = float(start[j])
            for name, names in (("contact", contact), ("torsion", torsion), ("axial", axial)):
                now, before = int(columns[name][j]), int(columns[name][j - 1])
                # Off the rock there is no wear flat that could hold the bit.
                meaningless = name == "axial" and not (on_rock[j] and on_rock[j - 1])
                if now != before and not meaningless:
                    found.append(Event(time, names[now]))
            before, now = int(saturated[j - 1]), int(saturated[j])
            if now & ~before:
                found.append(Event(time, "saturate"))
            if before & ~now:
                found.append(Event(time, "desaturate"))
        return tuple(found)

    def phases(self, name: str) -> tuple[tuple[float, float], ...]:
        """Return the intervals of time spent in a mode, for shading.

        Parameters
        ----------
        name : {"stuck", "held", "lost", "saturated"}
            Torsional stick, axial hold, loss of contact, an input or actuator at its limit.
        """
        modes = {
            "stuck": self._column("TORSION") == kernel("data").STUCK,
            "held": self._column("AXIAL") == kernel("data").HELD,
            "lost": self._column("CONTACT") == 0,
            "saturated": self._column("SATURATED") != 0,
        }
        if name not in modes:
            raise InputError("phase", name, f"one of {', '.join(modes)}")
        inside = np.concatenate([[False], modes[name][1:], [False]])
        edges = np.flatnonzero(inside[1:] != inside[:-1])
        return tuple(
            (float(self.times[a]), float(self.times[b]))
            for a, b in zip(edges[::2], edges[1::2], strict=True)
        )
