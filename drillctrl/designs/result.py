"""The result of `design` and `analyze`: gains, and what is known of the loop they close."""

from __future__ import annotations

import functools
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_number
from drillctrl.delay.closing import close_loop
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.delay.system import DelaySystem
from drillctrl.designs.fragility import Fragility, fragility, perturbed_plants
from drillctrl.designs.loop_analysis import (
    DEFAULT_ORDER,
    LoopAnalysis,
    SpectralRadius,
    analyze_loop,
    discretised_radius,
)
from drillctrl.designs.margins import point_margins
from drillctrl.designs.mode_shift import ModeShift, mode_shifts
from drillctrl.designs.trials import Trial
from drillctrl.designs.verdict import UNTRIED, Verdict, try_gains
from drillctrl.drilling.case import Case
from drillctrl.drilling.plant import paper_plant
from drillctrl.drilling.point import OperatingPoint, RigPoint
from drillctrl.robustness.margins import DelayMargin, ParameterMargin, delay_margin
from drillctrl.robustness.radius import StabilityRadius, stability_radius
from drillctrl.simulation.outcome import Figures
from drillctrl.synthesis.alternative import robust_alternative
from drillctrl.synthesis.boundary import BoundaryDecision, decide
from drillctrl.synthesis.certificate import OptimalityCertificate
from drillctrl.synthesis.family import loop_family
from drillctrl.synthesis.objectives import NO_REQUIREMENTS, Exact, Objective, Requirements

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from drillctrl.designs.remedies import Remedy
    from drillctrl.spectrum.proof import Proof

# How far left of a design its explicit boundary is asked for better gains.
_LEFT = 1e-3


