"""What the integrator needs of a plant: compiled code of its law, and arrays of all else."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
import scipy.linalg

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.drilling.bit_rock import (
    BitRock,
    Contact,
    Rates,
    kinematics,
    pitch,
    steady_load,
)
from drillctrl.drilling.coefficients import Coefficients
from drillctrl.drilling.linear import BIT_STATES, linear_depth, linearisation
from drillctrl.drilling.plant import Evaluator, Plant, by_form, evaluator, expressions

# Top ends that a kick of the bit leaves as they are; those of a user follow.
_TOPS = ("phi", "hook")
BIT_COEFFICIENTS = ("rotary_speed", "penetration_rate", "blades")


def _record(law: BitRock) -> tuple[ca.SX, Coefficients, Any]:
    """Return a vector of symbols, and the coefficients and the law's parameters in it."""
    c = [ca.SX.sym(name) for name in Coefficients._fields]
    own = {name: ca.SX.sym(name) for name in law.values}
    return ca.vertcat(*c, *own.values()), Coefficients(*c), SimpleNamespace(**own)


def load_function(law: BitRock) -> ca.Function:
    """Return the loads of the bit on one branch of its switches, for event-driven use.

    Parameters
    ----------
    law : BitRock
        Its form counts; its values and all coefficients are the argument q.

    Returns
    -------
    Function
        (contact, rates, q) → weight and torque on bit; see `Contact` and `Rates`.
    """
    q, c, own = _record(law)
    contact, speeds = ca.SX.sym("contact", 3), ca.SX.sym("rates", 2)
    load = law.load(c, Contact(*ca.vertsplit(contact)), Rates(*ca.vertsplit(speeds)), own)
    return ca.Function("load", [contact, speeds, q], [ca.vertcat(*load)])


def kinematic_functions() -> tuple[ca.Function, ...]:
    """Return the bit's way through the rock, which is the same under every law.

    Returns
    -------
    depth, turned : Function
        (X, Xd, τ, bit) → depth of cut (Eqs. 7, 9); angle turned beyond 2π/n (Eq. 8). X and Xd
        are the bit's four states; bit is Ω0, V0 and n.
    rates : Function
        (X, bit) → Z', Φ'.
    """
    c = Coefficients(*[ca.SX.sym(name) for name in Coefficients._fields])
    now, then = ca.SX.sym("now", BIT_STATES), ca.SX.sym("then", BIT_STATES)
    delay = ca.SX.sym("delay")
    bit = kinematics(c, ca.vertsplit(now), ca.vertsplit(then), delay)
    drives = ca.vertcat(*[getattr(c, name) for name in BIT_COEFFICIENTS])
    arguments = [now, then, delay, drives]
    return (
        ca.Function("depth", arguments, [bit.depth]),
        ca.Function("turned", arguments, [bit.turned - pitch(c)]),
        ca.Function("rates", [now, drives], [ca.vertcat(*bit.rates)]),
    )


class MotionArrays(NamedTuple):
    """A plant at one set of parameters, as the integrator takes it.

    Attributes
    ----------
    q : array
        Coefficients, then the law's own parameters: what `load_function` takes.
    steady : array, (2,)
        Weight and torque on bit of steady drilling.
    A, E, B, T, C, R : array
        As in `Realisation`.
    input_delays : array, (m,)
        How late the inputs act.
    late : tuple of (float, array (n, n))
        Terms that act with a delay.
    linear : array, (n, n)
        A with the load linearised.
    linear_delayed : array, (n, 4)
        Acts on the bit's states τ0 ago.
    depth : array, (9,)
        c1, c2 and d0 of the linear depth of cut.
    drag : array, (n, 2)
        As in `Realisation`, for all states.
    side_force, side_rate, side_torque, side_held : array, (n, k), (k, n + 1), (k,), (k,)
        As in `Realisation`, for all states.
    """

    q: FloatArray
    steady: FloatArray
    A: FloatArray
    E: FloatArray
    B: FloatArray
    T: FloatArray
    C: FloatArray
    R: FloatArray
    input_delays: FloatArray
    late: tuple[tuple[float, FloatArray], ...]
    linear: FloatArray
    linear_delayed: FloatArray
    depth: FloatArray
    drag: FloatArray
    side_force: FloatArray
    side_rate: FloatArray
    side_torque: FloatArray
    side_held: FloatArray

    @property
    def top_torque(self) -> float:
        """Torque that turns the string in steady drilling."""
        return float(self.steady[1] + self.side_torque.sum())


