"""Where feedback moves the modes of a plant: each root followed while the gains grow."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.delay.closing import close_loop
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


def mode_shifts(
    plant: DelaySystem,
    structure: FeedbackStructure,
    K1: FloatArray,
    K2: FloatArray,
    quantities: tuple[str, ...] = (),
) -> tuple[ModeShift, ...]:
    """Follow the rightmost roots of a plant while all gains grow together from nothing.

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
    found = []
    for root in dominant_roots(plant):
        if root.multiplicity == 1 and root.converged:
            end = _followed(plant, structure, K1, K2, root.value)
            if end is not None:
                kind = mode_kind(plant, root.value, quantities)
                found.append(ModeShift(kind, root.value, complex(end.real, abs(end.imag))))
    return tuple(found)


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


def _followed(
    plant: DelaySystem,
    structure: FeedbackStructure,
    K1: FloatArray,
    K2: FloatArray,
    start: complex,
) -> complex | None:
    """Follow a root by Newton's iteration, with steps as short as the root moves fast."""
    done, step = 0.0, 1.0 / _SCALES
    here, slope = start, 0j
    while done < 1.0:
        step = min(step, 1.0 - done)
        scale = done + step
        system = close_loop(plant, structure, scale * K1, scale * K2)
        guess = here + slope * step
        there = _newton(system, guess)
        if there is None or abs(there - guess) > 0.05 * (1.0 + abs(here)):
            step *= 0.5
            if step < _FINEST:
                return None
            continue
        here, slope, done = there, (there - here) / step, scale
        step *= 1.5
    return here


def _newton(system: DelaySystem, s: complex) -> complex | None:
    change = np.inf
    for _ in range(_NEWTON):
        slope = characteristic.log_derivative_at(system, s)
        if slope == 0.0 or np.isnan(slope):
            return None
        move = 1.0 / slope
        s -= move
        change = abs(move) / (1.0 + abs(s))
        if change < _SMALL:
            return s
    return s if change < _ROUGH else None
