"""A delay system as a discrete-time or a rational python-control system."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy.linalg

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_integer
from drillctrl.base.extras import required
from drillctrl.base.kinds import checks_kinds
from drillctrl.delay.system import DelaySystem
from drillctrl.robustness.transfer import frequency_response
from drillctrl.spectrum.characteristic import magnitude_bound
from drillctrl.spectrum.semidiscretization import semidiscretize

if TYPE_CHECKING:
    import control

_BAND_POINTS = 400


@checks_kinds
def lifted_system(system: DelaySystem, m: int | None = None, order: int = 1) -> control.StateSpace:
    """Return the semi-discretised system as discrete-time python-control states.

    Parameters
    ----------
    system : DelaySystem
        At least one delay. A closed loop has its feedback inside.
    m, order : int, optional
        As in `semidiscretize`.

    Returns
    -------
    control.StateSpace
        Its poles are the eigenvalues of D (Eq. 30), its sampling time is Δt, its inputs and
        outputs are those of the system. The input is held over a step. States are those of
        the system, then the past samples of the delayed signals, ``w1[-1]`` and so on.
    """
    control = required("control", "control")

    _check_channels(system)
    scheme = semidiscretize(system, m, order)
    matrix = scheme.matrix()
    n, inputs = system.B.shape
    # ∫ exp(A0 s) ds B over a step, from an augmented exponential: A0 may be singular.
    augmented = np.zeros((n + inputs, n + inputs))
    augmented[:n, :n], augmented[:n, n:] = system.A0 * scheme.step, system.B * scheme.step
    drive = np.zeros((len(matrix), inputs))
    drive[:n] = scipy.linalg.expm(augmented)[:n, n:]
    measure = np.zeros((system.C.shape[0], len(matrix)))
    measure[:, :n] = system.C
    rank = scheme.signals.shape[0]
    past = [f"w{i + 1}[-{k + 1}]" for k in range((len(matrix) - n) // rank) for i in range(rank)]
    return control.ss(
        matrix,
        drive,
        measure,
        np.zeros((len(measure), inputs)),
        scheme.step,
        states=[*system.state_names, *past],
        inputs=list(system.input_names),
        outputs=list(system.output_names),
    )


def _check_channels(system: DelaySystem) -> None:
    if any(system.input_delays) or any(system.output_delays):
        raise InputError("system", "with late inputs or outputs", "without them here")


@dataclass(frozen=True, eq=False)
class PadeApproximation:
    """A rational approximation of a delay system.

    Attributes
    ----------
    system : control.StateSpace
        The approximation.
    degree : int
        Of the Padé approximation of each delayed signal.
    highest_frequency : float
        Up to which the error was looked at.
    error : float
        Largest error of the frequency response there, relative to its largest gain.
    frequency : float
        Where it is.
    """

    system: control.StateSpace
    degree: int
    highest_frequency: float
    error: float
    frequency: float


@checks_kinds
def pade_approximation(
    system: DelaySystem, degree: int = 4, highest_frequency: float | None = None
) -> PadeApproximation:
    """Replace every delayed signal by a Padé approximation, and say how wrong that is.

    Parameters
    ----------
    system : DelaySystem
        At least one delay, input and output.
    degree : int
        1 to 20.
    highest_frequency : float, optional
        The error is looked at from 0 to here; by default a bound of what the system does.

    Raises
    ------
    InputError
        If the degree is out of range, or there is nothing to approximate.
    """
    control = required("control", "control")

    degree = checked_integer("degree", degree, 1, 20)
    _check_channels(system)
    if not system.delays or not system.B.size or not system.C.size:
        raise InputError("system", "without delay, input or output", "one with all three")
    n = system.order
    a, columns = system.A0.copy(), [np.eye(n)]
    blocks: list[FloatArray] = []
    for delay, (left, right) in zip(system.delays, system.factors, strict=True):
        numerator, denominator = control.pade(delay, degree)
        lag = control.ss(control.tf(numerator, denominator))
        rank = right.shape[0]
        unit = np.eye(rank)
        a = a + left @ np.kron(unit, lag.D) @ right
        columns.append(left @ np.kron(unit, lag.C))
        blocks.append(np.kron(unit, lag.A))
        columns[0] = np.vstack([columns[0], np.kron(unit, lag.B) @ right])
    size = len(columns[0])
    dynamics = np.zeros((size, size))
    dynamics[:n] = np.hstack([a, *columns[1:]])
    dynamics[n:, :n] = columns[0][n:]
    dynamics[n:, n:] = scipy.linalg.block_diag(*blocks)
    drive = np.zeros((size, system.B.shape[1]))
    drive[:n] = system.B
    measure = np.hstack([system.C, np.zeros((system.C.shape[0], size - n))])
    rational = control.ss(
        dynamics,
        drive,
        measure,
        0,
        inputs=list(system.input_names),
        outputs=list(system.output_names),
    )
    top = magnitude_bound(system, 0.0) if highest_frequency is None else highest_frequency
    omega = np.linspace(0.0, top, _BAND_POINTS + 1)[1:]
    exact = frequency_response(system, omega)
    near = rational(1j * omega, squeeze=False)
    apart = np.linalg.norm(np.moveaxis(near - exact, -1, 0), 2, axis=(1, 2))
    gain = np.linalg.norm(np.moveaxis(exact, -1, 0), 2, axis=(1, 2)).max()
    worst = int(apart.argmax())
    return PadeApproximation(
        rational, degree, float(top), float(apart[worst] / gain), float(omega[worst])
    )
