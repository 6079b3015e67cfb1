"""What the page shows of a point: each view is computed by the function that a program calls."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.errors import InputError, checked_number
from drillctrl.charts.chains import stable_strips
from drillctrl.charts.chart import StabilityChart, chart
from drillctrl.delay.closing import close_loop
from drillctrl.delay.system import DelaySystem
from drillctrl.designs.design import analyze
from drillctrl.drilling.quantities import root_scales
from drillctrl.explorer.commands import command_line, python_text
from drillctrl.explorer.state import Asked, designed_law
from drillctrl.robustness.transfer import frequency_grid, loop_transfer
from drillctrl.spectrum.pseudospectral import approximate_roots, degree_for
from drillctrl.strings.drive_measures import BAND
from drillctrl.strings.rig import StringRig
from drillctrl.strings.slopes import mode_slopes

# Done, to do (0 where nobody knows), and what is being done.
Tell = Callable[[float, float, str], None]
Options = Mapping[str, Any]

_MOST_ROOTS = 16
_MOST_POINTS = 1200
_MANY_STATES, _RESONANCES = 50, 24
# How far from 0 a Nyquist curve is drawn, and how far apart its points may be.
_SEEN, _STEP = 3.0, 0.08
_BESIDE = ("stiff", "soft-torque", "z-torque")
_MODES = 3


def roots(asked: Asked, options: Options, tell: Tell) -> dict[str, Any]:
    """Return whether the point is stable, with its roots; `analyze`.

    With the option ``rough`` they are those of a collocation, which are there at once and
    neither sharpened nor counted.
    """
    (rate, real, per), (turn, imaginary, cycles) = root_scales(asked.rig)
    structure, *gains = asked.feedback or (None,)
    case = asked.case
    loops = {"without control": case.system(structure.inputs)} if structure else {}
    own = close_loop(loops["without control"], structure, *gains) if structure else case.system()
    loops[asked.given.get("structure") or "without control"] = own
    series = []
    for name, system in loops.items():
        # The time of a sketch goes into these; the degree is for the fastest of many elements.
        sketched = options.get("rough") and system.order >= _MANY_STATES
        degree = max(1, degree_for(system) // 2) if sketched else 2 * degree_for(system)
        found = approximate_roots(system, degree)[:_MOST_ROOTS]
        found = found[found.real > found.real[0] - 12.0]
        series.append({"name": name, "x": rate * found.real, "y": turn * found.imag})
    drawn: dict[str, Any] = {
        "series": series,
        "x": {"label": real, "unit": per},
        "y": {"label": imaginary, "unit": cycles},
        "command": command_line(asked, "analyze"),
        "python": python_text(
            asked,
            ["analyze"],
            "result = analyze(point, *gains)",
            "print(result.summary())",
        ),
    }
    if options.get("rough"):
        top = complex(found[0])
        sentence = _sentence(asked, top.real, abs(top.imag), top.real < 0.0)
        drawn |= {"rough": True, "stable": top.real < 0.0, "rightmost": rate * top.real}
        return {**drawn, "sentence": f"{sentence[:-1]}; being checked …"}
    result = analyze(case, *asked.feedback)
    dominant = result.loop.dominant_roots
    beat = abs(dominant[0].imag) if dominant else 0.0
    return {
        **drawn,
        "sentence": _sentence(asked, result.spectral_abscissa, beat, result.stable),
        "stable": result.stable,
        "rightmost": rate * result.spectral_abscissa,
        "data": {**result.to_dict(), "elapsed_seconds": None},
        "summary": result.summary(),
    }


def _sentence(asked: Asked, abscissa: float, beat: float, stable: bool) -> str:
    """Return the answer first: whether vibrations die away, how fast, at which frequency."""
    (rate, _, per), (turn, _, cycles) = root_scales(asked.rig)
    alpha, beat = rate * abscissa, turn * beat
    at = f" at {beat:.3g} {cycles or 'of angular frequency'}" if beat else ""
    unit = " s" if per else ""
    if stable:
        return f"Stable: a vibration{at} falls to 2 % in {math.log(50.0) / -alpha:.3g}{unit}."
    if alpha <= 0.0:
        return "Undecided: roots and their count do not agree."
    return f"Unstable: a vibration{at} doubles every {math.log(2.0) / alpha:.3g}{unit}."


def nyquist(asked: Asked, options: Options, tell: Tell) -> dict[str, Any]:
    """Return the loop broken at the plant's input; `loop_transfer`."""
    if asked.structure is None:
        wanted = "gains at the bit (p, case1, pd or case2): a loop that can be broken"
        raise InputError("controller", asked.given.get("structure") or "none", wanted)
    structure, K1, K2 = asked.feedback
    plant = asked.case.system(structure.inputs)

    def broken(omega: FloatArray) -> Any:
        return loop_transfer(plant, structure, K1, K2, omega)

    omega, values = _drawn(plant, broken)
    keep = np.isfinite(values)
    values, omega = values[keep], omega[keep]
    turn, _, cycles = root_scales(asked.rig)[1]
    return {
        "omega": omega,
        "frequency": turn * omega,
        "unit": cycles,
        "real": values.real,
        "imag": values.imag,
        "distance": float(np.abs(1.0 + values).min()),
        "command": command_line(asked, "analyze"),
        "python": python_text(
            asked,
            ["loop_transfer", "plant_system", "preset_structure"],
            f"omega = numpy.geomspace({float(omega[0])!r}, {float(omega[-1])!r}, 1000)",
            "structure = preset_structure(gains[0])",
            "L = loop_transfer(plant_system(point), structure, *gains[1:], omega)[0, 0]",
            "print(abs(1 + L).min())",
            modules=["numpy"],
        ),
    }


