"""Laws of a top drive: the same torque in every language, and that of the continuous law."""

import csv
import ctypes
import re
import subprocess
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drillctrl import (
    DriveMachine,
    InputError,
    RigPoint,
    Scenario,
    Transfer,
    changed_rig,
    cli,
    drive_control,
    export_drive,
    law_controller,
    pi_control,
    sampled_drive,
    sampled_radius,
    simulate,
    simulate_drive,
    string_preset,
    transfer_control,
)
from drillctrl.strings.drive_stepped import SteppedDrive
from drillctrl.tables.drive_arithmetic import drive_float_difference, float_words
from drillctrl.tables.reserved import is_identifier

from .exported import FLAGS, SERIAL, compiled
from .iec import Block, load
from .test_arithmetic import COUNTING

RIG = string_preset("vertical-3000")
DRIVE = RIG.drive
PIPE = RIG.string.torsion.wave_impedance
NAMES = ("soft-torque", "z-torque", "dynamic-2", "observer-1")
LIMIT = 40e3
CARE = {"fade": 7, "hold": 2, "watchdog": 5, "rate_limit": 4e6, "release": 6, "ramp": 9}


@pytest.fixture(scope="module")
def laws():
    """One a kind, over three depths, and two that have no integral or no states."""
    rigs = [changed_rig(RIG, depth=depth) for depth in (2000.0, 2600.0, 3000.0)]
    found = {}
    for name in NAMES:
        controls = [drive_control(name, rig) for rig in (rigs if name != "dynamic-2" else rigs[:1])]
        depths = (2000.0, 2600.0, 3000.0)[: len(controls)]
        found[name] = sampled_drive(controls, period=5e-3, limit=LIMIT, depths=depths, **CARE)
    own = transfer_control(DRIVE, Transfer((900.0, 4e3), (0.05, 1.0)))
    found["own"] = sampled_drive(own, period=5e-3, limit=8e3)
    found["resistance"] = sampled_drive(
        [pi_control(DRIVE, factor * PIPE, 0.0) for factor in (2.0, 3.0)], period=0.02, limit=5e3,
        depths=(1000.0, 2000.0), ramp=20,
    )  # fmt: skip
    # As of a drive that is soft where it turns slowly and the rock is hard.
    found["scheduled"] = sampled_drive(
        [pi_control(DRIVE, (2.0 + 0.1 * i) * PIPE, 900.0 + 50.0 * i) for i in range(24)],
        period=0.01, limit=8e3, ramp=9, watchdog=6,
        axes={"rotary_speed": (6.0, 12.0, 18.0), "depth": (2000.0, 3000.0),
              "rock_strength": (4e7, 9e7), "mud": (1000.0, 1400.0)},
    )  # fmt: skip
    return found


def listed(place):
    return [place] if isinstance(place, float) else list(place)


class InC:
    REALS = ("slow", "drag", "speed", "error", "integral", "start", "command")
    COUNTS = ("node", "active", "tracking", "vouched", "status", "seen", "missing", "equal",
              "trust", "releasing")  # fmt: skip

    def __init__(self, law, folder, compiler="gcc", flags=()):
        export_drive(law, Path(folder) / "drive.c")
        double, whole = ctypes.c_double, ctypes.c_int32
        fields = [("x", double * law.order), ("good", double * (3 + len(law.axes)))]
        fields += [(name, double) for name in self.REALS] + [(n, whole) for n in self.COUNTS]
        fields += [("limit", double), ("elapsed", double)]
        self.state = type("State", (ctypes.Structure,), {"_fields_": fields})()
        binary = Path(folder) / f"drive_{next(SERIAL)}.so"
        source = Path(folder) / "drive.c"
        self.library = compiled([source], binary, *FLAGS, *flags, compiler=compiler)
        self.library.drive_step.restype = double
        self.library.drive_init(ctypes.byref(self.state))

    def step(self, speed, set_point, torque, place, on, **given):
        for name, value in given.items():
            setattr(self.state, name, value)
        values = map(ctypes.c_double, (speed, set_point, torque, *listed(place)))
        return self.library.drive_step(ctypes.byref(self.state), *values, int(on))

    status = property(lambda self: self.state.status)
    vouched = property(lambda self: bool(self.state.vouched))


