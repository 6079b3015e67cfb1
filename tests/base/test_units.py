import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drillctrl.base import units
from drillctrl.base.errors import InputError

EXPECTED = [
    ("120 rpm", units.ROTARY_SPEED, 4 * math.pi),
    ("120 RPM", units.ROTARY_SPEED, 4 * math.pi),
    ("2 rev/s", units.ROTARY_SPEED, 4 * math.pi),
    ("3.6 m/h", units.SPEED, 1e-3),
    ("3.6 m/hr", units.SPEED, 1e-3),
    ("100 ft/h", units.SPEED, 30.48 / 3600),
    ("20 kN", units.FORCE, 2e4),
    ("1 klbf", units.FORCE, 4448.2216152605),
    ("5 kN*m", units.TORQUE, 5e3),
    ("5 kNm", units.TORQUE, 5e3),
    ("5 kN·m", units.TORQUE, 5e3),
    ("1000 ft*lbf", units.TORQUE, 1355.8179483314),
    ("1000 ft-lbf", units.TORQUE, 1355.8179483314),
    ("1 kft·lbf", units.TORQUE, 1355.8179483314),
    ("4.25 in", units.LENGTH, 0.10795),
    ("60 MPa", units.STRESS, 6e7),
    ("1000 psi", units.STRESS, 6894757.293168),
    ("938 N*m/rad", units.TORSIONAL_STIFFNESS, 938.0),
    ("116 kg*m^2", units.INERTIA, 116.0),
    ("0.6", units.NUMBER, 0.6),
    ("10 t", units.FORCE, 98066.5),
    ("10 tonne", units.FORCE, 98066.5),
    ("34 tonne", units.MASS, 34000.0),
    ("2 short_ton", units.MASS, 1814.36948),
    ("22 klbs", units.FORCE, 97860.87553573),
    ("22 klb", units.FORCE, 97860.87553573),
    ("500 lb", units.MASS, 226.796185),
    ("500 kg", units.FORCE, 4903.325),
    ("1000 ft-lb", units.TORQUE, 1355.8179483314),
    ("1000 lbf-ft", units.TORQUE, 1355.8179483314),
    ("1 kft-lbs", units.TORQUE, 1355.8179483314),
    ("5 kN.m", units.TORQUE, 5e3),
    ("120 1/min", units.ROTARY_SPEED, 4 * math.pi),
    ("120 min^-1", units.ROTARY_SPEED, 4 * math.pi),
    ("100 fph", units.SPEED, 30.48 / 3600),
    ("12 1/4 in", units.LENGTH, 0.31115),
    ("12-1/4 in", units.LENGTH, 0.31115),
    ('8 1/2"', units.LENGTH, 0.2159),
    ("3/4 in", units.LENGTH, 0.01905),
    ("1.2 sg", units.DENSITY, 1200.0),
    ("0.1 1/s", units.RATE, 0.1),
    ("100 lb/in", units.STIFFNESS, 100 * 4.4482216152605 / 0.0254),
]


@pytest.mark.parametrize(("text", "dimension", "value"), EXPECTED)
def test_units_of_the_field_are_understood(text, dimension, value):
    assert units.to_si("x", text, dimension) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize("dimension", units._TYPED_MOST, ids=lambda dimension: dimension.name)
def test_the_units_typed_most_are_what_pint_makes_of_them(dimension):
    for unit, value in units._TYPED_MOST[dimension].items():
        assert units._converted(7.0, unit, dimension) == pytest.approx(7.0 * value, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "dimension"),
    [
        ("12 kg", units.ROTARY_SPEED),
        ("2 Hz", units.ROTARY_SPEED),
        ("120", units.ROTARY_SPEED),
        ("20 kn", units.FORCE),
        ("3 kg", units.TORQUE),
        ("12 1/0 in", units.LENGTH),
        ("12 1/4 kN", units.FORCE),
        ("30 bbl", units.LENGTH),
        ("", units.SPEED),
        ("fast", units.SPEED),
        ("nan rpm", units.ROTARY_SPEED),
        ("1 s)", units.TIME),
        ("1e400 m/h", units.SPEED),
        ("9**9**9**9 m/s", units.SPEED),
        ("2 m**9**9**9", units.LENGTH),
        ("__import__('os')", units.SPEED),
        ("1 m" + "/s" * 100, units.SPEED),
    ],
)
def test_what_is_no_such_quantity_is_refused(text, dimension):
    with pytest.raises(InputError, match="^x = "):
        units.to_si("x", text, dimension)


@pytest.mark.parametrize(
    ("text", "dimension", "readings"),
    [
        ("34 ton", units.MASS, ("tonne", "short_ton")),
        ("10 tons", units.FORCE, ("tonne", "short_ton")),
        ("20 mph", units.SPEED, ("m/h", "mile/h")),
        ("22 Mlbs", units.FORCE, ("thousand", "million")),
    ],
)
def test_what_drillers_read_in_two_ways_is_refused_with_both(text, dimension, readings):
    with pytest.raises(InputError) as error:
        units.to_si("x", text, dimension)
    assert text in str(error.value)
    assert all(reading in str(error.value) for reading in readings)


@given(st.floats(1e-6, 1e6))
def test_display_units_come_back(value):
    shown = units.from_si(value, units.ROTARY_SPEED, "rpm")
    assert units.to_si("x", f"{shown!r} rpm", units.ROTARY_SPEED) == pytest.approx(value)


@pytest.mark.long
@given(st.text(max_size=30))
def test_any_text_is_either_a_number_or_an_input_error(text):
    try:
        assert math.isfinite(units.to_si("x", text, units.LENGTH))
    except InputError as error:
        assert "\n" not in str(error)
