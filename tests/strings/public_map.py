"""Stick-slip maps of a uniform string that are public, in their own units.

Aarsnes and van de Wouw, J. Sound Vib. 444 (2019); maps stored with their public code
(github.com/ulfjakob/AxialTorsionalDrillString, ``UTR_K_a10_beta10`` and ``UTR_K_a40_beta10``).
Unit of time is the torsional transit, of angle the one between two blades. Speed and feed of
the top are imposed; waves lose 30 % per transit to a viscous damping. Waves in tension are 1.6
times as fast; length and section are ours to choose, none bears on the map.
"""

from __future__ import annotations

import math

import numpy as np

from drillctrl import Case, RigPoint, Scenario, as_case, paper_plant, simulate
from drillctrl.base.arrays import FloatArray
from drillctrl.strings.drill_string import Damping, DrillString
from drillctrl.strings.model import PipeString
from drillctrl.strings.rig import string_rig
from drillctrl.strings.section import Material, Section

LENGTH, DENSITY, SHEAR, FASTER = 2000.0, 8000.0, 77e9, 1.6
OUTER, INNER = 0.127, 0.108
RADIUS, BLADES, INCLINATION, WEARFLAT = 0.108, 4, 0.6, 1.2e-3
WEAR_FORCE, WEAR_TORQUE = 200.0, 20.0
LOSS = -math.log(0.7)
DURATION, LOOKED_AT, STICKS = 60.0, 20.0, 0.99
# Ka, V0 → the last Ω0 that sticks and the next, which does not: five rows of each map.
BORDERS = {
    (10, 0.4894): (1.1493, 1.2827),
    (10, 1.0826): (1.3463, 1.4794),
    (10, 2.3950): (2.1981, 2.3842),
    (10, 5.2983): (3.2211, 3.4625),
    (10, 11.721): (5.3043, 5.6718),
    (40, 0.4894): (0.8266, 0.9226),
    (40, 1.0826): (0.8401, 0.9232),
    (40, 2.3950): (1.2442, 1.3496),
    (40, 5.2983): (2.7877, 2.9967),
    (40, 11.721): (3.7947, 4.0577),
}


def speeds(feed: float) -> FloatArray:
    """Return the 30 values of Ω0 in a row of the map."""
    return np.asarray(np.geomspace(0.2 * feed + 0.03, 1.2 * feed + 2.5, 30))


def upwind_retardation(cells: int, speed: float) -> float:
    """Return the damping of Kelvin and Voigt, in transits, that upwind steps amount to.

    First-order upwind of a wave of speed c lets it diffuse with c dx (1 - c dt/dx)/2, which decays
    like a retardation of dx/c - dt. Steps of the public code are bounded by the waves, and by 212
    cells from blade to blade at ten times the speed.
    """
    transit = 1.0 / (FASTER * cells)
    return transit - min(0.99 * transit, 1.0 / (10.0 * 212.0 * speed))


def public_case(
    cutting: float,
    feed: float,
    speed: float,
    *,
    retardation: float = 0.0,
    torsional_frequency: float | None = None,
    axial_frequency: float | None = None,
    tolerance: float = 2e-3,
) -> tuple[Case, float]:
    """Return a point of the map, and its transit in units of the case's time.

    Parameters
    ----------
    cutting, feed, speed : float
        Ka, V0 and Ω0 in the units of the map.
    retardation : float
        Of Kelvin and Voigt, in transits; the maps have none.
    torsional_frequency, axial_frequency, tolerance : float
        As `PipeString`.
    """
    transit = LENGTH * math.sqrt(DENSITY / SHEAR)
    elasticity = FASTER**2 * SHEAR
    damping = Damping(LOSS / transit, LOSS / transit, retardation * transit)
    steel = Material(DENSITY, elasticity, SHEAR)
    string = DrillString((Section("pipe", "pipe", LENGTH, OUTER, INNER, material=steel),), damping)
    impedance = string.torsion.wave_impedance
    area = string.mass / (LENGTH * DENSITY)
    pitch = 2.0 * math.pi / BLADES
    rock = cutting * elasticity * area / (RADIUS * INCLINATION * BLADES * LENGTH)
    # Lengths are measured by what they bring in torque.
    per_metre = 0.5 * RADIUS**2 * rock * BLADES / impedance * transit / pitch
    force = WEAR_FORCE * elasticity * area / (per_metre * LENGTH)
    torque = WEAR_TORQUE * impedance * pitch / transit
    rig = string_rig(
        string,
        rock_strength=rock,
        contact_strength=force / (RADIUS * WEARFLAT),
        bit_radius=RADIUS,
        wearflat_length=WEARFLAT,
        cutter_inclination=INCLINATION,
        friction_coefficient=2.0 * torque / (force * RADIUS),
        bit_geometry=1.0,
        blades=BLADES,
    )
    where = RigPoint(rig, speed * pitch / transit, feed / (per_metre * transit))
    reduced = PipeString(string, torsional_frequency, axial_frequency, tolerance)
    return as_case(where, paper_plant(string=reduced)), transit / rig.time_scale