class InPython:
    def __init__(self, law, folder):
        self._steps = SteppedDrive(law)

    def step(self, speed, set_point, torque, depth, on, **given):
        for name, value in given.items():
            setattr(self._steps, name, value)
        return self._steps.step(speed, set_point, torque, depth, on)

    status = property(lambda self: self._steps.status)
    vouched = property(lambda self: self._steps.vouched)


class InST:
    ending = ".st"

    def __init__(self, law, folder):
        path = export_drive(law, Path(folder) / f"drive{self.ending}")
        self.block, self.law = Block(load(path.read_text())["DRIVE"]), law

    def step(self, speed, set_point, torque, depth, on, **given):
        names = {"limit": "TighterLimit", "elapsed": "ElapsedTime"}
        given = {names[name]: value for name, value in given.items()}
        given.setdefault("ElapsedTime", self.law.period)
        words = {"depth": "StringDepth", "rotary_speed": "RotarySpeed",
                 "rock_strength": "RockStrength", "mud": "MudDensity"}  # fmt: skip
        place = {words[n]: x for (n, _), x in zip(self.law.axes, listed(depth), strict=True)}
        self.block(
            MeasuredSpeed=speed, WantedSpeed=set_point, GivenTorque=torque, Enable=bool(on),
            **place, **given,
        )  # fmt: skip
        return self.block.TORQUECOMMAND

    status = property(lambda self: self.block.STATUSBITS)
    vouched = property(lambda self: self.block.VOUCHED)


class InScl(InST):
    ending = ".scl"


def hostile(law, count, seed=0):
    """Yield what a broken encoder, clock or operator may hand to a drive."""
    rng = np.random.default_rng(seed)
    worst = (np.nan, np.inf, -np.inf, 1e300, -1e300, 1e15, -1e14, 1e12, 0.0, -0.0, 5e-324)
    low, high = (np.array([values[end] for _, values in law.axes]) for end in (0, -1))
    speed, wanted, torque, place, on, kind = 12.0, 12.0, 5e3, 0.5 * (low + high), True, 0
    wide = 0.05 * (high - low) + 0.01 * low
    for _ in range(count):
        if rng.random() < 0.08:
            kind = int(rng.integers(10))
        given = {}
        if kind != 3:
            speed = 12.0 + 3.0 * rng.normal()
        torque += 100.0 * rng.normal()
        place = np.clip(
            place + wide * rng.normal(size=low.size), low - 0.5 * wide, high + 0.5 * wide
        )
        sample = [speed, wanted, torque, *place.tolist()]
        if kind == 1:
            sample[rng.integers(len(sample))] = float(rng.choice(worst))
        elif kind == 2:
            sample[0] *= float(rng.choice((-1.0, 1.0)))
        elif kind == 4:
            given["elapsed"] = float(rng.choice([*worst, -law.period, 1.7 * law.period]))
        elif kind == 5:
            wanted = float(rng.choice((0.0, 6.0, 18.0)))
        elif kind == 6:
            sample[3] = float(rng.choice((0.0, 1e4, -5.0)))
        elif kind == 7:
            on = bool(rng.integers(2))
        elif kind == 8:
            given["limit"] = float(rng.choice([*worst, 1e3]))
        elif kind == 9:
            sample[2] = float(rng.choice((-7e4, 0.0, 7e4)))
        if kind != 8:
            given["limit"] = 1e9
        yield *sample[:3], sample[3:], on, given


