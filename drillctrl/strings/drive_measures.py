"""What one drive returns, stands and leaves in reserve."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.text import finite_or_none
from drillctrl.strings.drill_string import DrillString
from drillctrl.strings.drive_control import DriveControl
from drillctrl.strings.drive_roots import DriveRoot, drive_roots
from drillctrl.strings.drive_verdict import DriveVerdict, drive_verdict
from drillctrl.strings.falling import FallingTorque
from drillctrl.strings.slopes import (
    CriticalSlope,
    ModeSlope,
    drive_delay_margin,
    mode_slopes,
)

# Hz, that reflections are told and drawn at.
BAND = (0.05, 5.0)
_SAMPLES = 200


@dataclass(frozen=True)
class DriveMode:
    """A mode of torsion under one drive.

    Attributes
    ----------
    slope : ModeSlope
        Its critical slope.
    reflection : float
        ``|r|`` of the drive at the frequency of the mode under a held top.
    threshold_speed : float
        rad/s, above which the falling torque is less steep than the critical slope.
    root : DriveRoot or None
        The least damped root around there with a free bit.
    """

    slope: ModeSlope
    reflection: float
    threshold_speed: float
    root: DriveRoot | None

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields."""
        root, slope = self.root, self.slope
        return {
            "kind": "torsional",
            "number": slope.number,
            "held_frequency": slope.mode_frequency,
            "frequency": slope.mode_frequency if root is None else root.frequency,
            "damping_ratio": None if root is None else root.damping_ratio,
            "critical_slope": slope.slope,
            "critical_frequency": slope.frequency,
            "reflection": self.reflection,
            "threshold_speed": finite_or_none(self.threshold_speed),
        }


@dataclass(frozen=True, eq=False)
class DriveMeasures:
    """One drive under one law on one string.

    Attributes
    ----------
    control : DriveControl
        The law.
    verdict : DriveVerdict
        Whether the law does the string good or harm.
    modes : tuple of DriveMode
        The first modes of torsion.
    delay_margin : float
        s by which the drive may act later; nan where it is unstable.
    swing : (float, float) or None
        Smallest swing of the top that takes the torque limit at a mode, rad/s, and where, Hz.
    frequencies : array, (q,)
        Hz.
    reflection, impedance : array, (q,)
        ``|r|`` and Z there, N m s/rad.
    roots : tuple of DriveRoot
        With a free bit, up to the last of these frequencies.
    """

    control: DriveControl
    verdict: DriveVerdict
    modes: tuple[DriveMode, ...]
    delay_margin: float
    swing: tuple[float, float] | None
    frequencies: FloatArray
    reflection: FloatArray
    impedance: ComplexArray
    roots: tuple[DriveRoot, ...]

    @property
    def stable(self) -> bool:
        """Whether string and drive are, with a free bit."""
        return self.verdict.stable

    @property
    def weakest(self) -> CriticalSlope | None:
        """The smallest critical slope of all modes up to 30 Hz; None where none makes any grow."""
        return self.verdict.weakest

    @property
    def smallest_slope(self) -> float:
        """The smallest critical slope of the modes, N m s/rad; 0 where the drive is unstable."""
        return min(mode.slope.slope for mode in self.modes) if self.stable else 0.0

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields."""
        return {
            "structure": self.control.name,
            "stable": self.stable,
            "recommended": self.verdict.untried,
            "reason": self.verdict.untried_reason(),
            "smallest_critical_slope": self.smallest_slope,
            "weakest_mode": self.weakest
            and {
                "critical_slope": self.weakest.slope if self.stable else 0.0,
                "critical_frequency": self.weakest.frequency,
            },
            "modes": [mode.to_dict() for mode in self.modes],
            "delay_margin": finite_or_none(self.delay_margin),
            "torque_limit_swing": self.swing
            and dict(zip(("speed", "frequency"), self.swing, strict=True)),
            "law": self.control.to_dict(),
            "reflection": {
                "frequencies": self.frequencies.tolist(),
                "magnitudes": self.reflection.tolist(),
            },
            "impedance": {
                "frequencies": self.frequencies.tolist(),
                "real": self.impedance.real.tolist(),
                "imag": self.impedance.imag.tolist(),
            },
            "roots": [root._asdict() for root in self.roots],
        }


def measure_drive(
    string: DrillString, control: DriveControl, falling: FallingTorque, count: int
) -> DriveMeasures:
    """Return what one drive returns, stands and leaves in reserve; see `DriveMeasures`."""
    line = string.torsion
    pipe = line.wave_impedance
    slopes = mode_slopes(line, control, count)
    held = np.array([slope.mode_frequency for slope in slopes])
    returned = np.abs(control.reflection(2j * np.pi * held, pipe))
    highest = max(BAND[1], 1.5 * float(held[-1]))
    roots = drive_roots(line, control, highest)
    edges = [0.0, *(0.5 * (held[1:] + held[:-1])).tolist(), 1.1 * float(held[-1])]
    modes = []
    for i, slope in enumerate(slopes):
        own = [root for root in roots if edges[i] < root.frequency <= edges[i + 1]]
        root = min(own, key=lambda root: root.damping_ratio, default=None)
        speed = falling.threshold_speed(slope.slope)
        modes.append(DriveMode(slope, float(returned[i]), speed, root))
    frequencies = np.geomspace(*BAND, _SAMPLES)
    s = 2j * math.pi * frequencies
    return DriveMeasures(
        control,
        drive_verdict(line, control),
        tuple(modes),
        drive_delay_margin(line, control),
        control.saturating_swing(held),
        frequencies,
        np.abs(control.reflection(s, pipe)),
        control.impedance(s),
        roots,
    )