# Relative stiffness below which a string is free: that of its modes spans five digits.
_FREE = 1e-10


@by_form
def _motion(plant: Plant) -> Evaluator:
    form = expressions(plant)
    made = form.structure
    own = [getattr(form.q, name) for name in plant.bit.values]
    load = ca.vertcat(*steady_load(form.bit, form.c, form.q))
    matrices = [made.A, made.E, made.B, made.T, made.C, made.R]
    late = [made.delays_of_inputs, *(value for term in made.late for value in term)]
    q = ca.vertcat(*[ca.SX(value) for value in (*form.c, *own)])
    depth = ca.horzcat(*linear_depth(plant))
    linear = linearisation(plant)(form.parameters)[:3]
    # States of blocks stand behind those of the string.
    size, (placed, parts) = made.A.shape[0], made.side_force.shape
    sides = [
        ca.vertcat(made.side_force, ca.SX(size - placed, parts)),
        ca.horzcat(made.side_rate[:, :-1], ca.SX(parts, size - placed), made.side_rate[:, -1]),
        made.side_torque,
        made.side_held,
        ca.vertcat(made.drag, ca.SX(size - placed, 2)),
    ]
    return evaluator(form, [q, load, *matrices, depth, *linear, *sides, *late])


def motion_arrays(plant: Plant, parameters: FloatArray) -> MotionArrays:
    """Return a plant's arrays at one set of parameters.

    Raises
    ------
    InputError
        If axial and torsional structure meet elsewhere than at the bit.
    """
    values = [value[0] for value in _motion(plant)(parameters[None])]
    q, steady, a, e, b, t, c, r, depth, linear, left, right, *others = values
    force, rate, friction, held, drag, inputs, *rest = others
    if e[1, 1] != 0.0 or e[3, 0] != 0.0:
        raise InputError("string", "a mass that couples x and theta", "uncoupled at the bit")
    late = tuple((float(rest[i][0, 0]), rest[i + 1]) for i in range(0, len(rest), 2))
    delayed = left @ right[:, :BIT_STATES]
    return MotionArrays(
        q.ravel(), steady.ravel(), a, e, b, t, c, r, inputs.ravel(), late, linear, delayed,
        depth.ravel(), drag, force, rate, friction.ravel(), held.ravel(),
    )  # fmt: skip


def stuck_states(arrays: MotionArrays, time: float) -> tuple[FloatArray, FloatArray]:
    """Return states of a string whose bit stands still while the top end goes on, (n,) twice.

    They are those when it came to rest from steady drilling, and so long after. The string is
    wound and pressed together at the speeds of the top end, without vibration of its own.

    Raises
    ------
    InputError
        If such a motion does not exist.
    """
    c = Coefficients(*arrays.q[: len(Coefficients._fields)])
    led = _led(arrays, -c.penetration_rate, -c.rotary_speed)
    if led is None:
        raise InputError("start", "stick", "steady where the string has no such motion")
    a, b = led
    return a, a + time * b


def kicked_states(
    arrays: MotionArrays, names: tuple[str, ...], axial: float, rotary: float
) -> FloatArray:
    """Return by how much all of a string moves faster whose bit is kicked, (n,).

    A bit alone has next to no inertia of a long string: what it is given is gone at once. So the
    string moves with it as if the bit were led slowly. Its top end goes on as it did, and so does
    what is no motion of the string: filters and integrals.

    Parameters
    ----------
    names : tuple of str
        Of the states.
    axial, rotary : float
        What the bit moves faster by.

    Raises
    ------
    InputError
        If the string has no such motion, as none without a source of energy.
    """
    ends = ("x", "theta", *_TOPS)
    follows = [name for name in names if f"d{name}" in names and name not in ends]
    moving = [names.index(f"d{name}") for name in follows]
    free = {*moving, *map(names.index, follows)}
    kick = np.zeros(len(arrays.A))
    kick[[1, 3]] = axial, rotary
    held = [i for i in range(len(names)) if i not in free]
    for speeds in ((axial, 0.0), (0.0, rotary)):
        if follows and any(speeds):
            led = _led(arrays, *speeds, held)
            if led is None:
                wanted = "0 where the string cannot follow its bit, or of a scenario `alone`"
                raise InputError("kick", max(speeds, key=abs), wanted)
            felt = np.abs(led[0]) > 1e-9 * np.abs(led[0][[1, 3, *moving]]).max()
            kick[moving] += np.where(felt, led[0], 0.0)[moving]
    return kick


