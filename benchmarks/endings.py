"""How random runs end: none for a numerical reason, none in steps without end, all figures finite.

Table 1 and two tallies at 50-180 rpm and 5-60 m/h, without control and with, under several laws of
the drive, with limits, lags, delays and sampling, in several rocks and bit laws, from several
starts, at several tolerances; some strings rub on the wall. A run that ends otherwise than by the
motion, one that takes more steps within a hundredth of its duration than `CROWDED`, and one with a
figure that is no number are printed with their seed: each is a defect.
"""

from __future__ import annotations

import argparse
import math
import time
from collections import Counter
from dataclasses import replace
from typing import Any

import numpy as np

from drillctrl import (
    Case,
    Controller,
    InputError,
    RigPoint,
    Scenario,
    Simulation,
    Stribeck,
    Wall,
    as_case,
    drive_control,
    law_controller,
    paper_plant,
    simulate,
    string_preset,
    table1,
)
from drillctrl.simulation.loads import loads
from drillctrl.simulation.outcome import figures
from drillctrl.simulation.starts import start_named
from drillctrl.strings.rig import StringRig, WeightControl

RPM = math.pi / 30.0
SOUND = ("done", "reverse rotation", "diverges")
CROWDED = 20_000
STARTS = ("small", "kick", "back", "rest", "stick")
LAWS = ("stiff", "soft-torque", "z-torque")
STRINGS = ("paper-string", "vertical-3000")
GAINS = {
    "pd": ([0.0, -2.0], [0.0, 0.0]),
    "case1": ([-3.8], [3.6]),
    "case2": ([-5.0, -4.9], [4.0, 1.0]),
}


def pick(rng: np.random.Generator, values: Any) -> Any:
    """Return one of some values."""
    return values[int(rng.integers(len(values)))]


def surroundings(rng: np.random.Generator, unit: float) -> dict[str, Any]:
    """Return limit, lag, delay and period of a controller; ``unit`` is that of time, s."""
    found: dict[str, Any] = {"limit": pick(rng, (None, None, 0.3, 1.0, 3.0))}
    found["actuator_lag"] = pick(rng, (0.0, 0.0, 0.02)) / unit
    found["measurement_delay"] = pick(rng, (0.0, 0.0, 0.02)) / unit
    found["period"] = pick(rng, (None, None, 0.01 / unit))
    if found["actuator_lag"] and rng.random() < 0.3:
        found["rate_limit"] = 2.0
    return found


def lumped(rng: np.random.Generator) -> tuple[Case, Controller | None]:
    """Return Table 1 somewhere, and a controller or none."""
    where = RigPoint(table1(), rng.uniform(50, 180) * RPM, rng.uniform(5, 60) / 3600.0)
    law = Stribeck(drop=rng.uniform(0.5, 10.0), decay=rng.uniform(0.5, 3.0))
    case = as_case(where, paper_plant(pick(rng, (None, None, law))))
    name = pick(rng, (None, *GAINS))
    if name is None:
        return case, None
    factor = rng.uniform(-1.5, 1.5)
    now, past = ([factor * value for value in gains] for gains in GAINS[name])
    return case, Controller(name, now, past, **surroundings(rng, where.rig.time_scale))


