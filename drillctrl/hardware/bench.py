"""`bench`: the string behind a socket, in real time or faster, for a drive's software."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.drilling.case import Case, Where, as_case
from drillctrl.drilling.point import RigPoint
from drillctrl.hardware.recording import Recording
from drillctrl.hardware.result import BenchRun
from drillctrl.hardware.source import RecordedSource, Source, StringSource
from drillctrl.hardware.wire import LOOPBACK, Address, Line
from drillctrl.simulation.drive_control import free_drive
from drillctrl.simulation.run import LONGEST
from drillctrl.simulation.scenario import Scenario
from drillctrl.strings.rig import StringRig

# A sample more often than this is none that Python keeps up with.
_MOST_SAMPLES = 10_000_000
_FASTEST = 1e6


@checks_kinds
def bench(
    where: Where,
    *,
    period: float,
    duration: float = 200.0,
    outputs: Sequence[str] | None = None,
    inputs: Sequence[str] | None = None,
    scenario: Scenario | None = None,
    initial: Mapping[str, float] | None = None,
    speedup: float = 1.0,
    host: str = LOOPBACK,
    port: int = 0,
    wait: float = 60.0,
    patience: float = 5.0,
    listening: Callable[[Address], None] | None = None,
    **options: Any,
) -> BenchRun:
    """Run the nonlinear string behind a UDP socket, so that a drive's software closes the loop.

    One datagram a sample goes out, and is answered by one (`hardware.wire` says how they are
    laid out). The answer acts from the instant of its sample on, as in `simulate` with a sampled
    controller; without one in time the inputs before it stand.

    Parameters
    ----------
    where : OperatingPoint, RigPoint or Case
        What drills, and where. Of a rig whose string hangs on a top drive, that drive takes the
        torque; its limit, delay and lag are in the loop.
    period, duration : float
        Between samples, and of the run; dimensionless, as in `simulate`. What goes over the line
        is SI where there is a rig.
    outputs, inputs : sequence of str, optional
        What is measured and driven; by default angle and speed of the top drive and its torque,
        or those of the bit.
    scenario, initial
        As of `simulate`.
    speedup : float
        Seconds of the motion (units of time without a rig) per second; infinite for lock-step,
        where each sample waits for its answer.
    host, port : str, int
        Where to listen; other machines reach it only if ``host`` is not loopback.
    wait : float
        Seconds to wait for the controller's first datagram.
    patience : float
        Seconds to wait for an answer in lock-step; the run ends without one.
    listening : callable, optional
        Called with the address once it listens.
    **options
        Of `SteppedRun`: limit, rate_limit, measurement_delay, actuator_lag, cutting, backwards,
        rtol, atol.

    Returns
    -------
    BenchRun
        Also after an interrupt such as Ctrl-C, as far as it went.

    Raises
    ------
    InputError
        If an argument is out of range, or no controller came.
    """
    case, around = bench_case(where)
    around |= {name: value for name, value in options.items() if value is not None}
    outputs, inputs = checked_signals(case, outputs, inputs)
    checked_number("period", period, 0.0, LONGEST, open_low=True)
    checked_number("duration", duration, 0.0, min(LONGEST, _MOST_SAMPLES * period), open_low=True)
    if scenario is not None and initial is not None:
        raise InputError("initial", dict(initial), "left out where there is a scenario")
    scenario = Scenario(initial=dict(initial or {})) if scenario is None else scenario
    _check_clock(speedup, wait, patience)
    with_line = Line(host, port, len(outputs), len(inputs))
    try:
        source = StringSource(
            case, outputs, inputs, scenario, period=period, duration=duration, **around
        )
        step = period * source.time_unit
        units = "dimensionless" if case.rig is None else "SI"
        served = _Served(with_line, source, len(inputs), step, speedup, patience)
        served.run(wait, listening)
    finally:
        with_line.close()
    simulation = source.result()
    ended = served.ended or ("duration" if simulation.status == "done" else str(simulation.status))
    recording = served.recording(tuple(outputs), tuple(inputs), units, step)
    return served.result(recording, ended, simulation, None)


@checks_kinds
def replay(
    recording: Recording,
    *,
    speedup: float = math.inf,
    host: str = LOOPBACK,
    port: int = 0,
    wait: float = 60.0,
    patience: float = 5.0,
    listening: Callable[[Address], None] | None = None,
) -> BenchRun:
    """Send a recording's samples again, and compare what is answered with what was.

    Parameters
    ----------
    recording : Recording
        Of `BenchRun`, or of `load_recording`.
    speedup, host, port, wait, patience, listening
        As of `bench`.
    """
    _check_clock(speedup, wait, patience)
    line = Line(host, port, len(recording.outputs), len(recording.inputs))
    try:
        served = _Served(
            line, RecordedSource(recording), len(recording.inputs), recording.period, speedup,
            patience,
        )  # fmt: skip
        served.run(wait, listening)
    finally:
        line.close()
    made = served.recording(recording.outputs, recording.inputs, recording.units, recording.period)
    return served.result(made, served.ended or "end of the recording", None, recording)


def bench_case(where: Where) -> tuple[Case, dict[str, Any]]:
    """Return what is put behind the socket, and what surrounds its controller."""
    if isinstance(where, RigPoint):
        rig = where.rig
        if isinstance(rig, StringRig) and rig.drive is not None:
            return free_drive(where)
    return as_case(where), {}


def checked_signals(
    case: Case, outputs: Sequence[str] | None, inputs: Sequence[str] | None
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return names of what is measured and driven, as they are usual where none are given."""
    plant, _ = case.physics("a bench")
    driven = "drive" in plant.input_names
    usual = (("phi", "dphi"), ("drive",)) if driven else (("theta", "dtheta"), ("torque",))
    found = []
    for what, names, known, default in (
        ("outputs", outputs, plant.output_names, usual[0]),
        ("inputs", inputs, plant.input_names, usual[1]),
    ):
        chosen = default if names is None else tuple(names)
        if not chosen or len(set(chosen)) != len(chosen) or not set(chosen) <= set(known):
            raise InputError(what, ",".join(chosen), f"some of {', '.join(known)}")
        found.append(chosen)
    return found[0], found[1]


