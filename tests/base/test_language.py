"""Units that results are told in, against pint's."""

import pytest

from drillctrl import InputError
from drillctrl.base.language import DIMENSIONLESS, FIELD, SI, language_named
from drillctrl.base.units import (
    ANGLE,
    DAMPING,
    DENSITY,
    FORCE,
    INERTIA,
    LENGTH,
    LINEAR_DENSITY,
    MASS,
    RATE,
    ROTARY_SPEED,
    SPEED,
    STIFFNESS,
    STRESS,
    TIME,
    TORQUE,
    TORSIONAL_DAMPING,
    TORSIONAL_STIFFNESS,
    to_si,
)

DIMENSIONS = {
    "angle": ANGLE, "angular_rate": ROTARY_SPEED, "time": TIME, "rate": RATE, "length": LENGTH,
    "depth": LENGTH, "axial_rate": SPEED, "force": FORCE, "torque": TORQUE, "stress": STRESS,
    "impedance": TORSIONAL_DAMPING, "drive_impedance": TORSIONAL_DAMPING,
    "drive_stiffness": TORSIONAL_STIFFNESS, "torsional_stiffness": TORSIONAL_STIFFNESS,
    "axial_stiffness": STIFFNESS, "axial_damping": DAMPING, "mass": MASS, "inertia": INERTIA,
    "density": DENSITY, "linear_density": LINEAR_DENSITY,
}  # fmt: skip


@pytest.mark.parametrize("language", [SI, FIELD], ids=lambda language: language.name)
def test_what_is_told_is_read_as_the_same(language):
    # "t" and "klb" are weights to a rig and masses to pint, which has no klb.
    spelled = {"kft·lbf": "1000*ft*lbf", "kft·lbf·s/rad": "1000*ft*lbf*s/rad", "klb": "1000*lb",
               "kft·lbf/rad": "1000*ft*lbf/rad", "klbf·s/ft": "1000*lbf*s/ft"}  # fmt: skip
    for quantity, dimension in DIMENSIONS.items():
        unit = language.unit(quantity)
        thousand = unit in spelled
        plain = spelled[unit].removeprefix("1000*") if thousand else unit.replace("²", "^2")
        plain = plain.replace("³", "^3").replace("·", "*")
        given = language.number(quantity, 7.5) * (1e3 if thousand else 1.0)
        assert to_si("x", f"{given!r} {plain}", dimension) == pytest.approx(7.5, rel=1e-12), unit
    assert set(language.units) - set(DIMENSIONS) == {"number", "frequency"}


def test_a_language_is_that_of_what_was_given():
    assert language_named(None, with_rig=True) is SI
    assert language_named(None, with_rig=False) is DIMENSIONLESS
    assert language_named("dimensionless", with_rig=True) is DIMENSIONLESS
    for name, with_rig in (("field", False), ("si", False), ("metric", True)):
        with pytest.raises(InputError, match="units"):
            language_named(name, with_rig=with_rig)
