"""What the compiled integrator works on: settings, and the steps it has taken.

Numba takes named tuples of arrays; arrays are shared, so what one function writes the others
see. Times, lengths and torques are dimensionless throughout.
"""

from __future__ import annotations

from typing import Any, NamedTuple

# Torsion of the bit: Φ' > 0, held at Φ' = 0, Φ' < 0.
FORWARD, STUCK, REVERSE = 0, 1, 2
# Axial motion while in contact: Z' > 0, held at Z' = 0 by the wear flat, Z' < 0.
DOWN, HELD, UP = 0, 1, 2

# Events. All but the last two are zeros of functions that are positive in the present mode.
TORSION_RATE, RELEASE_FORWARD, RELEASE_REVERSE = 0, 1, 2
AXIAL_RATE, HELD_TO_UP, HELD_TO_DOWN, DEPTH = 3, 4, 5, 6
# An input at its limit, or its actuator at its fastest: one kind for each input.
AT_LIMIT, AT_RATE_LIMIT, KINDS = 7, 9, 11
BARRIER, BEGIN = 11, 12

# How the march stopped.
DONE, MORE_ROOM, COLLAPSE, REVERSED, TOO_DEEP, NOT_FINITE = 0, 1, 2, 3, 4, 5

# A break of level L is a jump of the L-th derivative of x or θ. The pair of order 5 keeps its
# order across breaks of a higher level than this in what is delayed.
LAST_LEVEL = 4
NO_BREAK = 99
MAX_FACE_LEVELS = 400

# Entries of `flags`.
LINEAR, MULTIPLE, FEEDBACK, CURRENT_DELAY, SAMPLED, ACTUATOR, RATE_FEEDBACK = 0, 1, 2, 3, 4, 5, 6
# Entries of `control`.
T_ON, MEASURE_DELAY, PERIOD, LAG_TIME = 0, 1, 2, 3
# Column of `gains`, behind K1 and K2.
PAST_AGE = 17
# Columns of `drive`: start; top-end offset, speed, acceleration for x and θ; strength and slope.
DRIVE_T, DRIVE_X, DRIVE_THETA, DRIVE_STRENGTH = 0, 1, 4, 7
# Entries of `probe`, beside an event function's ingredients.
# P_ROOM: what is left until each limit of AT_LIMIT, AT_RATE_LIMIT is met; negative beyond.
P_DEPTH, P_FORWARD, P_REVERSE, P_UP, P_DOWN, P_PRESSED, P_DELAY, P_U0, P_U1 = range(9)
P_ROOM, PROBES = 9, 13


# Columns of `History`.
START, LENGTH, X, THETA, ACTUATORS, HELD_U, REALS = 0, 1, 2, 8, 14, 22, 24
CONTACT, TORSION, AXIAL, LEVEL, LAG, FACE, PASSES, SATURATED, WHOLES = range(9)


class Settings(NamedTuple):
    """What does not change during a run; tuples where arrays would cost a reference count.

    Attributes
    ----------
    p : tuple, (9,)
        Groups in the order of `PARAMETER_NAMES`.
    flags : tuple of int
        LINEAR, MULTIPLE, FEEDBACK, ...
    control : tuple
        T_ON, MEASURE_DELAY, ...
    limit, rate : tuple, (2,)
        Of each input, infinite where there is none.
    gains : array, (g, 18)
        From when each set of gains holds; K1, then K2, by rows, on all states; PAST_AGE:
        how old the delayed outputs are, sampled: beyond the measurement's age, continuous:
        in all, 0 where there are none or they are those of τ(t) ago.
    drive : array, (m, 9)
        Motion of the top end beyond V0 t and Ω0 t, and rock strength, by pieces.
    linear : array, (5, 10)
        A1, A2, B of the linear model side by side; below them the rows of the linear depth
        of cut, and its steady value.
    lags : tuple, (2,)
        Constant delays: of the linear model and of the measured signal; 0 where there is
        none. See also `lag_of`.
    noise : array, (k, 4)
        Added to the k-th sample of the states.
    tolerance : tuple, (2,)
        rtol, atol.
    scale : tuple, (11,)
        Size of each event function, to tell zero from rounding.
    """

    p: Any
    flags: Any
    control: Any
    limit: Any
    rate: Any
    gains: Any
    drive: Any
    linear: Any
    lags: Any
    noise: Any
    tolerance: Any
    scale: Any


class History(NamedTuple):
    """The steps taken so far; step 0 is the motion before t = 0.

    Attributes
    ----------
    real : array, (cap, 24)
        START: time at which a step starts; LENGTH; X, THETA: coefficients of quintics in
        s = (t − start)/length; ACTUATORS: those of a cubic for each actuator; HELD_U: output
        of a sampled controller.
    whole : int array, (cap, 9)
        CONTACT, TORSION, AXIAL: mode; LEVEL: of the break at the start; LAG: step that holds
        t − τ at the start; FACE, PASSES: step that left the rock face, and how many blade
        pitches it lies back; SATURATED: see `Mode`.
    """

    real: Any
    whole: Any


class Mode(NamedTuple):
    """One smooth branch of the model, and where its delayed signals are found.

    Bit i of ``saturated`` says that an event of kind AT_LIMIT + i has set in.
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
    held0: float
    held1: float
