"""What rock and string bear in the last quarter of a run, beside steady drilling."""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from drillctrl.simulation.trace import Trace

_PER_STEP = 5


@dataclass(frozen=True)
class Loads:
    """Loads of the last quarter; steady drilling at the starting point has 1 throughout.

    Attributes
    ----------
    weight_ratio, torque_ratio : float or None
        Mean weight and torque on bit over the steady ones; None where those are 0.
    weight_peak, torque_peak : float or None
        The largest, likewise.
    off_rock_fraction : float
        Share of the time off the rock.
    """

    weight_ratio: float | None
    torque_ratio: float | None
    weight_peak: float | None
    torque_peak: float | None
    off_rock_fraction: float

    def to_dict(self) -> dict[str, float | None]:
        """Return the fields by name."""
        return asdict(self)


def loads(run: Trace) -> Loads:
    """Return the loads of a run.

    Parameters
    ----------
    run : Trace
        Of any model; that of the linear one are those of small motion.
    """
    end = float(run.times[-1])
    tail = run.on_steps(_PER_STEP, 0.75 * end, ("weight_on_bit", "torque_on_bit"))
    span = float(tail.times[-1] - tail.times[0])
    means: list[float | None] = []
    peaks: list[float | None] = []
    for values, steady in zip(
        (tail.weight_on_bit, tail.torque_on_bit), run.steady_load, strict=True
    ):
        known = steady > 0.0 and span > 0.0
        mean = float(np.trapezoid(values, tail.times)) / span if known else None
        means.append(None if mean is None else mean / steady)
        peaks.append(float(values.max()) / steady if known else None)
    off = sum(max(0.0, b - max(a, 0.75 * end)) for a, b in run.phases("lost"))
    return Loads(means[0], means[1], peaks[0], peaks[1], off / (0.25 * end) if end > 0.0 else 0.0)
