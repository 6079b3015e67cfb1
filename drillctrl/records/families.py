"""Families of torsional lines that a recording can be fitted with."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drillctrl.drilling.rig import Rig
from drillctrl.strings.check import TORSIONAL_BAND, string_modes
from drillctrl.strings.line import Line, Piece, Stretch
from drillctrl.strings.rig import StringRig

# A disc is a piece of so many times the spring's stiffness.
_RIGID = 1e7
_LENGTH = 200.0


@dataclass(frozen=True)
class Family:
    """Lines by parameters that are all positive.

    Attributes
    ----------
    names : tuple of str
        Of the parameters.
    start, low, high : tuple of float
        First guess and bounds.
    base : Line or None
        What is scaled; None of pipe above a disc of which nothing is known.
    lumped : (float, float) or None
        Stiffness and inertia of the rig that was given, lumped to one spring and disc.
    single : bool
        Whether the base is nothing else.
    """

    names: tuple[str, ...]
    start: tuple[float, ...]
    low: tuple[float, ...]
    high: tuple[float, ...]
    base: Line | None = None
    lumped: tuple[float, float] | None = None
    single: bool = False

    def line(self, values: Sequence[float]) -> Line:
        """Return the line of some values of the parameters."""
        if self.base is None:
            stiffness, pipe, disc, damping = values
            return pipe_and_disc(stiffness, pipe, disc, damping)
        stiffer, heavier, damping = values
        return scaled(self.base, stiffer, heavier, damping)

    def modes(self, values: Sequence[float]) -> list[tuple[float, float]]:
        """Return frequencies in Hz and damping ratios, top held and bit free."""
        if self.single:
            stiffness, inertia = self.effective(values)
            rate = math.sqrt(stiffness / inertia)
            return [(rate / (2.0 * math.pi), values[2] / (2.0 * rate))]
        return [
            (mode.frequency, mode.damping_ratio)
            for mode in string_modes(self.line(values), "torsional", TORSIONAL_BAND)
        ]

    def effective(self, values: Sequence[float]) -> tuple[float, float]:
        """Return stiffness and inertia of one spring and disc instead, N m/rad and kg m²."""
        if self.base is None:
            return float(values[0]), float(values[2] + values[1] / 3.0)
        assert self.lumped is not None
        return float(values[0] * self.lumped[0]), float(values[1] * self.lumped[1])


def scaled(line: Line, stiffer: float, heavier: float, damping: float) -> Line:
    """Return a line stiffer and heavier by factors, with another viscous damping, 1/s."""

    def changed(piece: Piece) -> Piece:
        mass = heavier * piece.mass
        return piece._replace(
            mass=mass, stiffness=stiffer * piece.stiffness, damping=damping * mass
        )

    return line.changed(changed)


def pipe_and_disc(stiffness: float, pipe: float, disc: float, damping: float) -> Line:
    """Return uniform pipe above a disc.

    Parameters
    ----------
    stiffness : float
        Of the whole pipe, N m/rad.
    pipe, disc : float
        Inertias, kg m²; that of the pipe may be zero.
    damping : float
        Viscous, of both, 1/s.
    """
    # Any length will do; finite elements are made of some metres.
    mass = pipe / _LENGTH
    upper = Piece(_LENGTH, mass, stiffness * _LENGTH, damping * mass)
    lower = Piece(1.0, disc, _RIGID * stiffness, damping * disc)
    return Line((Stretch((upper,)), Stretch((lower,))))


def line_of(rig: Rig) -> Line:
    """Return the torsional line of a rig: its string's, or a spring and a disc."""
    if isinstance(rig, StringRig):
        return rig.string.torsion
    rate = rig.torsional_damping / rig.inertia
    return pipe_and_disc(rig.torsional_stiffness, 0.0, rig.inertia, rate)


def lump_frequency(line: Line) -> float | None:
    """Return the frequency of a disc on a spring, Hz; None of a line that carries waves."""
    spring = line.stretches[0].mean()
    if spring.mass > 0.0:
        return None
    disc = sum(one.length * one.mass for one in (each.mean() for each in line.stretches))
    return math.sqrt(spring.stiffness / spring.length / disc) / (2.0 * math.pi)


def damping_of(line: Line) -> float:
    """Return the viscous damping of a line over its inertia, 1/s."""
    pieces = [stretch.mean() for stretch in line.stretches]
    inertia = sum(piece.length * piece.mass for piece in pieces)
    return float(sum(piece.length * piece.damping for piece in pieces) / inertia)


def family_of(rig: Rig) -> Family:
    """Return a rig's own line, up to 60 % stiffer or heavier, or as much less."""
    line = line_of(rig)
    start = max(damping_of(line), 1e-3)
    return Family(
        ("stiffness", "inertia", "damping"),
        (1.0, 1.0, start),
        (1.0 / 1.6, 1.0 / 1.6, 1e-4),
        (1.6, 1.6, 5.0),
        line,
        (rig.torsional_stiffness, rig.inertia),
        not isinstance(rig, StringRig),
    )


def families_of(rig: Rig) -> list[list[Family]]:
    """Return a rig's own line; before that of a lumped rig pipe above a disc as stiff and heavy."""
    own = family_of(rig)
    if not own.single:
        return [[own]]
    given = rig.torsional_stiffness, rig.inertia
    return [[replace(unknown_family(*given, share), lumped=given) for share in (2.0, 0.4)], [own]]


def unknown_family(stiffness: float, inertia: float, share: float) -> Family:
    """Return pipe above a disc about a first guess.

    Parameters
    ----------
    stiffness, inertia : float
        Of the string lumped to one disc (a third of the pipe counted to it).
    share : float
        Inertia of the pipe over that of the disc.
    """
    disc = inertia / (1.0 + share / 3.0)
    start = (stiffness, share * disc, disc, 0.1)
    return Family(
        ("stiffness", "pipe_inertia", "disc_inertia", "damping"),
        start,
        tuple(np.array([0.3, 0.02, 0.1, 1e-3]) * (*start[:1], start[2], start[2], 1.0)),
        tuple(np.array([3.0, 20.0, 5.0, 50.0]) * (*start[:1], start[2], start[2], 0.1)),
    )
