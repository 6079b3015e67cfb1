"""Exports of tables of any shape, with cells of every kind."""

import math

import numpy as np
import pytest

from drillctrl import dimensionless_grid, linear_axis
from drillctrl.drilling.structures import preset_structure
from drillctrl.tables.interpolation import Cells, cell_shape
from drillctrl.tables.table import GainTable

from .exported import InC, InPython, InScl, Interpreted, Translated, hostile, matiec

RANGES = {"omega0": (8, 14), "delta0": (1, 6), "psi": (10, 20)}


def made_up(sizes, name, rng):
    """Return a table of gains at random: interpolated, constant and unsafe cells."""
    axes = [
        linear_axis(axis, low, high if size > 1 else low, size)
        for (axis, (low, high)), size in zip(RANGES.items(), sizes, strict=True)
    ]
    grid, structure = dimensionless_grid(*axes), preset_structure(name)
    nodes, cells, entries = math.prod(sizes), math.prod(cell_shape(grid)), structure.lower.size
    mode = rng.integers(0, 3, cells)
    mode[0] = 0
    constant = np.where((mode == 1)[:, None], rng.uniform(-5, 5, (cells, entries)), 0.0)
    sound, alpha = np.ones(nodes, dtype=bool), -np.ones(nodes)
    gains = rng.uniform(-5, 5, (nodes, entries))
    return GainTable(
        grid, structure, gains, alpha, np.zeros(nodes), sound, sound, alpha, 0.0, "off", 0,
        Cells(mode, -np.ones(cells), constant),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("sizes", "name"),
    [((2, 3, 4), "case2"), ((1, 1, 1), "p"), ((5, 1, 2), "pd"), ((1, 6, 1), "case1")],
)
def test_all_languages_agree_and_look_up_what_the_table_says(tmp_path, sizes, name):
    rng = np.random.default_rng(5)
    table = made_up(sizes, name, rng)
    kinds = [InC, InPython, Interpreted, InScl, *([Translated] if matiec() else [])]
    options = {"period": 0.01, "limit": 3.0, "rate_limit": 50.0, "release": 3, "hold": 1}
    runs = [kind(table, tmp_path, **options) for kind in kinds]
    for y, at, delay, on, extra in hostile(table, 0.01, 600, seed=1):
        commands = [run.step(y, at, delay, on, **extra) for run in runs]
        assert max(commands) - min(commands) < 1e-12
        assert len({(run.status, run.vouched) for run in runs}) == 1
    ends = np.array([(axis.values[0], axis.values[-1]) for axis in table.grid.axes])
    for _ in range(200):
        around = rng.uniform(0.9 * ends[:, 0], 1.1 * ends[:, 1])
        at = np.where(ends[:, 0] < ends[:, 1], around, ends[:, 0])
        gains, vouched = runs[0].lookup(at)
        K1, K2 = table.gains_at(*at)
        assert gains == pytest.approx([*K1.ravel(), *K2.ravel()], rel=1e-12, abs=1e-12)
        assert vouched == table.stable_at(*at)[0]
