import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drillctrl import (
    DelaySystem,
    InputError,
    OperatingPoint,
    close_loop,
    dominant_roots,
    plant_system,
    preset_structure,
    semidiscretize,
    spectral_abscissa,
)

from ..strategies import loops


def test_published_spectral_radius_at_point_c(plant_c):
    loop = close_loop(plant_c, preset_structure("case1"), [-5.17], [5.06])
    scheme = semidiscretize(loop, m=3, order=0)
    assert scheme.spectral_radius == pytest.approx(0.97933, abs=5e-6)
    assert scheme.step == pytest.approx(plant_c.delays[0] / 3.5)


def published_map(point, m):
    """Eqs. 27-31 as printed: the state keeps x and θ of the past, the inverse of A1."""
    system = plant_system(point)
    step = point.delay / (m + 0.5)
    from scipy.linalg import expm

    p = expm(system.A0 * step)
    r = (p - np.eye(4)) @ np.linalg.inv(system.A0) @ system.delayed[0]
    d = np.zeros((2 * m + 4, 2 * m + 4))
    d[:4, :4] = p
    d[:4, -2:] = r[:, [0, 2]]
    d[4, 0] = d[5, 2] = 1.0
    for i in range(6, 2 * m + 4):
        d[i, i - 2] = 1.0
    return d


@pytest.mark.parametrize("delta0", [0.5, 1.75, 9.0])
def test_order_zero_has_the_nonzero_spectrum_of_the_published_map(delta0):
    point = OperatingPoint(10.0, delta0, 14.0)
    for m in (2, 4, 9):
        ours = semidiscretize(plant_system(point), m=m, order=0).multipliers()
        theirs = np.linalg.eigvals(published_map(point, m))
        big = ours[np.abs(ours) > 0.05]
        for value in big:
            assert np.abs(theirs - value).min() < 1e-6
        assert (np.abs(theirs) > 0.05).sum() == big.size


def test_root_locus_of_figure_4():
    """Along ω0 a pair enters the unit circle, along δ0 a pair leaves it (m = 4)."""

    def radius(omega0, delta0):
        system = plant_system(OperatingPoint(omega0, delta0, 14.0))
        return semidiscretize(system, m=4, order=0).multipliers()

    along_speed = [radius(omega0, 1.0) for omega0 in np.linspace(3.0, 24.0, 43)]
    outside = [int((np.abs(values) > 1).sum()) for values in along_speed]
    assert outside[0] == 2
    assert 0 in outside
    first_stable = outside.index(0)
    assert all(count == 2 for count in outside[:first_stable])
    assert abs(along_speed[0][0].imag) > 0.1
    along_depth = [radius(6.0, delta0) for delta0 in np.linspace(0.5, 14.5, 57)]
    outside = [int((np.abs(values) > 1).sum()) for values in along_depth]
    assert 0 in outside
    assert outside[-1] == 2
    assert all(count <= 2 for count in outside)


@settings(max_examples=25)
@given(loops(), st.sampled_from([0, 1]))
def test_orders_0_and_1_converge_with_the_square_of_the_step(loop, order):
    root = dominant_roots(loop)[0]
    if root.multiplicity > 1 or root.condition > 1e5 or abs(root.value) * loop.max_delay > 3:
        return
    errors = []
    for m in (20, 40):
        scheme = semidiscretize(loop, m, order)
        logs = np.log(scheme.multipliers()[:4]) / scheme.step
        errors.append(
            min(np.abs(logs - root.value).min(), np.abs(logs - root.value.conjugate()).min())
        )
    if errors[0] > 1e-7:
        assert errors[1] < errors[0]
        assert np.log(errors[0] / errors[1]) / np.log(40.5 / 20.5) == pytest.approx(2.0, abs=0.3)


@pytest.mark.parametrize(("order", "rate"), [(0, 2), (1, 2), (2, 4)])
def test_measured_order_where_a0_is_singular(order, rate):
    system = plant_system(OperatingPoint(10.0, 0.25 + 14.0 / 1.6**2, 14.0))
    exact = spectral_abscissa(system)
    errors = [abs(semidiscretize(system, m, order).growth_rate - exact) for m in (5, 10)]
    assert np.log(errors[0] / errors[1]) / np.log(10.5 / 5.5) == pytest.approx(rate, abs=0.25)


def test_case2_remembers_the_rate_too(plant_c):
    gains = [-5.03, -4.91], [-1.67, -0.31]
    loop = close_loop(plant_c, preset_structure("case2"), *gains)
    scheme = semidiscretize(loop, 40, 2)
    assert scheme.signals.shape[0] == 2
    assert scheme.matrix().shape == (4 + 41 * 2, 4 + 41 * 2)
    assert scheme.growth_rate == pytest.approx(spectral_abscissa(loop), abs=1e-9)


def test_several_delays_that_are_no_multiples(plant_c):
    a0, a1 = plant_c.A0, plant_c.delayed[0]
    system = DelaySystem(a0, (0.4 * a1, 0.6 * a1), (0.1, 0.157), plant_c.B, plant_c.C)
    exact = spectral_abscissa(system)
    for order in (0, 1, 2):
        coarse, fine = (abs(semidiscretize(system, m, order).growth_rate - exact) for m in (10, 40))
        assert fine < coarse / 8
    assert fine < 1e-10


def test_slow_rotation_shows_no_false_island():
    """A small fixed m calls some of these points stable; m chosen from the delay does not."""
    false = 0
    for omega0 in (0.3, 0.5, 0.8):
        for delta0 in np.linspace(0.2, 14.0, 8):
            system = plant_system(OperatingPoint(omega0, delta0, 14.0))
            assert spectral_abscissa(system) > 0
            assert semidiscretize(system).spectral_radius > 1
            false += semidiscretize(system, 2, 0).spectral_radius < 1
    assert false > 0


@pytest.mark.parametrize(("m", "order"), [(0, 0), (2.5, 0), (10**6, 0), (10, 3), (10, -1)])
def test_bad_settings_are_refused(plant_c, m, order):
    with pytest.raises(InputError):
        semidiscretize(plant_c, m, order)
