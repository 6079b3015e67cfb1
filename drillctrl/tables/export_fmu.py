"""A table as a Functional Mock-up Unit: the C source, compiled here, without Python."""

from __future__ import annotations

import io
import os
import platform
import shutil
import subprocess
import sys
import tempfile
import uuid
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Unpack

from drillctrl.base.errors import InputError
from drillctrl.base.files import replacing
from drillctrl.base.templates import filled
from drillctrl.tables.export_c import check_c_name, export_c
from drillctrl.tables.fmu_description import (
    VERSIONS,
    Variable,
    build_description,
    description,
    source_files,
    variables,
    verdict,
)
from drillctrl.tables.gain_table import GainTable
from drillctrl.tables.sampled import sampled_controller
from drillctrl.tables.settings import Options

COMPILERS = ("cc", "gcc", "clang")
# System and machine → folder of the binary in FMI 2.0 and 3.0.
_FOLDERS = {
    ("linux", "x86_64"): ("linux64", "x86_64-linux"),
    ("linux", "aarch64"): ("aarch64-linux", "aarch64-linux"),
    ("darwin", "x86_64"): ("darwin64", "x86_64-darwin"),
    ("darwin", "arm64"): ("darwin64", "aarch64-darwin"),
    ("win32", "AMD64"): ("win64", "x86_64-windows"),
}
_ENDINGS = {"win32": ".dll", "darwin": ".dylib"}


def export_fmu(
    table: GainTable,
    path: str | Path,
    *,
    period: float,
    limit: float,
    fmi: str = "3.0",
    **options: Unpack[Options],
) -> Path:
    """Write a unit for co-simulation: description, sources, and a binary for this platform.

    The controller is that of `export_c` in double precision. A step of the host takes as many
    samples as periods fit in, which must be a whole number; ``u`` after a step is the command
    from its beginning on. Inputs are the outputs of the string, the coordinates of the table,
    the delay, ``other`` and ``enable``; ``limit`` is a parameter that may be tightened; ``vouched``
    and ``status`` say what the command is worth.

    Parameters
    ----------
    table : GainTable
        Over dimensionless groups, or in rig units: then all is SI.
    path : str or Path
        The file, ending in .fmu; its name is that of the model.
    period : float
        Sampling period, dimensionless or s.
    limit : float
        Largest |u|, dimensionless or N·m.
    fmi : {"3.0", "2.0"}
        Version of the standard.
    **options
        Of `Options`: ramp, outside, fade, hold, watchdog, rate_limit, release.

    Raises
    ------
    InputError
        As `export_c` does; if the version is none of these, the platform has no name in the
        standard, or there is no compiler (`COMPILERS`) on the path.
    """
    name = Path(path).stem
    check_fmu(name, fmi)
    controller = sampled_controller(table, name, period, limit, options)
    known = verdict(table, controller)
    told = " ".join(f"{what[0].upper()}{what[1:]}: {words}." for what, words in known[:3])
    outputs, axes = len(table.structure.outputs), len(controller.axes)
    place = 1 + outputs

    def source(folder: str) -> None:
        export_c(table, folder, name, period=period, limit=limit, **options)

    return write_fmu(
        path,
        fmi,
        source,
        variables(table, controller),
        known,
        text=f"Scheduled delayed output feedback. {told}",
        stamp=controller.stamp,
        period=controller.settings.period,
        arguments="&data->number[MEASURED], "
        f"&data->number[{place}u], data->number[{place + axes}u]",
        other_place=place + axes + 1,
    )


def write_fmu(
    path: str | Path,
    fmi: str,
    source: Callable[[str], object],
    listed: list[Variable],
    known: list[tuple[str, str]],
    *,
    text: str,
    stamp: str,
    period: float,
    arguments: str,
    other_place: int | None = None,
) -> Path:
    """Compile a controller's C source behind the functions of the standard, and pack all of it.

    Parameters
    ----------
    path : str or Path
        The file; its name is that of the model.
    fmi : str
        Version of the standard.
    source : callable
        Writes header and source of that name into a folder.
    listed, known, text
        As for `description`; after time and inputs come limit, period, command, switch, whether it
        is vouched for, and status.
    stamp : str
        No other controller's.
    period : float
        Sampling period.
    arguments : str
        Of a step in C, after the state and before the switch.
    other_place : int, optional
        Value reference of what was in control before, if the state has it.
    """
    name = Path(path).stem
    token = str(uuid.uuid5(uuid.NAMESPACE_OID, f"drillctrl {stamp} {fmi}"))
    with tempfile.TemporaryDirectory() as folder:
        source(folder)
        interface = Path(folder) / source_files(name)[1]
        interface.write_text(
            filled(
                "drillctrl.tables",
                "fmu.c.j2",
                name=name,
                token=token,
                version=fmi[0],
                period=f"{period:.17e}",
                limit_place=next(i for i, v in enumerate(listed) if v.name == "limit"),
                other_place=other_place,
                arguments=arguments,
                start=[v.start or "0.0" for v in listed if v.kind == "Float64"],
            ),
            encoding="ascii",
        )
        binary = _compiled(Path(folder), name)
        told = description(
            listed, known, name=name, text=text, period=period, version=fmi, token=token
        )
        files = {
            "modelDescription.xml": told.encode(),
            f"binaries/{_place(fmi)}/{binary.name}": binary.read_bytes(),
            **{
                f"sources/{file}": (Path(folder) / file).read_bytes()
                for file in (f"{name}.h", *source_files(name))
            },
        }
    if fmi == "3.0":
        files["sources/buildDescription.xml"] = build_description(name).encode()
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w", zipfile.ZIP_DEFLATED) as archive:
        for file, data in files.items():
            # The same table makes the same bytes, whatever the time of day.
            entry = zipfile.ZipInfo(file, (1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, data)
    with replacing(path) as target:
        target.write(content.getvalue())
    return Path(path)


def check_fmu(name: str, fmi: str) -> None:
    """Raise `InputError` unless a unit of a name and version can be made here."""
    check_c_name(name)
    if fmi not in VERSIONS:
        raise InputError("fmi", fmi, f"one of {', '.join(VERSIONS)}")
    _place(fmi)
    _compiler()


def _place(fmi: str) -> str:
    """Return the folder of the binary."""
    machine = sys.platform, platform.machine()
    if machine not in _FOLDERS:
        raise InputError("fmi", fmi, f"made on one of {', '.join(map('/'.join, _FOLDERS))}")
    return _FOLDERS[machine][fmi == "3.0"]


def _compiler() -> str:
    found = (os.environ.get("CC"), *COMPILERS)
    for name in found:
        where = name and shutil.which(name)
        if where:
            return where
    raise InputError("fmi", "a unit", f"made where a C compiler is: {', '.join(COMPILERS)}")


def _compiled(folder: Path, name: str) -> Path:
    binary = folder / f"{name}{_ENDINGS.get(sys.platform, '.so')}"
    # Products and sums are not fused, so that all platforms give the same bits.
    flags = ["-std=c99", "-O2", "-ffp-contract=off", "-fvisibility=hidden", "-shared"]
    if sys.platform != "win32":
        flags.append("-fPIC")
    command = [_compiler(), *flags, "-o", binary.name, *source_files(name)]
    run = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if run.returncode != 0:
        reason = " ".join(run.stderr.split())[:300]
        raise InputError("fmi", command[0], f"a compiler that makes a shared library ({reason})")
    return binary
