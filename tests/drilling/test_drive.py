import numpy as np
import pytest

from drillctrl import (
    InputError,
    OperatingPoint,
    as_case,
    close_loop,
    design,
    dominant_roots,
    plant_system,
    soft_torque,
    spectral_abscissa,
    top_drive_plant,
)


def characteristic_by_hand(s, point, ratio, stiffness, damping):
    """Eq. 22 and J φ'' = θ − φ − k φ − d φ', with φ eliminated."""
    blade = point.blades * (1.0 - np.exp(-s * point.delay))
    axial = s * s + 2 * point.xi * point.eta * s + point.eta**2
    top = 1.0 / (ratio * s * s + damping * s + stiffness + 1.0)
    torsion = s * s + 2 * point.kappa * s + 1.0 - top
    return (axial + blade * point.psi) * torsion - axial * blade * point.delta0


@pytest.mark.parametrize("ratio", [0.5, 3.0])
def test_roots_solve_the_equation_by_hand(point_c, ratio):
    plant = as_case(point_c, top_drive_plant(ratio)).system(("drive",))
    loop = close_loop(plant, soft_torque(), [-1.3, -2.7])
    for root in dominant_roots(loop)[:6]:
        value = characteristic_by_hand(root.value, point_c, ratio, 1.3, 2.7)
        beside = characteristic_by_hand(root.value + 1e-3, point_c, ratio, 1.3, 2.7)
        assert abs(value) < 1e-9 * max(1.0, abs(beside) / 1e-3)


def test_a_heavy_drive_held_stiffly_is_the_imposed_speed(point_c):
    plant = as_case(point_c, top_drive_plant(1e5)).system(("drive",))
    loop = close_loop(plant, soft_torque(1e6, 1e6), [-1e6, -1e6])
    fixed = spectral_abscissa(plant_system(point_c))
    assert spectral_abscissa(loop) == pytest.approx(fixed, abs=1e-5)


def test_soft_torque_stabilises_what_an_imposed_speed_does_not(point_c):
    assert spectral_abscissa(plant_system(point_c)) > 0
    result = design(as_case(point_c, top_drive_plant(1.0)), soft_torque(), trials=False)
    assert result.stable
    # Weakly held and well damped: near the matched impedance, far from the bounds.
    assert -3.0 < result.K1[0, 0] < 0.0
    assert -5.0 < result.K1[0, 1] < -1.0


def test_it_leaves_the_regenerative_axial_mode_alone():
    point = OperatingPoint(5.1, 0.25, 14.0)
    result = design(as_case(point, top_drive_plant(1.0)), soft_torque(), trials=False)
    assert not result.stable
    assert result.spectral_abscissa == pytest.approx(
        spectral_abscissa(plant_system(point)), abs=1e-4
    )


@pytest.mark.parametrize("ratio", [0.0, -1.0, float("nan")])
def test_a_drive_without_inertia_is_refused(ratio):
    with pytest.raises(InputError, match="inertia_ratio"):
        top_drive_plant(ratio)
