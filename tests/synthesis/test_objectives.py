import json
from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import differential_evolution

from drillctrl import (
    DelaySystem,
    Exact,
    FeedbackStructure,
    InputError,
    OperatingPoint,
    Requirements,
    Robust,
    SemiDiscrete,
    Tie,
    WorstCase,
    close_loop,
    design,
    loop_transfer,
    plant_system,
    preset_structure,
    pseudospectral_abscissa,
    semidiscretize,
    spectral_abscissa,
)
from drillctrl.designs.robustness import relative_radius
from drillctrl.synthesis import measures
from drillctrl.synthesis.family import loop_family

GAINS = {"case1": [-5.17, 5.06], "case2": [-5.03, -1.91, -1.67, -0.31]}


@pytest.mark.parametrize("name", GAINS)
@pytest.mark.parametrize(
    "measure",
    [
        lambda f: measures.growth_rate(f, 12, 1),
        measures.distance,
        lambda f: measures.pseudospectral(f, 1e-3),
        measures.inverse_input_gain,
        lambda f: measures.inverse_norm(f, (), ("theta",)),
    ],
)
def test_gradients_of_measures_are_those_of_differences(point_c, name, measure):
    family = loop_family(plant_system(point_c), preset_structure(name))
    objective = measure(family)
    here = np.array(GAINS[name])
    _, gradient = objective(here)
    steps = 1e-5 * np.eye(here.size)
    differences = [(objective(here + h)[0] - objective(here - h)[0]) / 2e-5 for h in steps]
    assert gradient == pytest.approx(differences, rel=2e-4, abs=1e-9)


def test_quick_measures_agree_with_guaranteed_ones(point_c):
    plant, structure = plant_system(point_c), preset_structure("case2")
    family = loop_family(plant, structure)
    gains = np.array(GAINS["case2"])
    weights = measures.plant_weights(family).tolist()
    slow = pseudospectral_abscissa(family.loop(gains), 1e-3, weights)
    assert measures.pseudospectral(family, 1e-3)(gains)[0] == pytest.approx(slow, abs=1e-9)
    omega = np.linspace(1e-3, 40.0, 100_001)
    loop = -loop_transfer(plant, structure, *structure.gains(gains), omega)[0, 0]
    peak = np.abs(loop / (1.0 - loop)).max()
    assert measures.inverse_input_gain(family)(gains)[0] == pytest.approx(1.0 / peak, rel=1e-6)


@pytest.mark.long
def test_semidiscrete_design_beats_the_exact_one_on_its_own_measure_only(point_c, best_c):
    paper = design(point_c, "case1", objective=SemiDiscrete(20, 1), trials=False)
    rate = semidiscretize(paper.system(), 20, 1).growth_rate
    assert paper.objective_value == pytest.approx(rate, abs=1e-12)
    assert rate < semidiscretize(best_c.system(), 20, 1).growth_rate
    assert paper.spectral_abscissa > best_c.spectral_abscissa


@pytest.mark.long
def test_semidiscrete_optimum_is_no_worse_than_differential_evolution(plant_c):
    structure = preset_structure("case1")

    def rate(gains):
        loop = close_loop(plant_c, structure, *structure.gains(gains))
        return semidiscretize(loop, 8, 1).growth_rate

    # Where the optimum is known to be, so that few generations reach it.
    bounds = [(-10.0, -9.0), (8.7, 9.7)]
    oracle = differential_evolution(rate, bounds, rng=1, popsize=10, maxiter=40, polish=False)
    found = design(plant_c, structure, objective=SemiDiscrete(8, 1), trials=False)
    assert found.objective_value <= oracle.fun + 1e-5


def test_worst_case_design_is_better_where_it_counts(point_c, best_c):
    rocks = [point_c.with_changes(psi=factor * point_c.psi) for factor in (0.8, 1.0, 1.2)]

    def worst(result):
        loops = (
            close_loop(plant_system(rock), result.structure, result.K1, result.K2) for rock in rocks
        )
        return max(spectral_abscissa(loop) for loop in loops)

    robust = design(point_c, "case1", objective=WorstCase(psi=0.2), trials=False)
    assert robust.objective_value == pytest.approx(worst(robust), abs=1e-10)
    # A grid over the box finds nothing better by more than its own coarseness.
    assert worst(robust) == pytest.approx(-0.4229, abs=2e-3)
    assert worst(robust) < worst(best_c) - 0.02


@pytest.mark.long
def test_robust_design_lowers_the_pseudospectral_abscissa(point_c, best_c):
    result = design(point_c, "case1", objective=Robust(1e-3), trials=False)
    plant = result.plant
    weights = [np.linalg.norm(plant.A0, 2), np.linalg.norm(plant.delayed[0], 2)]
    before = pseudospectral_abscissa(best_c.system(), 1e-3, weights)
    after = pseudospectral_abscissa(result.system(), 1e-3, weights)
    assert result.objective_value == pytest.approx(after, abs=1e-9)
    assert after < before - 0.05


@pytest.mark.long
def test_requirements_compose_with_the_objective(point_c, best_c):
    radius = 1.02 * relative_radius(best_c).value
    required = Requirements(stability_radius=radius)
    result = design(point_c, "case1", requirements=required, trials=False)
    assert result.requirements_met
    assert relative_radius(result).value >= radius
    assert best_c.spectral_abscissa < result.spectral_abscissa < -0.5
    fields = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert fields["requirements"]["met"] is True
    assert "Required" in result.summary()


