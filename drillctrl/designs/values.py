"""What `analyze` and `design` find out, as values."""

from __future__ import annotations

from dataclasses import dataclass, field

from drillctrl.base.arrays import FloatArray
from drillctrl.delay.closing import close_loop
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.delay.system import DelaySystem
from drillctrl.designs.controlled_swings import OnMotion
from drillctrl.designs.loop_analysis import LoopAnalysis, SpectralRadius
from drillctrl.designs.mode_shift import ModeShift
from drillctrl.designs.trials import Trial
from drillctrl.designs.verdict import UNTRIED, Verdict
from drillctrl.drilling.case import Case
from drillctrl.drilling.point import OperatingPoint, RigPoint
from drillctrl.synthesis.certificate import OptimalityCertificate
from drillctrl.synthesis.objectives import NO_REQUIREMENTS, Exact, Objective, Requirements


@dataclass(frozen=True, eq=False)
class AnalysisValues:
    """What is known of a loop around one plant; `Analysis` says what each field is."""

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

    def system(self) -> DelaySystem:
        """Return the closed loop."""
        return closed_loop(self.plant, self.structure, self.K1, self.K2)

    def __repr__(self) -> str:
        name = self.structure.name if self.structure else "open loop"
        gains = f"K1={self.K1.ravel().tolist()}, K2={self.K2.ravel().tolist()}"
        kind = type(self).__name__
        return f"<{kind} {name}: {gains}, α={self.spectral_abscissa:.6g}, stable={self.stable}>"


@dataclass(frozen=True, eq=False, repr=False)
class DesignValues(AnalysisValues):
    """What is known of gains that were designed; `Design` says what each field is."""

    objective: Objective = field(kw_only=True)
    objective_value: float = field(kw_only=True)
    requirements: Requirements = field(default=NO_REQUIREMENTS, kw_only=True)
    requirements_met: bool = field(default=True, kw_only=True)
    optimality: OptimalityCertificate = field(kw_only=True)
    evaluations: int = field(default=0, kw_only=True)
    on_motion: OnMotion | None = field(default=None, kw_only=True)

    @property
    def minimises_alpha(self) -> bool:
        """Whether the gains minimise the spectral abscissa, and nothing was required beside."""
        return isinstance(self.objective, Exact) and not self.requirements


def closed_loop(
    plant: DelaySystem, feedback: FeedbackStructure | None, K1: FloatArray, K2: FloatArray
) -> DelaySystem:
    """Return the loop around a plant; the plant itself without feedback."""
    return plant if feedback is None else close_loop(plant, feedback, K1, K2)
