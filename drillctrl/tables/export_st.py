"""A table as an IEC 61131-3 Structured Text function block."""

from __future__ import annotations

from pathlib import Path

from drillctrl.base.errors import InputError
from drillctrl.base.files import write_text
from drillctrl.base.templates import filled
from drillctrl.drilling.gain_units import rig_gain_units
from drillctrl.drilling.quantities import SI_UNITS
from drillctrl.tables.gain_table import GainTable
from drillctrl.tables.reserved import is_identifier
from drillctrl.tables.sampled import sampled_controller

# What the block declares, so that its own name is none of these.
_VARIABLES = """
    Measured Place DelayTime Enable Command Vouched PastSamples NewestSample ActiveSamples
    GainValues CellShare CellLow AxisIndex EntryIndex CornerA CornerB CornerC CellKind NodeIndex
    WholeSamples NearSample FarSample CornerWeight PartSample SamplesBack InsideTable
    SamplePeriod CommandLimit RampSamples RingDepth TicksA TicksB TicksC NodeGains CellGains
    CellKinds
"""
VARIABLES = frozenset(_VARIABLES.split())


def export_st(
    table: GainTable,
    path: str | Path,
    *,
    period: float,
    limit: float,
    ramp: int | None = None,
) -> Path:
    """Write one function block: lookup, delay line, saturation, soft switch-on.

    The same law, units and behaviour as the C controller of `export_c`, in LREAL; call it once
    a sampling period. The block has the name of its file, so that several stand in one project.

    Parameters
    ----------
    table : GainTable
        Over dimensionless groups, or in rig units: then the lookup takes the grid's axes in SI.
    path : str or Path
        The file, ending in .st.
    period : float
        Sampling period, dimensionless or s.
    limit : float
        Largest |u|, dimensionless or N·m.
    ramp : int, optional
        Samples of the switch-on, 0 for none; by default as many as the longest delay has.

    Raises
    ------
    InputError
        If a value is out of range, the file's name is none for a block, the structure drives
        more than one input, or it has no gains in rig units over a grid in rig units.
    """
    name = Path(path).stem
    check_st_name(name)
    controller = sampled_controller(table, name, period, limit, ramp)
    structure, plant, rig = table.structure, table.grid.plant, table.grid.rig
    gain_units = rig_gain_units(structure, plant, rig)
    si = {name: SI_UNITS[plant.quantity(name)] for name in (*structure.outputs, *structure.inputs)}
    outputs, depth = len(structure.outputs), int(controller.words["depth"])
    sizes = dict(zip("ABC", map(len, controller.axes), strict=True))
    arrays = {f"Ticks{letter}": ticks for letter, ticks in zip("ABC", controller.axes, strict=True)}
    arrays["NodeGains"] = controller.node_gains
    # An array of no elements is not Structured Text.
    arrays["CellGains"] = controller.cell_gains or (0.0,)
    words = controller.words | {
        "outputs": outputs,
        "entries": 2 * outputs,
        "depth": depth,
        "sizes": sizes,
        "period": _number(controller.period),
        "limit": _number(controller.limit),
        "reference": controller.reference,
        "arrays": {label: [_number(v) for v in values] for label, values in arrays.items()},
        "cell_mode": controller.cell_mode,
        "time_unit": "s" if rig else "in units of time",
        "command_unit": si[structure.inputs[0]].replace("·", " ")
        if rig
        else "in units of the torsional stiffness",
        "measured_units": ", ".join(
            f"{output} in {si[output]}" if rig else output for output in structure.outputs
        ),
        "gain_units": ", ".join(unit for _, unit in gain_units[:outputs])
        if gain_units
        else "dimensionless",
    }
    write_text(path, filled("drillctrl.tables", "controller.st.j2", **words))
    return Path(path)


def check_st_name(name: str) -> None:
    """Raise `InputError` unless a function block may have a name."""
    if not is_identifier(name) or name.upper() in {word.upper() for word in VARIABLES}:
        permitted = "an identifier of at most 32 characters that is no word of Structured Text"
        raise InputError("name", name, f"{permitted} or its libraries, such as gain_table")


def _number(value: float) -> str:
    return f"{value:.17E}"