def _check_clock(speedup: float, wait: float, patience: float) -> None:
    if speedup != math.inf:
        checked_number("speedup", speedup, 0.0, _FASTEST, open_low=True)
    checked_number("wait", wait, 0.0, 1e6, open_low=True)
    checked_number("patience", patience, 0.0, 1e6, open_low=True)


class _Served:
    """The loop over samples, and what it saw."""

    def __init__(
        self, line: Line, source: Source, inputs: int, step: float, speedup: float, patience: float
    ) -> None:
        self._line, self._source, self._speedup = line, source, speedup
        self._step = 0.0 if speedup == math.inf else step / speedup
        self._patience = patience
        self._held: tuple[float, ...] = (0.0,) * inputs
        self._rows: list[tuple[float, ...]] = []
        self._points: list[tuple[tuple[float, ...], ...]] = []
        self._overruns, self._lost, self._wall = 0, 0.0, 0.0
        self.ended: str | None = None

    def run(self, wait: float, listening: Callable[[Address], None] | None) -> None:
        """Wait for a controller, then serve it to the end."""
        if listening is not None:
            listening(self._line.address)
        began = time.perf_counter()
        try:
            if self._line.greet(began + wait) is None:
                raise InputError("wait", wait, "long enough for a controller to begin: none came")
            began = time.perf_counter()
            self._serve(began)
        except KeyboardInterrupt:
            self.ended = "interrupted"
        self._wall = time.perf_counter() - began

    def _serve(self, start: float) -> None:
        sequence = 0
        while self._source.goes_on:
            sequence += 1
            due = start + (sequence - 1) * self._step
            if self._step:
                behind = time.perf_counter() - due
                if behind > self._step:
                    # The string was slower than the clock, which waits for it.
                    self._overruns, self._lost = self._overruns + 1, self._lost + behind
                    start, due = start + behind, due + behind
                time.sleep(max(due - time.perf_counter(), 0.0))
            sample = self._source.sample(sequence)
            sent = time.perf_counter()
            self._line.send(sample)
            until = due + self._step if self._step else sent + self._patience
            found = self._line.answer(sequence, until)
            back = time.perf_counter()
            if found is not None:
                self._held = found
            late = max(sent - due, 0.0) if self._step else 0.0
            self._rows.append((sample.time, sample.delay, found is not None, late, back - sent))
            self._points.append((sample.points, sample.outputs, self._held))
            if found is None and not self._step:
                self.ended = "no answer"
                return
            self._source.take(self._held)

    def recording(
        self, outputs: tuple[str, ...], inputs: tuple[str, ...], units: str, period: float
    ) -> Recording:
        """Return all samples so far."""
        # An interrupt may have come between the two.
        count = min(len(self._rows), len(self._points))
        rows = np.array(self._rows[:count], dtype=float).reshape(count, 5)
        points, measured, answers = (
            _table([row[i] for row in self._points[:count]], width)
            for i, width in enumerate((3, len(outputs), len(inputs)))
        )
        return Recording(
            outputs, inputs, units, period, rows[:, 0], points, rows[:, 1], measured, answers,
            rows[:, 2] > 0.5, rows[:, 3], rows[:, 4],
        )  # fmt: skip

    def result(
        self, recording: Recording, ended: str, simulation: Any, compared: Recording | None
    ) -> BenchRun:
        """Return what the bench saw."""
        return BenchRun(
            recording=recording,
            counts=self._line.counts,
            speedup=self._speedup,
            overruns=self._overruns,
            lost_seconds=self._lost,
            wall_seconds=self._wall,
            ended=ended,
            simulation=simulation,
            compared=compared,
        )


def _table(rows: list[tuple[float, ...]], width: int) -> FloatArray:
    return np.array(rows, dtype=float).reshape(len(rows), width)
