"""Z-torque with the impedance that its string stands most under."""

from __future__ import annotations

import numpy as np

from drillctrl.base.errors import InputError
from drillctrl.base.kinds import checks_kinds
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
_LEAST, _MOST, _LOOKED = 1.0, 6.0, 9
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
    for times in np.geomspace(_LEAST, _MOST, _LOOKED).tolist():
        law = z_torque_control(machine, line.wave_impedance, times)
        if drive_is_stable(line, law):
            weakest = weakest_slope(line, law)
            found.append((lowest_impedance(line) if weakest is None else weakest.slope, law))
    if not found:
        wanted = f"one under which some of {_LEAST:g} to {_MOST:g} times the pipe's is stable"
        raise InputError("drive", f"{machine.lateness:g} s late", wanted)
    least = _KEPT * max(slope for slope, _ in found)
    kept = [law for slope, law in found if slope >= least]
    law = max(kept, key=lambda law: min(mode.slope for mode in mode_slopes(line, law, _MODES)))
    return DriveControl(TUNED, machine, law.speed, law.torque)
