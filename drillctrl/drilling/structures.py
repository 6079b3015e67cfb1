"""Feedback of a drill string: the presets of torque, the feed, soft torque at the top."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.delay.structure import FeedbackStructure

STRUCTURE_NAMES = ("p", "case1", "pd", "case2")
ANGLE_BOUND = 10.0
RATE_BOUND = 5.0
AXIAL_OUTPUTS = ("x", "dx")


@checks_kinds
def preset_structure(name: str) -> FeedbackStructure:
    """Return a preset structure with the paper's bounds (Eqs. 37, 39, 43).

    Parameters
    ----------
    name : str
        ``"p"``: θ; ``"case1"``: θ and delayed θ; ``"pd"``: θ and θ';
        ``"case2"``: θ and θ', both also delayed.

    Raises
    ------
    InputError
        If there is no such preset.
    """
    presets = {
        "p": ((ANGLE_BOUND,), False),
        "case1": ((ANGLE_BOUND,), True),
        "pd": ((ANGLE_BOUND, RATE_BOUND), False),
        "case2": ((ANGLE_BOUND, RATE_BOUND), True),
    }
    if name not in presets:
        raise InputError("structure", name, f"one of {', '.join(presets)}")
    bounds, delayed = presets[name]
    return _torque_structure(name, bounds, delayed=delayed)


def as_structure(given: str | FeedbackStructure) -> FeedbackStructure:
    """Return a structure that is given as such or by the name of a preset."""
    return preset_structure(given) if isinstance(given, str) else given


def _torque_structure(name: str, bounds: Sequence[float], *, delayed: bool) -> FeedbackStructure:
    box = np.array([bounds])
    past = box if delayed else np.zeros_like(box)
    outputs = ("theta", "dtheta")[: len(bounds)]
    return FeedbackStructure(name, outputs, -box, box, -past, past)


@checks_kinds
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
    other = as_structure(beside)
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


@checks_kinds
def soft_torque(stiffness: float = 10.0, damping: float = 10.0) -> FeedbackStructure:
    """Return PI speed control of a top drive: drive = −k φ − d φ' (soft torque).

    Parameters
    ----------
    stiffness, damping : float
        Largest k and d, in units of Kt and of the root of Kt times the bit's inertia. With a
        drive of inertia ratio J and the bit off the rock the fastest pair is k = J and
        d = 2√J; a stiff drive has both large.
    """
    most = [
        checked_number("stiffness", stiffness, 0.0, 1e9, open_low=True),
        checked_number("damping", damping, 0.0, 1e9, open_low=True),
    ]
    nothing = np.zeros((1, 2))
    return FeedbackStructure(
        "soft-torque",
        ("phi", "dphi"),
        -np.array([most]),
        nothing,
        nothing,
        nothing,
        inputs=("drive",),
    )
