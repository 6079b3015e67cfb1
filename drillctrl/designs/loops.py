"""Loops over many operating points and gains at once."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.base.errors import InputError, checked_integer
from drillctrl.base.kinds import checks_kinds
from drillctrl.delay.closing import feedback_lags, loop_channels
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.delay.system import DelaySystem
from drillctrl.drilling.case import Case, Where, as_case
from drillctrl.spectrum.batch import batch_abscissas


@checks_kinds
def spectral_abscissas(
    point: Where,
    parameters: Mapping[str, npt.ArrayLike] | None = None,
    structure: FeedbackStructure | None = None,
    gains: npt.ArrayLike | None = None,
    workers: int | None = None,
    feedback_delay: float | None = None,
) -> FloatArray:
    """Return α for many operating points, many gains, or both side by side.

    Parameters
    ----------
    point : OperatingPoint, RigPoint, DelaySystem or Case
        Supplies the parameters that do not vary. Of a DelaySystem only gains may vary.
    parameters : mapping of str to array_like, (q,), optional
        Values of the parameters that vary, by name: groups, or parameters of the plant's
        parts. λ keeps its ratio to ψ.
    structure : FeedbackStructure, optional
        Without it the open loop.
    gains : array_like, (q, k) or (k,), optional
        Gain vectors of the structure.
    workers : int, optional
        Threads; by default one for each core.
    feedback_delay : float, optional
        The controller's; by default it is τ0 of each point.

    Returns
    -------
    array, (q,)
        Spectral abscissas.

    Raises
    ------
    InputError
        If a name is unknown, lengths differ, a value is out of range, or the system has more
        than one delay.
    """
    case = as_case(point)
    if workers is not None:
        workers = checked_integer("workers", workers, 1, 1000)
    varied = {name: np.atleast_1d(np.asarray(v, float)) for name, v in (parameters or {}).items()}
    vectors = None
    if structure is not None:
        vectors = np.atleast_2d(np.asarray(gains, dtype=float))
        if (
            vectors.ndim != 2
            or vectors.shape[1] != structure.lower.size
            or not np.isfinite(vectors).all()
        ):
            raise InputError(
                "gains",
                f"array of shape {vectors.shape}",
                f"finite, with {structure.lower.size} columns",
            )
    lengths = {v.size for v in varied.values()} | (set() if vectors is None else {len(vectors)})
    count = max(lengths, default=1)
    if not lengths <= {1, count}:
        raise InputError("parameters", sorted(lengths), "arrays of one length")
    for name, values in varied.items():
        # The two ends of the range decide whether all of it is permitted.
        for value in (values.min(), values.max()):
            case.with_changes(**{name: float(value)})
    a0, left, right, delay = plant_arrays(case, varied, count)
    if structure is not None and vectors is not None:
        system = case.system()
        drive, measure = loop_channels(system, structure)
        gains = _gain_arrays(structure, np.broadcast_to(vectors, (count, vectors.shape[1])))
        own = system.feedback_delay if feedback_delay is None else feedback_delay
        follows = case.drills and feedback_delay is None
        lags = feedback_lags(system, structure, own)
        for is_late in (False, True):
            for extra in np.unique(lags[0]).tolist():
                part = np.where(lags[0] == extra, gains[is_late], 0.0)
                lag = (delay if follows else np.full(count, own)) * is_late + extra
                if not part.any():
                    continue
                if not lag.any():
                    a0 = a0 + drive @ part @ measure
                    continue
                if delay.ndim == 1 and not np.array_equal(lag, delay):
                    delay = np.repeat(delay[:, None], left.shape[2], axis=1)
                if delay.ndim == 2:
                    more = np.repeat(lag[:, None], drive.shape[1], axis=1)
                    delay = np.concatenate([delay, more], axis=1)
                left = np.concatenate([left, np.broadcast_to(drive, (count, *drive.shape))], axis=2)
                right = np.concatenate([right, part @ measure], axis=1)
    return batch_abscissas(a0, left, right, delay, workers)


def plant_arrays(
    case: Case, values: Mapping[str, npt.ArrayLike], count: int
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return plants of one delay over parameters that vary.

    Parameters
    ----------
    case : Case
        Supplies the others.
    values : mapping
        Parameter → value of each, (q,).
    count : int
        q.

    Returns
    -------
    A0 : array, (q, n, n)
    left, right : array, (q, n, r) and (q, r, n)
        Factors of the delayed matrix.
    delay : array, (q,)
        τ0.

    Raises
    ------
    InputError
        If there are several delays, or parameters vary of what has none.
    """
    if case.drills:
        arrays = case.linear_arrays(case.table(values, count))
        if not arrays.one_delay:
            raise InputError("plant", "with signals that arrive late", "of one delay here")
        return arrays.A0, arrays.left, arrays.right, arrays.delay
    if values:
        case.physics(f"an axis {next(iter(values))}")
    system = case.system()
    left, right = _one_delay(system)
    copies = [np.broadcast_to(m, (count, *m.shape)) for m in (system.A0, left, right)]
    return copies[0], copies[1], copies[2], np.full(count, system.max_delay)


def _one_delay(system: DelaySystem) -> tuple[FloatArray, FloatArray]:
    if len(system.delays) != 1:
        raise InputError("system", f"{len(system.delays)} delays", "one of one delay here")
    return system.factors[0]


def _check_lags(case: Case, structure: FeedbackStructure) -> None:
    """Refuse feedback with other delays than the plant's."""
    if case.drills:
        return
    system = case.system()
    now, late = feedback_lags(system, structure)
    uses_late = structure.K2_lower.any() or structure.K2_upper.any()
    if now.any() or (uses_late and (late != system.max_delay).any()):
        lags = sorted({*now.ravel().tolist(), *late.ravel().tolist()})
        raise InputError("delays of the feedback", lags, f"0 and {system.max_delay:g} here")


def loop_arrays(
    case: Case,
    values: Mapping[str, npt.ArrayLike],
    count: int,
    structure: FeedbackStructure | None,
    K1: FloatArray,
    K2: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return A0 (q, n, n), A1 (q, n, n) and τ0 (q,) of loops over parameters and gains.

    Parameters
    ----------
    case, values, count
        As for `plant_arrays`.
    structure : FeedbackStructure or None
        What is fed back.
    K1, K2 : array, (q, m, p)
        Gains of each.
    """
    a0, left, right, tau = plant_arrays(case, values, count)
    a1 = left @ right
    if structure is not None:
        drive, measure = loop_channels(case.system(), structure)
        _check_lags(case, structure)
        a0, a1 = a0 + drive @ K1 @ measure, a1 + drive @ K2 @ measure
    return np.ascontiguousarray(a0), np.ascontiguousarray(a1), tau


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
