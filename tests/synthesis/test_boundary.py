import numpy as np
import pytest

from drillctrl import OperatingPoint, design, plant_system, preset_structure, report
from drillctrl.synthesis.boundary import decide
from drillctrl.synthesis.family import loop_family
from drillctrl.synthesis.search import global_search


def points():
    rng = np.random.default_rng(11)
    for damping in (0.02, 0.05, 0.02, 0.05):
        low, high = (3.0, 0.2, 2.0), (25.0, 13.0, 26.0)
        yield OperatingPoint(*rng.uniform(low, high), xi=damping, kappa=damping)


@pytest.mark.long(but=1)
@pytest.mark.parametrize("name", ["p", "case1", "pd"])
def test_the_explicit_boundary_confirms_the_optimum(name):
    for point in points():
        family = loop_family(plant_system(point), preset_structure(name))
        best = global_search(family).best.value
        assert decide(family, 0.0).possible == (best < 0.0)
        assert not decide(family, best - 1e-2).possible
        assert decide(family, best + 1e-2).possible


def test_the_boundary_agrees_with_a_grid_of_gains():
    point = OperatingPoint(6.0, 9.0, 14.0)
    family = loop_family(plant_system(point), preset_structure("case1"))
    axis = np.linspace(-10.0, 10.0, 81)
    grid = np.array(np.meshgrid(axis, axis)).reshape(2, -1).T
    lowest = family.abscissas(grid).min()
    assert decide(family, lowest + 1e-3).possible
    assert not decide(family, global_search(family).best.value - 1e-2).possible


def test_impossible_is_said():
    result = design(OperatingPoint(10.0, 12.0, 14.0), "p", trials=False)
    told = report(result)
    assert told.boundary is not None
    assert not told.boundary.possible
    assert told.boundary.next_root > 0.0
    assert "no gains within the bounds stabilise" in told.summary()


def test_more_gains_are_not_decided(point_c):
    family = loop_family(plant_system(point_c), preset_structure("case2"))
    assert decide(family) is None
