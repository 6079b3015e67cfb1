import itertools
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import differential_evolution

from drillctrl import OperatingPoint, design, dominant_roots, plant_system, preset_structure
from drillctrl.designs.loops import spectral_abscissas
from drillctrl.synthesis.active import sharpen
from drillctrl.synthesis.boxes import nested_boxes
from drillctrl.synthesis.certificate import shortest_combination
from drillctrl.synthesis.explicit import explicit_candidates
from drillctrl.synthesis.family import ActiveRoot, loop_family
from drillctrl.synthesis.rounding import exact_determinant
from drillctrl.synthesis.search import Effort, global_search


def family(name, *groups, damping=0.02):
    point = OperatingPoint(*groups, xi=damping, kappa=damping)
    return loop_family(plant_system(point), preset_structure(name))


@pytest.mark.parametrize(
    ("name", "groups", "damping"),
    [
        ("p", (10.0, 12.0, 14.0), 0.02),
        ("case1", (10.0, 12.0, 14.0), 0.02),
        ("case1", (20.0, 3.0, 8.0), 0.05),
        ("case1", (4.2, 5.1, 11.8), 0.02),
    ],
)
def test_no_worse_than_differential_evolution(name, groups, damping):
    loops = family(name, *groups, damping=damping)
    found = global_search(loops).best.value
    bounds = list(zip(loops.feedback.lower, loops.feedback.upper, strict=True))
    oracle = differential_evolution(
        lambda g: loops.abscissa(g)[0], bounds, rng=1, popsize=12, maxiter=60, polish=False
    )
    assert found <= oracle.fun + 1e-5


@pytest.mark.long(but=1)
@pytest.mark.parametrize("groups", [(18.37, 5.94, 21.17), (8.16, 5.77, 25.38), (15.24, 3.27, 19.8)])
def test_more_search_finds_nothing_lower_in_case2(groups):
    """Narrow basins of quadruple roots, which sampling alone misses."""
    loops = family("case2", *groups)
    found = global_search(loops).best
    more = global_search(loops, seed=7, effort=Effort(512, 40, 120, 12, 4)).best
    assert found.value <= more.value + 1e-6


def test_published_optima_at_point_f():
    point = OperatingPoint(10.0, 12.0, 14.0)
    case1 = design(point, "case1", trials=False)
    assert case1.spectral_abscissa == pytest.approx(-0.3698, abs=5e-5)
    assert [case1.K1[0, 0], case1.K2[0, 0]] == pytest.approx([-2.0088, 0.4538], abs=5e-4)
    assert design(point, "case2", trials=False).spectral_abscissa <= -2.244


@pytest.mark.parametrize(("name", "multiplicity"), [("case1", 3), ("case2", 4)])
def test_sharpening_reaches_the_multiple_root_from_afar(name, multiplicity, plant_c):
    loops = loop_family(plant_c, preset_structure(name))
    start = np.array([-9.4, 9.0] if name == "case1" else [-9.4, 3.78, 9.6, -2.7])
    sharp = sharpen(loops, start, loops.abscissa(start)[0], (ActiveRoot(0.0, multiplicity),))
    root = dominant_roots(loops.loop(sharp.gains))[0]
    assert root.multiplicity == multiplicity
    assert root.real == pytest.approx(sharp.abscissa, abs=1e-9)


def test_the_printed_gains_hold_a_quadruple_root_closely(point_c):
    """In 50 digits: the split of the root at the doubles that are printed."""
    from decimal import Decimal, localcontext

    result = design(point_c, "case2", trials=False)
    loop = result.system()
    with localcontext() as context:
        context.prec = 50
        t, h = Decimal(result.spectral_abscissa), Decimal("0.01")
        centre = exact_determinant(loop, t)
        # Near a quadruple root det Δ is c4 (s − t)^4: its size a known distance off gives c4.
        c4 = (exact_determinant(loop, t + h) + exact_determinant(loop, t - h)) / 2 / h**4
        assert abs(centre / c4) < Decimal("1e-4") ** 4


