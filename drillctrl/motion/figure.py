"""Figures of the damping left and of the response. They take arrays and Axes, or make them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.figure import BLUE, GREY, ORANGE, axis_name, new_axes, plain_ticks

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_damping(
    amplitudes: FloatArray,
    damping: FloatArray,
    errors: FloatArray,
    crossings: Sequence[tuple[str, float]] = (),
    unit: str = "",
    label: str | None = None,
    title: str = "",
    ax: Axes | None = None,
) -> Axes:
    """Draw the damping left to a mode over the swing of the bit's speed.

    Parameters
    ----------
    amplitudes, damping, errors : array, (k,)
        A; damping left; and its error, infinite where it is not known.
    crossings : sequence of (kind, A)
        Where the mode neither grows nor decays.
    unit : str
        Of the damping.
    label : str, optional
        Name of the mode.
    title : str
        Where that is.
    ax : Axes, optional
        By default new ones.
    """
    ax = new_axes(6.4, 4.2) if ax is None else ax
    known = np.isfinite(damping) & np.isfinite(errors)
    name, of, many = ("swing ±", "%", 100.0) if unit else ("swing A", "share of Ω0", 1.0)
    ax.axhline(0.0, color=GREY, linewidth=0.8)
    ax.errorbar(
        many * amplitudes[known], damping[known], errors[known],
        color=BLUE, marker="o", markersize=3, linewidth=1.1, capsize=2, label=label,
    )  # fmt: skip
    for kind, amplitude in crossings:
        size = f"{many * amplitude:.2g}{' %' if unit else ''}"
        told = f"swings by {size}" if kind == "swing" else f"kick of {size}"
        ax.axvline(
            many * amplitude, color=ORANGE, linestyle="-" if kind == "swing" else "--", label=told
        )
    ax.set_xscale("log")
    plain_ticks(ax.xaxis)
    ax.set_xlabel(axis_name(f"{name} of the bit's speed", of))
    ax.set_ylabel(axis_name("damping left to the mode", unit))
    if title:
        ax.set_title(title, fontsize="medium")
    if label is not None or crossings:
        ax.legend(fontsize="small")
    return ax


def plot_damping_along(
    values: FloatArray,
    damping: FloatArray,
    errors: FloatArray,
    thresholds: Sequence[tuple[str, float]],
    *,
    along: str,
    units: tuple[str, str],
    label: str,
    title: str = "",
    ax: Axes | None = None,
) -> Axes:
    """Draw the damping left to a mode over rotary speed or rate of penetration.

    Parameters
    ----------
    values, damping, errors : array, (k,)
        Speeds or rates; damping left; and its error, infinite where it is not known.
    thresholds : sequence of (side, value)
        Where the mode neither grows nor decays, and on which side it decays.
    along : {"speed", "rate"}
        What the values are.
    units : (str, str)
        Of the values and of the damping; empty where dimensionless.
    label, title : str
        Name of the mode; where that is.
    ax : Axes, optional
        By default new ones.
    """
    ax = new_axes(6.4, 4.2) if ax is None else ax
    known = np.isfinite(damping) & np.isfinite(errors)
    unit, response = units
    name = {
        "speed": "rotary speed" if unit else "rotary speed ω0",
        "rate": "rate of penetration",
    }[along]
    ax.axhline(0.0, color=GREY, linewidth=0.8)
    ax.errorbar(
        values[known], damping[known], errors[known],
        color=BLUE, marker="o", markersize=3, linewidth=1.1, capsize=2, label=label,
    )  # fmt: skip
    for side, value in thresholds:
        told = f"decays {side} {value:.3g} {unit}".rstrip()
        ax.axvline(value, color=ORANGE, linestyle="-" if side == "above" else "--", label=told)
    for i, value in enumerate(values[~known]):
        once = "" if i else "not known, the bit swings of itself"
        ax.axvline(value, color=GREY, linewidth=0.8, linestyle=":", label=once)
    # An error that dwarfs all else hides where the mode decays.
    shown = damping[known][errors[known] < max(float(np.ptp(damping[known])), 1e-300)]
    if shown.size > 1:
        room = 0.15 * max(float(np.ptp(shown)), float(np.abs(shown).max()))
        ax.set_ylim(min(float(shown.min()), 0.0) - room, max(float(shown.max()), 0.0) + room)
    ax.set_xlabel(axis_name(name, unit))
    ax.set_ylabel(axis_name("damping left to the mode", response))
    if title:
        ax.set_title(title, fontsize="medium")
    ax.legend(fontsize="small")
    return ax


def plot_response(
    frequencies: FloatArray,
    values: ComplexArray,
    errors: FloatArray,
    model: tuple[FloatArray, ComplexArray],
    unit: str,
    label: str,
    ax: Axes | None = None,
) -> Axes:
    """Draw the bit's response over frequency.

    Parameters
    ----------
    frequencies, values, errors : array, (k,)
        Hz or ω; H; and its error, infinite where it is not known.
    model : tuple of frequencies and values
        Of the rational model.
    unit : str
        Of H; empty where all is dimensionless, else frequencies are in Hz.
    label : str
        What is drawn.
    ax : Axes, optional
        By default new ones.
    """
    ax = new_axes(6.4, 4.2) if ax is None else ax
    known = np.isfinite(errors)
    ax.axhline(0.0, color=GREY, linewidth=0.8)
    damps, leads = ("in phase, damps", "a quarter turn ahead") if unit else ("Re H, damps", "Im H")
    for part, colour, name in (("real", BLUE, damps), ("imag", ORANGE, leads)):
        ax.errorbar(
            frequencies[known], getattr(values[known], part), errors[known],
            color=colour, marker="o", markersize=3, linestyle="none", capsize=2, label=name,
        )  # fmt: skip
        ax.plot(model[0], getattr(model[1], part), color=colour, linewidth=1.1)
    ax.set_xscale("log")
    plain_ticks(ax.xaxis)
    cycles = "Hz" if unit else ""
    ax.set_xlabel(axis_name("frequency" if unit else "frequency ω", cycles))
    ax.set_ylabel(axis_name(f"{'' if unit else 'H, '}torque of the bit per speed", unit))
    ax.set_title(f"the bit's answer, {label}; lines: rational model", fontsize="medium")
    ax.legend(fontsize="small")
    return ax
