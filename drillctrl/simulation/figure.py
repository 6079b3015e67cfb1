"""Figures of simulated motions. Each takes matplotlib Axes, or makes them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from drillctrl.base.errors import InputError
from drillctrl.base.figure import (
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    axis_name,
    headline,
    new_axes,
    new_figure,
)
from drillctrl.drilling.quantities import told_scale
from drillctrl.simulation.rock_face import rock_face
from drillctrl.simulation.trace import Trace

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from drillctrl.drilling.case import Case

# Column of the motion → its name, its symbol, and what it measures.
SIGNALS = {
    "x": ("bit displacement", "x", "length"),
    "dx": ("axial rate of the bit", "x'", "axial_rate"),
    "theta": ("bit angle", "θ", "angle"),
    "dtheta": ("bit speed from steady", "θ'", "angular_rate"),
    "bit_speed": ("bit speed", "ω0 + θ'", "angular_rate"),
    "depth": ("depth of cut", "", "length"),
    "delay": ("delay", "τ", "time"),
    "weight_on_bit": ("weight on bit", "", "force"),
    "torque_on_bit": ("torque on bit", "", "torque"),
    "axial": ("axial control", "", "force"),
    "torque": ("control torque", "u", "torque"),
    "drive": ("torque of the drive", "u", "torque"),
}
PLANES = {"torsion": ("theta", "dtheta"), "axial": ("x", "dx")}
_SHADES = (
    ("stuck", "torsional stick", GREY, 0.3),
    ("lost", "off the rock", "#56B4E9", 0.25),
    ("saturated", "control at a limit", "#E69F00", 0.25),
)
_PER_STEP = 5


class Scale(NamedTuple):
    """How a column of the motion is drawn.

    Attributes
    ----------
    factor : float
        Units that are drawn in one dimensionless unit.
    label : str
        Of the axis.
    """

    factor: float
    label: str


def scale_of(case: Case, name: str) -> Scale:
    """Return how a column of the motion, or ``time``, is drawn: in a rig's units if there is one.

    States that are not the bit's are drawn as they are.
    """
    words, symbol, quantity = {**SIGNALS, "time": ("time", "t", "time")}.get(
        name, (name, "", "number")
    )
    factor, unit = told_scale(quantity, case.told_rig, case.language)
    return Scale(factor, axis_name(words if unit else f"{words} {symbol}".rstrip(), unit))


def plot_motion(run: Trace, inputs: Sequence[str] = (), title: str | None = None) -> Figure:
    """Draw axial motion, bit speed and control over time; see `plot_signal`.

    Parameters
    ----------
    run : Trace
        Of `simulate`.
    inputs : sequence of str
        Those that a controller drives.
    title : str, optional
        By default it names model and place.
    """
    names = ["x", "bit_speed"]
    names += [name for name in run.input_names if name in inputs]
    figure = new_figure(7.2, 1.9 * len(names) + 0.8)
    axes = figure.subplots(len(names), 1, sharex=True)
    for ax, name in zip(axes, names, strict=True):
        plot_signal(run, name, ax)
        ax.set_xlabel("")
        # Panels are low: a long label would run into the next one's.
        ax.set_ylabel(headline(ax.get_ylabel(), 24))
    handles, labels = axes[0].get_legend_handles_labels()
    if handles:
        # Curves and shading leave no corner free.
        figure.legend(handles, labels, loc="outside lower center", ncols=4, fontsize="small")
    axes[-1].set_xlabel(scale_of(run.case, "time").label)
    axes[0].set_title(headline(title or title_of(run), 80), fontsize="medium")
    return figure


def plot_signal(run: Trace, name: str = "x", ax: Axes | None = None) -> Axes:
    """Draw one signal over time, with what the bit and the controller are stopped by shaded.

    Parameters
    ----------
    run : Trace
        Of `simulate`.
    name : str
        A column of the motion, or ``bit_speed``.
    ax : Axes, optional
        By default new ones.
    """
    values, times = _signal(run, name)
    unit = scale_of(run.case, "time").factor
    ax = new_axes(7.2, 2.8) if ax is None else ax
    for phase, label, colour, alpha in _SHADES:
        for i, (start, end) in enumerate(run.phases(phase) if run.model == "nonlinear" else ()):
            told = label if i == 0 else None
            ax.axvspan(unit * start, unit * end, color=colour, alpha=alpha, linewidth=0, label=told)
    colour = ORANGE if name in run.input_names else BLUE
    ax.plot(times, values, color=colour, linewidth=0.9)
    ax.set_xlabel(scale_of(run.case, "time").label)
    ax.set_ylabel(scale_of(run.case, name).label)
    ax.margins(x=0)
    return ax


def plot_phase_portrait(
    run: Trace,
    plane: str = "torsion",
    ax: Axes | None = None,
    since: float = 0.0,
    title: str | None = None,
) -> Axes:
    """Draw the motion in a plane of states, with what was before ``since`` thin and grey.

    Parameters
    ----------
    run : Trace
        Of `simulate`.
    plane : {"torsion", "axial"}
        θ' over θ, or x' over x.
    ax : Axes, optional
        By default new ones.
    since : float
        Such as the dimensionless time from which an orbit is closed.
    title : str, optional
        By default it names model and place.
    """
    if plane not in PLANES:
        raise InputError("plane", plane, f"one of {', '.join(PLANES)}")
    across, up = PLANES[plane]
    ax = new_axes(5.2, 4.4) if ax is None else ax
    motion = run.on_steps(_PER_STEP)
    early = motion.times <= since
    right, high = scale_of(run.case, across), scale_of(run.case, up)
    x, y = right.factor * getattr(motion, across), high.factor * getattr(motion, up)
    if early.any():
        ax.plot(x[early], y[early], color=GREY, alpha=0.5, linewidth=0.6, label="before")
    late = motion.times >= since
    ax.plot(x[late], y[late], color=BLUE, linewidth=1.1, label="motion" if early.any() else None)
    halted, name = (
        (motion.stuck, "torsional stick") if plane == "torsion" else (motion.held, "axial hold")
    )
    halted = halted & late
    if halted.any():
        ax.plot(
            np.where(halted, x, np.nan), np.where(halted, y, np.nan), color=ORANGE,
            linewidth=2.4, label=name,
        )  # fmt: skip
    end = run.at([run.times[-1]])
    last = right.factor * getattr(end, across), high.factor * getattr(end, up)
    ax.plot(*last, "o", color=GREEN, markersize=5, label="end")
    ax.set_xlabel(right.label)
    ax.set_ylabel(high.label)
    ax.set_title(headline(title or title_of(run), 56), fontsize="medium")
    # The orbit leaves no corner free.
    ax.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), ncols=4, fontsize="small")
    return ax


def plot_against_linear(
    nonlinear: Trace,
    linear: Trace,
    name: str = "x",
    ax: Axes | None = None,
    title: str | None = None,
) -> Axes:
    """Draw a signal of the nonlinear motion over that of the linear one.

    Parameters
    ----------
    nonlinear, linear : Trace
        Of the same point, controller and disturbance. The linear motion is cut where it
        grows beyond three times the range of the other.
    name : str
        A column of the motion, or ``bit_speed``.
    ax : Axes, optional
        By default new ones.
    title : str, optional
        By default it names signal and place.
    """
    ax = new_axes(7.2, 3.2) if ax is None else ax
    values, times = _signal(nonlinear, name)
    other, others = _signal(linear, name)
    ax.plot(others, other, "--", color=ORANGE, linewidth=1.0, label="linear")
    ax.plot(times, values, color=BLUE, linewidth=1.0, label="nonlinear")
    low, high = float(values.min()), float(values.max())
    reach = high - low
    if other.min() < low - reach or other.max() > high + reach:
        ax.set_ylim(low - reach, high + reach)
    ax.set_xlabel(scale_of(nonlinear.case, "time").label)
    ax.set_ylabel(scale_of(nonlinear.case, name).label)
    ax.margins(x=0)
    words = SIGNALS.get(name, (name,))[0]
    told = f"{words[:1].upper()}{words[1:]} at {nonlinear.case.place}"
    ax.set_title(headline(title or told, 80), fontsize="medium")
    ax.legend(loc="best", fontsize="small")
    return ax


def plot_rock_face(
    run: Trace, time: float | None = None, ax: Axes | None = None, title: str | None = None
) -> Axes:
    """Draw the rock that lies ahead of a blade over the next blade pitch.

    Parameters
    ----------
    run : Trace
        Of the nonlinear model.
    time : float, optional
        The instant, dimensionless; by default the end of the run.
    ax : Axes, optional
        By default new ones.
    title : str, optional
        By default it names model and place.
    """
    ax = new_axes(6.4, 3.2) if ax is None else ax
    when = float(run.times[-1]) if time is None else time
    face = rock_face(run, when, 361)
    degrees = np.degrees(face.angle)
    told_rig, language = run.case.told_rig, run.case.language
    (length, unit), (duration, second) = (
        told_scale(quantity, told_rig, language) for quantity in ("length", "time")
    )
    height = length * face.height
    bottom = min(float(height.min()), 0.0) - 0.2 * max(float(np.ptp(height)), 1e-9)
    ax.fill_between(degrees, bottom, height, color=GREY, alpha=0.35, linewidth=0)
    ax.plot(degrees, height, color="black", linewidth=1.0, label="rock face")
    older = face.passes > 1
    if older.any():
        ax.plot(
            degrees, np.where(older, height, np.nan), color=ORANGE, linewidth=2.0,
            label="left by an earlier pass",
        )  # fmt: skip
    ax.axhline(0.0, color=BLUE, linestyle="--", linewidth=1.0, label="tip of the blade")
    ax.set_xlabel(axis_name("angle ahead of the blade", "°"))
    ax.set_ylabel(axis_name("height above the tip", unit))
    told = f"{duration * when:.4g} {second}" if second else f"t = {when:.6g}"
    ax.set_title(headline(f"{title or title_of(run)}, {told}", 72), fontsize="medium")
    ax.margins(x=0)
    ax.set_ylim(bottom=bottom)
    ax.legend(loc="best", fontsize="small")
    return ax


def _signal(run: Trace, name: str) -> tuple[Any, Any]:
    known = ["bit_speed", *run.column_names]
    if name not in known:
        raise InputError("signal", name, f"one of {', '.join(known)}")
    unit, factor = scale_of(run.case, "time").factor, scale_of(run.case, name).factor
    read = "dtheta" if name == "bit_speed" else name
    motion = run.on_steps(_PER_STEP, names=(read,))
    mean = run.point.omega0 if name == "bit_speed" else 0.0
    return factor * (mean + getattr(motion, read)), unit * motion.times


def title_of(run: Trace, name: str | None = None, control: str | None = None) -> str:
    """Return a title: the model, the place, and what closes the loop.

    Parameters
    ----------
    run : Trace
        Of `simulate`.
    name : str, optional
        Of the rig.
    control : str, optional
        Of the controller.
    """
    place = ", ".join(text for text in (name, run.case.place) if text)
    return f"{run.model.capitalize()} motion at {place}" + (f"; {control}" if control else "")
