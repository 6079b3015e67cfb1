"""What the paper's formulas say, tried out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.optimize

from drillctrl.delay.closing import close_loop
from drillctrl.drilling.case import plant_system
from drillctrl.drilling.point import OperatingPoint
from drillctrl.drilling.rig import table1
from drillctrl.drilling.structures import preset_structure
from drillctrl.paper.agreement import MISPRINT, Agreement
from drillctrl.paper.controlled import AT_F, F
from drillctrl.paper.panels import Reproduced
from drillctrl.paper.uncontrolled import POINTS
from drillctrl.spectrum.roots import spectral_abscissa
from drillctrl.spectrum.semidiscretization import semidiscretize


def printed_sign(omega0: float, delta0: float) -> float:
    """Return α with the sign of the ψnδ0 term as printed in Eqs. 20, 22 and 33."""
    plant = plant_system(OperatingPoint(omega0, delta0, 14.0))
    now, past = plant.A0.copy(), plant.delayed[0].copy()
    row, column = plant.state_names.index("dx"), plant.state_names.index("theta")
    now[row, column] *= -1.0
    past[row, column] *= -1.0
    return spectral_abscissa(replace(plant, A0=now, delayed=(past,)))


def forgetful_radius() -> tuple[float, float]:
    """Return the growth rates at F with Case 2's gains, with and without the past of θ'.

    A map of size 2m + 4 that keeps x and θ of the past has no place for θ'.
    """
    name, K1, K2 = AT_F["case2"]
    m = 40
    structure = preset_structure(name)
    whole = semidiscretize(close_loop(plant_system(F), structure, K1, K2), m, 0).growth_rate
    without = [K2[0], 0.0]
    lacking = semidiscretize(close_loop(plant_system(F), structure, K1, without), m, 0).growth_rate
    return whole, lacking


def singular_depth() -> float:
    """Return the δ0 at which A1 is singular."""

    def determinant(delta0: float) -> float:
        return float(np.linalg.det(plant_system(OperatingPoint(10.0, delta0, 14.0)).A0))

    return float(scipy.optimize.brentq(determinant, 1.0, 20.0))


def equations() -> Reproduced:
    """Check formulas and constants by what follows from them."""
    signs = {name: printed_sign(*place) for name, place in POINTS.items()}
    wrong = [name for name, sign in (("B", -1), ("C", 1), ("D", -1), ("E", 1))
             if signs[name] * sign < 0]  # fmt: skip
    shown = ", ".join(f"{name} {signs[name]:+.3g}" for name in "ABCDE")
    whole, lacking = forgetful_radius()
    rig = table1()
    rpm = 10.0 / rig.time_scale * 30.0 / np.pi
    rows = [
        Agreement(
            "Eqs. 20, 22, 33", "sign of the ψnδ0 term", "−", "+", MISPRINT,
            f"the paper's own A1 and A2 (Eqs. 25, 26) have +; with − the abscissas would be {shown}"
            + (f", against its Fig. 8 at {', '.join(wrong)}" if wrong else ""),
        ),
        Agreement(
            "Eqs. 29, 30", "size of D for Case 2", "2m + 4", "3m + 4, or 2m + 4 with two "
            "delayed signals", MISPRINT,
            "x and θ of the past leave out θ', which Case 2 feeds back late: growth rate "
            f"{whole:.4f} with it, {lacking:.4f} without (paper's gains at F)",
        ),
        Agreement(
            "Eq. 31", "R = (P − I) A1⁻¹ A2", "always", f"not where δ0 = {singular_depth():.4g}",
            MISPRINT,
            "A1 is singular at nδ0 = 1 + nψ/η², inside the region of interest; the integral exists",
        ),
        Agreement(
            "Sect. 3.2", "ω0 = 3 … 24 is about 60 … 480 rpm", "20 rpm per unit",
            f"{rpm / 10.0:.3g} rpm per unit", "differs",
            "from I and Kt of the paper's Table 1; the wording is approximate",
        ),
    ]  # fmt: skip
    return Reproduced(None, rows)
