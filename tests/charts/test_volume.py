import json
from collections import Counter

import meshio
import numpy as np
import pytest

from drillctrl import (
    InputError,
    OperatingPoint,
    chart,
    cli,
    count_right_of,
    design,
    gain_surface,
    plant_system,
    preset_structure,
    root_locus,
    semidiscretize,
    stability_volume,
)

POINT = OperatingPoint(10.0, 1.75, 14.0)


@pytest.fixture(scope="module")
def volume():
    """Fig. 5, with a quarter of its slices."""
    return stability_volume(POINT, slices=27)


@pytest.mark.long
def test_slices_have_the_areas_of_charts(volume):
    for k in (5, 14, 26):
        exact = chart(
            POINT.with_changes(psi=volume.positions[k]), ("omega0", 0.5, 24.0), ("delta0", 0.0, 5.0)
        )
        assert volume.areas[k] == pytest.approx(exact.stable_area, rel=2e-2, abs=0.1)
    one = volume.slice_at(14.0)
    assert one.stable_area == pytest.approx(21.977, abs=0.01)


@pytest.mark.long
def test_volume_is_that_of_random_points(volume):
    """Counting roots at random points knows nothing of boundaries."""
    rng = np.random.default_rng(3)
    low, high = np.array([0.5, 0.0, 0.1]), np.array([24.0, 5.0, 26.0])
    places = rng.uniform(low, high, (1500, 3))
    stable = [
        count_right_of(plant_system(OperatingPoint(*map(float, place))), 0.0).count == 0
        for place in places
    ]
    share = np.mean(stable)
    box = float(np.prod(high - low))
    deviation = box * np.sqrt(share * (1 - share) / len(places))
    assert abs(volume.volume - share * box) < 3.5 * deviation


@pytest.mark.long
def test_finer_grids_stay_within_the_error(volume):
    finer = stability_volume(POINT, slices=53, lines=257)
    assert abs(finer.volume - volume.volume) < 2.0 * volume.volume_error
    assert finer.volume_error < 0.5 * volume.volume_error


def test_the_surface_lies_on_the_boundary(volume):
    corners, quads = volume.surface()
    assert set(np.unique(quads)) == set(range(len(corners)))
    rng = np.random.default_rng(0)
    inside = (corners[:, 0] > 0.51) & (corners[:, 0] < 23.9)
    for omega0, delta0, psi in corners[rng.choice(np.flatnonzero(inside), 12)]:
        loops = [
            plant_system(OperatingPoint(w, delta0, psi)) for w in omega0 * np.array([0.999, 1.001])
        ]
        counts = Counter(count_right_of(loop, 0.0).count for loop in loops)
        assert len(counts) == 2 or delta0 < 1e-3


@pytest.mark.parametrize("ending", [".vtk", ".ply", ".stl"])
def test_meshes_open_elsewhere(volume, tmp_path, ending):
    path = tmp_path / f"volume{ending}"
    volume.save_mesh(path)
    mesh = meshio.read(path)
    corners, quads = volume.surface()
    assert len(mesh.cells_dict["triangle"]) == 2 * len(quads)
    # STL has single precision.
    assert mesh.points.max(axis=0) == pytest.approx(corners.max(axis=0), rel=1e-6)


def test_figures_have_what_they_say(volume):
    ax = volume.plot()
    assert len(ax.collections) == 1
    ax = volume.plot_slices(4)
    assert len(ax.get_legend().get_texts()) == 4


def test_bad_volumes_are_refused(tmp_path, volume):
    with pytest.raises(InputError, match="axis = K1_1"):
        stability_volume(POINT, z=("K1_1", -1.0, 1.0))
    with pytest.raises(InputError, match="slices = 2"):
        stability_volume(POINT, slices=2)
    with pytest.raises(InputError, match="z = omega0"):
        stability_volume(POINT, z=("omega0", 1.0, 2.0))
    with pytest.raises(InputError, match="out"):
        volume.save_mesh(tmp_path / "volume.xyz")
    assert not list(tmp_path.iterdir())


def test_the_command_writes_a_mesh(capsys, tmp_path):
    out = tmp_path / "v.vtk"
    with pytest.raises(SystemExit) as stop:
        cli.main(["chart", "--z", "psi=1:20", "--y", "delta0=0:4", "--slices", "7", "--json",
                  "--out", str(out)])  # fmt: skip
    fields = json.loads(capsys.readouterr().out)
    assert stop.value.code == 0
    assert fields["stable_volume"] > 0
    assert len(fields["slices"]) == 7
    assert out.exists()


@pytest.mark.long
def test_gain_surface_has_the_values_of_single_loops():
    surface = gain_surface(POINT, m=3, order=0, count=5)
    assert surface.radius.shape == (5, 5)
    from drillctrl import close_loop

    loop = close_loop(plant_system(POINT), preset_structure("case1"), [-5.0], [5.0])
    assert surface.radius[3, 1] == pytest.approx(semidiscretize(loop, 3, 0).spectral_radius)
    assert (
        surface.optimum.spectral_abscissa == design(POINT, "case1", trials=False).spectral_abscissa
    )
    # The paper's minimum is no minimum of its own measure either.
    finer = gain_surface(POINT, m=3, order=0, count=41)
    assert finer.lowest[2] < 0.97933 - 1e-3
    ax = finer.plot()
    assert ax.get_xlabel() == "gain $K_{1,1}$, dimensionless"
    with pytest.raises(InputError, match="structure = p"):
        gain_surface(POINT, "p")


def test_root_locus_enters_the_circle_where_drilling_becomes_stable():
    """Fig. 4a: as ω0 rises from 3 to 24 at δ0 = 1, a pair of eigenvalues comes in."""
    locus = root_locus(OperatingPoint(10.0, 1.0, 14.0), m=40, order=1, count=40)
    stable = locus.radius < 1.0
    first = locus.values[np.flatnonzero(stable)[0]]
    assert not stable[0]
    exact = chart(OperatingPoint(10.0, 1.0, 14.0), ("omega0", 3.0, 24.0), ("delta0", 0.9, 1.1))
    line = min(exact.lines, key=lambda one: abs(one.position - 1.0))
    edge = line.stable_intervals[0][0]
    assert abs(first - edge) < 2 * (locus.values[1] - locus.values[0])
    with pytest.raises(InputError, match="axis"):
        root_locus(POINT, ("K1_1", -1.0, 1.0))
