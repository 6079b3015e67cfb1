"""Cost of the simulator against a fixed-step loop of the same accuracy; its order; both cores.

The yardstick is what one would write by hand: Runge-Kutta steps of fixed length compiled by
numba, the delayed instant followed along the stored past, a bit that came to rest held until
the torque frees it. It is written from the equations, not from the package.
"""

from __future__ import annotations

import multiprocessing
import os
import time
from concurrent.futures import ProcessPoolExecutor
from typing import Any

import numba
import numpy as np
from unit import best_time, report, unit

from drillctrl import OperatingPoint, RigPoint, Simulation, simulate, string_preset

POINT = OperatingPoint(10.0, 2.5, 14.0)
DURATION = 400.0
KICK = {"dx": 1.0, "dtheta": 1.0}
ETA, XI, KAPPA, BLADES = 1.6, 0.02, 0.02, 4


@numba.njit(cache=True)
def acceleration(x, dx, theta, dtheta, depth, point, held, stuck):
    """x'' and θ'' (Eqs. 17-21); what friction holds does not move."""
    omega0, delta0, psi, lam, beta = point
    cut = max(depth, 0.0) - 2.0 * np.pi * delta0
    pressed = 1.0 if depth > 0.0 and delta0 * omega0 + dx > 0.0 else 0.0
    free = -2.0 * KAPPA * dtheta - theta - cut
    string = -2.0 * XI * ETA * dx - ETA * ETA * x - psi * cut
    if held:
        # The wear flat takes what it must.
        pressed = min(max((string + lam) / lam, 0.0), 1.0)
    ddx = 0.0 if held else string - lam * (pressed - 1.0)
    ddtheta = 0.0 if stuck else free - beta * (pressed - 1.0)
    return ddx, ddtheta, string + lam, free + beta - beta * pressed


@numba.njit(cache=True)
def hermite(a, da, b, db, h, s):
    """Cubic through values and slopes."""
    d = b - a
    return a + s * (h * da + s * (3.0 * d - h * (2.0 * da + db) + s * (h * (da + db) - 2.0 * d)))


@numba.njit(cache=True)
def fixed_steps(point, start, h, count):
    """Return x, x', θ, θ' at every step, (count + 1, 4); steady drilling before."""
    omega0, delta0, lam = point[0], point[1], point[3]
    rate = delta0 * omega0
    pitch = 2.0 * np.pi / BLADES
    path = np.empty((count + 1, 4))
    path[0] = start
    back, held, stuck = 0, False, False
    y, k, total = np.empty(4), np.empty(4), np.empty(4)
    for i in range(count):
        total[:] = 0.0
        for stage in range(4):
            c = 0.0 if stage == 0 else (0.5 if stage < 3 else 1.0)
            for n in range(4):
                y[n] = path[i, n] + (c * h * k[n] if stage else 0.0)
            t = (i + c) * h
            goal = omega0 * t + y[2] - pitch
            if goal < start[2]:
                # Before the start: steady drilling.
                before = goal / omega0
                lowered = rate * before
            else:
                while back + 1 < i and omega0 * (back + 1) * h + path[back + 1, 2] < goal:
                    back += 1
                while back > 0 and omega0 * back * h + path[back, 2] > goal:
                    back -= 1
                a, b = path[back], path[back + 1]
                low, high = 0.0, 1.0
                s = 0.5
                for _ in range(40):
                    turned = omega0 * (back + s) * h + hermite(a[2], a[3], b[2], b[3], h, s)
                    if turned > goal:
                        high = s
                    else:
                        low = s
                    new = s - (turned - goal) / max(h * (omega0 + a[3] + s * (b[3] - a[3])), 1e-9)
                    if new <= low or new >= high:
                        new = 0.5 * (low + high)
                    if abs(new - s) < 1e-13:
                        s = new
                        break
                    s = new
                lowered = rate * (back + s) * h + hermite(a[0], a[1], b[0], b[1], h, s)
            depth = BLADES * (rate * t + y[0] - lowered)
            ddx, ddtheta, push, torque = acceleration(
                y[0], y[1], y[2], y[3], depth, point, held, stuck
            )
            k[0], k[1], k[2], k[3] = y[1], ddx, y[3], ddtheta
            weight = 1.0 if stage in (0, 3) else 2.0
            for n in range(4):
                total[n] += weight * k[n]
        for n in range(4):
            path[i + 1, n] = path[i, n] + h / 6.0 * total[n]
        if stuck:
            path[i + 1, 3] = -omega0
            stuck = torque <= 0.0
        elif omega0 + path[i + 1, 3] < 0.0:
            path[i + 1, 3] = -omega0
            stuck = True
        if held:
            path[i + 1, 1] = -rate
            held = depth > 0.0 and 0.0 <= push <= lam
        elif rate + path[i + 1, 1] <= 0.0 and rate + path[i, 1] > 0.0:
            path[i + 1, 1] = -rate
            held = True
    return path


