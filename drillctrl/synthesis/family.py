"""The closed loop as a family over its gain vector, made to be evaluated often."""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg
from scipy.linalg.lapack import dgeev

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.errors import InputError, UndecidedError
from drillctrl.delay.closing import close_loop, feedback_lags, loop_channels, with_terms
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.delay.system import DelaySystem
from drillctrl.spectrum import characteristic
from drillctrl.spectrum.pseudospectral import (
    _blocks,
    degree_for,
    degree_for_reach,
    degrees_for,
    generator_matrix,
)
from drillctrl.spectrum.roots import spectral_abscissa
from drillctrl.synthesis.boxes import (
    bound_of_entries,
    counted_from,
    largest_loop,
    natural_speed,
)
from drillctrl.synthesis.expansion import Expansion, expand
from drillctrl.synthesis.signals import Signals, signals_of

# Gains that need more make the loop far faster than its plant; their loops are looked at again.
_FINEST = 64
_CIRCLE = np.exp(2j * np.pi * np.arange(32) / 32)


@dataclass(frozen=True)
class ActiveRoot:
    """A root that is taken to be rightmost.

    Attributes
    ----------
    omega : float
        Its imaginary part; 0 for a real root.
    multiplicity : int
        How often it is counted; a complex one implies its conjugate.
    """

    omega: float
    multiplicity: int

    @property
    def equations(self) -> int:
        """Number of real conditions."""
        return self.multiplicity * (1 if self.omega == 0.0 else 2)


