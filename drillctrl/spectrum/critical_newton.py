"""Newton's method on the frequency and the phase at which a loop with one delay is critical."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.delay.reduced import inverses

IntArray = npt.NDArray[np.intp]


def sharpened(
    A0: FloatArray, late: FloatArray, rows: IntArray, omega: FloatArray, phase: FloatArray
) -> tuple[IntArray, FloatArray, FloatArray, IntArray]:
    """Newton's method on det Δ(iω, φ) = 0; keep what converges nearby, once each."""
    start, omega, phase = omega, omega.copy(), phase.copy()
    eye = np.eye(A0.shape[1])
    good = np.ones(rows.shape, dtype=bool)
    step, turn = np.zeros(rows.shape), np.zeros(rows.shape)
    by_omega, by_phase = np.ones((2, *rows.shape), dtype=complex)
    # Those that still move.
    on = np.arange(rows.size)
    for _ in range(12):
        term = np.exp(-1j * phase[on])[:, None, None] * late[rows[on]]
        inverse = inverses(1j * omega[on, None, None] * eye - A0[rows[on]] - term)
        # Derivatives of ln det Δ: a step solves by_omega δω + by_phase δφ = −1.
        new_omega = 1j * np.trace(inverse, axis1=1, axis2=2)
        new_phase = 1j * np.einsum("qij,qji->q", inverse, term)
        fine = np.isfinite(new_omega) & np.isfinite(new_phase)
        by_omega[on[fine]], by_phase[on[fine]] = new_omega[fine], new_phase[fine]
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            across = (by_omega[on] * by_phase[on].conj()).imag
            along, around = by_phase[on].imag / across, -by_omega[on].imag / across
        # Where Δ is singular to the last bit nothing is left to do.
        good[on] = np.isfinite(along) & np.isfinite(around) | ~fine
        step[on] = np.where(good[on] & fine, along, 0.0)
        turn[on] = np.where(good[on] & fine, around, 0.0)
        scale = 0.05 * (1e-3 + np.abs(omega[on]))
        omega[on] += np.clip(step[on], -scale, scale)
        phase[on] += np.clip(turn[on], -0.2, 0.2)
        on = on[(np.abs(step[on]) > 1e-11 * omega[on]) | (np.abs(turn[on]) > 1e-11)]
        if not on.size:
            break
    keep = good & (np.abs(step) < 1e-8 * omega) & (np.abs(turn) < 1e-8) & (omega > 1e-9)
    keep &= np.abs(omega - start) < 0.05 * (1e-3 + start)
    rows, omega, phase = rows[keep], omega[keep], phase[keep] % (2.0 * np.pi)
    direction = -np.sign((by_omega[keep] / by_phase[keep]).imag).astype(np.intp)
    order = np.lexsort((phase, omega, rows))
    rows, omega, phase, direction = rows[order], omega[order], phase[order], direction[order]
    if not rows.size:
        return rows, omega, phase, direction
    apart = np.abs(np.diff(phase))
    same = (
        (np.diff(rows) == 0)
        & (np.diff(omega) < 1e-8 * omega[1:])
        & (np.minimum(apart, 2 * np.pi - apart) < 1e-7)
    )
    once = np.concatenate([[True], ~same])
    return rows[once], omega[once], phase[once], direction[once]
