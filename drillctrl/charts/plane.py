"""From places on a chart to loops: every parameter of both axes put where it belongs."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.charts.axes import (
    GROUPS,
    RIG_AXES,
    STRING_AXES,
    Axis,
    axis_language,
    make_axis,
    to_si_factor,
)
from drillctrl.charts.string_loops import EFFORTS, MOTIONS, BitLoads, exact_count, si_loads
from drillctrl.delay.closing import close_loop, gain_matrices
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.delay.system import DelaySystem
from drillctrl.designs.loops import gains_along, loop_arrays
from drillctrl.drilling.case import Case, Where, as_case
from drillctrl.drilling.coefficients import GROUP_NAMES
from drillctrl.drilling.point import OperatingPoint, RigPoint
from drillctrl.drilling.rig import Rig
from drillctrl.drilling.steady import rig_point_at_weight_on_bit, steady_state
from drillctrl.drilling.structures import as_structure
from drillctrl.spectrum.count import count_right_of
from drillctrl.strings.at_bit import StringAtBit, string_at_bit
from drillctrl.strings.changed import changed_case, changed_rig, string_of
from drillctrl.strings.rig import StringRig

AxisLike = Axis | Sequence[object]


@functools.lru_cache(maxsize=256)
def _changed(rig: Rig, depth: float | None, mud: float | None) -> StringRig:
    return changed_rig(rig, depth, mud)


@functools.lru_cache(maxsize=256)
def _hung(known: StringAtBit, rig: Rig, depth: float) -> StringAtBit:
    # The groups of a changed rig are in units of its own string.
    string = string_of(_changed(rig, depth, None))
    return replace(known, string=string, units=string)


@dataclass(frozen=True, eq=False)
class Plane:
    """A family of loops over two parameters, all others fixed.

    Attributes
    ----------
    case : Case
        Supplies what the axes do not.
    structure : FeedbackStructure or None
        What is fed back; None for the open loop.
    K1, K2 : array, (m, p)
        Gains where they are no axis.
    x, y : Axis
        The two parameters.
    """

    case: Case
    structure: FeedbackStructure | None
    K1: FloatArray
    K2: FloatArray
    x: Axis
    y: Axis

    @property
    def point(self) -> OperatingPoint | None:
        """The operating point, if the physics is known."""
        return self.case.point

    @property
    def name(self) -> str | None:
        """What is fed back: the structure, or the law of the top drive; None for neither."""
        if self.structure is not None:
            return self.structure.name
        plant = self.case.plant
        known = None if plant is None else string_at_bit(plant)
        return None if known is None or known.control is None else known.control.name

    @property
    def rig_point(self) -> RigPoint | None:
        """The rig behind it, if one was given."""
        return self.case.rig_point

    def value_of(self, name: str) -> float:
        """Return the value that the point has of what may be an axis, in the axis' unit.

        Raises
        ------
        InputError
            If it has none: it is no axis of the case, or ξ and κ differ where both are asked.
        """
        point, rig_point = self.point, self.rig_point
        if name in RIG_AXES and rig_point is not None:
            value = {
                "speed": rig_point.rotary_speed,
                "rop": rig_point.penetration_rate,
                "wob": steady_state(rig_point).weight_on_bit if name == "wob" else 0.0,
                "rock_strength": rig_point.rig.rock_strength,
            }[name]
            return value / to_si_factor(name, axis_language(self.case))
        if name == "damping" and point is not None and point.xi == point.kappa:
            return point.xi
        known = self.case.parameters
        if name not in known:
            raise InputError("axis", name, f"one of {', '.join(known)}")
        return known[name]

    def _parameters(self, values: dict[str, FloatArray], count: int) -> dict[str, FloatArray]:
        """Return the parameters that vary, by name; those of a rig as the groups they move."""
        given, own = self._split(values)
        if not given:
            return own
        # A string of pipe has no use for some groups.
        names = self.case.physics("an axis of a rig")[0].group_names
        points = [point.operating_point() for point in self._rig_points(given, count)]
        groups = {
            name: np.array([getattr(point, name) for point in points], dtype=float)
            for name in names
        }
        return {**groups, **own}

    def _split(
        self, values: dict[str, FloatArray]
    ) -> tuple[dict[str, FloatArray], dict[str, FloatArray]]:
        """Return what varies of the rig, and what else does but gains."""
        of_rig = {*RIG_AXES, *STRING_AXES} if self.rig_point is not None else set()
        given = {name: v for name, v in values.items() if name in of_rig}
        return given, {n: v for n, v in values.items() if n not in given and not self._is_gain(n)}

    def _rig_points(self, given: dict[str, FloatArray], count: int) -> list[RigPoint]:
        return [self._at_rig({k: float(v[i]) for k, v in given.items()}) for i in range(count)]

    def _is_gain(self, name: str) -> bool:
        return self.structure is not None and name in self.structure.gain_names

    def _at_rig(self, values: dict[str, float]) -> RigPoint:
        point = self.rig_point
        assert point is not None
        language = axis_language(self.case)
        si = {name: value * to_si_factor(name, language) for name, value in values.items()}
        rig = point.rig
        if self.varied_string:
            rig = _changed(rig, si.get("depth"), si.get("mud"))
        if "rock_strength" in si:
            rig = rig.with_rock_strength(si["rock_strength"])
        speed = si.get("speed", point.rotary_speed)
        if "wob" in si:
            found = rig_point_at_weight_on_bit(rig, speed, si["wob"])
            return replace(found, units=point.units)
        return RigPoint(rig, speed, si.get("rop", point.penetration_rate), point.units)

    @property
    def varied_string(self) -> bool:
        """Whether an axis changes the string itself."""
        return self.rig_point is not None and not {self.x.name, self.y.name}.isdisjoint(STRING_AXES)

    def _gains(self, values: dict[str, FloatArray], count: int) -> tuple[FloatArray, FloatArray]:
        """Return K1 and K2 of every place, each (N, m, p)."""
        if self.structure is None:
            return self.K1, self.K2
        return gains_along(self.structure, self.K1, self.K2, values, count)

    def matrices(self, x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return A0 (N, n, n), A1 (N, n, n) and τ (N,) of the loops at N places."""
        values = {self.x.name: x, self.y.name: y}
        gains = self._gains(values, x.size)
        return loop_arrays(
            self.case, self._parameters(values, x.size), x.size, self.structure, *gains
        )

    def string_loads(
        self, x: FloatArray, y: FloatArray
    ) -> tuple[list[StringAtBit], BitLoads] | None:
        """Return the string at each of N places, and what the bits answer there.

        None where there is more than a bit on a string of pipe, or more is fed back than the
        bit's own motion.
        """
        plant, _ = self.case.physics("a chart of a string")
        known = string_at_bit(plant)
        if known is None:
            return None
        values = {self.x.name: x, self.y.name: y}
        given, own = self._split(values)
        if not set(own) <= {*GROUPS, *plant.bit.values}:
            return None
        gains = None if self.structure is None else self._bit_gains(self.structure, values, x.size)
        if self.structure is not None and gains is None:
            return None
        strings = [known] * x.size
        rows = self._bit_rows(given, own, x.size)
        if "depth" in given:
            # Mud bears on weights, not on how a string swings.
            depths, where = np.unique(given["depth"], return_inverse=True)
            assert self.case.rig is not None
            hung = [_hung(known, self.case.rig, depth) for depth in depths.tolist()]
            strings = [hung[i] for i in where.tolist()]
        return strings, si_loads(plant.bit, rows, strings, gains, known)

    def unstable_roots(self, x: float, y: float, level: float = 0.0) -> int | None:
        """Count the roots right of Re s = level at one place, by the argument principle.

        Those of a string of pipe are counted on the exact string, where that can be. None
        where a root lies too near the line to tell.
        """
        found = None
        if level == 0.0 and self.case.drills:
            found = self.string_loads(np.array([x]), np.array([y]))
        if found is None:
            return count_right_of(self.system(x, y), level).count
        try:
            return exact_count(found[0][0], found[1])
        except InputError:
            return None

    def _bit_rows(
        self, given: dict[str, FloatArray], own: dict[str, FloatArray], count: int
    ) -> FloatArray:
        """Return groups and parameters of the bit's law at each place, (N, k)."""
        plant, point = self.case.physics("a chart of a string")
        if given:
            rows = self._rig_rows(given, count)
        else:
            base = [getattr(point, name) for name in GROUP_NAMES]
            rows = np.tile(np.array(base, dtype=float), (count, 1))
            for i, name in enumerate(GROUP_NAMES):
                rows[:, i] = own.get(name, rows[:, i])
        law: dict[str, Any] = {**plant.bit.values, **own}
        more = [np.broadcast_to(law[name], count) for name in plant.bit.values]
        return np.column_stack([rows, *more])

    def _rig_rows(self, given: dict[str, FloatArray], count: int) -> FloatArray:
        """Return the groups of a rig at each place, (N, k)."""
        moving = {"speed", "rop"} & set(given)
        if "wob" in given:
            moving = set()
        held = np.column_stack([np.zeros(count), *(given[n] for n in given if n not in moving)])
        first = where = np.zeros(count, dtype=np.intp)
        if (held == held[:1]).all():
            first = first[:1]
        else:
            _, first, where = np.unique(held, axis=0, return_index=True, return_inverse=True)
        # Speed and rate move two groups alone: a point for each rig will do.
        places = {name: v[first] for name, v in given.items()}
        known = self._rig_points(places, first.size)
        points = [one.operating_point() for one in known]
        rows = np.array([[getattr(p, name) for name in GROUP_NAMES] for p in points], dtype=float)
        rows, where = rows[where.ravel()], where.ravel()
        si = {name: given[name] * to_si_factor(name, axis_language(self.case)) for name in moving}
        speed = np.array([one.rotary_speed for one in known])[where]
        rate = np.array([one.penetration_rate for one in known])[where]
        speed, rate = si.get("speed", speed), si.get("rop", rate)
        time = np.array([one.rig.time_scale for one in known])[where]
        length = np.array([one.rig.axial_scale for one in known])[where]
        rows[:, GROUP_NAMES.index("omega0")] = speed * time
        rows[:, GROUP_NAMES.index("delta0")] = rate / speed / length
        return rows

    def _bit_gains(
        self, structure: FeedbackStructure, values: dict[str, FloatArray], count: int
    ) -> FloatArray | None:
        """Return what is fed back on the bit's states, now and τ0 ago, (2, N, 2, 4)."""
        if not (set(structure.inputs) <= set(EFFORTS) and set(structure.outputs) <= set(MOTIONS)):
            return None
        rows = [EFFORTS.index(name) for name in structure.inputs]
        columns = [MOTIONS.index(name) for name in structure.outputs]
        whole = np.zeros((2, count, 2, 4))
        for part, gains in zip(whole, self._gains(values, count), strict=True):
            part[:, np.array(rows)[:, None], columns] = gains
        return whole

    def rig_point_at(self, x: float, y: float) -> RigPoint | None:
        """Return the rig's point at one place; None without a rig, or over a group."""
        values = {self.x.name: np.array([x]), self.y.name: np.array([y])}
        given, own = self._split(values)
        return None if self.rig_point is None or own else self._rig_points(given, 1)[0]

    def case_at(self, x: float, y: float) -> Case:
        """Return the case at one place."""
        values = {self.x.name: np.array([x]), self.y.name: np.array([y])}
        if self.varied_string:
            return changed_case(self.case, self._rig_points(self._split(values)[0], 1)[0])
        changes = {name: float(v[0]) for name, v in self._parameters(values, 1).items()}
        if "damping" in changes:
            changes["xi"] = changes["kappa"] = changes.pop("damping")
        return self.case.with_changes(**changes) if changes else self.case

    def system(self, x: float, y: float) -> DelaySystem:
        """Return the loop at one place, by the route that designs and analyses take."""
        case = self.case_at(x, y)
        if self.structure is None:
            return case.system()
        values = {self.x.name: np.array([x]), self.y.name: np.array([y])}
        now, past = self._gains(values, 1)
        return close_loop(case.system(self.structure.inputs), self.structure, now[0], past[0])


