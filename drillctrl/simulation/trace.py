"""A motion as the integrator left it: steps, dense output, events."""

from __future__ import annotations

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.drilling.case import Case
from drillctrl.drilling.point import OperatingPoint
from drillctrl.simulation.compile import kernel
from drillctrl.simulation.kernel import data
from drillctrl.simulation.status import Status
from drillctrl.simulation.structure import Structure

Places = npt.NDArray[np.int64]
# Instants times states that are evaluated at once: about half a second's work.
_AT_ONCE = 2_000_000


class Event(NamedTuple):
    """A change of mode.

    Attributes
    ----------
    time : float
        When.
    name : str
        ``"stick"``, ``"release"``, ``"reverse"`` (torsion); ``"resume"`` (the bit is back where
        it turned back); ``"hold"``, ``"advance"``,
        ``"lift"`` (Z' becomes 0, positive, negative in contact); ``"ride"`` (on a face that falls
        away, pressed on it by less than all of the wear-flat force); ``"loss"``, ``"return"``
        (of contact); ``"saturate"``, ``"desaturate"`` (an input meets or leaves its limit, or
        an actuator its limit of rate; a sampled controller has no such instants).
    """

    time: float
    name: str


@dataclass(frozen=True, eq=False)
class Motion:
    """The motion at some instants; every column is an array, and an attribute, of one length.

    Attributes
    ----------
    times : array
        Dimensionless time.
    x, dx, theta, dtheta : array
        Of the bit, as perturbations of steady drilling at the starting point; further states
        of the plant by their names.
    ddx, ddtheta : array
        Accelerations of the bit.
    delay : array
        τ, the time since the blade ahead passed.
    depth : array
        d, total depth of cut; negative is clearance after a loss of contact.
    pressed : array
        Share of the wear-flat force that acts, 0 to 1.
    weight_on_bit, torque_on_bit : array
        What the rock bears; see `Simulation.steady_load` for the steady part.
    axial, torque : array
        Inputs from the controller, after its actuator; those of the plant by their names.
    contact, stuck, held : bool array
        Bit in the rock; in torsional stick; held at Z' = 0 by the wear flat.
    """

    _values: Mapping[str, npt.NDArray[Any]]

    def __getattr__(self, name: str) -> npt.NDArray[Any]:
        if name.startswith("_") or name not in self._values:
            raise AttributeError(name)
        return self._values[name]

    def columns(self) -> dict[str, npt.NDArray[Any]]:
        """Return the arrays by name, times first: the columns of a table."""
        return dict(self._values)


