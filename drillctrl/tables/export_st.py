"""A table as an IEC 61131-3 Structured Text function block, and a program that tests it."""

from __future__ import annotations

import contextlib
import re
from pathlib import Path
from typing import Unpack

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.base.files import replacing
from drillctrl.base.templates import filled
from drillctrl.drilling.gain_units import rig_gain_units
from drillctrl.drilling.quantities import SI_UNITS
from drillctrl.tables.bench_st import bench_name, bench_text
from drillctrl.tables.gain_table import GainTable
from drillctrl.tables.plcopen import plcopen_text
from drillctrl.tables.recorded import RecordedMotion
from drillctrl.tables.reserved import is_identifier
from drillctrl.tables.sampled import SampledController, sampled_controller
from drillctrl.tables.settings import STATUS_BITS, Options
from drillctrl.tables.vectors import Vectors, vectors_of

# What the block declares, so that its own name is none of these.
_VARIABLES = """
    Measured Place DelayTime Enable TighterLimit ElapsedTime OtherCommand Command Vouched
    StatusBits PastSamples NewestSample ActiveSamples MissingSamples EqualSamples TrustSamples
    ReleaseSamples SampleSeen SampleGood SampleEqual SampleLate SampleLost SignalFrozen
    GainTrusted GoodSample GoodPlace GoodDelay TrustedGains PastValue LimitNow StartCommand
    WantedCommand RampShare LargestInput FadeSamples HoldSamples FrozenSamples FastestChange
    GainValues CellShare CellLow AxisIndex EntryIndex CellKind NodeIndex
    WholeSamples NearSample FarSample CornerWeight PartSample SamplesBack InsideTable
    SamplePeriod CommandLimit RampSamples RingDepth NodeGains CellGains
    CellKinds
"""
# A letter an axis.
LETTERS = "ABCDEFGH"
VARIABLES = frozenset(_VARIABLES.split()) | {
    f"{what}{letter}" for what in ("Corner", "Ticks") for letter in LETTERS
}
DIALECTS = (
    "IEC 61131-3, second edition, Structured Text without extensions of a vendor.",
    "Structured Control Language of Siemens (TIA Portal, S7-1500), as an external source.",
)


def export_st(
    table: GainTable,
    path: str | Path,
    *,
    period: float,
    limit: float,
    motion: FloatArray | RecordedMotion | None = None,
    **options: Unpack[Options],
) -> Path:
    """Write one function block: lookup, delay line, saturation, soft switch-on.

    The same law, units and behaviour as the C controller of `export_c`, in LREAL; call it once
    a sampling period. The block has the name of its file, so that several stand in one project.
    Beside it stand ``NAME.vectors.csv``, what goes in and what has to come out, and for .st
    ``NAME_bench.st``, a program that replays these and reports the largest deviation; an .xml
    holds both block and program.

    Parameters
    ----------
    table : GainTable
        Over dimensionless groups, or in rig units: then the lookup takes the grid's axes in SI.
    path : str or Path
        The file: ending in .xml for PLCopen XML (TC6), in .scl for the Structured Control Language
        of Siemens, else in .st.
    period : float
        Sampling period, dimensionless or s.
    limit : float
        Largest |u|, dimensionless or N·m.
    motion : array, (n, p), or RecordedMotion, optional
        Recorded outputs to replay, a row a sample; by default a motion is made up (`vectors_of`).
    **options
        Of `Options`: ramp, outside, fade, hold, watchdog, rate_limit, release.

    Raises
    ------
    InputError
        If a value is out of range, the file's name is none for a block, the structure drives
        more than one input, or it has no gains in rig units over a grid in rig units.
    """
    name, ending = Path(path).stem, Path(path).suffix.lower()
    check_st_name(name)
    controller = sampled_controller(table, name, period, limit, options)
    vectors = vectors_of(table, controller, motion)
    texts = {Path(path): _block(table, controller, scl=ending == ".scl")}
    if ending != ".scl":
        texts[Path(path).with_name(f"{bench_name(name)}.st")] = _bench(table, controller, vectors)
    if ending == ".xml":
        texts = {Path(path): plcopen_text(name, list(texts.values()))}
    texts[Path(path).with_suffix(".vectors.csv")] = vectors.csv(table)
    with contextlib.ExitStack() as stack:
        # All of them or none.
        for target, text in texts.items():
            stack.enter_context(replacing(target)).write(text.encode("utf-8"))
    return Path(path)


