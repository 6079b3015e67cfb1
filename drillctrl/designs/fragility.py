"""What becomes of a loop when gains, rock or delay are a little off."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.delay.closing import close_loop
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.delay.system import DelaySystem
from drillctrl.drilling.case import Case
from drillctrl.robustness.margins import with_delay_factor
from drillctrl.spectrum.roots import spectral_abscissa


@dataclass(frozen=True)
class Fragility:
    """Spectral abscissa when something is not as designed.

    Attributes
    ----------
    rounded_gains : float
        With the gains rounded to three significant digits.
    psi_low, psi_high : float or None
        With ψ 5 % lower or higher; None where the plant has no operating point.
    delay_low, delay_high : float or None
        With all delays 2 % shorter or longer; None without delays.
    """

    rounded_gains: float
    psi_low: float | None
    psi_high: float | None
    delay_low: float | None
    delay_high: float | None

    @property
    def worst(self) -> float:
        """The largest of them."""
        values = (self.psi_low, self.psi_high, self.delay_low, self.delay_high)
        return max(self.rounded_gains, *(value for value in values if value is not None))


def round_to_digits(values: FloatArray, digits: int) -> FloatArray:
    """Round every value to a number of significant digits."""
    rounded = [float(f"{value:.{digits - 1}e}") for value in values.ravel()]
    return np.array(rounded).reshape(values.shape)


def fragility(
    plant: DelaySystem,
    perturbed: Mapping[str, DelaySystem],
    feedback: FeedbackStructure,
    K1: FloatArray,
    K2: FloatArray,
) -> Fragility:
    """Return the abscissa of a loop under small changes of gains, rock and delay.

    Parameters
    ----------
    plant : DelaySystem
        As designed for.
    perturbed : mapping
        What `perturbed_plants` returns.
    feedback, K1, K2 : FeedbackStructure and arrays
        The feedback.
    """
    values = {
        name: spectral_abscissa(close_loop(other, feedback, K1, K2))
        for name, other in perturbed.items()
    }
    rounded = close_loop(plant, feedback, round_to_digits(K1, 3), round_to_digits(K2, 3))
    names = ("psi_low", "psi_high", "delay_low", "delay_high")
    return Fragility(spectral_abscissa(rounded), *(values.get(name) for name in names))


def perturbed_plants(plant: DelaySystem, case: Case | None = None) -> dict[str, DelaySystem]:
    """Return plants by the names of `Fragility`'s fields, as far as they exist.

    Parameters
    ----------
    plant : DelaySystem
        The plant as assumed.
    case : Case, optional
        What it is the system of; without physics, ψ cannot change.
    """
    changed = {}
    if case is not None and case.point is not None:
        for name, factor in (("psi_low", 0.95), ("psi_high", 1.05)):
            rock = case.with_changes(psi=factor * case.point.psi)
            changed[name] = rock.system(plant.input_names)
    if plant.delays:
        changed["delay_low"] = with_delay_factor(plant, 0.98)
        changed["delay_high"] = with_delay_factor(plant, 1.02)
    return changed
