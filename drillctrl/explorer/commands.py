"""What the page shows as a command line and as Python, so that each view can be had without it."""

from __future__ import annotations

import shlex
from collections.abc import Sequence

from drillctrl.base.language import FIELD
from drillctrl.drilling.case import as_case
from drillctrl.drilling.gain_units import gain_units
from drillctrl.drilling.plant import top_drive_plant
from drillctrl.drilling.structures import soft_torque
from drillctrl.explorer.state import GROUPS, MOVED_LAWS, Asked, law_gains


def command_line(
    asked: Asked, verb: str, *options: str, controlled: bool = True, placed: bool = True
) -> str:
    """Return a command line that can be typed as it stands.

    Parameters
    ----------
    asked : Asked
        Where, and with which gains.
    verb : str
        Of drillctrl.
    *options : str
        Further words.
    controlled, placed : bool
        Whether the verb takes the controller, and where the rig drills.
    """
    where = ["--rig", file_name(asked), *units_words(asked)]
    if placed:
        where = _point_words(asked)
    words = ["drillctrl", verb, *where]
    if controlled:
        words += _controller_words(asked)
    return shlex.join([*words, *options])


def python_text(
    asked: Asked,
    uses: Sequence[str],
    *lines: str,
    modules: Sequence[str] = (),
    closed: bool = True,
) -> str:
    """Return a program.

    Parameters
    ----------
    asked : Asked
        Where, and with which gains.
    uses : sequence of str
        Names that the lines need from drillctrl. They find ``point`` and ``gains``, which is
        empty without control.
    *lines : str
        What is done with them.
    modules : sequence of str
        Others that they need.
    closed : bool
        Whether the law of a drive goes into ``point``; it is ``law`` anyway.
    """
    body, names = _point_lines(asked)
    if asked.law is not None:
        body.append(f"law = {_law_text(asked, names)}")
        if closed:
            names |= {"as_case", "driven_plant"}
            body.append("point = as_case(point, driven_plant(rig, law))")
    body.append(f"gains = {_gains_text(asked)}")
    head = ["from math import pi"] if asked.rig is not None else []
    head += [f"import {module}" for module in modules]
    imported = ", ".join(sorted(names | set(uses)))
    return "\n".join([*head, f"from drillctrl import {imported}", "", *body, *lines]) + "\n"


def file_name(asked: Asked) -> str:
    """Return what a command calls the rig: its preset, or the file that was opened."""
    return asked.rig_name or ""


def _point_words(asked: Asked) -> list[str]:
    given = asked.given
    if asked.rig is None:
        return [
            word for name in GROUPS if name in given for word in (f"--{name}", _number(given[name]))
        ]
    words = ["--rig", file_name(asked), "--speed", f"{_number(given['speed'])} rpm"]
    unit = asked.language.unit
    words += ["--rop", f"{_number(given['rop'])} {unit('axial_rate')}"]
    if "rock_strength" in given:
        words += ["--rock-strength", f"{_number(given['rock_strength'])} {unit('stress')}"]
    return [*words, *units_words(asked)]


def units_words(asked: Asked) -> list[str]:
    """Return what says the units on a command line, if they are not the usual ones."""
    return ["--units", "field"] if asked.language is FIELD else []


def _controller_words(asked: Asked) -> list[str]:
    given = asked.given
    if given.get("structure") is None:
        return []
    words = ["--structure", given["structure"]]
    for name in ("K1", "K2"):
        if given.get(name) is not None:
            units = own_units(asked)
            texts = [
                f"{_number(value)} {unit}".rstrip()
                for value, unit in zip(given[name], units, strict=True)
            ]
            # With = a leading minus is no option.
            words += [f"--{name}", ",".join(texts)]
    return words


def own_units(asked: Asked) -> list[str]:
    """Return the unit of each gain of one matrix."""
    structure, plant = soft_torque(), top_drive_plant(1.0)
    if asked.law is None:
        assert asked.structure is not None
        structure, (plant, _) = asked.structure, as_case(asked.where).physics("gains")
    if asked.rig is None:
        return [""] * len(structure.outputs)
    (units,) = gain_units(structure, plant, asked.rig)[1]
    return [asked.language.gain(unit).unit.replace("·", "*") for unit in units]


def _point_lines(asked: Asked) -> tuple[list[str], set[str]]:
    given = asked.given
    if asked.rig is None:
        groups = ", ".join(f"{name}={given[name]!r}" for name in GROUPS if name in given)
        return [f"point = OperatingPoint({groups})"], {"OperatingPoint"}
    lines = [f"rig = load_rig({file_name(asked)!r})"]
    if "rock_strength" in given:
        stress = asked.language.units["stress"].per_si
        lines.append(f"rig = rig.with_rock_strength({given['rock_strength']!r} / {stress:.16g})")
    rate = asked.language.units["axial_rate"].per_si
    place = f"{given['speed']!r} * pi / 30, {given['rop']!r} / {rate:.16g}"
    if asked.language is FIELD:
        place += ", units='field'"
    return [*lines, f"point = RigPoint(rig, {place})"], {"RigPoint", "load_rig"}


def _law_text(asked: Asked, names: set[str]) -> str:
    name, gains = asked.given["structure"], asked.given.get("K1")
    if gains is None or name not in MOVED_LAWS:
        names.add("drive_control")
        return f"drive_control({name!r}, rig)"
    names.add("pi_control")
    stiffness, damping = law_gains(gains, asked.language)
    return f"pi_control(rig.drive, {-damping!r}, {-stiffness!r}, name={name!r})"


def _gains_text(asked: Asked) -> str:
    if asked.structure is None or asked.K1 is None or asked.K2 is None:
        return "()"
    gains = [asked.K1.ravel().tolist(), asked.K2.ravel().tolist()]
    return f"({asked.structure.name!r}, {gains[0]!r}, {gains[1]!r})"


def _number(value: float) -> str:
    return repr(int(value)) if float(value).is_integer() and abs(value) < 1e15 else repr(value)
