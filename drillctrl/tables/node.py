"""The design of one node of a table: plain data in and out, so that any process can do it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drillctrl.analysis import analyze_loop
from drillctrl.delay_system import plant_system
from drillctrl.designing import design
from drillctrl.feedback import FeedbackStructure
from drillctrl.operating_point import OperatingPoint
from drillctrl.optimisation.certificate import certify_optimality
from drillctrl.optimisation.family import loop_family
from drillctrl.optimisation.objectives import EXACT, Exact, Objective
from drillctrl.optimisation.rounding import hold_multiple_root
from drillctrl.optimisation.search import EFFORTS, Effort, global_search
from drillctrl.spectrum.characteristic import FloatArray

# Gains of neighbours lie in the basins that matter; nothing else is begun from. Only the
# lowest end is sharpened: where that is the wrong one, the node stands out afterwards.
_CONTINUED = {
    1: Effort(0, 0, 25, 1, 1),
    2: Effort(0, 0, 35, 2, 2),
    3: Effort(0, 0, 60, 1, 2),
    4: Effort(0, 0, 60, 1, 2),
}
# Share of its range by which a descent begins inside a bound: on it, it could never leave.
_INSIDE = 0.05
_KEPT = 4


@dataclass(frozen=True, eq=False)
class NodeTask:
    """What to design at a node.

    Attributes
    ----------
    index : int
        Of the node.
    point : OperatingPoint
        Where it is.
    structure : FeedbackStructure
        With its bounds.
    seed : int
        Of the starting points.
    known : tuple of array, (k,)
        Gains of neighbours; without any the whole box is searched.
    objective : Objective
        What is minimised; only the exact abscissa begins at ``known``.
    """

    index: int
    point: OperatingPoint
    structure: FeedbackStructure
    seed: int
    known: tuple[FloatArray, ...] = ()
    objective: Objective = EXACT


@dataclass(frozen=True, eq=False)
class NodeDesign:
    """Gains of a node and what is known of them.

    Attributes
    ----------
    index : int
        Of the node.
    gains : array, (k,)
        The best gain vector found.
    spectral_abscissa : float
        α with them.
    stationarity : float
        Residual of the first-order conditions; see `OptimalityCertificate`.
    basins : tuple of array, (k,)
        Ends of the other descents, best first.
    """

    index: int
    gains: FloatArray
    spectral_abscissa: float
    stationarity: float
    basins: tuple[FloatArray, ...]


def design_node(task: NodeTask) -> NodeDesign:
    """Search for the best gains at a node, from its neighbours' if there are any."""
    if not isinstance(task.objective, Exact):
        return _design_otherwise(task)
    family = loop_family(plant_system(task.point, task.structure.inputs), task.structure)
    lower, upper = task.structure.lower, task.structure.upper
    margin = _INSIDE * (upper - lower)
    known = [np.clip(gains, lower + margin, upper - margin) for gains in task.known]
    count = min(lower.size, 4)
    effort = _CONTINUED.get(count) if known else EFFORTS.get(count)
    # A sharpening step that overshoots far left overflows; what it finds is then refused.
    with np.errstate(over="ignore", invalid="ignore"):
        search = global_search(family, task.seed, effort, known)
    gains = hold_multiple_root(family, search.best)
    return NodeDesign(
        task.index,
        gains,
        analyze_loop(family.loop(gains)).spectral_abscissa,
        certify_optimality(family, gains, search).stationarity,
        tuple(basin.gains for basin in search.basins[1:_KEPT]),
    )


def _design_otherwise(task: NodeTask) -> NodeDesign:
    """Minimise another objective than the abscissa, by the same route as `design`."""
    result = design(task.point, task.structure, objective=task.objective, seed=task.seed)
    assert result.optimality is not None
    return NodeDesign(
        task.index,
        task.structure.vector(result.K1, result.K2),
        result.spectral_abscissa,
        result.optimality.stationarity,
        (),
    )


@dataclass(frozen=True)
class NodeCheck:
    """Independent answer on the loop at a node: roots, and their count."""

    index: int
    spectral_abscissa: float
    stable: bool
    certified: bool


def check_node(task: NodeTask) -> NodeCheck:
    """Analyse the loop that the first known gains close at a node."""
    family = loop_family(plant_system(task.point, task.structure.inputs), task.structure)
    loop = analyze_loop(family.loop(task.known[0]))
    return NodeCheck(task.index, loop.spectral_abscissa, loop.stable, loop.certificate.agrees)
