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

# Events. The first seven are zeros of functions that are positive in the present mode.
TORSION_RATE, RELEASE_FORWARD, RELEASE_REVERSE = 0, 1, 2
AXIAL_RATE, HELD_TO_UP, HELD_TO_DOWN, DEPTH = 3, 4, 5, 6
KINDS = 7
BARRIER, START = 7, 8

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
T_ON, MEASURE_DELAY, FEEDBACK_DELAY, PERIOD, LAG_TIME = 0, 1, 2, 3, 4
# Columns of `drive`: start; top-end offset, speed, acceleration for x and θ; strength and slope.
DRIVE_T, DRIVE_X, DRIVE_THETA, DRIVE_STRENGTH = 0, 1, 4, 7
# Entries of `probe`, beside an event function's ingredients.
P_DEPTH, P_FORWARD, P_REVERSE, P_UP, P_DOWN, P_PRESSED, P_DELAY, P_U0, P_U1 = range(9)
PROBES = 9


class Settings(NamedTuple):
    """What does not change during a run.

    Attributes
    ----------
    p : array, (9,)
        Groups in the order of `PARAMETER_NAMES`.
    flags : int array
        LINEAR, MULTIPLE, FEEDBACK, ...
    control : array
        T_ON, MEASURE_DELAY, ...
    limit, rate : array, (2,)
        Of each input, infinite where there is none.
    gain_times : array, (g,)
        From when each pair of gains holds.
    K1, K2 : array, (g, 2, 4)
        Gains on all states.
    drive : array, (m, 9)
        Motion of the top end beyond V0 t and Ω0 t, and rock strength, by pieces.
    A1, A2, B : array
        Linear model.
    depth_row : array, (2, 4)
        Linear depth of cut beyond 2πδ0 from X and Xd.
    lags : array, (3,)
        Constant delays: of the linear model, of the measured and of the fed back signal; 0
        where there is none.
    noise : array, (k, 4)
        Added to the k-th sample of the states.
    tolerance : array, (2,)
        rtol, atol.
    scale : array, (7,)
        Size of each event function, to tell zero from rounding.
    """

    p: Any
    flags: Any
    control: Any
    limit: Any
    rate: Any
    gain_times: Any
    K1: Any
    K2: Any
    drive: Any
    A1: Any
    A2: Any
    B: Any
    depth_row: Any
    lags: Any
    noise: Any
    tolerance: Any
    scale: Any


class History(NamedTuple):
    """The steps taken so far; step 0 is the motion before t = 0.

    Attributes
    ----------
    start, length : array, (cap,)
        Time at which a step starts, and how long it is.
    x, theta : array, (cap, 6)
        Coefficients of quintics in s = (t − start)/length.
    actuator : array, (cap, 2, 4)
        Coefficients of cubics, actuator states.
    held : array, (cap, 2)
        Output of a sampled controller.
    contact, torsion, axial : int array, (cap,)
        Mode.
    level : int array, (cap,)
        Level of the break at the start of a step.
    lag, face, passes : int array, (cap,)
        Step that holds t − τ at the start; step that left the rock face, and how many
        blade pitches it lies back.
    """

    start: Any
    length: Any
    x: Any
    theta: Any
    actuator: Any
    held: Any
    contact: Any
    torsion: Any
    axial: Any
    level: Any
    lag: Any
    face: Any
    passes: Any


class Mode(NamedTuple):
    """One smooth branch of the model, and where its delayed signals are found."""

    contact: int
    torsion: int
    axial: int
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
