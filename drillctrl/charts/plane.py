"""From places on a chart to loops: every parameter of both axes put where it belongs."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drillctrl.base.errors import InputError
from drillctrl.charts.axes import RIG_AXES, Axis, to_si_factor
from drillctrl.delay.structure import FeedbackStructure, close_loop, loop_channels
from drillctrl.delay.system import DelaySystem, plant_system
from drillctrl.drilling.plant import (
    PARAMETER_NAMES,
    dimensionless_plant,
    linearisation,
    parameter_vector,
)
from drillctrl.drilling.point import OperatingPoint, RigPoint
from drillctrl.spectrum.characteristic import FloatArray
from drillctrl.spectrum.quasipolynomial import Quasipolynomials, from_matrices


@dataclass(frozen=True, eq=False)
class Plane:
    """A family of loops over two parameters, all others fixed.

    Attributes
    ----------
    point : OperatingPoint
        Supplies what the axes do not.
    rig_point : RigPoint or None
        The rig behind the point.
    structure : FeedbackStructure or None
        What is fed back; None for the open loop.
    K1, K2 : array, (m, p)
        Gains where they are no axis.
    x, y : Axis
        The two parameters.
    """

    point: OperatingPoint
    rig_point: RigPoint | None
    structure: FeedbackStructure | None
    K1: FloatArray
    K2: FloatArray
    x: Axis
    y: Axis

    def _parameters(self, values: dict[str, FloatArray], count: int) -> FloatArray:
        """Return the groups of every place, shape (N, 9)."""
        given = {name: v for name, v in values.items() if name in RIG_AXES}
        if given:
            assert self.rig_point is not None
            rows = [
                parameter_vector(self._at_rig({k: float(v[i]) for k, v in given.items()}))
                for i in range(count)
            ]
            table = np.array(rows)
        else:
            table = np.tile(parameter_vector(self.point), (count, 1))
        for name, column in values.items():
            for target in ("xi", "kappa") if name == "damping" else (name,):
                if target in PARAMETER_NAMES:
                    table[:, PARAMETER_NAMES.index(target)] = column
        return table

    def _at_rig(self, values: dict[str, float]) -> OperatingPoint:
        point = self.rig_point
        assert point is not None
        si = {name: value * to_si_factor(name) for name, value in values.items()}
        rig = point.rig
        if "rock_strength" in si:
            rig = rig.with_rock_strength(si["rock_strength"])
        return RigPoint(
            rig, si.get("speed", point.rotary_speed), si.get("rop", point.penetration_rate)
        ).operating_point()

    def _gains(self, values: dict[str, FloatArray], count: int) -> tuple[FloatArray, FloatArray]:
        """Return K1 and K2 of every place, each (N, m, p)."""
        assert self.structure is not None
        flat = np.concatenate([self.K1.ravel(), self.K2.ravel()])
        table = np.tile(flat, (count, 1))
        columns = self.structure.spread.T
        for name, column in zip(self.structure.gain_names, columns, strict=True):
            if name in values:
                # A gain takes along those that are tied to it.
                table[:, column != 0.0] = 0.0
                table += np.outer(values[name], column)
        half, shape = flat.size // 2, self.K1.shape
        return table[:, :half].reshape(-1, *shape), table[:, half:].reshape(-1, *shape)

    def matrices(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return A0 (N, n, n), A1 (N, n, n) and τ (N,) of the loops at N places."""
        count = x.size
        values = {self.x.name: x, self.y.name: y}
        table = self._parameters(values, count)
        a0, a1, _drive, tau = (
            value.full() for value in linearisation(dimensionless_plant())(table.T)
        )
        n = a0.shape[0]
        a0 = a0.reshape(n, count, n).transpose(1, 0, 2)
        a1 = a1.reshape(n, count, n).transpose(1, 0, 2)
        if self.structure is not None:
            inputs, outputs = loop_channels(
                plant_system(self.point, self.structure.inputs), self.structure
            )
            now, past = self._gains(values, count)
            a0, a1 = a0 + inputs @ now @ outputs, a1 + inputs @ past @ outputs
        return np.ascontiguousarray(a0), np.ascontiguousarray(a1), tau.ravel()

    def quasipolynomials(self, x: FloatArray, y: FloatArray) -> Quasipolynomials:
        """Return the characteristic functions at N places."""
        return from_matrices(*self.matrices(x, y))

    def operating_point(self, x: float, y: float) -> OperatingPoint:
        """Return the operating point at one place."""
        values = {self.x.name: np.array([x]), self.y.name: np.array([y])}
        row = self._parameters(values, 1)[0]
        changes = dict(zip(PARAMETER_NAMES, row.tolist(), strict=True))
        return replace(self.point, **changes)

    def system(self, x: float, y: float) -> DelaySystem:
        """Return the loop at one place, by the route that designs and analyses take."""
        point = self.operating_point(x, y)
        if self.structure is None:
            return plant_system(point)
        values = {self.x.name: np.array([x]), self.y.name: np.array([y])}
        now, past = self._gains(values, 1)
        return close_loop(
            plant_system(point, self.structure.inputs), self.structure, now[0], past[0]
        )


def check_plane(plane: Plane) -> None:
    """Refuse pairs of axes that contradict one another.

    Raises
    ------
    InputError
        If both axes set the same parameter.
    """
    sets = {"damping": ("xi", "kappa"), "speed": ("omega0", "delta0"), "rop": ("delta0",)}
    sets["rock_strength"] = ("psi", "delta0")
    first = set(sets.get(plane.x.name, (plane.x.name,)))
    second = set(sets.get(plane.y.name, (plane.y.name,)))
    both_rig = plane.x.name in RIG_AXES and plane.y.name in RIG_AXES
    if plane.x.name == plane.y.name or (first & second and not both_rig):
        raise InputError("y", plane.y.name, f"another parameter than x = {plane.x.name}")
