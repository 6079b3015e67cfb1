"""A line in finite elements, and reduced to its two ends and a few modes."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import scipy.linalg
import scipy.sparse
import scipy.sparse.linalg

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.errors import InputError
from drillctrl.strings.line import Line, Piece, Stretch

# Elements of this length are 0.002 % off at this frequency in steel, in torsion.
ELEMENT_LENGTH, ELEMENT_FREQUENCY = 20.0, 7.0
_MOST_ELEMENTS = 20_000
# Elements that differ along a joint err with the square of their length: they are so much shorter.
_FINER = 4.0
# The static rest stands for all higher modes, which carry waves away from the bit: without
# damping, cutting would find in it a mode that no string has, and excite it. An absorber tuned
# to it, of this share of its mass, damps it by a sixth of critical and, unlike a dashpot, leaves
# alone what is slow: its loss falls with the fifth power of frequency.
_ABSORBER, _ABSORBER_DAMPING = 0.5, 0.5
# Share of its size up to which a coupling of modes, and of what is left of them, is rounding.
_COUPLED = 1e-9
# Elements may take this share of a tolerance.
_ELEMENTS_SHARE = 0.3
_SAMPLES, _FEWER = 400, 4


class Chain(NamedTuple):
    """M, C and K of a line in elements, three tridiagonal matrices; the bit first, the top last.

    Attributes
    ----------
    diagonal : array, (3, N)
        Of M, C and K.
    beside : array, (3, N − 1)
        The same above the diagonal.
    height : array, (N,)
        Of every node above the bit, m.
    """

    diagonal: FloatArray
    beside: FloatArray
    height: FloatArray

    def bit_receptance(self, s: ComplexArray) -> ComplexArray:
        """Return the displacement of the bit per force on it, under an imposed top, (...)."""
        square = s * s
        own, ties = self.diagonal.T.tolist(), self.beside.T.tolist()
        m, c, k = own[-2]
        stiffness = square * m + s * c + k
        for i in range(len(ties) - 2, -1, -1):
            (m, c, k), (mass, damping, spring) = own[i], ties[i]
            across = square * mass + s * damping + spring
            stiffness = square * m + s * c + k - across * across / stiffness
        return np.asarray(1.0 / stiffness)

    def product(self, which: int, shapes: FloatArray) -> FloatArray:
        """Return M, C or K (0, 1, 2) times shapes, (N, k)."""
        found = self.diagonal[which, :, None] * shapes
        found[:-1] += self.beside[which, :, None] * shapes[1:]
        found[1:] += self.beside[which, :, None] * shapes[:-1]
        return found


def elements(line: Line, element_length: float = ELEMENT_LENGTH) -> Chain:
    """Return a line in finite elements with the mean of consistent and lumped mass.

    That mean makes the error of a frequency fall with the fourth power of the length of an
    element instead of the second. Tool joints are elements of their own.

    Parameters
    ----------
    line : Line
        The line.
    element_length : float
        Longest element, m.
    """
    parts = [part for s in reversed(line.stretches) for part in _split(s, element_length)]
    length, mass, stiffness, damping, retardation = np.array(parts).T
    spring = stiffness / length
    diagonal, beside = np.zeros((3, len(parts) + 1)), np.zeros((3, len(parts)))
    for i, (whole, ties) in enumerate(
        ((mass * length, 0.0), (damping * length, retardation * spring), (0.0, spring))
    ):
        own, cross = 5.0 / 12.0 * whole + ties, 1.0 / 12.0 * whole - ties
        diagonal[i, :-1] += own
        diagonal[i, 1:] += own
        beside[i] = cross
    return Chain(diagonal, beside, np.concatenate([[0.0], np.cumsum(length)]))


def _split(stretch: Stretch, element_length: float) -> list[Piece]:
    found = []
    for piece in reversed(stretch.pieces):
        whole = piece._replace(length=piece.length * (stretch.repeats if stretch.uniform else 1))
        longest = element_length if stretch.uniform else element_length / _FINER
        count = max(1, int(np.ceil(whole.length / longest - 1e-9)))
        found += [whole._replace(length=whole.length / count)] * count
    return found if stretch.uniform else found * stretch.repeats


class Matrices(NamedTuple):
    """M, C and K of a line, (N, N); the bit's coordinate first, the top end's last."""

    mass: FloatArray
    damping: FloatArray
    stiffness: FloatArray

    def bit_receptance(self, s: ComplexArray) -> ComplexArray:
        """Return the displacement of the bit per force on it, under an imposed top, (...)."""
        at = s[..., None, None]
        mass, damping, stiffness = (matrix[:-1, :-1] for matrix in self)
        force = np.zeros((mass.shape[0], 1))
        force[0] = 1.0
        whole = at * at * mass + at * damping + stiffness
        return np.asarray(np.linalg.solve(whole, force)[..., 0, 0])


class Reduced(NamedTuple):
    """A line by its ends and a few modes.

    Attributes
    ----------
    matrices : Matrices
        Coordinates: the bit's, those of the modes, that of the absorber, the top end's.
    shapes : array, (N, 3 + modes)
        Displacements of the N nodes, from the bit to the top, per coordinate; none of the
        absorber's.
    top_force : array, (3 + modes,)
        Force in the uppermost element per coordinate, positive where the top end is ahead.
    height : array, (N,)
        Of every node above the bit, m.
    """

    matrices: Matrices
    shapes: FloatArray
    top_force: FloatArray
    height: FloatArray


class Modes(NamedTuple):
    """Modes without damping of a free bit under a held top.

    Attributes
    ----------
    frequencies : array, (k,)
        Hz, in order.
    shapes : array, (N − 1, k)
        Of unit modal mass, moving the bit forward.
    """

    frequencies: FloatArray
    shapes: FloatArray


def free_modes(chain: Chain, count: int) -> Modes:
    """Return the first modes of a line in elements, at most N − 2."""

    def matrix(which: int) -> scipy.sparse.csc_matrix:
        diagonal, beside = chain.diagonal[which, :-1], chain.beside[which, :-1]
        return scipy.sparse.diags([beside, diagonal, beside], [-1, 0, 1], format="csc")

    mass, stiffness = matrix(0), matrix(2)
    size = mass.shape[0]
    if count >= size - 1 or size < 60:
        squares, shapes = scipy.linalg.eigh(stiffness.toarray(), mass.toarray())
    else:
        squares, shapes = scipy.sparse.linalg.eigsh(
            stiffness, count, mass, sigma=0.0, v0=np.ones(size)
        )
    order = np.argsort(squares)[:count]
    squares, shapes = squares[order], shapes[:, order]
    # The sign of a mode is nobody's.
    shapes = shapes * np.where(shapes[0] < 0.0, -1.0, 1.0)
    return Modes(np.sqrt(np.maximum(squares, 0.0)) / (2.0 * np.pi), shapes)


def reduced(chain: Chain, modes: Modes, count: int) -> Reduced:
    """Return a line reduced to both ends and its first modes.

    What a force on the bit moves beyond these modes is kept as a static shape (MacNeal 1971,
    Rubin 1975), what the top end moves as the static shape of the whole: so the compliance at
    the bit is exact at low frequency and the modes are those of the elements. What the static
    rest stands for takes waves away: an absorber (Den Hartog 1956) damps it.

    Parameters
    ----------
    chain : Chain
        In finite elements.
    modes : Modes
        At least ``count`` of them.
    count : int
        How many to keep, at most N − 3.
    """
    size = chain.diagonal.shape[1]
    kept = modes.shapes[:, :count]
    squares = (2.0 * np.pi * modes.frequencies[:count]) ** 2
    bands = np.array([np.append(chain.beside[2, :-1], 0.0), chain.diagonal[2, :-1]])
    bands[0] = np.append(0.0, chain.beside[2, :-1])
    loads = np.zeros((size - 1, 2))
    loads[0, 0], loads[-1, 1] = 1.0, -chain.beside[2, -1]
    static, top = scipy.linalg.solveh_banded(bands, loads).T
    rest = static - kept @ (kept[0] / squares)
    # It is what is left of much: modes are taken out again, of which rounding left some.
    rest -= kept @ (kept.T @ chain.product(0, np.append(rest, 0.0)[:, None])[:-1, 0])
    shapes = np.zeros((size, 2 + count))
    shapes[:-1, 0], shapes[:-1, 1:-1], shapes[:-1, -1] = rest / rest[0], kept, top
    shapes[-1, -1] = 1.0
    projected = [shapes.T @ chain.product(which, shapes) for which in range(3)]
    # The bit's own displacement takes the place of how much of the static rest there is.
    amount = np.concatenate([[1.0], -kept[0], [-top[0]]])
    change = np.eye(2 + count)
    change[0] = amount
    shapes = shapes @ change
    changed = [change.T @ _cleaned(part) @ change for part in projected]
    matrices = _with_absorber([0.5 * (part + part.T) for part in changed], amount)
    force = -chain.beside[2, -1] * (shapes[-1] - shapes[-2])
    whole = np.insert(shapes, -1, 0.0, axis=1)
    return Reduced(matrices, whole, np.insert(force, -1, 0.0), chain.height)


def _cleaned(matrix: FloatArray) -> FloatArray:
    """Return a symmetric matrix of rest, modes and top without what rounding couples."""
    whole = 0.5 * (matrix + matrix.T)
    size = np.sqrt(np.abs(np.diag(whole)))
    whole[abs(whole) <= _COUPLED * np.outer(size, size)] = 0.0
    return np.asarray(whole)


def _with_absorber(plain: list[FloatArray], amount: FloatArray) -> Matrices:
    """Return M, C and K with a coordinate before the last that absorbs the static rest.

    Parameters
    ----------
    plain : list of array, (k, k)
        M, C and K; of the first coordinate they are those of the rest.
    amount : array, (k,)
        Of the rest, per coordinate.
    """
    square = plain[2][0, 0] / plain[0][0, 0]
    mass = _ABSORBER * plain[0][0, 0]
    rest = np.insert(amount, -1, 0.0)
    own = np.zeros(rest.size)
    own[-2] = 1.0
    moved = np.outer(own, own) - np.outer(rest, rest)
    apart = mass * np.outer(own - rest, own - rest)
    added = (
        # Where it moves along, it is the mass that it takes from the rest.
        mass * moved,
        2.0 * _ABSORBER_DAMPING * np.sqrt(square) * apart,
        square * apart,
    )
    grown = [np.insert(np.insert(m, -1, 0.0, axis=0), -1, 0.0, axis=1) for m in plain]
    return Matrices(*(one + other for one, other in zip(grown, added, strict=True)))


def distance(line: Line, made: Chain | Matrices, frequency: float, count: int = _SAMPLES) -> float:
    """Return how far matrices are from the exact line as a wave at the bit meets them.

    The largest difference of the reflection coefficients (Z − ζ)/(Z + ζ), Z the impedance at
    the bit under an imposed top and ζ that of the lowest stretch, up to a frequency.

    Parameters
    ----------
    line : Line
        The exact line.
    made : Chain or Matrices
        In elements or reduced.
    frequency : float
        Hz.
    count : int
        Number of frequencies.
    """
    s, exact = _returned(line, frequency, count)
    return _distance(line, made, s, exact)


def _returned(line: Line, frequency: float, count: int) -> tuple[ComplexArray, ComplexArray]:
    """Return s at so many frequencies, and the exact line's reflection coefficient there."""
    s = np.asarray(2j * np.pi * np.linspace(frequency / count, frequency, count), dtype=complex)
    return s, _reflection(line, s / line.bit_stiffness(s))


