"""Common drill pipe by name, as new: nominal dimensions of API RP 7G and of usual tool joints."""

from __future__ import annotations

from typing import NamedTuple

from drillctrl.base.errors import InputError
from drillctrl.base.kinds import checks_kinds
from drillctrl.strings.section import JOINT_LENGTH, ToolJoint

INCH = 0.0254


class Pipe(NamedTuple):
    """Pipe as it is bought.

    Attributes
    ----------
    kind : str
        As in `Section`.
    outer_diameter, inner_diameter : float
        Of the body, m.
    tool_joint : ToolJoint
        With its connection.
    joint_length : float
        Range 2, m.
    """

    kind: str
    outer_diameter: float
    inner_diameter: float
    tool_joint: ToolJoint
    joint_length: float


# Name: OD and ID of the body, OD and ID of the tool joint in inches, its length in metres.
_PIPE = {
    '3 1/2" 13.3#': (3.5, 2.764, 4.75, 2.6875, 0.53),
    '3 1/2" 15.5#': (3.5, 2.602, 5.0, 2.5625, 0.53),
    '4" 14#': (4.0, 3.340, 5.25, 2.8125, 0.53),
    '4 1/2" 16.6#': (4.5, 3.826, 6.25, 3.25, 0.55),
    '4 1/2" 20#': (4.5, 3.640, 6.25, 3.0, 0.55),
    '5" 19.5#': (5.0, 4.276, 6.625, 3.75, 0.55),
    '5" 25.6#': (5.0, 4.000, 6.625, 3.5, 0.55),
    '5 1/2" 21.9#': (5.5, 4.778, 7.0, 4.0, 0.58),
    '5 1/2" 24.7#': (5.5, 4.670, 7.0, 4.0, 0.58),
    '5 7/8" 23.4#': (5.875, 5.153, 7.0, 4.25, 0.58),
    '6 5/8" 25.2#': (6.625, 5.965, 8.0, 5.0, 0.61),
}
_HEAVY = {
    '3 1/2" HWDP': (3.5, 2.0625, 4.75, 2.1875, 1.5),
    '5" HWDP': (5.0, 3.0, 6.5, 3.0625, 1.8),
    '5 1/2" HWDP': (5.5, 3.25, 7.0, 3.5, 1.8),
}


def pipe_names() -> tuple[str, ...]:
    """Return the names that `pipe` knows."""
    return (*_PIPE, *_HEAVY)


@checks_kinds
def pipe(name: str) -> Pipe:
    """Return pipe by its name.

    Parameters
    ----------
    name : str
        Size in inches and weight in lb/ft, such as ``5" 19.5#``, or ``5" HWDP``.

    Raises
    ------
    InputError
        If there is none of that name.
    """
    spelled = {_plain(known): known for known in pipe_names()}
    known = spelled.get(_plain(name))
    if known is None:
        raise InputError("pipe", name, f"one of {'; '.join(pipe_names())}")
    kind = "pipe" if known in _PIPE else "heavy-weight"
    outer, inner, joint_outer, joint_inner, length = (_PIPE | _HEAVY)[known]
    joint = ToolJoint(joint_outer * INCH, joint_inner * INCH, length)
    return Pipe(kind, outer * INCH, inner * INCH, joint, JOINT_LENGTH)


def _plain(name: str) -> str:
    for mark in ('"', "#", "”", "″", " in ", "lb/ft", "ppf"):
        name = name.replace(mark, " ")
    return " ".join(name.replace("in ", " ").lower().split())