def test_exact_determinant_is_the_determinant(plant_c):
    from decimal import Decimal

    from drillctrl.spectrum import characteristic

    for t in (-1.3, 0.2):
        plain = np.linalg.det(characteristic.matrix(plant_c, t)).real
        assert float(exact_determinant(plant_c, Decimal(t))) == pytest.approx(plain, rel=1e-11)


def test_explicit_candidates_lie_in_the_box_and_make_roots_coincide(plant_c):
    loops = loop_family(plant_c, preset_structure("case1"))
    gains = explicit_candidates(loops, -4.0, 4.0, 3)
    assert len(gains) >= 3
    assert (gains >= loops.feedback.lower).all()
    assert (gains <= loops.feedback.upper).all()
    assert min(loops.abscissa(g)[0] for g in gains) < -0.6


def test_shortest_combination_of_gradients():
    opposite = np.array([[1.0, 0.5], [-2.0, 0.5]])
    assert shortest_combination(opposite, []) == pytest.approx(0.5)
    assert shortest_combination(opposite, [np.array([0.0, -1.0])]) == pytest.approx(0.0, abs=1e-9)
    assert shortest_combination(np.array([[0.0, 2.0]]), []) == pytest.approx(2.0)


def test_certificate_tells_an_optimum_from_another_point(point_c):
    result = design(point_c, "p", trials=False)
    assert result.optimality.stationarity < 1e-6
    loops = loop_family(plant_system(point_c), preset_structure("p"))
    gradients, _ = loops.active_gradients(np.array([-1.0]))
    assert shortest_combination(gradients, []) > 1e-3


def test_wider_bounds_never_give_worse_gains(point_c):
    plant, structure = plant_system(point_c), preset_structure("p")
    scan = -np.geomspace(1.0, 1e4, 600)
    lowest = spectral_abscissas(plant, structure=structure, gains=scan[:, None]).min()
    before = np.inf
    for bound in (10.0, 1e3, 1e4, 1e6):
        result = design(point_c, "p", bounds={"K1": (-bound, bound)}, trials=False)
        assert result.spectral_abscissa <= before + 1e-9
        before = result.spectral_abscissa
    assert lowest - 1e-3 < before <= lowest
    assert before == pytest.approx(-0.169953919, abs=1e-8)


def test_wide_bounds_keep_the_optimum_of_narrow_ones(point_c):
    narrow = design(point_c, "pd", trials=False)
    wide = design(point_c, "pd", bounds={"K1": (-300.0, 300.0)}, trials=False)
    assert wide.spectral_abscissa == pytest.approx(narrow.spectral_abscissa, abs=1e-9)
    assert pytest.approx(narrow.K1, rel=1e-6) == wide.K1
    assert wide.optimality.stationarity < 1e-6


def test_what_bounds_are_wide_does_not_depend_on_units(plant_c):
    """The same plant with its torque in units of 10 000."""
    other = replace(plant_c, B=1e4 * plant_c.B)
    for name, bound, alpha in (("p", 1.0, -0.169953919), ("pd", 0.03, -0.783302734)):
        found = design(other, name, bounds={"K1": (-bound, bound)}, trials=False)
        assert found.spectral_abscissa == pytest.approx(alpha, abs=1e-8)


def test_boxes_widen_to_the_bounds(plant_c):
    structure = preset_structure("pd").with_bounds({"K1": (-1e4, 1e3), "K1_2": (200.0, 1e4)})
    boxes = nested_boxes(plant_c, structure)
    assert len(boxes) > 2
    assert boxes[-1] is structure
    for inner, outer in itertools.pairwise(boxes):
        assert (inner.lower >= outer.lower).all()
        assert (inner.upper <= outer.upper).all()
        assert (inner.lower < inner.upper).all()
    assert len(nested_boxes(plant_c, preset_structure("case2"))) == 1
    # As narrow inside as within any bounds.
    widest = nested_boxes(plant_c, preset_structure("p").with_bounds({"K1": (-1e12, 1e12)}))
    wide = nested_boxes(plant_c, preset_structure("p").with_bounds({"K1": (-1e4, 1e4)}))
    assert widest[0].lower == pytest.approx(wide[0].lower, rel=1e-6)
