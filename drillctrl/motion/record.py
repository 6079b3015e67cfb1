"""Sums over windows of a run: what a frequency holds of the torque, and how the bit met rock."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.simulation.trace import Trace

# Gauss points on each piece of a step; between two events all is smooth.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)


class Halves(NamedTuple):
    """Sums over successive halves of windows, h of them.

    Attributes
    ----------
    torques, speeds : complex array, (h, 3)
        Means of T e^(−iωt), and of θ' likewise, times 1, e^(iνt) and e^(−iνt), with ν = 2π over
        the window.
    weight, torque : array, (h,)
        Mean loads on the bit.
    held, lifted : array, (h,)
        Shares of the time.
    """

    torques: ComplexArray
    speeds: ComplexArray
    weight: FloatArray
    torque: FloatArray
    held: FloatArray
    lifted: FloatArray


def halves(run: Trace, since: float, half: float, frequency: float) -> Halves:
    """Return the sums over all halves of windows that a run holds.

    Parameters
    ----------
    run : Trace
        A run.
    since : float
        Begin of the first, from which phases count.
    half : float
        Length of each, whole periods.
    frequency : float
        ω.
    """
    end = float(run.times[-1])
    count = int(np.floor((end - since) / half + 1e-6))
    edges = np.minimum(since + half * np.arange(count + 1), end)
    inside = run.times[(run.times > since) & (run.times < edges[-1])]
    corners = np.unique(np.concatenate([edges, inside]))
    length = np.diff(corners)
    times = corners[:-1, None] + 0.5 * length[:, None] * (_NODES + 1.0)
    motion = run.at(times.ravel(), ("torque_on_bit", "dtheta", "weight_on_bit", "contact"))
    share = 0.5 * length[:, None] * _WEIGHTS / half
    torque, speed, weight, contact, held = (
        np.asarray(values).reshape(times.shape)
        for values in (
            motion.torque_on_bit,
            motion.dtheta,
            motion.weight_on_bit,
            motion.contact,
            motion.held,
        )
    )
    place = np.searchsorted(edges, 0.5 * (corners[:-1] + corners[1:]), side="right") - 1

    def means(values: FloatArray) -> FloatArray:
        sums = np.bincount(place, (share * values).sum(axis=1), minlength=count)
        return np.asarray(sums, dtype=float)

    def tones(values: FloatArray) -> ComplexArray:
        found = []
        for omega in (frequency, frequency - np.pi / half, frequency + np.pi / half):
            phase = omega * (times - since)
            found.append(means(values * np.cos(phase)) - 1j * means(values * np.sin(phase)))
        return np.stack(found, axis=1)

    on_rock = contact.astype(float)
    return Halves(
        tones(torque), tones(speed), means(weight), means(torque),
        means((contact & held).astype(float)), means(1.0 - on_rock),
    )  # fmt: skip


def windowed(tones: ComplexArray) -> ComplexArray:
    """Return the amplitude at ω in windows that overlap by half, (h − 1,), from `Halves`.

    Each is weighed by 1 − cos, so that neither the mean nor the lines of the axial orbit,
    which is in no whole ratio to ω, leak into it.
    """
    # From one half to the next the weight turns by π.
    turn = (-1.0) ** np.arange(tones.shape[0])
    plain = tones[:, 0]
    beside = 0.5 * turn * (tones[:, 1] + tones[:, 2])
    # Halves that begin a window, and those that end one.
    return (plain - beside)[:-1] + (plain + beside)[1:]