def _drawn(
    plant: DelaySystem, broken: Callable[[FloatArray], ComplexArray]
) -> tuple[FloatArray, ComplexArray]:
    """Return frequencies and values that draw a Nyquist curve.

    Those of a string begin about its resonances, and come closer only where the curve is seen.
    """
    if plant.order < _MANY_STATES:
        omega = frequency_grid(plant, response=broken)
        omega = omega[:: max(1, omega.size // _MOST_POINTS)]
        return omega, broken(omega)[0, 0]
    poles = approximate_roots(plant)
    poles = poles[poles.imag > 0.0]
    poles = poles[np.argsort(poles.imag)][:_RESONANCES]
    turned = np.tan(np.radians(np.linspace(-80.0, 80.0, 7)))
    near = poles.imag[:, None] + abs(poles.real)[:, None] * turned
    between = np.geomspace(1e-2, 1e3, 200) * poles.imag[0]
    omega = np.union1d(between, near[near > 0.0])
    values = broken(omega)[0, 0]
    while omega.size < _MOST_POINTS:
        seen = np.minimum(abs(values[1:]), abs(values[:-1])) < _SEEN
        coarse = np.flatnonzero(seen & (abs(np.diff(values)) > _STEP))
        if not coarse.size:
            break
        middle = np.sqrt(omega[coarse] * omega[coarse + 1])
        values = np.insert(values, coarse + 1, broken(middle)[0, 0])
        omega = np.insert(omega, coarse + 1, middle)
    return omega, values


def reflection(asked: Asked, options: Options, tell: Tell) -> dict[str, Any]:
    """Return what the drive returns of a torsional wave, beside usual laws; `compare_drives`."""
    rig = asked.rig
    if asked.law is None or not isinstance(rig, StringRig):
        raise InputError("rig", asked.rig_name or "none", "a string with a top drive")
    frequencies = np.geomspace(*BAND, 200)
    s = 2j * math.pi * frequencies
    pipe = rig.string.torsion.wave_impedance
    laws = {asked.law.name: asked.law}
    for name in _BESIDE:
        if name != asked.given["structure"]:
            try:
                laws[name] = designed_law(name, rig)
            except InputError:
                # Not every drive can follow every rule.
                continue
    slopes = mode_slopes(rig.string.torsion, asked.law, _MODES)
    names = ",".join([asked.given["structure"], *(name for name in laws if name != asked.law.name)])
    return {
        "frequency": frequencies,
        "series": [
            {"name": name, "magnitude": np.abs(law.reflection(s, pipe))}
            for name, law in laws.items()
        ],
        "modes": [slope.mode_frequency for slope in slopes],
        "critical_slopes": [slope.slope for slope in slopes],
        "command": command_line(
            asked, "compare", "--structures", names, controlled=False, placed=False
        ),
        "python": python_text(
            asked,
            [],
            "f = numpy.geomspace(0.05, 5, 200)",
            "r = law.reflection(2j * pi * f, rig.string.torsion.wave_impedance)",
            "print(abs(r))",
            modules=["numpy"],
        ),
    }


def stability(asked: Asked, options: Options, tell: Tell) -> dict[str, Any]:
    """Return where drilling is stable over speed and rate of penetration; `chart`."""
    x, y = read_axes(asked, options)
    found: StabilityChart = chart(asked.case, x, y, *asked.feedback, tolerance=2e-3)
    names = ("--x", "--y")
    words = [w for o, a in zip(names, (x, y), strict=True) for w in (o, axis_text(asked, a))]
    fields = {**found.to_dict(), "elapsed_seconds": None}
    return {
        "strips": stable_strips(found.lines, rows=found.rows),
        "curves": [curve.points for curve in found.curves],
        "closed": [curve.closed for curve in found.curves],
        "data": fields,
        "command": command_line(asked, "chart", *words),
        "python": python_text(
            asked,
            ["chart"],
            f"result = chart(point, {x!r}, {y!r}, *gains)",
            "print(result.summary())",
        ),
    }


def axis_names(asked: Asked) -> tuple[str, str]:
    """Return what charts and maps of the page are over."""
    return ("omega0", "delta0") if asked.rig is None else ("speed", "rop")


def read_axes(asked: Asked, options: Options) -> tuple[tuple[str, float, float], ...]:
    """Return the axes that the page asks for."""
    axes = []
    for key, name in zip(("x", "y"), axis_names(asked), strict=True):
        given = options.get(key)
        if not isinstance(given, list) or len(given) != 2:
            raise InputError(f"axis {key}", "something else", "two limits")
        low, high = (checked_number(f"limit of {name}", v, 0.0, 1e6) for v in given)
        axes.append((name, low, high))
    return tuple(axes)


def axis_text(asked: Asked, axis: tuple[str, float, float], count: int | None = None) -> str:
    """Return an axis as the command line takes it."""
    name, low, high = axis
    quantity = {"speed": "angular_rate", "rop": "axial_rate"}.get(name)
    unit = "" if quantity is None else f" {asked.language.unit(quantity)}"
    return f"{name}={low:g}:{high:g}{'' if count is None else f':{count}'}{unit}"
