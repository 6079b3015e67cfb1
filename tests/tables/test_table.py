import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from drillctrl import (
    InputError,
    OperatingPoint,
    WorstCase,
    analyze,
    design,
    dimensionless_grid,
    linear_axis,
    rig_grid,
    spectral_abscissas,
    table,
    table1,
)
from drillctrl.tables.grid import Axis
from drillctrl.tables.interpolation import Cells


@pytest.mark.long
def test_nodes_are_as_good_as_single_designs_and_agree_with_analyze(small):
    K1, K2 = small.gains_at(*np.array([[p.omega0, p.delta0, p.psi] for p in small.grid.points]).T)
    for i, point in enumerate(small.grid.points):
        assert (
            small.spectral_abscissa[i]
            <= design(point, "case1", trials=False).spectral_abscissa + 1e-4
        )
        again = analyze(point, "case1", K1[i], K2[i])
        # Interpolated at a node: equal up to rounding, which a triple root shows as its cube root.
        assert again.spectral_abscissa == pytest.approx(small.spectral_abscissa[i], abs=1e-4)
    assert small.certified.all()
    assert small.stable.all()


def test_random_points_between_nodes_are_stable_where_the_table_says_so(small):
    rng = np.random.default_rng(7)
    omega0, delta0 = rng.uniform(8, 14, 1000), rng.uniform(1, 6, 1000)
    vouched = small.stable_at(omega0, delta0, 14.0)
    K1, K2 = small.gains_at(omega0, delta0, 14.0)
    vectors = np.column_stack([K1.reshape(1000, -1), K2.reshape(1000, -1)])
    alpha = spectral_abscissas(
        small.grid.points[0], {"omega0": omega0, "delta0": delta0}, small.structure, vectors
    )
    assert vouched.sum() > 500
    assert (alpha[vouched] < 0.0).all()


def test_interpolation_is_bilinear_and_clamped(small):
    corner = [np.ravel_multi_index((i, j, 0), small.grid.shape) for i in (0, 1) for j in (0, 1)]
    K1, K2 = small.gains_at(9.5, 2.25, 14.0)
    mean = small.gains[corner].mean(axis=0)
    assert [K1.item(), K2.item()] == pytest.approx(mean.tolist(), rel=1e-12)
    far, edge = small.gains_at(99.0, 0.0, 14.0), small.gains_at(14.0, 1.0, 14.0)
    assert far[0].item() == edge[0].item()
    assert not small.stable_at(99.0, 0.0, 14.0).any()


@pytest.mark.long
def test_smoothing_keeps_its_promise(small):
    smooth = table(small.grid, "case1", trials=False, give_up=0.1)
    assert smooth.jump[0] < small.jump[0]
    assert (smooth.spectral_abscissa <= 0.9 * smooth.best_abscissa + 1e-6).all()
    assert (np.abs(smooth.gains) <= 10.0).all()


def test_nodes_that_nothing_stabilises(on_rig):
    slow = ~on_rig.stable
    assert slow.any()
    assert on_rig.stable.any()
    assert not on_rig.gains[slow].any()
    for i in np.flatnonzero(slow).tolist():
        open_loop = analyze(on_rig.grid.points[i]).spectral_abscissa
        assert on_rig.spectral_abscissa[i] == pytest.approx(open_loop, abs=1e-9)
        assert on_rig.best_abscissa[i] >= 0.0
    # A cell with such a corner is never vouched for.
    point = on_rig.grid.points[int(np.flatnonzero(slow)[0])]
    assert not on_rig.stable_at(point.omega0, point.delta0, point.psi).any()
    assert "that nothing found stabilises: control off" in on_rig.summary()


def test_rig_coordinates_and_groups_are_inverse():
    for feed in ({"penetration_rate": 5e-3}, {"weight_on_bit": 60e3}):
        grid = rig_grid(table1(), Axis("rotary_speed", (14.0, 20.0)), rock_strength=80e6, **feed)
        places = np.array([[15.0, next(iter(feed.values())), 7e7], [19.0, 50e3, 9e7]])
        if "penetration_rate" in feed:
            places[1, 1] = 8e-3
        back = grid.locate(*grid.groups(places).T)
        assert back == pytest.approx(places, rel=1e-12)
        assert grid.groups(list(places[0])).tolist() == grid.groups(places[:1]).tolist()


