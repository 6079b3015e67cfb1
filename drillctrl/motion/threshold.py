"""Rotary speeds and rates of penetration between which the torsional modes decay."""

from __future__ import annotations

import math
from concurrent.futures import Executor
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.base.workers import open_executor, spread_out
from drillctrl.drilling.case import Case, Where, as_case
from drillctrl.drilling.point import changed_by
from drillctrl.drilling.quantities import response_scale, si_scale
from drillctrl.motion.crossings import sign_changes
from drillctrl.motion.response import FEWEST_PERIODS
from drillctrl.motion.swing import ModeAt, mode_at
from drillctrl.motion.torsion import torsional_modes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ALONG = ("speed", "rate")
_LEAST, _MOST = 0.05, 20.0
_POINTS, _HALVED = 13, 4


@dataclass(frozen=True)
class Threshold:
    """Where a mode neither grows nor decays.

    Attributes
    ----------
    decays : {"above", "below"}
        On which side swings decay.
    factor : float
        Interpolated; times the point's own speed or rate.
    low, high : float
        Factors between which it lies, at both of which the sign is sure.
    """

    decays: str
    factor: float
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class ModeAlong:
    """A torsional mode over rotary speed or rate of penetration, all else as given.

    Attributes
    ----------
    case : Case
        What drills, and where.
    along : {"speed", "rate"}
        What is changed; faster rotation at the same rate cuts less deep.
    number : int
        Of the mode, 1 for the slowest.
    own_damping : array, (k,)
        Of the mode as seen at the bit.
    factors : array, (k,)
        Times the point's own, rising.
    at : tuple of ModeAt
        What becomes of the mode there.
    """

    case: Case
    along: str
    number: int
    own_damping: FloatArray
    factors: FloatArray
    at: tuple[ModeAt, ...]

    @property
    def values(self) -> FloatArray:
        """Speeds in rpm or rates in m/h where there is a rig, else Ω0 or V0, (k,)."""
        _, point = self.case.physics("a threshold")
        here = self.case.rig_point
        if self.along == "speed":
            own = point.omega0 if here is None else here.rotary_speed * 30.0 / math.pi
        else:
            own = point.penetration_rate if here is None else here.penetration_rate * 3600.0
        return np.asarray(self.factors * own)

    @property
    def own_value(self) -> float:
        """The point's own speed or rate, in the units of `values`."""
        return float(self.values[0] / self.factors[0])

    @property
    def told(self) -> tuple[float, str]:
        """How many units that are told one of `values` is, and that unit; it may be empty."""
        case, here = self.case, self.case.rig_point
        quantity, si = {
            "speed": ("angular_rate", math.pi / 30.0),
            "rate": ("axial_rate", 1.0 / 3600.0),
        }[self.along]
        if case.language.units:
            return case.language.number(quantity, si), case.language.unit(quantity)
        if here is None:
            return 1.0, ""
        return si / si_scale(quantity, here.rig), ""

    @property
    def damping_left(self) -> FloatArray:
        """Own damping and Re H, (k,)."""
        return np.asarray(self.own_damping + [each.response.value.real for each in self.at])

    @property
    def thresholds(self) -> tuple[Threshold, ...]:
        """Where it neither grows nor decays, by rising factor."""
        return tuple(
            Threshold("above" if k.grows_below else "below", k.place, k.low, k.high)
            for k in sign_changes(self.factors.tolist(), self.at)
        )

    @property
    def _held(self) -> list[str]:
        """Return what is the same throughout, for titles."""
        parts = self.case.place.split(", ")
        changed = {0} if self.along == "speed" else {1}
        if self.case.told_rig is None and self.along == "speed":
            # The depth of cut changes as well.
            changed = {0, 1}
        return [part for i, part in enumerate(parts) if i not in changed]

    def plot(self, name: str | None = None) -> Axes:
        """Draw the damping left, in SI where there is a rig.

        Parameters
        ----------
        name : str, optional
            Of the rig, for the title.
        """
        from drillctrl.motion.figure import plot_damping_along

        scale, response = response_scale(self.case.told_rig, self.case.language)
        factor, unit = self.told
        return plot_damping_along(
            factor * self.values,
            self.damping_left * scale,
            np.array([each.response.error for each in self.at]) * scale,
            [(t.decays, factor * t.factor * self.own_value) for t in self.thresholds],
            along=self.along,
            units=(unit, response),
            label=f"torsional mode {self.number}",
            title=", ".join(text for text in (name, *self._held) if text),
        )


