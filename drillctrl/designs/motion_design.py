"""Designs on the motion that is drilled with: measure it, find gains, let runs choose."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.base.workers import open_executor
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.delay.system import DelaySystem
from drillctrl.designs.authority import Candidate, between, candidates, irregular, tried
from drillctrl.designs.controlled_swings import OnMotion, followed_swings
from drillctrl.designs.drilling import ASKED, Drilling
from drillctrl.designs.result import Analysis, Design, analysis_fields, assess
from drillctrl.designs.swings import Swing, largest_growth, measured_swings
from drillctrl.drilling.case import Case
from drillctrl.motion.loop import torsional_system
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.outcome import Figures
from drillctrl.synthesis.objectives import Requirements

# States of a plant whose motion is measured without being asked.
_FEW = 12
# Of the bounds, within which gains are looked for.
SHARES = tuple(2.0**-k for k in range(8))
# Of a bound: gains below are none.
_NONE = 1e-6
NONE_HELP = "no gains within the bounds do better here than no control, to which the search returns"


def fits_motion(case: Case, structure: FeedbackStructure) -> bool:
    """Whether a structure closes a torsional loop about an axial orbit that is soon measured."""
    if case.plant is None or case.point is None or not case.point.delta0 > 0.0:
        return False
    if len(case.plant.state_names) > _FEW:
        return False
    try:
        system = torsional_system(case, 0j, 1.0)
    except InputError:
        return False
    return _within(system, structure)


def _within(torsion: DelaySystem, structure: FeedbackStructure) -> bool:
    drives, sees = set(torsion.input_names), set(torsion.output_names)
    return set(structure.inputs) <= drives and set(structure.outputs) <= sees


def _are_none(structure: FeedbackStructure, gains: FloatArray) -> bool:
    """Whether gains are zero but for the rounding of their search."""
    return bool((np.abs(gains) <= _NONE * (structure.upper - structure.lower)).all())


def motion_design(
    case: Case,
    structure: FeedbackStructure,
    objective: Drilling,
    requirements: Requirements,
    *,
    seed: int,
    trials: bool,
    surroundings: Mapping[str, Any],
    workers: int,
    why: str = ASKED,
    swings: tuple[Swing, ...] | None = None,
) -> Design:
    """Return the gains with which torsional swings decay soonest, as far as runs bear it out.

    Parameters
    ----------
    case : Case
        What drills, and where.
    structure : FeedbackStructure
        With its bounds.
    objective : Drilling
        Which swings and points.
    requirements : Requirements
        Of the torsional loop.
    seed : int
        Of the starting points.
    trials : bool
        Whether runs choose how much of the bounds is used; else it is the most that keeps the
        modes where the bit's answer is known.
    surroundings : mapping
        Limits, clock and delays of the controller in the runs.
    workers : int
        Processes.
    why : str
        Why the gains are designed for the motion.
    swings : tuple of Swing, optional
        What `measured_swings` returned for the case; it does not depend on the structure.

    Raises
    ------
    InputError
        If there is no plant, nothing is cut, or the structure is not torsional alone.
    """
    began = time.perf_counter()
    case.physics(f"objective {objective.name}")
    torsion = torsional_system(case, 0j, 1.0)
    if not _within(torsion, structure):
        drives, sees = ", ".join(torsion.input_names), ", ".join(torsion.output_names)
        wanted = f"one that drives {drives} and feeds back {sees} alone, with {objective.name}"
        raise InputError("structure", structure.name, wanted)
    Controller(structure, *structure.gains(structure.lower), **surroundings)
    with open_executor(workers, None) as executor:
        if swings is None:
            swings = measured_swings(case, objective, executor)
        without = largest_growth(swings)
        found = candidates(case, objective, swings, structure, requirements, seed, SHARES)
        if trials:
            runs: dict[str, Figures] = {}
            given = surroundings, executor, runs
            found = tried(case, objective, structure, found, without, *given)
            if irregular(found):
                more = candidates(
                    case, objective, swings, structure, requirements, seed, between(found, SHARES)
                )
                found = sorted([*found, *more], key=lambda each: -each.share)
                found = tried(case, objective, structure, found, without, *given)
    best: Candidate = found[0]
    gains = best.solution.gains
    known = analysis_fields(assess(case, structure, *structure.gains(gains)))
    if best.verdict is not None:
        known["verdict"] = best.verdict
        if not best.verdict.recommended and _are_none(structure, gains):
            known["verdict"] = replace(best.verdict, reason=NONE_HELP)
    made = followed_swings(case, objective, swings, structure, gains)
    growth = max((each.growth for each in made), default=best.growth)
    known["elapsed_seconds"] = time.perf_counter() - began
    return Design(
        **known,
        objective=objective,
        objective_value=growth,
        requirements=requirements,
        requirements_met=best.met,
        optimality=best.solution.optimality,
        evaluations=sum(each.solution.evaluations for each in found),
        on_motion=OnMotion(
            why,
            best.share,
            growth,
            without,
            made,
            tuple(swing for swing in swings if not swing.known),
        ),
    )


def why_not_smooth(exact: Analysis) -> str:
    """Say why smooth drilling is not what is designed for."""
    return (
        "no gains were found with which smooth drilling is stable "
        f"(best α = {exact.spectral_abscissa:.4g})"
    )
