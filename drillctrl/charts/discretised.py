"""What the semi-discretisation shows of a family: ρ(D) over two gains, eigenvalues along a path.

These are the paper's own views (Figs. 4, 11). They carry the error of the scheme: beside the
surface stand the exact boundary and the exact optimum.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.errors import InputError, checked_integer
from drillctrl.base.figure import GREY, ORANGE, axis_name, new_axes
from drillctrl.base.kinds import checks_kinds
from drillctrl.charts.axes import Axis, make_axis
from drillctrl.charts.chart import StabilityChart, chart
from drillctrl.charts.figure import axis_text, draw_curves
from drillctrl.charts.plane import AxisLike, make_plane
from drillctrl.delay.closing import close_loop
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.designs.design import design
from drillctrl.designs.result import Design
from drillctrl.drilling.case import Case, Where, as_case
from drillctrl.drilling.structures import as_structure
from drillctrl.spectrum.semidiscretization import semidiscretize

if TYPE_CHECKING:
    from matplotlib.axes import Axes


@dataclass(frozen=True, eq=False)
class GainSurface:
    """ρ(D) over two gains, with the exact boundary and the exact optimum (Fig. 11).

    Attributes
    ----------
    case : Case
        What drills, and where.
    chart : StabilityChart
        Where the gains stabilise, without discretisation.
    optimum : Design
        The gains that minimise the spectral abscissa.
    x, y : array, (q,)
        Values of the gains.
    radius : array, (q, q)
        ρ(D), y along the first axis.
    m, order : int
        Of the semi-discretisation.
    """

    case: Case
    chart: StabilityChart
    optimum: Design
    x: FloatArray
    y: FloatArray
    radius: FloatArray
    m: int
    order: int

    @property
    def lowest(self) -> tuple[float, float, float]:
        """Gains of the lowest ρ(D) on the grid, and its value."""
        row, column = np.unravel_index(int(self.radius.argmin()), self.radius.shape)
        return float(self.x[column]), float(self.y[row]), float(self.radius[row, column])

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw contours of ρ(D), the exact boundary and the exact optimum."""
        ax = new_axes() if ax is None else ax
        levels = np.unique(np.concatenate([np.linspace(self.lowest[2], 1.0, 8), [1.02, 1.1, 1.3]]))
        drawn = ax.contourf(
            self.x, self.y, self.radius, levels=levels, cmap="cividis", extend="both"
        )
        ax.figure.colorbar(
            drawn, ax=ax, label=axis_name(f"ρ(D) of m = {self.m} and order {self.order}")
        )
        draw_curves(ax, self.chart.curves, "black", "exact boundary")
        gains = self.optimum.K1.ravel(), self.optimum.K2.ravel()
        vector = self.optimum.structure.vector(*gains) if self.optimum.structure else None
        if vector is not None:
            ax.plot(
                [vector[0]], [vector[1]], "*", color=ORANGE, markersize=12, label="optimum of α"
            )
        ax.plot(*([v] for v in self.lowest[:2]), "o", mfc="none", color=GREY, label="lowest ρ(D)")
        ax.set_xlabel(axis_text(self.chart.plane.x))
        ax.set_ylabel(axis_text(self.chart.plane.y))
        p = self.case.point
        if p is not None:
            ax.set_title(f"ω0 = {p.omega0:g}, δ0 = {p.delta0:g}, ψ = {p.psi:g}", fontsize="medium")
        ax.legend(loc="best", fontsize="small")
        return ax


