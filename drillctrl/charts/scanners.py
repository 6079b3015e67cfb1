"""Which scanner suits the axes of a chart."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.errors import InputError
from drillctrl.charts.affine_scan import scan_affine
from drillctrl.charts.axes import STRING_AXES, Axis
from drillctrl.charts.counting_scan import scan_counting
from drillctrl.charts.delay_scan import scan_rotary_speed
from drillctrl.charts.plane import Plane
from drillctrl.charts.scan import ScanLine, Scanner
from drillctrl.charts.string_loops import BitLoads
from drillctrl.charts.string_scan import is_affine, scan_string, scan_string_counting
from drillctrl.delay.reduced import reduced_matrices
from drillctrl.spectrum.characteristic import perron_bounds
from drillctrl.strings.at_bit import string_at_bit

_SHORTEST_DELAY_SHARE = 1e-3
_PLACES = np.exp(1j * np.array([0.2, 0.9, 1.5, 1.8])) * np.array([1.0, 0.4, 0.1, 0.7])


def _transposed(plane: Plane, rows: bool) -> Any:
    """Return matrices(position, along) for lines held at y (rows) or at x."""
    if rows:
        return lambda position, along: plane.matrices(along, position)
    return plane.matrices


def _is_affine(plane: Plane, held: Axis, scanned: Axis, *, rows: bool) -> bool:
    """Whether the characteristic function is affine in the scanned parameter."""
    if scanned.name in ("omega0", "speed"):
        return False
    matrices = _transposed(plane, rows)
    t = held.low + held.span * np.array([0.31, 0.83])
    signs: list[ComplexArray] = []
    sizes: list[FloatArray] = []
    for share in (0.0, 0.37, 1.0):
        A0, A1, delays = matrices(t, np.full(2, scanned.low + share * scanned.span))
        # The same places for all three, of the size of the roots.
        if not signs:
            s = perron_bounds(A0, A1, delays, 0.0)[:, None] * _PLACES
        sign, size = reduced_matrices(A0, A1, delays, plain=True).determinant(s)
        signs.append(sign)
        sizes.append(size)
    scale = np.max(sizes, axis=0)
    values = [sign * np.exp(size - scale) for sign, size in zip(signs, sizes, strict=True)]
    middle = values[0] + 0.37 * (values[2] - values[0])
    return bool(np.abs(middle - values[1]).max() <= 1e-9)


def _moves_delay_alone(plane: Plane, scanned: Axis, *, rows: bool) -> bool:
    """Whether the rotary speed enters through the delay only: not with every friction law."""
    held = plane.y if rows else plane.x
    middle = np.full(2, held.low + 0.43 * held.span)
    low = max(scanned.low, 1e-3 * scanned.high)
    a0, a1, _ = _transposed(plane, rows)(middle, np.array([low, scanned.high]))
    return bool(np.allclose(a0[0], a0[1], rtol=1e-12, atol=0.0) and
                np.allclose(a1[0], a1[1], rtol=1e-12, atol=0.0))  # fmt: skip


def choose_scanner(plane: Plane, level: float) -> tuple[str, bool, Scanner]:
    """Return the method, whether its lines are rows, and the scanner."""
    x, y = plane.x, plane.y
    if plane.case.drills and string_at_bit(plane.case.physics("a chart")[0]) is not None:
        found = _string_scanner(plane, level)
        if found is not None:
            return found
    if plane.varied_string:
        wanted = "with level 0, and feedback of the bit's motion alone"
        raise InputError("axis", x.name if x.name in STRING_AXES else y.name, wanted)
    if level == 0.0:
        for scanned, rows in ((x, True), (y, False)):
            if scanned.name == "omega0" and _moves_delay_alone(plane, scanned, rows=rows):
                return "delay", rows, _delay_scanner(plane, scanned, rows=rows)
    for scanned, held, rows in ((y, x, False), (x, y, True)):
        if _is_affine(plane, held, scanned, rows=rows):
            return "affine", rows, _affine_scanner(plane, scanned, level, rows=rows)
    return "counting", False, _counting_scanner(plane, level)


def _string_scanner(plane: Plane, level: float) -> tuple[str, bool, Scanner] | None:
    """Return what scans a chart of a string of pipe by its receptances, if that can be."""
    x, y = plane.x, plane.y
    middle = np.array([x.low + 0.5 * x.span]), np.array([y.low + 0.5 * y.span])
    if level != 0.0 or plane.string_loads(*middle) is None:
        return None
    # A string belongs to a line: its depth is held.
    for scanned, held, rows in ((y, x, False), (x, y, True)):
        if scanned.name == "depth":
            continue
        if _is_affine_for_string(plane, held, scanned, rows=rows):
            scan = _by_string(plane, scanned, scan_string, rows=rows)
            return "receptance", rows, scan
    rows = y.name == "depth"
    return "counting", rows, _by_string(plane, x if rows else y, scan_string_counting, rows=rows)


def _string_loads(plane: Plane, rows: bool) -> Any:
    """Return strings and loads at (position, along) for lines held at y (rows) or at x."""
    if rows:
        return lambda position, along: plane.string_loads(along, position)
    return plane.string_loads


def _is_affine_for_string(plane: Plane, held: Axis, scanned: Axis, *, rows: bool) -> bool:
    if scanned.name in ("omega0", "speed"):
        return False
    at = np.full(1, held.low + 0.43 * held.span)
    loads = [
        _string_loads(plane, rows)(at, np.full(1, scanned.low + share * scanned.span))
        for share in (0.0, 0.37, 1.0)
    ]
    return is_affine(loads[0][0][0], *(found[1] for found in loads))


def _by_string(plane: Plane, scanned: Axis, scan: Any, *, rows: bool) -> Scanner:
    """Return a scanner that takes the lines of each string together."""
    find = _string_loads(plane, rows)
    low, high = first_position(scanned), scanned.high
    # Frequencies of a chart are dimensionless, those of a string are not.
    known = string_at_bit(plane.case.physics("a chart")[0])
    assert known is not None
    time = known.scales[1]

    def scanner(positions: FloatArray) -> list[ScanLine]:
        strings, _ = find(positions, np.full(positions.size, high))
        names = np.array([id(string) for string in strings])
        lines: dict[int, ScanLine] = {}
        for name in np.unique(names):
            where = np.flatnonzero(names == name)

            def loads(at: FloatArray, along: FloatArray) -> BitLoads:
                return find(at, along)[1]  # type: ignore[no-any-return]

            found = scan(strings[where[0]], loads, positions[where], low, high)
            found = [replace(line, omega=line.omega * time) for line in found]
            lines.update(zip(where.tolist(), found, strict=True))
        return [lines[i] for i in range(positions.size)]

    return scanner


def _delay_scanner(plane: Plane, scanned: Axis, *, rows: bool) -> Scanner:
    matrices = _transposed(plane, rows)
    _, point = plane.case.physics("an axis omega0")
    turn = 2.0 * np.pi / point.blades

    def scan(positions: FloatArray) -> list[ScanLine]:
        A0, A1, _ = matrices(positions, np.full(positions.size, scanned.high))
        return scan_rotary_speed(A0, A1, positions, scanned.low, scanned.high, turn)

    return scan


def _affine_scanner(plane: Plane, scanned: Axis, level: float, *, rows: bool) -> Scanner:
    matrices = _transposed(plane, rows)

    def scan(positions: FloatArray) -> list[ScanLine]:
        return scan_affine(matrices, positions, scanned.low, scanned.high, level)

    return scan


def _counting_scanner(plane: Plane, level: float) -> Scanner:
    low, high = first_position(plane.y), plane.y.high

    def scan(positions: FloatArray) -> list[ScanLine]:
        return scan_counting(plane.matrices, positions, low, high, level)

    return scan


def first_position(axis: Axis) -> float:
    """Return where lines may begin: ω0 and the rotary speed exclude zero."""
    if axis.name in ("omega0", "speed") and axis.low == 0.0:
        return _SHORTEST_DELAY_SHARE * axis.high
    if axis.name == "rock_strength" and axis.low == 0.0:
        return 1e-9 * axis.high
    return axis.low