@dataclass(frozen=True, eq=False, kw_only=True)
class Trace:
    """A motion that was integrated.

    Attributes
    ----------
    case : Case
        What drills, and where; the motion is a perturbation of its steady drilling.
    model, cutting : str
        As given to `simulate`.
    duration : float
        As asked for; ``times[-1]`` is what was reached.
    status : Status
        Whether it is done, or why it went no further.
    elapsed_seconds : float
        Wall time of the integration.
    structure : Structure
        The string and the law of its bit.
    settings : Settings
        What the kernel was told.
    history : History
        The steps as the kernel keeps them.
    first : int
        Place of the first step after t = 0 in it.
    """

    case: Case
    model: str
    cutting: str
    duration: float
    status: Status
    elapsed_seconds: float
    structure: Structure = field(repr=False)
    settings: data.Settings = field(repr=False)
    history: data.History = field(repr=False)
    first: int = field(default=1, repr=False)

    @property
    def point(self) -> OperatingPoint:
        """The starting point."""
        return self.case.physics("a motion")[1]

    @functools.cached_property
    def column_names(self) -> tuple[str, ...]:
        """Names of all columns that `at` and `on_steps` can return."""
        string = self.structure
        return data.sample_columns(string.state_names, string.input_names, string.output_names)

    @property
    def state_names(self) -> tuple[str, ...]:
        """Names of the states, those of the bit first."""
        return self.structure.state_names

    @property
    def input_names(self) -> tuple[str, ...]:
        """Names of the inputs."""
        return self.structure.input_names

    def _column(self, name: str) -> npt.NDArray[Any]:
        """A column of the steps from t = 0 on and the one before, by its name in the kernel."""
        real = name in ("START", "LENGTH")
        table = self.history.real if real else self.history.whole
        column: npt.NDArray[Any] = table[self.first - 1 :, getattr(data, name)]
        return column

    @property
    def steps(self) -> int:
        """Number of accepted steps."""
        return int(self.history.real.shape[0]) - self.first

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

    def at(self, times: npt.ArrayLike, names: Sequence[str] | None = None) -> Motion:
        """Return the motion at any instants of the run, by the dense output of the steps.

        Parameters
        ----------
        times : array_like
            Within [0, ``times[-1]``]. Where a quantity jumps, its value after the jump.
        names : sequence of str, optional
            Columns, by default those of `Motion`; also the rate of any state (``d`` and its
            name) and any output.

        Raises
        ------
        InputError
            If an instant is outside the run, or a name unknown.
        """
        when = np.atleast_1d(np.asarray(times, dtype=float))
        if when.size and not (when.min() >= 0.0 and when.max() <= self.times[-1]):
            raise InputError("times", f"{when.min():g} to {when.max():g}", self._span())
        places = np.searchsorted(self._column("START"), when, side="right") - 1
        places = np.clip(places, 0 if self.steps == 0 else 1, self.steps)
        return self._evaluate(places, when, names)

    def _span(self) -> str:
        return f"within [0, {self.times[-1]:g}]"

    def on_steps(
        self, per_step: int, since: float = 0.0, names: Sequence[str] | None = None
    ) -> Motion:
        """Return the motion at equally spaced places of every step, ends included.

        At a jump both sides are there: the end of one step and the start of the next.
        ``names`` are as in `at`.
        """
        if not self.steps:
            return self.at(self.times, names)
        start, length = self._column("START"), self._column("LENGTH")
        first = max(1, int(np.searchsorted(start, since, side="right")) - 1)
        s = np.linspace(0.0, 1.0, per_step)
        grid = start[first:, None] + length[first:, None] * s
        index = np.broadcast_to(np.arange(first, start.size)[:, None], grid.shape)
        keep = grid.ravel() >= since
        return self._evaluate(index.ravel()[keep], grid.ravel()[keep], names)

    def _evaluate(self, places: Places, times: FloatArray, names: Sequence[str] | None) -> Motion:
        every = self.column_names
        plant = self.state_names, self.input_names, self.structure.output_names
        asked = data.motion_columns(*plant) if names is None else tuple(names)
        for name in asked:
            if name not in every:
                raise InputError("names", name, f"of {', '.join(every)}")
        wanted = np.array([every.index(name) for name in asked], dtype=np.int64)
        places = np.ascontiguousarray(places, dtype=np.int64)
        taken, before = self.history.real.shape[0], self.first - 1
        evaluate = kernel("sample").evaluate
        rows = np.empty((wanted.size, times.size))
        # Piece by piece, so that an interrupt is heard.
        size = _AT_ONCE // (len(self.state_names) + 16)
        for k in range(0, times.size, size):
            part = slice(k, k + size)
            where = places[part] + before, np.ascontiguousarray(times[part]), wanted
            rows[:, part] = evaluate(self.settings, self.history, taken, *where)
        values: dict[str, npt.NDArray[Any]] = {
            "times": times, **dict(zip(asked, rows, strict=True))
        }  # fmt: skip
        nonlinear = self.model == "nonlinear"
        if "contact" in values:
            values["contact"] = values["contact"] > 0.0
        values["stuck"] = nonlinear & (self._column("TORSION")[places] == data.STUCK)
        values["held"] = nonlinear & (self._column("AXIAL")[places] == data.HELD)
        return Motion(values)

    @functools.cached_property
    def steady_load(self) -> tuple[float, float]:
        """Weight and torque on bit of steady drilling at the starting point."""
        weight, torque = self.settings.real[[data.WEIGHT, data.TORQUE]]
        return float(weight), float(torque)

    @functools.cached_property
    def events(self) -> tuple[Event, ...]:
        """Changes of mode in order of time."""
        torsion = {data.STUCK: "stick", data.FORWARD: "release", data.REVERSE: "reverse"}
        axial = {data.HELD: "hold", data.DOWN: "advance", data.UP: "lift", data.RIDING: "ride"}
        contact = {0: "loss", 1: "return"}
        found = []
        start, on_rock = self._column("START"), self._column("CONTACT")
        saturated, behind = self._column("SATURATED"), self._column("BEHIND")
        columns = {name: self._column(name.upper()) for name in ("contact", "torsion", "axial")}
        changed = np.zeros(self.steps + 1, dtype=bool)
        changed[2:] = (saturated[2:] != saturated[1:-1]) | (behind[2:] < behind[1:-1])
        for column in columns.values():
            changed[2:] |= column[2:] != column[1:-1]
        for j in np.flatnonzero(changed):
            time = float(start[j])
            for name, names in (("contact", contact), ("torsion", torsion), ("axial", axial)):
                now, before = int(columns[name][j]), int(columns[name][j - 1])
                # Off the rock there is no wear flat that could hold the bit.
                both = on_rock[j] and (on_rock[j - 1] or now == data.RIDING)
                meaningless = name == "axial" and not both
                if now != before and not meaningless:
                    found.append(Event(time, names[now]))
            if behind[j] < behind[j - 1]:
                found.append(Event(time, "resume"))
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
        name : {"stuck", "held", "riding", "lost", "saturated", "reverse", "behind"}
            Torsional stick, axial hold, riding on a face that falls away, loss of contact, an
            input or actuator at its limit; rotation backwards, and until the bit is again where
            it turned back.
        """
        modes = {
            "stuck": self._column("TORSION") == data.STUCK,
            "held": self._column("AXIAL") == data.HELD,
            "riding": self._column("AXIAL") == data.RIDING,
            "lost": self._column("CONTACT") == 0,
            "saturated": self._column("SATURATED") != 0,
            "reverse": self._column("TORSION") == data.REVERSE,
            "behind": self._column("BEHIND") != 0,
        }
        if name not in modes:
            raise InputError("phase", name, f"one of {', '.join(modes)}")
        inside = np.concatenate([[False], modes[name][1:], [False]])
        edges = np.flatnonzero(inside[1:] != inside[:-1])
        return tuple(
            (float(self.times[a]), float(self.times[b]))
            for a, b in zip(edges[::2], edges[1::2], strict=True)
        )
