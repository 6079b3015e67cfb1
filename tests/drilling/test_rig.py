import dataclasses
import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from drillctrl import InputError, OperatingPoint, RigPoint, load_rig, save_rig, table1
from drillctrl.drilling.steady import rig_point_at_weight_on_bit, steady_state

from ..strategies import points

positive = st.floats(0.1, 10.0)


@st.composite
def rigs(draw):
    base = table1()
    changes = {
        item.name: getattr(base, item.name) * draw(positive)
        for item in dataclasses.fields(base)
        if item.name != "blades"
    }
    return dataclasses.replace(base, **changes, blades=draw(st.integers(1, 10)))


def assert_same_rig_point(one, two):
    a, b = dataclasses.asdict(one), dataclasses.asdict(two)
    assert a.pop("rig") == pytest.approx(b.pop("rig"), rel=1e-12)
    assert a.pop("units") == b.pop("units")
    assert a == pytest.approx(b, rel=1e-12)


@given(rigs(), positive, positive)
def test_rig_to_point_to_rig_is_the_identity(rig, speed, rate):
    there = RigPoint(rig, speed, rate)
    assert_same_rig_point(there, RigPoint.from_operating_point(there.operating_point(), rig))


@given(points)
def test_point_to_rig_to_point_is_the_identity(point):
    back = RigPoint.from_operating_point(point, table1()).operating_point()
    assert dataclasses.asdict(back) == pytest.approx(dataclasses.asdict(point), rel=1e-12)


def test_table1_has_the_groups_that_were_computed_independently():
    rig = table1()
    point = RigPoint(rig, 10.0 / rig.time_scale, 0.01).operating_point()
    assert point.omega0 == pytest.approx(10.0)
    assert point.psi == pytest.approx(14.14, abs=5e-3)
    assert point.eta == pytest.approx(1.596, abs=5e-4)
    assert point.xi == pytest.approx(0.0506, abs=5e-5)
    assert point.kappa == pytest.approx(0.0499, abs=5e-5)
    assert point.lam == pytest.approx(10.55, abs=5e-3)
    assert point.beta == pytest.approx(0.2686, abs=5e-5)
    assert point.lam / point.psi == pytest.approx(0.7461, abs=5e-5)
    assert rig.time_scale == pytest.approx(0.352, abs=5e-4)
    assert rig.axial_scale == pytest.approx(2.68e-3, abs=5e-6)


def test_field_speeds_map_to_the_published_points():
    point = RigPoint(table1(), 120 * math.pi / 30, 20 / 3600).operating_point()
    assert (point.omega0, point.delta0) == pytest.approx((4.42, 0.165), abs=1e-2)


@given(rigs(), positive, positive)
def test_weight_on_bit_is_inverted(rig, speed, rate):
    there = RigPoint(rig, speed, rate * 1e-2)
    weight = steady_state(there).weight_on_bit
    back = rig_point_at_weight_on_bit(rig, speed, weight)
    assert steady_state(back).weight_on_bit == pytest.approx(weight, rel=1e-12)


def test_weight_below_the_wear_flat_is_refused():
    with pytest.raises(InputError, match="weight_on_bit = 7000"):
        rig_point_at_weight_on_bit(table1(), 10.0, 7000.0)


def test_steady_state_follows_the_closed_forms_of_the_paper():
    rig, speed, rate = table1(), 12.0, 5e-3
    steady = steady_state(RigPoint(rig, speed, rate))
    a, eps = rig.bit_radius, rig.rock_strength
    cut = 2 * math.pi * rate / speed
    flat = rig.contact_strength * a * rig.wearflat_length
    assert steady.depth_of_cut == pytest.approx(cut)
    assert steady.weight_on_bit == pytest.approx(eps * a * rig.cutter_inclination * cut + flat)
    assert steady.torque_on_bit == pytest.approx(
        eps * a**2 * cut / 2 + 0.5 * rig.friction_coefficient * a * flat
    )
    drag = rig.axial_damping * rate + steady.weight_on_bit - rig.submerged_weight
    assert steady.axial_offset == pytest.approx(-drag / rig.axial_stiffness)
    twist = rig.torsional_damping * speed + steady.torque_on_bit
    assert steady.angular_offset == pytest.approx(-twist / rig.torsional_stiffness)


@given(rigs())
def test_toml_round_trip_loses_nothing(tmp_path_factory, rig):
    path = tmp_path_factory.mktemp("rig") / "rig.toml"
    save_rig(rig, path)
    assert load_rig(path) == rig


def test_a_file_may_begin_with_a_mark_of_its_encoding(tmp_path):
    """As Windows writes them."""
    plain, marked = (tmp_path / name for name in ("plain.toml", "marked.toml"))
    save_rig(table1(), plain)
    marked.write_bytes(b"\xef\xbb\xbf" + plain.read_bytes())
    assert load_rig(marked) == load_rig(plain)


def test_a_bad_toml_file_is_refused_by_name(tmp_path):
    path = tmp_path / "rig.toml"
    save_rig(table1(), path)
    text = path.read_text()
    cases = {
        text.replace("mass =", "mas ="): "did you mean mass",
        text.replace('bit_radius = "0.108 m"\n', ""): "bit_radius",
        text.replace('"0.108 m"', '"0.108 kg"'): "must be a length",
        text.replace('"0.108 m"', "0.108"): "with its unit",
        text.replace('"34000.0 kg"', '"-1 t"'): r"mass in .*rig.toml = -1 t: .* in SI units",
        text.replace("blades = 4", "blades = 6.5"): r"blades in .*rig.toml = 6.5: must be a whole",
        text[:40]: "must be",
        "mass = ": "valid TOML",
    }
    for content, message in cases.items():
        path.write_text(content)
        with pytest.raises(InputError, match=message) as caught:
            load_rig(path)
        assert "\n" not in str(caught.value)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="UTF-8"):
        load_rig(path)
    with pytest.raises(InputError, match="table1"):
        load_rig(tmp_path / "none.toml")


@pytest.mark.parametrize(
    ("field", "value"),
    [("omega0", 0.0), ("omega0", math.nan), ("psi", -1.0), ("blades", 0), ("delta0", -0.1),
     ("blades", 2.5), ("xi", math.inf), ("eta", -1.0), ("omega0", True), ("psi", "14")],
)  # fmt: skip
def test_bad_groups_are_refused(field, value):
    good = {"omega0": 10.0, "delta0": 1.0, "psi": 14.0}
    with pytest.raises(InputError, match=f"^{field} = "):
        OperatingPoint(**{**good, field: value})


@given(points, st.floats(0.5, 2.0))
def test_lambda_keeps_its_ratio_when_the_rock_changes(point, factor):
    assume(point.psi > 0)
    other = point.with_changes(psi=factor * point.psi)
    assert other.lam / other.psi == pytest.approx(point.lam / point.psi)
