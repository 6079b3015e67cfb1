"""Gains and their bounds as texts on the command line."""

from __future__ import annotations

from drillctrl.base.errors import InputError


def read_bounds(texts: tuple[str, ...]) -> dict[str, tuple[float, float]]:
    """Return bounds by gain from texts such as ``K1=-10:10``."""
    bounds = {}
    for text in texts:
        name, _, interval = text.partition("=")
        low, _, high = interval.partition(":")
        try:
            bounds[name.strip()] = (float(low), float(high))
        except ValueError:
            raise InputError("--bound", text, "of the form K1=-10:10") from None
    return bounds


def read_gains(name: str, text: str | None) -> list[float] | None:
    """Return a flat list of gains from a text such as ``-5.03,-4.91``."""
    if text is None:
        return None
    try:
        return [float(part) for part in text.replace(",", " ").split()]
    except ValueError:
        raise InputError(f"--{name}", text, "numbers with commas between them") from None
