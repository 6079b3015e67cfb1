"""Damping of the torsional modes on the motion that is drilled with, as what a design wants."""

from __future__ import annotations

from dataclasses import dataclass

from drillctrl.base.errors import checked_integer, checked_number
from drillctrl.designs.worst_case import cases_in_box, errors_of
from drillctrl.drilling.case import Case
from drillctrl.synthesis.objectives import WorstLoop

ASKED = "it was asked for"
_AMPLITUDES = (0.03, 0.1, 0.2, 0.3)


@dataclass(frozen=True)
class Drilling(WorstLoop):
    """The slowest decay of torsional modes on the motion that is drilled with.

    The bit, on its axial orbit, answers a swing of its speed with a torque (`bit_response`);
    what is minimised is the largest growth rate of the torsional loop with that answer, over
    all swings up to a kick, and all answers within their errors. How much of the bounds is
    used is decided by trial runs.

    Attributes
    ----------
    kick : float
        Largest swing of the bit's speed, share of it, in (0, 0.95].
    modes : int
        So many of the slowest torsional modes.
    psi, delta0, omega0, depth, mud : float
        Relative errors, 0 to 0.9, of the point and of a real string's length and mud, as in
        `WorstCase`: motions are looked at there too.
    """

    kick: float = 0.45
    modes: int = 1
    psi: float = 0.0
    delta0: float = 0.0
    omega0: float = 0.0
    depth: float = 0.0
    mud: float = 0.0
    name = "drilling"

    def __post_init__(self) -> None:
        checked_number("kick", self.kick, 0.0, 0.95, open_low=True)
        checked_integer("modes", self.modes, 1, 20)
        for name, size in errors_of(self).items():
            checked_number(f"{name} error", size, 0.0, 0.9)

    def around(self, case: Case) -> tuple[Case, ...]:
        """Return all cases looked at, the given one first."""
        return cases_in_box(self, case)

    @property
    def amplitudes(self) -> tuple[float, ...]:
        """Swings at which the bit's answer is measured."""
        return (*(a for a in _AMPLITUDES if a < 0.9 * self.kick), self.kick)
