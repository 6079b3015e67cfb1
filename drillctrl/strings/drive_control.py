"""A top drive under control, as the string meets it: impedance and reflection at its shaft.

J φ'' = torque of the string + torque of the drive, and the drive answers what it measures,

    drive = P(s) [B(s) T̂ − A(s) Ω̂],   P = exp(−τ s)/(1 + T_lag s),

with the top's speed through the encoder's filter, Ω̂, and the pipe's torque through its own, T̂.
So Z(s) = (J s + P A)/(1 + P B), torque per speed.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.base.kinds import makes_of_kinds

_MOST_COEFFICIENTS = 21


@dataclass(frozen=True)
class DriveMachine:
    """What a top drive is, whatever controls it.

    Attributes
    ----------
    inertia : float
        J, referred to the string, kg m².
    torque_limit : float or None
        Largest torque of the drive, N m. Nothing linear depends on it: it bounds designs, and
        results say which swing of the top takes all of it.
    delay : float
        From measurement to torque, s.
    lag : float
        Time constant of the torque, s; 0 for none.
    encoder : float
        Time constant of the measured speed, s; 0 for none.
    encoder_counts : int or None
        Counts of the encoder in a turn of the string, of which a sampled law takes its speed: what
        is counted over a period. Nothing linear depends on it; None for a speed as it is.
    torque_filter : float
        Time constant of the measured torque in the pipe, s; that is the drive's own torque less
        J times its acceleration, which needs one.

    Raises
    ------
    InputError
        If a value is not in its range.
    """

    inertia: float
    torque_limit: float | None = None
    delay: float = 0.0
    lag: float = 0.0
    encoder: float = 0.0
    torque_filter: float = 0.01
    encoder_counts: int | None = None

    def __post_init__(self) -> None:
        checked_number("inertia of the drive", self.inertia, 0.0, 1e9, open_low=True)
        if self.torque_limit is not None:
            checked_number("torque limit of the drive", self.torque_limit, 0.0, 1e9, open_low=True)
        for name in ("delay", "lag", "encoder"):
            checked_number(f"{name} of the drive", getattr(self, name), 0.0, 10.0)
        checked_number("torque filter", self.torque_filter, 0.0, 10.0, open_low=True)
        if self.encoder_counts is not None:
            checked_integer("encoder counts", self.encoder_counts, 1, 1_000_000_000)

    @property
    def lateness(self) -> float:
        """Delay and time constants from speed to torque together, s."""
        return self.delay + self.lag + self.encoder


@dataclass(frozen=True)
class Transfer:
    """A rational transfer function of s in 1/s.

    Attributes
    ----------
    numerator, denominator : tuple of float
        Coefficients, highest power first.

    Raises
    ------
    InputError
        If a coefficient is not finite, the denominator vanishes, or the numerator is more than
        one degree above it.
    """

    numerator: tuple[float, ...] = (0.0,)
    denominator: tuple[float, ...] = (1.0,)

    def __post_init__(self) -> None:
        for name in ("numerator", "denominator"):
            try:
                found = np.trim_zeros(np.atleast_1d(np.asarray(getattr(self, name), float)), "f")
            except (TypeError, ValueError):
                raise InputError(name, getattr(self, name), "a list of numbers") from None
            if found.ndim != 1 or not np.isfinite(found).all() or found.size > _MOST_COEFFICIENTS:
                raise InputError(name, found.tolist(), f"at most {_MOST_COEFFICIENTS} numbers")
            object.__setattr__(self, name, tuple(found.tolist()) or (0.0,))
        if self.denominator == (0.0,):
            raise InputError("denominator", self.denominator, "not zero")
        if self.excess > 1:
            wanted = "of at most one degree more than the denominator"
            raise InputError("numerator", self.numerator, wanted)

    @property
    def excess(self) -> int:
        """Degree of the numerator beyond that of the denominator."""
        return len(self.numerator) - len(self.denominator)

    @property
    def poles(self) -> ComplexArray:
        """Zeros of the denominator, 1/s."""
        return np.roots(self.denominator).astype(complex)

    def __bool__(self) -> bool:
        return self.numerator != (0.0,)

    def __call__(self, s: npt.ArrayLike) -> ComplexArray:
        """Return its value, (...)."""
        at = np.asarray(s, dtype=complex)
        return np.asarray(np.polyval(self.numerator, at) / np.polyval(self.denominator, at))

    def to_dict(self) -> dict[str, list[float]]:
        """Return the coefficients, highest power first."""
        return {"numerator": list(self.numerator), "denominator": list(self.denominator)}


@makes_of_kinds
@dataclass(frozen=True)
class DriveControl:
    """A machine and the law that controls it.

    Attributes
    ----------
    name : str
        Of the law.
    machine : DriveMachine
        The drive.
    speed : Transfer
        A, from measured speed to braking torque, N m s/rad.
    torque : Transfer
        B, from measured torque of the pipe to driving torque.

    Raises
    ------
    InputError
        If the law differentiates through a delay and no filter: there is no such loop of retarded
        type, and high frequencies would decide.
    """

    made_by = "drive_control makes of a rig"

    name: str
    machine: DriveMachine
    speed: Transfer
    torque: Transfer = field(default_factory=Transfer)

    def __post_init__(self) -> None:
        if self.torque.excess > 0:
            raise InputError("law on the pipe's torque", self.torque.numerator, "proper")
        if self.speed.excess > 0:
            machine = self.machine
            inertia = machine.inertia + self.speed.numerator[0] / self.speed.denominator[0]
            filtered = machine.lag > 0.0 or machine.encoder > 0.0
            if not filtered and machine.delay > 0.0:
                wanted = "with a lag or an encoder's filter where a delay meets compensated inertia"
                raise InputError("drive", f"delay {machine.delay:g} s", wanted)
            if not filtered and inertia <= 0.0:
                raise InputError("compensated inertia", machine.inertia - inertia, "less than J")

    def path(self, s: npt.ArrayLike) -> ComplexArray:
        """Return P(s), what a wanted torque becomes."""
        at = np.asarray(s, dtype=complex)
        return np.asarray(np.exp(-self.machine.delay * at) / (1.0 + self.machine.lag * at))

    def laws(self, s: npt.ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Return A and B with the filters of what they measure."""
        at = np.asarray(s, dtype=complex)
        speed = self.speed(at) / (1.0 + self.machine.encoder * at)
        return speed, self.torque(at) / (1.0 + self.machine.torque_filter * at)

    def ends(self, s: npt.ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Return 1 + P B and J s + P A: speed and torque of a motion that the drive allows."""
        at = np.asarray(s, dtype=complex)
        path, (speed, torque) = self.path(at), self.laws(at)
        return 1.0 + path * torque, self.machine.inertia * at + path * speed

    def impedance(self, s: npt.ArrayLike) -> ComplexArray:
        """Return Z(s), torque per speed at the top of the string."""
        speed, torque = self.ends(s)
        return np.asarray(torque / speed)

    def reflection(self, s: npt.ArrayLike, pipe: float) -> ComplexArray:
        """Return (Z − ζ)/(Z + ζ), what the drive returns of a wave in pipe of impedance ζ."""
        speed, torque = self.ends(s)
        return np.asarray((torque - pipe * speed) / (torque + pipe * speed))

    def saturating_swing(self, frequencies: FloatArray) -> tuple[float, float] | None:
        """Return the smallest swing of the top's speed that takes the whole torque limit.

        Parameters
        ----------
        frequencies : array, (q,)
            Hz, at which the top may swing.

        Returns
        -------
        float, float
            rad/s and Hz; None without a limit.
        """
        if self.machine.torque_limit is None:
            return None
        s = 2j * np.pi * frequencies
        # The drive gives what the top's inertia and the pipe do not take.
        drive = np.abs(self.impedance(s) - self.machine.inertia * s)
        worst = int(np.argmax(drive))
        return float(self.machine.torque_limit / drive[worst]), float(frequencies[worst])

    def to_dict(self) -> dict[str, Any]:
        """Return the law in SI."""
        return {"speed": self.speed.to_dict(), "torque": self.torque.to_dict()}