@pytest.mark.long(but=1)
@pytest.mark.parametrize("name", [*NAMES, "own", "resistance", "scheduled"])
def test_every_language_gives_the_same_torque(laws, tmp_path, name):
    law, kinds = laws[name], (InC, InST, InScl)
    reference = InPython(law, tmp_path)
    others = [kind(law, tmp_path) for kind in kinds]
    seen, largest = 0, 0.0
    for *sample, on, given in hostile(law, 700, seed=2):
        expected = reference.step(*sample, on, **given)
        seen, largest = seen | reference.status, max(largest, abs(expected))
        assert abs(expected) <= law.limit
        for other in others:
            u = other.step(*sample, on, **given)
            assert u == pytest.approx(expected, rel=1e-12, abs=1e-12 * LIMIT), type(other)
            assert (other.status, other.vouched) == (reference.status, reference.vouched)
    assert largest == law.limit
    wanted = 2 + 4 + 16 + 128 + (8 + 64 if law.rate else 0) + any(law.edges)
    assert seen & wanted == wanted


COUNTED = """
extern "C" double count_step(const double *given, int on, double elapsed, double limit)
{
    static drill_state state;
    static bool begun;
    if (!begun) { drill_init(&state); begun = true; }
    state.elapsed = elapsed; state.limit = limit;
    return drill_step(&state, GIVEN, on).v;
}
"""


@pytest.mark.long(but=1)
@pytest.mark.parametrize("name", ["soft-torque", "dynamic-2", "own", "resistance", "scheduled"])
def test_no_step_costs_more_than_the_header_says(laws, tmp_path, name, tool):
    """The same source, compiled as C++ with numbers that count what is done to them."""
    tool("g++")
    law = laws[name]
    source = export_drive(law, tmp_path / "drill.c")
    header = source.with_suffix(".h").read_text()
    said = r"at most (\d+) operations a step, (\d+) of them divisions, and\s+\*\s+(\d+) comp"
    stated = [int(number) for number in re.search(said, header).groups()]
    header = header.replace('#ifdef __cplusplus\nextern "C" {\n#endif\n', "")
    header = header.replace("#ifdef __cplusplus\n}\n#endif\n", "").replace("double", "Real")
    minus = "static Real &operator-=(Real &a, Real b) { return a = a - b; }\n"
    source.with_suffix(".h").write_text(COUNTING.replace("#include <cmath>", "") + minus + header)
    given = ", ".join(f"given[{k}]" for k in range(3 + len(law.axes)))
    counted = source.read_text().replace("double", "Real") + COUNTED.replace("GIVEN", given)
    (tmp_path / "count.cpp").write_text(counted)
    library = compiled([tmp_path / "count.cpp"], tmp_path / "count.so", "-w", compiler="g++")
    counters = [
        ctypes.c_long.in_dll(library, n) for n in ("operations", "divisions", "comparisons")
    ]
    library.count_step.restype = ctypes.c_double
    most = [0, 0, 0]
    for *sample, place, on, extra in hostile(law, 6_000, seed=4):
        before = [counter.value for counter in counters]
        values = (ctypes.c_double * (3 + len(place)))(*sample, *place)
        elapsed, limit = (ctypes.c_double(extra.get(n, law.period)) for n in ("elapsed", "limit"))
        library.count_step(values, int(on), elapsed, limit)
        spent = [c.value - b for c, b in zip(counters, before, strict=True)]
        most = [max(a, b) for a, b in zip(most, spent, strict=True)]
    assert all(a <= b for a, b in zip(most, stated, strict=True)), (most, stated)
    assert stated[0] <= 1.15 * most[0]
    assert stated[2] <= 1.3 * most[2]


def test_what_was_found_of_a_law_stands_in_all_that_is_written(laws, tmp_path):
    told = "sampled every 5 ms the string stands 118 N·m·s"
    for ending in (".c", ".st", ".scl", ".xml", ".fmu"):
        path = export_drive(laws["own"], tmp_path / f"drill{ending}", verdict=told)
        if ending == ".fmu":
            with zipfile.ZipFile(path) as unit:
                text = unit.read("modelDescription.xml").decode()
        else:
            text = path.with_suffix(".h" if ending == ".c" else ending).read_text("utf-8")
        assert "Verdict" in text
        assert "the string stands 118 N m s" in text
    silent = export_drive(laws["own"], tmp_path / "silent.c").with_suffix(".h").read_text()
    assert "no string was asked" in silent