@pytest.mark.long
def test_a_worker_more_changes_nothing(small):
    import multiprocessing
    from concurrent.futures import ProcessPoolExecutor

    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
        again = table(small.grid, "case1", trials=False, executor=pool)
    assert np.array_equal(again.gains, small.gains)
    assert np.array_equal(again.cells.spectral_abscissa, small.cells.spectral_abscissa)


def test_one_node_and_three_axes():
    single = table(dimensionless_grid(10.0, 1.75, 14.0), "p", trials=False)
    assert single.jump == (0.0, None)
    alone = design(OperatingPoint(10, 1.75, 14), "p", trials=False)
    assert single.spectral_abscissa[0] == alone.spectral_abscissa
    cube = table(
        dimensionless_grid(
            Axis("omega0", (9.0, 10.0)), Axis("delta0", (1.0, 2.0)), Axis("psi", (14.0, 18.0))
        ),
        "p",
        trials=False,
    )
    corners = list(itertools.product((9.0, 10.0), (1.0, 2.0), (14.0, 18.0)))
    assert [(p.omega0, p.delta0, p.psi) for p in cube.grid.points] == corners
    middle = cube.gains_at(9.5, 1.5, 16.0)[0].item()
    assert middle == pytest.approx(cube.gains.mean(), rel=1e-12)


@pytest.mark.parametrize(
    ("low", "high", "count"), [(4, 24, 1), (4, 4, 3), (5, 4, 3), (4, math.inf, 3), (1, 2, 10**9)]
)
def test_bad_axes(low, high, count):
    with pytest.raises(InputError):
        linear_axis("omega0", low, high, count)


def test_bad_arguments(small):
    for wrong in ({"give_up": 0.95}, {"fallback": "nearest"}, {"seed": -1}, {"refine": 7}):
        with pytest.raises(InputError):
            table(small.grid, "case1", trials=False, **wrong)


def test_figure_shows_gains_and_abscissa(on_rig):
    figure = on_rig.plot()
    titles = [ax.get_title() for ax in figure.axes]
    assert {"K1_1", "K2_2", "growth"} <= set(titles)
    shown = next(ax for ax in figure.axes if ax.get_title() == "growth")
    data = shown.collections[0].get_array()
    drawn = np.sort(np.ravel(data)).tolist()
    growth = np.sort(on_rig.spectral_abscissa) / on_rig.grid.rig.time_scale
    assert drawn == pytest.approx(growth.tolist())


def titles_of(table):
    figure = table.plot()
    return [ax.get_title() for ax in figure.axes if ax.get_title()], figure


def test_one_axis_is_drawn_as_lines_and_one_node_as_text(speeds):
    titles, figure = titles_of(speeds)
    assert titles == ["K1_1", "K2_1", "α"]
    x, y = figure.axes[2].lines[0].get_data()
    assert x.tolist() == list(speeds.grid.axes[0].values)
    assert y.tolist() == speeds.spectral_abscissa.tolist()
    # A constant gain is drawn over its cell, beside the ones that are interpolated.
    middle = figure.axes[0].lines[2].get_data()[1]
    assert middle.tolist() == [speeds.cells.gains[1, 0]] * 2
    titles, figure = titles_of(table(dimensionless_grid(10.0, 1.75, 14.0), "p", trials=False))
    assert titles == ["one node"]
    assert "K1_1 = " in figure.axes[0].texts[0].get_text()


def test_all_layers_of_three_axes_are_drawn_and_a_constant_gain_too():
    axes = Axis("omega0", (3.0, 9.0, 10.0)), Axis("delta0", (1.0, 2.0, 3.0))
    cube = table(
        dimensionless_grid(*axes, Axis("psi", (14.0, 18.0))),
        "p",
        bounds={"K1_1": (-9.0, -8.9)},
        trials=False,
    )
    cube = replace(cube, gains=np.full_like(cube.gains, -9.0))
    titles, figure = titles_of(cube)
    assert titles == ["K1_1 at psi 18", "α at psi 14", "α at psi 18"]
    shown = [ax.collections[0].get_array() for ax in figure.axes[1:3]]
    drawn = np.concatenate([np.ravel(values.T) for values in shown])
    layers = cube.spectral_abscissa.reshape(cube.grid.shape)
    assert drawn.tolist() == [*layers[..., 0].ravel(), *layers[..., 1].ravel()]