def orbit_of(times: Any, theta: Any, speed: Any) -> tuple[float, float]:
    """Return mean period and largest bit speed over the last half, from dense samples."""
    late = times > 0.5 * times[-1]
    times, theta, speed = times[late], theta[late], speed[late]
    beyond = theta - 0.5 * (theta.max() + theta.min())
    rising = np.flatnonzero((beyond[:-1] < 0.0) & (beyond[1:] >= 0.0))
    share = beyond[rising] / (beyond[rising] - beyond[rising + 1])
    crossings = times[rising] + share * (times[rising + 1] - times[rising])
    j = int(speed[1:-1].argmax()) + 1
    left, top, right = speed[j - 1 : j + 2]
    peak = top + (left - right) ** 2 / (8.0 * (2.0 * top - left - right))
    return float(np.diff(crossings).mean()), float(POINT.omega0 + peak)


def event_driven(rtol: float) -> tuple[float, float]:
    """Return period and largest bit speed of the package's simulator."""
    run = simulate(POINT, duration=DURATION, initial=KICK, rtol=rtol, atol=0.1 * rtol)
    times = np.linspace(0.0, DURATION, 400_001)
    motion = run.at(times)
    return orbit_of(times, motion.theta, motion.dtheta)


def one_run(seed: int) -> int:
    """Return the number of steps of a run from a slightly different start."""
    kick = {"dx": 1.0 + 1e-4 * seed, "dtheta": 1.0}
    return simulate(POINT, duration=DURATION, initial=kick, rtol=1e-6).steps


def warm_up(_: int) -> None:
    """Load the compiled code in a process."""
    one_run(0)
    time.sleep(0.3)


def string_run(seconds: float) -> Simulation:
    """Return a run of a 3 km string under its drive that starts with a jump of the bit's speed."""
    where = RigPoint(string_preset("vertical-3000"), 4.0 * np.pi, 15.0 / 3600.0)
    duration = seconds / where.rig.time_scale
    return simulate(where, duration=duration, initial={"dtheta": -0.5}, rtol=1e-6)


def main(runs: int) -> None:
    """Print the table."""
    one = unit()
    string_run(0.1)
    begun = os.times().user
    run = string_run(60.0)
    spent = os.times().user - begun
    size = f"{len(run.state_names)} states, rtol 1e-6: {run.steps} steps"
    print(f"60 s of 3 km, axial and torsional, {size}")
    report("processor", spent, one)
    report("wall", run.elapsed_seconds, one)
    report("dense 44 × 44 eigvals", one, one)
    exact = event_driven(1e-12)

    def error(found: tuple[float, float]) -> float:
        return max(abs(a / b - 1.0) for a, b in zip(found, exact, strict=True))

    ours = best_time(lambda: simulate(POINT, duration=DURATION, initial=KICK, rtol=1e-6))
    reached = error(event_driven(1e-6))
    report(f"stick-slip orbit, {DURATION:g} units at rtol 1e-6, error {reached:.0e}", ours, one)

    assert POINT.lam is not None
    point = (POINT.omega0, POINT.delta0, POINT.psi, POINT.lam, POINT.beta)
    start = np.array([0.0, KICK["dx"], 0.0, KICK["dtheta"]])
    for divisor in (200, 1_000, 5_000, 25_000):
        h = 1.0 / divisor
        count = round(DURATION / h)
        fixed_steps(point, start, h, 10)
        began = time.perf_counter()
        path = fixed_steps(point, start, h, count)
        spent = time.perf_counter() - began
        found = error(orbit_of(h * np.arange(count + 1), path[:, 2], path[:, 3]))
        report(f"fixed steps of 1/{divisor}, error {found:.0e}", spent, one)
        print(f"{'':58s} {spent / ours:12.1f} times the event-driven run")

    stopped = {"dtheta": -9.0}
    events = len(simulate(POINT, duration=60.0, initial=stopped).events)
    print(f"\nconvergence, t = 0 to 60 with {events} events (θ' against rtol 1e-13)")
    grid = np.linspace(0.0, 60.0, 6001)

    def motion(rtol: float) -> tuple[int, Any]:
        run = simulate(POINT, duration=60.0, initial=stopped, rtol=rtol, atol=0.1 * rtol)
        return run.steps, run.at(grid).dtheta

    best = motion(1e-13)[1]
    before = None
    for exponent in range(4, 12):
        steps, values = motion(10.0**-exponent)
        apart = float(abs(values - best).max())
        order = ""
        if before is not None:
            order = f"order {np.log(before[1] / apart) / np.log(steps / before[0]):.1f}"
        print(f"rtol 1e-{exponent:<3d} {steps:6d} steps  error {apart:.1e}  {order}")
        before = steps, apart

    print(f"\n{runs} runs of {DURATION:g} units at rtol 1e-6")
    began = time.perf_counter()
    for seed in range(runs):
        one_run(seed)
    alone = time.perf_counter() - began
    report("one process", alone, one)
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
        list(pool.map(warm_up, range(2)))
        began = time.perf_counter()
        list(pool.map(one_run, range(runs), chunksize=max(1, runs // 40)))
        both = time.perf_counter() - began
    report("two processes", both, one)
    print(f"{'':58s} {alone / both:12.2f} times as fast")


if __name__ == "__main__":
    import argparse

    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=1000)
    main(parser.parse_args().runs)