@checks_kinds
def gain_surface(
    point: Where,
    structure: str | FeedbackStructure = "case1",
    *,
    m: int = 20,
    order: int = 1,
    count: int = 41,
) -> GainSurface:
    """Sweep ρ(D) over the bounds of a structure with two gains (Fig. 11).

    Parameters
    ----------
    point : OperatingPoint, RigPoint, DelaySystem or Case
        Where the rig drills.
    structure : str or FeedbackStructure
        With two free gains.
    m, order : int
        Of the semi-discretisation.
    count : int
        Values of each gain.

    Raises
    ------
    InputError
        If the structure has not two gains, or a number is out of range.
    """
    chosen = as_structure(structure)
    number = checked_integer("count", count, 2, 1001)
    if len(chosen.gain_names) != 2:
        raise InputError("structure", chosen.name, "one with two gains")
    case = as_case(point)
    plant = case.system(chosen.inputs)
    x, y = (np.linspace(*ends, number) for ends in chosen.gain_bounds.values())
    radius = np.empty((number, number))
    for i, second in enumerate(y):
        for j, first in enumerate(x):
            loop = close_loop(plant, chosen, *chosen.gains([first, second]))
            radius[i, j] = semidiscretize(loop, m, order).spectral_radius
    axes = [(name, *ends) for name, ends in chosen.gain_bounds.items()]
    fixed = chosen.gains(np.zeros(2))
    exact = chart(point, axes[0], axes[1], chosen, *fixed)
    optimum = design(case, chosen, trials=False)
    return GainSurface(case, exact, optimum, x, y, radius, m, order)


@dataclass(frozen=True, eq=False)
class RootLocus:
    """Eigenvalues of D along a parameter (Fig. 4).

    Attributes
    ----------
    axis : Axis
        The parameter.
    values : array, (q,)
        Where it is held.
    multipliers : array, (q, N)
        Eigenvalues of D, largest modulus first.
    m, order : int
        Of the semi-discretisation.
    """

    axis: Axis
    values: FloatArray
    multipliers: ComplexArray
    m: int
    order: int

    @property
    def radius(self) -> FloatArray:
        """ρ(D) at each value, (q,)."""
        return np.asarray(np.abs(self.multipliers[:, 0]))

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draw the eigenvalues in the complex plane, shaded by the parameter."""
        ax = new_axes(5.6, 4.8) if ax is None else ax
        angle = np.linspace(0.0, 2.0 * np.pi, 400)
        ax.plot(np.cos(angle), np.sin(angle), color="black", linewidth=0.8, label="unit circle")
        many = np.repeat(self.values, self.multipliers.shape[1])
        points = self.multipliers.ravel()
        drawn = ax.scatter(points.real, points.imag, c=many, s=6, cmap="cividis")
        ax.figure.colorbar(drawn, ax=ax, label=axis_text(self.axis))
        ax.set_aspect("equal")
        ax.set_xlabel(axis_name("real part of the eigenvalue"))
        ax.set_ylabel(axis_name("imaginary part of the eigenvalue"))
        ax.set_title(f"Eigenvalues of D, m = {self.m}, order {self.order}", fontsize="medium")
        ax.legend(loc="lower left", fontsize="small")
        return ax


@checks_kinds
def root_locus(
    point: Where,
    axis: AxisLike = ("omega0", 3.0, 24.0),
    structure: str | FeedbackStructure | None = None,
    K1: npt.ArrayLike | None = None,
    K2: npt.ArrayLike | None = None,
    *,
    m: int = 4,
    order: int = 0,
    count: int = 200,
) -> RootLocus:
    """Follow the eigenvalues of D along a group of the point (Fig. 4).

    Parameters
    ----------
    point : OperatingPoint, RigPoint or Case
        Supplies the other parameters.
    axis : (name, low, high)
        A group, or a parameter of the plant's parts.
    structure, K1, K2 : optional
        As in `chart`.
    m, order : int
        Of the semi-discretisation; the paper's figure has 4 and 0.
    count : int
        Values of the parameter.

    Raises
    ------
    InputError
        If there is no such parameter, or a number is out of range.
    """
    case = as_case(point)
    case.physics("a root locus over a parameter")
    # Numbers of the rig would move several groups at once.
    case = replace(case, rig_point=None)
    chosen = make_axis(axis, None, case)
    number = checked_integer("count", count, 2, 100_000)
    other: Sequence[object] = ("psi", 0.0, 1.0) if chosen.name != "psi" else ("omega0", 1.0, 2.0)
    plane = make_plane(case, chosen, other, structure, K1, K2)
    values = np.linspace(chosen.low, chosen.high, number)
    held = case.parameters[str(other[0])]
    found = [semidiscretize(plane.system(v, held), m, order).multipliers() for v in values]
    return RootLocus(chosen, values, np.array(found), m, order)
