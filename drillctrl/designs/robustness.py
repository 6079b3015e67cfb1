"""How near instability a loop is, and gains beside the fastest that stand more."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.base.text import finite_or_none
from drillctrl.designs.fragility import Fragility, fragility, perturbed_plants
from drillctrl.designs.margins import point_margins
from drillctrl.designs.result import Analysis, assess
from drillctrl.robustness.margins import DelayMargin, ParameterMargin, delay_margin
from drillctrl.robustness.radius import StabilityRadius, stability_radius
from drillctrl.synthesis import alternative
from drillctrl.synthesis.family import loop_family

# Share of the decay rate that the alternative beside a design may lose.
GIVE_UP = 0.05


@dataclass(frozen=True)
class Robustness:
    """What a loop with feedback stands.

    Attributes
    ----------
    stability_radius : StabilityRadius
        Smallest error of the plant's matrices, relative to their norms, that destabilises.
    delay_margin : DelayMargin or None
        How wrong the delays may be; None for a loop that is unstable or without delay.
    point_margins : dict or None
        How wrong ψ, δ0 and ω0 may each be; None for an unstable loop, without a point, or where
        they were not asked for.
    fragility : Fragility
        The loop when gains, rock or delay are a little off.
    """

    stability_radius: StabilityRadius
    delay_margin: DelayMargin | None
    point_margins: dict[str, ParameterMargin] | None
    fragility: Fragility

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields."""
        radius, margin = self.stability_radius, self.delay_margin
        fields: dict[str, Any] = {
            "stability_radius": radius.value,
            "stability_radius_lower_bound": radius.lower_bound,
            "delay_margin": None,
            "point_margins": None,
            "spectral_abscissa_with": asdict(self.fragility),
        }
        if margin is not None:
            fields["delay_margin"] = {
                "shorter": margin.shorter,
                "longer": finite_or_none(margin.longer),
                "limit": finite_or_none(margin.limit),
            }
        if self.point_margins is not None:
            fields["point_margins"] = {
                name: {"lower": errors.lower, "upper": errors.upper, "limit": errors.limit}
                for name, errors in self.point_margins.items()
            }
        return fields


def relative_radius(result: Analysis) -> StabilityRadius:
    """Return the stability radius with errors relative to the norms of the plant's matrices."""
    loop = result.system()
    matrices = [result.plant.A0, *map(result.plant.delayed_matrix, loop.delays)]
    return stability_radius(loop, [float(np.linalg.norm(m, 2)) for m in matrices])


def robustness_of(result: Analysis, with_point: bool = True) -> Robustness:
    """Return what a loop with feedback stands.

    Parameters
    ----------
    result : Analysis
        With feedback.
    with_point : bool
        Whether margins of the point are worked out, which takes minutes for a plant of a hundred
        states.

    Raises
    ------
    InputError
        If there is no feedback.
    """
    if result.structure is None:
        raise InputError("result", "an open loop", "one with feedback")
    structure, loop = result.structure, result.system()
    changed = perturbed_plants(result.plant, result.case)
    margins = None
    if with_point and result.stable and result.case.drills:
        margins = point_margins(result.case, structure, result.K1, result.K2)
    return Robustness(
        relative_radius(result),
        delay_margin(loop) if result.stable and loop.delays else None,
        margins,
        fragility(result.plant, changed, structure, result.K1, result.K2),
    )


@checks_kinds
def robust_alternative(result: Analysis, give_up: float = GIVE_UP) -> Analysis:
    """Return gains that decay almost as fast, and faster when something is off.

    Parameters
    ----------
    result : Analysis
        A stable loop with feedback.
    give_up : float
        Share of the decay rate −α that may be lost, in (0, 1).

    Returns
    -------
    Analysis
        Within the same bounds, with α ≤ (1 − give_up) times the result's, the lowest abscissa
        that was found for the worst of: nominal, ψ 5 % lower or higher, delay 2 % shorter or
        longer. Tried on the nonlinear motion if the result was.

    Raises
    ------
    InputError
        If the result has no feedback or is not stable.
    """
    share = checked_number("give_up", give_up, 0.0, 1.0, open_low=True)
    if result.structure is None or not result.stable:
        raise InputError("result", "not a stabilised loop", "one, to have an alternative")
    began = time.perf_counter()
    structure = result.structure
    family = loop_family(result.plant, structure)
    here = structure.vector(result.K1, result.K2)
    perturbed = [
        loop_family(plant, structure, family.degree)
        for plant in perturbed_plants(result.plant, result.case).values()
    ]
    gains = alternative.robust_alternative(family, perturbed, here, result.spectral_abscissa, share)
    found = assess(result.case, structure, *structure.gains(gains))
    if result.trials:
        found = found.tried()
    return replace(found, elapsed_seconds=time.perf_counter() - began)
