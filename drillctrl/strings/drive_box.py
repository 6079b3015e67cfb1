"""A string that is not known exactly, as strings that a law of a top drive must hold for."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from drillctrl.strings.drive_control import DriveControl
from drillctrl.strings.line import Line, Piece
from drillctrl.strings.slopes import drive_is_stable, mode_slopes


class Corner(NamedTuple):
    """A string at the edge of what is known, under a law.

    Attributes
    ----------
    stiffness, inertia, damping : float
        Over those of the string in the middle.
    stable : bool
        With a free bit.
    slope : float
        Smallest critical slope of the first modes, N m s.
    """

    stiffness: float
    inertia: float
    damping: float
    stable: bool
    slope: float


def box_lines(
    line: Line, errors: Mapping[str, float]
) -> list[tuple[tuple[float, float, float], Line]]:
    """Return factors of stiffness, inertia and damping, and the strings they make.

    Parameters
    ----------
    line : Line
        In torsion, in the middle.
    errors : mapping
        Relative errors of ``stiffness``, ``inertia`` and ``damping``: all corners are looked at,
        of damping the lower end, for more of it steadies every law.
    """
    sides = [(1.0 - e, 1.0 + e) for e in (errors.get("stiffness", 0), errors.get("inertia", 0))]
    less = 1.0 - errors.get("damping", 0.0)
    found = []
    for stiffer, heavier in itertools.product(*sides):

        def changed(piece: Piece, k: float = stiffer, m: float = heavier) -> Piece:
            return piece._replace(
                mass=m * piece.mass, stiffness=k * piece.stiffness, damping=less * m * piece.damping
            )

        found.append(((stiffer, heavier, less), line.changed(changed)))
    return found


def corners(line: Line, errors: Mapping[str, float], law: DriveControl) -> tuple[Corner, ...]:
    """Return what a law is worth at the corners of a box; see `box_lines`."""
    return tuple(
        Corner(
            *factors,
            drive_is_stable(there, law),
            min(mode.slope for mode in mode_slopes(there, law)),
        )
        for factors, there in box_lines(line, errors)
    )


def box_told(found: Sequence[Corner]) -> str:
    """Return in words what a law is worth at corners."""
    shares = [
        100.0 * abs(1.0 - getattr(found[0], name)) for name in ("stiffness", "inertia", "damping")
    ]
    told = "stiffness ± {:.2g} %, inertia ± {:.2g} %, damping to {:.2g} % less".format(*shares)
    held = sum(corner.stable for corner in found)
    if held < len(found):
        return f"{told}: UNSTABLE with a free bit at {len(found) - held} of {len(found)} corners"
    least = min(corner.slope for corner in found)
    return f"{told}: stable at all corners, smallest critical slope {least:.3g} N·m·s there"
