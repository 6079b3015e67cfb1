"""Numbers as other programs read them."""

from __future__ import annotations

import math


def finite_or_none(value: float) -> float | None:
    """Return a float that JSON can hold; None for what is not finite."""
    return float(value) if math.isfinite(value) else None
