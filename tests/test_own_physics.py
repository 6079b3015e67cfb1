"""Physics of a stranger goes through every verb, and stays what it is."""

import numpy as np
import pytest

from drillctrl import (
    Controller,
    FeedbackStructure,
    InputError,
    OperatingPoint,
    analyze,
    as_case,
    chart,
    close_loop,
    compare,
    count_right_of,
    design,
    dimensionless_grid,
    linear_axis,
    load_table,
    paper_plant,
    report,
    save_table,
    simulate,
    table,
)
from drillctrl.tables.export_c import export_c
from drillctrl.tables.export_st import export_st
from tests.strangers import PLANTS, VelocityWeakening, short_chain, third_inertia

POINT = OperatingPoint(10.0, 2.5, 14.0)


@pytest.fixture(scope="module", params=PLANTS)
def stranger(request):
    plant, structure = PLANTS[request.param]
    case = as_case(POINT, plant)
    return case, design(case, structure, trials=False)


@pytest.mark.long(but=1)
def test_design_chart_and_report(stranger, monkeypatch):
    case, result = stranger
    # Where it stands is asked, not how large the area is.
    monkeypatch.setattr("drillctrl.charts.chart.FIRST_LINES", 5)
    assert count_right_of(result.system(), 0.0).count == 0
    assert result.stable
    # A chart of the same gains says the same of the point, by its own route.
    drawn = chart(
        case, ("omega0", 9.0, 11.0), ("delta0", 2.0, 3.0), result.structure, result.K1, result.K2,
        tolerance=0.1,
    )  # fmt: skip
    assert drawn.unstable_roots(10.0, 2.5) == 0
    told = report(result) if case.system().order < 10 else result
    assert "argument principle agrees" in told.summary()


def test_small_motion_is_linear(stranger):
    case, result = stranger
    kick = {"dx": 1e-4, "dtheta": 1e-4}
    runs = [
        simulate(case, result.controller(), duration=6.0, initial=kick, model=model, rtol=1e-9)
        for model in ("nonlinear", "linear")
    ]
    times = np.linspace(0.0, 6.0, 200)
    bent, straight = (run.at(times).theta for run in runs)
    assert np.abs(bent - straight).max() < 2e-3 * np.abs(straight).max()


def test_another_physics_than_the_gains_were_designed_for_is_refused(stranger):
    case, result = stranger
    with pytest.raises(InputError, match=r"plant = .*PaperLaw.*designed for"):
        simulate(POINT, result.controller(), duration=1.0)
    if case.plant.string == as_case(POINT).plant.string:
        run = simulate(POINT, result.controller(), duration=1.0, other_plant=True)
        assert run.status == "done"


@pytest.mark.long(but=1)
def test_table_files_and_exports(stranger, tmp_path):
    case, result = stranger
    grid = dimensionless_grid(linear_axis("omega0", 9.0, 11.0, 2), 2.5, reference=case)
    made = table(grid, result.structure, trials=False)
    assert made.stable.all()
    for node, gains in zip(grid.cases, made.gains, strict=True):
        K1, K2 = result.structure.gains(gains)
        loop = close_loop(node.system(result.structure.inputs), result.structure, K1, K2)
        assert count_right_of(loop, 0.0).count == 0
    path = tmp_path / "gains.json"
    save_table(made, path)
    assert load_table(path, plant=case.plant).gains.tobytes() == made.gains.tobytes()
    with pytest.raises(InputError, match="another plant"):
        load_table(path)
    period = POINT.delay / 8
    header, source = export_c(made, tmp_path, "drill", period=period, limit=3.0)
    assert "drill_step" in header.read_text() + source.read_text()
    assert (
        "FUNCTION_BLOCK"
        in export_st(made, tmp_path / "drill.st", period=period, limit=3.0).read_text()
    )


@pytest.mark.long(but=1)
@pytest.mark.parametrize("bit_or_string", [{"bit": VelocityWeakening()}, {"string": short_chain}])
def test_compare(bit_or_string):
    case = as_case(POINT, paper_plant(**bit_or_string))
    found = compare(case, ("pd",), duration=10.0, region=None, trials=False)
    rows = {row.label: row for row in found.rows}
    alone = design(case, "pd", trials=False)
    assert rows["pd"].result.spectral_abscissa == alone.spectral_abscissa
    assert rows["none"].result.spectral_abscissa == analyze(case).spectral_abscissa


def test_a_surface_output_is_fed_back():
    plant = PLANTS["third inertia, surface output"][0]
    structure = FeedbackStructure(
        "surface", ("dtheta_2", "surface_torque"), [[-5, -5]], [[5, 5]], [[0, 0]], [[0, 0]],
        inputs=("surface",),
    )  # fmt: skip
    case = as_case(OperatingPoint(15.0, 1.0, 14.0), plant)
    result = design(case, structure, trials=False)
    assert result.spectral_abscissa < analyze(case).spectral_abscissa - 1e-3
    with pytest.raises(InputError, match="surface"):
        simulate(POINT, Controller(structure, result.K1, result.K2), duration=1.0)
    assert third_inertia.__module__ in plant.text


def test_gains_are_tried_on_the_plant_that_they_are_for():
    plant, structure = PLANTS["velocity-weakening law"]
    tried = design(as_case(POINT, plant), structure)
    assert [trial.start.name for trial in tried.trials[:3]] == ["small", "kick", "back"]
    assert tried.recommended is not None
    fresh = analyze(as_case(POINT, plant), structure, tried.K1, tried.K2, trials=True)
    assert fresh.trials == tried.trials


@pytest.mark.long
def test_a_parameter_of_the_law_is_an_axis_of_a_table(tmp_path):
    plant, structure = PLANTS["velocity-weakening law"]
    grid = dimensionless_grid(
        10.0, 2.5, 14.0, as_case(POINT, plant), parameter=linear_axis("drop", 0.5, 2.0, 3)
    )
    made = table(grid, structure, trials=False)
    assert made.columns[:3] == ("omega0", "delta0", "drop")
    for value, gains in zip((0.5, 1.25, 2.0), made.gains, strict=True):
        there = as_case(POINT, paper_plant(bit=VelocityWeakening(drop=value)))
        alone = design(there, structure, trials=False)
        loop = close_loop(there.system(("torque",)), alone.structure, *made.structure.gains(gains))
        assert count_right_of(loop, alone.spectral_abscissa + 1e-3).count == 0
    path = tmp_path / "gains.csv"
    save_table(made, path)
    again = load_table(path, plant=plant)
    assert again.gains_at(10.0, 2.5, 1.25)[0] == pytest.approx(made.gains_at(10.0, 2.5, 1.25)[0])
    assert "drop" in export_c(made, tmp_path, "drill", period=0.02, limit=3.0)[0].read_text()
    with pytest.raises(InputError, match="axes"):
        dimensionless_grid(10.0, 2.5, parameter=linear_axis("drop", 0.5, 2.0, 3))
