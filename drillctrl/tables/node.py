"""The design of one node of a table: plain data in and out, so that any process can do it."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.checkpoint import Checkpoint
from drillctrl.delay.structure import FeedbackStructure, no_control
from drillctrl.designs.design import design
from drillctrl.designs.drilling import Drilling
from drillctrl.designs.loop_analysis import analyze_loop
from drillctrl.designs.verdict import try_gains
from drillctrl.drilling.case import Case
from drillctrl.synthesis.certificate import certify_optimality
from drillctrl.synthesis.family import ActiveRoot, LoopFamily, loop_family
from drillctrl.synthesis.objectives import EXACT, Exact, Objective
from drillctrl.synthesis.rounding import hold_multiple_root
from drillctrl.synthesis.search import EFFORTS, Effort, Search, follow, global_search

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
# Residual of the first-order conditions up to which an optimum counts as followed.
_STATIONARY = 1e-6
_UNKNOWN = float(np.finfo(float).max)


@dataclass(frozen=True, eq=False)
class NodeTask:
    """What to design at a node.

    Attributes
    ----------
    index : int
        Of the node.
    case : Case
        What drills there.
    structure : FeedbackStructure
        With its bounds.
    seed : int
        Of the starting points.
    known : tuple of array, (k,)
        Gains of neighbours; without any the whole box is searched.
    trials : bool
        Whether gains are tried on the nonlinear motion when they are checked.
    active : tuple of tuple of ActiveRoot
        The active roots there, as many as ``known`` or none; each may be empty.
    objective : Objective
        What is minimised; only the exact abscissa begins at ``known``.
    surroundings : mapping
        Limits, clock and delays of the controller in trial runs.
    """

    index: int
    case: Case
    structure: FeedbackStructure
    seed: int
    known: tuple[FloatArray, ...] = ()
    objective: Objective = EXACT
    trials: bool = False
    active: tuple[tuple[ActiveRoot, ...], ...] = ()
    surroundings: Mapping[str, float] = field(default_factory=dict)


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
    roots : tuple of ActiveRoot
        The active ones, where the gains were sharpened on them.
    refusal : str or None
        Why a design on the motion that is drilled with is not recommended.
    """

    index: int
    gains: FloatArray
    spectral_abscissa: float
    stationarity: float
    basins: tuple[FloatArray, ...]
    roots: tuple[ActiveRoot, ...] = ()
    refusal: str | None = None


def design_node(task: NodeTask) -> NodeDesign:
    """Find the best gains at a node, from its neighbours' if there are any.

    Where the neighbours' active roots stay active, their optimum is followed; elsewhere
    descents begin at their gains, or all over the box.
    """
    if not isinstance(task.objective, Exact):
        return _design_otherwise(task)
    family = loop_family(task.case.system(task.structure.inputs), task.structure)
    # A sharpening step that overshoots far left overflows; what it finds is then refused.
    with np.errstate(over="ignore", invalid="ignore"):
        search = _followed(family, task) or _searched(family, task)
    gains = hold_multiple_root(family, search.best)
    return NodeDesign(
        task.index,
        gains,
        analyze_loop(family.loop(gains)).spectral_abscissa,
        certify_optimality(family, gains, search).stationarity,
        tuple(basin.gains for basin in search.basins[1:_KEPT]),
        search.best.roots,
    )


def _followed(family: LoopFamily, task: NodeTask) -> Search | None:
    """Follow the optimum of every neighbour, or None where one of them ends."""
    basins = []
    for gains, roots in zip(task.known, task.active, strict=False):
        basin = follow(family, gains, roots) if roots else None
        if basin is None:
            return None
        alone = Search(basin, (basin,), 1, 1)
        if not certify_optimality(family, basin.gains, alone).stationarity < _STATIONARY:
            return None
        basins.append(basin)
    if not basins:
        return None
    basins.sort(key=lambda basin: basin.value)
    return Search(basins[0], tuple(basins), 1, len(basins))


def _searched(family: LoopFamily, task: NodeTask) -> Search:
    """Descend from the neighbours' gains, or from all over the box."""
    lower, upper = task.structure.lower, task.structure.upper
    margin = _INSIDE * (upper - lower)
    known = [np.clip(gains, lower + margin, upper - margin) for gains in task.known]
    effort = _CONTINUED.get(min(lower.size, 4)) if known else EFFORTS.get(min(lower.size, 5))
    return global_search(family, task.seed, effort, known)


