"""A line: uniform pieces in a row that carry one motion, axial or torsional, exactly.

Along a piece the wave equation m u'' + c u' = k (1 + μ d/dt) u_zz holds. Its transfer matrix
carries (displacement, force) from the upper end to the lower one, at any complex s.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import ComplexArray


class Piece(NamedTuple):
    """A uniform piece of a line; for torsion read inertia for mass and torque for force.

    Attributes
    ----------
    length : float
        m.
    mass : float
        m, per metre; 0 for a spring.
    stiffness : float
        k, force per strain: EA or GJ.
    damping : float
        c, force per metre and unit of velocity.
    retardation : float
        μ of Kelvin and Voigt, s.
    """

    length: float
    mass: float
    stiffness: float
    damping: float = 0.0
    retardation: float = 0.0


class Stretch(NamedTuple):
    """Pieces that recur: a pipe's body and its tool joint, as often as there are joints."""

    pieces: tuple[Piece, ...]
    repeats: int = 1

    @property
    def length(self) -> float:
        """Length in metres."""
        return self.repeats * sum(piece.length for piece in self.pieces)

    @property
    def uniform(self) -> bool:
        """Whether there is but one kind of piece."""
        return len(self.pieces) == 1

    def mean(self) -> Piece:
        """Return the uniform piece with the same mass, compliance and damping.

        Waves much longer than the pieces do not tell it from the stretch.
        """
        once = sum(piece.length for piece in self.pieces)

        def mean(values: list[float]) -> float:
            weighted = zip(values, self.pieces, strict=True)
            return sum(value * piece.length for value, piece in weighted) / once

        compliance = mean([1.0 / piece.stiffness for piece in self.pieces])
        # Each piece's share of the compliance is also its share of the material's damping.
        retarded = mean([piece.retardation / piece.stiffness for piece in self.pieces])
        return Piece(
            self.length,
            mean([piece.mass for piece in self.pieces]),
            1.0 / compliance,
            mean([piece.damping for piece in self.pieces]),
            retarded / compliance,
        )


