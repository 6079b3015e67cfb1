"""Exported controllers, compiled and run through one door: ``step(y, at, delay, on)``."""

import ctypes
import functools
import itertools
import shutil
import subprocess
from pathlib import Path

import numpy as np

from drillctrl.tables.export_c import export_c
from drillctrl.tables.export_st import export_st
from drillctrl.tables.sampled import sampled_controller
from drillctrl.tables.stepped import SteppedController

from .iec import Block, load

FLAGS = (
    *("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion", "-Wfloat-equal"),
    *("-Wshadow", "-Wmissing-prototypes", "-ffp-contract=off"),
)

# A library of a name that was loaded already would be taken for that one.
SERIAL = itertools.count()

# Fields of the state in C.
COUNTS = ("newest", "active", "vouched", "status", "seen", "missing", "equal", "trust", "releasing")
REALS = ("start", "command", "limit", "elapsed", "other")


def compiled(sources, binary, *flags, compiler="gcc"):
    command = [compiler, *flags, "-shared", "-fPIC", "-o", str(binary), *map(str, sources)]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    return ctypes.CDLL(str(binary))


class InC:
    """The C source; the state is mirrored field by field."""

    def __init__(self, table, folder, *, real="double", compiler="gcc", flags=(), **options):
        header, source = export_c(table, folder, "drill", real=real, **options)
        self.header, self.outputs = header.read_text(), len(table.structure.outputs)
        self.axes = len(table.grid.axes)
        depth = int(self.header.split("_DEPTH ")[1].split()[0])
        self.kind = ctypes.c_double if real == "double" else ctypes.c_float
        reals, whole = self.kind, ctypes.c_int32
        counts = COUNTS
        fields = [("past", reals * (depth * self.outputs)), *((name, whole) for name in counts)]
        fields += [
            ("good_y", reals * self.outputs),
            ("good_at", reals * self.axes),
            ("good_delay", reals),
        ]
        fields += [("gains", reals * (2 * self.outputs))]
        fields += [(name, reals) for name in REALS]
        self.state = type("State", (ctypes.Structure,), {"_fields_": fields})()
        binary = Path(folder) / f"drill_{real}_{compiler}_{next(SERIAL)}.so"
        self.library = compiled([source], binary, *FLAGS, *flags, compiler=compiler)
        self.library.drill_step.restype = self.kind
        self.init()

    def init(self):
        self.library.drill_init(ctypes.byref(self.state))

    def lookup(self, at):
        gains = (self.kind * (2 * self.outputs))()
        vouched = self.library.drill_lookup((self.kind * self.axes)(*at), gains)
        return list(gains), bool(vouched)

    def step(self, y, at, delay, on=True, **given):
        for name, value in given.items():
            setattr(self.state, name, value)
        values, places = (self.kind * self.outputs)(*y), (self.kind * self.axes)(*at)
        state = ctypes.byref(self.state)
        return self.library.drill_step(state, values, places, self.kind(delay), int(on))

    @property
    def status(self):
        return self.state.status

    @property
    def vouched(self):
        return bool(self.state.vouched)


class InPython:
    """The reference."""

    def __init__(self, table, folder, *, period, limit, **options):
        controller = sampled_controller(table, "drill", period, limit, options)
        self._steps = SteppedController(controller, len(table.structure.outputs))

    def step(self, y, at, delay, on=True, **given):
        for name, value in given.items():
            setattr(self._steps, name, value)
        return self._steps.step(y, at, delay, on)

    status = property(lambda self: self._steps.status)
    vouched = property(lambda self: self._steps.vouched)


class Interpreted:
    """The function block, run by the interpreter in these tests."""

    ending = ".st"

    def __init__(self, table, folder, **options):
        path = export_st(table, Path(folder) / f"drill{self.ending}", **options)
        self.block = Block(load(path.read_text())["DRILL"])
        self.period = options["period"]

    def step(self, y, at, delay, on=True, *, elapsed=None, **given):
        names = {"limit": "TighterLimit", "other": "OtherCommand"}
        given = {names[name]: value for name, value in given.items()}
        given["ElapsedTime"] = self.period if elapsed is None else elapsed
        block = self.block(
            Measured=list(y), Place=list(at), DelayTime=delay, Enable=bool(on), **given
        )
        return block.COMMAND

    status = property(lambda self: self.block.STATUSBITS)
    vouched = property(lambda self: self.block.VOUCHED)


class InScl(Interpreted):
    ending = ".scl"


