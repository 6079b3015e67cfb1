"""No run ends for a numerical reason; contact begins at no depth; runs can be stopped."""

from __future__ import annotations

import math
import signal
import time

import numpy as np
import pytest

from drillctrl.base.errors import InputError
from drillctrl.drilling.point import OperatingPoint, RigPoint
from drillctrl.drilling.rig import table1
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.run import Interrupted, simulate


def table1_at(rpm, rop):
    return RigPoint(table1(), rpm * 2.0 * math.pi / 60.0, rop / 3600.0)


@pytest.mark.parametrize("rtol", [1e-6, 1e-7, 1e-8, 1e-9])
def test_a_step_that_was_cut_short_says_nothing_of_the_next(rtol):
    point = OperatingPoint(
        2.209568367121137, 0.32984777118405606, 14.141728333124295, eta=1.5956481642552995,
        xi=0.05055989043706882, kappa=0.049869554492294264, lam=10.551116371699043,
        beta=0.2685953091684435,
    )  # fmt: skip
    controller = Controller("pd", [0.0, -2.0], limit=1.0)
    kick = {"dx": 0.01, "dtheta": 0.05}
    run = simulate(point, controller, duration=60.0, initial=kick, rtol=rtol)
    assert run.status == "done"
    assert run.steps < 10_000


@pytest.mark.parametrize(
    ("rpm", "rop", "K1", "rtol", "dx", "dtheta", "cutting"),
    [
        (58.53278611805623, 44.75622625343331, None, 1e-6,
         0.16074830456382527, 0.19521628325528528, "single"),
        (65.23239447078554, 19.780346661470357, [0.0, -2.0], 1e-6,
         0.15436943198270003, -0.09970373656318761, "single"),
        (69.83169496983031, 54.324942272480065, [0.0, -2.0], 1e-6,
         -0.11739392698763913, 0.1544047864470796, "single"),
    ],
)  # fmt: skip
def test_breaks_within_rounding_are_passed(rpm, rop, K1, rtol, dx, dtheta, cutting):
    controller = None if K1 is None else Controller("pd", K1)
    run = simulate(
        table1_at(rpm, rop), controller, duration=100.0, initial={"dx": dx, "dtheta": dtheta},
        rtol=rtol, cutting=cutting,
    )  # fmt: skip
    assert run.status == "done"


def test_hard_bounce_goes_on():
    random = np.random.default_rng(3)
    for _ in range(40):
        controller = Controller("pd", [0.0, -2.0], limit=1.0) if random.integers(2) else None
        run = simulate(
            table1_at(random.uniform(50.0, 90.0), random.uniform(20.0, 60.0)), controller,
            duration=40.0, initial={"dx": 0.1, "dtheta": random.uniform(-0.1, 0.1)},
            rtol=10.0 ** -random.uniform(5.0, 9.0),
        )  # fmt: skip
        assert run.status in ("done", "reverse rotation")


@pytest.mark.parametrize(
    ("rpm", "rop", "rtol", "K1"),
    [
        (50.726814018190666, 57.32895600901735, 1e-6, [0.0, -2.0]),
        (77.45155205552612, 38.12657113354402, 1e-5, None),
    ],
)
def test_contact_begins_and_ends_where_the_depth_is_nothing(rpm, rop, rtol, K1):
    """Also where it falls like a root; unless the face itself jumps there."""
    controller = None if K1 is None else Controller("pd", K1, limit=1.0)
    kick = {"dx": 0.1, "dtheta": 0.05}
    run = simulate(table1_at(rpm, rop), controller, duration=80.0, initial=kick, rtol=rtol)
    times = np.array([e.time for e in run.events if e.name in ("return", "loss")])
    motion = run.on_steps(2, names=("depth",))
    end = np.searchsorted(motion.times, times)
    before, after = motion.depth[end], motion.depth[end + 1]
    np.testing.assert_array_equal(motion.times[end], times)
    smooth = abs(after - before) < 1e-4
    assert smooth.sum() > 50
    assert np.minimum(abs(before), abs(after))[smooth].max() < 2e-6


def test_a_run_stops_at_its_time_limit():
    began = time.perf_counter()
    run = simulate(OperatingPoint(10.0, 2.5, 14.0), duration=1e5, rtol=1e-12, time_limit=0.3)
    assert run.status == "time limit"
    assert 0.3 < time.perf_counter() - began < 20.0
    assert np.isfinite(run.at([run.times[-1]]).x).all()
    with pytest.raises(InputError, match="time_limit"):
        simulate(OperatingPoint(10.0, 2.5, 14.0), duration=1.0, time_limit=0.0)


def test_an_interrupt_is_heard_within_a_second():
    heard = []

    def interrupt(*_):
        heard.append(time.process_time())
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, interrupt)
    began = time.process_time()
    try:
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        with pytest.raises(Interrupted) as stopped:
            simulate(OperatingPoint(10.0, 2.5, 14.0), duration=1e5, rtol=1e-12)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)
    assert heard[0] - began < 1.3
    assert time.process_time() - began < 2.3
    kept = stopped.value.simulation
    assert kept.status == "interrupted"
    assert kept.steps > 100
    assert str(kept.duration)[:3] in str(stopped.value)
    again = simulate(OperatingPoint(10.0, 2.5, 14.0), duration=float(kept.times[50]), rtol=1e-12)
    np.testing.assert_array_equal(again.times[:50], kept.times[:50])
