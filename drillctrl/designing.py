"""`design` and `analyze`: from an operating point to gains and what is known of them."""

from __future__ import annotations

import functools
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from drillctrl.analysis import (
    DEFAULT_ORDER,
    Fragility,
    LoopAnalysis,
    analyze_loop,
    analyze_roots,
    fragility,
    perturbed_plants,
)
from drillctrl.delay_system import DelaySystem, plant_system
from drillctrl.errors import InputError, checked_integer, checked_number
from drillctrl.feedback import FeedbackStructure, close_loop, gain_matrices, preset_structure
from drillctrl.operating_point import OperatingPoint, RigPoint
from drillctrl.optimisation.alternative import robust_alternative
from drillctrl.optimisation.certificate import OptimalityCertificate, certify_optimality
from drillctrl.optimisation.family import loop_family
from drillctrl.optimisation.rounding import hold_multiple_root
from drillctrl.optimisation.search import global_search
from drillctrl.spectrum.characteristic import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from drillctrl.spectrum.proof import Proof


@dataclass(frozen=True, eq=False)
class Design:
    """Gains for one operating point, and what is known of the loop they close.

    Attributes
    ----------
    point : OperatingPoint
        Where the gains are meant for.
    rig_point : RigPoint or None
        The rig behind the point, if one was given.
    structure : FeedbackStructure or None
        What is fed back; None for an open loop.
    K1, K2 : array, (m, p)
        Gains on Y(t) and on Y(t − τ0).
    loop, open_loop : LoopAnalysis
        With and without the feedback.
    optimality : OptimalityCertificate or None
        Evidence that no better gains lie within the bounds; None for given gains.
    evaluations : int
        Eigenvalue problems that the search solved; 0 for given gains.
    elapsed_seconds : float
        Wall time.
    """

    point: OperatingPoint
    rig_point: RigPoint | None
    structure: FeedbackStructure | None
    K1: FloatArray
    K2: FloatArray
    loop: LoopAnalysis
    open_loop: LoopAnalysis
    optimality: OptimalityCertificate | None
    evaluations: int
    elapsed_seconds: float

    @property
    def spectral_abscissa(self) -> float:
        """α of the closed loop, per unit of dimensionless time."""
        return self.loop.spectral_abscissa

    @functools.cached_property
    def fragility(self) -> Fragility | None:
        """The closed loop when gains, rock or delay are a little off; None without feedback."""
        if self.structure is None:
            return None
        return fragility(self.point, self.structure, self.K1, self.K2)

    @property
    def stable(self) -> bool:
        """Whether the closed loop is asymptotically stable."""
        return self.loop.stable

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
        family = loop_family(plant_system(self.point, self.structure.inputs), self.structure)
        here = self.structure.vector(self.K1, self.K2)
        perturbed = [
            loop_family(plant, self.structure, family.degree)
            for plant in perturbed_plants(self.point, self.structure)
        ]
        gains = robust_alternative(family, perturbed, here, self.spectral_abscissa, share)
        K1, K2 = self.structure.gains(gains)
        result = _assess(self.point, self.rig_point, self.structure, K1, K2, None, DEFAULT_ORDER)
        return replace(result, elapsed_seconds=time.perf_counter() - began)

    def prove(self) -> Proof:
        """Prove the number of roots right of the certificate's line; see `prove_count`."""
        from drillctrl.spectrum.proof import prove_count

        return prove_count(self.system(), self.loop.certificate.line)

    def system(self) -> DelaySystem:
        """Return the closed loop."""
        return closed_loop(self.point, self.structure, self.K1, self.K2)

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields of the command line."""
        from drillctrl.reporting import design_fields

        return design_fields(self)

    def summary(self) -> str:
        """Return a text for people, in rig units too where a rig was given."""
        from drillctrl.reporting import design_summary

        return design_summary(self)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the rightmost roots with and without feedback; see `plotting.plot_roots`."""
        from drillctrl.plotting import plot_roots

        return plot_roots(self, ax)

    def __repr__(self) -> str:
        name = self.structure.name if self.structure else "open loop"
        gains = f"K1={self.K1.ravel().tolist()}, K2={self.K2.ravel().tolist()}"
        return f"<Design {name}: {gains}, α={self.spectral_abscissa:.6g}, stable={self.stable}>"


