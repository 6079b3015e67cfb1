"""The rig as a recording says it is: a file that `load_rig` reads, with its uncertainty."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from drillctrl.base import units
from drillctrl.base.errors import InputError
from drillctrl.base.files import write_text
from drillctrl.base.kinds import checks_kinds
from drillctrl.drilling.rig import Rig
from drillctrl.records.families import damping_of, line_of
from drillctrl.records.fit_values import RecordFit
from drillctrl.strings.drill_string import DrillString
from drillctrl.strings.rig import StringRig, string_rig
from drillctrl.strings.saving import section_texts

_BIT_AND_ROCK = (
    *("rock_strength", "contact_strength", "bit_radius", "wearflat_length"),
    *("cutter_inclination", "friction_coefficient", "bit_geometry", "blades"),
)


@checks_kinds
def fitted_rig(rig: Rig, fit: RecordFit) -> Rig:
    """Return a rig whose string is as stiff, heavy and damped in torsion as a fit found it.

    Stiffness enters through the shear modulus, inertia through the weight per metre, so axial
    inertia follows it. Damping that the record does not tell stays the rig's.

    Parameters
    ----------
    rig : Rig
        That was fitted.
    fit : RecordFit
        Of `fit_record` with this rig.

    Raises
    ------
    InputError
        If the fit was made without a rig, or the record does not say what the string is.
    """
    if not isinstance(rig, Rig):
        raise InputError("rig", type(rig).__name__, "a Rig")
    if not isinstance(fit, RecordFit):
        raise InputError("fit", type(fit).__name__, "a RecordFit")
    if fit.factors is None:
        raise InputError("fit", "made without a rig", "of a rig")
    if not fit.identifiable:
        raise InputError("fit", "no string", f"one that the record tells ({fit.reasons[0]})")
    stiffer, heavier = fit.factors
    damping = fit.damping.value if fit.damping.seen else damping_of(line_of(rig))
    if not isinstance(rig, StringRig):
        inertia = heavier * rig.inertia
        return replace(
            rig,
            torsional_stiffness=stiffer * rig.torsional_stiffness,
            inertia=inertia,
            torsional_damping=damping * inertia,
        )
    sections = tuple(
        replace(
            section,
            weight=heavier * section.mass_per_metre,
            material=replace(section.material, shear=stiffer * section.material.shear),
        )
        for section in rig.string.sections
    )
    string = replace(
        rig.string, sections=sections, damping=replace(rig.string.damping, torsional=damping)
    )
    return string_rig(
        string, drive=rig.drive, **{name: getattr(rig, name) for name in _BIT_AND_ROCK}
    )


@checks_kinds
def save_fit(rig: Rig, fit: RecordFit, path: str | Path) -> None:
    """Write the fitted rig as a TOML file, with what is known of it in a table ``[fit]``.

    `load_rig` reads it; worst-case design takes the relative errors there as its box.

    Parameters
    ----------
    rig : Rig
        That was fitted.
    fit : RecordFit
        Of `fit_record` with this rig.
    path : str or Path
        Ends in .toml.

    Raises
    ------
    InputError
        As `fitted_rig`, or if the file does not end in .toml.
    OSError
        If the file cannot be written; an existing one is then left as it was.
    """
    import tomli_w

    made = fitted_rig(rig, fit)
    if Path(path).suffix.lower() != ".toml":
        raise InputError("path", str(path), "a file that ends in .toml")
    data = _string_data(made) if isinstance(made, StringRig) else _lumped_data(made)
    errors = {
        name: {"low": e.low, "high": e.high, "error": min(e.relative, 0.9)}
        for name in ("stiffness", "inertia", "damping", "level", "drop", "decay", "lag")
        for e in (getattr(fit, name),)
        if e.seen
    }
    data["fit"] = {
        "stiffness": fit.stiffness.value,
        "inertia": fit.inertia.value,
        **({"damping": fit.damping.value} if fit.damping.seen else {}),
        "bit_law": fit.law._asdict(),
        "uncertainty": errors,
    }
    write_text(path, tomli_w.dumps(data))


def _lumped_data(rig: Rig) -> dict[str, Any]:
    data: dict[str, Any] = {"blades": rig.blades}
    for item in fields(Rig):
        dimension = item.metadata.get("dimension")
        if dimension is not None:
            value = getattr(rig, item.name)
            data[item.name] = f"{value!r} {dimension.unit}" if dimension.unit else value
    return data


def _string_data(rig: StringRig) -> dict[str, Any]:
    string: DrillString = rig.string

    def told(value: float, dimension: units.Dimension) -> str:
        return f"{float(value)!r} {dimension.unit}"

    data: dict[str, Any] = {
        "sections": [section_texts(section) for section in string.sections],
        "bit": {
            "diameter": told(2.0 * rig.bit_radius, units.LENGTH),
            "blades": rig.blades,
            "wearflat_length": told(rig.wearflat_length, units.LENGTH),
            "cutter_inclination": rig.cutter_inclination,
            "friction_coefficient": rig.friction_coefficient,
            "geometry": rig.bit_geometry,
        },
        "rock": {
            "strength": told(rig.rock_strength, units.STRESS),
            "contact_strength": told(rig.contact_strength, units.STRESS),
        },
        "damping": {
            "torsional": string.damping.torsional,
            "axial": string.damping.axial,
            "kelvin_voigt": string.damping.retardation,
        },
        "mud": {"density": told(string.mud_density, units.DENSITY)},
    }
    drive = rig.drive
    if drive is not None:
        data["top_drive"] = {"inertia": told(drive.inertia, units.INERTIA)}
        if drive.torque_limit is not None:
            data["top_drive"]["torque_limit"] = told(drive.torque_limit, units.TORQUE)
        for name in ("delay", "lag", "encoder", "torque_filter"):
            data["top_drive"][name] = told(getattr(drive, name), units.TIME)
        if drive.encoder_counts is not None:
            data["top_drive"]["encoder_counts"] = drive.encoder_counts
    if string.hoisting_stiffness is not None:
        data["hoisting"] = {"stiffness": told(string.hoisting_stiffness, units.STIFFNESS)}
    return data
