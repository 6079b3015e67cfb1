import pickle

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drillctrl.base.errors import InputError
from drillctrl.drilling.bit_rock import BitRock, PaperLaw
from drillctrl.drilling.case import as_case
from drillctrl.drilling.drive import TopDrive
from drillctrl.drilling.friction import Stribeck
from drillctrl.drilling.gain_units import gain_units
from drillctrl.drilling.linear import linear_arrays, rhs_function
from drillctrl.drilling.motion import rest_states
from drillctrl.drilling.plant import paper_plant
from drillctrl.drilling.point import OperatingPoint, RigPoint
from drillctrl.drilling.rig import table1
from drillctrl.drilling.sensors import Filtered, Lagging
from drillctrl.drilling.string import String, spring_string
from drillctrl.drilling.structures import preset_structure


class CuttingWeakening(BitRock):
    """Cutting torque and weight that fall with speed, and a weight that feels Z'."""

    parameters = {"share": 0.3, "drag": 0.2}

    def load(self, c, contact, rates, q):
        plain = PaperLaw().load(c, contact, rates, q)
        factor = 1 - q.share * ca.tanh(rates.rotary / c.rotary_speed)
        return plain._replace(
            weight_on_bit=factor * plain.weight_on_bit + q.drag * rates.axial * contact.pressed,
            torque_on_bit=factor * plain.torque_on_bit,
        )


def collar(c):
    """A second inertia halfway up, with a torque of its own."""
    k = 2 * c.torsional_stiffness
    names = {"x": "length", "theta": "angle", "theta_2": "angle"}
    return spring_string(
        {**names, "x_top": "length", "theta_top": "angle"},
        masses={"x": c.mass, "theta": c.inertia, "theta_2": 0.5 * c.inertia},
        springs={
            ("x", "x_top"): c.axial_stiffness,
            ("theta", "theta_2"): k,
            ("theta_2", "theta_top"): k,
        },
        dampers={"x": c.axial_damping, "theta": c.torsional_damping, ("theta_2", "theta"): 0.01},
        inputs={"axial": "x", "torque": "theta", "surface": "theta_2"},
        outputs={"pipe_torque": ("torque", {"theta": k, "theta_2": -k})},
    )


PLANTS = {
    "paper": paper_plant(),
    "stribeck": paper_plant(bit=Stribeck(drop=20.0)),
    "weakening": paper_plant(bit=CuttingWeakening()),
    "collar": paper_plant(string=collar),
    "drive": paper_plant(blocks=(TopDrive(inertia_ratio=2.0),)),
    "sensors": paper_plant(
        bit=Stribeck(), blocks=(TopDrive(), Filtered("phi", 0.1), Lagging("drive", 0.05))
    ),
}


@pytest.mark.parametrize("name", PLANTS)
@given(
    st.lists(st.floats(-1, 1), min_size=6, max_size=6),
    st.floats(4, 15),
    st.floats(0.2, 3),
)
@settings(max_examples=20, deadline=None)
def test_linear_plant_is_the_derivative_of_the_motion(name, numbers, omega0, delta0):
    """The delay is solved for anew where X and X(t − τ) differ (Eqs. 8, 9)."""
    plant, point = PLANTS[name], OperatingPoint(omega0, delta0, 9.0)
    case = as_case(point, plant)
    values = linear_arrays(plant, case.parameter_vector[None, :])
    n = len(plant.state_names)
    now = 1e-5 * np.resize(numbers, n)
    then = 1e-5 * np.resize(numbers[::-1], n)
    u = 1e-5 * np.resize(numbers, len(plant.input_names))
    f = rhs_function(plant)

    def motion(scale):
        # 2π/n = ω0 τ + θ − θd, exactly.
        delay = (2 * np.pi / 4 - scale * (now[2] - then[2])) / omega0
        rate = f(scale * now, scale * then, delay, scale * u, case.parameter_vector)
        return rate.full().ravel()

    slope = 0.5 * (motion(1.0) - motion(-1.0))
    expected = values.A0[0] @ now + (values.left @ values.right)[0] @ then + values.B[0] @ u
    assert np.abs(motion(0.0)).max() < 1e-11
    assert np.abs(slope - expected).max() < 1e-13 + 1e-7 * np.abs(expected).max()


def test_outputs_are_rows_with_quantities():
    case = as_case(OperatingPoint(10, 1.75, 14), PLANTS["collar"])
    system = case.system()
    assert system.output_names[-1] == "pipe_torque"
    assert system.C[-1].tolist() == [0, 0, 2.0, 0, -2.0, 0]
    assert case.plant.quantity("pipe_torque") == "torque"
    assert case.plant.quantity("dtheta_2") == "angular_rate"
    assert system.input_names == ("axial", "torque", "surface")
    assert system.B[:, 2].tolist() == [0, 0, 0, 0, 0, 2.0]