def swing(case: Case, transit: float, *, rtol: float = 1e-5, duration: float = DURATION) -> float:
    """Return (Ω0 − min Ω)/Ω0 over the last 20 transits; 1 or more is stick-slip.

    The first axial mode sets off with 0.3 V0 upward. Cutting is by the last pass alone, as in
    the maps.
    """
    assert case.point is not None
    kick = -0.3 * case.point.penetration_rate
    string = case.rig.string  # type: ignore[union-attr]
    mode = math.sqrt(2.0 / string.mass)
    start = Scenario(initial={"dx": kick, "dx1": kick / mode}, alone=True)
    run = simulate(case, scenario=start, duration=duration * transit, cutting="single", rtol=rtol)
    assert str(run.status) == "done"
    tail = run.on_steps(5, (duration - LOOKED_AT) * transit, ("dtheta",))
    return -float(tail.dtheta.min()) / case.point.omega0


class Wave:
    """Waves on a damped string by characteristics, a cell a step; speed is imposed at its top.

    Down- and upward waves are v ± w, v the rate and w the load in units of the impedance.
    """

    def __init__(self, cells: int, step: float, rate: float, load: float) -> None:
        self.rate, self.loss = rate, 0.25 * step * LOSS
        # So steady motion loads it: twice the loss of each cell.
        loads = load + 4.0 * self.loss * rate * np.arange(cells, -1, -1)
        self.down, self.up = rate + loads, rate - loads

    def move(self) -> float:
        """Move waves on by a step; return what arrives at the bit."""
        lost = self.loss * (self.down + self.up)
        down, up = (self.down - lost)[:-1], (self.up - lost)[1:]
        both = self.loss * (down[:-1] + up[1:]) / (1.0 + 2.0 * self.loss)
        self.down[1:-1], self.up[1:-1] = down[:-1] - both, up[1:] - both
        self.up[0] = up[0] - 2.0 * self.loss * self.rate
        self.down[0] = 2.0 * self.rate - self.up[0]
        return float(down[-1])

    def leave(self, arrived: float, rate: float) -> None:
        """Send a wave upward from a bit that moves at a rate."""
        self.down[-1] = arrived - 2.0 * self.loss * rate
        self.up[-1] = 2.0 * rate - self.down[-1]


def swing_by_characteristics(
    cutting: float, feed: float, speed: float, *, cells: int = 100, duration: float = DURATION
) -> float:
    """Return the same as `swing` without elements, modes or events.

    A step is the transit over ``cells``; the set-valued loads at the bit, which has no inertia, are
    those that hold it if they can.
    """
    step = 1.0 / cells
    torsion = Wave(cells, step, speed, feed / speed + WEAR_TORQUE)
    tension = Wave(
        round(cells / FASTER), step, feed, FASTER * (cutting * feed / speed + WEAR_FORCE)
    )
    kick = -0.3 * feed * np.sin(0.5 * np.pi * np.linspace(0.0, 1.0, tension.down.size))
    tension.down += kick
    tension.up += kick
    before = math.ceil(cells / speed) + 2
    count = round(duration * cells)
    place = feed * step * np.arange(-before, count + 1)
    angle = speed * step * np.arange(-before, count + 1)
    v, o, lag, least = feed, speed, 0, math.inf
    damped = 1.0 + 2.0 * tension.loss
    for k in range(before, before + count):
        pushed, turned = tension.move(), torsion.move()
        v_before, o_before = v, o
        for _ in range(2):
            x, phi = place[k] + 0.5 * step * (v_before + v), angle[k] + 0.5 * step * (o_before + o)
            place[k + 1], angle[k + 1] = x, phi
            while lag > 0 and angle[lag] > phi - 1.0:
                lag -= 1
            while angle[lag + 1] <= phi - 1.0 and lag + 1 < k:
                lag += 1
            share = (phi - 1.0 - angle[lag]) / max(angle[lag + 1] - angle[lag], 1e-300)
            depth = x - place[lag] - share * (place[lag + 1] - place[lag])
            cut, wear = max(depth, 0.0), WEAR_FORCE if depth > 0.0 else 0.0
            light = pushed - FASTER * cutting * cut
            full = light - FASTER * wear
            pressed = 1.0 if full > 0.0 else 0.0
            v = max(full, min(light, 0.0)) / damped
            if light > 0.0 >= full:
                pressed = light / (light - full)
            rub = WEAR_TORQUE * pressed if depth > 0.0 else 0.0
            o = max(turned - cut - rub, min(turned + rub, 0.0)) / damped
        place[k + 1] = place[k] + 0.5 * step * (v_before + v)
        angle[k + 1] = angle[k] + 0.5 * step * (o_before + o)
        tension.leave(pushed, v)
        torsion.leave(turned, o)
        if k - before >= count - LOOKED_AT * cells:
            least = min(least, o)
    return 1.0 - least / speed
