"""Growth rates of torsional swings on the drilling motion, predicted and in the simulator.

Random points of Table 1's rig, with damping taken away or added by feedback. Small swings whose
torsional rate the simulator can tell (the swing grows or decays steadily above its ripple) are
compared. Run as ``python -m benchmarks.motion [COUNT] [SEED]``.
"""

from __future__ import annotations

import math
import sys

import numpy as np

from drillctrl import Controller, Drilling, RigPoint, as_case, preset_structure, simulate, table1
from drillctrl.designs.controlled_swings import controlled_swings
from drillctrl.designs.swings import measured_swings

_WINDOW = 4.0
# The swing is fitted while it is above this many times its smallest, which is the ripple.
_ABOVE = 3.0
_SIGN, _NEAR, _SHARE = 0.008, 0.005, 0.25


def measured_rate(case, controller, frequency):
    """Return the growth rate of the bit's swing at a frequency, None where it shows none."""
    _, point = case.physics("a rate")
    initial = {"dx": 0.1 * point.penetration_rate, "dtheta": 0.04 * point.omega0}
    run = simulate(case, controller, duration=120.0, initial=initial, backwards="stop")
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


def main() -> None:
    """Print each point and how many are right."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 50
    rng = np.random.default_rng(int(sys.argv[2]) if len(sys.argv) > 2 else 1)
    structure, told = preset_structure("pd"), []
    print(f"{'rpm':>6} {'m/h':>6} {'gain':>7} {'predicted':>10} {'±':>8} {'simulator':>10}")
    while len(told) < count:
        rpm, rop, gain = rng.uniform(60, 180), rng.uniform(5, 50), rng.uniform(-0.05, 0.12)
        case = as_case(RigPoint(table1(), rpm * math.pi / 30.0, rop / 3600.0))
        (swing,) = measured_swings(case, Drilling(kick=0.03))
        if not swing.known:
            continue
        gains = np.array([0.0, gain])
        (made,) = controlled_swings(case, Drilling(kick=0.03), [swing], structure, gains)
        controller = Controller(structure, *structure.gains(gains))
        rate = measured_rate(case, controller, made.frequency)
        if rate is None:
            continue
        # An error of H moves the rate by half of it.
        error = 0.5 * swing.error
        told.append((made.growth, rate, error))
        line = f"{rpm:6.1f} {rop:6.1f} {gain:7.3f} {made.growth:10.4f} {error:8.2g} {rate:10.4f}"
        print(line, flush=True)
    predicted, rates, errors = np.array(told).T
    large = np.abs(rates) > _SIGN
    wrong = (np.sign(predicted) != np.sign(rates)) & large
    near = np.abs(predicted - rates) <= np.maximum(_NEAR, _SHARE * np.abs(rates)) + errors
    print(f"{near.sum()} of {near.size} within {_SHARE:.0%} or {_NEAR}, beyond the error of H")
    print(f"sign wrong at {wrong.sum()} of {large.sum()} whose rate exceeds {_SIGN}")


if __name__ == "__main__":
    main()
