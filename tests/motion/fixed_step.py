"""The axial motion under an imposed rotation by fixed steps, written on its own."""

import math

import numba
import numpy as np


@numba.njit
def _march(groups, amplitude, frequency, step, count, sums):
    omega0, delta0, psi, eta, xi, blades, lam, beta = groups
    v0 = delta0 * omega0
    pitch = 2.0 * math.pi / blades
    back = int(pitch / (omega0 * (1.0 - amplitude)) / step) + 2
    # Deepest place that any blade has been at, and the angle, step by step; smooth drilling before.
    deepest, angle = np.empty(back + count), np.empty(back + count)
    for i in range(back):
        t = (i - back) * step
        deepest[i], angle[i] = v0 * t, omega0 * t
    z, rate, j = 0.0, 1.1 * v0, 0
    for i in range(count):
        t = i * step
        k = back + i
        angle[k] = omega0 * t + omega0 * amplitude / frequency * math.sin(frequency * t)
        ahead = angle[k] - pitch
        while angle[j + 1] < ahead:
            j += 1
        s = (ahead - angle[j]) / (angle[j + 1] - angle[j])
        face = deepest[j] + s * (deepest[j + 1] - deepest[j])
        depth = blades * (z - face)
        cut = max(depth, 0.0)
        x = z - v0 * t
        push = -2.0 * xi * eta * (rate - v0) - eta**2 * x
        push -= psi * (cut - 2.0 * math.pi * delta0) - lam
        free = rate + step * push
        rate = free
        if depth > 0.0 and free > 0.0:
            # The wear flat takes what it can, no more than stops the bit.
            rate = max(0.0, free - step * lam)
        pressed = (free - rate) / (step * lam)
        deepest[k] = max(z, face)
        z += step * rate
        if t >= sums[0]:
            window = 1.0 - math.cos(2.0 * math.pi * (t - sums[0]) / (count * step - sums[0]))
            torque = (cut + beta * pressed) * window
            sums[1] += torque * math.cos(frequency * t)
            sums[2] -= torque * math.sin(frequency * t)


def fixed_step_response(point, frequency, amplitude, periods=16, wait=12, step=1e-4):
    """Return H of an operating point, after so many periods of waiting."""
    period = 2.0 * math.pi / frequency
    count = round((wait + periods) * period / step)
    sums = np.array([wait * period, 0.0, 0.0])
    names = ("omega0", "delta0", "psi", "eta", "xi", "blades", "lam", "beta")
    groups = tuple(float(getattr(point, name)) for name in names)
    _march(groups, amplitude, frequency, step, count, sums)
    scale = 2.0 / (count * step - sums[0]) * step
    return complex(sums[1], sums[2]) * scale / (amplitude * point.omega0)
