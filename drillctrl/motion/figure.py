"""The figure of the damping left. It takes arrays and matplotlib Axes, or makes them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.figure import BLUE, GREY, ORANGE, axis_name, new_axes

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
    ax.axhline(0.0, color=GREY, linewidth=0.8)
    ax.errorbar(
        amplitudes[known], damping[known], errors[known],
        color=BLUE, marker="o", markersize=3, linewidth=1.1, capsize=2, label=label,
    )  # fmt: skip
    for kind, amplitude in crossings:
        told = f"swings by {amplitude:.2g}" if kind == "swing" else f"kick of {amplitude:.2g}"
        ax.axvline(amplitude, color=ORANGE, linestyle="-" if kind == "swing" else "--", label=told)
    ax.set_xscale("log")
    ax.set_xlabel(axis_name("swing A of the bit's speed", "share of Ω0"))
    ax.set_ylabel(axis_name("damping left to the mode", unit))
    if title:
        ax.set_title(title, fontsize="medium")
    if label is not None or crossings:
        ax.legend(fontsize="small")
    return ax