def _block(table: GainTable, controller: SampledController, scl: bool) -> str:
    settings = controller.settings
    structure, plant, rig = table.structure, table.grid.plant, table.grid.rig
    gain_units = rig_gain_units(structure, plant, rig)
    si = {name: SI_UNITS[plant.quantity(name)] for name in (*structure.outputs, *structure.inputs)}
    outputs = len(structure.outputs)
    sizes = dict(zip(LETTERS, map(len, controller.axes), strict=False))
    arrays = {
        f"Ticks{letter}": ticks for letter, ticks in zip(LETTERS, controller.axes, strict=False)
    }
    arrays["NodeGains"] = controller.node_gains
    # An array of no elements is not Structured Text.
    arrays["CellGains"] = controller.cell_gains or (0.0,)
    words = {
        **controller.words,
        **settings._asdict(),
        "outputs": outputs,
        "entries": 2 * outputs,
        "bits": STATUS_BITS,
        "fading": settings.fading,
        "ends": [[_number(value) for value in pair] for pair in controller.ends()],
        "scl": scl,
        "dialect_words": DIALECTS[scl],
        "sizes": sizes,
        "period": _number(settings.period),
        "limit": _number(settings.limit),
        "rate": "" if settings.rate is None else _number(settings.rate),
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
    text = filled("drillctrl.tables", "controller.st.j2", **words)
    return with_marks(text, VARIABLES) if scl else text


def _bench(table: GainTable, controller: SampledController, vectors: Vectors) -> str:
    name, structure, rig = str(controller.words["name"]), table.structure, table.grid.rig
    quantity = table.grid.plant.quantity(structure.inputs[0])
    unit = "in units of the torsional stiffness"
    columns = {
        "MotionValues": vectors.outputs,
        "MotionPlaces": vectors.places,
        "MotionDelays": vectors.delay,
        "MotionTimes": vectors.elapsed,
        "MotionOthers": vectors.other,
        "MotionLimits": vectors.limit,
        "MotionEnables": vectors.enable,
        "WantedCommands": vectors.command,
        "WantedVouched": vectors.vouched,
        "WantedStates": vectors.status,
    }
    return bench_text(
        name,
        columns,
        {"Measured": "MotionValues", "Place": "MotionPlaces"},
        {
            "DelayTime": "MotionDelays",
            "Enable": "MotionEnables",
            "TighterLimit": "MotionLimits",
            "ElapsedTime": "MotionTimes",
            "OtherCommand": "MotionOthers",
        },
        "Command",
        controller.settings.limit,
        unit if rig is None else SI_UNITS[quantity].replace("·", " "),
    )


def with_marks(text: str, variables: frozenset[str]) -> str:
    """Return a block with the mark # before each variable in its statements."""
    declared, body = text.split("\nBEGIN\n")
    return f"{declared}\nBEGIN\n" + re.sub(
        rf"\b({'|'.join(sorted(variables, key=len, reverse=True))})\b", r"#\1", body
    )


def check_st_name(name: str) -> None:
    """Raise `InputError` unless a function block may have a name."""
    if not (is_identifier(name) and is_identifier(bench_name(name))) or name.upper() in {
        word.upper() for word in VARIABLES
    }:
        permitted = "an identifier of at most 32 characters that is no word of Structured Text"
        raise InputError("name", name, f"{permitted} or its libraries, such as gain_table")


def _number(value: float) -> str:
    return f"{value:.17E}"