@pytest.mark.long(but=1)
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_ten_thousand_hostile_samples_stay_within_the_limit(laws, tmp_path, tool, compiler):
    """And two good minutes later it holds the speed again."""
    tool(compiler)
    for name in ("soft-torque", "z-torque", "observer-1"):
        law = laws[name]
        steps, python = InC(law, tmp_path, compiler), InPython(law, tmp_path)
        for *sample, on, given in hostile(law, 10_000):
            u = steps.step(*sample, on, **given)
            python.step(*sample, on, **given)
            limit = given.get("limit", LIMIT)
            assert abs(u) <= min(LIMIT, max(limit, 0.0) if limit < LIMIT else LIMIT)
            if np.isnan([*sample[:3], *listed(sample[3])]).any():
                assert steps.status & (2 | 4)
        # A drive on endless pipe, from where the last sample found it.
        speed, u = 12.0, 0.0
        for _ in range(int(120.0 / law.period)):
            u = steps.step(speed, 12.0, u, [values[0] for _, values in law.axes], True, limit=1e9)
            speed += law.period * (u - 5e3 - PIPE * (speed - 12.0)) / DRIVE.inertia
        assert steps.status == 0
        assert (speed, u) == (pytest.approx(12.0, abs=0.5), pytest.approx(5e3, rel=0.1))


@pytest.mark.long
def test_the_source_is_clean_under_sanitizers_and_cppcheck(laws, tmp_path, tool):
    tool("cppcheck")
    for law in laws.values():
        export_drive(law, tmp_path / "drive.c")
        places = "".join(f" {values[0]!r} + (k * 4.0)," for _, values in law.axes)
        main = (
            '#include "drive.h"\nint main(void) { drive_state s; double u = 0.0; int k;'
            " drive_init(&s); for (k = 0; k < 900; k++) { u = drive_step(&s, (k % 7) * 3.0,"
            f" 12.0, u,{places} (k % 90) < 80); }} return (u > 1e9) ? 1 : 0; }}\n"
        )
        (tmp_path / "main.c").write_text(main)
        for compiler in ("gcc", "clang"):
            build = [compiler, *FLAGS, "-fsanitize=address,undefined", "-fno-sanitize-recover=all",
                     "-o", "run", "main.c", "drive.c"]  # fmt: skip
            subprocess.run(build, cwd=tmp_path, check=True)
            subprocess.run(["./run"], cwd=tmp_path, check=True)
        check = ["cppcheck", "--error-exitcode=1", "--enable=warning,style,performance", "-q",
                 "--suppress=knownConditionTrueFalse", "drive.c"]  # fmt: skip
        subprocess.run(check, cwd=tmp_path, check=True)


@pytest.mark.long(but=1)
@pytest.mark.parametrize("name", ["soft-torque", "z-torque", "observer-1"])
def test_the_sampled_law_becomes_the_continuous_one_as_the_period_shrinks(name):
    """The held torque is half a period late: first order, with the string in the loop."""
    where, unit = RigPoint(RIG, 12.0, 10.0 / 3600.0), RIG.time_scale
    control = drive_control(name, RIG)
    # Both begin alike to the last digit where no string is led along.
    kick = Scenario(initial={"dtheta": 2.0}, alone=True)
    options = {"duration": 1.6 / unit, "scenario": kick, "rtol": 1e-7}
    case, continuous = law_controller(where, control)
    expected = simulate(case, continuous, **options)
    at = np.linspace(0.0, 1.6 / unit, 400)
    exact, apart = expected.at(at, ("phi",)).phi, []
    for period in (4e-3, 2e-3, 1e-3):
        law = sampled_drive(control, period=period, limit=100e3)
        run = simulate_drive(where, law, **options)
        apart.append(abs(run.at(at, ("phi",)).phi - exact).max() / abs(exact).max())
    assert apart[2] < 1e-2
    assert np.log2(np.array(apart[:-1]) / apart[1:]).min() > 0.9


