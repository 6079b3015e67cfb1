"""A million samples through exported controllers, compiled, against the law in Python.

Tables of gains at random (interpolated, constant and unsafe cells, three and four axes), and laws
of a top drive of every kind, the last of them as a unit in fmpy too. One sample in a hundred is
broken. Run as ``python -m benchmarks.controllers [COUNT]``; a C compiler has to be there.
"""

from __future__ import annotations

import ctypes
import math
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from drillctrl import (
    SteppedDrive,
    dimensionless_grid,
    drive_control,
    export_drive,
    linear_axis,
    pi_control,
    preset_structure,
    sampled_drive,
    string_preset,
)
from drillctrl.tables.export_c import export_c
from drillctrl.tables.gain_table import GainTable
from drillctrl.tables.interpolation import Cells, cell_shape
from drillctrl.tables.sampled import sampled_controller
from drillctrl.tables.stepped import SteppedController

_PERIOD = 0.01
_LOOP = """
#include "run.h"
void all(long count, const double *y, const double *at, const double *delay, const int *on,
         double *u, int *status)
{
    static run_state state;
    long i;
    run_init(&state);
    for (i = 0; i < count; i++) {
        u[i] = run_step(&state, STEP);
        status[i] = state.status;
    }
}
"""


def random_table(sizes, name, rng):
    """Return a table whose gains mean nothing."""
    ends = (("omega0", 8, 14), ("delta0", 1, 6), ("psi", 10, 20), ("kappa", 0.01, 0.06))
    axes = [
        linear_axis(n, a, b if k > 1 else a, k) for (n, a, b), k in zip(ends, sizes, strict=False)
    ]
    grid = dimensionless_grid(*axes[:3], further=axes[3:])
    structure = preset_structure(name)
    nodes, cells, entries = math.prod(sizes), math.prod(cell_shape(grid)), structure.lower.size
    mode = rng.integers(0, 3, cells)
    constant = np.where((mode == 1)[:, None], rng.uniform(-5, 5, (cells, entries)), 0.0)
    sound, alpha = np.ones(nodes, dtype=bool), -np.ones(nodes)
    return GainTable(
        grid, structure, rng.uniform(-5, 5, (nodes, entries)), alpha, np.zeros(nodes), sound,
        sound, alpha, 0.0, "off", 0, Cells(mode, -np.ones(cells), constant),
    )  # fmt: skip


def in_c(folder, step, y, at, delay, on):
    """Run the exported source over all samples."""
    (folder / "loop.c").write_text(_LOOP.replace("STEP", step))
    library = folder / f"{time.monotonic_ns()}.so"
    flags = ["-O2", "-std=c99", "-ffp-contract=off", "-shared", "-fPIC"]
    subprocess.run(["cc", *flags, "-o", library, "loop.c", "run.c"], cwd=folder, check=True)
    u, status = np.zeros(len(on)), np.zeros(len(on), dtype=np.int32)
    arrays = [np.ascontiguousarray(a) for a in (y, at, delay, on.astype(np.int32), u, status)]
    began = time.perf_counter()
    ctypes.CDLL(str(library)).all(len(on), *(a.ctypes.data_as(ctypes.c_void_p) for a in arrays))
    return arrays[4], arrays[5], time.perf_counter() - began


def drives():
    """Laws of every kind, one of them over speed, depth and rock."""
    rig = string_preset("vertical-3000")
    kinds = ("stiff", "soft-torque", "z-torque", "observer-1", "dynamic-1", "dynamic-4")
    given = {"period": 5e-3, "limit": 40e3, "rate_limit": 1e6}
    found = {kind: sampled_drive(drive_control(kind, rig), **given) for kind in kinds}
    axes = {
        "rotary_speed": (6.0, 9.0, 15.0),
        "depth": (2000.0, 3000.0),
        "rock_strength": (4e7, 9e7),
    }
    laws = [pi_control(rig.drive, 1e3 + 50.0 * i, 500.0 + 20.0 * i) for i in range(12)]
    return {**found, "PI over speed, depth and rock": sampled_drive(laws, axes=axes, **given)}


