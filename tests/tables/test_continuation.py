import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drillctrl import OperatingPoint, as_case, design, dimensionless_grid, linear_axis
from drillctrl.drilling.structures import preset_structure
from drillctrl.tables.continuation import design_grid, excess
from drillctrl.tables.node import NodeDesign, NodeTask, design_node

GRID = dimensionless_grid(linear_axis("omega0", 8, 14, 5), linear_axis("delta0", 1, 6, 5), 14.0)


def test_a_node_that_stands_out_is_searched_over_the_whole_box_and_once():
    asked = []

    def run(work, tasks):
        for task in tasks:
            asked.append((task.index, len(task.known)))
            # From its neighbours, node 8 ends in a worse basin.
            stuck = task.index == 8 and task.known
            yield NodeDesign(task.index, np.ones(2), -0.5 if stuck else -1.0, 0.0, ())

    found = design_grid(GRID, preset_structure("case1"), 0, run)
    assert [node.spectral_abscissa for node in found] == [-1.0] * 25
    assert asked.count((8, 0)) == 1
    coarse = [(5 * i + j, 0) for i in (0, 2, 4) for j in (0, 2, 4)]
    assert sorted(task for task in asked if not task[1]) == sorted([*coarse, (8, 0)])


def test_a_node_with_other_gains_that_stands_out_a_little_is_begun_at_its_neighbours():
    asked = []

    def run(work, tasks):
        for task in tasks:
            # The first time, node 12 ends a little too high, in a basin of its own.
            first = task.index == 12 and 12 not in asked
            asked.append(task.index)
            gains = np.full(2, 5.0 if first else 1.0)
            yield NodeDesign(task.index, gains, -0.995 if first else -1.0, 0.0, ())

    found = design_grid(GRID, preset_structure("case1"), 0, run)
    assert [node.spectral_abscissa for node in found] == [-1.0] * 25
    # The other way round its gains are tried beside it, in vain.
    assert sorted(set(asked)) == list(range(25))
    assert asked.count(12) == 2


@pytest.mark.long
def test_a_descent_leaves_the_bounds_that_its_neighbours_gains_lie_on():
    # A neighbour's best p1 lies on its bound, the best one here does not.
    point = OperatingPoint(6.0, 61 / 7, 14.0)
    beside = design(OperatingPoint(6.0, 99 / 14, 14.0), "case2", trials=False)
    structure = preset_structure("case2")
    known = structure.vector(beside.K1, beside.K2)
    assert known.min() == structure.lower.min()
    found = design_node(NodeTask(0, as_case(point), structure, 0, (known,)))
    # No worse than a design from scratch: a neighbour's gains may lead to a better end.
    assert found.spectral_abscissa < 0.999 * design(point, "case2", trials=False).spectral_abscissa


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(0.01, 2))
def test_excess_is_zero_on_a_plane_and_what_a_node_has_too_much(a, b, height):
    x, y = np.meshgrid(np.arange(5.0), np.arange(4.0), indexing="ij")
    plane = a * x + b * y
    assert excess(plane) == pytest.approx(np.zeros((5, 4)), abs=1e-12)
    plane[2, 2] += height
    assert excess(plane)[2, 2] == pytest.approx(height)
    assert np.argmax(excess(plane)) == np.ravel_multi_index((2, 2), plane.shape)
    corner = a * x + b * y
    corner[0, 0] += height
    assert excess(corner)[0, 0] == pytest.approx(height / 2)


def test_excess_needs_three_nodes():
    assert (excess(np.array([[1.0, 5.0]])) == -np.inf).all()
