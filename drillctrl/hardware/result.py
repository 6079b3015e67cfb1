"""What a bench saw: samples, jitter, what was missed, and the motion."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.base.text import finite_or_none, set_out
from drillctrl.hardware.recording import Recording
from drillctrl.hardware.wire import Counts
from drillctrl.simulation.outcome import figures
from drillctrl.simulation.result import Simulation

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, eq=False)
class BenchRun:
    """A run on the bench, or a replay.

    Attributes
    ----------
    recording : Recording
        What went over the line.
    counts : Counts
        Datagrams that were no answer.
    speedup : float
        Motion per wall time; infinite in lock-step.
    overruns : int
        How often the string itself was more than a period behind the clock, which then waited.
    lost_seconds : float
        For how long in all.
    wall_seconds : float
        From the controller's first datagram to the end.
    ended : str
        Why: ``"duration"``, ``"interrupted"``, ``"no answer"``, a status of `Simulation`, or
        ``"end of the recording"``.
    simulation : Simulation or None
        The motion; None in a replay.
    compared : Recording or None
        What a replay is compared with.
    """

    recording: Recording
    counts: Counts
    speedup: float
    overruns: int
    lost_seconds: float
    wall_seconds: float
    ended: str
    simulation: Simulation | None = field(default=None, repr=False)
    compared: Recording | None = field(default=None, repr=False)

    @property
    def lockstep(self) -> bool:
        """Whether there was no clock."""
        return bool(np.isinf(self.speedup))

    @property
    def deviation(self) -> tuple[float, int] | None:
        """Largest difference from the recording's answers, and at which sample (from 1); None
        without a recording, or without a sample that was answered in both."""
        if self.compared is None:
            return None
        count = len(self.recording)
        both = self.recording.answered & self.compared.answered[:count]
        if not both.any():
            return None
        apart = abs(self.recording.answers - self.compared.answers[:count]).max(axis=1)
        worst = int(np.argmax(np.where(both, apart, -1.0)))
        return float(apart[worst]), worst + 1

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields of the command line; wall times in s."""
        found, run = self.recording, self.simulation
        end = float(found.times[-1]) if len(found) else 0.0
        fields: dict[str, Any] = {
            "schema": "drillctrl/bench/1",
            "outputs": list(found.outputs),
            "inputs": list(found.inputs),
            "units": found.units,
            "period": found.period,
            "speedup": finite_or_none(self.speedup),
            "ended": self.ended,
            "samples": len(found),
            "missed": found.missed,
            "datagrams": asdict(self.counts),
            "jitter": None if self.lockstep else _spread(found.lateness),
            "round_trip": _spread(found.round_trip[found.answered]),
            "overruns": self.overruns,
            "lost_seconds": self.lost_seconds,
            "last_time": end,
            "wall_seconds": self.wall_seconds,
        }
        if run is not None and run.steps:
            judged = figures(run)
            fields |= {
                "outcome": judged.outcome,
                "swing": judged.swing,
                "stick_fraction": judged.stick_fraction,
            }
        if self.compared is not None:
            worst = self.deviation
            fields["deviation"] = worst and worst[0]
            fields["worst_sample"] = worst and worst[1]
        return fields

    def summary(self) -> str:
        """Return the report for people."""
        found = self.recording
        unit = "s" if found.units == "SI" else "units of time"
        pace = "lock-step" if self.lockstep else f"{self.speedup:g} times real time"
        samples = len(found)
        lines = []
        if self.compared is not None:
            lines.append(("Against", self._comparison()))
        missed = f"{found.missed} of {samples} samples without an answer in time"
        lines.append(
            ("Missed", missed if found.missed or not samples else "none: every answer in time")
        )
        if self.simulation is not None and self.simulation.steps:
            judged = figures(self.simulation)
            swing = "" if judged.swing is None else f", swing {judged.swing:.3g}"
            lines.append(("Motion", f"{judged.outcome}{swing}"))
        lines += [
            ("Loop", f"{', '.join(found.outputs)} -> {', '.join(found.inputs)}, "
             f"every {found.period:.4g} {unit}, {pace}"),
            ("Ended", f"{self.ended}, after {samples} samples in {self.wall_seconds:.3g} s"),
        ]  # fmt: skip
        if not self.lockstep:
            lines.append(("Jitter", _words(_spread(found.lateness), "samples sent late by")))
        lines.append(("Answers", _words(_spread(found.round_trip[found.answered]), "came after")))
        if self.overruns:
            lines.append(
                ("Overruns", f"{self.overruns} times the string was behind the clock, "
                 f"{self.lost_seconds:.3g} s in all")
            )  # fmt: skip
        if self.counts.total:
            told = ", ".join(
                f"{count} {name.replace('_', ' ')}"
                for name, count in asdict(self.counts).items()
                if count
            )
            lines.append(("No answers", f"{told} (counted, and left aside)"))
        return set_out(lines)

    def _comparison(self) -> str:
        worst = self.deviation
        if worst is None:
            return "the recording: no sample was answered in both"
        if worst[0] == 0.0:
            return "the recording: every answer is the same"
        quantity = {"SI": "N·m or N", "dimensionless": "dimensionless"}[self.recording.units]
        return (
            f"the recording: answers differ by at most {worst[0]:.3g} ({quantity}), "
            f"at sample {worst[1]}"
        )

    def plot(self) -> Figure:
        """Draw the motion, as `Simulation.plot` does.

        Raises
        ------
        InputError
            If it was a replay, which has none.
        """
        if self.simulation is None:
            raise InputError("plot", "a replay", "a run of the string")
        return self.simulation.plot()


def _spread(seconds: FloatArray) -> dict[str, float] | None:
    """Return median, 99th percentile and largest of some times, s."""
    if not seconds.size:
        return None
    median, high = np.percentile(seconds, [50.0, 99.0])
    return {"median": float(median), "p99": float(high), "max": float(seconds.max())}


def _words(spread: dict[str, float] | None, before: str) -> str:
    if spread is None:
        return "none"
    median, high, most = (f"{1e3 * spread[name]:.3g}" for name in ("median", "p99", "max"))
    return f"{before} {median} ms (median), {high} ms (99 %), {most} ms at most"
