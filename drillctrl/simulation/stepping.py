"""A run that goes on sample by sample, under inputs that come from outside."""

from __future__ import annotations

import math
import time
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.kinds import makes_of_kinds
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.drilling.case import Where
from drillctrl.simulation.advance import finished, go_on
from drillctrl.simulation.compile import kernel
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.kernel import data
from drillctrl.simulation.result import Simulation
from drillctrl.simulation.run import prepare


@makes_of_kinds
class SteppedRun:
    """The nonlinear string under inputs that are given anew each period and held in between.

    It is the motion of `simulate` with a sampled controller, whose place the caller takes:
    `outputs`, then `hold` the inputs that answer them, then `advance` by a period, and so on.

    Parameters
    ----------
    where : OperatingPoint, RigPoint or Case
        What drills, and where. All here is dimensionless.
    outputs, inputs : sequence of str
        What is measured, and what is driven.
    period : float
        Between samples.
    duration : float
        When the run ends.
    limit, rate_limit, measurement_delay, actuator_lag
        As of `Controller`.
    encoder : float, optional
        Angle of a count of the encoder at the top drive: the outputs ``phi`` and ``dphi`` are what
        it counts, and that over a period.
    max_steps : int
        As of `simulate`.
    **options
        Of `simulate`: scenario, initial, cutting, backwards, rtol, atol, max_step.

    Attributes
    ----------
    sample : int
        Number of periods that have passed.

    Raises
    ------
    InputError
        If an argument is out of range.
    """

    def __init__(
        self,
        where: Where,
        outputs: Sequence[str],
        inputs: Sequence[str],
        *,
        period: float,
        duration: float,
        limit: float | None = None,
        rate_limit: float | None = None,
        measurement_delay: float = 0.0,
        actuator_lag: float = 0.0,
        encoder: float | None = None,
        max_steps: int = 100_000_000,
        **options: Any,
    ) -> None:
        self._controller = outside_controller(
            outputs, inputs, period, limit, rate_limit, measurement_delay, actuator_lag
        )
        prepared = prepare(
            where, self._controller, duration=duration, max_steps=max_steps, **options
        )
        self._standing, self._structure, self._steps, self._asked = prepared
        structure = self._structure
        self._march = kernel("march")
        self._evaluate = kernel("sample").evaluate
        # Samples are taken here, not by the march.
        self._standing.reals[self._march.NEXT_SAMPLE] = math.inf
        self.sample, self._outcome, self._elapsed = 0, data.DONE, 0.0
        self._limits = (
            math.inf if limit is None else limit,
            math.inf if rate_limit is None or actuator_lag else rate_limit * period,
        )
        names = data.sample_columns(
            structure.state_names, structure.input_names, structure.output_names
        )
        rows = len(names) - len(structure.output_names)
        self._wanted = np.array(
            [rows + structure.output_names.index(name) for name in outputs], dtype=np.int64
        )
        self._measured, self._count = tuple(outputs), 0.0
        if encoder is not None:
            self._count = checked_number("encoder", encoder, 0.0, math.tau, open_low=True)
            if "phi" not in structure.state_names:
                raise InputError("encoder", encoder, "left out where there is no top drive")
            self._top = np.array([names.index("phi"), names.index("dphi")], dtype=np.int64)
        self._driven = [structure.input_names.index(name) for name in inputs]
        # Compiles what is not compiled yet, before any clock runs.
        self._go_on(0.0)
        self.outputs()

    @property
    def time(self) -> float:
        """Where the run stands."""
        return float(self._standing.reals[self._march.TIME])

    @property
    def goes_on(self) -> bool:
        """Whether neither its end nor something that ends it has been reached."""
        return self._outcome == data.DONE and self.time < self._asked["duration"]

    def outputs(self) -> FloatArray:
        """Return what is measured now (a measurement delay ago), (p,)."""
        when = self.time - self._controller.measurement_delay
        found = self._at(when, self._wanted)
        return found + self._miscounted(when) if self._count else found

    def _miscounted(self, when: float) -> FloatArray:
        """Return what an encoder tells beyond the outputs as they are, (p,)."""
        period, speed = self._controller.period, self._structure.omega0
        assert period is not None
        angle, rate = self._at(when, self._top)
        before = self._at(when - period, self._top)[0]
        turned = np.array([speed * when + angle, speed * (when - period) + before])
        counted = np.floor(turned / self._count) * self._count
        told = {
            "phi": counted[0] - turned[0],
            "dphi": (counted[0] - counted[1]) / period - speed - rate,
        }
        return np.array([told.get(name, 0.0) for name in self._measured])

    def _at(self, when: float, wanted: npt.NDArray[np.int64]) -> FloatArray:
        """Return some columns of a sample at an instant that has passed."""
        standing = self._standing
        used = int(standing.ints[self._march.STEPS])
        start = standing.history.real[:used, data.START]
        place = max(int(np.searchsorted(start, when, side="right")) - 1, 0)
        found: FloatArray = self._evaluate(
            standing.settings,
            standing.history,
            used,
            np.array([place], dtype=np.int64),
            np.array([when]),
            wanted,
        )
        return found[:, 0]

    def hold(self, inputs: npt.ArrayLike) -> FloatArray:
        """Hold inputs from now on, within the limits; return those that are held, (m,).

        Raises
        ------
        InputError
            If they are not finite, or not as many as are driven.
        """
        wanted = np.atleast_1d(np.asarray(inputs, dtype=float))
        if wanted.shape != (len(self._driven),) or not np.isfinite(wanted).all():
            raise InputError("inputs", wanted.tolist(), f"{len(self._driven)} finite numbers")
        y = self._standing.y
        first = sum(self._structure.arrays.B.shape)
        most, change = self._limits
        for i, value in zip(self._driven, wanted.tolist(), strict=True):
            before = float(y[first + i])
            held = min(max(value, -most), most)
            y[first + i] = min(max(held, before - change), before + change)
        self._break()
        return np.array([y[first + i] for i in self._driven])

    def _break(self) -> None:
        """Enter the mode that follows a jump of an input."""
        settings, history, ints, reals, y, chain, *_ = self._standing
        work, steps = self._march.workplace(settings), int(ints[self._march.STEPS])
        self._march.enter(
            settings, history, steps, ints, reals, chain, data.BARRIER, self.time, y, work
        )
        level = self._march.I_LEVEL
        ints[level] = min(ints[level], 2)

    def advance(self) -> bool:
        """Go on by a period; return whether the run goes on."""
        if self.goes_on:
            began = time.perf_counter()
            self.sample += 1
            period = self._controller.period
            assert period is not None
            self._go_on(min(self.sample * period, self._asked["duration"]))
            self._elapsed += time.perf_counter() - began
        return self.goes_on

    def _go_on(self, end: float) -> None:
        self._standing, self._outcome = go_on(self._standing, self._structure, end, *self._steps)

    def result(self) -> Simulation:
        """Return the run as far as it went."""
        return finished(self._standing, self._outcome, elapsed_seconds=self._elapsed, **self._asked)


def outside_controller(
    outputs: Sequence[str],
    inputs: Sequence[str],
    period: float,
    limit: float | None = None,
    rate_limit: float | None = None,
    measurement_delay: float = 0.0,
    actuator_lag: float = 0.0,
) -> Controller:
    """Return clock, limits and delays of a controller whose law is elsewhere."""
    shape = len(inputs), len(outputs)
    none, one = np.zeros(shape), np.ones(shape)
    structure = FeedbackStructure(
        "from outside", tuple(outputs), -one, one, none, none, tuple(inputs)
    )
    return Controller(
        structure,
        none,
        none,
        period=checked_number("period", period, 0.0, 1e9, open_low=True),
        limit=limit,
        rate_limit=rate_limit,
        measurement_delay=measurement_delay,
        actuator_lag=actuator_lag,
    )
