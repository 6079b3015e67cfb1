"""Figures of a design."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from drillctrl.base.figure import BLUE, GREY, ORANGE, new_axes
from drillctrl.spectrum.pseudospectral import approximate_roots, degree_for

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.axes import Axes

    from drillctrl.delay.system import DelaySystem
    from drillctrl.drilling.point import OperatingPoint
    from drillctrl.spectrum.roots import Root


def plot_roots(
    loops: Mapping[str, DelaySystem],
    dominant: Sequence[Root],
    point: OperatingPoint | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw the rightmost characteristic roots without feedback, and with it.

    Parameters
    ----------
    loops : mapping of str to DelaySystem
        The plant and, if there is feedback, the closed loop, by their labels.
    dominant : sequence of Root
        Of the last of them, the rightmost first.
    point : OperatingPoint, optional
        Where that is, for the title.
    ax : Axes, optional
        By default new ones.
    """
    ax = new_axes() if ax is None else ax
    looks = (("o", GREY), ("x", BLUE))
    series = [(*pair, *look) for pair, look in zip(loops.items(), looks, strict=False)]
    shown = []
    for label, system, marker, colour in series:
        roots = approximate_roots(system, 2 * degree_for(system))[:16]
        reach = 1.2 * max(1.0, float(np.abs(roots[: system.order + 1].imag).max()))
        near = roots[np.abs(roots.imag) <= max(reach, 3.0)]
        near = near[near.real > near.real[0] - 12.0]
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
    alpha = dominant[0].rightmost
    ax.axvline(
        alpha,
        color=looks[len(series) - 1][1],
        linestyle="--",
        linewidth=1.0,
        label=f"spectral abscissa α = {alpha:.4g}",
    )
    right = max(0.0, *(float(roots.real.max()) for roots in shown))
    left = min(float(roots.real.min()) for roots in shown)
    ax.axvspan(
        0.0,
        right + 0.15 * (right - left + 1.0),
        color=ORANGE,
        alpha=0.12,
        linewidth=0,
        label="unstable half-plane",
    )
    ax.set_xlim(left - 0.08 * (right - left + 1.0), right + 0.15 * (right - left + 1.0))
    ax.set_xlabel("Re s")
    ax.set_ylabel("Im s")
    p = point
    where = f" at ω0 = {p.omega0:g}, δ0 = {p.delta0:g}, ψ = {p.psi:g}" if p else ""
    ax.set_title(f"Characteristic roots{where}")
    for root in dominant:
        if root.multiplicity > 1:
            ax.annotate(
                f"{root.multiplicity} roots",
                (root.real, root.imag),
                xytext=(-8, 8),
                ha="right",
                textcoords="offset points",
            )
    ax.legend(loc="best", fontsize="small")
    return ax
