"""The modelDescription of a controller's Functional Mock-up Unit."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple
from xml.etree import ElementTree

from drillctrl.base.language import SI
from drillctrl.drilling.quantities import SI_UNITS
from drillctrl.tables.gain_table import GainTable
from drillctrl.tables.interpolation import UNSAFE
from drillctrl.tables.sampled import SampledController
from drillctrl.tables.settings import STATUS_BITS

VERSIONS = ("3.0", "2.0")
# SI unit → powers of base units, and what people on rigs read with how many are one of it.
_UNITS: dict[str, tuple[dict[str, int], tuple[str, float] | None]] = {
    "m": ({"m": 1}, SI.units["length"]),
    "m/s": ({"m": 1, "s": -1}, SI.units["axial_rate"]),
    "rad": ({"rad": 1}, None),
    "rad/s": ({"rad": 1, "s": -1}, SI.units["angular_rate"]),
    "N": ({"kg": 1, "m": 1, "s": -2}, SI.units["force"]),
    "N.m": ({"kg": 1, "m": 2, "s": -2}, ("kN.m", 1e-3)),
    "Pa": ({"kg": 1, "m": -1, "s": -2}, ("MPa", 1e-6)),
    "s": ({"s": 1}, None),
    "kg/m3": ({"kg": 1, "m": -3}, None),
}


class Variable(NamedTuple):
    """A variable of the unit.

    Attributes
    ----------
    name, kind : str
        ``"Float64"``, ``"Boolean"`` or ``"Int32"``.
    causality, variability : str
        As in FMI.
    start : str
        Value before the first step, empty for none.
    text : str
        What it is.
    unit : str
        SI, empty for a plain number.
    low, high : float, optional
        Valid range.
    """

    name: str
    kind: str
    causality: str
    variability: str
    start: str
    text: str
    unit: str = ""
    low: float | None = None
    high: float | None = None


def variables(table: GainTable, controller: SampledController) -> list[Variable]:
    """Return the variables in the order of their value references."""
    structure, plant, rig = table.structure, table.grid.plant, table.grid.rig
    settings = controller.settings

    def unit(name: str) -> str:
        return "" if rig is None else SI_UNITS[plant.quantity(name)].replace("·", ".")

    time, torque = "" if rig is None else "s", unit(structure.inputs[0])
    least = min(point.delay for point in table.grid.points) * (rig.time_scale if rig else 1.0)
    most = max(point.delay for point in table.grid.points) * (rig.time_scale if rig else 1.0)
    limit = settings.limit
    found = [Variable("time", "Float64", "independent", "continuous", "", "Time", time)]
    for name in structure.outputs:
        text = f"{name}, as a perturbation from steady drilling"
        found.append(Variable(name, "Float64", "input", "discrete", "0.0", text, unit(name)))
    for axis, ticks, (low, high) in zip(
        table.grid.axes, controller.axes, controller.ends(), strict=True
    ):
        text = "coordinate of the table, which vouches for nothing beyond its valid range"
        start = repr(float(ticks[0]))
        which = "" if axis.unit == "1" else axis.unit
        found.append(
            Variable(axis.name, "Float64", "input", "discrete", start, text, which, low, high)
        )
    text = str(controller.words["delay"])
    add = found.append
    add(Variable("delay", "Float64", "input", "discrete", repr(most), text, time, least, most))
    text = "u of what was in control before it is enabled, where its ramp begins"
    add(Variable("other", "Float64", "input", "discrete", "0.0", text, torque, -limit, limit))
    text = "largest magnitude of u"
    start = repr(limit)
    add(Variable("limit", "Float64", "parameter", "tunable", start, text, torque, 0.0, limit))
    text = "sampling period: a step takes a whole number of these"
    start = repr(settings.period)
    add(Variable("period", "Float64", "local", "constant", start, text, time))
    text = str(controller.words["law"])
    add(Variable("u", "Float64", "output", "discrete", "0.0", text, torque, -limit, limit))
    add(Variable("enable", "Boolean", "input", "discrete", "false", "whether it is switched on"))
    text = "whether the table vouches for the gains"
    add(Variable("vouched", "Boolean", "output", "discrete", "false", text))
    text = "sum of " + "; ".join(f"{value}: {words}" for _, value, words in STATUS_BITS)
    add(Variable("status", "Int32", "output", "discrete", "0", text, "", 0, 255))
    return found


def verdict(table: GainTable, controller: SampledController) -> list[tuple[str, str]]:
    """Return what is known of a table, by words."""
    words, cells = controller.words, table.cells.mode
    return [
        ("trials", str(words["trials"])),
        ("nodes", f"{int(table.sound.sum())} of {len(table.gains)} vouched for"),
        ("cells", f"{int((cells != UNSAFE).sum())} of {cells.size} vouched for"),
        ("worst abscissa in them", f"{table.worst_abscissa}"),
        ("bounds", str(words["bounds"])),
        ("sampling", str(words["sampling"])),
        ("care", " ".join(words["care"])),
        ("reference", " ".join(controller.reference)),
        ("table", f"SHA-256 {words['checksum']}"),
    ]


def description(
    listed: list[Variable],
    known: list[tuple[str, str]],
    *,
    name: str,
    text: str,
    period: float,
    version: str,
    token: str,
) -> str:
    """Return the text of modelDescription.xml, FMI 2.0 or 3.0, for co-simulation.

    Parameters
    ----------
    listed : list of Variable
        In the order of their value references.
    known : list of (str, str)
        What is known of the controller, by words.
    name, text : str
        Of the model.
    period : float
        Sampling period.
    version : str
        Of the standard.
    token : str
        That of the binary.
    """
    newer = version == "3.0"
    root = ElementTree.Element(
        "fmiModelDescription",
        {
            "fmiVersion": version,
            "modelName": name,
            "instantiationToken" if newer else "guid": token,
            "description": text,
            "generationTool": "drillctrl",
            **({} if newer else {"variableNamingConvention": "flat"}),
        },
    )
    abilities = {"modelIdentifier": name, "canHandleVariableCommunicationStepSize": "true"}
    if newer:
        abilities["fixedInternalStepSize"] = repr(period)
        abilities |= {"canGetAndSetFMUState": "true", "canSerializeFMUState": "true"}
    else:
        abilities |= {"canGetAndSetFMUstate": "true", "canSerializeFMUstate": "true"}
        abilities["canNotUseMemoryManagementFunctions"] = "true"
    simulation = ElementTree.SubElement(root, "CoSimulation", abilities)
    if not newer:
        files = ElementTree.SubElement(simulation, "SourceFiles")
        for file in source_files(name):
            ElementTree.SubElement(files, "File", name=file)
    _add_units(root, {variable.unit for variable in listed} - {""})
    notes = [f"{what}: {words}" for what, words in known]
    experiment = {"startTime": "0.0", "stepSize": repr(period)}
    ElementTree.SubElement(root, "DefaultExperiment", experiment)
    if not newer:
        notes_in = ElementTree.SubElement(root, "VendorAnnotations")
        tool = ElementTree.SubElement(notes_in, "Tool", name="drillctrl")
        ElementTree.SubElement(tool, "Verdict").text = "\n".join(notes)
    places = ElementTree.SubElement(root, "ModelVariables")
    for reference, variable in enumerate(listed):
        places.append((_newer if newer else _older)(variable, reference))
    structure = ElementTree.SubElement(root, "ModelStructure")
    outputs = [i for i, variable in enumerate(listed) if variable.causality == "output"]
    if newer:
        for reference in outputs:
            ElementTree.SubElement(structure, "Output", valueReference=str(reference))
        notes_in = ElementTree.SubElement(root, "Annotations")
        note = ElementTree.SubElement(notes_in, "Annotation", type="drillctrl.verdict")
        note.text = "\n".join(notes)
    else:
        unknowns = ElementTree.SubElement(structure, "Outputs")
        for reference in outputs:
            ElementTree.SubElement(unknowns, "Unknown", index=str(reference + 1))
    return _text(root)


def build_description(name: str) -> str:
    """Return the text of sources/buildDescription.xml of FMI 3.0."""
    root = ElementTree.Element("fmiBuildDescription", fmiVersion="3.0")
    configuration = ElementTree.SubElement(root, "BuildConfiguration", modelIdentifier=name)
    files = ElementTree.SubElement(configuration, "SourceFileSet", language="C99")
    for file in source_files(name):
        ElementTree.SubElement(files, "SourceFile", name=file)
    return _text(root)


def source_files(name: str) -> tuple[str, str]:
    """Return the names of the files to compile."""
    return f"{name}.c", f"{name}_fmu.c"


def _add_units(root: ElementTree.Element, units: set[str]) -> None:
    if not units:
        return
    places = ElementTree.SubElement(root, "UnitDefinitions")
    for unit in sorted(units):
        powers, shown = _UNITS[unit]
        place = ElementTree.SubElement(places, "Unit", name=unit)
        ElementTree.SubElement(place, "BaseUnit", {k: str(v) for k, v in powers.items()})
        if shown is not None:
            ElementTree.SubElement(place, "DisplayUnit", name=shown[0], factor=repr(shown[1]))


def _shown(variable: Variable) -> Iterator[tuple[str, str]]:
    if variable.unit:
        yield "unit", variable.unit
        field = _UNITS[variable.unit][1]
        if field is not None:
            yield "displayUnit", field[0]
    for what, value in (("min", variable.low), ("max", variable.high)):
        if value is not None:
            yield what, repr(value)
    if variable.start:
        yield "start", variable.start


def _newer(variable: Variable, reference: int) -> ElementTree.Element:
    given = {
        "name": variable.name,
        "valueReference": str(reference),
        "causality": variable.causality,
        "variability": variable.variability,
        "description": variable.text,
        **dict(_shown(variable)),
    }
    if variable.causality == "output":
        given["initial"] = "exact"
    return ElementTree.Element(variable.kind, given)


def _older(variable: Variable, reference: int) -> ElementTree.Element:
    given = {
        "name": variable.name,
        "valueReference": str(reference),
        "causality": variable.causality,
        "variability": variable.variability,
        "description": variable.text,
    }
    if variable.causality == "output":
        given["initial"] = "exact"
    place = ElementTree.Element("ScalarVariable", given)
    kind = {"Float64": "Real", "Boolean": "Boolean", "Int32": "Integer"}[variable.kind]
    ElementTree.SubElement(place, kind, dict(_shown(variable)))
    return place


def _text(root: ElementTree.Element) -> str:
    ElementTree.indent(root)
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + ElementTree.tostring(root, "unicode") + "\n"