@functools.cache
def matiec():
    """Return the compiler iec2c and its library, or None."""
    found = shutil.which("iec2c")
    if found is None:
        return None
    folders = (Path(found).parent / "lib", Path(found).parent.parent / "share/matiec/lib")
    return next(((found, folder) for folder in folders if (folder / "ieclib.txt").exists()), None)


class Translated:
    """The function block, compiled by MATIEC to C and by gcc from there."""

    WRAPPER = """
        #include <string.h>
        #include "POUS.h"
        #include "POUS.c"
        TIME __CURRENT_TIME;
        BOOL __DEBUG;
        static DRILL block;
        void start(void) { memset(&block, 0, sizeof block); DRILL_init__(&block, 0); }
        double step(const double *y, const double *at, double delay, int on,
                    double limit, double elapsed, double other)
        {
            memcpy(block.MEASURED.value.table, y, sizeof block.MEASURED.value.table);
            memcpy(block.PLACE.value.table, at, sizeof block.PLACE.value.table);
            block.DELAYTIME.value = delay;
            block.ENABLE.value = (BOOL)on;
            block.TIGHTERLIMIT.value = limit;
            block.ELAPSEDTIME.value = elapsed;
            block.OTHERCOMMAND.value = other;
            DRILL_body__(&block);
            return block.COMMAND.value;
        }
        int status(void) { return block.STATUSBITS.value; }
        int vouched(void) { return block.VOUCHED.value; }
    """

    def __init__(self, table, folder, **options):
        command, library = matiec()
        path = export_st(table, Path(folder) / "drill.st", **options)
        run = subprocess.run(
            [command, "-I", library, "-T", folder, path],
            capture_output=True,
            text=True,
            check=False,
        )
        assert run.returncode == 0, run.stderr + run.stdout
        wrapper = Path(folder) / "wrapper.c"
        wrapper.write_text(self.WRAPPER)
        include = (f"-I{library / 'C'}", "-w", "-ffp-contract=off", f"-I{folder}")
        self.library = compiled([wrapper], Path(folder) / f"block_{next(SERIAL)}.so", *include)
        self.library.step.restype = ctypes.c_double
        self.library.start()
        self.limit, self.period, self.other = options["limit"], options["period"], 0.0

    def step(self, y, at, delay, on=True, *, limit=None, elapsed=None, other=None):
        self.limit = self.limit if limit is None else limit
        self.other = self.other if other is None else other
        double = ctypes.c_double
        return self.library.step(
            (double * len(y))(*y), (double * len(at))(*at), double(delay), int(on),
            double(self.limit), double(self.period if elapsed is None else elapsed),
            double(self.other),
        )  # fmt: skip

    status = property(lambda self: self.library.status())
    vouched = property(lambda self: bool(self.library.vouched()))


def hostile(table, period, count, seed=0):
    """Yield what a broken sensor, clock or operator may hand to a controller."""
    rng = np.random.default_rng(seed)
    low, high = table.grid.coordinates.min(axis=0), table.grid.coordinates.max(axis=0)
    outputs = len(table.structure.outputs)
    worst = (np.nan, np.inf, -np.inf, 1e300, -1e300, 1e15, -1e14, 1e30, 0.0, -0.0, 5e-324)
    y, at, delay, on = np.zeros(outputs), (low + high) / 2, 10.5 * period, True
    kind = 0
    for _ in range(count):
        if rng.random() < 0.05:
            kind = int(rng.integers(9))
        if kind != 3:
            y = rng.normal(size=outputs) * 10.0 ** rng.integers(-3, 3)
        at = np.clip(at + 0.1 * (high - low) * rng.normal(size=low.size), low, high)
        given, place, lag = {}, at.copy(), delay
        if kind == 1:
            y = rng.choice(worst, outputs)
        elif kind == 2:
            y = np.abs(y) * rng.choice((-1.0, 1.0))
        elif kind == 4:
            given["elapsed"] = float(rng.choice([*worst, -period, 0.0, 1.6 * period, -1e9]))
        elif kind == 5:
            place[rng.integers(low.size)] = rng.choice([*worst, *(3 * high), *(0.1 * low)])
        elif kind == 6:
            lag = float(rng.choice([*worst, -lag, 100 * lag]))
        elif kind == 7:
            on = bool(rng.integers(2))
        elif kind == 8:
            given["limit"] = float(rng.choice([*worst, 0.5, 1.0]))
            given["other"] = float(rng.choice([*worst, 0.5]))
        if kind != 8:
            given["limit"] = 1e9
        yield y.tolist(), place.tolist(), lag, on, given