@dataclass(frozen=True)
class Line:
    """Stretches from the top end to the bit."""

    made_by = "the torsion of a DrillString"

    stretches: tuple[Stretch, ...]

    @property
    def length(self) -> float:
        """Length in metres."""
        return sum(stretch.length for stretch in self.stretches)

    def changed(self, change: Callable[[Piece], Piece]) -> Line:
        """Return the line with each of its pieces changed."""
        return Line(
            tuple(
                each._replace(pieces=tuple(change(piece) for piece in each.pieces))
                for each in self.stretches
            )
        )

    def transfer(self, s: npt.ArrayLike) -> ComplexArray:
        """Return the transfer matrix from the top to the bit, (..., 2, 2).

        With u and f = k u_z at both ends, (u, f) at the bit = transfer · (u, f) at the top.
        Its determinant is 1.

        Parameters
        ----------
        s : complex, (...)
            1/s.
        """
        matrix, exponent = self.scaled_transfer(np.asarray(s, dtype=complex))
        return np.asarray(matrix * np.exp(exponent)[..., None, None])

    def scaled_transfer(self, s: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """Return the transfer matrix without its growth, and the exponent of that."""
        one, none = np.ones_like(s, dtype=complex), np.zeros_like(s, dtype=complex)
        whole, exponent = _Matrix(one, none, none, one), none
        for stretch in self.stretches:
            once: _Matrix | None = None
            for piece in stretch.pieces:
                matrix, growth = _transfer(piece, s)
                once = matrix if once is None else _product(matrix, once)
                exponent = exponent + stretch.repeats * growth
            if once is not None:
                whole = _product(_power(once, stretch.repeats), whole)
        found = np.empty((*s.shape, 2, 2), dtype=complex)
        found[..., 0, 0], found[..., 0, 1], found[..., 1, 0], found[..., 1, 1] = whole
        return found, exponent

    def at_bit(
        self, s: npt.ArrayLike, top: npt.ArrayLike = np.inf
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Return displacement and force at the bit for a motion that the top end allows, (...).

        Both without their growth along the line, whose exponent is returned third. For a top
        end whose stiffness is finite it is displaced by 1, else a force of 1 acts there.

        Parameters
        ----------
        s : complex, (...)
            1/s.
        top : complex, (...)
            Dynamic stiffness of what holds the top end; infinite where its motion is imposed.
        """
        matrix, exponent = self.scaled_transfer(np.asarray(s, dtype=complex))
        held = np.asarray(top, dtype=complex)
        free = np.isfinite(held)
        u, f = np.where(free, 1.0, 0.0), np.where(free, held, 1.0)
        displacement = matrix[..., 0, 0] * u + matrix[..., 0, 1] * f
        return displacement, matrix[..., 1, 0] * u + matrix[..., 1, 1] * f, exponent

    def bit_stiffness(self, s: npt.ArrayLike, top: npt.ArrayLike = np.inf) -> ComplexArray:
        """Return the dynamic stiffness that the bit sees, force per displacement, (...).

        Its inverse is the receptance at the bit. Parameters as of `at_bit`.
        """
        displacement, force, _ = self.at_bit(s, top)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(force / displacement)

    def port_stiffness(self, s: npt.ArrayLike) -> ComplexArray:
        """Return the dynamic stiffness of both ends, (..., 2, 2).

        Forces on the line (bit, top) per displacements (bit, top); it is symmetric.
        """
        matrix, exponent = self.scaled_transfer(np.asarray(s, dtype=complex))
        b = matrix[..., 0, 1]
        across = -np.exp(-exponent) / b
        rows = [[matrix[..., 1, 1] / b, across], [across, matrix[..., 0, 0] / b]]
        return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)

    @property
    def transit_time(self) -> float:
        """Time that a wave takes from end to end, s."""
        pieces = (stretch.mean() for stretch in self.stretches)
        return float(sum(p.length * np.sqrt(p.mass / p.stiffness) for p in pieces))

    @property
    def wave_impedance(self) -> float:
        """√(m k) of the topmost stretch, the impedance that a drive should match."""
        piece = self.stretches[0].mean()
        return float(np.sqrt(piece.mass * piece.stiffness))


class _Matrix(NamedTuple):
    """Entries of 2 × 2 matrices, row by row, (...) each: products of stacks are slow."""

    a: ComplexArray
    b: ComplexArray
    c: ComplexArray
    d: ComplexArray


def _product(m: _Matrix, n: _Matrix) -> _Matrix:
    return _Matrix(
        m.a * n.a + m.b * n.c, m.a * n.b + m.b * n.d, m.c * n.a + m.d * n.c, m.c * n.b + m.d * n.d
    )


def _power(matrix: _Matrix, count: int) -> _Matrix:
    """Return a product of equal matrices, one or more, by squaring."""
    whole, square = None, matrix
    while True:
        if count % 2:
            whole = square if whole is None else _product(square, whole)
        count //= 2
        if not count:
            assert whole is not None
            return whole
        square = _product(square, square)


def _transfer(piece: Piece, s: ComplexArray) -> tuple[_Matrix, ComplexArray]:
    """Return a piece's matrix over exp(x), and x = γ times its length."""
    k = piece.stiffness * (1.0 + piece.retardation * s)
    square = piece.length**2 * (piece.mass * s + piece.damping) * s / k
    x = np.sqrt(square)
    fallen = np.expm1(-2.0 * x)
    small = np.abs(x) < 1e-8
    along = np.asarray(1.0 + 0.5 * fallen, dtype=complex)
    across = np.where(small, 1.0, -0.5 * fallen / np.where(small, 1.0, x))
    scaled = piece.length / k
    return _Matrix(along, scaled * across, square * across / scaled, along), x
