"""The edge of a basin along one disturbance: the size up to which the motion settles."""

from __future__ import annotations

import math
from collections.abc import Callable

# Below this share of the smallest size nothing is looked for.
_LEAST = 1.0 / 1024.0


def basin_edge(
    settles: Callable[[float], bool],
    smallest: float,
    largest: float,
    sharpness: float,
    low: float = 0.0,
    high: float | None = None,
) -> tuple[float, float | None]:
    """Return a size that settles and one that does not, close together.

    Parameters
    ----------
    settles : callable
        Whether the motion settles after a disturbance of a size.
    smallest, largest : float
        Sizes are doubled from the first up to the second until one does not settle.
    sharpness : float
        The interval between the two is then halved (in its ends' ratio) until it is this.
    low, high : float
        Sizes that are known to settle and not to, if any.

    Returns
    -------
    low, high : float
        0 where even small ones do not settle; None for ``high`` if the largest settles too.

    Notes
    -----
    What lies beyond the first size that does not settle is not looked at.
    """
    while high is None:
        if low >= largest:
            return low, None
        size = min(2.0 * low, largest) if low > 0.0 else smallest
        if settles(size):
            low = size
        else:
            high = size
    least = smallest * _LEAST
    while high > sharpness * low and high > least:
        size = math.sqrt(low * high) if low > 0.0 else 0.5 * high
        if settles(size):
            low = size
        else:
            high = size
    return low, high
