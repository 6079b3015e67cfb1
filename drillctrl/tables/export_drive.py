"""The law of a top drive as source for its controller: C, Structured Text, FMU."""

from __future__ import annotations

import contextlib
import itertools
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any

from drillctrl.base.errors import InputError
from drillctrl.base.files import replacing
from drillctrl.base.kinds import checks_kinds
from drillctrl.base.templates import filled
from drillctrl.strings.drive_sampled import DRIVE_AXES, DRIVE_BITS, SampledDrive
from drillctrl.tables.bench_st import bench_name, bench_text
from drillctrl.tables.drive_arithmetic import drive_worst_cost, float_words, in_float
from drillctrl.tables.drive_vectors import DriveVectors, drive_vectors
from drillctrl.tables.export_c import check_c_header, check_c_name, check_real
from drillctrl.tables.export_fmu import check_fmu, write_fmu
from drillctrl.tables.export_st import DIALECTS, with_marks
from drillctrl.tables.fmu_description import Variable
from drillctrl.tables.plcopen import plcopen_text
from drillctrl.tables.reserved import is_identifier

ENDINGS = (".c", ".st", ".scl", ".xml", ".fmu")
NOT_ASKED = "none: no string was asked whether this law does it harm"
# What the block declares, so that its own name is none of these.
_VARIABLES = """
    MeasuredSpeed WantedSpeed GivenTorque StringDepth RotarySpeed RockStrength MudDensity
    Enable TighterLimit ElapsedTime
    TorqueCommand Vouched StatusBits LawStates MovedStates GoodSpeed GoodWanted GoodTorque
    GoodDepth GoodRotary GoodStrength GoodDensity
    SlowSpeed SlowTorque SpeedBefore ErrorBefore SpeedError PipeTorque LawValue
    ValueBefore LawIntegral IntegralChange StartTorque WantedTorque HeldTorque BeyondTorque
    LimitNow RampShare SumOfStates LawNow LawBefore RowIndex EntryIndex ActiveSamples
    MissingSamples EqualSamples TrustSamples ReleaseSamples SampleSeen SampleGood SampleEqual
    SampleLost SampleLate SignalFrozen SignalTrusted TorqueFollowed SamplePeriod TorqueLimit
    MostIntegral LargestSpeed LargestGiven
    LargestTorque SpeedToTorque SpeedKept SpeedTaken TorqueKept TorqueTaken
    RampSamples FadeSamples HoldSamples FrozenSamples
    FastestChange LawEdges AtRest ByInput ByState FromInput FromState IntegralGain
"""
VARIABLES = frozenset(_VARIABLES.split())
# Of each axis what it is called in Structured Text, and the last good one.
_WORDS = {
    "depth": ("StringDepth", "GoodDepth"),
    "rotary_speed": ("RotarySpeed", "GoodRotary"),
    "rock_strength": ("RockStrength", "GoodStrength"),
    "mud": ("MudDensity", "GoodDensity"),
}


@checks_kinds
def export_drive(
    law: SampledDrive,
    path: str | Path,
    *,
    fmi: str = "3.0",
    real: str = "double",
    verdict: str = NOT_ASKED,
) -> Path:
    """Write the law of a top drive as source for its controller.

    All languages compute what `SteppedDrive` does: the law by the trapezoidal rule, an integral
    that neither winds up at the limits of torque and rate nor bumps when the law takes over, from
    others or from that of another place, and a torque that falls where signals are lost or frozen.
    Beside a function block stand ``NAME.vectors.csv``, samples that go in and what has to come
    out, and for .st ``NAME_bench.st``, a program that replays them; an .xml holds both.

    Parameters
    ----------
    law : SampledDrive
        Of `sampled_drive`.
    path : str or Path
        The file: ``.c`` (with ``.h``), ``.st`` (IEC 61131-3), ``.scl`` (Siemens), ``.xml``
        (PLCopen) or ``.fmu`` (for co-simulation); its name is that of function, block or model.
    fmi : {"3.0", "2.0"}
        Version of the standard of an .fmu.
    real : {"double", "float"}
        Arithmetic of a .c; the header says by how much float differs at most.
    verdict : str
        What was found of the law, which stands in what is written; see `sampled_slopes`.

    Raises
    ------
    InputError
        If the ending or the name is none of these, or there is a ``NAME.h`` of someone else's.
    OSError
        If a file cannot be written.
    """
    check_drive_path(path, fmi)
    check_real(real)
    where = Path(path)
    if real != "double" and where.suffix.lower() != ".c":
        raise InputError("real", real, "double but in a .c")
    ending = where.suffix.lower()
    if ending == ".c":
        _write_c(law, where.parent, where.stem, verdict, real)
    elif ending == ".fmu":
        _write_fmu(law, where, fmi, verdict)
    else:
        text = filled(
            "drillctrl.tables",
            "drive.st.j2",
            **_words(law, where.stem, "{:.17E}", verdict),
            scl=ending == ".scl",
            dialect_words=DIALECTS[ending == ".scl"],
        )
        if ending == ".scl":
            text = with_marks(text, VARIABLES)
        vectors = drive_vectors(law)
        texts = {where: text}
        if ending != ".scl":
            bench = where.with_name(f"{bench_name(where.stem)}.st")
            texts[bench] = _bench(law, where.stem, vectors)
        if ending == ".xml":
            texts = {where: plcopen_text(where.stem, list(texts.values()))}
        texts[where.with_suffix(".vectors.csv")] = vectors.csv()
        with contextlib.ExitStack() as stack:
            # All of them or none.
            for target, written in texts.items():
                stack.enter_context(replacing(target)).write(written.encode("utf-8"))
    return where


