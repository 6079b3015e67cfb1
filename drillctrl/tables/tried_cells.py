"""Gains between the nodes of a table on the motion that is drilled with, tried by runs."""

from __future__ import annotations

import numpy as np

from drillctrl.delay.closing import close_loop
from drillctrl.designs.trials import Trial
from drillctrl.designs.verdict import FAILURES, try_gains
from drillctrl.spectrum.roots import spectral_abscissa
from drillctrl.tables.cells import CellTask
from drillctrl.tables.crossings import crosses
from drillctrl.tables.interpolation import (
    INTERPOLATED,
    UNSAFE,
    Cells,
    IntArray,
    interpolated,
    middles,
    place,
)


def try_cells(task: CellTask) -> tuple[IntArray, Cells]:
    """Try the interpolated gains in the middle of some cells, beside no control.

    A cell passes if the gains of all its corners are recommended, and those in its middle do no
    harm from any start of the trials and leave the bit neither stalled nor behind its feed; nor
    those that follow the point across it, see `crosses`.

    Returns
    -------
    cells : int array, (c,)
        Those of the task.
    found : Cells
        What is known of them; the abscissa is that of smooth drilling in the middle.
    """
    grid, structure = task.grid, task.structure
    at = middles(grid, task.cells)
    where = place(grid, at)
    vectors = interpolated(where, task.gains, None)
    mode, alphas = [], []
    for cell, corners, coordinates, gains in zip(
        task.cells.tolist(), where.corners, at, vectors, strict=True
    ):
        case = grid.case(*coordinates.tolist())
        K1, K2 = structure.gains(gains)
        alphas.append(
            spectral_abscissa(close_loop(case.system(structure.inputs), structure, K1, K2))
        )
        passed = bool(task.stable[corners].all())
        if passed:
            verdict = try_gains(
                case, structure, K1, K2, False,
                spare=True, standing=False, surroundings=task.surroundings,
            )  # fmt: skip
            passed = not verdict.harm and not any(map(_fails, verdict.trials))
            passed = passed and crosses(task, cell)
        mode.append(INTERPOLATED if passed else UNSAFE)
    return task.cells, Cells(np.array(mode), np.array(alphas), np.zeros_like(vectors))


def _fails(trial: Trial) -> bool:
    return trial.controlled.outcome in FAILURES
