"""What exported controllers do where they should not follow their law."""

import math

import numpy as np
import pytest

from drillctrl import Change, InputError, OperatingPoint, Scenario, simulate
from drillctrl.tables.export_c import export_c
from drillctrl.tables.scheduling import course, scheduled
from drillctrl.tables.settings import STATUS_BITS

from .exported import InC, InPython, InScl, Interpreted, Translated, hostile, matiec

PERIOD, LIMIT = 0.01, 3.0
AT, DELAY = (10.0, 2.5, 14.0), 0.105
BIT = {name: value for name, value, _ in STATUS_BITS}
BUSY = {"rate_limit": 20.0, "release": 7, "watchdog": 4, "hold": 2, "fade": 9, "ramp": 5}
SETS = ({}, BUSY, {"outside": "hold", "hold": 0, "fade": 0, "ramp": 0, "release": 3})


def driven(controller, count, **options):
    """Run a controller on a signal that moves, so that it is at full size."""
    return [controller.step([wave(k)], AT, DELAY, **options) for k in range(count)]


def wave(k):
    return 0.05 * math.sin(0.1 * k) + 0.05


@pytest.mark.long(but=1)
@pytest.mark.parametrize(
    ("options", "compiler"), [*((options, "gcc") for options in SETS), (BUSY, "clang")]
)
def test_hostile_inputs_stay_within_the_limit_and_the_status_says_so(
    small, tmp_path, options, compiler, tool
):
    tool(compiler)
    sanitizer = ("-fsanitize=undefined", "-fno-sanitize-recover=all") if compiler == "gcc" else ()
    given = {"period": PERIOD, "limit": LIMIT, **options}
    exported = InC(small, tmp_path, compiler=compiler, flags=sanitizer, **given)
    reference = InPython(small, tmp_path, **given)
    seen, before, worst = 0, 0.0, 0.0
    for y, at, delay, on, extra in hostile(small, PERIOD, 10_000):
        u = exported.step(y, at, delay, on, **extra)
        assert abs(u) <= LIMIT
        limit = extra["limit"]
        assert not limit < LIMIT or abs(u) <= max(limit, 0.0)
        sound = all(math.isfinite(value) for value in (*y, *at, delay))
        sound &= math.isfinite(extra.get("elapsed", 0.0)) and extra.get("elapsed", 1.0) > 0.0
        assert sound or exported.status & (BIT["HELD"] | BIT["CLOCK"])
        if "rate_limit" in options and on and before is not None and not limit < LIMIT:
            assert abs(u - before) <= 0.2 * (1 + 1e-12)
        before = u if on and not limit < LIMIT else None
        expected = reference.step(y, at, delay, on, **extra)
        worst = max(worst, abs(u - expected))
        assert exported.status == reference.status
        assert exported.vouched == reference.vouched
        seen |= exported.status
    assert worst < 1e-12
    assert seen == 255 - (0 if "rate_limit" in options else BIT["SLOWED"])


@pytest.mark.long(but=1)
@pytest.mark.parametrize("language", [Interpreted, InScl, Translated])
@pytest.mark.parametrize("options", SETS)
def test_the_function_block_is_the_c_under_hostile_inputs(
    small, on_rig, tmp_path, language, options
):
    if language is Translated and matiec() is None:
        pytest.skip("no iec2c on the path")
    for table, period, limit in ((small, PERIOD, LIMIT), (on_rig, 0.01, 5000.0)):
        options = {**options, "period": period, "limit": limit}
        one, two = (kind(table, tmp_path, **options) for kind in (language, InC))
        for y, at, delay, on, extra in hostile(table, period, 1_000, seed=3):
            u, v = (runs.step(y, at, delay, on, **extra) for runs in (one, two))
            assert u == pytest.approx(v, rel=1e-12, abs=1e-12 * limit)
            assert (one.status, one.vouched) == (two.status, two.vouched)


def test_float_stays_within_the_limit_too(small, tmp_path):
    exported = InC(small, tmp_path, real="float", period=PERIOD, limit=LIMIT, **BUSY)
    for y, at, delay, on, extra in hostile(small, PERIOD, 10_000, seed=5):
        assert abs(exported.step(y, at, delay, on, **extra)) <= LIMIT


