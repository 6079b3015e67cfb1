"""Whether a law of a top drive does its string good or harm, whatever the bit does."""

from __future__ import annotations

import functools
from dataclasses import dataclass

from drillctrl.base.language import SI, Language
from drillctrl.strings.drive_control import DriveControl, DriveMachine
from drillctrl.strings.drive_rules import stiff_control
from drillctrl.strings.line import Line
from drillctrl.strings.slopes import (
    CriticalSlope,
    drive_is_stable,
    lowest_impedance,
    weakest_slope,
)

# Share of what a string stands under a stiff drive, and of the pipe's impedance, by which it may
# stand less: the damping of strings is not known that well.
_SHARE, _LITTLE = 0.05, 0.01
UNTRIED = "not tried on the nonlinear motion"


@dataclass(frozen=True)
class DriveVerdict:
    """What a string stands under a law, beside a drive that keeps its speed.

    Attributes
    ----------
    stable : bool
        Whether string and drive are, with a free bit.
    weakest : CriticalSlope or None
        The smallest critical slope of all modes, None where no slope makes any grow.
    stiff : CriticalSlope or None
        That under a stiff drive.
    enough : float
        The slope that is not less than that, N m s/rad.
    """

    stable: bool
    weakest: CriticalSlope | None
    stiff: CriticalSlope | None
    enough: float

    @property
    def recommended(self) -> bool:
        """Whether the string stands as much as under a stiff drive.

        A law may take from a mode that has much: vibration begins at the weakest.
        """
        return self.stable and (self.weakest is None or self.weakest.slope >= self.enough)

    @property
    def untried(self) -> bool | None:
        """What is known without a run: False where it is refused, else None."""
        return None if self.recommended else False

    def untried_reason(self) -> str:
        """Say why it is refused, or that no run was made."""
        told = self.reason()
        return f"{UNTRIED}; of the string alone, {told}" if self.recommended else told

    def reason(self, language: Language = SI) -> str:
        """Say in one sentence why."""
        if not self.stable:
            return "string and drive swing up by themselves, the bit turning freely"
        mine = f"the weakest mode stands {told(self.weakest, language)}"
        if self.stiff is not None and not self.stiff.slope:
            return f"{mine}, where a stiff drive swings up by itself"
        return f"{mine}, under a stiff drive {told(self.stiff, language)}"


def drive_verdict(line: Line, control: DriveControl) -> DriveVerdict:
    """Judge a law by what the string stands under it, and under a stiff drive.

    Parameters
    ----------
    line : Line
        The string in torsion.
    control : DriveControl
        The law.
    """
    machine = control.machine
    return DriveVerdict(
        drive_is_stable(line, control),
        weakest_slope(line, control),
        stiff_slope(line, machine),
        enough(line, machine),
    )


@functools.lru_cache(maxsize=64)
def stiff_slope(line: Line, machine: DriveMachine) -> CriticalSlope | None:
    """Return the weakest slope under the stiff drive of the rule, 0 where that is unstable."""
    stiff = stiff_control(machine, line.wave_impedance)
    if not drive_is_stable(line, stiff):
        return CriticalSlope(0.0, 0.0)
    return weakest_slope(line, stiff)


def enough(line: Line, machine: DriveMachine) -> float:
    """Return the critical slope that is not less than under a stiff drive, N m s/rad."""
    stiff = stiff_slope(line, machine)
    slope = lowest_impedance(line) if stiff is None else stiff.slope
    return (1.0 - _SHARE) * slope - _LITTLE * line.wave_impedance


def told(slope: CriticalSlope | None, language: Language = SI) -> str:
    """Return a slope in words."""
    if slope is None:
        return "any fall of the bit's torque with its speed"
    value = language.text("impedance", slope.slope).removesuffix("/rad")
    return f"{value} at {slope.frequency:.3g} Hz"