def check_drive_path(path: str | Path, fmi: str = "3.0") -> None:
    """Raise `InputError` unless the law of a drive can be written under a name."""
    where = Path(path)
    ending = where.suffix.lower()
    if ending not in ENDINGS:
        raise InputError("out", str(path), f"a file that ends in {', '.join(ENDINGS)}")
    if ending == ".c":
        check_c_name(where.stem)
        check_c_header(where.with_suffix(".h"))
    elif ending == ".fmu":
        check_fmu(where.stem, fmi)
    elif not all(
        map(is_identifier, (where.stem, bench_name(where.stem)))
    ) or where.stem.upper() in {v.upper() for v in VARIABLES}:
        wanted = "an identifier of at most 32 characters that is no word of Structured Text"
        raise InputError("name", where.stem, f"{wanted} or its libraries, such as soft_torque")


def _bench(law: SampledDrive, name: str, vectors: DriveVectors) -> str:
    targets = ["MeasuredSpeed", "WantedSpeed", "GivenTorque", *(_WORDS[n][0] for n, _ in law.axes)]
    inputs = {target: f"Motion{target}" for target in targets}
    columns = {
        **dict(zip(inputs.values(), vectors.inputs.T, strict=True)),
        "MotionEnables": vectors.enable,
        "MotionLimits": vectors.limit,
        "MotionTimes": vectors.elapsed,
        "WantedCommands": vectors.command,
        "WantedVouched": vectors.vouched,
        "WantedStates": vectors.status,
    }
    given = {
        "Enable": "MotionEnables",
        "TighterLimit": "MotionLimits",
        "ElapsedTime": "MotionTimes",
    }
    return bench_text(name, columns, {}, {**inputs, **given}, "TorqueCommand", law.limit, "N m")


def _write_c(
    law: SampledDrive, folder: str | Path, name: str, verdict: str, real: str = "double"
) -> None:
    words = _words(law, name, "{:.17e}" if real == "double" else "{:.9e}", verdict)
    words["rounding"] = float_words(law) if real == "float" else []
    labels = {
        "LawEdges": "edges", "AtRest": "at_rest", "ByInput": "by_input", "ByState": "by_state",
        "FromInput": "from_input", "FromState": "from_state", "IntegralGain": "gain",
    }  # fmt: skip
    words["arrays"] = {labels[label]: values for label, values in words["arrays"].items()}
    with contextlib.ExitStack() as stack:
        for template in ("drive.h.j2", "drive.c.j2"):
            target = Path(folder) / f"{name}.{template.split('.')[1]}"
            text = filled("drillctrl.tables", template, **words)
            text = text if real == "double" else in_float(text)
            stack.enter_context(replacing(target)).write(text.encode("ascii"))


def _words(law: SampledDrive, name: str, form: str, verdict: str) -> dict[str, Any]:
    """Return what the templates name; numbers in the form of the language."""
    number = form.format
    arrays = {
        # An array of no elements is not Structured Text.
        **({"LawEdges": [edge for edges in law.edges for edge in edges]} if any(law.edges) else {}),
        "AtRest": [v for node in law.nodes for v in node.E.ravel().tolist()],
        "ByInput": [v for node in law.nodes for v in node.D.tolist()],
        "ByState": [v for node in law.nodes for v in node.C.tolist()],
        "FromInput": [v for node in law.nodes for v in node.G.ravel().tolist()],
        "FromState": [v for node in law.nodes for v in node.F.ravel().tolist()],
        "IntegralGain": [node.K for node in law.nodes],
    }
    stiff, kept, new, held = law.filters
    return {
        "name": name,
        "law": drive_words(law),
        "care": _care(law),
        "verdict": textwrap.wrap(_plain(verdict), 76),
        "costs": drive_worst_cost(law),
        "period_s": law.period,
        "limit_nm": law.limit,
        "period": number(law.period),
        "limit": number(law.limit),
        "most": number(law.most),
        "axes": _axes(law, number),
        "largest": [number(value) for value in law.largest],
        "filters": [number(value) for value in (stiff, kept, new, held, 1.0 - held)],
        "rate": "" if law.rate is None else number(law.rate),
        "order": law.order,
        "laws": len(law.nodes),
        "integrates": law.integrates,
        "bits": DRIVE_BITS,
        "fading": ("LOST", "FROZEN") if law.watched else ("LOST",),
        "stamp": law.stamp,
        "arrays": {label: [number(value) for value in values] for label, values in arrays.items()},
        **{name: getattr(law, name) for name in ("ramp", "fade", "hold", "frozen", "release")},
    }