@pytest.fixture
def speeds():
    """Four nodes along one axis; the gains of the middle cell are constant."""
    found = table(
        dimensionless_grid(linear_axis("omega0", 8, 14, 4), 2.0, 14.0), "case1", trials=False
    )
    gains = np.zeros((3, 2))
    gains[1] = found.gains[1] + (3.0, -1.0)
    return replace(found, cells=Cells(np.array([0, 1, 0]), np.full(3, -0.1), gains))


def test_the_largest_jump_may_be_at_the_border_of_a_cell(speeds):
    jump, between = speeds.jump
    steps = [speeds.cells.gains[1] - speeds.gains[i] for i in (1, 2)]
    inside = np.abs([speeds.gains[1] - speeds.gains[0], speeds.gains[3] - speeds.gains[2]]).max()
    assert jump == pytest.approx(max(inside, np.abs(steps).max()) / 20.0)
    assert between in ((1, 1), (2, 2))
    assert speeds.worst_abscissa == -0.1
    # What lies on both sides of a cell does not follow on each other.
    alone = replace(speeds, cells=Cells(np.ones(3, dtype=int), np.zeros(3), np.ones((3, 2))))
    assert alone.jump[0] == 0.0


@pytest.mark.long
def test_refining_vouches_for_more_and_keeps_the_nodes():
    coarse = dimensionless_grid(linear_axis("omega0", 1, 9, 3), linear_axis("delta0", 1, 6, 2))
    tables = [
        table(coarse, "p", bounds={"K1": (-20.0, 20.0)}, refine=r, trials=False) for r in (0, 1, 2)
    ]
    rng = np.random.default_rng(3)
    omega0, delta0 = rng.uniform(1, 9, 800), rng.uniform(1, 6, 800)
    shares = []
    for found in tables:
        vouched = found.stable_at(omega0, delta0, 14.0)
        shares.append(vouched.mean())
        K1, _ = found.gains_at(omega0, delta0, 14.0)
        alpha = spectral_abscissas(
            found.grid.points[0],
            {"omega0": omega0, "delta0": delta0},
            found.structure,
            K1.reshape(-1, 1),
        )
        assert (alpha[vouched] < 0.0).all()
        assert set(coarse.points) <= set(found.grid.points)
    assert shares[0] < shares[1] < shares[2]


def test_the_error_of_the_spectral_abscissa_is_told():
    # The best gains make a root of multiplicity five, which rounding splits.
    found = table(dimensionless_grid(6.0, 9.7), "case2", trials=False)
    K1, K2 = found.gains_at(6.0, 9.7, 14.0)
    told = analyze(found.grid.points[0], "case2", K1[0], K2[0]).loop
    assert found.abscissa_error[0] == told.abscissa_error > 1e-4
    assert (found.spectral_abscissa + found.abscissa_error < 0.0)[found.stable].all()


def test_people_read_the_units_of_the_field(on_rig):
    text = " ".join(on_rig.summary().split())
    assert "rotary speed 100 … 220 rpm (3), penetration rate 20 … 60 m/h (2)" in text
    assert "rock strength 60 MPa " in text
    ax = on_rig.plot().axes[0]
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("rotary speed, rpm", "penetration rate, m/h")
    low, high = ax.get_xlim()
    assert low < 100.0 < 220.0 < high < 300.0
    # Files and the interface for programs stay in SI units.
    assert on_rig.to_dict()["axes"]["rotary_speed"][-1] == pytest.approx(220 * math.pi / 30)


@pytest.mark.long
def test_another_objective_is_designed_for_at_each_node():
    grid = dimensionless_grid(linear_axis("omega0", 9, 11, 2), 2.0, 14.0)
    worst = WorstCase(psi=0.2)
    found = table(grid, "case1", objective=worst, trials=False)
    best = table(grid, "case1", trials=False)
    for i, point in enumerate(grid.points):
        alone = design(point, "case1", objective=worst, trials=False)
        assert found.entries[i] == pytest.approx([alone.K1.item(), alone.K2.item()], abs=1e-12)
    # What is gained off the node costs decay on it.
    assert (found.spectral_abscissa > best.spectral_abscissa).all()
    assert found.stable.all()
    assert "WorstCase" in found.summary()
    with pytest.raises(InputError, match="give_up"):
        table(grid, "case1", objective=worst, give_up=0.1)
