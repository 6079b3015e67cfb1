"""The results of `analyze` and `design`: gains, and what is known of the loop they close."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import TYPE_CHECKING, Any, Self

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.base.text import set_out
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.designs.fields import design_fields, result_fields
from drillctrl.designs.loop_analysis import DEFAULT_ORDER, analyze_loop, discretised_radius
from drillctrl.designs.mode_shift import ModeShift, mode_kind, modes_worse
from drillctrl.designs.values import AnalysisValues, DesignValues, closed_loop
from drillctrl.designs.verdict import try_gains
from drillctrl.designs.words import design_lines, result_lines
from drillctrl.drilling.case import Case
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.outcome import Figures
from drillctrl.strings.named_roots import turned_by

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from drillctrl.spectrum.proof import Proof


class Analysis(AnalysisValues):
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
        Modes that decay more slowly with the gains than without; see `modes_worse`.
    verdict : Verdict
        What trial runs on the nonlinear motion say of the gains, if there were any.
    elapsed_seconds : float
        Wall time.
    """

    def tried(self, uncontrolled: dict[str, Figures] | None = None, **surroundings: Any) -> Self:
        """Return the same gains after trial runs on the nonlinear motion.

        Parameters
        ----------
        uncontrolled : dict, optional
            What `uncontrolled_runs` returned for the point.
        **surroundings
            Attributes of `Controller`: limits, clock, delays.
        """
        verdict = try_gains(
            self.case,
            self.structure,
            self.K1,
            self.K2,
            self.stable,
            uncontrolled=uncontrolled,
            surroundings=surroundings,
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

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields of the command line."""
        return result_fields(self)

    def summary(self) -> str:
        """Return a text for people, in rig units too where a rig was given."""
        return set_out(result_lines(self))

    def plot(self, ax: Axes | None = None, name: str | None = None) -> Axes:
        """Draw the rightmost roots with and without feedback, under the name of the rig."""
        from drillctrl.designs.figure import plot_roots

        drive = turned_by(self.case)
        loops = {"without control" if drive is None else drive.name: self.plant}
        if self.structure is not None:
            loops[f"with {self.structure.name}"] = self.system()
        place = ", ".join(text for text in (name, self.case.place) if text)
        return plot_roots(loops, self.loop.dominant_roots, place, self.case.told_rig, ax)


class Design(DesignValues, Analysis):
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
    on_motion : OnMotion or None
        What the gains do on the motion that is drilled with, where that was designed for.
    """

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields of the command line, as far as they are known."""
        return design_fields(self)

    def summary(self) -> str:
        """Return a text for people, in rig units too where a rig was given."""
        return set_out(design_lines(self))


def analysis_fields(result: Analysis) -> dict[str, Any]:
    """Return the values of an analysis by name, to make a `Design` of them."""
    return {item.name: getattr(result, item.name) for item in fields(Analysis)}


def dominant_kind(result: Analysis) -> str | None:
    """Return which motion alone takes part in the first root; see `mode_kind`."""
    first = result.loop.dominant_roots[0].value
    return mode_kind(result.system(), first, _quantities(result.case))


def _quantities(case: Case) -> tuple[str, ...]:
    return () if case.plant is None else tuple(s.quantity for s in case.plant.linear.states)


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
        worse = modes_worse(plant, feedback, K1, K2, _quantities(case))
    alone = loop if feedback is None else analyze_loop(plant)
    radius = discretised_radius(system, m, order)
    return Analysis(case, plant, feedback, K1, K2, loop, alone, radius, worse)
