"""Figures of the bit's response. Each takes arrays and matplotlib Axes, or makes them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.figure import BLUE, GREY, ORANGE, new_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def plot_damping(
    amplitudes: FloatArray,
    damping: FloatArray,
    errors: FloatArray,
    crossings: Sequence[tuple[str, float]] = (),
    unit: str = "",
    label: str | None = None,
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
    ax : Axes, optional
        By default new ones.
    """
    ax = new_axes(6.4, 4.2) if ax is None else ax
    known = np.isfinite(damping) & np.isfinite(errors)
    ax.axhline(0.0, color=GREY, linewidth=0.8)
    ax.errorbar(
        amplitudes[known], damping[known], errors[known],
        color=BLUE, marker="o", markersize=3, linewidth=1.1, capsize=2, label=label,
    )  # fmt: skip
    for kind, amplitude in crossings:
        told = f"swings by {amplitude:.2g}" if kind == "swing" else f"kick of {amplitude:.2g}"
        ax.axvline(amplitude, color=ORANGE, linestyle="-" if kind == "swing" else "--", label=told)
    ax.set_xscale("log")
    ax.set_xlabel("swing A of the bit's speed, share of Ω0")
    ax.set_ylabel(f"damping left{f', {unit}' if unit else ''}")
    if label is not None or crossings:
        ax.legend(fontsize="small")
    return ax


def plot_response(
    frequencies: FloatArray,
    values: ComplexArray,
    errors: FloatArray,
    unit: str = "",
    ax: Axes | None = None,
) -> Axes:
    """Draw real and imaginary part of H over frequency.

    Parameters
    ----------
    frequencies, values, errors : array, (k,)
        ω, H, and the error of |H|.
    unit : str
        Of H.
    ax : Axes, optional
        By default new ones.
    """
    ax = new_axes(6.4, 4.2) if ax is None else ax
    known = np.isfinite(values) & np.isfinite(errors)
    ax.axhline(0.0, color=GREY, linewidth=0.8)
    for part, colour, label in ((values.real, BLUE, "Re H"), (values.imag, ORANGE, "Im H")):
        ax.errorbar(
            frequencies[known], part[known], errors[known],
            color=colour, marker="o", markersize=3, linewidth=1.1, capsize=2, label=label,
        )  # fmt: skip
    ax.set_xlabel("frequency")
    ax.set_ylabel(f"H{f', {unit}' if unit else ''}")
    ax.legend(fontsize="small")
    return ax
