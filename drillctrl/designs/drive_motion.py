"""What laws of a drive make of the motion that is drilled with, and what no law reaches."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from drillctrl.base.kinds import checks_kinds
from drillctrl.base.language import Language
from drillctrl.base.text import finite_or_none, wrapped
from drillctrl.designs.drive_trials import DriveTrials, law_is_quiet
from drillctrl.designs.quieter import QUIET
from drillctrl.drilling.point import RigPoint, changed_by
from drillctrl.strings.bit_load import BitLoad
from drillctrl.strings.drive_control import DriveControl
from drillctrl.strings.drive_measures import DriveMeasures
from drillctrl.strings.drive_rules import stiff_control
from drillctrl.strings.line import Line
from drillctrl.strings.rig import StringRig
from drillctrl.strings.slopes import mode_slopes

# Of the swing that a law leaves, what the bit would swing under any.
_MOST = 0.75
_FASTER, _LESS = (1.25, 1.5, 2.0), (0.75, 0.5, 0.25)
_WORDS = {"speed": "{:g} times the speed", "rate": "{:g} times the feed"}
STIFF, ABSORBING = "stiff", "absorbing"


@dataclass(frozen=True, eq=False)
class DriveMotion:
    """Laws of a drive where the bit drills.

    Attributes
    ----------
    bit : BitLoad
        What was measured.
    swings : dict
        The swing that the torque of the orbit forces on the bit, by the name of the law; of a
        stiff drive and of a top that swallows every wave too.
    left : dict
        What the bit leaves of each mode's critical slope, N m s/rad, by the name of the law.
    frequency : float
        Hz at which the bit is shaken most under a top that swallows every wave.
    quieter : dict or None
        Factors of ``speed`` and ``rate`` with which the law is quiet from a small start and a
        kick, of those tried; None where it is as it is, or no runs were made.
    """

    bit: BitLoad
    swings: dict[str, float]
    left: dict[str, list[float]]
    frequency: float
    quieter: dict[str, float] | None

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields."""
        return {
            "response": [
                {
                    "frequency": each.frequency,
                    "amplitude": each.amplitude,
                    "real": finite_or_none(each.value.real),
                    "imag": finite_or_none(each.value.imag),
                    "error": finite_or_none(each.error),
                    "known": each.known,
                }
                for each in self.bit.answers
            ],
            "forced_swing": self.swings,
            "forced_at": self.frequency,
            "damping_left": self.left,
            "quieter": self.quieter,
        }

    def text(self, language: Language) -> str:
        """Return what it says for people."""
        law = next(name for name in self.swings if name not in (STIFF, ABSORBING))
        stiff, mine, none = (self.swings[name] for name in (STIFF, law, ABSORBING))
        lines = [
            f"Where it drills the bit shakes the string, most at {self.frequency:.2g} Hz. By that "
            f"it swings by {mine:.2g} of its speed under {law}, by {stiff:.2g} under a stiff drive "
            f"and by {none:.2g} under a top that swallows every wave."
        ]
        unit = language.unit("impedance").removesuffix("/rad")
        ends = [
            f"{language.number('impedance', min(self.left[name])):.3g} {unit} under {told}"
            for name, told in ((law, law), (STIFF, "a stiff drive"))
        ]
        lines.append(f"Damping left to the weakest of the first modes: {', '.join(ends)}.")
        vague = sum(not each.known for each in self.bit.answers)
        if vague:
            count = len(self.bit.answers)
            taken = "the others stand for it" if vague < count else "taken as none"
            lines.append(f"What the bit answers is not known at {vague} of {count}: {taken}.")
        if self.quieter is not None:
            if none > _MOST * mine:
                lines.append("No law of the drive leaves much less: none reaches that bounce.")
            told = [_WORDS[kind].format(factor) for kind, factor in self.quieter.items()]
            help_ = " or ".join(told) or "nothing up to twice the speed or a quarter of the feed"
            lines.append(f"Quiet in runs, a swing below {QUIET:g}: {help_}.")
        return "\n".join(map(wrapped, lines))


@checks_kinds
def drive_motion(
    where: RigPoint,
    bit: BitLoad,
    drives: Sequence[DriveMeasures],
    best: DriveTrials | None = None,
) -> DriveMotion:
    """Say what laws make of the motion that is drilled with.

    Parameters
    ----------
    where : RigPoint
        A string under a top drive, and where it drills.
    bit : BitLoad
        Of `bit_load` there.
    drives : sequence of DriveMeasures
        The laws; the first is the answer.
    best : DriveTrials, optional
        What became of that in runs. Where it swings, runs say how it would be quiet.
    """
    rig = where.rig
    assert isinstance(rig, StringRig)
    line = rig.string.torsion
    laws = {drive.control.name: drive.control for drive in drives}
    laws.setdefault(STIFF, stiff_control(drives[0].control.machine, line.wave_impedance))
    swings = {name: bit.forced_swing(line, law) for name, law in laws.items()}
    return DriveMotion(
        bit,
        {**swings, ABSORBING: bit.forced_swing(line, None)},
        {name: _left(line, law, bit) for name, law in laws.items()},
        bit.main_frequency(line, None),
        None if best is None or best.swing <= QUIET else _quieter(where, drives[0]),
    )


def _left(line: Line, law: DriveControl, bit: BitLoad) -> list[float]:
    return [bit.damping_left(mode) for mode in mode_slopes(line, law)]


def _quieter(where: RigPoint, drive: DriveMeasures) -> dict[str, float]:
    found = {}
    for kind, factors in (("speed", _FASTER), ("rate", _LESS)):
        for factor in factors:
            there = changed_by(where, **{kind: factor})
            assert isinstance(there, RigPoint)
            if law_is_quiet(there, drive, QUIET):
                found[kind] = factor
                break
    return found
