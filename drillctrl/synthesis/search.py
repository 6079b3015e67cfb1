"""Deterministic global search: descents from many starts, sharpened on their active roots."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import UndecidedError
from drillctrl.spectrum.pseudospectral import own_abscissa
from drillctrl.spectrum.roots import dominant_roots
from drillctrl.synthesis.active import ActiveDesign, hypotheses, sharpen
from drillctrl.synthesis.boxes import nested_boxes
from drillctrl.synthesis.descent import bfgs
from drillctrl.synthesis.explicit import explicit_candidates
from drillctrl.synthesis.family import ActiveRoot, LoopFamily, loop_family
from drillctrl.synthesis.spread import spread_points
from drillctrl.synthesis.tracking import abscissa_along, coarse_family, exact_abscissa

# Relative distances up to which eigenvalues may be meant to coincide.
_WIDTHS = (0.05, 0.2, 0.5)
# How often a descent may be taken up again where sharpening led away from its end.
_DESCENTS = 4
# How often a collocation is drawn further left, and how far at most, over the longest delay.
_DEEPER, _LEFTMOST = 6, -200.0
# By so little other roots may lie right of those that were made to coincide.
_SHARP = 1e-7


@dataclass(frozen=True)
class Effort:
    """How long to search.

    Attributes
    ----------
    looked : int
        Points of the box at which the abscissa is evaluated.
    begun : int
        Descents begun at the best of them; with 0, none are looked at.
    steps : int
        Evaluations of each descent.
    sharpened : int
        Distinct ends that are sharpened on their active roots.
    rounds : int
        How often the configuration of active roots of an end is looked at again.
    """

    looked: int
    begun: int
    steps: int
    sharpened: int
    rounds: int


EFFORTS = {
    1: Effort(16, 2, 25, 1, 1),
    2: Effort(32, 5, 35, 2, 3),
    3: Effort(128, 10, 80, 5, 4),
    4: Effort(256, 18, 80, 6, 4),
    5: Effort(256, 18, 240, 6, 4),
}
# Of a plant of many states few descents are begun that go on for long.
_MANY_STATES = {
    1: Effort(12, 2, 25, 1, 1),
    2: Effort(16, 4, 35, 2, 3),
    3: Effort(24, 6, 160, 3, 4),
    4: Effort(24, 8, 200, 3, 4),
    5: Effort(24, 8, 240, 3, 4),
}


@dataclass(frozen=True, eq=False)
class Basin:
    """Where one descent ended.

    Attributes
    ----------
    gains : array, (k,)
        The gain vector.
    value : float
        Collocated spectral abscissa there.
    roots : tuple of ActiveRoot
        Active roots that it was sharpened on; empty if it was not.
    """

    gains: FloatArray
    value: float
    roots: tuple[ActiveRoot, ...]


@dataclass(frozen=True, eq=False)
class Search:
    """Result of a global search.

    Attributes
    ----------
    best : Basin
        The lowest end.
    basins : tuple of Basin
        Distinct ends, lowest first.
    hits : int
        How many descents ended in the lowest basin.
    evaluations : int
        Eigenvalue problems and root conditions solved.
    family : LoopFamily, optional
        The loops, with a collocation that resolves the rightmost roots of the best.
    """

    best: Basin
    basins: tuple[Basin, ...]
    hits: int
    evaluations: int
    family: LoopFamily | None = None


def global_search(
    family: LoopFamily,
    seed: int = 0,
    effort: Effort | None = None,
    known: Sequence[FloatArray] = (),
) -> Search:
    """Minimise the collocated abscissa over the box of the family's structure.

    Parameters
    ----------
    family : LoopFamily
        Loops to choose from.
    seed : int
        Scrambles the Halton points; the same seed gives the same result.
    effort : Effort, optional
        By default according to the number of gains.
    known : sequence of array, (k,)
        Gains that are good nearby; descents begin there too.
    """
    count = family.feedback.lower.size
    if count == 0:
        value, _ = family.abscissa(family.feedback.lower)
        only = Basin(family.feedback.lower, value, ())
        return Search(only, (only,), 1, 1)
    if effort is None:
        efforts = EFFORTS if family.signals is None else _MANY_STATES
        effort = efforts[min(count, max(efforts))]
    family = _near_what_is(family)
    search = _in_boxes(family, seed, effort, known)
    for _ in range(_DEEPER):
        if not effort.begun or _resolves(family, search.best.value):
            break
        # What lies left of all that the collocation shows looked alike: once more, from there.
        family = _near(family, search.best.value)
        best = search.best
        again = _in_boxes(family, seed, effort, [*known, best.gains])
        used = search.evaluations + again.evaluations
        search = replace(again if again.best.value <= best.value else search, evaluations=used)
        if search.best.value > best.value - 1e-9 * (1.0 + abs(best.value)):
            break
    return replace(search, family=family)


def _resolves(family: LoopFamily, alpha: float) -> bool:
    """Whether a collocation shows a rightmost root as far left as that."""
    longest = max([*family.plain.delays, *family.lags.tolist()], default=0.0)
    return not longest or (alpha - family.line) * longest > 0.9 * own_abscissa(family.degree)


def _near(family: LoopFamily, alpha: float) -> LoopFamily:
    longest = max([*family.plain.delays, *family.lags.tolist()])
    return loop_family(family.system, family.feedback, line=max(alpha, _LEFTMOST / longest))


def _near_what_is(family: LoopFamily) -> LoopFamily:
    """Return the family near the rightmost root of the loop of least gains, if that is far left."""
    centre = np.clip(0.0, family.feedback.lower, family.feedback.upper)
    if _resolves(family, family.value(centre)):
        return family
    alpha = family.exact(centre)
    return family if _resolves(family, alpha) else _near(family, alpha)


def _in_boxes(family: LoopFamily, seed: int, effort: Effort, known: Sequence[FloatArray]) -> Search:
    """Search from the gains that matter beside the plant up to the bounds."""
    inner = nested_boxes(family.system, family.feedback, family.line)[:-1] if effort.begun else []
    basins: list[Basin] = []
    evaluations = 0
    for feedback in inner:
        loops = loop_family(family.system, feedback, line=family.line)
        found = _in_box(loops, seed, effort, known)
        end = found.best.gains
        if ((end <= feedback.lower) | (end >= feedback.upper)).any():
            known = [*known, end]
        basins += found.basins
        evaluations += found.evaluations
    search = _in_box(family, seed, effort, known)
    if not inner:
        return search
    distinct = _distinct(sorted([*basins, *search.basins], key=lambda basin: basin.value))
    tolerance = 1e-6 * (1.0 + abs(distinct[0].value))
    hits = sum(basin.value <= distinct[0].value + tolerance for basin in [*basins, *search.basins])
    return Search(distinct[0], distinct, hits, evaluations + search.evaluations)


def _in_box(family: LoopFamily, seed: int, effort: Effort, known: Sequence[FloatArray]) -> Search:
    """Descend from many starts all over the box, and sharpen the ends."""
    lower, upper = family.feedback.lower, family.feedback.upper
    starts = [np.clip(gains, lower, upper) for gains in known]
    evaluations = 0
    if effort.begun:
        starts += list(starting_points(family, seed, effort))
        evaluations += 2 * effort.looked
    ends = []
    for start in starts:
        end = bfgs(abscissa_along(family), start, lower, upper, most=effort.steps)
        evaluations += end.evaluations
        ends.append(Basin(end.gains, end.value, ()))
    ends.sort(key=lambda basin: basin.value)
    sharp: list[Basin] = []
    rest: list[Basin] = []
    width = upper - lower
    for i, basin in enumerate(ends):
        # Another descent into the same corner teaches nothing.
        seen = any(np.abs((basin.gains - e.gains) / width).max() < 2e-3 for e in ends[:i])
        if len(sharp) == effort.sharpened or seen:
            # Exact: near a multiple root the collocation promises more than there is.
            exact = exact_abscissa(family)(basin.gains)
            rest.append(Basin(basin.gains, exact, ()))
            evaluations += 1
            continue
        better, used = _settle(family, basin, effort)
        evaluations += used
        sharp.append(better)
    everything = sorted([*sharp, *rest], key=lambda basin: basin.value)
    distinct = _distinct(everything)
    best = distinct[0]
    tolerance = 1e-6 * (1.0 + abs(best.value))
    hits = sum(basin.value <= best.value + tolerance for basin in everything)
    return Search(best, distinct, hits, evaluations)


def starting_points(
    family: LoopFamily, seed: int, effort: Effort, *, placed: bool = True
) -> FloatArray:
    """Return the best of points spread over the box and over its middle part.

    With ``placed`` gains that make roots coincide are among them.
    """
    lower, upper = family.feedback.lower, family.feedback.upper
    cube = spread_points(effort.looked, lower.size, seed)
    wide = lower + (upper - lower) * (0.01 + 0.98 * cube)
    # The box is generous: many useful gains are small against it.
    points = np.vstack([wide, np.clip(0.2 * wide, lower, upper)])
    inside = lower + (upper - lower) * np.array([[0.01], [0.99]])
    # Which are the best shows at a coarse collocation, too.
    coarse = coarse_family(family)
    values = coarse.abscissas(points)
    order = np.argsort(values, kind="stable")
    chosen = points[order[: effort.begun]]
    if placed:
        deepest = -4.0 * (1.0 + abs(float(values[order[0]])))
        explicit = explicit_candidates(coarse, deepest, 4.0, max(2, effort.begun // 6))
        chosen = np.vstack([explicit, chosen[: max(0, effort.begun - len(explicit))]])
    return np.asarray(np.clip(chosen, inside[0], inside[1]))


def _settle(family: LoopFamily, basin: Basin, effort: Effort) -> tuple[Basin, int]:
    """Sharpen an end; where that leads away from it, descend again from there."""
    lower, upper = family.feedback.lower, family.feedback.upper
    best, used = improve(family, basin, effort.rounds)
    before = basin.value
    for _ in range(_DESCENTS):
        if best.roots or best.value > before - 1e-4 * (1.0 + abs(before)):
            break
        before = best.value
        end = bfgs(abscissa_along(family), best.gains, lower, upper, most=effort.steps)
        again, more = improve(family, Basin(end.gains, end.value, ()), effort.rounds)
        used += end.evaluations + more
        best = min(best, again, key=lambda basin: basin.value)
    return best, used


def improve(family: LoopFamily, basin: Basin, rounds: int) -> tuple[Basin, int]:
    """Sharpen an end on every configuration of active roots that its spectrum suggests.

    Each success is looked at again: roots that have become active join the configuration.

    Returns
    -------
    Basin
        The best found; the given one if nothing is better.
    int
        Evaluations used.
    """
    # From here on abscissas are exact: the collocation's error is as large as what is gained.
    used, exact = 1, exact_abscissa(family)
    best = Basin(basin.gains, exact(basin.gains), ())
    tried: set[tuple[tuple[bool, int], ...]] = set()
    for _ in range(rounds):
        values = coarse_family(family).eigenvalues(best.gains)
        used += 1
        improved = False
        for width in _WIDTHS:
            for roots in hypotheses(values, best.gains.size, width * (1.0 + abs(best.value))):
                key = tuple((root.omega == 0.0, root.multiplicity) for root in roots)
                if key in tried:
                    continue
                tried.add(key)
                sharp = sharpen(family, best.gains, best.value, roots)
                value = exact(sharp.gains)
                used += sharp.evaluations + 1
                if _holds(family, sharp, value) and sharp.abscissa < best.value - 1e-12:
                    best = Basin(sharp.gains, sharp.abscissa, sharp.roots)
                    improved = True
                elif value < best.value - 1e-9:
                    best = Basin(sharp.gains, value, ())
                    improved = True
        if not improved:
            break
    return best, used


def follow(family: LoopFamily, start: FloatArray, roots: tuple[ActiveRoot, ...]) -> Basin | None:
    """Return the optimum near some gains with given active roots, if there is one.

    Parameters
    ----------
    family : LoopFamily
        Loops to choose from.
    start : array, (k,)
        Gains that are nearly optimal, such as those of a loop nearby.
    roots : tuple of ActiveRoot
        The roots that were active there.
    """
    lower, upper = family.feedback.lower, family.feedback.upper
    start = np.clip(start, lower, upper)
    sharp = sharpen(family, start, family.exact(start), roots)
    if not _holds(family, sharp, family.exact(sharp.gains)):
        return None
    return Basin(sharp.gains, sharp.abscissa, sharp.roots)


def _holds(family: LoopFamily, sharp: ActiveDesign, value: float) -> bool:
    """Whether the conditions are met and no root but the active ones lies further right.

    Roots that coincide are thrown apart by rounding, and so may show further right themselves.
    """
    blur = _blur(sharp.roots)
    if not (sharp.residual < 1e-9 and value < sharp.abscissa + blur):
        return False
    if value <= sharp.abscissa + _SHARP:
        return True
    places = sharp.abscissa + 1j * np.array([root.omega for root in sharp.roots])
    try:
        known = dominant_roots(family.loop(sharp.gains))
    except UndecidedError:
        return False
    others = [root for root in known if np.abs(root.value - places).min() > blur]
    return all(root.rightmost <= sharp.abscissa + _SHARP for root in others)


def _blur(roots: tuple[ActiveRoot, ...]) -> float:
    """What the abscissa shows of conditions that hold to rounding: its k-th root."""
    return float(1e-9 ** (1.0 / max(root.multiplicity for root in roots)))


def _distinct(basins: list[Basin]) -> tuple[Basin, ...]:
    kept: list[Basin] = []
    for basin in basins:
        tolerance = 1e-4 * (1.0 + abs(basin.value))
        if all(abs(basin.value - other.value) > tolerance for other in kept):
            kept.append(basin)
    return tuple(kept)
