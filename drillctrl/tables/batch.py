"""Loops of a table at many places of its grid at once."""

from __future__ import annotations

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.designs.loops import spectral_abscissas
from drillctrl.tables.grid import Grid


def abscissas_at(
    grid: Grid, structure: FeedbackStructure, coordinates: FloatArray, gains: FloatArray
) -> FloatArray:
    """Return α at places of a grid with gain vectors, (q, 3) and (q, k) → (q,)."""
    groups = grid.groups(coordinates)
    if not grid.restrings:
        first = grid.case(*(axis.values[0] for axis in grid.axes))
        parameters = dict(zip(grid.names, groups.T, strict=True))
        return spectral_abscissas(first, parameters, structure, gains)
    found = np.empty(len(groups))
    for value in np.unique(groups[:, 2]).tolist():
        rows = groups[:, 2] == value
        case = grid.case(*coordinates[rows][0].tolist())
        parameters = dict(zip(grid.names[:2], groups[rows, :2].T, strict=True))
        found[rows] = spectral_abscissas(case, parameters, structure, gains[rows])
    return found
