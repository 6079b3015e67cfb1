"""Points are dense where what is found changes, and nothing is lost between."""

from __future__ import annotations

import numpy as np
import pytest

from drillctrl.studies.lattice import explore, fill, fine_shape


@pytest.mark.parametrize("refine", [0, 1, 3])
def test_a_circle_is_found_with_few_points(refine):
    counts = (15, 12)
    shape = fine_shape(counts, refine)
    asked = []

    def inside(node):
        x, y = node[0] / (shape[0] - 1), node[1] / (shape[1] - 1)
        return "in" if (x - 0.5) ** 2 + (y - 0.5) ** 2 < 0.09 else "out"

    def find(nodes):
        asked.extend(nodes)
        return {node: inside(node) for node in nodes}

    cells = explore(counts, refine, find)
    assert len(asked) == len(set(asked))
    assert sum(cell.step**2 for cell in cells) == (shape[0] - 1) * (shape[1] - 1)
    for cell in cells:
        words = {inside(node) for node in cell.corners}
        assert len(words) == 1 or cell.step == 1
    if refine == 3:
        assert len(asked) < 0.25 * shape[0] * shape[1]
    known = {node: float(inside(node) == "in") for node in asked}
    whole = fill(shape, cells, list(known), np.array(list(known.values())))
    everywhere = [[inside((i, j)) == "in" for j in range(shape[1])] for i in range(shape[0])]
    # The circle is larger than the first spacing, so that no part of it is missed.
    np.testing.assert_array_equal(whole, np.array(everywhere, dtype=float))


def test_a_plane_is_filled_exactly_and_a_hole_spreads():
    cells = explore((3, 3), 2, lambda nodes: {node: str(node == (0, 0)) for node in nodes})
    nodes = sorted({node for cell in cells for node in cell.corners})
    values = np.array([2.0 * i - 3.0 * j + 0.5 * i * j for i, j in nodes])
    i, j = np.meshgrid(np.arange(9), np.arange(9), indexing="ij")
    np.testing.assert_allclose(fill((9, 9), cells, nodes, values), 2.0 * i - 3.0 * j + 0.5 * i * j)
    values[nodes.index((8, 8))] = np.nan
    holed = fill((9, 9), cells, nodes, values)
    assert np.isnan(holed[5:, 5:]).all()
    assert np.isfinite(holed[:4, :4]).all()
