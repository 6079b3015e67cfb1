"""The controller as it runs on a rig: gains, clock, delays, actuator, limits, noise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.base.kinds import makes_of_kinds
from drillctrl.delay.closing import gain_matrices
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.drilling.plant import Plant
from drillctrl.drilling.structures import preset_structure

DELAYS = ("fixed", "current")
# Beyond what any step of the integrator could follow.
_LARGEST_GAIN = 1e15


class ScheduleEntry(NamedTuple):
    """Gains from some time on.

    Attributes
    ----------
    time : float
        From when.
    K1, K2 : array_like, (m, p) or flat
        As in `Controller`.
    delay : float, optional
        How long ago the delayed outputs are from then on; τ0 of the starting point if it is
        left out, which is wrong where the rotary speed has changed.
    """

    time: float
    K1: npt.ArrayLike
    K2: npt.ArrayLike | None = None
    delay: float | None = None


@makes_of_kinds
@dataclass(frozen=True, eq=False)
class Controller:
    """Output feedback u = K1 Y(t) + K2 Y(t − τ) with what surrounds it (Eqs. 36-40).

    The outputs are perturbations from steady drilling at the starting point; where the top
    end is told to move otherwise, its motion is taken off.

    Attributes
    ----------
    feedback : FeedbackStructure or str
        Which outputs are fed back to which inputs; a name as in `preset_structure`.
    K1, K2 : array_like, (m, p) or flat
        Gains on Y(t) and on Y(t − τ).
    activation : float
        Time at which the controller is switched on; before it u = 0.
    delay : {"fixed", "current"}
        Whether the delayed outputs are those of τ0 ago (or as the schedule says) or of the
        present delay τ(t) ago.
    period : float, optional
        Sampling period; the command is held in between. Without it the law is continuous.
    measurement_delay : float
        Age of every measurement, when it is used.
    actuator_lag : float
        Time constant of a first-order lag between command and torque; 0 for none.
    limit : float
        Largest absolute command.
    rate_limit : float
        Fastest change of the input: of the actuator if it has a lag, else from sample to
        sample; a continuous command without lag cannot be limited so.
    noise : mapping
        Standard deviation by output name of the white noise added to each sample.
    seed : int
        Of the noise.
    schedule : tuple of (time, K1, K2) or (time, K1, K2, delay)
        Later gains; times must rise. The delay is how long ago the delayed outputs are from
        then on; without one it is τ0 of the starting point, which is wrong where the rotary
        speed has changed.
    back_calculation : mapping
        State of the plant that is an integral of the law → 1/T: its rate is less by so much of
        what the command is beyond its limit, so that it does not wind up there.
    plant : Plant, optional
        What the gains were designed for. `simulate` then refuses another one, unless told
        that it is meant.

    Raises
    ------
    InputError
        If a value is out of range or a shape does not fit.
    """

    feedback: FeedbackStructure | str
    K1: npt.ArrayLike
    K2: npt.ArrayLike | None = None
    activation: float = 0.0
    delay: str = "fixed"
    period: float | None = None
    measurement_delay: float = 0.0
    actuator_lag: float = 0.0
    limit: float | None = None
    rate_limit: float | None = None
    noise: Mapping[str, float] = field(default_factory=dict)
    seed: int = 0
    schedule: tuple[ScheduleEntry | tuple[Any, ...], ...] = ()
    back_calculation: Mapping[str, float] = field(default_factory=dict)
    plant: Plant | None = None

    def __post_init__(self) -> None:
        def put(name: str, value: object) -> None:
            object.__setattr__(self, name, value)

        if isinstance(self.feedback, str):
            put("feedback", preset_structure(self.feedback))
        for name in ("activation", "measurement_delay", "actuator_lag"):
            put(name, checked_number(name, getattr(self, name), 0.0, 1e9))
        for name in ("limit", "rate_limit", "period"):
            if getattr(self, name) is not None:
                value = checked_number(name, getattr(self, name), 0.0, 1e9, open_low=True)
                put(name, value)
        put("seed", checked_integer("seed", self.seed, 0, 2**32 - 1))
        if self.delay not in DELAYS:
            raise InputError("delay", self.delay, f"one of {', '.join(DELAYS)}")
        if self.delay == "current" and self.measurement_delay and self.period is None:
            raise InputError(
                "measurement_delay",
                self.measurement_delay,
                "0 with delay = current, unless sampled",
            )
        if self.rate_limit is not None and self.period is None and not self.actuator_lag:
            raise InputError(
                "rate_limit", self.rate_limit, "left out unless there is a period or actuator lag"
            )
        if self.noise and self.period is None:
            raise InputError("noise", dict(self.noise), "left out unless there is a period")
        for name, deviation in self.noise.items():
            checked_number(f"noise {name}", deviation, 0.0, 1e9)
        for name, rate in self.back_calculation.items():
            checked_number(f"back_calculation {name}", rate, 0.0, 1e9)
        for name, gains in zip(("K1", "K2"), self.gain_sets()[1:], strict=True):
            for gain in gains.ravel().tolist():
                checked_number(name, gain, -_LARGEST_GAIN, _LARGEST_GAIN)
        self.delays(0.0)

    @property
    def driven(self) -> tuple[str, ...]:
        """Names of the inputs that it drives."""
        assert isinstance(self.feedback, FeedbackStructure)
        return self.feedback.inputs

    def gain_sets(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return when each set of gains starts, and the gains of the structure.

        Returns
        -------
        times : array, (g,)
        K1, K2 : array, (g, m, p)
            From the outputs of the structure to its inputs.
        """
        assert isinstance(self.feedback, FeedbackStructure)
        entries = [ScheduleEntry(0.0, self.K1, self.K2), *self._later]
        times = np.zeros(len(entries))
        shape = len(self.feedback.inputs), len(self.feedback.outputs)
        gains = np.zeros((2, len(entries), *shape))
        for k, (start, now, past, _) in enumerate(entries):
            times[k] = checked_number("schedule", start, 0.0, 1e9)
            if k and not times[k] > times[k - 1]:
                raise InputError("schedule", times[: k + 1].tolist(), "at rising times above 0")
            for which, matrix in enumerate(gain_matrices(self.feedback, now, past)):
                gains[which, k] = matrix
        return times, gains[0], gains[1]

    def gains(
        self, inputs: tuple[str, ...], outputs: tuple[str, ...]
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return `gain_sets` on all outputs of a plant, K1 and K2 of shape (g, m, p).

        Parameters
        ----------
        inputs, outputs : tuple of str
            Names of those of the plant.

        Raises
        ------
        InputError
            If the plant lacks what is fed back, driven or noisy.
        """
        assert isinstance(self.feedback, FeedbackStructure)
        rows = [_place("inputs", name, inputs) for name in self.feedback.inputs]
        columns = [_place("outputs", name, outputs) for name in self.feedback.outputs]
        for name in self.noise:
            _place("noise", name, outputs)
        times, *sets = self.gain_sets()
        full = np.zeros((2, times.size, len(inputs), len(outputs)))
        for which, values in enumerate(sets):
            full[which][np.ix_(range(times.size), rows, columns)] = values
        return times, full[0], full[1]

    def delays(self, usual: float) -> FloatArray:
        """Return how old the delayed outputs of each set of gains are, (g,), if it is fixed.

        Parameters
        ----------
        usual : float
            τ0 of the starting point.
        """
        given = [entry.delay for entry in self._later]
        for delay in given:
            if delay is not None:
                checked_number("schedule delay", delay, 0.0, 1e9, open_low=True)
                if self.delay == "current":
                    raise InputError("schedule delay", delay, "left out with delay = current")
        return np.array([usual, *(usual if delay is None else delay for delay in given)])

    @property
    def _later(self) -> tuple[ScheduleEntry, ...]:
        for entry in self.schedule:
            if not 2 <= len(entry) <= len(ScheduleEntry._fields):
                raise InputError("schedule", entry, "of (time, K1, K2) or (time, K1, K2, delay)")
        return tuple(ScheduleEntry(*entry) for entry in self.schedule)


def _place(what: str, name: str, names: tuple[str, ...]) -> int:
    if name not in names:
        raise InputError(what, name, f"among {', '.join(names)}")
    return names.index(name)
