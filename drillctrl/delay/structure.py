"""Output-feedback structures u = K1 Y(t) + K2 Y(t − τ0) (Eqs. 36-40), and closing the loop."""

from __future__ import annotations

import functools
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_number
from drillctrl.base.kinds import makes_of_kinds

BoolArray = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Tie:
    """One gain that follows another: ``gain`` = ``factor`` · ``leader``.

    Attributes
    ----------
    gain, leader : str
        Names such as ``K2_1``; the leader is itself not tied.
    factor : float
        Not zero.
    """

    gain: str
    leader: str
    factor: float = 1.0


@makes_of_kinds
@dataclass(frozen=True, eq=False)
class FeedbackStructure:
    """Which outputs are fed back to which inputs, now and delayed, and within what bounds.

    An entry of a gain matrix whose lower and upper bounds coincide is fixed, one that is
    tied follows its leader; all others are free. The free gains, K1 before K2 and row by
    row, form the gain vector.

    Attributes
    ----------
    name : str
        Name for summaries.
    outputs : tuple of str
        Names of the states that are measured, in the order of Y.
    K1_lower, K1_upper : array, (m, p)
        Bounds of the gains on Y(t).
    K2_lower, K2_upper : array, (m, p)
        Bounds of the gains on Y(t − τ).
    inputs : tuple of str
        Names of the inputs that are driven, m of them.
    ties : tuple of Tie
        Gains that follow others, within the bounds of both.

    Raises
    ------
    InputError
        If shapes do not fit, a bound is not finite, bounds are swapped, or a tie names no
        free gain or leaves its leader no room.
    """

    made_by = "preset_structure('case1')"

    name: str
    outputs: tuple[str, ...]
    K1_lower: FloatArray
    K1_upper: FloatArray
    K2_lower: FloatArray
    K2_upper: FloatArray
    inputs: tuple[str, ...] = ("torque",)
    ties: tuple[Tie, ...] = ()

    def __post_init__(self) -> None:
        shape = (len(self.inputs), len(self.outputs))
        for field in ("K1_lower", "K1_upper", "K2_lower", "K2_upper"):
            bound = np.array(getattr(self, field), dtype=float)
            if bound.shape != shape:
                raise InputError(field, f"array of shape {bound.shape}", f"of shape {shape}")
            if not np.isfinite(bound).all():
                raise InputError(field, bound.tolist(), "finite")
            bound.setflags(write=False)
            object.__setattr__(self, field, bound)
        for gain in ("K1", "K2"):
            low, high = getattr(self, f"{gain}_lower"), getattr(self, f"{gain}_upper")
            if (low > high).any():
                raise InputError(
                    f"bound of {gain}",
                    f"{low[low > high][0]:g}:{high[low > high][0]:g}",
                    "given as lower:upper with lower ≤ upper",
                )
        self._check_ties()

    def _check_ties(self) -> None:
        """Refuse ties between gains that are not free, and leaders left without room."""
        bounded = self.flat_lower < self.flat_upper
        known = {n for n, free in zip(self.entry_names, bounded, strict=True) if free}
        followers = {tie.gain for tie in self.ties}
        for tie in self.ties:
            for name in (tie.gain, tie.leader):
                if name not in known:
                    raise InputError("tie", name, f"one of the gains {', '.join(sorted(known))}")
            if tie.leader in followers:
                raise InputError("tie", tie.leader, "a leader that is not tied itself")
            if checked_number(f"factor of the tie of {tie.gain}", tie.factor) == 0.0:
                raise InputError(f"factor of the tie of {tie.gain}", 0.0, "not zero")
        if len(followers) < len(self.ties):
            raise InputError("ties", [tie.gain for tie in self.ties], "one for each gain")
        for name, (low, high) in self.gain_bounds.items():
            if low >= high:
                raise InputError(f"bound {name}", f"{low:g}:{high:g}", "wider, with its ties")

    @property
    def flat_lower(self) -> FloatArray:
        """Lower bounds of all entries of K1, then K2, row by row, shape (2 m p,)."""
        return np.concatenate([self.K1_lower.ravel(), self.K2_lower.ravel()])

    @property
    def flat_upper(self) -> FloatArray:
        """Upper bounds of all entries of K1, then K2, row by row, shape (2 m p,)."""
        return np.concatenate([self.K1_upper.ravel(), self.K2_upper.ravel()])

    @functools.cached_property
    def entry_names(self) -> tuple[str, ...]:
        """Names of all entries of K1, then K2: ``K1_1``, or ``K1_1_1`` with several inputs."""
        rows, columns = self.K1_lower.shape
        return tuple(
            f"{gain}_{j + 1}" if rows == 1 else f"{gain}_{i + 1}_{j + 1}"
            for gain in ("K1", "K2")
            for i in range(rows)
            for j in range(columns)
        )

    @functools.cached_property
    def free(self) -> BoolArray:
        """Which entries of (K1, K2), flattened, are free; shape (2 m p,)."""
        followers = {tie.gain for tie in self.ties}
        leads = [name not in followers for name in self.entry_names]
        return np.asarray((self.flat_lower < self.flat_upper) & np.array(leads, dtype=bool))

    @functools.cached_property
    def gain_names(self) -> tuple[str, ...]:
        """Names of the free gains in the order of the vector."""
        return tuple(n for n, free in zip(self.entry_names, self.free, strict=True) if free)

    @property
    def gain_bounds(self) -> dict[str, tuple[float, float]]:
        """Least and largest value of each free gain by its name."""
        ends = zip(self.lower.tolist(), self.upper.tolist(), strict=True)
        return dict(zip(self.gain_names, ends, strict=True))

    @functools.cached_property
    def spread(self) -> FloatArray:
        """How each entry of (K1, K2), flattened, follows the gain vector, (2 m p, k)."""
        names, columns = self.entry_names, self.gain_names
        table = np.zeros((len(names), len(columns)))
        for j, name in enumerate(columns):
            table[names.index(name), j] = 1.0
        for tie in self.ties:
            table[names.index(tie.gain), columns.index(tie.leader)] = tie.factor
        return table

    @functools.cached_property
    def fixed(self) -> FloatArray:
        """The fixed entries of (K1, K2), flattened; 0 where an entry is free or tied."""
        return np.where(self.flat_lower < self.flat_upper, 0.0, self.flat_lower)

    @functools.cached_property
    def lower(self) -> FloatArray:
        """Lower bounds of the gain vector, those of tied gains included, shape (k,)."""
        return self._limits()[0]

    @functools.cached_property
    def upper(self) -> FloatArray:
        """Upper bounds of the gain vector, those of tied gains included, shape (k,)."""
        return self._limits()[1]

    def _limits(self) -> tuple[FloatArray, FloatArray]:
        table = self.spread
        low, high = self.flat_lower[:, None], self.flat_upper[:, None]
        acts = table != 0.0
        factor = np.where(acts, table, 1.0)
        ends = np.sort(np.stack([low / factor, high / factor]), axis=0)
        return (
            np.where(acts, ends[0], -np.inf).max(axis=0),
            np.where(acts, ends[1], np.inf).min(axis=0),
        )

    def gains(self, vector: npt.ArrayLike) -> tuple[FloatArray, FloatArray]:
        """Return K1 and K2, each (m, p), from a vector of the free gains."""
        flat = self.fixed + self.spread @ np.asarray(vector, dtype=float)
        half = flat.size // 2
        shape = self.K1_lower.shape
        return flat[:half].reshape(shape), flat[half:].reshape(shape)

    def vector(self, K1: npt.ArrayLike, K2: npt.ArrayLike) -> FloatArray:
        """Return the vector of the free gains in given matrices, the inverse of `gains`."""
        flat = np.concatenate([np.ravel(K1), np.ravel(K2)])
        return np.asarray(flat[self.free], dtype=float)

    def with_bounds(self, bounds: Mapping[str, tuple[float, float]]) -> FeedbackStructure:
        """Return the structure with other bounds.

        Parameters
        ----------
        bounds : mapping
            From ``"K1"`` or ``"K2"`` (all free gains of that matrix) or a name among
            `gain_names` to (lower, upper). Single gains overrule whole matrices.

        Raises
        ------
        InputError
            If a name is unknown or bounds are swapped or not finite.
        """
        arrays = [self.flat_lower, self.flat_upper]
        positions = dict(zip(self.gain_names, np.flatnonzero(self.free), strict=True))
        for key in sorted(bounds, key=len):
            low, high = bounds[key]
            where = [
                i for name, i in positions.items() if name == key or name.startswith(key + "_")
            ]
            if not where:
                known = ", ".join(("K1", "K2", *self.gain_names))
                raise InputError("bound", key, f"on one of the gains {known}")
            if checked_number(f"bound {key}", low) > checked_number(f"bound {key}", high):
                raise InputError(f"bound {key}", f"{low:g}:{high:g}", "lower:upper, lower ≤ upper")
            arrays[0][where], arrays[1][where] = low, high
        half, shape = arrays[0].size // 2, self.K1_lower.shape
        return replace(
            self,
            K1_lower=arrays[0][:half].reshape(shape),
            K1_upper=arrays[1][:half].reshape(shape),
            K2_lower=arrays[0][half:].reshape(shape),
            K2_upper=arrays[1][half:].reshape(shape),
        )


def no_control(structure: FeedbackStructure) -> FloatArray:
    """Return the gain vector that is nearest to no control within the bounds, (k,)."""
    return np.asarray(np.clip(0.0, structure.lower, structure.upper))
