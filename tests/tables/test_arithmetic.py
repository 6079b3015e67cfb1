"""What the C source costs, how float differs from double, and what its checkers say."""

import ctypes
import re
import subprocess

import numpy as np
import pytest

from drillctrl.tables.export_c import export_c
from drillctrl.tables.interpolation import INTERPOLATED

from .exported import FLAGS, InC, compiled, hostile

COUNTING = """
#include <cmath>
extern "C" { long operations, divisions, comparisons; }
struct Real {
    double v;
    Real() = default;
    Real(double x) : v(x) {}
    explicit operator int() const { return (int)v; }
};
static Real operator+(Real a, Real b) { operations++; return a.v + b.v; }
static Real operator-(Real a, Real b) { operations++; return a.v - b.v; }
static Real operator-(Real a) { return -a.v; }
static Real operator*(Real a, Real b) { operations++; return a.v * b.v; }
static Real operator/(Real a, Real b) { operations++; divisions++; return a.v / b.v; }
static Real &operator+=(Real &a, Real b) { return a = a + b; }
static bool operator<(Real a, Real b) { comparisons++; return a.v < b.v; }
static bool operator>(Real a, Real b) { comparisons++; return a.v > b.v; }
static bool operator<=(Real a, Real b) { comparisons++; return a.v <= b.v; }
static bool operator>=(Real a, Real b) { comparisons++; return a.v >= b.v; }
"""
DRIVER = """
extern "C" double count_step(const double *y, const double *at, double delay, int on,
                             double elapsed, double limit, double other)
{
    static drill_state state;
    static bool begun;
    Real yy[DRILL_OUTPUTS], aa[3] = {at[0], at[1], at[2]};
    for (int k = 0; k < DRILL_OUTPUTS; k++) yy[k] = y[k];
    if (!begun) { drill_init(&state); begun = true; }
    state.elapsed = elapsed; state.limit = limit; state.other = other;
    return drill_step(&state, yy, aa, delay, on).v;
}
"""


@pytest.mark.parametrize("options", [{}, {"rate_limit": 20.0, "release": 7, "watchdog": 4}])
def test_no_step_costs_more_than_the_header_says(small, on_rig, tmp_path, options, tool):
    """The same source, compiled as C++ with numbers that count what is done to them."""
    tool("g++")
    for table, limit in ((small, 3.0), (on_rig, 2000.0)):
        given = {"period": 0.01, "limit": limit, **options}
        header, source = export_c(table, tmp_path, "drill", **given)
        text = header.read_text()
        stated = [int(n) for n in re.search(
            r"at most (\d+) operations a step, (\d+) of them divisions, and\s+\*\s+(\d+) comp", text
        ).groups()]  # fmt: skip
        text = text.replace("typedef double drill_real;", f"{COUNTING}typedef Real drill_real;")
        # With linkage of C++, where templates and operators are at home.
        text = text.replace('#ifdef __cplusplus\nextern "C" {\n#endif\n', "")
        header.write_text(text.replace("#ifdef __cplusplus\n}\n#endif\n", ""))
        wrapper = tmp_path / "count.cpp"
        wrapper.write_text(f'#include "{source}"\n{DRIVER}')
        library = compiled([wrapper], tmp_path / f"count_{limit}.so", "-w", compiler="g++")
        names = ("operations", "divisions", "comparisons")
        counters = [ctypes.c_long.in_dll(library, name) for name in names]
        library.count_step.restype = ctypes.c_double
        most = [0, 0, 0]
        double = ctypes.c_double
        for y, at, delay, on, extra in hostile(table, 0.01, 3_000, seed=8):
            before = [counter.value for counter in counters]
            library.count_step(
                (double * len(y))(*y), (double * 3)(*at), double(delay), int(on),
                double(extra.get("elapsed", 0.01)), double(extra["limit"]),
                double(extra.get("other", 0.0)),
            )  # fmt: skip
            spent = [c.value - b for c, b in zip(counters, before, strict=True)]
            most = [max(a, b) for a, b in zip(most, spent, strict=True)]
        assert all(a <= b for a, b in zip(most, stated, strict=True)), (most, stated)
        assert stated[0] <= 1.1 * most[0]
        assert stated[1] == most[1]
        assert stated[2] <= 1.3 * most[2]