def _design_otherwise(task: NodeTask) -> NodeDesign:
    """Minimise another objective than the abscissa, by the same route as `design`."""
    on_motion = isinstance(task.objective, Drilling)
    result = design(
        task.case,
        task.structure,
        objective=task.objective,
        seed=task.seed,
        trials=on_motion,
        surroundings=task.surroundings,
    )
    return NodeDesign(
        task.index,
        task.structure.vector(result.K1, result.K2),
        result.spectral_abscissa,
        result.optimality.stationarity,
        (),
        refusal=result.reason if on_motion and not result.recommended else None,
    )


@dataclass(frozen=True)
class NodeCheck:
    """Independent answer on the loop at a node: roots, their count, and trial runs.

    Where ``refusal`` says why trial runs refused the gains, the rest is of no control. ``caution``
    is that of their `Verdict`.
    """

    index: int
    spectral_abscissa: float
    abscissa_error: float
    stable: bool
    certified: bool
    refusal: str | None = None
    caution: str | None = None


def check_node(task: NodeTask) -> NodeCheck:
    """Analyse the loop that the first known gains close at a node, and try them if asked."""
    structure, gains = task.structure, task.known[0]
    family = loop_family(task.case.system(structure.inputs), structure)
    loop = analyze_loop(family.loop(gains))
    off = no_control(structure)
    refusal = caution = None
    if task.trials and (gains != off).any():
        verdict = try_gains(
            task.case,
            structure,
            *structure.gains(gains),
            loop.stable,
            spare=True,
            surroundings=task.surroundings,
        )
        caution = verdict.caution
        if verdict.refused:
            refusal, loop = verdict.reason, analyze_loop(family.loop(off))
    return NodeCheck(
        task.index,
        loop.spectral_abscissa,
        # Files hold finite numbers only.
        float(np.nan_to_num(loop.abscissa_error, nan=_UNKNOWN, posinf=_UNKNOWN)),
        loop.stable,
        loop.certificate.agrees,
        refusal,
        caution,
    )


def find_design(checkpoint: Checkpoint, task: NodeTask) -> NodeDesign | None:
    """Return the design of a task if a checkpoint knows it."""
    entry = checkpoint.find(task_key(task))
    if entry is None:
        return None
    return NodeDesign(
        task.index,
        np.array(entry["gains"]),
        entry["spectral_abscissa"],
        entry["stationarity"],
        tuple(np.array(basin) for basin in entry["basins"]),
        tuple(ActiveRoot(*root) for root in entry["roots"]),
        entry["refusal"],
    )


def keep_design(checkpoint: Checkpoint, task: NodeTask, design: NodeDesign) -> None:
    """Append a design; JSON keeps every bit of its numbers.

    Raises
    ------
    InputError
        If the disk is full or the file is gone.
    """
    entry = {
        "gains": design.gains.tolist(),
        "spectral_abscissa": float(design.spectral_abscissa),
        "stationarity": float(design.stationarity),
        "basins": [basin.tolist() for basin in design.basins],
        "roots": [dataclasses.astuple(root) for root in design.roots],
        "refusal": design.refusal,
    }
    checkpoint.keep(task_key(task), entry)


def task_key(task: NodeTask) -> str:
    """Return a hash of all that a design depends on."""
    structure = {
        name: value.tolist() if isinstance(value, np.ndarray) else value
        for name, value in (
            (field.name, getattr(task.structure, field.name))
            for field in dataclasses.fields(task.structure)
        )
        if name != "ties"
    }
    ties = [dataclasses.astuple(tie) for tie in task.structure.ties]
    known = [gains.tolist() for gains in task.known]
    plant, where = task.case.physics("a table")
    point = (*dataclasses.astuple(where), plant.text)
    active = [[dataclasses.astuple(root) for root in roots] for roots in task.active]
    rest = task.seed, known, active, task.objective, sorted(task.surroundings.items())
    text = repr((task.index, point, structure, ties, *rest))
    return hashlib.sha256(text.encode("utf-8")).hexdigest()
