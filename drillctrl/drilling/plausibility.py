"""What is possible, but no rig that anyone has seen: mistakes in a unit look like this."""

from __future__ import annotations

import math

from drillctrl.base.kinds import checks_kinds
from drillctrl.drilling.point import RigPoint
from drillctrl.drilling.steady import steady_state

# Bits from 3 1/4 in to 17 1/2 in; soft clay to the hardest granite; 100 t on bit.
_BIT_RADIUS = (0.04, 0.2225)
_ROCK_STRENGTH = (1e6, 1e9)
_ROTARY_SPEED = (10.0, 500.0)
_DEEPEST_CUT = 0.03
_HEAVIEST = 1e6


@checks_kinds
def plausibility_notes(point: RigPoint) -> tuple[str, ...]:
    """Return a sentence for each number that no drilling rig is known to have.

    Parameters
    ----------
    point : RigPoint
        Where it drills.

    Returns
    -------
    tuple of str
        Empty where everything is usual. Nothing is refused: the numbers may be meant.
    """
    rig = point.rig
    rpm = point.rotary_speed * 30.0 / math.pi
    cut = 2.0 * math.pi * point.penetration_rate / point.rotary_speed
    weight = steady_state(point).weight_on_bit
    notes = []
    if rig.bit_radius > _BIT_RADIUS[1]:
        inches = rig.bit_radius / 0.0254
        notes.append(
            f"a bit radius of {rig.bit_radius:.4g} m is a bit of {2 * inches:.4g} in;"
            f" is {inches:.4g} in its diameter?"
        )
    if rig.bit_radius < _BIT_RADIUS[0]:
        notes.append(f"a bit radius of {1e3 * rig.bit_radius:.4g} mm is less than bits have")
    if not _ROCK_STRENGTH[0] <= rig.rock_strength <= _ROCK_STRENGTH[1]:
        notes.append(
            f"a rock strength of {rig.rock_strength / 1e6:.4g} MPa is outside of what is drilled,"
            " 1 to 1000 MPa"
        )
    if not _ROTARY_SPEED[0] <= rpm <= _ROTARY_SPEED[1]:
        notes.append(f"a rotary speed of {rpm:.4g} rpm is unusual")
    if cut > _DEEPEST_CUT:
        notes.append(f"a cut of {1e3 * cut:.4g} mm a turn is deeper than bits cut, 30 mm")
    if weight > _HEAVIEST:
        notes.append(f"a weight on bit of {weight / 1e3:.4g} kN is more than strings carry")
    return tuple(notes)