def closed_loop(
    point: OperatingPoint, feedback: FeedbackStructure | None, K1: FloatArray, K2: FloatArray
) -> DelaySystem:
    """Return the loop at a point; the plant itself without feedback."""
    if feedback is None:
        return plant_system(point)
    return close_loop(plant_system(point, feedback.inputs), feedback, K1, K2)


def _as_structure(given: str | FeedbackStructure) -> FeedbackStructure:
    return preset_structure(given) if isinstance(given, str) else given


def _split_point(given: OperatingPoint | RigPoint) -> tuple[OperatingPoint, RigPoint | None]:
    if isinstance(given, RigPoint):
        return given.operating_point(), given
    if isinstance(given, OperatingPoint):
        return given, None
    raise InputError("point", type(given).__name__, "an OperatingPoint or a RigPoint")


def design(
    point: OperatingPoint | RigPoint,
    structure: str | FeedbackStructure = "case1",
    *,
    bounds: Mapping[str, tuple[float, float]] | None = None,
    seed: int = 0,
) -> Design:
    """Design bounded gains that minimise the spectral abscissa of the closed loop.

    Parameters
    ----------
    point : OperatingPoint or RigPoint
        Where the rig drills.
    structure : str or FeedbackStructure
        A preset (``"p"``, ``"case1"``, ``"pd"``, ``"case2"``) or a structure.
    bounds : mapping, optional
        Bounds that replace those of the structure; see `FeedbackStructure.with_bounds`.
    seed : int
        Of the starting points. The same seed gives the same gains.

    Returns
    -------
    Design
        The best gains found, whether or not they stabilise: look at ``stable``.

    Raises
    ------
    InputError
        If the structure does not fit the plant or a bound is wrong.
    """
    began = time.perf_counter()
    where, rig_point = _split_point(point)
    chosen = _as_structure(structure).with_bounds(bounds or {})
    checked_integer("seed", seed, 0, 2**63 - 1)
    family = loop_family(plant_system(where, chosen.inputs), chosen)
    search = global_search(family, seed)
    gains = hold_multiple_root(family, search.best)
    K1, K2 = chosen.gains(gains)
    result = _assess(where, rig_point, chosen, K1, K2, None, DEFAULT_ORDER)
    elapsed = time.perf_counter() - began
    return replace(
        result,
        optimality=certify_optimality(family, gains, search),
        evaluations=search.evaluations,
        elapsed_seconds=elapsed,
    )


def analyze(
    point: OperatingPoint | RigPoint,
    structure: str | FeedbackStructure | None = None,
    K1: npt.ArrayLike | None = None,
    K2: npt.ArrayLike | None = None,
    *,
    m: int | None = None,
    order: int = DEFAULT_ORDER,
) -> Design:
    """Analyse given gains, or the open loop.

    Parameters
    ----------
    point : OperatingPoint or RigPoint
        Where the rig drills.
    structure : str or FeedbackStructure, optional
        Without it, the open loop.
    K1, K2 : array_like, optional
        Gains in the order of the outputs; K2 may be left out where nothing delayed is fed
        back.
    m, order : int, optional
        Of the semi-discretisation that is reported; see `semidiscretize`.

    Raises
    ------
    InputError
        If gains are missing, too many, or not finite.
    """
    began = time.perf_counter()
    where, rig_point = _split_point(point)
    if structure is None:
        if K1 is not None or K2 is not None:
            raise InputError("structure", "(missing)", "given together with gains")
        none = np.zeros((0, 0))
        result = _assess(where, rig_point, None, none, none, m, order)
    else:
        chosen = _as_structure(structure)
        if K1 is None:
            raise InputError("K1", "(missing)", f"given for structure {chosen.name}")
        if K2 is None and (chosen.K2_upper.any() or chosen.K2_lower.any()):
            raise InputError("K2", "(missing)", f"given for structure {chosen.name}")
        gains = gain_matrices(chosen, K1, K2)
        result = _assess(where, rig_point, chosen, *gains, m, order)
    return replace(result, elapsed_seconds=time.perf_counter() - began)


def _assess(
    point: OperatingPoint,
    rig_point: RigPoint | None,
    feedback: FeedbackStructure | None,
    K1: FloatArray,
    K2: FloatArray,
    m: int | None,
    order: int,
) -> Design:
    """Analyse the loop that the gains close, beside the open loop."""
    loop = analyze_loop(closed_loop(point, feedback, K1, K2), m, order)
    open_loop = loop if feedback is None else analyze_roots(plant_system(point))
    return Design(point, rig_point, feedback, K1, K2, loop, open_loop, None, 0, 0.0)
