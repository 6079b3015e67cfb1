"""`rig_report`: two pages for people on a rig, from what other verbs find out."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from drillctrl.base.errors import InputError
from drillctrl.base.files import write_text
from drillctrl.base.kinds import checks_kinds
from drillctrl.base.language import DIMENSIONLESS
from drillctrl.base.text import wrapped
from drillctrl.base.workers import Progress, spread_out
from drillctrl.designs.design import analyze, design
from drillctrl.designs.report import Report, report
from drillctrl.drilling.case import Case, as_case
from drillctrl.drilling.point import RigPoint
from drillctrl.drilling.steady import steady_state
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.drive_control import law_controller
from drillctrl.simulation.outcome import figures
from drillctrl.simulation.run import simulate
from drillctrl.simulation.starts import start_named
from drillctrl.strings.check import check_rig
from drillctrl.strings.drive_control import DriveControl
from drillctrl.strings.drive_law import driven_plant
from drillctrl.strings.drives import DRIVE_NAMES, DriveComparison, compare_drives
from drillctrl.strings.rig import StringRig, lump
from drillctrl.studies.rig_report_values import Course, ReportValues
from drillctrl.studies.rig_report_words import report_answer
from drillctrl.studies.vibration import VibrationMap, vibration_map

# Periods of the slowest torsional mode that runs last, and the most seconds of a long string,
# whose waves take many steps.
_PERIODS, _PERIODS_OF_STRING, _MOST_SECONDS = 30.0, 3.0, 20.0
_SAMPLES = 1500
_RTOL = 1e-6
# A long stick winds all of a string up.
_START, _START_OF_STRING = "kick", "stick"
# Of the map: points across and up, and its range over the point.
_COUNTS, _ACROSS, _UP = (7, 5), (0.5, 1.5), (0.25, 2.0)
_COUNTS_OF_STRING = (5, 3)
# Of runs of a lumped rig, units of time.
_USUAL = 200.0
_AT_BIT, _OF_DRIVE = "pd", "soft-torque"


@dataclass(frozen=True, eq=False)
class RigReport(ReportValues):
    """A report of a rig at a point; attributes are those of `ReportValues`."""

    def summary(self) -> str:
        """Return its first sentences."""
        return "\n".join(wrapped(text) for text in report_answer(self))

    def to_html(self) -> str:
        """Return the page, which needs nothing else and prints to two sheets of A4."""
        from drillctrl.studies.rig_report_page import report_page

        return report_page(self)

    def save(self, path: str | Path) -> None:
        """Write the page, whole or not at all.

        Raises
        ------
        InputError
            If the name does not end in .html.
        """
        check_report_path(path)
        write_text(path, self.to_html())

    def __repr__(self) -> str:
        return f"<RigReport: {self.name}, {self.free.case.place}>"


def check_report_path(path: str | Path) -> None:
    """Raise `InputError` if a report cannot be written under this name."""
    if Path(path).suffix.lower() not in (".html", ".htm"):
        raise InputError("path", str(path), "a name that ends in .html")


@checks_kinds
def rig_report(
    where: RigPoint,
    structure: str | None = None,
    *,
    name: str = "rig",
    date: str = "",
    mapped: bool = True,
    executor: Executor | None = None,
    progress: Progress | None = None,
    stage: Callable[[str], None] | None = None,
) -> RigReport:
    """Find out what people on a rig want to know of a point.

    Parameters
    ----------
    where : RigPoint
        The rig, and where it drills; the report is in its units.
    structure : str, optional
        Of a rig with a top drive a law of it, as of `drive_control`, soft torque without it;
        of others what torque at the bit follows, as of `design`, ``"pd"`` without it.
    name : str
        Of the rig.
    date : str
        Of the report; the same input with the same date makes the same page.
    mapped : bool
        Whether a vibration map around the point is made; of a string of 3 km it takes a minute
        of one core.
    executor : concurrent.futures.Executor, optional
        Works on runs side by side.
    progress, stage : callable, optional
        Told how far the map has come, and what is being worked on.

    Returns
    -------
    RigReport
        Of a string whose speed is imposed at the top, gains and map are of the string lumped
        to one mass each way, and the runs of the string itself.

    Raises
    ------
    InputError
        If the structure does not fit the rig, or a drive cannot drill there.
    """
    began = time.perf_counter()
    rig = where.rig
    driven = isinstance(rig, StringRig) and rig.drive is not None
    _check_structure(structure, driven)
    if where.language is DIMENSIONLESS:
        raise InputError("units", where.units, "si or field: a report is for people on a rig")

    def at(what: str) -> None:
        if stage is not None:
            stage(what)

    at("modes")
    check = check_rig(rig)
    drives: DriveComparison | None = None
    gains: Report | None = None
    found: VibrationMap | None = None
    tasks: list[_Task]
    seconds = _duration(check.torsional[0].frequency, isinstance(rig, StringRig))
    if driven:
        assert isinstance(rig, StringRig)
        at("drives")
        laws = ["stiff", structure or _OF_DRIVE]
        drives = compare_drives(rig, list(dict.fromkeys(laws)))
        free = analyze(as_case(where, driven_plant(rig, drives.drives[0].control)))
        tasks = []
        for drive in drives.drives:
            case, controller = law_controller(where, drive.control)
            tasks.append(_Task(len(tasks), case, controller, drive.control.name, seconds))
        if mapped:
            at("map")
            law = drives.drives[-1].control if len(drives.drives) > 1 else None
            found = _map(where, law, executor, progress, _COUNTS_OF_STRING, seconds)
    else:
        simple: RigPoint = replace(where, rig=lump(rig))
        free = analyze(where)
        at("gains")
        result = design(simple, structure or _AT_BIT)
        gains = report(result, at)
        control = result.controller() if result.recommended else None
        if mapped:
            at("map")
            found = _map(simple, control, executor, progress)
        case = as_case(where)
        tasks = [_Task(0, case, None, "without control", seconds)]
        if control is not None:
            again = Controller(control.feedback, control.K1, control.K2)
            tasks.append(_Task(1, case, again, "with control", seconds))
    at("runs")
    courses = sorted(spread_out(executor, _course, tasks), key=lambda pair: pair[0])
    return RigReport(
        where,
        name,
        date,
        steady_state(where),
        check,
        free,
        gains,
        drives,
        tuple(course for _, course in courses),
        found,
        isinstance(rig, StringRig) and not driven,
        time.perf_counter() - began,
    )


def _check_structure(structure: str | None, driven: bool) -> None:
    if structure is None:
        return
    of_drive = structure in DRIVE_NAMES
    if driven and not of_drive:
        raise InputError("structure", structure, f"a law of the drive: {', '.join(DRIVE_NAMES)}")
    if of_drive and not driven:
        raise InputError("structure", structure, "of a rig with a [top_drive]")


def _duration(frequency: float, of_string: bool) -> float:
    """Return how many seconds a run lasts."""
    if of_string:
        return min(_PERIODS_OF_STRING / frequency, _MOST_SECONDS)
    return _PERIODS / frequency


@dataclass(frozen=True, eq=False)
class _Task:
    index: int
    case: Case
    controller: Controller | None
    label: str
    seconds: float


def _course(task: _Task) -> tuple[int, Course]:
    """Run from the start that tells most of a rig."""
    _, point = task.case.physics("a report")
    rig = task.case.rig
    assert rig is not None
    start = start_named(_START_OF_STRING if isinstance(rig, StringRig) else _START)
    run = simulate(
        task.case,
        task.controller,
        duration=task.seconds / rig.time_scale,
        scenario=start.scenario(),
        rtol=_RTOL,
    )
    times = np.linspace(0.0, float(run.times[-1]) * (1.0 - 1e-12), _SAMPLES)
    motion = run.at(times)
    torque = np.zeros_like(times)
    if task.controller is not None:
        (driven,) = task.controller.feedback.inputs  # type: ignore[union-attr]
        torque = rig.torsional_stiffness * getattr(motion, driven)
    return task.index, Course(
        task.label,
        start.text,
        figures(run),
        rig.time_scale * times,
        (point.omega0 + motion.dtheta) / rig.time_scale,
        torque,
    )


def _map(
    where: RigPoint,
    control: Controller | DriveControl | None,
    executor: Executor | None,
    progress: Progress | None,
    counts: tuple[int, int] = _COUNTS,
    seconds: float | None = None,
) -> VibrationMap:
    """Map what becomes of the bit around a point after a kick, in so many seconds."""
    told = where.language
    speed = told.number("angular_rate", where.rotary_speed)
    rate = max(told.number("axial_rate", where.penetration_rate), 1.0)
    return vibration_map(
        where,
        ("speed", *(float(f"{speed * share:.2g}") for share in _ACROSS)),
        ("rop", *(float(f"{rate * share:.2g}") for share in _UP)),
        control,
        counts=counts,
        refine=0,
        starts=("kick",),
        duration=_USUAL if seconds is None else seconds / where.rig.time_scale,
        executor=executor,
        progress=progress,
    )
