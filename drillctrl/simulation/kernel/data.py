"""What the compiled integrator works on: settings, and the steps it has taken.

Numba takes named tuples of arrays; arrays are shared, so what one function writes the others
see. Times, lengths and torques are dimensionless throughout. Nothing here depends on how many
states n, inputs m and outputs p a plant has: sizes are data, so another string or drive runs
in the same machine code.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

# Torsion of the bit: Φ' > 0, held at Φ' = 0, Φ' < 0.
FORWARD, STUCK, REVERSE = 0, 1, 2
# Axial motion while in contact: Z' > 0, held at Z' = 0 by the wear flat, Z' < 0; and on a face
# that falls away, which the bit follows, pressed on it by less than all of the wear-flat force.
DOWN, HELD, UP, RIDING = 0, 1, 2, 3

# Events that are zeros of functions which are positive in the present mode.
TORSION_RATE, RELEASE_FORWARD, RELEASE_REVERSE = 0, 1, 2
AXIAL_RATE, HELD_TO_UP, HELD_TO_DOWN, DEPTH = 3, 4, 5, 6
# The bit is back at the furthest angle that it has reached.
RESUME = 7
BARRIER, BEGIN = 8, 9
# Input i at its limit: AT_LIMIT + i; its actuator at its fastest: AT_LIMIT + m + i.
AT_LIMIT = 10

# How the march stopped.
DONE, MORE_ROOM, COLLAPSE, REVERSED, NOT_FINITE, PAUSED, DIVERGED, INTERRUPTED = range(8)

# A break of level L is a jump of the L-th derivative of x or θ. The pair of order 5 keeps its
# order across breaks of a higher level than this in what is delayed.
LAST_LEVEL = 4
NO_BREAK = 99
# Delayed instants that are followed: a pitch back, that at which the rock face was left, and
# from LATE on those of constant delays.
NEAR, FAR, LATE, DELAYS = 0, 1, 2, 5

# Entries of ``Settings.whole``: sizes of the plant, switches, and from ROWS on the matrix.
STATES, INPUTS, OUTPUTS = 0, 1, 2
# PAST: there are gains on delayed outputs; BACKWARDS: whether a bit may turn back; FED: place of
# the list of outputs that are fed back; SIDES: parts of the string that rub on the wall, without
# the bit's; PIVOT: rows whose rates others are told by, -1 for none.
(LINEAR, MULTIPLE, FEEDBACK, PAST, CURRENT_DELAY, SAMPLED, ACTUATOR, RATE_FEEDBACK, BACKWARDS,
 FED, SIDES, PIVOT) = range(3, 15)  # fmt: skip
PIVOTS = 3
ROWS = PIVOT + PIVOTS
# Entries of ``Settings.real``. Weight and torque on bit and depth of cut in steady drilling;
# what the accelerations of the bit gain by weight, E[1, 0], and by torque, E[3, 1]; and behind
# the clock the friction of the bit's part of the string on the wall, sliding and at rest.
WEIGHT, TORQUE, CUT, BY_WEIGHT, BY_TORQUE = 0, 1, 2, 3, 4
# The controller's clock; errors allowed; constant delays of the linear model and of the
# measured signal, 0 where there is none; bounds of x' and θ' (two each: at t = 0, and what
# they gain by time); size of each event function, to tell zero from rounding, and that of the
# last ones: the limits of inputs (m) and of their rates (m).
T_ON, MEASURE_DELAY, PERIOD, LAG_TIME, RTOL, ATOL, LAGS = 5, 6, 7, 8, 9, 10, 11
BOUNDS, WALL, WALL_HELD, SCALE = 13, 17, 18, 19
LIMITS = SCALE + AT_LIMIT
# Columns of `schedule`.
SINCE, PAST_AGE = 0, 1
# Columns of `drive`: start; top-end offset, speed, acceleration for x and θ; strength and slope.
DRIVE_T, DRIVE_X, DRIVE_THETA, DRIVE_STRENGTH = 0, 1, 4, 7
# Entries of `probe`, beside an event function's ingredients; behind them, from P_ROOM on, what
# is left until each limit is met (2 m, negative beyond), and the inputs (m).
(P_DEPTH, P_FORWARD, P_REVERSE, P_UP, P_DOWN, P_PRESSED, P_DELAY, P_WEIGHT, P_TORQUE,
 P_LEFT, P_ROOM) = range(11)  # fmt: skip

# Rows of `Work`.
STAGES = 7
END, INCREMENT, BETWEEN = 0, 1, 2

# Columns of `History`.
START, LENGTH, X, THETA, OTHERS = 0, 1, 2, 8, 14
QUINTIC, QUARTIC = 6, 5
CONTACT, TORSION, AXIAL, LEVEL, LAG, FACE, PASSES, SATURATED, BEHIND, WHOLES = range(10)

# What is known of the bit at an instant; the columns of a sample start with these.
BIT_COLUMNS = ("delay", "depth", "pressed", "weight_on_bit", "torque_on_bit", "contact")
C_DELAY, C_DEPTH, C_PRESSED, C_WEIGHT, C_TORQUE, C_CONTACT, C_STATES = range(7)


def sample_columns(
    states: Sequence[str], inputs: Sequence[str], outputs: Sequence[str]
) -> tuple[str, ...]:
    """Return the names of all columns of a sample, in the order of `sample.evaluate`.

    They are `BIT_COLUMNS`, the states, their rates of change (``d`` and the state's name; a
    rate that is a state is found among these), the inputs, and the outputs (``y_`` and their
    name where that is taken).
    """
    names = [*BIT_COLUMNS, *states, *(f"d{name}" for name in states), *inputs]
    taken = set(names)
    return (*names, *(f"y_{name}" if name in taken else name for name in outputs))


def motion_columns(
    states: Sequence[str], inputs: Sequence[str], outputs: Sequence[str]
) -> tuple[str, ...]:
    """Return the names of the columns that a motion has unless others are asked for."""
    taken = {*sample_columns(states, inputs, ())}
    new = [name for name in outputs if name not in taken]
    *bit, contact = BIT_COLUMNS
    return (*states, "ddx", "ddtheta", *bit, *inputs, *new, contact)


def history_width(states: int, inputs: int, sides: int = 0) -> int:
    """Return the number of columns of ``History.real``."""
    return OTHERS + QUARTIC * (states + inputs - 4) + inputs + sides


def vector_length(states: int, inputs: int, sides: int = 0) -> int:
    """Return the length of the vector that the march moves; see `Settings`."""
    return states + 4 * inputs + 6 + PIVOTS + sides


class Settings(NamedTuple):
    """What does not change during a run, in few arrays: each adds to the compiler's work.

    The motion is X' = A X + B u + T top + E (load − steady), of which X starts with x, x',
    θ, θ' of the bit, and the outputs are C X − R top. All of it acts on one vector,

        y = (X, actuators, held commands, u, top, load − steady, beyond, pivots, sides),

    of length n + m + m + m + 4 + 2 + m + 3 + k, so that A, B, T, E, C and R are the rows of one
    sparse matrix. In the linear model the bit's state a delay ago takes the place of top.
    ``beyond`` is by how much commands exceed their limits. ``pivots`` are the rates of the
    bit's and the top's speeds: the modes of a string follow these, and share the rest. ``sides``
    are what friction along the string brings beyond that of steady drilling, held over a step.

    Attributes
    ----------
    bit : tuple
        Ω0, V0 and n: last argument of `depth`, `turned` and `rates`.
    law : (int, array)
        Address of the law, and the coefficients and its own parameters: last argument of `load`.
    whole : int array
        STATES, ...; LINEAR, ...; ROWS; the list of FED.
    real : array
        WEIGHT, ...; T_ON, ...; SCALE; LIMITS, infinite where there is none.
    value : array
        Entries of the matrix. Those of row i are at whole[ROWS + i] to whole[ROWS + i + 1]
        here, and their columns there in ``whole``. Rows are the n of X', the p outputs, and
        what the linear depth of cut is beyond its steady value.
    schedule : array, (g, 2)
        SINCE when each set of gains holds; PAST_AGE: how old the delayed outputs are,
        sampled: beyond the measurement's age, continuous: in all, 0 where there are none or
        they are those of τ(t) ago.
    gains : array, (2, g, m, f)
        K1 on the f outputs that are fed back, and K2 on them delayed.
    drive : array, (k, 9)
        Motion of the top end beyond V0 t and Ω0 t, and rock strength, by pieces.
    noise : array, (k, f)
        Added to the k-th sample of these outputs.
    side : array, (k, n + 3 + 2 k)
        Of each part that rubs: speed per state, and per speed of the top end; torque sliding, and
        at most at rest; acceleration by the torque of each, the bit free to turn; and the bit held.
    """

    bit: Any
    law: Any
    whole: Any
    real: Any
    value: Any
    schedule: Any
    gains: Any
    drive: Any
    noise: Any
    side: Any


class History(NamedTuple):
    """The steps taken so far; step 0 is the motion before t = 0.

    Attributes
    ----------
    real : array, (cap, `history_width`)
        START: time at which a step starts; LENGTH; X, THETA: coefficients of quintics in
        s = (t − start)/length; OTHERS: those of a quartic for each further state and then
        each actuator; held output of a sampled controller; friction along the string.
    whole : int array, (cap, WHOLES)
        CONTACT, TORSION, AXIAL: mode; LEVEL: of the break at the start; LAG: step that holds
        t − τ at the start; FACE, PASSES: step that left the rock face, and how many blade
        pitches it lies back; SATURATED, BEHIND: see `Mode`.
    """

    real: Any
    whole: Any


class Mode(NamedTuple):
    """One smooth branch of the model, and where its delayed signals are found.

    Bit i of ``saturated`` says that event AT_LIMIT + i has set in. A bit that has turned back
    is ``behind`` until it is again where it turned, at ``turned_t`` and ``turned_theta``.
    """

    contact: int
    torsion: int
    axial: int
    saturated: int
    lag: int
    face: int
    passes: int
    lag0: int
    lag1: int
    lag2: int
    piece: int
    gains: int
    on: int
    behind: int
    turned_t: float
    turned_theta: float


class Work(NamedTuple):
    """Arrays that a step is tried in.

    Attributes
    ----------
    rates : array, (8, n + m)
        Rates of change at the stages; behind them those of an evaluation in between.
    stages : array, (8, probes + 2)
        Probe of each stage, with x' and θ' behind it; then that of an evaluation in between.
    vectors : array, (3, `vector_length`)
        END of the step, INCREMENT from its start; a vector BETWEEN.
    """

    rates: Any
    stages: Any
    vectors: Any
