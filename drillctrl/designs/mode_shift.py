"""Where feedback moves the modes of a plant: each root followed while the gains grow."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.delay.closing import feedback_lags, loop_channels
from drillctrl.delay.reduced import ReducedLoops, reduced_loops
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.delay.system import DelaySystem
from drillctrl.spectrum import characteristic
from drillctrl.spectrum.roots import dominant_roots

_SCALES = 64
_FINEST = 1.0 / 65536.0
_NEWTON = 12
# Residual step of Newton's iteration; at a multiple root it stops at the root of rounding.
_SMALL, _ROUGH = 1e-10, 1e-5
# A decay rate that is lower by less than this share, and absolutely, is as good as kept.
_SHARE, _LEAST = 0.05, 1e-3
# A mode is one of torsion, or axial, where the other takes less part than this.
_PURE = 0.2
_KINDS = {
    **dict.fromkeys(("length", "axial_rate"), "axial"),
    **dict.fromkeys(("angle", "angular_rate"), "torsional"),
}


@dataclass(frozen=True)
class ModeShift:
    """A mode without control and what the gains make of it.

    Attributes
    ----------
    kind : str or None
        ``"axial"`` or ``"torsional"``, where one motion alone takes part without control.
    open_loop, root : complex
        Its root without control and with it; imag ≥ 0.
    """

    kind: str | None
    open_loop: complex
    root: complex

    @property
    def worse(self) -> bool:
        """Whether it decays more slowly, or grows faster, than without control."""
        before = self.open_loop.real
        return self.root.real > before + _SHARE * abs(before) + _LEAST

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields."""
        pair = {"open_loop": self.open_loop, "root": self.root}
        found = {name: {"real": s.real, "imag": s.imag} for name, s in pair.items()}
        return {"kind": self.kind, **found}


def modes_worse(
    plant: DelaySystem,
    structure: FeedbackStructure,
    K1: FloatArray,
    K2: FloatArray,
    quantities: tuple[str, ...] = (),
) -> tuple[ModeShift, ...]:
    """Return the modes that decay more slowly, followed while all gains grow from nothing.

    Parameters
    ----------
    plant : DelaySystem
        Without control.
    structure, K1, K2
        The feedback.
    quantities : tuple of str
        What the plant's states measure, if known.

    Returns
    -------
    tuple of ModeShift
        Rightmost first without control. A root that cannot be followed, because it meets
        another on the way, is left out.
    """
    known = [root for root in dominant_roots(plant) if root.multiplicity == 1]
    begun = [root.value for root in known if root.converged]
    ends = _followed(_growing_loop(plant, structure, K1, K2), np.array(begun, dtype=complex))
    shifts = [
        ModeShift(None, start, complex(end.real, abs(end.imag)))
        for start, end in zip(begun, ends.tolist(), strict=True)
        if not np.isnan(end)
    ]
    return tuple(
        replace(shift, kind=mode_kind(plant, shift.open_loop, quantities))
        for shift in shifts
        if shift.worse
    )


def mode_kind(plant: DelaySystem, s: complex, quantities: tuple[str, ...]) -> str | None:
    """Say which motion alone takes part in a mode, by the participation of the states.

    The participation of state k is yₖ (Δ'(s) x)ₖ over the sum of all, with the left and right
    null vectors y and x of Δ(s): it does not depend on the units of the states.
    """
    if len(quantities) != plant.order:
        return None
    left, _, right = np.linalg.svd(characteristic.matrix(plant, s))
    y, x = left[:, -1].conj(), right[-1].conj()
    parts = np.abs(y * (characteristic.derivative(plant, s) @ x))
    total = float(parts.sum())
    shares = dict.fromkeys(_KINDS.values(), 0.0)
    for quantity, part in zip(quantities, parts.tolist(), strict=True):
        # What a filter or an actuator holds belongs to neither motion.
        if quantity in _KINDS:
            shares[_KINDS[quantity]] += part / total
    kind = max(shares, key=lambda one: shares[one])
    return kind if shares[kind] >= 1.0 - _PURE else None