def in_fmpy(folder, law, y, on):
    """Run the unit in fmpy, step by step."""
    import fmpy
    from fmpy.fmi3 import FMU3Slave

    path = export_drive(law, folder / "unit.fmu")
    description = fmpy.read_model_description(path)
    place = {v.name: v.valueReference for v in description.modelVariables}
    unit = FMU3Slave(
        guid=description.guid, unzipDirectory=fmpy.extract(path, folder / "unit"),
        modelIdentifier=description.coSimulation.modelIdentifier, instanceName="unit",
    )  # fmt: skip
    unit.instantiate()
    unit.enterInitializationMode()
    unit.exitInitializationMode()
    inputs = [place[n] for n in ("speed", "set_point", "torque", *(name for name, _ in law.axes))]
    u, status = np.zeros(len(on)), np.zeros(len(on), dtype=np.int32)
    began = time.perf_counter()
    for i, row in enumerate(y.tolist()):
        unit.setFloat64(inputs, row)
        unit.setBoolean([place["enable"]], [bool(on[i])])
        unit.doStep(i * law.period, law.period)
        u[i], status[i] = unit.getFloat64([place["u"]])[0], unit.getInt32([place["status"]])[0]
    seconds = time.perf_counter() - began
    unit.terminate()
    unit.freeInstance()
    return u, status, seconds


def told(name, found, expected, states):
    u, status, seconds = found
    apart = np.abs(u - np.array(expected)).max()
    other = int(np.count_nonzero(status != np.array(states)))
    print(f"{name:<34}{apart:12.1e}{other:8d}{seconds / len(u) * 1e9:10.0f} ns a sample")


def main() -> None:
    """Run all of them."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 1_000_000
    rng = np.random.default_rng(0)
    print(f"{count} samples              largest difference  states")
    on = (np.arange(count) % 5000) > 100
    broken = rng.random(count) < 0.01
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for sizes, structure in (((3, 4, 2), "case2"), ((5, 1, 1), "p"), ((2, 3, 2, 3), "case1")):
            table = random_table(sizes, structure, rng)
            outputs = len(table.structure.outputs)
            y = np.cumsum(rng.normal(size=(count, outputs)), axis=0) % 2.0 - 1.0
            y[broken] = rng.choice([np.nan, np.inf, -1e300], (int(broken.sum()), outputs))
            low, high = (table.grid.coordinates.min(axis=0), table.grid.coordinates.max(axis=0))
            sway = np.sin(np.outer(np.arange(count), 1e-3 * np.arange(1, 1 + len(sizes))))
            at = (low + high) / 2 + 0.55 * (high - low) * sway
            delay = rng.uniform(0.05, 0.2, count)
            options = {"period": _PERIOD, "limit": 3.0}
            export_c(table, folder, "run", **options)
            step = f"y + {outputs} * i, at + {len(sizes)} * i, delay[i], on[i]"
            found = in_c(folder, step, y, at, delay, on)
            steps = SteppedController(
                sampled_controller(table, "run", *options.values(), {}), outputs
            )
            expected, states = [], []
            for row in zip(y.tolist(), at.tolist(), delay.tolist(), on.tolist(), strict=True):
                expected.append(steps.step(*row))
                states.append(steps.status)
            told(f"{structure}, {' x '.join(map(str, sizes))} nodes", found, expected, states)
        for name, sampled in drives().items():
            speed = 12.0 + 3.0 * np.sin(0.01 * np.arange(count)) + 0.01 * rng.normal(size=count)
            speed[broken] = np.nan
            low, high = (np.array([v[end] for _, v in sampled.axes]) for end in (0, -1))
            sway = np.sin(np.outer(np.arange(count), 1e-3 * np.arange(1, 1 + low.size)))
            at = (low + high) / 2 + 0.55 * (high - low) * sway
            y = np.column_stack([speed, np.full(count, 12.0), np.full(count, 5e3), at])
            export_drive(sampled, folder / "run.c")
            inputs = ", ".join(f"y[({y.shape[1]} * i) + {k}]" for k in range(y.shape[1]))
            found = in_c(folder, f"{inputs}, on[i]", y, y, at[:, 0], on)
            steps = SteppedDrive(sampled)
            expected, states = [], []
            for row, switch in zip(y.tolist(), on.tolist(), strict=True):
                expected.append(steps.step(*row[:3], row[3:], switch))
                states.append(steps.status)
            told(name, found, expected, states)
        told("the last one as a unit in fmpy", in_fmpy(folder, sampled, y, on), expected, states)


if __name__ == "__main__":
    main()
