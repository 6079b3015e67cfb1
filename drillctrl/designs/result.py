"""The results of `analyze` and `design`: gains, and what is known of the loop they close."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Self

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.delay.closing import close_loop
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.delay.system import DelaySystem
from drillctrl.designs.loop_analysis import (
    DEFAULT_ORDER,
    LoopAnalysis,
    SpectralRadius,
    analyze_loop,
    discretised_radius,
)
from drillctrl.designs.mode_shift import ModeShift, mode_shifts
from drillctrl.designs.trials import Trial
from drillctrl.designs.verdict import UNTRIED, Verdict, try_gains
from drillctrl.drilling.case import Case
from drillctrl.drilling.point import OperatingPoint, RigPoint
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.outcome import Figures
from drillctrl.synthesis.certificate import OptimalityCertificate
from drillctrl.synthesis.objectives import NO_REQUIREMENTS, Exact, Objective, Requirements

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from drillctrl.spectrum.proof import Proof


@dataclass(frozen=True, eq=False)
class Analysis:
    """A loop around one plant, and what is known of it.

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
    loop, open_loop : LoopAnalysis
        With and without the feedback.
    spectral_radius : SpectralRadius or None
        ρ(D) of the semi-discretised loop; None without delay.
    modes_worse : tuple of ModeShift
        Modes that decay more slowly with the gains than without; see `mode_shifts`.
    verdict : Verdict
        What trial runs on the nonlinear motion say of the gains, if there were any.
    elapsed_seconds : float
        Wall time.
    """

    case: Case
    plant: DelaySystem
    structure: FeedbackStructure | None
    K1: FloatArray
    K2: FloatArray
    loop: LoopAnalysis
    open_loop: LoopAnalysis
    spectral_radius: SpectralRadius | None
    modes_worse: tuple[ModeShift, ...] = ()
    verdict: Verdict = UNTRIED
    elapsed_seconds: float = 0.0

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

    def tried(self, uncontrolled: dict[str, Figures] | None = None) -> Self:
        """Return the same gains after trial runs on the nonlinear motion.

        Parameters
        ----------
        uncontrolled : dict, optional
            What `uncontrolled_runs` returned for the point.
        """
        verdict = try_gains(
            self.case, self.structure, self.K1, self.K2, self.stable, uncontrolled=uncontrolled
        )
        return replace(self, verdict=verdict)

    def controller(self, **surroundings: Any) -> Controller:
        """Return what closes the loop in the simulator, on the plant that it was designed for.

        Parameters
        ----------
        **surroundings
            Attributes of `Controller`: clock, delays, limits and the rest.

        Raises
        ------
        InputError
            If there is no feedback, or a value is out of range.
        """
        if self.structure is None:
            raise InputError("result", "an open loop", "one with feedback")
        return Controller(self.structure, self.K1, self.K2, plant=self.case.plant, **surroundings)

    def prove(self) -> Proof:
        """Prove the number of roots right of the certificate's line; see `prove_count`."""
        from drillctrl.spectrum.proof import prove_count

        return prove_count(self.system(), self.loop.certificate.line)

    def system(self) -> DelaySystem:
        """Return the closed loop."""
        return closed_loop(self.plant, self.structure, self.K1, self.K2)

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields of the command line."""
        from drillctrl.designs.fields import result_fields

        return result_fields(self)

    def summary(self) -> str:
        """Return a text for people, in rig units too where a rig was given."""
        from drillctrl.designs.words import result_lines, set_out

        return set_out(result_lines(self))

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
        kind = type(self).__name__
        return f"<{kind} {name}: {gains}, α={self.spectral_abscissa:.6g}, stable={self.stable}>"


@dataclass(frozen=True, eq=False, repr=False)
class Design(Analysis):
    """Gains that were designed; margins and alternatives are told by `report`.

    Attributes
    ----------
    objective : Objective
        What the gains minimise.
    objective_value : float
        Its value at the gains.
    requirements : Requirements
        What was required beside.
    requirements_met : bool
        Whether the loop fulfils them.
    optimality : OptimalityCertificate
        Evidence that no better gains lie within the bounds.
    evaluations : int
        Eigenvalue problems that the search solved.
    """

    objective: Objective = field(kw_only=True)
    objective_value: float = field(kw_only=True)
    requirements: Requirements = field(default=NO_REQUIREMENTS, kw_only=True)
    requirements_met: bool = field(default=True, kw_only=True)
    optimality: OptimalityCertificate = field(kw_only=True)
    evaluations: int = field(default=0, kw_only=True)

    @property
    def minimises_alpha(self) -> bool:
        """Whether the gains minimise the spectral abscissa, and nothing was required beside."""
        return isinstance(self.objective, Exact) and not self.requirements

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields of the command line, as far as they are known."""
        from drillctrl.designs.fields import design_fields

        return design_fields(self)

    def summary(self) -> str:
        """Return a text for people, in rig units too where a rig was given."""
        from drillctrl.designs.words import design_lines, set_out

        return set_out(design_lines(self))


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
) -> Analysis:
    """Analyse the loop that the gains close, beside the open loop."""
    plant = case.system(None if feedback is None else feedback.inputs)
    system = closed_loop(plant, feedback, K1, K2)
    loop = analyze_loop(system)
    worse: tuple[ModeShift, ...] = ()
    if feedback is not None:
        known = () if case.plant is None else case.plant.linear.states
        quantities = tuple(state.quantity for state in known)
        shifts = mode_shifts(plant, feedback, K1, K2, quantities)
        worse = tuple(shift for shift in shifts if shift.worse)
    alone = loop if feedback is None else analyze_loop(plant)
    radius = discretised_radius(system, m, order)
    return Analysis(case, plant, feedback, K1, K2, loop, alone, radius, worse)
