"""What of a recording's columns cannot be right, or is not there: said, or left out and said."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from drillctrl.base.arrays import FloatArray

# A speed or torque that stays to the last digit for so long, s, comes from no sensor.
_STANDS = 10.0
# So many times the width of nearly all values outside of them, in at most this share: no motion.
_FAR, _FEW = 3.0, 0.002
# No string is turned faster, rad/s.
_FAST = 35.0
# Two columns that both change so many-fold from one stretch of so many seconds to the next.
_FOLD, _STRETCH = 5.0, 10.0
# A leap is so many times what moves beside it.
_LEAP = 3.0
_MOVING = ("rotary_speed", "torque", "bit_speed", "bit_torque")


def without_spikes(
    times: FloatArray, rows: Mapping[str, FloatArray], step: float
) -> tuple[dict[str, FloatArray], list[str]]:
    """Return columns whose spikes are left out as NaN, and what is to be said of all of them.

    Parameters
    ----------
    times : array, (k,)
        s, rising.
    rows : mapping
        Quantity → array, (k,), NaN where there is no number.
    step : float
        Between most rows, s.
    """
    notes, kept = [], dict(rows)
    for name, data in rows.items():
        told = name.replace("_", " ")
        missing = int(np.isnan(data).sum())
        if missing:
            notes.append(f"{told} has no number in {missing} of {data.size} rows")
        if name not in _MOVING or missing == data.size:
            continue
        low, high = np.nanquantile(data, [_FEW, 1.0 - _FEW])
        far = _FAR * (high - low)
        spikes = (data < low - far) | (data > high + far)
        if high > low and spikes.any() and spikes.mean() <= _FEW:
            kept[name] = np.where(spikes, np.nan, data)
            at = times[int(np.argmax(spikes))]
            count = int(spikes.sum())
            notes.append(f"{count} of {told} far beyond all others left out, from {at:g} s on")
        notes += _standing(times, data, told)
        notes += _turned(times, kept[name], told)
    fast = float(np.nanmedian(np.abs(rows.get("rotary_speed", np.zeros(1)))))
    if fast > _FAST:
        notes.append(
            f"rotary speed is {fast * 30.0 / np.pi:.0f} rpm in the median: is its unit so?"
        )
    if "torque" in rows:
        notes += _shifted(times, kept["torque"], step)
    return kept, [*notes, *_mixed(times, rows, step)]


def _turned(times: FloatArray, data: FloatArray, told: str) -> list[str]:
    """Say for how long a column has the other sign."""
    usual = np.sign(np.nanmedian(data))
    wrong = usual * data < -0.1 * np.nanmedian(np.abs(data))
    edges = np.flatnonzero(np.diff(np.concatenate([[False], wrong, [False]]).astype(int)))
    if not edges.size:
        return []
    begin, end = edges[::2], edges[1::2] - 1
    place = int(np.argmax(times[end] - times[begin]))
    long = times[end[place]] - times[begin[place]]
    if long < _STANDS:
        return []
    return [f"{told} has the other sign for {long:.4g} s from {times[begin[place]]:g} s on"]


def _shifted(times: FloatArray, torque: FloatArray, step: float) -> list[str]:
    """Say where torque leaps by far more than it moves before and after."""
    per = max(4, round(_STRETCH / step))
    parts = [torque[a : a + per] for a in range(0, torque.size - per + 1, per)]
    if len(parts) < 4 or not all(np.isfinite(part).any() for part in parts):
        return []
    middle = np.array([np.nanmedian(part) for part in parts])
    moves = np.array([np.nanmax(part) - np.nanmin(part) for part in parts])
    leap = np.abs(middle[3:] - middle[:-3])
    far = leap > _LEAP * np.maximum(moves[3:], moves[:-3])
    turns = np.minimum(np.abs(middle[3:]), np.abs(middle[:-3])) > 0.05 * np.nanmax(np.abs(middle))
    found = np.flatnonzero(far & turns)
    if not found.size:
        return []
    place = int(found[np.argmax(leap[found])])
    return [
        f"torque leaps by {leap[place] / 1e3:.3g} kN·m near {times[per * (place + 2)]:.4g} s, far "
        "beyond its motion: is that the rig's?"
    ]


def _standing(times: FloatArray, data: FloatArray, told: str) -> list[str]:
    """Say for how long a column repeats one number."""
    edges = np.flatnonzero(np.concatenate([[True], np.diff(data) != 0.0, [True]]))
    if edges.size == 2:
        return [f"{told} is one number throughout"]
    long = times[edges[1:] - 1] - times[edges[:-1]]
    place = int(np.argmax(long))
    if long[place] < _STANDS or np.isnan(data[edges[place]]):
        return []
    return [f"{told} repeats one number for {long[place]:.4g} s from {times[edges[place]]:g} s on"]


def _mixed(times: FloatArray, rows: Mapping[str, FloatArray], step: float) -> list[str]:
    """Say where speed and torque change so much at once that columns may have been mixed up."""
    if not {"rotary_speed", "torque"} <= rows.keys():
        return []
    per = max(4, round(_STRETCH / step))
    edges = np.arange(per, times.size, per)
    folds = []
    for name in ("rotary_speed", "torque"):
        size = np.abs(rows[name])
        parts = [p[np.isfinite(p)] for p in np.split(size, edges)]
        middle = np.array([np.median(part) if part.size else np.nan for part in parts])
        least = 0.01 * np.nanmax(middle, initial=0.0)
        with np.errstate(invalid="ignore", divide="ignore"):
            fold = np.abs(np.log(middle[1:] / middle[:-1]))
        # What stops or starts changes without bound.
        folds.append(np.where((middle[1:] > least) & (middle[:-1] > least), fold, 0.0))
    both = np.flatnonzero(np.minimum(*folds) > np.log(_FOLD))
    return [
        f"speed and torque both change more than {_FOLD:g}-fold near {times[edges[k]]:.4g} s: "
        "are columns or units mixed there?"
        for k in both[:1]
    ]
