"""Loops over many operating points and gains at once."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError
from drillctrl.delay.closing import loop_channels
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.drilling.coefficients import INPUT_NAMES, PARAMETER_NAMES
from drillctrl.drilling.linear import linearisation, parameter_vector, plant_system
from drillctrl.drilling.plant import dimensionless_plant
from drillctrl.drilling.point import OperatingPoint
from drillctrl.spectrum.batch import batch_abscissas


def spectral_abscissas(
    point: OperatingPoint,
    parameters: Mapping[str, npt.ArrayLike] | None = None,
    structure: FeedbackStructure | None = None,
    gains: npt.ArrayLike | None = None,
    workers: int | None = None,
) -> FloatArray:
    """Return α for many operating points, many gains, or both side by side.

    Parameters
    ----------
    point : OperatingPoint
        Supplies the parameters that do not vary.
    parameters : mapping of str to array_like, (q,), optional
        Values of the parameters that vary, by name.
    structure : FeedbackStructure, optional
        Without it the open loop.
    gains : array_like, (q, k) or (k,), optional
        Gain vectors of the structure.
    workers : int, optional
        Threads; by default one for each core.

    Returns
    -------
    array, (q,)
        Spectral abscissas.

    Raises
    ------
    InputError
        If a name is unknown, lengths differ or a value is out of range.
    """
    varied = {name: np.atleast_1d(np.asarray(v, float)) for name, v in (parameters or {}).items()}
    vectors = None
    if structure is not None:
        vectors = np.atleast_2d(np.asarray(gains, dtype=float))
        if vectors.shape[1] != structure.lower.size or not np.isfinite(vectors).all():
            raise InputError(
                "gains",
                f"array of shape {vectors.shape}",
                f"finite, with {structure.lower.size} columns",
            )
    lengths = {v.size for v in varied.values()} | (set() if vectors is None else {len(vectors)})
    count = max(lengths, default=1)
    if not lengths <= {1, count}:
        raise InputError("parameters", sorted(lengths), "arrays of one length")
    table = np.tile(parameter_vector(point)[:, None], (1, count))
    for name, values in varied.items():
        if name not in PARAMETER_NAMES:
            raise InputError("parameters", name, f"one of {', '.join(PARAMETER_NAMES)}")
        # The two ends of the range decide whether all of it is permitted.
        for value in (values.min(), values.max()):
            point.with_changes(**{name: float(value)})
        table[PARAMETER_NAMES.index(name)] = values
    a0, delayed, delay = plant_arrays(table)
    # The plant delays one signal: every row of A1 is a multiple of its last.
    right = delayed[:, 3:, :]
    left = delayed @ right.transpose(0, 2, 1) / (right**2).sum(axis=2, keepdims=True)
    if structure is not None and vectors is not None:
        drive, measure = _channels(point, structure)
        now, past = _gain_arrays(structure, np.broadcast_to(vectors, (count, vectors.shape[1])))
        a0 = a0 + drive @ now @ measure
        if past.any():
            left = np.concatenate([left, np.broadcast_to(drive, (count, *drive.shape))], axis=2)
            right = np.concatenate([right, past @ measure], axis=1)
    return batch_abscissas(a0, left, right, delay, workers)


def plant_arrays(table: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return A0 (q, n, n), A1 (q, n, n) and τ0 (q,) for every column of parameters."""
    count = table.shape[1]
    mapped = linearisation(dimensionless_plant()).map(count)
    a0, a1, _drive, tau = (value.full() for value in mapped(table))
    n = a0.shape[0]
    a0 = a0.reshape(n, count, n).transpose(1, 0, 2)
    a1 = a1.reshape(n, count, n).transpose(1, 0, 2)
    return a0, a1, tau.ravel()


def loop_arrays(
    point: OperatingPoint,
    table: FloatArray,
    structure: FeedbackStructure | None,
    K1: FloatArray,
    K2: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return A0 (q, n, n), A1 (q, n, n) and τ0 (q,) of loops at many points.

    Parameters
    ----------
    point : OperatingPoint
        Any of them.
    table : array, (9, q)
        Parameters of each, in the order of `PARAMETER_NAMES`.
    structure : FeedbackStructure or None
        What is fed back.
    K1, K2 : array, (q, m, p)
        Gains of each.
    """
    a0, a1, tau = plant_arrays(table)
    if structure is not None:
        drive, measure = _channels(point, structure)
        a0, a1 = a0 + drive @ K1 @ measure, a1 + drive @ K2 @ measure
    return np.ascontiguousarray(a0), np.ascontiguousarray(a1), tau


def _channels(point: OperatingPoint, structure: FeedbackStructure) -> tuple[FloatArray, FloatArray]:
    return loop_channels(plant_system(point, INPUT_NAMES), structure)


def gains_along(
    structure: FeedbackStructure,
    K1: FloatArray,
    K2: FloatArray,
    values: Mapping[str, FloatArray],
    count: int,
) -> tuple[FloatArray, FloatArray]:
    """Return K1 and K2 of every place, each (q, m, p), where some gains vary.

    Parameters
    ----------
    structure : FeedbackStructure
        Whose gains they are.
    K1, K2 : array, (m, p)
        Gains that do not vary.
    values : mapping of str to array, (q,)
        Those that do, by name; other names are passed over.
    count : int
        q.
    """
    flat = np.concatenate([K1.ravel(), K2.ravel()])
    table = np.tile(flat, (count, 1))
    for name, column in zip(structure.gain_names, structure.spread.T, strict=True):
        if name in values:
            # A gain takes along those that are tied to it.
            table[:, column != 0.0] = 0.0
            table += np.outer(values[name], column)
    half, shape = flat.size // 2, K1.shape
    return table[:, :half].reshape(-1, *shape), table[:, half:].reshape(-1, *shape)


def _gain_arrays(
    structure: FeedbackStructure, vectors: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return K1 and K2 for every gain vector, each (q, m, p)."""
    flat = structure.fixed + vectors @ structure.spread.T
    half = flat.shape[1] // 2
    shape = (len(vectors), *structure.K1_lower.shape)
    return flat[:, :half].reshape(shape), flat[:, half:].reshape(shape)
