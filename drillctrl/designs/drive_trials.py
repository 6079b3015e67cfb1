"""Laws of a top drive on the nonlinear motion, beside the stiff drive that keeps its speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drillctrl.base.kinds import checks_kinds
from drillctrl.base.text import wrapped
from drillctrl.base.workers import open_executor, spread_out
from drillctrl.designs.trials import STARTS, Trial
from drillctrl.designs.verdict import Verdict, judge
from drillctrl.drilling.point import RigPoint
from drillctrl.simulation.drive_control import law_controller
from drillctrl.simulation.outcome import Figures, figures
from drillctrl.simulation.run import simulate
from drillctrl.simulation.starts import Start
from drillctrl.strings.drive_control import DriveControl
from drillctrl.strings.drive_measures import DriveMeasures
from drillctrl.strings.drive_rules import stiff_control
from drillctrl.strings.rig import StringRig

# Periods of the first mode that a run lasts; its last quarter is judged.
_PERIODS = 14.0
_RTOL, _STEPS = 1e-5, 1_000_000
# Swings that are alike, of which the law that stands more is better.
_ALIKE = 0.02
_WORDS = (
    ("with these gains", "with this law"),
    ("without control", "under a stiff drive"),
    ("they do not settle it", "it does not bring the motion to rest"),
    ("they do not stabilise smooth drilling", "smooth drilling is not stable"),
    ("and do no", "and it does no"),
)


@dataclass(frozen=True, eq=False)
class DriveTrials:
    """What became of the starts under one law.

    Attributes
    ----------
    drive : DriveMeasures
        The law and what its string stands.
    trials : tuple of Trial
        Beside the same runs under the stiff drive.
    """

    drive: DriveMeasures
    trials: tuple[Trial, ...]

    @property
    def verdict(self) -> Verdict:
        """Whether the law can be recommended; a stiff drive is what others are compared with."""
        if not self.drive.verdict.recommended:
            return Verdict(False, self.drive.verdict.reason(), self.trials, True)
        found = judge(self.trials, True)
        reason = found.reason
        for of_gains, of_laws in _WORDS:
            reason = reason.replace(of_gains, of_laws)
        return Verdict(found.recommended, reason, self.trials, found.harm)

    @property
    def swing(self) -> float:
        """The largest swing of any start; infinite where a run broke off or the bit stood still."""
        swings = [trial.controlled.swing for trial in self.trials]
        return max(np.inf if swing is None else swing for swing in swings)

    @property
    def worst(self) -> Figures:
        """What became of the worst start."""
        ends = [trial.controlled for trial in self.trials]
        return max(ends, key=lambda end: (end.outcome.severity, end.swing or 0.0))

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields."""
        verdict = self.verdict
        return {
            "structure": self.drive.control.name,
            "recommended": verdict.recommended,
            "reason": verdict.reason,
            "trials": [trial.to_dict() for trial in self.trials],
        }


@checks_kinds
def drive_trials(
    where: RigPoint, drives: Sequence[DriveMeasures], workers: int = 1
) -> tuple[DriveTrials, ...]:
    """Try laws of a drive from a small start and from kicks, each beside a stiff drive.

    Parameters
    ----------
    where : RigPoint
        A string under a top drive, and where it drills.
    drives : sequence of DriveMeasures
        The laws; delay, lag and torque limit of their machine hold in the runs.
    workers : int
        Processes.

    Raises
    ------
    InputError
        If the drive has less torque than steady drilling takes, or a law differentiates.
    """
    rig = where.rig
    assert isinstance(rig, StringRig)
    controls = [drive.control for drive in drives]
    stiff = stiff_control(controls[0].machine, rig.string.torsion.wave_impedance)
    seconds = _PERIODS / drives[0].modes[0].slope.mode_frequency
    laws = [stiff, *(control for control in controls if control != stiff)]
    tasks = [(where, law, start, seconds) for law in laws for start in STARTS]
    with open_executor(workers, None) as executor:
        indexed = list(enumerate(tasks))
        found = dict(spread_out(executor, _run, indexed))
    ends = {(law, start.name): found[i] for i, (_, law, start, _) in indexed}
    return tuple(
        DriveTrials(
            drive,
            tuple(
                Trial(start, ends[drive.control, start.name], ends[stiff, start.name])
                for start in STARTS
            ),
        )
        for drive in drives
    )


def _run(task: tuple[int, tuple[RigPoint, DriveControl, Start, float]]) -> tuple[int, Figures]:
    place, (where, control, start, seconds) = task
    case, controller = law_controller(where, control)
    _, point = case.physics("a trial run")
    run = simulate(
        case,
        controller,
        duration=seconds / where.rig.time_scale,
        scenario=start.scenario(point),
        rtol=_RTOL,
        max_steps=_STEPS,
        backwards="stop",
    )
    return place, figures(run)


def trials_text(found: Sequence[DriveTrials], place: str) -> str:
    """Return a table of what became of the starts under each law, and which does best."""
    width = max(len("swing of the bit"), *(len(each.drive.control.name) for each in found)) + 2
    rows = [("swing of the bit", [start.name for start in STARTS])]
    rows.append(("a stiff drive", [_cell(trial.uncontrolled) for trial in found[0].trials]))
    for each in found:
        rows.append((each.drive.control.name, [_cell(trial.controlled) for trial in each.trials]))
    lines = [wrapped(f"Trial runs at {place}")]
    lines += [f"{name:<{width}}{''.join(f'{cell:<20}' for cell in cells)}".rstrip()
              for name, cells in rows]  # fmt: skip
    for each in found:
        if each.verdict.refused:
            word = "Refused" if each.verdict.harm else "No better"
            lines.append(wrapped(f"{word}: {each.drive.control.name}, {each.verdict.reason}."))
    best = best_tried(found)
    good = "does harm too" if best.verdict.harm else best.verdict.reason
    lines.append(wrapped(f"Best of these in the trials: {best.drive.control.name}, {good}."))
    return "\n".join(lines)


def _cell(end: Figures | None) -> str:
    assert end is not None
    swing = "" if end.swing is None else f"{end.swing:.2f} "
    return f"{swing}{end.outcome}"


@checks_kinds
def best_tried(found: Sequence[DriveTrials]) -> DriveTrials:
    """Return the law that does best in its trials: no harm, then the least swing.

    Of laws whose swings are alike, that whose weakest mode stands most.
    """

    def harm(each: DriveTrials) -> int:
        # A law that neither helps nor harms is no worse than the stiff drive.
        return int(each.verdict.harm) * (1 + each.worst.outcome.severity)

    least = min(map(harm, found))
    good = [each for each in found if harm(each) == least]
    smallest = min(each.swing for each in good)
    alike = [each for each in good if each.swing <= smallest + _ALIKE]
    return max(alike, key=_stands)


def _stands(each: DriveTrials) -> float:
    weakest = each.drive.weakest
    return np.inf if weakest is None else weakest.slope