def test_the_law_itself_is_of_second_order():
    """Against its exact answer to a ramp of speed, with what the drive gives known."""
    control = drive_control("z-torque", RIG)
    end, errors = 0.2, []
    for period in (4e-3, 2e-3, 1e-3):
        law = sampled_drive(control, period=period, limit=1e9)
        steps = SteppedDrive(law)
        for k in range(1 + round(end / period)):
            u = steps.step(0.5 * k * period, 0.0, 0.0)
        exact = -0.5 * _ramp(control.speed, end)
        machine = control.machine
        through = Transfer((machine.inertia, 0.0), (machine.torque_filter, 1.0))
        exact += 0.5 * _ramp(_product(through, control.torque), end)
        errors.append(abs(u - exact) / abs(exact))
    assert errors[-1] < 1e-3
    assert np.log2(np.array(errors[:-1]) / errors[1:]).min() > 1.9


def _product(first, second):
    return Transfer(
        tuple(np.polymul(first.numerator, second.numerator)),
        tuple(np.polymul(first.denominator, second.denominator)),
    )


def _ramp(law, time):
    """The answer to a ramp of slope 1, by partial fractions of G(s)/s²."""
    import scipy.signal

    below = np.polymul(law.denominator, [1.0, 0.0, 0.0])
    residues, poles, _ = scipy.signal.residue(law.numerator, below, tol=1e-6)
    total, power = 0.0, 0
    for i, (residue, pole) in enumerate(zip(residues, poles, strict=True)):
        power = power + 1 if i and abs(pole - poles[i - 1]) < 1e-6 else 0
        total += residue * time**power * np.exp(pole * time) / np.prod(np.arange(1, power + 1))
    return float(np.real(total))


def test_it_takes_over_hands_over_and_does_not_wind_up(laws):
    law = laws["soft-torque"]
    steps = SteppedDrive(replace(law, rate=None))
    for k in range(50):
        assert steps.step(11.0 + 0.01 * np.sin(k), 12.0, 7e3, 2000.0, on=False) == 0.0
    # From the torque of whatever was in control, at a speed that is not yet the set point.
    first = steps.step(11.0, 12.0, 7e3, 2000.0)
    assert first == pytest.approx(7e3)
    before = u = first
    for k in range(200):
        before, u = u, steps.step(11.9 + 1e-4 * (k % 2), 12.0, u, 2000.0)
    # Another depth: the integral takes the difference.
    after = steps.step(11.9, 12.0, u, 3000.0)
    assert after - u == pytest.approx(u - before, rel=0.5, abs=2.0)
    assert SteppedDrive(law).step(11.9, 12.0, 0.0, 3000.0) != pytest.approx(after, rel=1e-3)
    # Stalled for a minute at the limit, it lets go as soon as the speed is beyond the set point.
    for k in range(12_000):
        u = steps.step(1e-6 * (k % 2), 12.0, u, 3000.0)
    assert (u, steps.status) == (LIMIT, 128)
    after_stall = [steps.step(12.0 + 0.02 * k, 12.0, u, 3000.0) for k in range(1, 60)]
    assert after_stall[-1] < LIMIT - 500.0
    wound_up = law.nodes[2].K * 12.0 * 60.0
    assert wound_up > 20 * LIMIT


