"""Linear systems with constant delays: X' = A0 X(t) + Σ Ai X(t − τi) + B u, Y = C X."""

from __future__ import annotations

import functools
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import scipy.linalg

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError


def _matrix(name: str, value: npt.ArrayLike, shape: tuple[int | None, int | None]) -> FloatArray:
    try:
        matrix = np.array(value, dtype=float)
    except (TypeError, ValueError):
        raise InputError(name, type(value).__name__, "a matrix of numbers") from None
    wanted = tuple("any" if size is None else str(size) for size in shape)
    fits = matrix.ndim == 2 and all(
        want is None or want == have for want, have in zip(shape, matrix.shape, strict=True)
    )
    if not fits:
        raise InputError(name, f"array of shape {matrix.shape}", f"of shape ({', '.join(wanted)})")
    if not np.isfinite(matrix).all():
        raise InputError(name, "an array with NaN or infinity", "finite")
    matrix.setflags(write=False)
    return matrix


@dataclass(frozen=True, eq=False)
class DelaySystem:
    """A linear time-invariant system of retarded type.

    Attributes
    ----------
    A0 : array, (n, n)
        Acts on X(t).
    delayed : tuple of array, (n, n)
        Ai, acts on X(t − τi).
    delays : tuple of float
        τi > 0, strictly increasing.
    B : array, (n, m)
        Acts on the inputs.
    C : array, (p, n)
        Yields the outputs.
    state_names, input_names, output_names : tuple of str
        Names in order.

    Raises
    ------
    InputError
        If shapes, delays or names do not fit, or a number is not finite.
    """

    A0: FloatArray
    delayed: tuple[FloatArray, ...]
    delays: tuple[float, ...]
    B: FloatArray
    C: FloatArray
    state_names: tuple[str, ...] = ()
    input_names: tuple[str, ...] = ()
    output_names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        a0 = _matrix("A0", self.A0, (None, None))
        n = a0.shape[0]
        if n == 0 or a0.shape[1] != n:
            raise InputError("A0", f"array of shape {a0.shape}", "square and not empty")
        delays = tuple(float(tau) for tau in self.delays)
        increasing = all(a < b for a, b in zip((0.0, *delays), delays, strict=False))
        if not increasing or not np.isfinite(delays).all():
            raise InputError("delays", delays, "positive, finite and strictly increasing")
        if len(self.delayed) != len(delays):
            raise InputError("delayed", f"{len(self.delayed)} matrices", "one for each delay")
        put = functools.partial(object.__setattr__, self)
        put("A0", a0)
        put("delays", delays)
        put("delayed", tuple(_matrix("delayed", a, (n, n)) for a in self.delayed))
        put("B", _matrix("B", self.B, (n, None)))
        put("C", _matrix("C", self.C, (None, n)))
        for field, letter, size in (
            ("state_names", "x", n),
            ("input_names", "u", self.B.shape[1]),
            ("output_names", "y", self.C.shape[0]),
        ):
            names = tuple(getattr(self, field)) or tuple(f"{letter}{i + 1}" for i in range(size))
            if len(names) != size or len(set(names)) != size:
                raise InputError(field, names, f"{size} different names")
            put(field, names)

    @property
    def order(self) -> int:
        """Number of states, n."""
        return int(self.A0.shape[0])

    @property
    def max_delay(self) -> float:
        """Largest delay, 0 if there is none."""
        return self.delays[-1] if self.delays else 0.0

    def delayed_matrix(self, delay: float) -> FloatArray:
        """Return the matrix that acts on X(t − delay); zero if there is none."""
        for tau, matrix in zip(self.delays, self.delayed, strict=True):
            if tau == delay:
                return matrix
        return np.zeros_like(self.A0)

    @functools.cached_property
    def factors(self) -> tuple[tuple[FloatArray, FloatArray], ...]:
        """Minimal factors (L, R) of each Ai = L R: R X are the signals that are delayed.

        L has shape (n, r) and R shape (r, n), with r the numerical rank of Ai.
        """
        return tuple(low_rank_factors(matrix) for matrix in self.delayed)

    def scaled_time(self, unit: float) -> DelaySystem:
        """Return the same system with time counted in ``unit`` old units.

        Every characteristic root is multiplied by ``unit``.
        """
        return DelaySystem(
            self.A0 * unit,
            tuple(a * unit for a in self.delayed),
            tuple(tau / unit for tau in self.delays),
            self.B * unit,
            self.C,
            self.state_names,
            self.input_names,
            self.output_names,
        )


def low_rank_factors(matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Factor a matrix as L @ R with as few columns of L as its numerical rank.

    R consists of rows of the matrix itself, so that the delayed signals keep their exact
    coefficients.
    """
    rows = np.flatnonzero(matrix.any(axis=1))
    left = np.zeros((matrix.shape[0], 0))
    if rows.size == 0:
        return left, np.zeros((0, matrix.shape[1]))
    _, triangle, order = scipy.linalg.qr(matrix[rows].T, mode="economic", pivoting=True)
    size = np.abs(np.diag(triangle))
    rank = int((size > size[0] * max(matrix.shape) * np.finfo(float).eps).sum())
    kept = np.sort(rows[order[:rank]])
    right = matrix[kept]
    left = np.zeros((matrix.shape[0], rank))
    left[rows] = scipy.linalg.lstsq(right.T, matrix[rows].T)[0].T
    left[kept] = np.eye(rank)
    return left, right