def test_a_filtered_output_is_the_output_behind_a_lag():
    """Y_f(s) = e^(−0.02 s) Y(s)/(1 + 0.1 s), at any s."""
    plant = paper_plant(blocks=(Filtered("theta", 0.1, 0.02),))
    system = as_case(OperatingPoint(10, 1.75, 14), plant).system(("torque",))
    s = 0.3 + 2.1j
    matrix = s * np.eye(system.order) - system.A0
    for delay, late in zip(system.delays, system.delayed, strict=True):
        matrix = matrix - late * np.exp(-s * delay)
    reply = system.C @ np.linalg.solve(matrix, system.B)[:, 0]
    plain = reply[system.output_names.index("theta")]
    seen = reply[system.output_names.index("theta_filtered")]
    assert seen == pytest.approx(plain * np.exp(-0.02 * s) / (1 + 0.1 * s), rel=1e-12)


def test_stribeck_adds_its_slope_to_the_damping():
    """∂T/∂Φ' at Ω0 is −drop/decay exp(−Ω0/decay)."""
    point = OperatingPoint(5.1, 1.75, 14)
    plain = as_case(point).system().A0
    falling = as_case(point, paper_plant(bit=Stribeck(drop=40.0, decay=1.5))).system().A0
    change = falling - plain
    assert change[3, 3] == pytest.approx(40 / 1.5 * np.exp(-5.1 / 1.5), rel=1e-13)
    assert np.count_nonzero(change) == 1


def test_parameters_of_parts_are_parameters_of_the_case():
    case = as_case(OperatingPoint(10, 1.75, 14), PLANTS["stribeck"])
    assert case.parameters["drop"] == 20.0
    changed = case.with_changes(drop=3.0, psi=7.0)
    assert changed.parameters["drop"] == 3.0
    assert changed.point.lam == pytest.approx(0.7461 * 7.0)
    assert case.parameters["drop"] == 20.0
    table = case.table({"decay": np.array([1.0, 2.0]), "damping": 0.1}, 2)
    names = list(case.parameters)
    assert table[:, names.index("decay")].tolist() == [1.0, 2.0]
    assert table[0, names.index("xi")] == table[0, names.index("kappa")] == 0.1


def test_values_do_not_make_a_form_anew():
    """What is derived for a law is derived once, whatever its numbers are."""
    from drillctrl.drilling.linear import linearisation

    first = linearisation(paper_plant(bit=Stribeck(drop=1.0)))
    assert linearisation(paper_plant(bit=Stribeck(drop=2.0))) is first
    assert linearisation(paper_plant()) is not first


@pytest.mark.parametrize("name", PLANTS)
def test_plants_travel(name):
    case = as_case(RigPoint(table1(), 12.0, 4e-3), PLANTS[name])
    again = pickle.loads(pickle.dumps(case))
    assert again == case
    assert hash(again.plant) == hash(case.plant)
    assert (again.system().A0 == case.system().A0).all()


def test_a_bit_at_rest_hangs_on_the_string():
    """K q = what the load had borne, and what damping had: nothing accelerates."""
    case = as_case(OperatingPoint(10, 1.75, 14, kappa=0.1), PLANTS["collar"])
    arrays = case.motion()
    rest, after = rest_states(arrays, case.plant.state_names)
    assert (rest == after).all()
    assert rest[1::2].tolist() == [-17.5, -10.0, -10.0]
    rates = arrays.A @ rest - arrays.E @ arrays.steady
    assert np.abs(rates[1::2]).max() < 1e-10
    driven = as_case(case.point, PLANTS["drive"])
    with pytest.raises(InputError, match="nothing holds the string at its top"):
        rest_states(driven.motion(), driven.plant.state_names)


def test_gain_units_come_from_what_signals_measure():
    rig = table1()
    factors, names = gain_units(preset_structure("case2"), paper_plant(), rig)
    assert names == [["N·m/rad", "N·m·s/rad"]]
    assert factors[0] == pytest.approx([rig.torsional_stiffness,
                                        rig.torsional_stiffness * rig.time_scale])  # fmt: skip


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Stribeck(dorp=1.0), "parameter of Stribeck = dorp"),
        (lambda: Stribeck(drop=np.nan), "drop = nan"),
        (lambda: paper_plant(bit=TopDrive()), "bit = TopDrive: must be a BitRock"),
        (lambda: paper_plant(blocks=(TopDrive(), TopDrive())), "inertia_ratio"),
        (lambda: as_case("C"), "where = 'C'"),
        (lambda: as_case(OperatingPoint(1, 1, 1), 3), "plant = 3"),
        (lambda: as_case(OperatingPoint(1, 1, 1)).with_changes(drop=1.0), "parameter = drop"),
        (lambda: String({"theta": "angle"}, [[1]], [[1]], [[1]]), "x and theta first"),
        (
            lambda: as_case(OperatingPoint(1, 1, 1), paper_plant(string=lambda c: 3)).system(),
            "string = int",
        ),
        (lambda: Filtered("theta", 0.0), "time_constant = 0"),
        (lambda: as_case(as_case(OperatingPoint(1, 1, 1)).system()).motion(), "needs the physics"),
    ],
)
def test_what_does_not_fit_is_refused_in_one_line(make, message):
    with pytest.raises(InputError, match=message) as caught:
        make()
    assert "\n" not in str(caught.value)
