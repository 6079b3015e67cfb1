"""What the page shows that takes runs or a search: the motion, a map, gains within bounds."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.base.workers import cores, open_executor
from drillctrl.designs.design import design
from drillctrl.explorer.commands import command_line, own_units, python_text
from drillctrl.explorer.state import Asked, gain_scale
from drillctrl.explorer.views import Options, Tell, axis_text, read_axes
from drillctrl.simulation.outcome import figures
from drillctrl.simulation.report import simulation_fields, simulation_summary
from drillctrl.simulation.result import Simulation
from drillctrl.simulation.run import simulate
from drillctrl.simulation.starts import START_NAMES, start_named
from drillctrl.studies.vibration import vibration_map

_SAMPLES = 1500
# Seconds of wall time after which a motion that follows the hand is broken off.
PATIENCE = 5.0
_FEW_NODES, _MOST_NODES = 9, 40
# Columns of a motion, and what they are.
_SHOWN = {
    "bit_speed": "angular_rate",
    "penetration_rate": "axial_rate",
    "weight_on_bit": "force",
    "torque_on_bit": "torque",
    "control_torque": "torque",
}


def motion(asked: Asked, options: Options, tell: Tell) -> dict[str, Any]:
    """Return the nonlinear motion from a start; `simulate`.

    Options are ``duration`` (s with a rig), ``start`` and ``patient``: whether the run may take
    as long as it likes and is told in full.
    """
    patient = bool(options.get("patient"))
    seconds = checked_number("duration", options.get("duration"), 0.0, 1e5, open_low=True)
    start = options.get("start")
    if start not in START_NAMES:
        raise InputError("start", str(start)[:40], f"one of {', '.join(START_NAMES)}")
    length = seconds / asked.time_scale
    case, controller = asked.run()
    tell(0.0, seconds, "simulating")
    run = simulate(
        case,
        controller,
        duration=length,
        scenario=start_named(start).scenario(),
        time_limit=math.inf if patient else PATIENCE,
        progress=lambda time: tell(time * asked.time_scale, seconds, "simulating"),
    )
    times = np.linspace(0.0, float(run.times[-1]), _SAMPLES)
    found = figures(run)
    unit = "" if asked.rig is None else " s"
    lines = ["run = simulate_starts("]
    lines += [
        f"    {'case' if asked.law else 'point'}, controller, starts=[{start!r}], "
        f"duration={length!r}",
        ").runs[0].simulation",
        "print(run.summary)",
    ]
    uses = {"simulate_starts"}
    if asked.law is not None:
        uses.add("law_controller")
        lines.insert(0, "case, controller = law_controller(point, law)")
    else:
        uses.add("Controller")
        lines.insert(0, "controller = Controller(*gains) if gains else None")
    return {
        "sentence": found.outcome.sentence[:1].upper() + found.outcome.sentence[1:] + ".",
        "outcome": str(found.outcome),
        "columns": _columns(asked, run, times),
        "data": {**simulation_fields(run), "elapsed_seconds": None} if patient else None,
        "summary": simulation_summary(run) if patient else None,
        "command": command_line(
            asked, "simulate", "--start", start, "--duration", f"{seconds:g}{unit}"
        ),
        "python": python_text(asked, sorted(uses), *lines, closed=False),
    }


def _columns(asked: Asked, run: Simulation, times: Any) -> list[dict[str, Any]]:
    """Return what is drawn over time: name, unit and values of each column, times first."""
    if asked.rig is None:
        at = run.at(times)
        named = {"bit speed": run.point.omega0 + at.dtheta, "axial displacement": at.x,
                 "weight on bit": at.weight_on_bit, "torque on bit": at.torque_on_bit,
                 "control torque": at.torque}  # fmt: skip
        columns = [{"name": name, "unit": "", "values": values} for name, values in named.items()]
        return [{"name": "time", "unit": "", "values": times}, *columns]
    rig, told = run.in_rig_units(times * asked.time_scale), asked.language.units
    columns = [
        {"name": name.replace("_", " "), "unit": told[what].unit,
         "values": told[what].per_si * getattr(rig, name)}
        for name, what in _SHOWN.items()
    ]  # fmt: skip
    return [{"name": "time", "unit": "s", "values": rig.times}, *columns]


def vibrations(asked: Asked, options: Options, tell: Tell) -> dict[str, Any]:
    """Return how hard the bit vibrates over the chart's axes; `vibration_map`."""
    x, y = read_axes(asked, options)
    counts = options.get("counts")
    if not isinstance(counts, list) or len(counts) != 2:
        raise InputError("counts", "something else", "two numbers of points")
    across, up = (checked_integer("points", count, 2, _MOST_NODES) for count in counts)
    closing: Any = asked.law or asked.run()[1]
    tell(0, across * up * (1 if closing is None else 2), "simulating")
    # Processes of their own would take longer to start than a few points.
    with open_executor(cores() if across * up > _FEW_NODES else 1, None) as executor:
        found = vibration_map(
            asked.where,
            x,
            y,
            closing,
            counts=(across, up),
            refine=0,
            executor=executor,
            progress=lambda stage, done, total: tell(done, total, "simulating"),
        )
    severity = found.uncontrolled if found.controlled is None else found.controlled
    words = ["--x", axis_text(asked, x, across), "--y", axis_text(asked, y, up), "--refine", "0"]
    return {
        "points": found.points,
        "counts": [across, up],
        "outcomes": severity.outcomes,
        "swing": severity.swing,
        "data": {**found.to_dict(), "elapsed_seconds": None},
        "summary": found.summary(),
        "command": command_line(asked, "map", *words),
        "python": python_text(
            asked,
            ["vibration_map", *([] if asked.law else ["Controller"])],
            "controller = law"
            if asked.law
            else "controller = Controller(*gains) if gains else None",
            f"result = vibration_map(point, {x!r}, {y!r}, controller, counts={(across, up)!r},"
            " refine=0)",
            "print(result.summary())",
            closed=False,
        ),
    }


