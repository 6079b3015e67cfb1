"""Contact of bit and rock: loads where they are set-valued, at Z' = 0, at Φ' = 0 and on a face."""

from __future__ import annotations

from .data import (
    BY_TORQUE,
    BY_WEIGHT,
    DOWN,
    P_DOWN,
    P_FORWARD,
    P_PRESSED,
    P_REVERSE,
    P_TORQUE,
    P_UP,
    P_WEIGHT,
    REVERSE,
    RIDING,
    STUCK,
    TORQUE,
    UP,
    WALL,
    WALL_HELD,
    WEIGHT,
)
from .jit import entry
from .law import load


@entry
def bit_load(
    axial, angular, cut, speeds, contact, torsion, direction, behind, face, real, law, probe
):
    """Weight and torque on bit, with the set-valued loads of Φ' = 0 and Z' = 0 resolved.

    At Z' = 0 the share of the wear-flat force is the one that holds the bit, and on a face that
    it rides on the one with which it falls as that does (Filippov); at Φ' = 0 the
    torque is, and the cutters press as for Φ' > 0, since H(0) = 1 (Eq. 5). Behind the furthest
    angle that the bit has reached they rest on the rock with that weight, and bear no torque.
    The bit's part of the string rubs on the wall as the wear flat does on the rock.

    Parameters
    ----------
    axial, angular : float
        Accelerations of the bit under the load of steady drilling.
    cut : float
        Depth that is cut in contact, times the strength of the rock.
    speeds : tuple
        Z' and Φ'.
    contact, torsion, direction, behind : int
        The mode; ``direction`` is the axial one.
    face : tuple
        As of `face_at`, where the bit rides on it.
    real, law : array, tuple
        As in `Settings`.
    probe : array
        Takes the loads of the rock, and the accelerations at the ends of what they can be, on a
        face that the bit rides on those from it.

    Returns
    -------
    tuple
        Weight, and torque of rock and wall.
    """
    by_weight, by_torque, wall = real[BY_WEIGHT], real[BY_TORQUE], real[WALL]
    hold = real[WALL_HELD] if torsion == STUCK else wall
    axial -= by_weight * real[WEIGHT]
    angular -= by_torque * (real[TORQUE] + wall)
    weight, torque, pressed = 0.0, 0.0, 0.0
    if contact == 1:
        sign, turning = (-1.0, 0.0) if torsion == REVERSE else (1.0, cut)
        light = load((turning, 0.0, sign), speeds, law)
        full = load((turning, 1.0, sign), speeds, law)
        if behind == 1:
            light = load((cut, 0.0, 1.0), speeds, law)[0], load((0.0, 0.0, sign), speeds, law)[1]
            full = load((cut, 1.0, 1.0), speeds, law)[0], load((0.0, 1.0, sign), speeds, law)[1]
        up, down = axial + by_weight * light[0], axial + by_weight * full[0]
        if direction == RIDING:
            up -= face[1] * (angular + by_torque * (wall + light[1])) + face[2]
            down -= face[1] * (angular + by_torque * (wall + full[1])) + face[2]
        probe[P_UP], probe[P_DOWN] = up, down
        if direction == DOWN:
            pressed = 1.0
            weight, torque = full
        elif direction != UP:
            pressed = up / (up - down) if up != down else 0.0
            weight = light[0] + pressed * (full[0] - light[0])
            torque = light[1] + pressed * (full[1] - light[1])
        else:
            weight, torque = light
    probe[P_FORWARD] = angular + by_torque * (torque + hold)
    whole = torque - wall if torsion == REVERSE else torque + wall
    if torsion == STUCK:
        back = 0.0
        if contact == 1:
            back = load((0.0, pressed, -1.0), speeds, law)[1]
        probe[P_REVERSE] = angular + by_torque * (back - hold)
        whole = -angular / by_torque
        torque = whole if hold == 0.0 else min(max(whole, back), torque)
    probe[P_PRESSED], probe[P_WEIGHT], probe[P_TORQUE] = pressed, weight, torque
    return weight, whole