def tally(rng: np.random.Generator) -> tuple[Case, Controller | None]:
    """Return a string of pipe under an imposed speed or a top drive, somewhere."""
    name = pick(rng, STRINGS)
    rig = string_preset(name).with_rock_strength(rng.uniform(10e6, 120e6))
    assert isinstance(rig, StringRig)
    if rng.random() < 0.3:
        rig = replace(rig, weight_control=WeightControl(20e3, 10.0 ** rng.uniform(-8.0, -6.0)))
    if rng.random() < 0.4:
        wall = Wall(rng.uniform(0.1, 0.5), side_force=10.0 ** rng.uniform(0.0, 2.7))
        sections = tuple(replace(section, wall=wall) for section in rig.string.sections)
        rig = replace(rig, string=replace(rig.string, sections=sections))
    spin, feed = rng.uniform(50, 180) * RPM, rng.uniform(5, 60) / 3600.0
    machine = string_preset("vertical-3000").drive
    assert machine is not None
    unit, turn = rig.torsional_stiffness, rig.time_scale
    bit = Stribeck(drop=rng.uniform(200, 5e3) / unit, decay=rng.uniform(1, 8) * turn)
    bit = pick(rng, (None, bit))
    if rng.random() < 0.2:
        where = RigPoint(replace(rig, drive=None), spin, feed)
        return as_case(where, paper_plant(bit, **where.rig.hardware())), None
    limit = pick(rng, (None, 60e3, 30e3, 20e3))
    delay, lag = pick(rng, (0.0, 0.02, 0.05)), pick(rng, (0.0, 0.0, 0.01))
    rig = replace(rig, drive=replace(machine, torque_limit=limit, delay=delay, lag=lag))
    control = drive_control(pick(rng, LAWS), rig)
    period, tracking = pick(rng, (None, None, 0.01)), pick(rng, (None, math.inf))
    return law_controller(RigPoint(rig, spin, feed), control, bit, period=period, tracking=tracking)


def setting(seed: int) -> tuple[Case, Controller | None, dict[str, Any]]:
    """Return what a seed runs: a case, a controller and options of `simulate`."""
    rng = np.random.default_rng([20, seed])
    # One in sixteen: they take as long as all others.
    string = rng.random() < 0.0625
    case, controller = (tally if string else lumped)(rng)
    _, point = case.physics("a campaign")
    start, kick = pick(rng, STARTS), rng.uniform(-0.9, 0.9)
    scenario = start_named(start).scenario()
    if rng.random() < 0.3:
        scenario = Scenario("steady", {"dtheta": kick * point.omega0})
    options = {
        "scenario": scenario,
        "duration": 20.0 if string else rng.uniform(20.0, 100.0),
        "rtol": 10.0 ** -rng.uniform(5.0, 7.0 if string else 10.0),
        "cutting": pick(rng, ("multiple", "multiple", "single")),
        "backwards": pick(rng, ("rest", "rest", "stop")),
    }
    return case, controller, options


def faults(run: Simulation, seed: int) -> list[str]:
    """Return what is wrong with a run; figures of some, for they take as long as the run."""
    found = [] if run.status in SOUND else [f"ends in {run.status}"]
    crowd = np.histogram(run.times, np.linspace(0.0, run.duration, 101))[0].max()
    if crowd > CROWDED:
        found.append(f"{crowd} steps within a hundredth of its duration")
    told: dict[str, Any] = {}
    if seed % 3 == 0:
        told |= {**run.summary.as_dict(), **loads(run).to_dict()}
    if seed % 10 == 0:
        told |= figures(run).to_dict()
    numbers = {name: value for name, value in told.items() if isinstance(value, float)}
    found += [f"{name} = {value}" for name, value in numbers.items() if not math.isfinite(value)]
    return found


def main(first: int, count: int) -> None:
    """Run them, tell what is wrong, and how they ended."""
    began, ends, steps, wrong = time.process_time(), Counter[str](), [0], 0
    for done in range(1, count + 1):
        seed = first + done - 1
        try:
            case, controller, options = setting(seed)
            run = simulate(case, controller, max_steps=2_000_000, **options)
        except InputError as error:
            # A drive with less torque than drilling takes, a start that a string has not.
            ends[f"refused: {error.parameter}"] += 1
        else:
            ends[str(run.status)] += 1
            steps.append(run.steps)
            for fault in faults(run, seed):
                wrong += 1
                print(f"seed {seed}: {fault}", flush=True)
        if done % 100 == 0 or done == count:
            each = 1e6 * (time.process_time() - began) / max(sum(steps), 1)
            ran = f"{sum(steps)} steps, at most {max(steps)} in a run, {each:.1f} µs each"
            print(f"seeds {first} to {seed}: {wrong} faults; {dict(ends)}; {ran}", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--count", type=int, default=2000)
    arguments = parser.parse_args()
    main(arguments.first, arguments.count)
