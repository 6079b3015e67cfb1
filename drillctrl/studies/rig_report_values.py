"""What a report of a rig holds: values alone, found out by `rig_report`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from drillctrl.base.arrays import FloatArray
from drillctrl.base.language import Language
from drillctrl.designs.report import Report
from drillctrl.designs.result import Analysis, Design
from drillctrl.drilling.point import RigPoint
from drillctrl.drilling.steady import SteadyState
from drillctrl.simulation.outcome import Figures
from drillctrl.simulation.status import OUTCOME_NAMED
from drillctrl.strings.check import RigCheck
from drillctrl.strings.drives import DriveComparison
from drillctrl.studies.vibration import VibrationMap


@dataclass(frozen=True, eq=False)
class Course:
    """How a nonlinear run went on, in SI units.

    Attributes
    ----------
    label : str
        What closed the loop.
    start : str
        What it started from, in words.
    figures : Figures
        What became of it.
    times, bit_speed, torque : array, (k,)
        s; rad/s; of the control beside that of steady drilling, N m.
    """

    label: str
    start: str
    figures: Figures
    times: FloatArray
    bit_speed: FloatArray
    torque: FloatArray


@dataclass(frozen=True, eq=False)
class ReportValues:
    """All that a report says of a rig at a point.

    Attributes
    ----------
    point : RigPoint
        The rig, and where it drills.
    name : str
        Of the rig.
    date : str
        Of the report, as given; may be empty.
    steady : SteadyState
        Drilling without vibration.
    check : RigCheck
        What is understood of the rig, and its modes.
    free : Analysis
        The linear motion without control: of a rig with a top drive under a stiff one.
    gains : Report or None
        Torque feedback at the bit and what is said of it; None for a rig with a top drive.
    drives : DriveComparison or None
        A stiff drive and the law that is recommended; None without a top drive.
    courses : tuple of Course
        Runs without control and with it.
    map : VibrationMap or None
        Around the point.
    is_lumped : bool
        Whether gains and map are of the string lumped to one mass each way.
    elapsed_seconds : float
        Wall time.
    """

    point: RigPoint
    name: str
    date: str
    steady: SteadyState
    check: RigCheck
    free: Analysis
    gains: Report | None
    drives: DriveComparison | None
    courses: tuple[Course, ...]
    map: VibrationMap | None
    is_lumped: bool
    elapsed_seconds: float

    @property
    def language(self) -> Language:
        """In whose units it is told."""
        return self.point.language

    @property
    def design(self) -> Design | None:
        """The gains, where there are any."""
        found = None if self.gains is None else self.gains.result
        return found if isinstance(found, Design) else None

    @property
    def calm(self) -> bool:
        """Whether without control the bit keeps turning in the run, in the rock."""
        return self.courses[0].figures.outcome.calm

    @property
    def recommended(self) -> bool:
        """Whether a control is recommended: it was tried, and does no harm on the string."""
        if self.drives is not None:
            return self.drives.drives[-1].verdict.recommended and self._is_no_worse_moving
        design = self.design
        return design is not None and design.recommended is True and self.does_no_harm

    @property
    def _is_no_worse_moving(self) -> bool:
        """Whether a bit that turns does no worse after a kick, nearest the point on the map.

        Without a map the run over time has to say so.
        """
        if self.map is None or self.map.controlled is None or self.map.marked is None:
            return self.does_no_harm
        spans = [self.map.plane.x.span, self.map.plane.y.span]
        distance = ((self.map.points - list(self.map.marked)) / spans) ** 2
        here = int(distance.sum(axis=1).argmin())
        both = self.map.uncontrolled, self.map.controlled
        free, mine = (OUTCOME_NAMED[str(each.outcomes[here])].severity for each in both)
        return mine <= free

    @property
    def does_no_harm(self) -> bool:
        """Whether the run over time ends no worse with the control."""
        if len(self.courses) < 2:
            return True
        free, with_control = (course.figures.outcome.severity for course in self.courses[:2])
        return with_control <= free

    def to_dict(self) -> dict[str, Any]:
        """Return JSON types, in SI units."""
        design = self.design
        return {
            "schema": "drillctrl/report/1",
            "rig": self.name,
            "date": self.date or None,
            "rotary_speed": self.point.rotary_speed,
            "penetration_rate": self.point.penetration_rate,
            "rock_strength": self.point.rig.rock_strength,
            "weight_on_bit": self.steady.weight_on_bit,
            "torque_on_bit": self.steady.torque_on_bit,
            "stable_without_control": self.free.stable,
            "recommended": self.recommended,
            "check": self.check.to_dict(),
            "design": None if design is None or self.gains is None else self.gains.to_dict(),
            "drives": None if self.drives is None else self.drives.to_dict(),
            "runs": [
                {"control": course.label, "start": course.start, **course.figures.to_dict()}
                for course in self.courses
            ],
            "map": None if self.map is None else self.map.to_dict(),
            "lumped": self.is_lumped,
            "elapsed_seconds": self.elapsed_seconds,
        }
