"""What the bench sends: the motion of the string, or a recording of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Protocol

import numpy as np

from drillctrl.drilling.case import Case
from drillctrl.drilling.quantities import si_scale
from drillctrl.hardware.recording import Recording
from drillctrl.hardware.wire import POINTS, Sample
from drillctrl.simulation.result import Simulation
from drillctrl.simulation.scenario import Scenario
from drillctrl.simulation.stepping import SteppedRun
from drillctrl.tables.scheduling import course


class Source(Protocol):
    """Where samples come from and answers go."""

    @property
    def goes_on(self) -> bool:
        """Whether there is another sample."""

    def sample(self, sequence: int) -> Sample:
        """Return the sample of now."""

    def take(self, inputs: Sequence[float]) -> None:
        """Take the answer to it, and go on by a period."""


class StringSource:
    """The nonlinear string, which goes on under each answer; in SI where it is of a rig."""

    def __init__(
        self,
        case: Case,
        outputs: Sequence[str],
        inputs: Sequence[str],
        scenario: Scenario,
        **options: Any,
    ) -> None:
        plant, self._point = case.physics("a bench")
        self._run = SteppedRun(case, outputs, inputs, scenario=scenario, **options)
        self._scenario, self._rig = scenario, case.rig
        scales = (
            [1.0 if case.rig is None else si_scale(plant.quantity(name), case.rig) for name in some]
            for some in (outputs, inputs)
        )
        self._measured, self._driven = (np.array(scale) for scale in scales)
        self._fixed = None if scenario.changes else self._set_points(0.0)

    @property
    def goes_on(self) -> bool:
        """Whether the run does."""
        return self._run.goes_on

    @property
    def time_unit(self) -> float:
        """s, or 1."""
        return 1.0 if self._rig is None else self._rig.time_scale

    def sample(self, sequence: int) -> Sample:
        """Return what is measured now."""
        now = self._run.time
        points, delay = self._set_points(now) if self._fixed is None else self._fixed
        outputs = tuple((self._run.outputs() * self._measured).tolist())
        return Sample(sequence, now * self.time_unit, points, delay, outputs)

    def _set_points(self, now: float) -> tuple[tuple[float, ...], float]:
        # What changes in a step is looked up just behind it, as by a scheduled controller.
        place = course(self._point, self._scenario, np.array([now + 2e-9]))[0]
        delay = replace(self._point, omega0=float(place[0])).delay * self.time_unit
        omega0, delta0, psi = place.tolist()
        rig = self._rig
        if rig is None:
            return (omega0, delta0, psi), delay
        strength = rig.rock_strength * (psi / self._point.psi if self._point.psi else 1.0)
        rate = delta0 * omega0 * rig.axial_scale / rig.time_scale
        return (omega0 / rig.time_scale, rate, strength), delay

    def take(self, inputs: Sequence[float]) -> None:
        """Hold the inputs over a period."""
        self._run.hold(np.array(inputs) / self._driven)
        self._run.advance()

    def result(self) -> Simulation:
        """Return the run as far as it went."""
        return self._run.result()


class RecordedSource:
    """Samples of a recording, whatever is answered."""

    def __init__(self, recording: Recording) -> None:
        self._recording, self._next = recording, 0

    @property
    def goes_on(self) -> bool:
        """Whether there is another one."""
        return self._next < len(self._recording)

    def sample(self, sequence: int) -> Sample:
        """Return the next one."""
        found, k = self._recording, self._next
        points = tuple(found.points[k].tolist())
        assert len(points) == POINTS
        measured = tuple(found.measured[k].tolist())
        return Sample(sequence, float(found.times[k]), points, float(found.delay[k]), measured)

    def take(self, inputs: Sequence[float]) -> None:
        """Go on."""
        self._next += 1
