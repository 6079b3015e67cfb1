"""Reduced and exact strings against each other at random, and what designed drives stand.

``python -m benchmarks.strings [COUNT]`` counts growing roots of COUNT random strings, drives and
points on both routes, compares the roots, measures a fixed-order law on strings of 2500 m, and
slows a bit down under four laws until it sticks.

A reduced string is right up to its frequencies, ten Hz by default, and says nothing of what cutting
excites further up. So the rule for counts is: as many growing roots on both routes up to there.
Where the whole counts differ, both are taken again below a line amid roots next to that end.
"""

from __future__ import annotations

import itertools
import sys
import time
from dataclasses import replace

import numpy as np

from drillctrl import (
    DelaySystem,
    DriveMachine,
    RigPoint,
    characteristic_roots,
    count_growing,
    count_right_of,
    drive_control,
    dynamic_drive_control,
    exact_loop,
    mode_slopes,
    rule_control,
    slow_down,
    string_preset,
    weakest_slope,
)
from tests.strings.test_counts import LAWS, random_case
from tests.strings.test_drives import LATE, LONG, long_string

# How many of the cases have their roots compared, too.
_COMPARED = 0.1


def end_of_band(system: DelaySystem, band: float) -> float:
    """Return a frequency at the end of the band that no root of the reduced string is next to."""
    near = [root.imag for root in characteristic_roots(system, -0.3)]
    edges = [0.9 * band, *sorted(s for s in near if 0.9 * band < s < band), band]
    low, high = max(itertools.pairwise(edges), key=lambda pair: pair[1] - pair[0])
    return 0.5 * (low + high)


def counts(number: int) -> None:
    """Say how many counts agree, and how far roots up to 10 Hz are apart."""
    rng = np.random.default_rng(2026)
    agree, beyond, worst, began = 0, 0, 0.0, time.perf_counter()
    for i in range(number):
        case = random_case(rng, LAWS[i % len(LAWS)])
        system, loop = case.system(), exact_loop(case)
        reduced, exact = count_right_of(system, 0.0).count, loop.count_right_of(0.0)
        if reduced != exact:
            top = end_of_band(system, 2.0 * np.pi * min(case.plant.string.frequencies) / loop.rate)
            growing = characteristic_roots(system, 0.0)
            below = [root for root in growing if root.imag < top]
            reduced = sum(root.multiplicity * (2 if root.imag > 0.0 else 1) for root in below)
            exact = loop.count_right_of(0.0, top)
            beyond += reduced == exact
            hertz = top * loop.rate / (2.0 * np.pi)
            print(f"case {i}: {reduced} reduced, {exact} exact up to {hertz:.3g} Hz", flush=True)
            for root in growing:
                hertz = abs(root.value) * loop.rate / (2.0 * np.pi)
                off = abs(loop.root(root.value) - root.value)
                print(f"  root {root.value:.4g} at {hertz:.3g} Hz, {off:.2g} from the exact one")
        agree += reduced == exact
        if i % 50 == 49:
            print(f"{agree} of {i + 1}", flush=True)
        if i < _COMPARED * number:
            for root in characteristic_roots(system, -0.3):
                if abs(root.value) * loop.rate < 20.0 * np.pi:
                    off = abs(loop.root(root.value) - root.value)
                    worst = max(worst, off / max(abs(root.value), 1.0))
    elapsed = time.perf_counter() - began
    print(f"{agree} of {number} counts agree, {beyond} of them only up to the end of the band;")
    print(f"roots within {worst:.2g}, {elapsed:.0f} s")


def fixed_order() -> None:
    """Say what a law of second order stands over lengths of ±20 %, beside soft torque."""
    began = time.perf_counter()
    law = dynamic_drive_control(LONG.torsion, LATE, 2)
    elapsed = time.perf_counter() - began
    soft = rule_control("soft-torque", LATE, LONG)
    known = min(mode.slope for mode in mode_slopes(LONG.torsion, soft))
    print(f"soft torque stands {known:.1f} N m s; designed in {elapsed:.1f} s:")
    for length in np.linspace(2000.0, 3000.0, 11):
        line = long_string(length).torsion
        least = min(mode.slope for mode in mode_slopes(line, law))
        weakest = weakest_slope(line, law)
        high = "any" if weakest is None else f"{weakest.slope:.2f} at {weakest.frequency:.2f} Hz"
        print(
            f"{length:.0f} m: {least:.1f} ({least / known:.2f} times), weakest of all {high}, "
            f"{count_growing(line, law)} growing"
        )


def stick_slip() -> None:
    """Say at what speed stick-slip begins on `vertical-3000`, slowing down by steps of 5 rpm."""
    machine = DriveMachine(2900.0, torque_limit=60e3, delay=0.02)
    rig = replace(string_preset("vertical-3000").with_rock_strength(1e6), drive=machine)
    where = RigPoint(rig, 10.0, 1e-4 / 3600.0)
    rpm = np.pi / 30.0
    for name in ("stiff", "soft-torque", "z-torque", "dynamic-2"):
        began = time.perf_counter()
        control = drive_control(name, rig)
        run = slow_down(where, control, (np.arange(95.0, 15.0, -5.0) * rpm).tolist(), hold=40.0)
        swing = run.swings[-1] if run.swings.size else float("nan")
        print(
            f"{name}: stick-slip from {run.stick_slip / rpm:.0f} rpm, linear {run.linear / rpm:.0f}"
            f" rpm; swing {swing:.2f} at {run.speeds[-1] / rpm:.0f} rpm, "
            f"{time.perf_counter() - began:.0f} s"
        )


if __name__ == "__main__":
    fixed_order()
    stick_slip()
    counts(int(sys.argv[1]) if len(sys.argv) > 1 else 1000)