def test_one_sample_that_is_none_is_held_and_many_fade(small, tmp_path):
    broken, sound = (
        InC(small, folder(tmp_path, name), period=PERIOD, limit=LIMIT, ramp=0, hold=2, fade=10)
        for name in "ab"
    )
    driven(broken, 40), driven(sound, 40)
    for _ in range(2):
        # The last good sample stands for the present one.
        u, v = broken.step([math.nan], AT, DELAY), sound.step([wave(39)], AT, DELAY)
        assert u == v != 0.0
        assert broken.status == BIT["HELD"]
    for k in range(42, 60):
        u, v = broken.step([math.inf], AT, DELAY), sound.step([wave(39)], AT, DELAY)
        assert u == pytest.approx(v * max(0.0, 1.0 - (k - 41) / 10), abs=1e-12)
        assert broken.status == BIT["HELD"] | BIT["LOST"]
    for k in range(60, 75):
        u, v = broken.step([wave(k)], AT, DELAY), sound.step([wave(k)], AT, DELAY)
        assert u == pytest.approx(v * min(1.0, (k - 59) / 10), abs=1e-12)
        assert broken.status == 0


def folder(path, name):
    path = path / name
    path.mkdir()
    return path


@pytest.mark.parametrize("outside", ["fade", "hold"])
def test_where_the_table_does_not_vouch_its_last_gains_fade_or_stay(small, tmp_path, outside):
    runs = [
        InC(small, folder(tmp_path, name), period=PERIOD, limit=LIMIT, fade=8, outside=outside)
        for name in "ab"
    ]
    for one in runs:
        driven(one, 60)
    for k in range(60, 80):
        u = runs[0].step([wave(k)], (10.0, 60.0, 14.0), DELAY)
        v = runs[1].step([wave(k)], AT, DELAY)
        share = max(0.0, 1.0 - (k - 59) / 8) if outside == "fade" else 1.0
        assert u == pytest.approx(share * v, abs=1e-12)
        assert (runs[0].status, runs[0].vouched) == (BIT["OUTSIDE"], False)
    for one in runs:
        # Switched on outside, nothing has ever been vouched for.
        one.init()
        first = [one.step([wave(k)], (10.0, 60.0, 14.0), DELAY) for k in range(50)]
        assert first == [0.0] * 50


@pytest.mark.parametrize("outside", ["fade", "hold"])
def test_the_simulator_fades_and_holds_as_the_exported_controller_does(small, tmp_path, outside):
    """Over a transient on which the table is left and entered again, to a delay of 11 samples."""
    point = OperatingPoint(10.0, 2.5, 14.0)
    changes = (Change(35.0, omega0=160.0 / 11.0), Change(35.7, omega0=10.0), Change(37.0, psi=15.0))
    scenario = Scenario(initial={"dtheta": 0.5}, changes=changes)
    start, period = 30.0, point.delay / 16
    options = {"period": period, "limit": LIMIT, "rate_limit": 40.0}
    exported = InC(small, tmp_path, ramp=0, fade=20, outside=outside, **options)
    control = scheduled(
        small, point, scenario, activation=start, fade=20, outside=outside, duration=40.0, **options
    )
    run = simulate(point, control, scenario=scenario, duration=40.0)
    count = int(9.5 / period)
    times = start + np.arange(-100, count) * period
    theta, held = run.at(times).theta, run.at(times[100:] + period / 2).torque
    # What the top end does otherwise than at the start is taken off.
    rest = theta - commanded_turn(scenario, point, times)
    places = course(point, scenario, times + 2e-9)
    delays = [2.0 * math.pi / (point.blades * omega0) for omega0 in places[:, 0]]
    u, seen = [], 0
    for k, (y, at, delay) in enumerate(zip(rest, places, delays, strict=True)):
        u.append(exported.step([y], at, delay, k >= 100))
        seen |= exported.status
    assert seen & BIT["OUTSIDE"]
    assert np.abs(np.array(u[100:]) - held).max() < 1e-12
    assert np.ptp(held) > 0.1


