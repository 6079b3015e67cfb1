"""The parts of a system that do not feel one another: its roots are theirs, taken together.

Where one part drives another and is not driven back, Δ is block triangular in suitable states and
det Δ the product of the parts'. A root that both have is a defective multiple one of the whole,
hard to find to more than a few digits, and a simple one of each part.
"""

from __future__ import annotations

import functools

import numpy as np
import numpy.typing as npt
import scipy.linalg
import scipy.sparse.csgraph

from drillctrl.base.arrays import FloatArray
from drillctrl.delay.system import DelaySystem

_EPSILON = float(np.finfo(float).eps)
# What delayed signals reach is found at a cost of n⁴.
_MANY = 40


def parts(system: DelaySystem) -> tuple[DelaySystem, ...]:
    """Return systems whose characteristic functions multiply to that of ``system``.

    They are found by the pattern of its matrices, exactly, and, of up to 40 states, as states
    that no delayed signal reaches or that none is made of, to rounding of its norm. Delays that
    act on nothing are left out.
    """
    # What is rounding is told by norms, so numbers have to be of like size.
    system = system.balanced
    late = [k for k, matrix in enumerate(system.delayed) if matrix.any()]
    system = DelaySystem(
        system.A0, tuple(system.delayed[k] for k in late), tuple(system.delays[k] for k in late)
    )
    coupled = functools.reduce(np.logical_or, (m != 0.0 for m in (system.A0, *system.delayed)))
    count, member = scipy.sparse.csgraph.connected_components(coupled, connection="strong")
    if count > 1:
        return _each([_block(system, np.flatnonzero(member == k)) for k in range(count)])
    if not late or system.order > _MANY:
        return (system,)
    for matrices in (
        (system.A0, *system.delayed),
        tuple(matrix.T for matrix in (system.A0, *system.delayed)),
    ):
        reached, rest = _reached(matrices)
        if rest.shape[1]:
            return _each([_seen(system, reached), _seen(system, rest)])
    return (system,)


def _each(systems: list[DelaySystem]) -> tuple[DelaySystem, ...]:
    return tuple(part for system in systems for part in parts(system))


def _block(system: DelaySystem, states: npt.NDArray[np.intp]) -> DelaySystem:
    """Return the block of some states, as it is."""
    square = np.ix_(states, states)
    delayed = tuple(matrix[square] for matrix in system.delayed)
    return DelaySystem(system.A0[square], delayed, system.delays)


def _seen(system: DelaySystem, basis: FloatArray) -> DelaySystem:
    """Return the block of a system on orthonormal states, cleared of rounding."""
    blocks = []
    for matrix, norm in zip((system.A0, *system.delayed), system.norms, strict=True):
        block = basis.T @ matrix @ basis
        block[np.abs(block) <= 4.0 * system.order * _EPSILON * norm] = 0.0
        blocks.append(block)
    return DelaySystem(blocks[0], tuple(blocks[1:]), system.delays)


def _reached(matrices: tuple[FloatArray, ...]) -> tuple[FloatArray, FloatArray]:
    """Return orthonormal bases of what the delayed matrices reach by way of A0, and of the rest."""
    now, *late = (matrix / max(float(np.linalg.norm(matrix, 2)), 1e-300) for matrix in matrices)
    rank, wide = 0, np.hstack(late)
    while True:
        basis, triangle, _ = scipy.linalg.qr(wide, pivoting=True)
        size = np.abs(np.diag(triangle))
        found = int((size > len(now) * _EPSILON * size[0]).sum())
        if found in (rank, len(now)):
            return basis[:, :found], basis[:, found:]
        rank, wide = found, np.hstack([basis[:, :found], now @ basis[:, :found]])
