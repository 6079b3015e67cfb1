"""Tables over more axes than three."""

import itertools

import numpy as np
import pytest

from drillctrl import (
    Axis,
    Change,
    InputError,
    OperatingPoint,
    Scenario,
    analyze,
    cli,
    dimensionless_grid,
    linear_axis,
    load_table,
    rig_grid,
    save_table,
    scheduled,
    string_preset,
    table,
    table1,
)
from drillctrl.drilling.case import as_case
from drillctrl.drilling.drive import TopDrive
from drillctrl.drilling.plant import paper_plant
from drillctrl.tables.export_st import export_st

from .exported import InC, InPython, InScl, Interpreted, hostile
from .iec import Block, load

ENDS = {"omega0": (9, 12), "delta0": (1, 2), "psi": (12, 14)}
AXES = tuple(linear_axis(name, *ends, 2) for name, ends in ENDS.items())
KAPPA = Axis("kappa", (0.01, 0.03, 0.06))


@pytest.fixture(scope="module")
def four():
    return table(dimensionless_grid(*AXES, further=[KAPPA]), "case1", trials=False)


@pytest.mark.long
def test_nodes_are_those_of_their_damping_and_cells_are_looked_into(four):
    assert four.grid.shape == (2, 2, 2, 3)
    assert four.columns[:4] == ("omega0", "delta0", "psi", "kappa")
    assert len(four.cells.mode) == 2
    assert four.stable.all()
    for i in (0, 7, 23):
        omega0, delta0, psi, kappa = four.grid.coordinates[i]
        point = OperatingPoint(omega0, delta0, psi, kappa=kappa)
        K1, K2 = four.gains_at(omega0, delta0, psi, kappa)
        found = analyze(point, "case1", K1[0], K2[0]).spectral_abscissa
        assert found == pytest.approx(four.spectral_abscissa[i], abs=1e-9)
    # Rows of one damping are the table over three axes; between the nodes by repeated averages.
    rng = np.random.default_rng(4)
    assert four.cells.mode[1] == 0
    gains = four.entries.reshape(2, 2, 2, 3, -1)
    for place in rng.uniform([9, 1, 12, 0.03], [12, 2, 14, 0.06], (20, 4)):
        share = [(place[0] - 9) / 3, place[1] - 1, (place[2] - 12) / 2, (place[3] - 0.03) / 0.03]
        expected = gains[:, :, :, 1:]
        for part in share:
            expected = (1.0 - part) * expected[0] + part * expected[1]
        flat = np.concatenate([part.ravel() for part in four.gains_at(*place)])
        assert flat == pytest.approx(expected, rel=1e-12)
    assert not four.stable_at(10.0, 1.5, 13.0, 0.07)[0]


def test_it_comes_back_from_every_file(four, tmp_path):
    for ending in ("csv", "json", "mat", "nc", "parquet"):
        save_table(four, tmp_path / f"four.{ending}")
        back = load_table(tmp_path / f"four.{ending}")
        assert back.grid == four.grid
        assert np.array_equal(back.gains, four.gains)
        assert np.array_equal(back.cells.mode, four.cells.mode)


@pytest.mark.parametrize("kind", [InC, Interpreted, InScl])
def test_exports_look_four_coordinates_up(four, tmp_path, kind):
    options = {"period": 0.01, "limit": 1.0, "ramp": 0, "hold": 1}
    reference, steps = InPython(four, tmp_path, **options), kind(four, tmp_path, **options)
    largest = 0.0
    for y, at, delay, on, given in hostile(four, 0.01, 1500 if kind is InC else 300):
        expected = reference.step(y, at, delay, on, **given)
        assert steps.step(y, at, delay, on, **given) == pytest.approx(
            expected, rel=1e-12, abs=1e-12
        )
        assert (steps.status, steps.vouched) == (reference.status, reference.vouched)
        largest = max(largest, abs(expected))
    assert largest == 1.0
    if kind is InC:
        for place in itertools.product((9.7, 12.0), (1.3,), (12.5, 14.0), (0.01, 0.02, 0.05)):
            gains, vouched = steps.lookup(place)
            flat = np.concatenate([part.ravel() for part in four.gains_at(*place)])
            assert gains == pytest.approx(flat.tolist(), rel=1e-12)
            assert vouched == four.stable_at(*place)[0]


