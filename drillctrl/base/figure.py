"""Figures. Every function takes matplotlib Axes, or makes them, and returns them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from drillctrl.base.errors import InputError
from drillctrl.base.files import replacing
from drillctrl.spectrum.pseudospectral import approximate_roots, degree_for

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from drillctrl.designs.result import Design

# Okabe and Ito's palette, told apart by colour-blind readers too.
BLUE, ORANGE, GREEN, GREY = "#0072B2", "#D55E00", "#009E73", "#666666"
FIGURE_ENDINGS = (".pdf", ".png", ".svg")


def new_axes(width: float = 6.4, height: float = 4.2) -> Axes:
    """Return Axes in a new figure that belongs to no window."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure.add_subplot()


def save_figure(figure: Figure, path: str | Path) -> None:
    """Write a figure by the file's ending, whole or not at all.

    Raises
    ------
    InputError
        If the ending is none of .pdf, .png, .svg.
    """
    check_figure_path(path)
    metadata = {".pdf": {"CreationDate": None}, ".svg": {"Date": None}}
    ending = Path(path).suffix.lower()
    with replacing(path) as file:
        import matplotlib as mpl

        with mpl.rc_context({"svg.hashsalt": "drillctrl"}):
            figure.savefig(file, format=ending[1:], dpi=150, metadata=metadata.get(ending))


def check_figure_path(path: str | Path) -> None:
    """Raise `InputError` if a figure cannot be written under this name."""
    if Path(path).suffix.lower() not in FIGURE_ENDINGS:
        raise InputError("plot", str(path), f"a file that ends in {', '.join(FIGURE_ENDINGS)}")


def plot_roots(design: Design, ax: Axes | None = None) -> Axes:
    """Draw the rightmost characteristic roots with and without feedback.

    Parameters
    ----------
    design : Design
        Of `design` or `analyze`.
    ax : Axes, optional
        By default new ones.
    """
    ax = new_axes() if ax is None else ax
    series = [("without control", design.plant, "o", GREY)]
    if design.structure is not None:
        series.append((f"with {design.structure.name}", design.system(), "x", BLUE))
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
    alpha = design.spectral_abscissa
    ax.axvline(
        alpha,
        color=BLUE if design.structure else GREY,
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
    p = design.point
    where = f" at ω0 = {p.omega0:g}, δ0 = {p.delta0:g}, ψ = {p.psi:g}" if p else ""
    ax.set_title(f"Characteristic roots{where}")
    for root in design.loop.dominant_roots:
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
