"""A drill string as one axial and one torsional spring with a mass: a rig of the paper's kind."""

from __future__ import annotations

from typing import NamedTuple

from drillctrl.strings.drill_string import DrillString
from drillctrl.strings.line import Line


class Lumped(NamedTuple):
    """One degree of freedom for a line; for torsion read inertia for mass.

    Attributes
    ----------
    mass, stiffness, damping : float
        Of the equation of motion, SI.
    """

    mass: float
    stiffness: float
    damping: float


def lumped(string: DrillString, line: Line) -> Lumped:
    """Return the one degree of freedom of a line of a string.

    The collars at the lower end move as one body; all above them bends as under a static load
    on the bit, which counts a third of the mass of a uniform pipe. A string that has nothing
    but collars is a spring all along.

    Parameters
    ----------
    string : DrillString
        The string.
    line : Line
        Its torsion or its tension.
    """
    ropes = len(line.stretches) - len(string.sections)
    kinds = ["rope"] * ropes + [section.kind for section in string.sections]
    rigid = len(kinds)
    while rigid and kinds[rigid - 1] == "collar":
        rigid -= 1
    if rigid == ropes:
        rigid = len(kinds)
    pieces = [stretch.mean() for stretch in line.stretches]
    compliances = [piece.length / piece.stiffness for piece in pieces[:rigid]]
    whole = sum(compliances)
    mass = damping = retarded = above = 0.0
    for i, piece in enumerate(pieces):
        here = above + (compliances[i] if i < rigid else 0.0)
        share = (above**2 + above * here + here**2) / (3.0 * whole**2) * piece.length
        mass += share * piece.mass
        damping += share * piece.damping
        # A piece stores its share of the energy, and loses it by its own retardation.
        retarded += piece.retardation * (here - above) / whole**2
        above = here
    return Lumped(mass, 1.0 / whole, damping + retarded)