def _axes(law: SampledDrive, number: Callable[[float], str]) -> list[dict[str, Any]]:
    """Return what the templates name of each axis."""
    found, offset = [], 0
    for k, ((name, values), (low, high)) in enumerate(zip(law.axes, law.ends, strict=True)):
        unit, most, told = DRIVE_AXES[name]
        word, good = _WORDS[name]
        found.append(
            {
                **{"name": name, "word": word, "good": good, "unit": unit, "told": told},
                **{"count": len(values), "offset": offset, "input": 3 + k},
                **{"low": number(low), "high": number(high), "largest": number(most)},
            }
        )
        offset += len(values) - 1
    return found


def drive_words(law: SampledDrive) -> list[str]:
    """Say in lines what the law is, at each place, in ASCII."""
    lines = [f"{law.name}, on a drive of {law.machine.inertia:g} kg m2"]
    varying = [
        [f"{value:g} {DRIVE_AXES[name][0]}" if len(values) > 1 else "" for value in values]
        for name, values in law.axes
    ]
    for at, words in zip(itertools.product(*varying), law.words, strict=True):
        place = ", ".join(filter(None, at))
        place += ": " if place else ""
        lines += textwrap.wrap(place + _plain(words), 76)
    return lines


def _plain(words: str) -> str:
    plain = words.replace("·", " ").replace("²", "2").replace("−", "-")
    return plain.encode("ascii", "replace").decode()


def _care(law: SampledDrive) -> list[str]:
    lost = f"the torque falls to 0 over {law.fade} samples"
    text = [
        f"{law.hold} samples that are none, or beyond {law.largest[0]:g} rad/s or "
        f"{law.largest[2]:g} N m, in a row are replaced by the last good one, then "
        f"{lost}.",
        f"{law.frozen} equal speeds in a row: {lost if law.watched else 'reported'}.",
        "The integral takes only what a limit lets through, and starts from "
        "the torque that the drive gives.",
    ]
    if law.rate is not None:
        text.append(f"The torque changes by at most {law.rate:g} N m a sample.")
    if law.release:
        text.append(f"Switched off, it falls to 0 over {law.release} samples.")
    return textwrap.wrap(" ".join(text), 76)


def _write_fmu(law: SampledDrive, path: Path, fmi: str, verdict: str) -> None:
    limit = law.limit
    status = "sum of " + "; ".join(f"{value}: {words}" for _, value, words in DRIVE_BITS)

    def given(name: str, text: str, unit: str, start: str = "0.0", **more: Any) -> Variable:
        return Variable(name, "Float64", "input", "discrete", start, text, unit, **more)

    listed = [
        Variable("time", "Float64", "independent", "continuous", "", "Time", "s"),
        given("speed", "measured speed of the drive", "rad/s"),
        given("set_point", "speed that is wanted", "rad/s"),
        given("torque", "what the drive gave since the last sample", "N.m"),
        *(
            given(name, f"{DRIVE_AXES[name][2]}, which picks the law", DRIVE_AXES[name][0],
                  repr(values[0]), **({"low": low, "high": high} if len(values) > 1 else {}))
            for (name, values), (low, high) in zip(law.axes, law.ends, strict=True)
        ),
        Variable("limit", "Float64", "parameter", "tunable", repr(limit),
                 "largest magnitude of the torque", "N.m", 0.0, limit),
        Variable("period", "Float64", "local", "constant", repr(law.period),
                 "sampling period: a step takes a whole number of these", "s"),
        Variable("u", "Float64", "output", "discrete", "0.0", "torque of the drive", "N.m",
                 -limit, limit),
        Variable("enable", "Boolean", "input", "discrete", "false", "whether it is switched on"),
        Variable("vouched", "Boolean", "output", "discrete", "false",
                 "whether there is a law for the place"),
        Variable("status", "Int32", "output", "discrete", "0", status, "", 0, 255),
    ]  # fmt: skip
    words = " ".join(drive_words(law))
    write_fmu(
        path,
        fmi,
        lambda folder: _write_c(law, folder, path.stem, verdict),
        listed,
        [
            ("law", words),
            ("method", "trapezoidal rule"),
            ("care", " ".join(_care(law))),
            ("verdict", _plain(verdict)),
        ],
        text=f"Control of a top drive. Verdict: {_plain(verdict)}. Law: {words}.",
        stamp=law.stamp,
        period=law.period,
        arguments=", ".join(f"data->number[{i}u]" for i in range(1, 4 + len(law.axes))),
    )