@dataclass(frozen=True, eq=False)
class LoopFamily:
    """All loops that one structure closes around one plant.

    The collocated generator is affine in the gains, M(g) = M0 + Σ hj bj cjᵀ with h = S g:
    an entry hj of (K1, K2) acts from one output, now or delayed, on one input.

    Attributes
    ----------
    system : DelaySystem
        The plant.
    feedback : FeedbackStructure
        The structure.
    base : array, (q, q)
        M0, the generator with the fixed gains and the free ones at zero.
    actuation : array, (q, c)
        Columns bj.
    measurement : array, (c, q)
        Rows cjᵀ.
    spread : array, (c, k)
        S: how the entries of the gain matrices follow the gain vector.
    plain : DelaySystem
        The loop with the fixed gains only.
    drive, seen : array, (n, c) and (c, n)
        The same columns and rows in the states of the plant.
    lags : array, (c,)
        Delay through which each entry acts.
    degree : int
        Of the collocation.
    line : float
        Real part near which it resolves the rightmost roots.
    """

    system: DelaySystem
    feedback: FeedbackStructure
    base: FloatArray
    actuation: FloatArray
    measurement: FloatArray
    spread: FloatArray
    plain: DelaySystem
    drive: FloatArray
    seen: FloatArray
    lags: FloatArray
    degree: int
    line: float = 0.0

    def loop(self, gains: FloatArray) -> DelaySystem:
        """Return the closed loop at a gain vector."""
        return close_loop(self.system, self.feedback, *self.feedback.gains(gains))

    def matrix(self, gains: FloatArray) -> FloatArray:
        """Return the collocated generator at a gain vector, shape (q, q)."""
        return self.base + (self.actuation * (self.spread @ gains)) @ self.measurement

    def abscissa(self, gains: FloatArray) -> tuple[float, FloatArray]:
        """Return the collocated spectral abscissa and its gradient.

        Parameters
        ----------
        gains : array, (k,)
            The gain vector.

        Returns
        -------
        value : float
            Largest real part of an eigenvalue of M(g).
        gradient : array, (k,)
            Σ Sij Re (yᴴ bi)(ciᵀ x) / (yᴴ x) for the rightmost eigenvalue; one of the
            gradients there are where several eigenvalues are rightmost.
        """
        real, imag, left, right, info = dgeev(self.matrix(gains), 1, 1)
        if info:
            return np.inf, np.zeros_like(gains)
        top = int(np.argmax(real))
        y, x = left[:, top], right[:, top]
        if imag[top] != 0.0:
            # LAPACK stores a conjugate pair as real and imaginary columns.
            first = top if imag[top] > 0 else top - 1
            y = left[:, first] + 1j * left[:, first + 1]
            x = right[:, first] + 1j * right[:, first + 1]
        y = y.conj()
        scale = y @ x
        slopes = ((y @ self.actuation) * (self.measurement @ x)) @ self.spread
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            gradient = np.real(slopes / scale)
        return float(real[top]), np.where(np.isfinite(gradient), gradient, 0.0)

    def value(self, gains: FloatArray) -> float:
        """Return the collocated spectral abscissa alone, in a third of the time."""
        real, _, _, _, info = dgeev(self.matrix(gains), 0, 0)
        return np.inf if info else float(real.max())

    def abscissas(self, gains: FloatArray) -> FloatArray:
        """Return the collocated spectral abscissa at many gain vectors, (q, k) → (q,)."""
        if len(gains) == 0:
            return np.zeros(0)
        return np.asarray(np.linalg.eigvals(self.matrices(gains)).real.max(axis=1))

    def matrices(self, gains: FloatArray) -> FloatArray:
        """Return the collocated generator at many gain vectors, (r, k) → (r, q, q)."""
        entries = gains @ self.spread.T
        return np.asarray(self.base + (self.actuation * entries[:, None, :]) @ self.measurement)

    def active_gradients(
        self, gains: FloatArray, width: float = 1e-6
    ) -> tuple[FloatArray, tuple[ActiveRoot, ...]]:
        """Return the gradients of all roots within ``width`` of the abscissa, (q, k)."""
        values, left, right = scipy.linalg.eig(self.matrix(gains), left=True, right=True)
        top = values.real.max()
        active = np.flatnonzero((values.real > top - width * (1 + abs(top))) & (values.imag >= 0))
        y, x = left[:, active].conj().T, right[:, active]
        scale = np.einsum("qn,nq->q", y, x)
        slopes = ((y @ self.actuation) * (self.measurement @ x).T) @ self.spread
        roots = tuple(ActiveRoot(float(s.imag), 1) for s in values[active])
        return np.real(slopes / scale[:, None]), roots

    def determinant(self, s: ComplexArray, gains: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """Return det Δ(s) of the loop and its derivatives by the gains.

        Parameters
        ----------
        s : array, (q,)
            Points that are no roots.
        gains : array, (k,)
            The gain vector.

        Returns
        -------
        array, (q,), and array, (q, k)
            ∂ det Δ/∂hj = −det Δ · cj(s)ᵀ Δ⁻¹ bj, exact.
        """
        seen = self.seen_at(s)
        delta = self.characteristic_matrix(s, gains)
        value = np.linalg.det(delta)
        response = np.linalg.inv(delta) @ self.drive
        slopes = -value[:, None] * np.einsum("qkn,qnk->qk", seen, response)
        return value, slopes @ self.spread

    @property
    def is_affine(self) -> bool:
        """Whether det Δ is affine in all gains together: they drive one and the same input."""
        return bool(np.linalg.matrix_rank(self.drive) == 1) if self.drive.size else False

    @functools.cached_property
    def signals(self) -> Signals | None:
        """What its past and gains act on, where it has many states and few of these."""
        return signals_of(self.plain, self.drive, self.seen, self.lags)

    @functools.cached_property
    def expansion(self) -> Expansion | None:
        """The determinant as a quasi-polynomial; None with several inputs or delays."""
        if not self.is_affine or len(self.plain.delays) > 1 or self.signals is not None:
            return None
        return expand(self.plain, self.drive, self.seen, self.lags > 0.0)

    def taylor(
        self, s: ComplexArray, gains: FloatArray, terms: int
    ) -> tuple[ComplexArray, ComplexArray]:
        """Expand det Δ(s) of the loop about many places.

        Parameters
        ----------
        s : array, (q,)
            Places; they may be roots.
        gains : array, (k,)
            The gain vector.
        terms : int
            Number of coefficients.

        Returns
        -------
        array, (q, terms), and array, (q, terms, k)
            Taylor coefficients and their derivatives by the gains; of many states over the
            size of det Δ at the place without feedback.
        """
        if self.expansion is not None:
            each = self.expansion.taylor(s, terms)
            slopes = each[:, 1:].transpose(0, 2, 1) @ self.spread
            return each[:, 0] + slopes @ gains, slopes
        # Samples on a circle: aliasing falls with the power points − terms.
        radius = self.reach(s)
        ring = s[:, None] + radius[:, None] * _CIRCLE
        if self.signals is None:
            value, slope = self.determinant(ring.ravel(), gains)
        else:
            value, slope = self.signals.determinant(ring, s, self.spread @ gains)
            slope = slope @ self.spread
        wave = _CIRCLE[:, None] ** -np.arange(terms) / _CIRCLE.size
        scale = radius[:, None] ** -np.arange(terms)
        slopes = np.einsum("qpk,pl->qlk", slope.reshape(*ring.shape, gains.size), wave)
        return value.reshape(ring.shape) @ wave * scale, slopes * scale[..., None]

    def reach(self, s: ComplexArray) -> FloatArray:
        """Return radii around places on which `taylor` has its samples, (q,) → (q,).

        On a wider circle, where exp(−sτ) turns far, det Δ would be taken for another function.
        """
        longest = max([*self.plain.delays, *self.lags.tolist()], default=0.0)
        radius = np.minimum(0.1 * (1.0 + np.abs(s)), 4.0 / (longest or 1.0))
        return radius if self.signals is None else np.minimum(radius, self.signals.near(s))

    def seen_at(self, s: ComplexArray) -> ComplexArray:
        """Return the rows cj(s), (q, c, n): a delayed output is seen through exp(−sτ)."""
        return np.asarray(np.exp(-np.multiply.outer(s, self.lags))[:, :, None] * self.seen)

    def characteristic_matrix(self, s: ComplexArray, gains: FloatArray) -> ComplexArray:
        """Return Δ(s) of the loop at a gain vector, (q, n, n)."""
        drive = self.drive * (self.spread @ gains)
        fed_back = np.einsum("nk,qkm->qnm", drive, self.seen_at(s))
        return np.asarray(characteristic.matrix(self.plain, s) - fed_back)

    def exact(self, gains: FloatArray) -> float:
        """Return the spectral abscissa of the delay system, infinite where it cannot be told."""
        try:
            return spectral_abscissa(self.loop(gains))
        except UndecidedError:
            return np.inf

    def eigenvalues(self, gains: FloatArray) -> ComplexArray:
        """Return the eigenvalues of the collocated generator, rightmost first."""
        values = np.linalg.eigvals(self.matrix(gains)).astype(complex)
        return values[np.argsort(-values.real, kind="stable")]


def loop_family(
    system: DelaySystem,
    feedback: FeedbackStructure,
    degree: int | None = None,
    line: float = 0.0,
) -> LoopFamily:
    """Assemble the family of closed loops.

    Parameters
    ----------
    system : DelaySystem
        The plant, with at least one delay where the structure uses delayed outputs.
    feedback : FeedbackStructure
        Names inputs, outputs, bounds and ties.
    degree : int, optional
        Of the collocation; by default what the largest gains within the bounds need.
    line : float
        Real part near which rightmost roots are to be resolved: with s = line + z the delayed
        terms grow by exp(−line τ), and a collocation shows no root further left than z of
        some −2/τ.
    """
    drive, measure = loop_channels(system, feedback)
    spread = feedback.spread
    entries = np.flatnonzero(spread.any(axis=1))
    every_lag = feedback_lags(system, feedback)
    late, target, source = np.unravel_index(entries, every_lag.shape)
    lags = every_lag.ravel()[entries]
    if late.any() and not system.feedback_delay:
        raise InputError("structure", feedback.name, "without delayed outputs: no delay is known")
    plain = with_terms(system, drive, measure, feedback.fixed.reshape(every_lag.shape), every_lag)
    # Carry what the plant delays anyway and what is fed back late: the measured outputs, or
    # what is sent to the inputs where that is less.
    nothing = np.zeros((system.order, 0)), np.zeros((0, system.order))
    carried = dict(zip(plain.delays, plain.factors, strict=True))
    sent: dict[float, list[int]] = {}
    for lag in sorted(set(lags[lags > 0.0].tolist())):
        left, right = carried.get(lag, nothing)
        wide = right
        for output in sorted(set(source[lags == lag].tolist())):
            wider = np.vstack([wide, measure[output]])
            if np.linalg.matrix_rank(wider) > wide.shape[0]:
                wide = wider
        more = len(wide) - len(right)
        inputs = sorted(set(target[lags == lag].tolist()))
        if len(inputs) < more:
            sent[lag] = inputs
            none = np.zeros((len(inputs), system.order))
            carried[lag] = np.hstack([left, drive[:, inputs]]), np.vstack([right, none])
        else:
            carried[lag] = np.hstack([left, np.zeros((system.order, more))]), wide
    delays = tuple(sorted(carried))
    signals = [carried[delay] for delay in delays]
    plain = replace(plain, delays=delays, delayed=tuple(map(plain.delayed_matrix, delays)))
    if degree is None:
        # Three more than suffices to start an iteration on the characteristic equation.
        largest = largest_loop(system, feedback, bound_of_entries(feedback), line)
        resolved = degree_for_reach(natural_speed(system, feedback, line) * largest.max_delay)
        degree = min(degree_for(largest), max(_FINEST, resolved)) + 3
    shifted = replace(plain, A0=counted_from(plain, line)[0])
    growth = [np.exp(-line * delay) for delay in delays]
    factors = [(left * up, right) for (left, right), up in zip(signals, growth, strict=True)]
    base = generator_matrix(shifted, degree, factors)
    size, n = base.shape[0], system.order
    base += line * np.eye(size)
    # The oldest values of the signals of each delay.
    degrees = degrees_for(delays, degree)
    widths = [p * len(carried[delay][1]) for p, delay in zip(degrees, delays, strict=True)]
    ends = n + np.cumsum(widths, dtype=int)
    actuation = np.zeros((size, entries.size))
    actuation[:n] = drive[:, target]
    measurement = np.zeros((entries.size, size))
    for row, (lag, entering, output) in enumerate(
        zip(lags.tolist(), target.tolist(), source.tolist(), strict=True)
    ):
        if not lag:
            measurement[row, :n] = measure[output]
            continue
        place = delays.index(lag)
        right, points, end = carried[lag][1], degrees[place], ends[place]
        rank = len(right)
        if lag in sent:
            signal = rank - len(sent[lag]) + sent[lag].index(entering)
            actuation[:n, row] = 0.0
            actuation[end - points * rank : end, row] = _blocks(points, rank)[1][:, signal] / lag
            measurement[row, :n] = measure[output]
        else:
            weights = np.linalg.lstsq(right.T, measure[output], rcond=None)[0]
            measurement[row, end - rank : end] = weights * growth[place]
    return LoopFamily(
        system,
        feedback,
        base,
        actuation,
        measurement,
        spread[entries],
        plain,
        drive[:, target],
        measure[source],
        lags,
        degree,
        line,
    )
