"""`design` and `analyze`: from an operating point to gains and what is known of them."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_integer
from drillctrl.base.kinds import checks_kinds
from drillctrl.delay.closing import gain_matrices
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.designs.drilling import ASKED, Drilling
from drillctrl.designs.loop_analysis import DEFAULT_ORDER
from drillctrl.designs.motion_design import fits_motion, motion_design, why_not_smooth
from drillctrl.designs.result import Analysis, Design, analysis_fields, assess
from drillctrl.designs.robustness import relative_radius
from drillctrl.designs.worst_case import WorstCase
from drillctrl.drilling.case import Where, as_case
from drillctrl.drilling.structures import as_structure
from drillctrl.simulation.controller import Controller
from drillctrl.spectrum.roots import spectral_abscissa
from drillctrl.strings.at_bit import string_at_bit
from drillctrl.synthesis import problem
from drillctrl.synthesis.family import LoopFamily, loop_family
from drillctrl.synthesis.objectives import EXACT, NO_REQUIREMENTS, Objective, Requirements


@checks_kinds
def design(
    point: Where,
    structure: str | FeedbackStructure = "case1",
    *,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    objective: Objective | None = None,
    requirements: Requirements = NO_REQUIREMENTS,
    seed: int = 0,
    trials: bool | None = True,
    surroundings: Mapping[str, Any] | None = None,
    workers: int = 1,
) -> Design:
    """Design bounded gains.

    They minimise the spectral abscissa of the closed loop; where that leaves smooth drilling
    unstable, the growth of torsional swings on the motion that is drilled with instead.

    Parameters
    ----------
    point : OperatingPoint, RigPoint, DelaySystem or Case
        What drills, and where: a point is the paper's plant there.
    structure : str or FeedbackStructure
        A preset (``"p"``, ``"case1"``, ``"pd"``, ``"case2"``) or a structure.
    bounds : mapping, optional
        Bounds that replace those of the structure; see `FeedbackStructure.with_bounds`.
    objective : Exact, Drilling, SemiDiscrete, WorstCase, Robust or HInfinity, optional
        What to minimise. Without one, `Exact`, and `Drilling` where that does not stabilise a
        plant of few states and trial runs are made.
    requirements : Requirements
        What must hold beside the bounds.
    seed : int
        Of the starting points. The same seed gives the same gains.
    trials : bool, optional
        Whether the gains are then tried on the nonlinear motion, beside no control.
    surroundings : mapping, optional
        Attributes of the `Controller` in these runs: limits, clock, delays.
    workers : int
        Processes that share the runs of `Drilling`.

    Returns
    -------
    Design
        The best gains found, whether or not they stabilise, meet the requirements, and do
        good on the nonlinear motion: look at ``stable``, ``requirements_met`` and
        ``recommended``.

    Raises
    ------
    InputError
        If the structure does not fit the plant, a bound is wrong, or a worst case is asked
        for where the physics is not known.
    """
    began = time.perf_counter()
    chosen = as_structure(structure).with_bounds(bounds or {})
    checked_integer("seed", seed, 0, 2**63 - 1)
    workers = checked_integer("workers", workers, 1, 1000)
    case, around = as_case(point), dict(surroundings or {})
    if case.plant is not None and "drive" not in chosen.inputs:
        # A top drive that nothing holds turns as it likes, whatever acts at the bit.
        string_at_bit(case.plant)
    # Names and ranges are checked before any work is done.
    Controller(chosen, *chosen.gains(chosen.lower), **around)

    def on_motion(objective: Drilling, why: str = ASKED) -> Design:
        return motion_design(
            case,
            chosen,
            objective,
            requirements,
            seed=seed,
            trials=bool(trials),
            surroundings=around,
            workers=workers,
            why=why,
        )

    if isinstance(objective, Drilling):
        return on_motion(objective)
    free, objective = objective is None, EXACT if objective is None else objective
    family = loop_family(case.system(chosen.inputs), chosen)
    others = []
    if isinstance(objective, WorstCase):
        for other in objective.around(case)[1:]:
            others.append(loop_family(other.system(chosen.inputs), chosen))
    solution = problem.solve(family, objective, requirements, others, seed)
    result = assess(case, chosen, *chosen.gains(solution.gains))
    alphas = [spectral_abscissa(other.loop(solution.gains)) for other in others]
    value = problem.reported_value(family, objective, solution.gains)
    if free and trials and not result.stable and fits_motion(case, chosen):
        made = on_motion(Drilling(), why_not_smooth(result))
        return replace(made, elapsed_seconds=time.perf_counter() - began)
    if trials:
        result = result.tried(**around)
    known = analysis_fields(result)
    known["elapsed_seconds"] = time.perf_counter() - began
    return Design(
        **known,
        objective=objective,
        objective_value=max([result.spectral_abscissa if value is None else value, *alphas]),
        requirements=requirements,
        requirements_met=_meets(result, requirements, family, solution.gains),
        optimality=solution.optimality,
        evaluations=solution.evaluations,
    )


def _meets(
    result: Analysis, requirements: Requirements, family: LoopFamily, gains: FloatArray
) -> bool:
    """Whether a design fulfils what was required, by exact abscissa and guaranteed radius."""
    decay, radius = requirements.decay, requirements.stability_radius
    peak, norm = requirements.input_gain, requirements.h_infinity
    return (
        (decay is None or result.spectral_abscissa + result.loop.abscissa_error <= -decay)
        and (radius is None or relative_radius(result).value >= radius)
        and (peak is None or (result.stable and problem.input_gain(family, gains) <= peak))
        and (norm is None or problem.norm_between(family, requirements.between, gains) <= norm)
    )


@checks_kinds
def analyze(
    point: Where,
    structure: str | FeedbackStructure | None = None,
    K1: npt.ArrayLike | None = None,
    K2: npt.ArrayLike | None = None,
    *,
    m: int | None = None,
    order: int = DEFAULT_ORDER,
    trials: bool | None = False,
) -> Analysis:
    """Analyse given gains, or the open loop.

    Parameters
    ----------
    point : OperatingPoint, RigPoint, DelaySystem or Case
        What drills, and where: a point is the paper's plant there.
    structure : str or FeedbackStructure, optional
        Without it, the open loop.
    K1, K2 : array_like, optional
        Gains in the order of the outputs; K2 may be left out where nothing delayed is fed
        back.
    m, order : int, optional
        Of the semi-discretisation that is reported; see `semidiscretize`.
    trials : bool, optional
        Whether the gains are tried on the nonlinear motion, beside no control.

    Raises
    ------
    InputError
        If gains are missing, too many, or not finite.
    """
    began = time.perf_counter()
    if structure is None:
        if K1 is not None or K2 is not None:
            raise InputError("structure", "(missing)", "given together with gains")
        none = np.zeros((0, 0))
        result = assess(as_case(point), None, none, none, m, order)
    else:
        chosen = as_structure(structure)
        if K1 is None:
            raise InputError("K1", "(missing)", f"given for structure {chosen.name}")
        if K2 is None and (chosen.K2_upper.any() or chosen.K2_lower.any()):
            raise InputError("K2", "(missing)", f"given for structure {chosen.name}")
        gains = gain_matrices(chosen, K1, K2)
        result = assess(as_case(point), chosen, *gains, m, order)
    if trials:
        result = result.tried()
    return replace(result, elapsed_seconds=time.perf_counter() - began)