def _reflection(line: Line, mobility: ComplexArray) -> ComplexArray:
    lowest = line.stretches[-1].mean()
    impedance = np.sqrt(lowest.mass * lowest.stiffness)
    return np.asarray((1.0 - impedance * mobility) / (1.0 + impedance * mobility))


def _distance(line: Line, made: Chain | Matrices, s: ComplexArray, exact: ComplexArray) -> float:
    return float(np.abs(_reflection(line, s * made.bit_receptance(s)) - exact).max())


def resolved(line: Line, frequency: float, tolerance: float) -> tuple[Reduced, float]:
    """Return a line with as few modes as a tolerance up to a frequency asks for, and its error.

    Parameters
    ----------
    line : Line
        The exact line.
    frequency : float
        Hz, up to which it must hold.
    tolerance : float
        Largest `distance`.

    Raises
    ------
    InputError
        If no finite elements that are tried come so close.
    """
    length = ELEMENT_LENGTH * ELEMENT_FREQUENCY / frequency
    s, exact = _returned(line, frequency, _SAMPLES)
    for _ in range(6):
        chain = elements(line, length)
        size = chain.diagonal.shape[1]
        if size > _MOST_ELEMENTS:
            break
        # What elements are off grows smoothly with frequency.
        off = _distance(line, chain, s[::-_FEWER], exact[::-_FEWER]) / tolerance
        if off <= _ELEMENTS_SHARE:
            # Half a wave there and back from mode to mode, and as many as a tolerance may ask for.
            modes = free_modes(chain, 32 + math.ceil(2.0 * frequency * line.transit_time))
            count = int(np.searchsorted(modes.frequencies, frequency)) + 2
            while count <= size - 3:
                if count > modes.frequencies.size:
                    modes = free_modes(chain, 2 * count)
                found = reduced(chain, modes, count)
                error = _distance(line, found.matrices, s, exact)
                if error <= tolerance:
                    return found, error
                count += 1 + count // 8
        length *= min(0.5, max(0.1, 0.9 * np.sqrt(_ELEMENTS_SHARE / off)))
    raise InputError("tolerance", tolerance, f"one that elements reach up to {frequency:g} Hz")