def commanded_turn(scenario, point, times):
    """Return by how much the top end has turned further than at the start's speed."""
    turned = np.zeros(len(times))
    knots = [(change.time, change.omega0) for change in scenario.changes if change.omega0]
    for (time, after), end in zip(knots, [*(t for t, _ in knots[1:]), 1e9], strict=True):
        turned += (after - point.omega0) * np.clip(times - time, 0.0, end - time)
    return turned


def test_what_units_have_rounded_is_inside(small, on_rig, tmp_path):
    for real, rounding in (("double", 1e-12), ("float", 1e-7)):
        for table in (small, on_rig):
            exported = InC(table, tmp_path, real=real, period=PERIOD, limit=LIMIT)
            ends = table.grid.coordinates[[0, -1]]
            vouched = [exported.lookup(end)[1] for end in ends]
            for factor in (1.0 - rounding, 1.0 + rounding):
                assert [exported.lookup(factor * end)[1] for end in ends] == vouched
            assert not exported.lookup(1.001 * ends[1])[1]


def test_frozen_signals_are_reported_and_fade_where_that_is_asked(small, tmp_path):
    for name, options, fades in (("a", {}, False), ("b", {"watchdog": 6, "fade": 5}, True)):
        exported = InC(small, folder(tmp_path, name), period=PERIOD, limit=LIMIT, ramp=0, **options)
        driven(exported, 40)
        stuck = [exported.step([wave(39)], AT, DELAY) for _ in range(40)]
        assert exported.status == BIT["FROZEN"]
        assert (stuck[-1] == 0.0) == fades
        assert stuck[5] != 0.0
        # One sample that moves is enough to begin again.
        exported.step([0.051], AT, DELAY)
        assert exported.status == 0


@pytest.mark.parametrize("elapsed", [0.0, -PERIOD, -1e9, math.nan])
def test_a_clock_that_stands_or_runs_back_gives_no_samples(small, tmp_path, elapsed):
    exported = InC(small, tmp_path, period=PERIOD, limit=LIMIT, ramp=0, hold=3, fade=5)
    driven(exported, 40)
    late = [exported.step([wave(k)], AT, DELAY, elapsed=elapsed) for k in range(40, 60)]
    assert exported.status == BIT["HELD"] | BIT["LOST"] | BIT["CLOCK"]
    assert late[-1] == 0.0
    # The field falls back to the period, so one who measures no time need not set it.
    for k in range(60, 70):
        exported.step([wave(k)], AT, DELAY)
    assert exported.status == 0
    exported.step([wave(70)], AT, DELAY, elapsed=3 * PERIOD)
    assert exported.status == BIT["CLOCK"]


def test_hand_over_and_release_have_no_step(small, tmp_path):
    exported = InC(small, tmp_path, period=PERIOD, limit=LIMIT, ramp=40, release=30)
    for k in range(30):
        assert exported.step([wave(k)], AT, DELAY, on=False) == 0.0
    taken = [exported.step([wave(k)], AT, DELAY, other=2.0) for k in range(30, 90)]
    left = [exported.step([wave(k)], AT, DELAY, on=False) for k in range(90, 130)]
    assert taken[0] == pytest.approx(2.0, abs=0.15)
    assert np.abs(np.diff([2.0, *taken])).max() < 0.15
    assert left[:30] == pytest.approx([taken[-1] * (29 - k) / 30 for k in range(30)], abs=1e-12)
    assert left[30:] == [0.0] * 10
    # Switched on again on the way down, it goes on from there.
    driven(exported, 60)
    falling = [exported.step([wave(k)], AT, DELAY, on=False) for k in range(60, 70)][-1]
    again = exported.step([wave(70)], AT, DELAY, other=-2.0)
    assert again == pytest.approx(falling, abs=0.1)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("outside", "full"), ("fade", -1), ("hold", -1), ("hold", 0.5), ("watchdog", 0),
        ("rate_limit", 0.0), ("rate_limit", math.nan), ("release", -1), ("ramp", 10**10),
    ],
)  # fmt: skip
def test_senseless_options_are_refused(small, tmp_path, name, value):
    with pytest.raises(InputError, match=f"{name} = "):
        export_c(small, tmp_path, period=PERIOD, limit=LIMIT, **{name: value})
    assert not list(tmp_path.iterdir())