def test_a_lost_encoder_takes_the_torque_away_and_comes_back_without_a_bump(laws):
    law = laws["soft-torque"]
    steps, u = SteppedDrive(law), 6e3
    for k in range(100):
        u = steps.step(12.0 + 1e-6 * (k % 2), 12.0, u, 2000.0)
    assert u == pytest.approx(6e3, rel=1e-3)
    lost = [steps.step(np.nan, 12.0, u, 2000.0) for _ in range(law.hold + law.fade)]
    assert lost[: law.hold] == pytest.approx([u] * law.hold, rel=1e-3)
    falls = [lost[law.hold - 1] * (law.fade - k) / law.fade for k in range(1, law.fade + 1)]
    assert lost[law.hold :] == pytest.approx(falls, abs=1e-9)
    back = steps.step(9.0, 12.0, 0.0, 2000.0)
    assert (back, steps.status) == (pytest.approx(0.0, abs=1e-9), 0)
    frozen = [steps.step(9.0, 12.0, 0.0, 2000.0) for _ in range(5)]
    assert steps.status & 8
    assert abs(frozen[-1]) < abs(frozen[-2])


def test_a_period_that_is_too_long_for_the_law_is_told():
    """Against the simulator: what grows on endless pipe grows on the string."""
    where, unit = RigPoint(RIG, 12.0, 10.0 / 3600.0), RIG.time_scale
    control = drive_control("z-torque", RIG)
    for period, grows in ((5e-3, False), (2e-2, True)):
        law = sampled_drive(control, period=period, limit=1e6)
        assert (sampled_radius(law, PIPE) > 1.0) == grows
        run = simulate_drive(where, law, duration=2.0 / unit, initial={"dphi": 0.01}, rtol=1e-5)
        assert (abs(run.motion.drive).max() * RIG.torsional_stiffness > 1e5) == grows
    # A drive alone, J ω' = u held, under u = −Kp ω: 1 − Kp T/J.
    alone = DriveMachine(1000.0, torque_filter=0.5)
    for gain in (1e4, 3e4):
        law = sampled_drive(pi_control(alone, gain, 0.0), period=0.1, limit=1.0)
        expected = max(abs(1.0 - gain * 0.1 / 1000.0), 1.0)
        assert sampled_radius(law, 1e-9) == pytest.approx(expected, rel=1e-2)


def test_the_unit_is_valid_and_gives_the_same_torque(laws, tmp_path):
    fmpy = pytest.importorskip("fmpy")
    from fmpy.validation import validate_fmu

    law = laws["z-torque"]
    rng = np.random.default_rng(1)
    count = 400
    signals = np.zeros(
        count,
        dtype=[(n, float) for n in ("time", "speed", "set_point", "torque", "depth")]
        + [("enable", bool)],
    )
    signals["time"] = np.arange(count) * law.period
    signals["speed"] = 12.0 + np.cumsum(0.02 * rng.normal(size=count))
    signals["set_point"], signals["torque"] = 12.0, 8e3 + 100.0 * rng.normal(size=count)
    signals["depth"] = np.where(np.arange(count) < 200, 2000.0, 2700.0)
    signals["enable"] = np.arange(count) > 20
    steps = SteppedDrive(law)
    expected = [steps.step(*map(float, list(row)[1:5]), bool(row[5])) for row in signals.tolist()]
    for fmi in ("3.0", "2.0"):
        path = export_drive(law, tmp_path / "drive.fmu", fmi=fmi)
        assert validate_fmu(str(path)) == []
        found = fmpy.simulate_fmu(
            str(path), start_time=0.0, stop_time=(count - 1) * law.period,
            step_size=law.period, output_interval=law.period, input=signals, output=["u"],
        )  # fmt: skip
        # u after a step is the torque from its beginning on; discrete inputs count from a step on
        # or from the one before, by fmpy's version.
        off = [np.abs(found["u"][1 + lag :] - expected[: count - 1 - lag]).max() for lag in (0, 1)]
        assert min(off) < 1e-7 < max(off)
    with zipfile.ZipFile(path) as archive:
        told = archive.read("modelDescription.xml").decode()
    assert "trapezoidal rule" in told
    assert 'unit="N.m"' in told