def _led(
    arrays: MotionArrays, axial: float, rotary: float, held: Sequence[int] = ()
) -> tuple[FloatArray, FloatArray] | None:
    """Return a and b of X = a + b t where the bit is led at constant speeds; None without such.

    The states ``held`` stay as they are, whatever that takes.
    """
    n = arrays.A.shape[0]
    # X = a + b t obeys b = A (a + b t) + E (f + g t) with the bit's own rates known: both powers of
    # t at once, since a state that integrates takes its rate from the other.
    fixed = np.union1d(range(BIT_STATES), held).astype(int)
    free = np.setdiff1d(np.arange(n), fixed)
    b, a = np.zeros(n), np.zeros(n)
    b[[0, 2]] = a[[1, 3]] = axial, rotary
    forces = np.hstack([arrays.E, np.eye(n)[:, list(held)]])
    loaded = np.hstack([arrays.A[:, free], forces])
    own = np.hstack([np.eye(n)[:, free], np.zeros_like(forces)])
    unknown = np.block([[loaded, np.zeros_like(loaded)], [-own, loaded]])
    wanted = -np.concatenate([arrays.A[:, fixed] @ b[fixed], arrays.A[:, fixed] @ a[fixed] - b])
    found, *_ = scipy.linalg.lstsq(unknown, wanted, lapack_driver="gelsy")
    if not np.allclose(unknown @ found, wanted, rtol=0.0, atol=1e-8 * abs(wanted).max()):
        return None
    rates, places = np.split(found, 2)
    b[free], a[free] = rates[: free.size], places[: free.size]
    return a, b


def rest_states(arrays: MotionArrays, names: tuple[str, ...]) -> tuple[FloatArray, FloatArray]:
    """Return states of a string at rest without load or strain, (n,) twice.

    They are those just before and after an imposed top end sets off, at V0 t = Ω0 t = 0: what
    inertia hangs on it moves at once, and the bit stands still.

    Parameters
    ----------
    names : tuple of str
        Of the states.

    Raises
    ------
    InputError
        If nothing holds the string at its top, as with a drive that is free to turn.
    """
    c = Coefficients(*arrays.q[: len(Coefficients._fields)])
    speeds = np.array([c.penetration_rate, c.rotary_speed])
    before = np.zeros(len(arrays.A))
    for row, led in zip(arrays.C, arrays.R, strict=True):
        # A state that is an output as it is; those of a drive's law are none.
        if np.count_nonzero(row) == 1 and row.max() == 1.0:
            before[row.argmax()] = -led[1::2] @ speeds
    places = [i for i, name in enumerate(names) if f"d{name}" in names]
    moving = [names.index(f"d{names[i]}") for i in places]
    # Friction that slides in steady drilling is not there.
    wanted = arrays.E @ arrays.steady - arrays.side_force @ arrays.side_torque
    wanted += arrays.T[:, 1::2] @ speeds - arrays.A @ before
    held = arrays.A[np.ix_(moving, places)]
    found, _, rank, _ = np.linalg.lstsq(held, wanted[moving], rcond=_FREE)
    if rank < len(places):
        raise InputError("start", "rest", "steady where nothing holds the string at its top")
    before[places] = found
    after = before + arrays.drag @ speeds
    for k, row in enumerate((1, 3)):
        after += arrays.E[:, k] * (before[row] - after[row]) / arrays.E[row, k]
        after[row] = before[row]
    return before, after
