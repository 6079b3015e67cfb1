"""`compare`: candidates at one operating point, measured alike and sorted."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy.typing as npt

from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.designs.design import analyze, design
from drillctrl.designs.drilling import Drilling
from drillctrl.designs.margins import point_margins
from drillctrl.designs.motion_design import fits_motion, motion_design, why_not_smooth
from drillctrl.designs.result import Analysis
from drillctrl.designs.robustness import relative_radius
from drillctrl.designs.swings import Swing, measured_swings
from drillctrl.designs.trials import uncontrolled_runs
from drillctrl.drilling.case import Case, Where, as_case
from drillctrl.drilling.structures import as_structure
from drillctrl.robustness.loop_margins import LoopMargins, loop_margins
from drillctrl.robustness.margins import ParameterMargin, delay_margin
from drillctrl.simulation.outcome import Figures
from drillctrl.studies.comparison import OPEN_LOOP, SORTS, Comparison, Row
from drillctrl.studies.comparison_text import delay_room
from drillctrl.studies.measures import basin, respond
from drillctrl.synthesis.objectives import NO_REQUIREMENTS

if TYPE_CHECKING:
    from drillctrl.base.workers import Progress
    from drillctrl.charts.chart import StabilityChart

Given = tuple[str, str | FeedbackStructure, npt.ArrayLike, npt.ArrayLike | None]

DISTURBANCE = {"dx": 1.0, "dtheta": 1.0}
REGION = (("omega0", 0.5, 25.0), ("delta0", 0.0, 15.0))


def _subjects(
    case: Case,
    structures: Sequence[str | FeedbackStructure],
    given: Sequence[Given],
    bounds: Mapping[str, tuple[float, float]] | None,
    trials: bool | None,
    tell: Callable[[str], None],
) -> list[tuple[str, Analysis, bool]]:
    """Design, analyse and try the candidates, the open loop first."""
    open_loop = analyze(case)
    subjects: list[tuple[str, Analysis, bool]] = [(OPEN_LOOP, open_loop, False)]
    free: dict[str, Figures] | None = None
    swings: tuple[Swing, ...] | None = None

    def tried(candidate: Analysis) -> Analysis:
        nonlocal free
        if not trials:
            return candidate
        free = uncontrolled_runs(case) if free is None else free
        return candidate.tried(free)

    designed = [as_structure(s) for s in structures]
    known = dict.fromkeys(name for chosen in designed for name in chosen.entry_names)
    for name in bounds or {}:
        if name not in ("K1", "K2", *known):
            raise InputError("bound", name, f"on one of K1, K2, {', '.join(known)}")
    for chosen in designed:
        tell(f"design of {chosen.name}")
        mine = {
            name: limits
            for name, limits in (bounds or {}).items()
            if name in ("K1", "K2") or name in chosen.entry_names
        }
        made: Analysis = design(case, chosen, bounds=mine, trials=False)
        if trials and not made.stable and fits_motion(case, chosen):
            tell(f"design of {chosen.name} on the motion")
            swings = measured_swings(case, Drilling()) if swings is None else swings
            made = motion_design(
                case,
                chosen.with_bounds(mine),
                Drilling(),
                NO_REQUIREMENTS,
                seed=0,
                trials=True,
                surroundings={},
                workers=1,
                why=why_not_smooth(made),
                swings=swings,
            )
        else:
            made = tried(made)
        subjects.append((chosen.name, made, True))
    for label, structure, K1, K2 in given:
        tell(f"analysis of {label}")
        subjects.append((label, tried(analyze(case, structure, K1, K2)), False))
    labels = [label for label, _, _ in subjects]
    if len(set(labels)) < len(labels):
        raise InputError("structures", labels[1:], f"different names, none of them {OPEN_LOOP}")
    return subjects


@checks_kinds
def compare(
    point: Where,
    structures: Sequence[str | FeedbackStructure] = ("p", "case1", "pd", "case2"),
    *,
    given: Sequence[Given] = (),
    bounds: Mapping[str, tuple[float, float]] | None = None,
    disturbance: Mapping[str, float] | None = None,
    duration: float = 200.0,
    region: tuple[tuple[str, float, float], tuple[str, float, float]] | None = REGION,
    sort: str = "spectral_abscissa",
    trials: bool | None = True,
    progress: Progress | None = None,
) -> Comparison:
    """Compare feedback structures, and given gains, at an operating point.

    Parameters
    ----------
    point : OperatingPoint, RigPoint or Case
        What drills, and where.
    structures : sequence of str or FeedbackStructure
        Structures to design gains for.
    given : sequence of (label, structure, K1, K2)
        Gains from elsewhere.
    bounds : mapping, optional
        As in `design`, for the structures that have such gains.
    disturbance : mapping, optional
        Perturbation of steady drilling at t = 0 by state name, as ``initial`` of `Scenario`; by
        default that of the paper's Fig. 13, ``{"dx": 1, "dtheta": 1}``.
    duration : float
        Dimensionless time of the simulations.
    region : pair of (name, low, high), optional
        Axes of the charts of each candidate's gains; None draws none.
    sort : str
        A key of `SORTS`.
    trials : bool, optional
        Whether the gains are tried on the nonlinear motion, as by `design`.
    progress : callable, optional
        Called with what is being done, steps done and steps in all.

    Returns
    -------
    Comparison
        The open loop is among the rows.

    Raises
    ------
    InputError
        If a name is unknown or used twice, or a number is out of range.
    """
    began = time.perf_counter()
    case = as_case(point)
    case.physics("a comparison")
    if sort not in SORTS:
        raise InputError("sort", sort, f"one of {', '.join(SORTS)}")
    checked_number("duration", duration, 0.0, 1e5, open_low=True)
    pushed = dict(DISTURBANCE if disturbance is None else disturbance)
    if not any(pushed.values()):
        raise InputError("disturbance", pushed, "a perturbation that is not zero")
    steps = 2 * (len(structures) + len(given)) + 1
    done = [0]

    def tell(what: str) -> None:
        if progress is not None:
            progress(what, done[0], steps)
        done[0] += 1

    rows: list[Row] = []
    area = None
    for label, subject, designed in _subjects(case, structures, given, bounds, trials, tell):
        tell(f"measures of {label}")
        chart = _chart(case, subject, region)
        if label == OPEN_LOOP and chart is not None:
            area = chart.stable_area
        rows.append(
            Row(
                label,
                subject,
                designed,
                _margins(subject),
                relative_radius(subject),
                delay_margin(subject.system()) if subject.stable else None,
                _point_margins(subject),
                respond(subject, pushed, duration, "linear"),
                respond(subject, pushed, duration, "nonlinear"),
                basin(subject, pushed, duration),
                chart,
                chart.stable_area / area if chart is not None and area else None,
            )
        )
    if progress is not None:
        progress("done", steps, steps)
    rows.sort(key=lambda row: _rank(row, sort))
    elapsed = time.perf_counter() - began
    return Comparison(case, tuple(rows), sort, pushed, duration, elapsed)


def _point_margins(subject: Analysis) -> dict[str, ParameterMargin] | None:
    structure = subject.structure
    if structure is None or not subject.stable:
        return None
    return point_margins(subject.case, structure, subject.K1, subject.K2)


def _margins(subject: Analysis) -> LoopMargins | None:
    """Return the margins of a stable loop with one input."""
    structure = subject.structure
    if structure is None or not subject.stable or len(structure.inputs) != 1:
        return None
    return loop_margins(subject.plant, structure, subject.K1, subject.K2)


def _chart(
    case: Case,
    subject: Analysis,
    region: tuple[tuple[str, float, float], tuple[str, float, float]] | None,
) -> StabilityChart | None:
    if region is None:
        return None
    from drillctrl.charts.chart import chart

    if subject.structure is None:
        return chart(case, *region)
    return chart(case, *region, subject.structure, subject.K1, subject.K2)


def _rank(row: Row, sort: str) -> float:
    value: Any = row.to_dict()[sort]
    if isinstance(value, dict):
        value = delay_room(value)
    if value is None:
        return math.inf
    return float(-value if SORTS[sort] else value)