@dataclass(frozen=True, eq=False)
class Design:
    """Gains for one plant, and what is known of the loop they close.

    Attributes
    ----------
    case : Case
        What the gains are meant for: physics, point and rig as far as they are known.
    plant : DelaySystem
        Its linear system, with the inputs that are driven.
    structure : FeedbackStructure or None
        What is fed back; None for an open loop.
    K1, K2 : array, (m, p)
        Gains on Y(t) and on Y(t − τ0).
    loop : LoopAnalysis
        With the feedback.
    m : int or None
        Intervals of the semi-discretisation that is reported; None: chosen to suit.
    order : int
        Its order.
    objective : Objective or None
        What the gains minimise; None for given gains.
    objective_value : float or None
        Its value at the gains.
    requirements : Requirements
        What was required beside.
    requirements_met : bool
        Whether the loop fulfils them.
    verdict : Verdict
        What trial runs on the nonlinear motion say of the gains, if there were any.
    optimality : OptimalityCertificate or None
        Evidence that no better gains lie within the bounds; None for given gains.
    evaluations : int
        Eigenvalue problems that the search solved; 0 for given gains.
    elapsed_seconds : float
        Wall time.
    seek : callable or None
        Finds `remedies` when they are asked for.
    """

    case: Case
    plant: DelaySystem
    structure: FeedbackStructure | None
    K1: FloatArray
    K2: FloatArray
    loop: LoopAnalysis
    m: int | None = None
    order: int = DEFAULT_ORDER
    objective: Objective | None = None
    objective_value: float | None = None
    requirements: Requirements = NO_REQUIREMENTS
    requirements_met: bool = True
    verdict: Verdict = UNTRIED
    optimality: OptimalityCertificate | None = None
    evaluations: int = 0
    elapsed_seconds: float = 0.0
    seek: Callable[[Design], tuple[Remedy, ...]] | None = None

    @property
    def point(self) -> OperatingPoint | None:
        """Where it drills, if the physics is known."""
        return self.case.point

    @property
    def rig_point(self) -> RigPoint | None:
        """The rig at its point, if one was given."""
        return self.case.rig_point

    @property
    def spectral_abscissa(self) -> float:
        """α of the closed loop, per unit of dimensionless time."""
        return self.loop.spectral_abscissa

    @property
    def stable(self) -> bool:
        """Whether the closed loop is asymptotically stable."""
        return self.loop.stable

    @property
    def recommended(self) -> bool | None:
        """Whether trial runs speak for the gains; None where they were not tried."""
        return self.verdict.recommended

    @property
    def reason(self) -> str:
        """Why they are recommended, refused or untried."""
        return self.verdict.reason

    @property
    def trials(self) -> tuple[Trial, ...]:
        """Trial runs with the gains and without control."""
        return self.verdict.trials

    def tried(self, uncontrolled: dict[str, Figures] | None = None) -> Design:
        """Return the same gains after trial runs on the nonlinear motion.

        Parameters
        ----------
        uncontrolled : dict, optional
            What `uncontrolled_runs` returned for the point.
        """
        verdict = try_gains(
            self.point,
            self.structure,
            self.K1,
            self.K2,
            self.stable,
            known_plant=self.case.plant == paper_plant(),
            uncontrolled=uncontrolled,
        )
        return replace(self, verdict=verdict)

    @functools.cached_property
    def modes_worse(self) -> tuple[ModeShift, ...]:
        """Modes that decay more slowly with the gains than without; see `mode_shifts`."""
        if self.structure is None:
            return ()
        known = () if self.case.plant is None else self.case.plant.linear.states
        quantities = tuple(state.quantity for state in known)
        shifts = mode_shifts(self.plant, self.structure, self.K1, self.K2, quantities)
        return tuple(shift for shift in shifts if shift.worse)

    @property
    def minimises_alpha(self) -> bool:
        """Whether the gains minimise the spectral abscissa, and nothing was required beside."""
        return isinstance(self.objective, Exact) and not self.requirements

    @functools.cached_property
    def spectral_radius(self) -> SpectralRadius | None:
        """ρ(D) of the semi-discretised loop; None without delay."""
        return discretised_radius(self.system(), self.m, self.order)

    @functools.cached_property
    def open_loop(self) -> LoopAnalysis:
        """Without the feedback."""
        return self.loop if self.structure is None else analyze_loop(self.plant)

    @functools.cached_property
    def fragility(self) -> Fragility | None:
        """The closed loop when gains, rock or delay are a little off; None without feedback."""
        if self.structure is None:
            return None
        return fragility(self.plant, self._perturbed(), self.structure, self.K1, self.K2)

    @functools.cached_property
    def stability_radius(self) -> StabilityRadius:
        """Smallest error of the plant's matrices, relative to their norms, that destabilises."""
        loop = self.system()
        matrices = [self.plant.A0, *map(self.plant.delayed_matrix, loop.delays)]
        return stability_radius(loop, [float(np.linalg.norm(m, 2)) for m in matrices])

    @functools.cached_property
    def boundary(self) -> BoundaryDecision | None:
        """What the explicit boundary in the space of one or two gains says of the bounds.

        Whether any gains stabilise, if these do not; else whether any put all roots left of
        a line a thousandth left of this design's abscissa. None for given gains, where α is
        not what was minimised, and where there are more gains or several inputs.
        """
        if self.structure is None or self.optimality is None:
            return None
        if self.stable and not self.minimises_alpha:
            return None
        alpha = self.spectral_abscissa
        line = alpha - _LEFT * (1.0 + abs(alpha)) if self.stable else 0.0
        return decide(loop_family(self.plant, self.structure), line)

    @functools.cached_property
    def delay_margin(self) -> DelayMargin | None:
        """How wrong the delays may be; None for a loop that is unstable or without delay."""
        loop = self.system()
        return delay_margin(loop) if self.stable and loop.delays else None

    @functools.cached_property
    def point_margins(self) -> dict[str, ParameterMargin] | None:
        """How wrong ψ, δ0 and ω0 may each be; None for an unstable loop or without a point."""
        if not self.stable or not self.case.drills or self.structure is None:
            return None
        return point_margins(self.case, self.structure, self.K1, self.K2)

    @functools.cached_property
    def remedies(self) -> tuple[Remedy, ...]:
        """What else stabilises the point, if these gains do not."""
        return () if self.seek is None else self.seek(self)

    def _perturbed(self) -> dict[str, DelaySystem]:
        return perturbed_plants(self.plant, self.case)

    def robust_alternative(self, give_up: float = 0.05) -> Design:
        """Return gains that decay almost as fast here, and faster when something is off.

        Parameters
        ----------
        give_up : float
            Share of the decay rate −α that may be lost, in (0, 1).

        Returns
        -------
        Design
            Within the same bounds, with α ≤ (1 − give_up) times this one's, the lowest
            abscissa that was found for the worst of: nominal, ψ 5 % lower or higher, delay
            2 % shorter or longer.

        Raises
        ------
        InputError
            If this design has no feedback or is not stable.
        """
        share = checked_number("give_up", give_up, 0.0, 1.0, open_low=True)
        if self.structure is None or not self.stable:
            raise InputError("design", "not a stabilised loop", "one, to have an alternative")
        began = time.perf_counter()
        family = loop_family(self.plant, self.structure)
        here = self.structure.vector(self.K1, self.K2)
        perturbed = [
            loop_family(plant, self.structure, family.degree)
            for plant in self._perturbed().values()
        ]
        gains = robust_alternative(family, perturbed, here, self.spectral_abscissa, share)
        result = assess(self.case, self.structure, *self.structure.gains(gains))
        if self.trials:
            result = result.tried()
        return replace(result, elapsed_seconds=time.perf_counter() - began)

    def prove(self) -> Proof:
        """Prove the number of roots right of the certificate's line; see `prove_count`."""
        from drillctrl.spectrum.proof import prove_count

        return prove_count(self.system(), self.loop.certificate.line)

    def system(self) -> DelaySystem:
        """Return the closed loop."""
        return closed_loop(self.plant, self.structure, self.K1, self.K2)

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields of the command line."""
        from drillctrl.designs.fields import design_fields

        return design_fields(self)

    def summary(self) -> str:
        """Return a text for people, in rig units too where a rig was given."""
        from drillctrl.designs.report import design_summary

        return design_summary(self)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the rightmost roots with and without feedback; see `plot_roots`."""
        from drillctrl.designs.figure import plot_roots

        loops = {"without control": self.plant}
        if self.structure is not None:
            loops[f"with {self.structure.name}"] = self.system()
        return plot_roots(loops, self.loop.dominant_roots, self.point, ax)

    def __repr__(self) -> str:
        name = self.structure.name if self.structure else "open loop"
        gains = f"K1={self.K1.ravel().tolist()}, K2={self.K2.ravel().tolist()}"
        return f"<Design {name}: {gains}, α={self.spectral_abscissa:.6g}, stable={self.stable}>"


def closed_loop(
    plant: DelaySystem, feedback: FeedbackStructure | None, K1: FloatArray, K2: FloatArray
) -> DelaySystem:
    """Return the loop around a plant; the plant itself without feedback."""
    return plant if feedback is None else close_loop(plant, feedback, K1, K2)


def assess(
    case: Case,
    feedback: FeedbackStructure | None,
    K1: FloatArray,
    K2: FloatArray,
    m: int | None = None,
    order: int = DEFAULT_ORDER,
) -> Design:
    """Analyse the loop that the gains close, beside the open loop."""
    plant = case.system(None if feedback is None else feedback.inputs)
    loop = analyze_loop(closed_loop(plant, feedback, K1, K2))
    return Design(case, plant, feedback, K1, K2, loop, m, order)
