"""Where one loop of few delayed signals is critical, from its response over frequency.

A root lies at iω for some delay where an eigenvalue of the r × r response R(iω − A0)⁻¹L has modulus
one. The response is a sum over the poles of A0, and so smooth on the scale of the distance to
the nearest of them: places that crowd around each pole see every change of it.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import elementwise

from drillctrl.base.arrays import ComplexArray, FloatArray

# Places on either side of a pole, from a fraction of its distance to the axis outwards.
_PLACES, _NEAREST, _FURTHEST = 80, 0.05, 1e9
_SAFE_CONDITION = 1e8
# By how much the logarithm of a modulus may miss 0 at a turning point that is looked at closely,
# and at a zero.
_NEAR, _AT = 0.5, 1e-6


def modal_response(
    A0: FloatArray, left: FloatArray, right: FloatArray
) -> tuple[ComplexArray, ComplexArray] | None:
    """Return the poles of A0, (n,), and their residues, (n, r, r); None where no basis is good."""
    poles, vectors = np.linalg.eig(A0)
    if not np.linalg.cond(vectors) < _SAFE_CONDITION:
        return None
    driven = np.linalg.solve(vectors, left.astype(complex))
    return poles, (right @ vectors).T[:, :, None] * driven[:, None, :]


def critical_frequencies(
    poles: ComplexArray, residues: ComplexArray
) -> tuple[FloatArray, FloatArray]:
    """Return ω and φ where exp(−iφ) times the response has an eigenvalue 1."""
    omega = _places(poles, float(np.linalg.norm(residues, axis=(1, 2)).sum()))
    logs = _logs(omega, poles, residues)
    steps = np.diff(logs, axis=0)
    turning = (steps[1:] * steps[:-1] <= 0.0) & (np.abs(logs[1:-1]) < _NEAR)
    turns = 1 + np.flatnonzero(turning.any(axis=1))
    closer = np.linspace(omega[turns - 1], omega[turns + 1], 34)[1:-1]
    omega = np.unique(np.concatenate([omega, closer.ravel()]))
    logs = _logs(omega, poles, residues)
    at, column = np.nonzero(logs[:-1] * logs[1:] <= 0.0)

    def passes(frequency: FloatArray, which: FloatArray) -> FloatArray:
        found = _logs(frequency, poles, residues)
        return np.asarray(found[np.arange(frequency.size), which.astype(int)])

    root = elementwise.find_root(passes, (omega[at], omega[at + 1]), args=(column,))
    omega = np.unique(root.x[np.isfinite(root.x)])
    factors = _factors(omega, poles, residues)
    # Several may pass the circle at one frequency, each at a phase of its own.
    where, which = np.nonzero(np.abs(np.log(np.abs(factors))) < _AT)
    return omega[where], np.angle(factors[where, which])


def _places(poles: ComplexArray, gain: float) -> FloatArray:
    """Return frequencies around each pole, up to where no response reaches one."""
    largest = float(np.abs(poles).max())
    most = 1.01 * (largest + gain)
    width = np.maximum(np.abs(poles.real), 1e-12 * largest)[:, None]
    away = width * np.concatenate([[0.0], np.geomspace(_NEAREST, _FURTHEST, _PLACES)])
    middle = np.abs(poles.imag)[:, None]
    wide = np.geomspace(1e-6 * most, most, 200)
    places = np.concatenate([(middle + away).ravel(), (middle - away).ravel(), wide])
    return np.unique(places[(places > 0.0) & (places <= most)])


def _factors(omega: FloatArray, poles: ComplexArray, residues: ComplexArray) -> ComplexArray:
    """Return the eigenvalues of the response at each frequency, (k, r)."""
    rank = residues.shape[1]
    with np.errstate(divide="ignore", invalid="ignore"):
        shares = 1.0 / (1j * omega[:, None] - poles)
    response = np.nan_to_num(shares @ residues.reshape(poles.size, -1))
    return np.asarray(np.linalg.eigvals(response.reshape(-1, rank, rank)))


def _logs(omega: FloatArray, poles: ComplexArray, residues: ComplexArray) -> FloatArray:
    """Return the logarithms of the moduli of the eigenvalues, largest first, (k, r)."""
    moduli = np.sort(np.abs(_factors(omega, poles, residues)), axis=1)[:, ::-1]
    return np.asarray(np.log(np.maximum(moduli, 1e-300)))
