import numpy as np
import pytest

from drillctrl import InputError, close_loop, preset_structure, semidiscretize
from drillctrl.spectrum.trust import compare_spectra, intervals_for


@pytest.fixture(scope="module")
def loop(plant_c):
    return close_loop(plant_c, preset_structure("case1"), [-5.17], [5.06])


def test_errors_shrink_with_the_square_of_the_step(loop):
    coarse, fine = (compare_spectra(loop, m, 0) for m in (20, 40))
    assert fine.errors.max() < coarse.errors.max() / 3.5
    assert abs(fine.abscissa_error) <= fine.errors.max()


def test_sparse_and_dense_spectra_agree(loop):
    scheme = semidiscretize(loop, 120, 0)
    assert np.abs(scheme.sparse_matrix().toarray() - scheme.matrix()).max() == 0.0
    dense = scheme.multipliers()
    sparse = scheme.multipliers_near(complex(dense[0]) + 1e-6j, 2)
    assert abs(sparse[0] - dense[0]) < 1e-9
    assert np.abs(dense - sparse[1]).min() < 1e-9


def test_long_maps_stay_affordable_and_exact(loop):
    """2000 intervals: a dense map would have four million entries."""
    comparison = compare_spectra(loop, 2000, 2)
    assert comparison.scheme.sparse_matrix().nnz < 12 * 2000
    assert comparison.errors[0] < 1e-8


@pytest.mark.parametrize("order", [0, 1, 2])
def test_chosen_intervals_reach_the_tolerance(loop, order):
    m = intervals_for(loop, 1e-5, order)
    assert compare_spectra(loop, m, order).errors.max() <= 1e-5
    assert m == 1 or compare_spectra(loop, m // 3 + 1, order).errors.max() > 1e-5


def test_it_misleads_at_the_optimum(plant_c):
    """With m = 40 the gains that minimise ρ(D) claim −0.8119 and have −0.7926."""
    structure = preset_structure("case1")
    triple = close_loop(plant_c, structure, [-9.525113872283], [9.220013710400])
    comparison = compare_spectra(triple, 40, 0)
    simple = compare_spectra(close_loop(plant_c, structure, [-5.17], [5.06]), 40, 0)
    assert comparison.errors.max() > 100 * simple.errors.max()


def test_impossible_tolerances_are_refused(loop):
    with pytest.raises(InputError, match="tolerance = 0.0"):
        intervals_for(loop, 0.0)
    with pytest.raises(InputError, match="tolerance = 1e-15"):
        intervals_for(loop, 1e-15, 0)
