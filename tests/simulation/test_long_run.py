import numpy as np
import pytest

from drillctrl import (
    Controller,
    InputError,
    OperatingPoint,
    band_energy,
    close_loop,
    limit_cycle,
    plant_system,
    preset_structure,
    separation,
    simulate,
    spectral_abscissa,
    table1,
)

ORBIT = OperatingPoint(10.0, 2.5, 14.0)
KICK = {"dx": 1.0, "dtheta": 1.0}


def test_the_stick_slip_orbit_closes_and_attracts():
    found = limit_cycle(simulate(ORBIT, duration=300.0, initial=KICK, rtol=1e-10))
    other = limit_cycle(
        simulate(ORBIT, duration=300.0, initial={"dtheta": 4.0, "x": 2.0}, rtol=1e-10)
    )
    assert found.period == pytest.approx(7.785330, abs=1e-6)
    assert found.spread < 1e-9
    # The multiplier belongs to the orbit, not to the way there.
    assert 0.05 < found.multiplier < 0.3
    assert other.multiplier == pytest.approx(found.multiplier, rel=0.05)


def test_no_limit_cycle_where_the_motion_grows_or_is_too_short():
    assert limit_cycle(simulate(ORBIT, duration=30.0, initial={"dtheta": 0.1})) is None
    assert limit_cycle(simulate(ORBIT, duration=10.0, initial=KICK)) is None


def test_neighbours_of_the_orbit_stay_apart_by_a_phase():
    """The paper's maximum Lyapunov exponent of 0."""
    found = separation(ORBIT, initial=KICK, duration=300.0)
    assert abs(found.exponent) < 5e-3
    assert abs(found.exponent) < 4 * found.scatter + 1e-3


@pytest.mark.parametrize(("omega0", "delta0"), [(10.0, 1.0), (14.0, 0.5)])
def test_neighbours_of_rest_come_together_with_the_abscissa(omega0, delta0):
    point = OperatingPoint(omega0, delta0, 14.0)
    found = separation(point, initial={"dtheta": 1e-3}, size=1e-4, duration=500.0)
    alpha = spectral_abscissa(plant_system(point))
    assert found.exponent == pytest.approx(alpha, rel=0.02)


def test_neighbours_of_a_controlled_rest_too():
    gains = [-1.0], [0.3]
    point = OperatingPoint(10.0, 1.75, 14.0)
    loop = close_loop(plant_system(point), preset_structure("case1"), *gains)
    found = separation(
        point, Controller("case1", *gains), initial={"dtheta": 1e-2}, size=1e-3, duration=60.0
    )
    assert found.exponent == pytest.approx(spectral_abscissa(loop), rel=0.05)
    with pytest.raises(InputError, match="size"):
        separation(point, size=1.0)


def test_band_energy_of_the_orbit():
    """0.365 Hz and its harmonics: nearly all of ½ I ⟨θ'²⟩ and ½ M ⟨x'²⟩ lies in the band."""
    rig = table1()
    run = simulate(ORBIT, duration=400.0, initial=KICK)
    found = band_energy(run, rig)
    motion = run.at(np.linspace(400.0 - 10 * 7.78533, 400.0, 40001))
    rates = motion.dtheta / rig.time_scale, motion.dx * rig.axial_scale / rig.time_scale
    torsional, axial = (
        0.5 * mass * float(np.var(rate))
        for mass, rate in zip((rig.inertia, rig.mass), rates, strict=True)
    )
    assert found.torsional == pytest.approx(torsional, rel=0.02)
    assert found.axial == pytest.approx(axial, rel=0.05)
    assert band_energy(run, rig, 0.1, 0.3).torsional < 1e-2 * torsional
    with pytest.raises(InputError, match="low"):
        band_energy(run, rig, 1e-6, 1.0)
    with pytest.raises(InputError, match="low, high"):
        band_energy(run, rig, 5.0, 1.0)


def test_energy_of_bands_adds_up():
    rig = table1()
    run = simulate(ORBIT, duration=200.0, initial=KICK)
    parts = [band_energy(run, rig, a, b) for a, b in ((0.1, 1.0), (1.0000001, 10.0))]
    whole = band_energy(run, rig)
    assert whole.total == pytest.approx(sum(part.total for part in parts), rel=1e-6)
    assert whole.axial > 0