@checks_kinds
def torsional_threshold(
    where: Where,
    along: str = "speed",
    *,
    amplitude: float = 0.03,
    mode: int = 1,
    least: float = 0.5,
    most: float = 2.0,
    workers: int = 1,
    **options: Any,
) -> ModeAlong:
    """Return where the swings of a torsional mode decay, over rotary speed or penetration.

    Parameters
    ----------
    where : OperatingPoint, RigPoint or Case
        What drills, and where.
    along : {"speed", "rate"}
        What is changed, the other is held.
    amplitude : float
        Of the bit's swing, A in (0, 1).
    mode : int
        1 for the slowest.
    least, most : float
        Factors of the point's own speed or rate between which is looked; from 13 of them, in
        even ratios, changes of sign are halved four times.
    workers : int
        Processes.
    **options
        Of `mode_at`.

    Raises
    ------
    InputError
        If an argument is out of its range; see `bit_response` and `torsional_modes`.
    """
    if along not in ALONG:
        raise InputError("along", along, f"one of {', '.join(ALONG)}")
    amplitude = checked_number("amplitude", amplitude, 0.0, 0.999, open_low=True)
    mode = checked_integer("mode", mode, 1, 20)
    least = checked_number("least", least, _LEAST, _MOST)
    most = checked_number("most", most, least, _MOST, open_low=True)
    workers = checked_integer("workers", workers, 1, 1000)
    case = as_case(where)
    options = {"most_periods": FEWEST_PERIODS, **options}
    wanted = np.geomspace(least, most, _POINTS).tolist()
    known: dict[float, tuple[float, ModeAt]] = {}
    with open_executor(workers, None) as executor:
        for _ in range(1 + _HALVED):
            known |= _looked(case, along, mode, amplitude, wanted, executor, options)
            found = _along(case, along, mode, known)
            middles = [math.sqrt(each.low * each.high) for each in found.thresholds]
            wanted = [f for f in middles if all(abs(f / k - 1.0) > 2e-3 for k in known)]
            if not wanted:
                break
    return found


def _along(
    case: Case, along: str, mode: int, known: dict[float, tuple[float, ModeAt]]
) -> ModeAlong:
    factors = sorted(known)
    own = np.array([known[f][0] for f in factors])
    return ModeAlong(case, along, mode, own, np.array(factors), tuple(known[f][1] for f in factors))


def _looked(
    case: Case,
    along: str,
    mode: int,
    amplitude: float,
    factors: list[float],
    executor: Executor | None,
    options: dict[str, Any],
) -> dict[float, tuple[float, ModeAt]]:
    _, point = case.physics("a threshold")
    here = point if case.rig_point is None else case.rig_point
    tasks = [
        (f, case.at(changed_by(here, **{along: f})), mode, amplitude, options) for f in factors
    ]
    return dict(spread_out(executor, _look, tasks))


def _look(
    task: tuple[float, Case, int, float, dict[str, Any]],
) -> tuple[float, tuple[float, ModeAt]]:
    factor, case, number, amplitude, options = task
    modes = torsional_modes(case, number)
    if len(modes) < number:
        raise InputError("mode", number, f"at most {len(modes)}: the string has no more")
    mode = modes[-1]
    return factor, (mode.damping, mode_at(case, mode, amplitude, **options))