def check_plane(plane: Plane) -> None:
    """Refuse pairs of axes that contradict one another.

    Raises
    ------
    InputError
        If both axes set the same parameter.
    """
    sets = {"damping": ("xi", "kappa"), "speed": ("omega0", "delta0"), "rop": ("delta0",)}
    sets["rock_strength"], sets["wob"] = ("psi", "delta0"), ("delta0",)
    first = set(sets.get(plane.x.name, (plane.x.name,)))
    second = set(sets.get(plane.y.name, (plane.y.name,)))
    of_rig = {*RIG_AXES, *STRING_AXES}
    both_rig = plane.x.name in of_rig and plane.y.name in of_rig
    weight_twice = {plane.x.name, plane.y.name} == {"rop", "wob"}
    if plane.x.name == plane.y.name or weight_twice or (first & second and not both_rig):
        raise InputError("y", plane.y.name, f"another parameter than x = {plane.x.name}")


def make_plane(
    point: Where,
    x: AxisLike,
    y: AxisLike,
    structure: str | FeedbackStructure | None,
    K1: npt.ArrayLike | None,
    K2: npt.ArrayLike | None,
) -> Plane:
    """Check what a chart is drawn over.

    Raises
    ------
    InputError
        If axes, structure and gains do not fit together.
    """
    case = as_case(point)
    chosen = None if structure is None else as_structure(structure)
    axes = [make_axis(axis, chosen, case) for axis in (x, y)]
    if chosen is None:
        if K1 is not None or K2 is not None:
            raise InputError("structure", "(missing)", "given together with gains")
        now = past = np.zeros((0, 0))
    else:
        over = {axis.name for axis in axes}
        if K1 is None and not all(n in over for n in chosen.gain_names if n.startswith("K1")):
            raise InputError("K1", "(missing)", f"given for structure {chosen.name}")
        if K2 is None and not all(n in over for n in chosen.gain_names if n.startswith("K2")):
            raise InputError("K2", "(missing)", f"given for structure {chosen.name}")
        none = np.zeros(chosen.K1_lower.shape)
        now, past = gain_matrices(chosen, none if K1 is None else K1, none if K2 is None else K2)
    plane = Plane(case, chosen, now, past, *axes)
    check_plane(plane)
    return plane


def plane_fields(plane: Plane) -> dict[str, Any]:
    """Return what a chart was drawn over."""
    axes = {
        key: {"name": axis.name, "low": axis.low, "high": axis.high, "unit": axis.unit or None}
        for key, axis in (("x", plane.x), ("y", plane.y))
    }
    return {
        "operating_point": plane.point and dataclasses.asdict(plane.point),
        "axes": axes,
        "structure": plane.name,
        "K1": plane.K1.ravel().tolist(),
        "K2": plane.K2.ravel().tolist(),
    }
