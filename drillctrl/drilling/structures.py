"""Feedback to the feed: an axial force on the string, instead of a torque or beside one."""

from __future__ import annotations

import numpy as np

from drillctrl.base.errors import InputError, checked_number
from drillctrl.delay.structure import (
    ANGLE_BOUND,
    RATE_BOUND,
    FeedbackStructure,
    FloatArray,
    preset_structure,
)

AXIAL_OUTPUTS = ("x", "dx")


def feed(
    beside: str | FeedbackStructure | None = None,
    *,
    stiffness: float = ANGLE_BOUND,
    damping: float = RATE_BOUND,
) -> FeedbackStructure:
    """Return axial feedback: a force on the bit that is fed by its axial motion.

    The regenerative axial mode hardly feels a torque. A force does, and u = K1 (x, x') adds
    to x'' what the string's own stiffness and damping lack.

    Parameters
    ----------
    beside : str or FeedbackStructure, optional
        A preset or structure of torques that acts at the same time; its outputs do not reach
        the feed, nor the axial ones the torque.
    stiffness, damping : float
        Largest absolute gain on x and on x', at least 0; 0 leaves that gain out.

    Returns
    -------
    FeedbackStructure
        Its last input is ``"axial"``, its last outputs are ``"x"`` and ``"dx"``.

    Raises
    ------
    InputError
        If a bound is negative, both are 0, or ``beside`` uses x, x' or the feed itself.
    """
    most = np.array(
        [
            [
                checked_number("stiffness", stiffness, 0.0, 1e9),
                checked_number("damping", damping, 0.0, 1e9),
            ]
        ]
    )
    if not most.any():
        raise InputError("stiffness, damping", (0.0, 0.0), "not both 0")
    none = np.zeros_like(most)
    alone = FeedbackStructure("feed", AXIAL_OUTPUTS, -most, most, none, none, inputs=("axial",))
    if beside is None:
        return alone
    other = preset_structure(beside) if isinstance(beside, str) else beside
    return _side_by_side(other, alone)


def _side_by_side(one: FeedbackStructure, two: FeedbackStructure) -> FeedbackStructure:
    """Return two structures at once, neither of which sees the other's outputs."""
    shared = {*one.inputs, *one.outputs} & {*two.inputs, *two.outputs}
    if shared:
        raise InputError("beside", one.name, f"a structure without {', '.join(sorted(shared))}")
    if one.ties:
        raise InputError("beside", one.name, "a structure without ties")

    def blocks(bound: str) -> FloatArray:
        first, second = getattr(one, bound), getattr(two, bound)
        corner = np.zeros((first.shape[0], second.shape[1]))
        other = np.zeros((second.shape[0], first.shape[1]))
        return np.asarray(np.block([[first, corner], [other, second]]))

    return FeedbackStructure(
        f"{one.name}+{two.name}",
        (*one.outputs, *two.outputs),
        blocks("K1_lower"),
        blocks("K1_upper"),
        blocks("K2_lower"),
        blocks("K2_upper"),
        inputs=(*one.inputs, *two.inputs),
    )