def test_a_requirement_that_holds_anyway_changes_nothing(point_c):
    result = design(point_c, "case1", requirements=Requirements(decay=0.1), trials=False)
    assert result.spectral_abscissa == pytest.approx(-0.811927438342, abs=1e-8)


def test_a_requirement_out_of_reach_is_reported(point_c):
    result = design(point_c, "case1", requirements=Requirements(decay=2.0), trials=False)
    assert not result.requirements_met
    assert "NOT MET" in result.summary()


def test_input_gain_is_bounded(point_c):
    limit = 1.05
    required = Requirements(input_gain=limit)
    result = design(point_c, "case1", requirements=required, trials=False)
    assert result.requirements_met
    omega = np.linspace(1e-3, 30.0, 50_001)
    loop = -loop_transfer(result.plant, result.structure, result.K1, result.K2, omega)[0, 0]
    assert np.abs(loop / (1.0 - loop)).max() <= limit * (1.0 + 1e-9)


@pytest.mark.parametrize(
    "make",
    [
        lambda: SemiDiscrete(0),
        lambda: SemiDiscrete(10, 3),
        lambda: WorstCase(psi=1.0),
        lambda: Robust(float("nan")),
        lambda: Requirements(decay=-1.0),
    ],
)
def test_bad_objectives_are_refused(make):
    with pytest.raises(InputError):
        make()


def test_tied_gains_are_the_one_gain_optimum(point_c):
    tied = replace(preset_structure("case1"), ties=(Tie("K2_1", "K1_1", -1.0),))
    result = design(point_c, tied, trials=False)
    assert result.K2[0, 0] == -result.K1[0, 0]
    family = loop_family(plant_system(point_c), tied)
    scan = family.abscissas(np.linspace(-10.0, 10.0, 4001)[:, None])
    assert result.spectral_abscissa <= scan.min() + 1e-7


def test_ties_narrow_the_bounds_of_their_leader():
    case1 = preset_structure("case1").with_bounds({"K2": (-3.0, 4.0)})
    tied = replace(case1, ties=(Tie("K2_1", "K1_1", -0.5),))
    assert (tied.lower[0], tied.upper[0]) == (-8.0, 6.0)
    with pytest.raises(InputError, match="tie"):
        replace(case1, ties=(Tie("K2_2", "K1_1"),))
    with pytest.raises(InputError, match="not zero"):
        replace(case1, ties=(Tie("K2_1", "K1_1", 0.0),))


def test_two_inputs_stabilise_what_torque_alone_cannot():
    point = OperatingPoint(5.1, 0.25, 14.0)
    torque = design(point, "case2", trials=False)
    assert not torque.stable
    low, none = [[-5.0, 0.0], [0.0, -5.0]], np.zeros((2, 2))
    both = FeedbackStructure(
        "torque and feed",
        ("theta", "dx"),
        low,
        -np.array(low),
        none,
        none,
        inputs=("torque", "axial"),
    )
    result = design(point, both, trials=False)
    assert result.stable
    assert spectral_abscissa(result.system()) < 0.0


def test_a_delay_system_of_the_user_is_designed_for():
    """x' = x(t) + u with u = k x(t - 1) is stable for -π/2 < ... only for some k."""
    plant = DelaySystem([[0.5]], ([[0.0]],), (1.0,), [[1.0]], [[1.0]], output_names=("x",))
    structure = FeedbackStructure("late", ("x",), [[0]], [[0]], [[-5]], [[5]], ("u1",))
    result = design(plant, structure)
    # A double root at s = 0.5 - 1, where the gain is -exp(s).
    assert result.K2[0, 0] == pytest.approx(-np.exp(-0.5), abs=1e-9)
    assert result.spectral_abscissa == pytest.approx(-0.5, abs=1e-7)
    assert result.point is None
    assert "1 states" in result.summary()
    assert json.loads(json.dumps(result.to_dict(), allow_nan=False))["operating_point"] is None


def test_a_worst_case_needs_an_operating_point():
    plant = DelaySystem([[0.5]], ([[0.0]],), (1.0,), [[1.0]], [[1.0]], output_names=("x",))
    structure = FeedbackStructure("late", ("x",), [[0]], [[0]], [[-5]], [[5]], ("u1",))
    with pytest.raises(InputError, match="OperatingPoint, .* worst-case needs the physics"):
        design(plant, structure, objective=WorstCase())


def test_exact_is_the_default(point_c):
    assert design(point_c, "p", trials=False).objective == Exact()


@pytest.mark.long(but=1)
@pytest.mark.parametrize(("name", "alpha"), [("p", -0.169953919), ("pd", -0.783302734)])
def test_wider_bounds_give_no_worse_gains(point_c, name, alpha):
    found = [
        design(point_c, name, bounds={"K1": (-size, size)}, trials=False).spectral_abscissa
        for size in (10.0, 1000.0, 1e4)
    ]
    assert found[2] <= found[1] + 1e-9 <= found[0] + 2e-9
    assert found[1] == pytest.approx(alpha, abs=1e-8)


@pytest.mark.long(but=1)
@pytest.mark.parametrize(("m", "order"), [(40, 0), (40, 2)])
def test_the_semi_discretised_optimum_is_reached(point_c, m, order):
    found = design(point_c, "case1", objective=SemiDiscrete(m, order), trials=False)
    # By an exhaustive search with another method: -0.811928 and -0.811925.
    assert found.objective_value < -0.81191
    loop = semidiscretize(found.system(), m, order)
    assert loop.growth_rate == pytest.approx(found.objective_value, abs=1e-12)