def gains(asked: Asked, options: Options, tell: Tell) -> dict[str, Any]:
    """Return the best gains within bounds; `design`.

    Options are ``bounds``: a pair for each free gain, in the order of the structure's names and
    in the window's units; and ``trials``.
    """
    if asked.structure is None:
        wanted = "p, case1, pd or case2; a law of a top drive follows from its rule"
        raise InputError("controller", asked.given.get("structure") or "none", wanted)
    structure = asked.structure
    names, given = structure.gain_names, options.get("bounds")
    if not isinstance(given, list) or len(given) != len(names):
        raise InputError("bounds", "something else", f"a pair for each of {', '.join(names)}")
    flat = [*gain_scale(structure, asked.where).ravel().tolist()] * 2
    free = [k for k, is_free in enumerate(structure.free) if is_free]
    bounds, words = {}, []
    for name, pair, k in zip(names, given, free, strict=True):
        if not isinstance(pair, list) or len(pair) != 2:
            raise InputError(f"bound of {name}", "something else", "two numbers")
        low, high = (checked_number(f"bound of {name}", v, -1e12, 1e12) for v in pair)
        bounds[name] = (low / flat[k], high / flat[k])
        unit = own_units(asked)[k % len(structure.outputs)]
        words += ["--bound", f"{name}={low!r}:{high!r} {unit}".rstrip()]
    tell(0, 0, "looking for gains")
    trials = bool(options.get("trials"))
    found = design(asked.case, structure, bounds=bounds, trials=trials)
    scale = gain_scale(structure, asked.where)
    line = command_line(asked, "design", "--structure", structure.name, *words,
                        *([] if trials else ["--trials", "none"]), controlled=False)  # fmt: skip
    return {
        "K1": (found.K1 * scale).ravel(),
        "K2": (found.K2 * scale).ravel(),
        "stable": found.stable,
        "recommended": found.recommended,
        "reason": found.reason,
        "data": {**found.to_dict(), "elapsed_seconds": None},
        "summary": found.summary(),
        "command": line,
        "python": python_text(
            asked,
            ["design"],
            f"result = design(point, gains[0], bounds={bounds!r}, trials={trials})",
            "print(result.summary())",
        ),
    }
