"""Linear systems with constant delays: X' = A0 X(t) + Σ Ai X(t − τi) + B u, Y = C X."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
import numpy.typing as npt
import scipy.linalg

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.kinds import makes_of_kinds

# Rows and columns whose sums differ by more than this are scaled.
_UNBALANCED = 1e3


def _matrix(name: str, value: npt.ArrayLike, shape: tuple[int | None, int | None]) -> FloatArray:
    try:
        matrix = np.array(value, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise InputError(name, type(value).__name__, "a matrix of numbers") from None
    rows, columns = shape
    if (
        matrix.ndim != 2
        or rows not in (None, matrix.shape[0])
        or columns not in (None, matrix.shape[1])
    ):
        wanted = ("any" if size is None else str(size) for size in shape)
        raise InputError(name, f"array of shape {matrix.shape}", f"of shape ({', '.join(wanted)})")
    if not np.isfinite(matrix).all():
        raise InputError(name, "an array with NaN or infinity", "finite")
    matrix.setflags(write=False)
    return matrix


def _in_order(
    a0: FloatArray, delays: tuple[float, ...], delayed: tuple[FloatArray, ...]
) -> tuple[FloatArray, tuple[float, ...], tuple[FloatArray, ...]]:
    """Return A0, delays > 0 that increase, and their matrices."""
    matrices = {0.0: a0}
    for tau, matrix in sorted(zip(delays, delayed, strict=True), key=lambda pair: pair[0]):
        matrices[tau] = matrices[tau] + matrix if tau in matrices else matrix
    for matrix in matrices.values():
        matrix.setflags(write=False)
    a0 = matrices.pop(0.0)
    return a0, tuple(matrices), tuple(matrices.values())


@makes_of_kinds
@dataclass(frozen=True, eq=False)
class DelaySystem:
    """A linear time-invariant system of retarded type, with delays at its inputs and outputs too.

    Attributes
    ----------
    A0 : array, (n, n)
        Acts on X(t).
    delayed : tuple of array, (n, n)
        Ai, acts on X(t − τi).
    delays : tuple of float
        τi > 0, strictly increasing. They may be given in any order, equal ones and 0 too:
        equal ones are added up, and 0 is added to A0.
    B : array, (n, m), optional
        Acts on the inputs; without it there are none.
    C : array, (p, n), optional
        Yields the outputs; without it all states are outputs.
    state_names, input_names, output_names : tuple of str
        Names in order.
    input_delays, output_delays : tuple of float
        ≥ 0, how late each input acts and each output is seen; without them they are 0.
    feedback_delay : float
        τ ≥ 0 of K2 in u = K1 Y(t) + K2 Y(t − τ); the largest of ``delays`` if it is not given.

    Raises
    ------
    InputError
        If shapes, delays or names do not fit, or a number is not finite.
    """

    made_by = "plant_system makes of a point"

    A0: FloatArray
    delayed: tuple[FloatArray, ...] = ()
    delays: tuple[float, ...] = ()
    # What is left out is filled in below; from then on both are arrays.
    B: FloatArray = None  # type: ignore[assignment]
    C: FloatArray = None  # type: ignore[assignment]
    state_names: tuple[str, ...] = ()
    input_names: tuple[str, ...] = ()
    output_names: tuple[str, ...] = ()
    input_delays: tuple[float, ...] = ()
    output_delays: tuple[float, ...] = ()
    feedback_delay: float = None  # type: ignore[assignment]

    def __post_init__(self) -> None:
        a0 = _matrix("A0", self.A0, (None, None))
        n = a0.shape[0]
        if n == 0 or a0.shape[1] != n:
            raise InputError("A0", f"array of shape {a0.shape}", "square and not empty")
        delays = tuple(float(tau) for tau in self.delays)
        if not all(0.0 <= tau < np.inf for tau in delays):
            raise InputError("delays", delays, "finite and ≥ 0")
        if len(self.delayed) != len(delays):
            raise InputError("delayed", f"{len(self.delayed)} matrices", "one for each delay")
        delayed = tuple(_matrix("delayed", a, (n, n)) for a in self.delayed)
        if not all(a < b for a, b in zip((0.0, *delays), delays, strict=False)):
            a0, delays, delayed = _in_order(a0, delays, delayed)
        states = tuple(self.state_names)
        outputs = tuple(self.output_names)
        if self.C is None:
            outputs = outputs or states
        put = functools.partial(object.__setattr__, self)
        put("A0", a0)
        put("delays", delays)
        put("delayed", delayed)
        put("B", _matrix("B", np.zeros((n, 0)) if self.B is None else self.B, (n, None)))
        put("C", _matrix("C", np.eye(n) if self.C is None else self.C, (None, n)))
        for field, given, letter, size in (
            ("state_names", states, "x", n),
            ("input_names", tuple(self.input_names), "u", self.B.shape[1]),
            ("output_names", outputs, "y", self.C.shape[0]),
        ):
            names = given or tuple(f"{letter}{i + 1}" for i in range(size))
            if len(names) != size or len(set(names)) != size:
                raise InputError(field, names, f"{size} different names")
            put(field, names)
        for field, size in (("input_delays", self.B.shape[1]), ("output_delays", len(self.C))):
            late = tuple(float(delay) for delay in getattr(self, field)) or (0.0,) * size
            if len(late) != size or not all(0.0 <= delay < np.inf for delay in late):
                raise InputError(field, late, f"{size} numbers, finite and ≥ 0")
            put(field, late)
        fed_back = self.max_delay if self.feedback_delay is None else self.feedback_delay
        put("feedback_delay", checked_number("feedback_delay", fed_back, 0.0))

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

    def with_matrices(
        self, A0: FloatArray, delayed: Sequence[FloatArray], delays: tuple[float, ...]
    ) -> DelaySystem:
        """Return the system with other matrices of its states, all else as it is.

        Parameters
        ----------
        A0, delayed : array and sequence of array, (n, n)
            As of the system.
        delays : tuple of float
            Of these, > 0, strictly increasing.

        Raises
        ------
        InputError
            If a matrix is not finite.
        """
        square = (self.order, self.order)
        made = object.__new__(DelaySystem)
        made.__dict__.update({field: self.__dict__[field] for field in _FIELDS})
        made.__dict__.update(
            A0=_matrix("A0", A0, square),
            delayed=tuple(_matrix("delayed", matrix, square) for matrix in delayed),
            delays=delays,
        )
        return made

    @functools.cached_property
    def factors(self) -> tuple[tuple[FloatArray, FloatArray], ...]:
        """Minimal factors (L, R) of each Ai = L R: R X are the signals that are delayed.

        L has shape (n, r) and R shape (r, n), with r the numerical rank of Ai.
        """
        return tuple(low_rank_factors(matrix) for matrix in self.delayed)

    @functools.cached_property
    def norms(self) -> tuple[float, ...]:
        """Spectral norms of A0 and of each Ai."""
        return tuple(float(np.linalg.norm(part, 2)) for part in (self.A0, *self.delayed))

    def scaled_time(self, unit: float) -> DelaySystem:
        """Return the same system with time counted in ``unit`` old units.

        Every characteristic root is multiplied by ``unit``.
        """
        return replace(
            self,
            A0=self.A0 * unit,
            delayed=tuple(a * unit for a in self.delayed),
            delays=tuple(tau / unit for tau in self.delays),
            B=self.B * unit,
            input_delays=tuple(tau / unit for tau in self.input_delays),
            output_delays=tuple(tau / unit for tau in self.output_delays),
            feedback_delay=self.feedback_delay / unit,
        )

    @functools.cached_property
    def balanced(self) -> DelaySystem:
        """The system with its states scaled so that the matrices' norms are small.

        It is the system itself where that is so already. Inputs, outputs and roots stay.
        """
        size = self._size()
        rows, columns = size.sum(axis=1), size.sum(axis=0)
        if (rows <= _UNBALANCED * columns).all() and (columns <= _UNBALANCED * rows).all():
            return self
        return self.rescaled()

    def rescaled(self) -> DelaySystem:
        """Return `balanced`, to the last factor of 2 even where the norms are small already."""
        # States that drive no others, or that none drives, would be left as they are.
        size = self._size()
        size = size + np.finfo(float).eps * size.max()
        # Scales beyond the integers upset older versions, which look for places among them.
        with np.errstate(invalid="ignore"):
            _, (scale, _) = scipy.linalg.matrix_balance(size, permute=False, separate=True)
        ratio = scale[None, :] / scale[:, None]
        return replace(
            self,
            A0=self.A0 * ratio,
            delayed=tuple(a * ratio for a in self.delayed),
            B=self.B / scale[:, None],
            C=self.C * scale,
        )

    def _size(self) -> FloatArray:
        return np.asarray(sum((np.abs(matrix) for matrix in self.delayed), np.abs(self.A0)))


_FIELDS = tuple(field.name for field in fields(DelaySystem))


def low_rank_factors(matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Factor a matrix as L @ R with as few columns of L as its numerical rank.

    R consists of rows of the matrix itself, so that the delayed signals keep their exact
    coefficients.
    """
    rows = np.flatnonzero(matrix.any(axis=1))
    left = np.zeros((matrix.shape[0], 0))
    if rows.size == 0:
        return left, np.zeros((0, matrix.shape[1]))
    # Most delayed matrices have rank one, which shows at once.
    i, j = np.unravel_index(np.argmax(np.abs(matrix)), matrix.shape)
    column, row = matrix[:, j : j + 1] / matrix[i, j], matrix[i : i + 1]
    if np.abs(column * row - matrix).max() <= np.finfo(float).eps * abs(matrix[i, j]):
        return column, row
    _, triangle, order = scipy.linalg.qr(matrix[rows].T, mode="economic", pivoting=True)
    size = np.abs(np.diag(triangle))
    rank = int((size > size[0] * max(matrix.shape) * np.finfo(float).eps).sum())
    kept = np.sort(rows[order[:rank]])
    right = matrix[kept]
    left = np.zeros((matrix.shape[0], rank))
    if rank < rows.size:
        left[rows] = scipy.linalg.lstsq(right.T, matrix[rows].T)[0].T
    left[kept] = np.eye(rank)
    return left, right