@pytest.mark.long
def test_float_differs_from_double_by_no_more_than_the_header_says(small, on_rig, tmp_path):
    rng = np.random.default_rng(6)
    for table, limit in ((small, 3.0), (on_rig, 2000.0)):
        options = {"period": 0.01, "limit": limit, "ramp": 0, "outside": "hold"}
        single, double = (
            InC(table, tmp_path, real=real, **options) for real in ("float", "double")
        )
        text = " ".join(single.header.replace("\n *", " ").split())
        found = re.search(
            r"at most (\S+) anywhere in the table, for magnitudes up to (.*?), and", text
        )
        stated = float(found[1])
        sizes = [float(part.split()[0]) for part in found[2].split(", ")]
        low, high = table.grid.coordinates.min(axis=0), table.grid.coordinates.max(axis=0)
        worst = 0.0
        delays = [point.delay for point in table.grid.points]
        scale = table.grid.rig.time_scale if table.grid.rig else 1.0
        for _ in range(20_000):
            at = low + (high - low) * rng.random(3)
            y = np.array(sizes) * rng.choice((-1.0, 1.0, rng.random()), len(sizes))
            delay = scale * rng.uniform(min(delays), max(delays))
            u, v = single.step(y, at, delay), double.step(y, at, delay)
            if single.vouched == double.vouched:
                worst = max(worst, abs(u - v))
        assert (table.cells.mode == INTERPOLATED).any()
        assert worst <= stated
        assert stated < 40.0 * worst


MAIN = """
#include <stdio.h>
#include "drill.h"
int main(void)
{
    static drill_state state;
    double y[DRILL_OUTPUTS], at[3], rest[5];
    drill_init(&state);
    while (fread(y, sizeof y, 1, stdin) == 1 && fread(at, sizeof at, 1, stdin) == 1
           && fread(rest, sizeof rest, 1, stdin) == 1) {
        double u;
        state.elapsed = rest[2];
        state.limit = rest[3];
        state.other = rest[4];
        u = drill_step(&state, y, at, rest[0], rest[1] > 0.0);
        if (!(u >= -LIMIT_ && u <= LIMIT_)) return 2;
    }
    return 0;
}
"""


@pytest.mark.long(but=1)
@pytest.mark.parametrize("compiler", ["gcc", "clang"])
def test_sanitizers_find_nothing_under_hostile_inputs(on_rig, tmp_path, compiler, tool):
    tool(compiler)
    _, source = export_c(on_rig, tmp_path, "drill", period=0.01, limit=2000.0, watchdog=5)
    (tmp_path / "main.c").write_text(MAIN.replace("LIMIT_", "2000.0"))
    flags = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-g", "-O1")
    call = [compiler, *FLAGS, *flags, "main.c", source.name, "-o", "drill"]
    run = subprocess.run(call, cwd=tmp_path, capture_output=True, text=True, check=False)
    if "asan" in run.stderr and "cannot find" in run.stderr:
        pytest.skip(f"no sanitizer library for {compiler}")
    assert run.returncode == 0, run.stderr
    rows = [
        [*y, *at, delay, on, given.get("elapsed", 0.01), given["limit"], given.get("other", 0.0)]
        for y, at, delay, on, given in hostile(on_rig, 0.01, 10_000, seed=9)
    ]
    data = np.array(rows, dtype=float).tobytes()
    run = subprocess.run([tmp_path / "drill"], input=data, capture_output=True, check=False)
    assert (run.returncode, run.stderr) == (0, b"")


def test_cppcheck_finds_nothing(small, on_rig, tmp_path, tool):
    tool("cppcheck")
    for table, name in ((small, "one"), (on_rig, "two")):
        for real in ("double", "float"):
            export_c(table, tmp_path, f"{name}_{real}", period=0.01, limit=3.0, real=real,
                     rate_limit=3.0, release=4, watchdog=9)  # fmt: skip
    quiet = ("--suppress=missingIncludeSystem", "--suppress=unusedFunction")
    files = [str(path) for path in tmp_path.glob("*.c")]
    call = ["cppcheck", "-q", "--enable=all", "--inconclusive", "--std=c99", *quiet]
    run = subprocess.run(
        [*call, "--error-exitcode=1", *files], capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr
