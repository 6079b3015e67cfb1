import numpy as np
import pytest

from drillctrl import (
    InputError,
    OperatingPoint,
    close_loop,
    plant_system,
    preset_structure,
    spectral_abscissa,
    spectral_abscissas,
)


@pytest.mark.parametrize("name", [None, "p", "case1", "pd", "case2"])
def test_batch_equals_one_by_one(point_c, name):
    rng, count = np.random.default_rng(1), 150
    varied = {
        "omega0": rng.uniform(0.3, 25, count),
        "delta0": rng.uniform(0, 15, count),
        "psi": rng.uniform(0.1, 26, count),
    }
    structure = preset_structure(name) if name else None
    gains = None
    if structure:
        gains = rng.uniform(structure.lower, structure.upper, (count, structure.lower.size))
    batch = spectral_abscissas(point_c, varied, structure, gains)
    for i in range(count):
        loop = plant_system(
            point_c.with_changes(**{key: float(value[i]) for key, value in varied.items()})
        )
        if structure:
            loop = close_loop(loop, structure, *structure.gains(gains[i]))
        assert batch[i] == pytest.approx(spectral_abscissa(loop), abs=1e-11)


def test_a_controller_may_keep_its_delay_while_the_plants_moves(point_c):
    structure = preset_structure("case2")
    gains, speeds = np.array([-9.0, 3.2, 9.5, -1.0]), np.linspace(1.0, 25.0, 60)
    batch = spectral_abscissas(
        point_c, {"omega0": speeds}, structure, gains, feedback_delay=point_c.delay
    )
    for speed, found in zip(speeds, batch, strict=True):
        plant = plant_system(point_c.with_changes(omega0=float(speed)))
        loop = close_loop(plant, structure, *structure.gains(gains), delay=point_c.delay)
        assert found == pytest.approx(spectral_abscissa(loop), abs=1e-10)


def test_the_number_of_threads_does_not_show(point_c):
    varied = {"delta0": np.linspace(0.1, 12, 2000)}
    one, two = (spectral_abscissas(point_c, varied, workers=w) for w in (1, 2))
    assert one.tobytes() == two.tobytes()


def test_multiple_roots_in_a_batch(point_c):
    structure = preset_structure("case1")
    gains = [[-9.525113872283, 9.2200137104], [-5.17, 5.06]]
    alpha = spectral_abscissas(point_c, structure=structure, gains=gains)
    assert alpha == pytest.approx([-0.81192, -0.465196], abs=1e-4)


def test_wrong_input_is_refused(point_c):
    structure = preset_structure("case1")
    with pytest.raises(InputError, match="speed"):
        spectral_abscissas(point_c, {"speed": [1.0]})
    with pytest.raises(InputError, match="omega0 = 0.0"):
        spectral_abscissas(point_c, {"omega0": [1.0, 0.0]})
    with pytest.raises(InputError, match="omega0 = nan"):
        spectral_abscissas(point_c, {"omega0": [1.0, np.nan]})
    with pytest.raises(InputError, match="one length"):
        spectral_abscissas(point_c, {"omega0": [1.0, 2.0], "psi": [1.0, 2.0, 3.0]})
    with pytest.raises(InputError, match="gains"):
        spectral_abscissas(point_c, structure=structure, gains=[[1.0, 2.0, 3.0]])
    with pytest.raises(InputError, match="psi"):
        OperatingPoint(1.0, 1.0, -1.0)
