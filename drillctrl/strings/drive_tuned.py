"""Laws of the field with the impedance at the top that does most for their string."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from drillctrl.base.errors import InputError
from drillctrl.base.kinds import checks_kinds
from drillctrl.strings.bit_load import BitLoad
from drillctrl.strings.drive_control import DriveControl, DriveMachine
from drillctrl.strings.drive_rules import z_torque_control
from drillctrl.strings.line import Line
from drillctrl.strings.slopes import (
    drive_is_stable,
    lowest_impedance,
    mode_slopes,
    weakest_slope,
)

TUNED = "z-torque-tuned"
# Wanted impedance over ζ: the pipe's own returns nothing, the rule's four times 0.6 of a wave.
_LEAST, _RULE, _MOST, _LOOKED = 1.0, 4.0, 6.0, 9
# Of the largest weakest slope, what the chosen one keeps.
_KEPT = 0.9
_MODES = 4


@checks_kinds
def tuned_z_torque(line: Line, machine: DriveMachine) -> DriveControl:
    """Return Z-torque with the wanted impedance under which the first modes stand most.

    The rule's is four times that of the pipe. Nearer to the pipe's own the drive returns less of
    every wave, until its lateness turns a high mode unstable: of what keeps the weakest mode to
    30 Hz within a tenth of the best, the largest smallest critical slope of the first four is
    taken.

    Parameters
    ----------
    line : Line
        The string in torsion.
    machine : DriveMachine
        The drive, with its delay.

    Raises
    ------
    InputError
        If string and drive are unstable under all of these.
    """
    found = []
    laws = _stable_laws(line, lambda times: z_torque_control(machine, line.wave_impedance, times))
    for law in laws:
        weakest = weakest_slope(line, law)
        found.append((lowest_impedance(line) if weakest is None else weakest.slope, law))
    least = _KEPT * max(slope for slope, _ in found)
    kept = [law for slope, law in found if slope >= least]
    law = max(kept, key=lambda law: min(mode.slope for mode in mode_slopes(line, law, _MODES)))
    return DriveControl(TUNED, machine, law.speed, law.torque)


def tuned_on_load(
    line: Line, bit: BitLoad, law_at: Callable[[float], DriveControl]
) -> DriveControl:
    """Return the law under which the bit is shaken least where it drills.

    Of those whose first modes stand no less, with a free bit, than under the rule's four times
    the pipe's impedance.

    Parameters
    ----------
    line : Line
        The string in torsion.
    bit : BitLoad
        What the bit does there.
    law_at : callable
        The law of a wanted impedance over that of the pipe.

    Raises
    ------
    InputError
        If string and drive are unstable under all of these.
    """
    laws = _stable_laws(line, law_at)
    stands = [min(mode.slope for mode in mode_slopes(line, law, _MODES)) for law in laws]
    rule = law_at(_RULE)
    if drive_is_stable(line, rule):
        floor = min(mode.slope for mode in mode_slopes(line, rule, _MODES))
        laws = [law for law, own in zip(laws, stands, strict=True) if own >= floor] + [rule]
    left = [min(bit.damping_left(mode) for mode in mode_slopes(line, law, _MODES)) for law in laws]
    if max(left) <= 0.0:
        return laws[int(np.argmax(left))]
    good = [law for law, own in zip(laws, left, strict=True) if own > 0.0]
    return min(good, key=lambda law: bit.mean_square(line, law))


def tuned_over(lines: Sequence[Line], law_at: Callable[[float], DriveControl]) -> DriveControl:
    """Return the law whose smallest critical slope over several strings is largest.

    Parameters
    ----------
    lines : sequence of Line
        In torsion, the one in the middle first.
    law_at : callable
        The law of a wanted impedance over that of the pipe.

    Raises
    ------
    InputError
        If the first string and the drive are unstable under all of these.
    """

    def worst(law: DriveControl) -> float:
        if not all(drive_is_stable(line, law) for line in lines):
            return -np.inf
        return min(mode.slope for line in lines for mode in mode_slopes(line, law, _MODES))

    return max((law_at(_RULE), *_stable_laws(lines[0], law_at)), key=worst)


def _stable_laws(line: Line, law_at: Callable[[float], DriveControl]) -> list[DriveControl]:
    laws = [law_at(times) for times in np.geomspace(_LEAST, _MOST, _LOOKED).tolist()]
    if found := [law for law in laws if drive_is_stable(line, law)]:
        return found
    wanted = f"one under which some of {_LEAST:g} to {_MOST:g} times the pipe's is stable"
    raise InputError("drive", f"{laws[0].machine.lateness:g} s late", wanted)
