"""Growth rates of torsional swings on the drilling motion, predicted and in the simulator.

Random points of Table 1's rig, with damping taken away or added by feedback, or of a string of
pipe under imposed speed, with part of its own torsional damping. Small swings whose torsional rate
the simulator can tell (the swing grows or decays steadily above its ripple) are compared. Run as
``python -m benchmarks.motion [COUNT] [SEED] [paper-string]``; a point of a string takes 10 s.
"""

from __future__ import annotations

import math
import sys
from dataclasses import replace

import numpy as np

from drillctrl import (
    Controller,
    Drilling,
    RigPoint,
    Scenario,
    as_case,
    mode_at,
    preset_structure,
    simulate,
    string_preset,
    table1,
    torsional_modes,
)
from drillctrl.designs.controlled_swings import controlled_swings
from drillctrl.designs.swings import measured_swings
from drillctrl.motion.torsion import torsional_states
from drillctrl.strings.rig import lumped_values

_WINDOW = 4.0
# The swing is fitted while it is above this many times its smallest, which is the ripple.
_ABOVE = 3.0
_SIGN, _NEAR, _SHARE = 0.008, 0.005, 0.25


# An error of a rate, per unit of time, at which nothing is told of it.
_UNSURE = 0.02
# Of the bit's speed at the beginning.
_SWING = 0.04


def begun_in(case, mode):
    """Return the states in which a string swings in a mode: its bit alone weighs almost nothing."""
    matrix, _, places = torsional_states(case)
    roots, shapes = np.linalg.eig(matrix)
    shape = shapes[:, np.argmin(np.abs(roots - mode.root))]
    plant, point = case.physics("a mode")
    values = (shape / shape[1]).real * _SWING * point.omega0
    return {plant.state_names[i]: value for i, value in zip(places, values.tolist(), strict=True)}


def measured_rate(case, controller, frequency, initial=None):
    """Return the growth rate of the bit's swing at a frequency, None where it shows none."""
    _, point = case.physics("a rate")
    # Off the rock a long string is on its orbit at once; out of smooth drilling that may take as
    # long as a swing takes to die out as if there were no orbit.
    kick = 0.1 if initial is None else -2.0
    initial = initial or {"dtheta": _SWING * point.omega0}
    start = Scenario(initial=initial, kick=(kick, 0.0), alone=True)
    run = simulate(case, controller, duration=120.0, scenario=start, backwards="stop")
    length = _WINDOW * 2.0 * math.pi / frequency
    begins = np.arange(10.0, float(run.times[-1]) - length, 0.25 * length)
    if begins.size < 4:
        return None
    sizes = []
    for begin in begins:
        times = np.linspace(begin, begin + length, 2001)[:-1]
        weight = 1.0 - np.cos(2.0 * math.pi * (times - begin) / length)
        speed = run.at(times, ("dtheta",)).dtheta
        sizes.append(abs(2.0 * np.mean(weight * speed * np.exp(-1j * frequency * times))))
    sizes = np.array(sizes) / point.omega0
    # Small, and above what the ripple leaves at this frequency.
    kept = (sizes < 0.1) & (sizes > _ABOVE * 1e-3)
    stop = int(np.argmin(kept)) if not kept.all() else kept.size
    if stop < 4:
        return None
    fit, residual, *_ = np.polyfit(begins[:stop], np.log(sizes[:stop]), 1, full=True)
    scatter = math.sqrt(float(residual[0]) / stop) if residual.size else 0.0
    return None if scatter > 0.2 else float(fit[0])


def lumped_point(rng):
    """Return a random point of Table 1: text, prediction, its error and what was seen."""
    rpm, rop, gain = rng.uniform(60, 180), rng.uniform(5, 50), rng.uniform(-0.05, 0.12)
    structure, gains = preset_structure("pd"), np.array([0.0, gain])
    case = as_case(RigPoint(table1(), rpm * math.pi / 30.0, rop / 3600.0))
    text = f"{rpm:6.1f} {rop:6.1f} {gain:7.3f}"
    (swing,) = measured_swings(case, Drilling(kick=0.03))
    if not swing.known:
        return text, math.nan, math.inf, None
    (made,) = controlled_swings(case, Drilling(kick=0.03), [swing], structure, gains)
    controller = Controller(structure, *structure.gains(gains))
    # An error of H moves the rate by half of it.
    return text, made.growth, 0.5 * swing.error, measured_rate(case, controller, made.frequency)


def string_point(rng, name):
    """Return a random point of a string, as `lumped_point` does; below 100 rpm few show a rate."""
    rpm, rop, share = rng.uniform(100, 180), rng.uniform(5, 50), rng.uniform(0.0, 1.0)
    known = string_preset(name)
    damping = replace(known.string.damping, torsional=share * known.string.damping.torsional)
    string = replace(known.string, damping=damping)
    rig = replace(known, string=string, drive=None, **lumped_values(string))
    case = as_case(RigPoint(rig, rpm * math.pi / 30.0, rop / 3600.0))
    text = f"{rpm:6.1f} {rop:6.1f} {share:7.3f}"
    (mode,) = torsional_modes(case)
    at = mode_at(case, mode, 0.03, most_periods=40)
    if at.error > _UNSURE:
        return text, at.root.real, at.error, None
    rate = measured_rate(case, None, at.root.imag, begun_in(case, mode))
    return text, at.root.real, at.error, rate


def main() -> None:
    """Print each point and how many are right."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 50
    rng = np.random.default_rng(int(sys.argv[2]) if len(sys.argv) > 2 else 1)
    name = sys.argv[3] if len(sys.argv) > 3 else None
    told, looked = [], 0
    given = "gain" if name is None else "damping"
    print(f"{'rpm':>6} {'m/h':>6} {given:>7} {'predicted':>10} {'±':>8} {'simulator':>10}")
    while len(told) < count:
        text, growth, error, rate = lumped_point(rng) if name is None else string_point(rng, name)
        looked += 1
        if rate is None:
            print(f"{text} {growth:10.4f} {error:8.2g}       none", flush=True)
            continue
        told.append((growth, rate, error))
        print(f"{text} {growth:10.4f} {error:8.2g} {rate:10.4f}", flush=True)
    predicted, rates, errors = np.array(told).T
    large = np.abs(rates) > _SIGN
    wrong = (np.sign(predicted) != np.sign(rates)) & large
    near = np.abs(predicted - rates) <= np.maximum(_NEAR, _SHARE * np.abs(rates)) + errors
    print(f"{near.sum()} of {near.size} within {_SHARE:.0%} or {_NEAR}, beyond the error of H")
    print(f"sign wrong at {wrong.sum()} of {large.sum()} whose rate exceeds {_SIGN}")
    print(f"{looked - count} more points showed no rate: irregular, or gone at once")


if __name__ == "__main__":
    main()
