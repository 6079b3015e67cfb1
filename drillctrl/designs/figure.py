"""Figures of a design."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from drillctrl.base.figure import BLUE, GREY, ORANGE, axis_name, new_axes
from drillctrl.drilling.quantities import root_scales
from drillctrl.spectrum.pseudospectral import approximate_roots, degree_for

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.axes import Axes

    from drillctrl.delay.system import DelaySystem
    from drillctrl.drilling.rig import Rig
    from drillctrl.spectrum.multiplicity import Root


def plot_roots(
    loops: Mapping[str, DelaySystem],
    dominant: Sequence[Root],
    title: str = "",
    rig: Rig | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw the rightmost characteristic roots without feedback, and with it.

    Parameters
    ----------
    loops : mapping of str to DelaySystem
        The plant and, if there is feedback, the closed loop, by their labels.
    dominant : sequence of Root
        Of the last of them, the rightmost first.
    title : str
        Where that is.
    rig : Rig, optional
        In whose units the roots are drawn: growth per second over Hz.
    ax : Axes, optional
        By default new ones.
    """
    ax = new_axes() if ax is None else ax
    looks = (("o", GREY), ("x", BLUE))
    series = [(*pair, *look) for pair, look in zip(loops.items(), looks, strict=False)]
    (rate, real, per), (turn, imaginary, cycles) = root_scales(rig)
    shown = []
    for label, system, marker, colour in series:
        roots = approximate_roots(system, 2 * degree_for(system))[:16]
        reach = 1.2 * max(1.0, float(np.abs(roots[: system.order + 1].imag).max()))
        near = roots[np.abs(roots.imag) <= max(reach, 3.0)]
        near = near[near.real > near.real[0] - 12.0]
        near = rate * near.real + 1j * turn * near.imag
        face = "none" if marker == "o" else colour
        ax.scatter(
            near.real,
            near.imag,
            marker=marker,
            c=colour if marker == "x" else None,
            facecolors=None if marker == "x" else face,
            edgecolors=None if marker == "x" else colour,
            label=label,
            zorder=3,
        )
        shown.append(near)
    ax.axvline(0.0, color="black", linewidth=0.8)
    alpha = rate * dominant[0].rightmost
    ax.axvline(
        alpha,
        color=looks[len(series) - 1][1],
        linestyle="--",
        linewidth=1.0,
        label=_rightmost_text(alpha, per),
    )
    right = max(0.0, *(float(roots.real.max()) for roots in shown))
    left = min(float(roots.real.min()) for roots in shown)
    span = right - left + rate
    ax.axvspan(
        0.0,
        right + 0.15 * span,
        color=ORANGE,
        alpha=0.12,
        linewidth=0,
        label="unstable half-plane",
    )
    ax.set_xlim(left - 0.08 * span, right + 0.15 * span)
    ax.set_xlabel(axis_name(real, per))
    ax.set_ylabel(axis_name(imaginary, cycles))
    ax.set_title(f"Characteristic roots{f' at {title}' if title else ''}", fontsize="medium")
    for root in dominant:
        if root.multiplicity > 1:
            ax.annotate(
                f"{root.multiplicity} roots",
                (rate * root.real, turn * root.imag),
                xytext=(-8, 8),
                ha="right",
                textcoords="offset points",
            )
    ax.legend(loc="best", fontsize="small")
    return ax


def _rightmost_text(alpha: float, per: str) -> str:
    """Say how fast what decays slowest decays, or what grows fastest grows."""
    if not per:
        return f"spectral abscissa α = {alpha:.4g}"
    return f"slowest decay, {-alpha:.3g} {per}" if alpha < 0.0 else f"growth, {alpha:.3g} {per}"