@dataclass(frozen=True, eq=False)
class _GrowingLoop:
    """A loop whose gains are t times what they will be.

    Attributes
    ----------
    whole : ReducedLoops
        The single loop at t = 1.
    own : int
        Signals that the plant delays itself; the others are fed back.
    """

    whole: ReducedLoops
    own: int

    def log_derivative(self, s: ComplexArray, t: FloatArray) -> ComplexArray:
        """Return (det Δ)'/det Δ at places, each with its own share of the gains, (q,)."""
        every = self.whole.take(np.zeros(s.size, dtype=np.intp))
        rank = every.delays.shape[1]
        scale = np.where(np.arange(rank) < self.own, 1.0, t[:, None])
        residues = every.residues * np.tile(scale, rank)[:, None, : every.residues.shape[2]]
        loops = replace(every, left=every.left * scale[:, None], residues=residues)
        return loops.evaluate(s[:, None])[2][:, 0]


def _growing_loop(
    plant: DelaySystem, structure: FeedbackStructure, K1: FloatArray, K2: FloatArray
) -> _GrowingLoop:
    """Write feedback as signals beside those that the plant delays: no basis changes with t."""
    plant = plant.balanced
    drive, measure = loop_channels(plant, structure)
    lags = feedback_lags(plant, structure)
    parts = [
        (left, right, tau) for (left, right), tau in zip(plant.factors, plant.delays, strict=True)
    ]
    own = sum(len(right) for _, right, _ in parts)
    gains = np.array([K1, K2])
    for lag in sorted(set(lags[gains != 0.0].tolist())):
        parts.append((drive, ((lags == lag) * gains).sum(axis=0) @ measure, lag))
    whole = reduced_loops(
        plant.A0[None],
        np.hstack([left for left, *_ in parts])[None],
        np.vstack([right for _, right, _ in parts])[None],
        np.concatenate([np.full(len(right), lag) for _, right, lag in parts])[None],
    )
    return _GrowingLoop(whole, own)


def _followed(loop: _GrowingLoop, start: ComplexArray) -> ComplexArray:
    """Follow roots by Newton's iteration, with steps as short as each moves fast; NaN if lost."""
    here, slope = start.copy(), np.zeros_like(start)
    done, step = np.zeros(start.size), np.full(start.size, 1.0 / _SCALES)
    while True:
        on = np.flatnonzero((done < 1.0) & (step >= _FINEST))
        if not on.size:
            return np.where(done < 1.0, np.nan, here)
        ahead = np.minimum(step[on], 1.0 - done[on])
        guess = here[on] + slope[on] * ahead
        there = _newton(loop, guess, done[on] + ahead)
        good = np.abs(there - guess) <= 0.05 * (1.0 + np.abs(here[on]))
        step[on[~good]] = 0.5 * ahead[~good]
        on, ahead, there = on[good], ahead[good], there[good]
        slope[on], here[on] = (there - here[on]) / ahead, there
        done[on] = np.where(ahead < 1.0 - done[on], done[on] + ahead, 1.0)
        step[on] = 1.5 * ahead


def _newton(loop: _GrowingLoop, s: ComplexArray, t: FloatArray) -> ComplexArray:
    """Return roots near places at shares of the gains; NaN where none is reached."""
    s = s.copy()
    change = np.full(s.size, np.inf)
    for _ in range(_NEWTON):
        on = np.flatnonzero(change >= _SMALL)
        if not on.size:
            break
        with np.errstate(divide="ignore", invalid="ignore"):
            move = 1.0 / loop.log_derivative(s[on], t[on])
        s[on] -= move
        change[on] = np.abs(move) / (1.0 + np.abs(s[on]))
    return np.where(change < _ROUGH, s, np.nan)
