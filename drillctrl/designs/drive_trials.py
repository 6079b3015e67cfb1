"""Laws of a top drive on the nonlinear motion, beside the stiff drive that keeps its speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drillctrl.base.kinds import checks_kinds
from drillctrl.base.text import WIDTH, wrapped
from drillctrl.base.workers import open_executor, spread_out
from drillctrl.designs.trials import STARTS, Trial, standing_starts
from drillctrl.designs.verdict import FAILURES, Verdict, judge, with_engagement
from drillctrl.drilling.point import RigPoint
from drillctrl.simulation.drive_control import law_controller
from drillctrl.simulation.outcome import Figures, figures
from drillctrl.simulation.run import simulate
from drillctrl.simulation.starts import Start
from drillctrl.simulation.status import Outcome
from drillctrl.strings.drive_control import DriveControl
from drillctrl.strings.drive_measures import DriveMeasures
from drillctrl.strings.drive_rules import stiff_control
from drillctrl.strings.rig import StringRig

# Periods of the first mode that a run lasts; its last quarter is judged.
_PERIODS = 14.0
_RTOL, _STEPS = 1e-5, 1_000_000
# Swings that are alike, of which the law that stands more is better.
_ALIKE = 0.02
_BESIDE = "under a stiff drive"
_STANDING = "bring a bit that stands up to speed under the stiff drive"


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
        return with_engagement(judge(self.moving, True), self.trials[len(self.moving) :], _STANDING)

    @property
    def moving(self) -> tuple[Trial, ...]:
        """Those in which the bit turns at first."""
        return tuple(trial for trial in self.trials if trial.start.begin == "steady")

    @property
    def swing(self) -> float:
        """The largest swing of those; infinite where a run broke off or the bit stood still."""
        swings = [trial.controlled.swing for trial in self.moving]
        return max(np.inf if swing is None else swing for swing in swings)

    @property
    def worst(self) -> Figures:
        """What became of the worst start."""
        ends = [trial.controlled for trial in self.moving]
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
    """Try laws of a drive from a small start, from kicks, and out of a stick, beside a stiff drive.

    Parameters
    ----------
    where : RigPoint
        A string under a top drive, and where it drills.
    drives : sequence of DriveMeasures
        The laws; delay, lag and torque limit of their machine hold in the runs.
    workers : int
        Processes.

    Returns
    -------
    tuple of DriveTrials
        In the same order. A law under which the bit turns back or diverges is tried from no more
        starts; out of a stick the best alone is.

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
    trials: list[list[Trial]] = [[] for _ in drives]
    with open_executor(workers, None) as executor:

        def run(start: Start, places: Sequence[int]) -> None:
            laws = [stiff, *(controls[i] for i in places if controls[i] != stiff)]
            tasks = list(enumerate((where, law, start, seconds) for law in laws))
            ends = dict(spread_out(executor, _run, tasks))
            for i in places:
                mine = ends[laws.index(controls[i])]
                trials[i].append(Trial(start, mine, ends[0], _BESIDE))

        for start in STARTS:
            if alive := [i for i, made in enumerate(trials) if not any(map(_broke, made))]:
                run(start, alive)
        made = [DriveTrials(d, tuple(t)) for d, t in zip(drives, trials, strict=True)]
        best = made.index(best_tried(made))
        if not made[best].verdict.refused:
            for start in standing_starts(law_controller(where, controls[best])[0]):
                run(start, [best])
    return tuple(DriveTrials(d, tuple(t)) for d, t in zip(drives, trials, strict=True))


def _broke(trial: Trial) -> bool:
    return trial.controlled.outcome in (Outcome.TURNS_BACK, Outcome.DIVERGES)


def law_is_quiet(where: RigPoint, drive: DriveMeasures, most: float) -> bool:
    """Whether under a law the bit swings by no more than that from a small start and a kick."""
    seconds = _PERIODS / drive.modes[0].slope.mode_frequency
    for start in STARTS[:2]:
        _, end = _run((0, (where, drive.control, start, seconds)))
        if end.swing is None or end.outcome in FAILURES or end.swing > most:
            return False
    return True


def _run(task: tuple[int, tuple[RigPoint, DriveControl, Start, float]]) -> tuple[int, Figures]:
    place, (where, control, start, seconds) = task
    case, controller = law_controller(where, control)
    run = simulate(
        case,
        controller,
        duration=seconds / where.rig.time_scale,
        scenario=start.scenario(),
        rtol=_RTOL,
        max_steps=_STEPS,
        backwards="stop",
    )
    return place, figures(run)


def trials_text(found: Sequence[DriveTrials], place: str) -> str:
    """Return a table of what became of the starts under each law, and which does best."""
    starts = list({t.start.name: t.start for each in found for t in each.trials}.values())
    rows = [("swing of the bit", [start.name for start in starts])]
    ends = {t.start.name: t.uncontrolled for each in found for t in each.trials}
    rows.append(("a stiff drive", [_cell(ends[start.name]) for start in starts]))
    for each in found:
        mine = {trial.start.name: trial.controlled for trial in each.trials}
        rows.append((each.drive.control.name, [_cell(mine.get(s.name)) for s in starts]))
    width = max(len(name) for name, _ in rows) + 2
    lines = [wrapped(f"Trial runs at {place}")]
    columns = max(len(cell) for _, cells in rows for cell in cells) + 2
    abreast = (WIDTH - width) // columns
    for begin in range(0, len(starts), abreast):
        for name, cells in rows:
            beside = "".join(f"{cell:<{columns}}" for cell in cells[begin : begin + abreast])
            lines.append(f"{name:<{width}}{beside}".rstrip())
    for each in found:
        if each.verdict.refused:
            word = "Refused" if each.verdict.harm else "No better"
            lines.append(wrapped(f"{word}: {each.drive.control.name}, {each.verdict.reason}."))
    best = best_tried(found)
    good = "does harm too" if best.verdict.harm else best.verdict.reason
    lines.append(wrapped(f"Best of these in the trials: {best.drive.control.name}, {good}."))
    return "\n".join(lines)


def _cell(end: Figures | None) -> str:
    if end is None:
        return "not run"
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
