"""How to drill so that the bit hardly swings without control: faster, less feed, more blades."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from drillctrl.designs.trials import STARTS, trial_run
from drillctrl.designs.verdict import FAILURES
from drillctrl.drilling.case import Case
from drillctrl.drilling.point import OperatingPoint, RigPoint, changed_by

# Largest swing of a motion that is called quiet.
QUIET = 0.3
_FASTER = tuple((10 + k) / 10 for k in range(1, 11))
_LESS = tuple((10 - k) / 10 for k in range(1, 10))
_BLADES = (1, 2, 3, 4)


@dataclass(frozen=True)
class Quieter:
    """A change with which the motion is quiet from each of `STARTS`, without control.

    Attributes
    ----------
    kind : {"speed", "feed", "blades"}
        Faster rotation at the same rate of penetration; less of that rate; more blades.
    value : float
        Factor of the speed or of the rate; number of blades.
    swing : float
        Largest swing from any start.
    where : OperatingPoint or RigPoint
        Where it then drills.
    """

    kind: str
    value: float
    swing: float
    where: OperatingPoint | RigPoint

    def to_dict(self) -> dict[str, object]:
        """Return the JSON fields."""
        return {"kind": self.kind, "value": self.value, "swing": self.swing}


def quieter(case: Case) -> tuple[Quieter, ...]:
    """Return the smallest changes tried with which the motion is quiet without control.

    Steps are of a tenth of speed or feed, and of one blade; each has been run from the three
    `STARTS`. That a kind is missing means that nothing up to twice the speed, a tenth of
    the feed or four more blades did.

    Raises
    ------
    InputError
        If there is no plant.
    """
    _, point = case.physics("a quieter motion")
    here = point if case.rig_point is None else case.rig_point
    found = []
    for kind, changes in (("speed", _faster), ("feed", _less), ("blades", _blades)):
        for value, where in changes(here):
            swing = _largest_swing(case.at(where))
            if swing is not None:
                found.append(Quieter(kind, value, swing, where))
                break
    return tuple(found)


def _largest_swing(case: Case) -> float | None:
    """Return the largest swing over the starts, None as soon as one is not quiet."""
    largest = 0.0
    for start in STARTS:
        end = trial_run(case, None, start)
        if end.swing is None or FAILURES.get(end.outcome, 0) or not end.swing <= QUIET:
            return None
        largest = max(largest, end.swing)
    return largest


_Changes = Iterator[tuple[float, OperatingPoint | RigPoint]]


def _faster(where: OperatingPoint | RigPoint) -> _Changes:
    for factor in _FASTER:
        yield factor, changed_by(where, speed=factor)


def _less(where: OperatingPoint | RigPoint) -> _Changes:
    for factor in _LESS:
        yield factor, changed_by(where, rate=factor)


def _blades(where: OperatingPoint | RigPoint) -> _Changes:
    for more in _BLADES:
        if isinstance(where, RigPoint):
            count = where.rig.blades + more
            yield count, replace(where, rig=replace(where.rig, blades=count))
        else:
            count = where.blades + more
            yield count, where.with_changes(blades=count)