@pytest.mark.parametrize("name", ["soft-torque", "scheduled", "resistance"])
def test_vectors_are_what_the_c_answers_and_the_bench_replays_them(laws, tmp_path, name):
    law = laws[name]
    export_drive(law, tmp_path / "drive.st")
    exported, seen = InC(law, tmp_path), 0
    lines = (tmp_path / "drive.vectors.csv").read_text().splitlines()[1:]
    rows = [{k: float(v) for k, v in row.items()} for row in csv.DictReader(lines)]
    for row in rows:
        place = [row[axis] for axis, _ in law.axes]
        u = exported.step(
            row["speed"], row["set_point"], row["torque"], place, int(row["enable"]),
            elapsed=row["elapsed"], limit=row["limit"],
        )  # fmt: skip
        assert u == pytest.approx(row["u"], abs=1e-12 * law.limit)
        assert (exported.status, exported.vouched) == (row["status"], row["vouched"])
        seen |= exported.status
    # All that can happen does, as far as the law knows it.
    assert seen == 255 - 32 - (0 if law.rate else 64)
    text = (tmp_path / "drive.st").read_text() + (tmp_path / "drive_bench.st").read_text()
    bench = Block(load(text)["DRIVE_BENCH"])
    for _ in range(len(rows) + 1):
        bench()
    assert bench.PASSED
    assert 1e-9 * law.limit > bench.LARGESTDEVIATION


@pytest.mark.parametrize("name", ["soft-torque", "dynamic-2", "scheduled"])
def test_float_differs_by_no_more_than_is_stated(laws, tmp_path, name):
    law = laws[name]
    export_drive(law, tmp_path / "drive.c", real="float")
    told = drive_float_difference(law)
    assert f"{told.torque:.3g} N m" in (tmp_path / "drive.h").read_text()
    library = compiled([tmp_path / "drive.c"], tmp_path / f"float_{next(SERIAL)}.so", *FLAGS)
    library.drive_step.restype = ctypes.c_float
    state, steps = ctypes.create_string_buffer(4096), SteppedDrive(law)
    library.drive_init(state)
    rng, worst = np.random.default_rng(0), 0.0
    middle = [0.5 * (values[0] + values[-1]) * 1.01 for _, values in law.axes]
    for k in range(3000):
        sample = [
            12.0 + 3.0 * np.sin(0.05 * k) + 0.01 * rng.normal(),
            12.0,
            5e3 + rng.normal(),
            *middle,
        ]
        given = [float(np.float32(value)) for value in sample]
        u = library.drive_step(state, *map(ctypes.c_float, given), 1)
        off = abs(u - steps.step(*given[:3], given[3:]))
        worst = max(worst, off)
        assert off <= told.torque + (k + 1) * told.drift
    assert worst > 0.0


@pytest.mark.long
def test_float_is_refused_where_it_cannot_hold_the_law(laws, tmp_path):
    with pytest.raises(InputError, match="float could change the torque"):
        export_drive(laws["z-torque"], tmp_path / "drive.c", real="float")
    assert not list(tmp_path.iterdir())


@pytest.mark.long
def test_blark_takes_the_block_and_no_name_is_taken(laws, tmp_path):
    blark = pytest.importorskip("blark")
    blark.parse_source_code(export_drive(laws["own"], tmp_path / "plain.st").read_text())
    for name in ("z-torque", "own"):
        text = export_drive(laws[name], tmp_path / "soft_drive.st").read_text()
        declared = [line.split(" : ")[0].strip() for line in text.splitlines() if " : " in line]
        assert len(declared) > 60
        assert all(is_identifier(word) for word in declared)
        xml = export_drive(laws[name], tmp_path / "soft_drive.xml").read_text()
        assert 'pouType="functionBlock"' in xml
        block, bench = xml.split('pouType="program"')
        assert block.count("<variable ") == len(declared)
        assert "LargestDeviation" in bench