def test_the_bench_replays_four_coordinates(four, tmp_path):
    path = export_st(four, tmp_path / "drill.st", period=0.01, limit=1.0)
    text = path.read_text() + (tmp_path / "drill_bench.st").read_text()
    bench = Block(load(text)["DRILL_BENCH"])
    for _ in range(241):
        bench()
    assert bench.PASSED


def test_a_schedule_keeps_what_no_scenario_changes(four):
    point = OperatingPoint(9.0, 1.5, 13.0, kappa=0.045)
    scenario = Scenario(changes=(Change(5.0, omega0=12.0),))
    control = scheduled(four, point, scenario)
    K1, _ = four.gains_at(9.0, 1.5, 13.0, 0.045)
    assert pytest.approx(K1[0]) == control.K1


def test_a_parameter_of_the_plant_is_a_further_axis():
    """The inertia of a drive beside ψ, and on a rig."""
    plant = paper_plant(blocks=(TopDrive(inertia_ratio=3.0),))
    case = as_case(OperatingPoint(10.0, 1.0, 14.0), plant)
    further = [linear_axis("inertia_ratio", 2.0, 5.0, 2)]
    grid = dimensionless_grid(10.0, 1.0, linear_axis("psi", 12, 14, 2), case, further=further)
    ratios = [node.parameters["inertia_ratio"] for node in grid.cases]
    assert ratios == [2.0, 5.0, 2.0, 5.0]
    assert [node.parameters["psi"] for node in grid.cases] == [12.0, 12.0, 14.0, 14.0]
    for name in ("depth", "omega0", "psi"):
        with pytest.raises(InputError, match="axes"):
            rig_grid(
                table1(), 15.0, penetration_rate=0.005, further=[linear_axis(name, 1.0, 2.0, 2)]
            )
    with pytest.raises(InputError, match="axes"):
        dimensionless_grid(*AXES, further=[KAPPA, KAPPA])


def test_the_command_takes_further_axes(tmp_path, capsys):
    def call(*arguments):
        base = ("table", "--omega0", "9:12:2", "--delta0", "1", "--psi", "14", "--structure", "p")
        with pytest.raises(SystemExit) as stop:
            cli.main([*base, "--trials", "none", *arguments])
        return stop.value.code, *capsys.readouterr()

    out = str(tmp_path / "four.csv")
    status, told, _ = call("--axis", "kappa=0.01:0.06:2", "--axis", "eta=1.5:1.6:2", "--out", out)
    assert status == 0
    assert "8 nodes" in told
    assert load_table(out).grid.names == ("omega0", "delta0", "psi", "kappa", "eta")
    for bad, option in (
        (("--axis", "kappa"), "--axis"), (("--axis", "depth=1:2:2"), "--axis"),
        (("--axis", "kappa=0.06:0.01:2"), "--axis"),
        (("--axis", "kappa=0.01:0.06:2", "--plot", str(tmp_path / "a.png")), "--plot"),
    ):  # fmt: skip
        status, told, err = call(*bad)
        assert (status, told) == (2, ""), bad
        assert f"drillctrl: {option} = " in err, err


def test_rock_depth_and_mud_vary_together():
    rig = string_preset("paper-string")
    grid = rig_grid(
        rig, Axis("rotary_speed", (12.0, 15.0)), penetration_rate=2e-3,
        rock_strength=linear_axis("rock_strength", 40e6, 60e6, 2),
        depth=linear_axis("depth", 900.0, 1100.0, 2), mud=linear_axis("mud", 1000.0, 1200.0, 2),
    )  # fmt: skip
    assert grid.shape == (2, 1, 2, 2, 2)
    assert grid.names == ("omega0", "delta0", "psi", "depth", "mud")
    for place, case in zip(grid.coordinates.tolist(), grid.cases, strict=True):
        assert case.plant.string.string.length == pytest.approx(place[3])
        assert case.plant.string.string.mud_density == place[4]
        np.testing.assert_allclose(grid.place_of(case), grid.groups([place])[0], rtol=1e-12)
        np.testing.assert_allclose(grid.locate(*grid.place_of(case))[0], place, rtol=1e-9)
