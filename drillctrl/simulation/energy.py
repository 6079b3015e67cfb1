"""Vibration energy of a motion within a band of frequencies, in SI."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from drillctrl.base.errors import InputError
from drillctrl.base.kinds import checks_kinds
from drillctrl.drilling.rig import Rig
from drillctrl.simulation.result import Simulation

_SAMPLES = 8192


@dataclass(frozen=True)
class BandEnergy:
    """Mean kinetic energy of the vibration within a band.

    Attributes
    ----------
    axial, torsional : float
        J.
    low, high : float
        Ends of the band, Hz.
    """

    axial: float
    torsional: float
    low: float
    high: float

    @property
    def total(self) -> float:
        """Both together, J."""
        return self.axial + self.torsional


@checks_kinds
def band_energy(
    run: Simulation, rig: Rig, low: float = 0.1, high: float = 10.0, share: float = 0.25
) -> BandEnergy:
    """Return ½ M ⟨ẋ²⟩ and ½ I ⟨θ̇²⟩ of the part of a motion within a band.

    Parameters
    ----------
    run : Simulation
        A run of the rig's operating point.
    rig : Rig
        Turns its units into SI.
    low, high : float
        Ends of the band, Hz.
    share : float
        The last part of the run that is looked at.

    Raises
    ------
    InputError
        If the band is empty, or the part is too short to hold its lowest frequency.

    Notes
    -----
    Spectra are of the dense output on an even grid, with a Hann window.
    """
    if not 0.0 < low < high or not np.isfinite(high):
        raise InputError("low, high", (low, high), "positive, finite and increasing")
    end = float(run.times[-1])
    times = np.linspace((1.0 - share) * end, end, _SAMPLES)
    span = (times[-1] - times[0]) * rig.time_scale
    if span * low < 1.0:
        raise InputError("low", low, f"at least {1.0 / span:.3g} Hz for {span:.3g} s of motion")
    rate = (_SAMPLES - 1) / span
    motion = run.at(times, ("dx", "dtheta"))
    scales = (rig.axial_scale / rig.time_scale, 1.0 / rig.time_scale)
    energies = []
    for values, scale, mass in zip(
        (motion.dx, motion.dtheta), scales, (rig.mass, rig.inertia), strict=True
    ):
        frequency, density = scipy.signal.periodogram(
            values * scale, rate, window="hann", detrend="constant"
        )
        inside = (frequency >= low) & (frequency <= high)
        power = float(density[inside].sum() * (frequency[1] - frequency[0]))
        energies.append(0.5 * mass * power)
    return BandEnergy(energies[0], energies[1], low, high)