@pytest.mark.parametrize(
    ("given", "parameter"),
    [
        ({"period": 0.0}, "period"), ({"limit": None}, "limit"), ({"depths": (1.0, 2.0)}, "depths"),
        ({"rate_limit": -1.0}, "rate_limit"), ({"watchdog": 0}, "watchdog"),
        ({"hold": 1.5}, "hold"),
    ],
)  # fmt: skip
def test_what_no_drive_can_do_is_refused(given, parameter):
    control = pi_control(DRIVE, 1e3, 1e3)
    with pytest.raises(InputError, match=parameter):
        sampled_drive(control, **{"period": 0.01, "limit": 1e4, **given})


def test_laws_that_differentiate_or_grow_are_refused(tmp_path):
    lagging = replace(DRIVE, lag=0.01)
    for control in (
        pi_control(lagging, 1e3, 1e3, 500.0),
        transfer_control(DRIVE, Transfer((1.0,), (1.0, -1.0))),
        transfer_control(DRIVE, Transfer((1.0,), (1.0, 0.0, 0.0))),
        transfer_control(DRIVE, Transfer((1.0,), (1.0, 0.0, 4.0))),
    ):
        with pytest.raises(InputError, match="control"):
            sampled_drive(control, period=0.01, limit=1e4)
    law = sampled_drive(pi_control(DRIVE, 1e3, 1e3), period=0.01, limit=1e4)
    for bad in ("drive.csv", "9.c", "Enable.st", "LIMIT.xml", "fastestchange.scl"):
        with pytest.raises(InputError):
            export_drive(law, tmp_path / bad)
    assert not list(tmp_path.iterdir())


@pytest.mark.long
def test_the_command_writes_laws_over_depth_and_at_one(tmp_path, capsys):
    def call(*arguments):
        base = ("table", "--rig", "vertical-3000", "--structure", "soft-torque")
        with pytest.raises(SystemExit) as stop:
            cli.main([*base, *arguments])
        return stop.value.code, *capsys.readouterr()

    out = str(tmp_path / "drive.c")
    given = ("--out", out, "--period", "10 ms", "--limit", "40 kN*m", "--rate-limit", "80 kN*m/s")
    status, told, _ = call(*given, "--depth", "2500:3000:2 m", "--watchdog", "50")
    assert status == 0
    assert "Held to the middle between depths" in told
    header = (tmp_path / "drive.h").read_text()
    for words in ("2500 m: Kp", "3000 m: Kp", "at most 800 N m a sample", "50 equal speeds"):
        assert words in " ".join(header.replace(" *", "").split()), words
    status, told, _ = call(*given)
    assert status == 0
    assert "m: Kp" not in (tmp_path / "drive.h").read_text()
    assert call(*given, "--real", "float")[0] == 0
    assert "float, which changes the torque" in (tmp_path / "drive.h").read_text()
    for bad, option in (
        (given[:4], "--limit"), (("--out", out, *given[4:]), "--period"),
        ((*given, "--real", "half"), "--real"),
        (("--structure", "z-torque", "--real", "float", *given[:2], "--period", "5 ms", *given[4:]),
         "--real"),
        (("--period", "10 ms"), "--period"),
        ((*given, "--fmi", "2.0"), "--fmi"), ((*given, "--smooth", "5"), "--smooth"),
        (("--structure", "z-torque", "--out", out, "--period", "20 ms", *given[4:]), "--period"),
        (("--out", str(tmp_path / "Enable.st"), *given[2:]), "--out"),
    ):  # fmt: skip
        status, told, err = call(*bad)
        assert (status, told) == (2, ""), bad
        assert f"drillctrl: {option} = " in err, (bad, err)


def test_a_memory_that_was_not_seen_to_fade_bounds_no_float(laws, monkeypatch):
    assert np.isfinite(drive_float_difference(laws["observer-1"]).torque)
    monkeypatch.setattr("drillctrl.tables.drive_arithmetic._MOST", 20)
    assert np.isinf(drive_float_difference(laws["observer-1"]).torque)
    with pytest.raises(InputError, match="double"):
        float_words(laws["observer-1"])
