"""Semi-discretisation: the loop as a linear map over one time step (Eqs. 27-32).

Over a step Δt the delayed signals are replaced by a polynomial through their samples, and
the rest is solved exactly. The state of the map is X and the past samples of the delayed
signals w = R X only, so feedback of θ' is remembered as well as θ, and nothing more.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass

import numpy as np
import scipy.linalg
import scipy.sparse
import scipy.sparse.linalg

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.errors import InputError, UndecidedError, checked_integer
from drillctrl.base.kinds import checks_kinds
from drillctrl.delay.system import DelaySystem, low_rank_factors
from drillctrl.spectrum.characteristic import magnitude_bound

MAX_INTERVALS = 4000
_DEFAULT_LIMIT = 400


@dataclass(frozen=True, eq=False)
class SemiDiscretization:
    """The map y(i+1) = D y(i) with y = (X(i), w(i−1), …, w(i−M)).

    Attributes
    ----------
    P : array, (n, n)
        exp(A0 Δt).
    terms : tuple of (int, array (n, r))
        (k, Rk): Rk multiplies the sample w(i − k).
    signals : array, (r, n)
        w = signals @ X.
    step : float
        Δt.
    m, order : int
        Intervals per largest delay, and order of the interpolation.
    """

    P: FloatArray
    terms: tuple[tuple[int, FloatArray], ...]
    signals: FloatArray
    step: float
    m: int
    order: int

    def matrix(self) -> FloatArray:
        """Return D, shape (n + M r, n + M r); its nonzero spectrum is that of Eq. 30."""
        n, rank = self.P.shape[0], self.signals.shape[0]
        memory = max((k for k, _ in self.terms), default=0)
        d = np.zeros((n + memory * rank, n + memory * rank))
        d[:n, :n] = self.P
        for k, factor in self.terms:
            if k == 0:
                d[:n, :n] += factor @ self.signals
            else:
                start = n + (k - 1) * rank
                d[:n, start : start + rank] += factor
        if memory:
            d[n : n + rank, :n] = self.signals
            rows = np.arange(n + rank, n + memory * rank)
            d[rows, rows - rank] = 1.0
        return d

    def sparse_matrix(self) -> scipy.sparse.csc_array:
        """Return D as a sparse array; its nonzeros and the cost of using it grow as m."""
        n, rank = self.P.shape[0], self.signals.shape[0]
        memory = max((k for k, _ in self.terms), default=0)
        size = n + memory * rank
        top = scipy.sparse.lil_array((size, size))
        present = self.P.copy()
        for k, factor in self.terms:
            if k == 0:
                present += factor @ self.signals
            else:
                start = n + (k - 1) * rank
                top[:n, start : start + rank] = factor
        top[:n, :n] = present
        if memory:
            top[n : n + rank, :n] = self.signals
        rows = np.arange(n + rank, size)
        shift = scipy.sparse.coo_array((np.ones(rows.size), (rows, rows - rank)), (size, size))
        return (top.tocsc() + shift.tocsc()).tocsc()

    def multipliers_near(self, target: complex, count: int = 2) -> ComplexArray:
        """Return the eigenvalues of D nearest to a target, at a cost linear in m.

        Parameters
        ----------
        target : complex
            For a characteristic root s this is exp(s Δt). D − target must be regular.
        count : int
            How many.
        """
        # Complex throughout: a real matrix with a complex shift would be split in two.
        matrix = self.sparse_matrix().astype(complex)
        start = np.cos(np.arange(matrix.shape[0]))
        values = scipy.sparse.linalg.eigs(
            matrix, k=count, sigma=target, v0=start, return_eigenvectors=False
        )
        return np.asarray(values[np.argsort(np.abs(values - target), kind="stable")])

    def multipliers(self) -> ComplexArray:
        """Return the eigenvalues of D, largest modulus first."""
        matrix = self.matrix()
        if not np.isfinite(matrix).all():
            told = f"{self.P.shape[0]} states in steps of {self.step:g}"
            raise UndecidedError("system", told, "one whose numbers are not too large for a step")
        values = np.linalg.eigvals(matrix).astype(complex)
        return values[np.argsort(-np.abs(values), kind="stable")]

    @property
    def spectral_radius(self) -> float:
        """ρ(D) (Eq. 32)."""
        return float(np.abs(self.multipliers()[0]))

    @property
    def growth_rate(self) -> float:
        """ln ρ(D) / Δt, which tends to the spectral abscissa as Δt²."""
        radius = self.spectral_radius
        return math.log(radius) / self.step if radius > 0.0 else -math.inf


def default_intervals(system: DelaySystem, order: int) -> int:
    """Choose m so that each root right of the imaginary axis sees a fine step.

    Δt shrinks with the delay and with the largest possible |s|; a fixed m would show
    stable islands at small ω0 that do not exist.
    """
    reach = magnitude_bound(system, 0.0) * system.max_delay
    least, dense = (16, 2.0) if order == 2 else (40, 4.0)
    return min(_DEFAULT_LIMIT, max(least, math.ceil(dense * reach)))


@checks_kinds
def semidiscretize(system: DelaySystem, m: int | None = None, order: int = 1) -> SemiDiscretization:
    """Semi-discretise a delay system.

    Parameters
    ----------
    system : DelaySystem
        At least one delay. The largest is (m + ½) Δt (Eq. 27); the others fall where they
        fall.
    m : int, optional
        Number of intervals, 1 to 4000; by default `default_intervals`.
    order : int
        0: the nearest sample (the paper's scheme). 1: linear between the two neighbours.
        2: quadratic through the nearest sample and its neighbours.

    Raises
    ------
    InputError
        If m or the order is out of range, or there is no delay.

    Notes
    -----
    The integrals over the step come from the exponential of an augmented matrix, which
    needs no inverse of A0: A0 is singular at nδ0 = 1 + nψ/η².
    """
    if not system.delays:
        raise InputError("system", "a system without delay", "one with a delay")
    order = checked_integer("order", order, 0, 2)
    m = default_intervals(system, order) if m is None else m
    m = checked_integer("m", m, 1, MAX_INTERVALS)
    step = system.max_delay / (m + 0.5)
    _, signals = low_rank_factors(np.vstack([right for _, right in system.factors]))
    gather = np.linalg.pinv(signals)
    terms: dict[int, FloatArray] = {}
    for delay, delayed in zip(system.delays, system.delayed, strict=True):
        for lag, part in _delayed_terms(system.A0, delayed @ gather, delay / step, step, order):
            terms[lag] = terms.get(lag, 0.0) + part
    return SemiDiscretization(
        scipy.linalg.expm(system.A0 * step),
        tuple(sorted(terms.items())),
        signals,
        step,
        m,
        order,
    )


def _delayed_terms(
    a0: FloatArray, left: FloatArray, lag: float, step: float, order: int
) -> list[tuple[int, FloatArray]]:
    """Return (k, Rk) such that the step adds Σ Rk w(i − k), for one delay of ``lag`` steps.

    At the fraction σ of the step the signal is wanted at the sample position σ − lag.
    Nearest-sample and quadratic interpolation change their samples halfway between two of
    them, the linear one at a sample: the step is split there.
    """
    switch = 0.5 if order != 1 else 0.0
    breaks = [0.0, 1.0]
    for position in range(math.floor(-lag) - 1, math.ceil(-lag) + 3):
        fraction = position + switch + lag
        if 1e-9 < fraction < 1.0 - 1e-9:
            breaks.append(fraction)
    breaks.sort()
    parts = []
    for start, stop in itertools.pairwise(breaks):
        middle = 0.5 * (start + stop) - lag
        base = math.floor(middle) if order == 1 else round(middle)
        nodes = {0: [base], 1: [base, base + 1], 2: [base - 1, base, base + 1]}[order]
        # Too short a memory to centre the polynomial: use the latest samples there are.
        shift = min(0, -max(nodes))
        nodes = [node + shift for node in nodes]
        moments = _moments(a0, left, start, stop, step, order)
        for node in nodes:
            # Lagrange polynomial of the node in powers of (σ − start).
            weights = np.poly1d([1.0])
            for other in nodes:
                if other != node:
                    weights *= np.poly1d([1.0, start - lag - other]) / (node - other)
            coefficients = weights.coeffs[::-1]
            part = sum(c * moments[j] for j, c in enumerate(coefficients))
            parts.append((-node, np.asarray(part)))
    return parts


def _moments(
    a0: FloatArray, left: FloatArray, start: float, stop: float, step: float, order: int
) -> list[FloatArray]:
    """Return ∫ exp(A0 Δt (1 − σ)) (σ − start)^j dσ Δt · left over [start, stop], j ≤ order."""
    n, rank = left.shape
    size = n + rank * (order + 1)
    augmented = np.zeros((size, size))
    augmented[:n, :n] = a0 * step
    augmented[:n, n : n + rank] = left * step
    index = np.arange(n, size - rank)
    augmented[index, index + rank] = 1.0
    exponential = scipy.linalg.expm(augmented * (stop - start))
    tail = scipy.linalg.expm(a0 * step * (1.0 - stop))
    # Column block j holds the integral against (σ − start)^j / j!.
    blocks = [exponential[:n, n + j * rank : n + (j + 1) * rank] for j in range(order + 1)]
    return [tail @ block * math.factorial(j) for j, block in enumerate(blocks)]
