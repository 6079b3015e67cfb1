"""Recordings of rigs by travelling waves: unlike the chain of discs in every part but the string.

Pipe and collars carry waves exactly (method of characteristics), the drive is PI or soft and its
torque lags, the bit's torque falls as 1/(1 + (speed/decay)²). Nothing of drillctrl is used.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from tests.records.other_rig import RPM, measured, rig_text

DENSITY, SHEAR = 7850.0, 79.3e9
_STEP = 1e-3


@dataclass(frozen=True)
class WaveRig:
    """Uniform pipe above collars, m, with a rigid bit."""

    length: float = 2000.0
    pipe: tuple[float, float] = (0.127, 0.1086)
    collars: tuple[float, float, float] = (150.0, 0.1715, 0.0714)
    bit: float = 8.0
    damping: float = 0.15
    drive: float = 2500.0
    soft: float = 0.0
    level: float = 4000.0
    drop: float = 3000.0
    decay: float = 6.0

    def cells(self):
        """Numbers of cells, and the impedance and inertia of one, of pipe and collars."""
        size = np.sqrt(SHEAR / DENSITY) * _STEP
        found = []
        for length, outer, inner in ((self.length, *self.pipe), self.collars):
            polar = np.pi / 32.0 * (outer**4 - inner**4)
            found.append((round(length / size), polar * np.sqrt(SHEAR * DENSITY)))
        return found

    def lumped(self):
        """Stiffness of the pipe and inertia with a third of it, as a fit tells them."""
        (n, pipe), (m, collar) = self.cells()
        stiffness = 1.0 / (n * _STEP / pipe)
        return stiffness, pipe * n * _STEP / 3.0 + collar * m * _STEP + self.bit

    def gains(self):
        """Kp and Ki: stiff, or ``soft`` times the pipe's impedance."""
        pipe = self.cells()[0][1]
        if not self.soft:
            return 30.0 * pipe, 30.0 * pipe
        stiffness, inertia = self.lumped()
        return self.soft * pipe, self.drive * stiffness / inertia

    def toml(self, stiffer=1.0, heavier=1.0, damping=0.15):
        """Return a rig file off by these factors; the bit counts to the collars."""
        (n, _), (m, collar) = self.cells()
        size = np.sqrt(SHEAR / DENSITY) * _STEP
        longer = 1.0 + self.bit / (collar * m * _STEP)
        parts = (
            ("pipe", "pipe", n * size, *self.pipe),
            ("collars", "collar", m * size * longer, *self.collars[1:]),
        )
        return rig_text(parts, SHEAR * stiffer, DENSITY * heavier, self.drive, damping)


@numba.njit(cache=True)
def _march(n, m, pipe, collar, bit, drive, kp, ki, law, speed, shake, every, damping, spread, lag):
    size = n + m
    # Damping takes speed and leaves torque.
    lost = 0.5 * (1.0 - np.exp(-damping * _STEP))
    level, drop, decay = law
    steps = speed.size * every
    # Waves that run down and up, as torques: twist that turns the bit is positive.
    down, up = np.zeros(size + 1), np.zeros(size + 1)
    begin = speed[0]
    holds = level + drop / (1.0 + (begin / decay) ** 2)
    own = np.zeros(size + 1)
    for i in range(size + 1):
        below = damping * begin * _STEP * (max(n - i, 0) * pipe + min(m, size - i) * collar)
        own[i] = holds + damping * begin * bit + below
    for i in range(size + 1):
        z = pipe if i <= n else collar
        down[i] = 0.5 * (own[i] + z * begin)
        up[i] = 0.5 * (own[i] - z * begin)
    top, last = begin, begin
    integral = own[0]
    acting = own[0]
    measured = own[0]
    out = np.zeros((speed.size, 3))
    junction_down, junction_up = 0.5 * (own[n] + collar * begin), 0.5 * (own[n] - pipe * begin)
    for step in range(steps):
        want = speed[step // every]
        # Each end of a cell meets the wave that set out one step before.
        at_top = up[1]
        into = down[n - 1]
        back = up[n + 1]
        at_bit = down[size - 1] if m > 1 else junction_down
        for i in range(size, n + 1, -1):
            down[i] = down[i - 1]
        down[n + 1] = junction_down
        for i in range(n, 0, -1):
            down[i] = down[i - 1]
        for i in range(0, n - 1):
            up[i] = up[i + 1]
        up[n - 1] = junction_up
        for i in range(n, size):
            up[i] = up[i + 1]
        # Fast waves lose more: a share of each cell is spread over its neighbours.
        before, above = down[0], up[0]
        for i in range(1, size):
            here, near = down[i], up[i]
            if abs(i - n) > 1:
                down[i] += 0.5 * spread * (before - 2.0 * here + down[i + 1])
                up[i] += 0.5 * spread * (above - 2.0 * near + up[i + 1])
            before, above = here, near
            if i != n:
                off = lost * (down[i] - up[i])
                down[i] -= off
                up[i] += off
        # Junction: torque and speed are shared.
        rate = 2.0 * (into - back) / (pipe + collar)
        torque = 2.0 * into - pipe * rate
        junction_down = 0.5 * (torque + collar * rate)
        junction_up = 0.5 * (torque - pipe * rate)
        up[n] = junction_up
        down[n] = into
        # Top: J ω' = drive − T, T = 2 up + ζ ω.
        pull = kp * (want - top) + integral
        acting += (pull - acting) * _STEP / 0.01
        integral += ki * (want - top) * _STEP
        load = 2.0 * at_top
        now = (top * (drive / _STEP - 0.5 * pipe) + acting - load) / (drive / _STEP + 0.5 * pipe)
        mid = 0.5 * (now + top)
        top = now
        down[0] = at_top + pipe * mid
        up[0] = at_top
        # Bit: J ω' = T − friction, T = 2 down − ζ ω.
        size_now = (level + drop / (1.0 + (last / decay) ** 2)) * (1.0 + shake[step // every])
        push = 2.0 * at_bit - damping * bit * last
        ahead = (last * (bit / _STEP - 0.5 * collar) + push) / (bit / _STEP + 0.5 * collar)
        least = size_now / (bit / _STEP + 0.5 * collar)
        if abs(ahead) <= least:
            after = 0.0
        else:
            after = ahead - np.sign(ahead) * least
        mid = 0.5 * (after + last)
        last = after
        up[size] = at_bit - collar * mid
        down[size] = at_bit
        measured += (acting - measured) * (_STEP / lag if lag > 0.0 else 1.0)
        # Means over an interval, as controllers record them.
        out[step // every, 0] += top / every
        out[step // every, 1] += measured / every
        out[step // every, 2] += last / every
    return out


def wave_recorded(
    rig,
    speed=60.0,
    seconds=400.0,
    seed=0,
    rate=20.0,
    lag=0.02,
    rock=0.02,
    noise=(0.3, 80.0),
    steps=(0.5, 50.0),
    gaps=0,
):
    """Return time, rpm and N m as measured (rows of gaps left out), and the bit's true rpm."""
    random = np.random.default_rng(seed)
    (n, pipe), (m, collar) = rig.cells()
    count, every = int(seconds * rate), round(1.0 / rate / _STEP)
    wanted = np.full(count, speed * RPM)
    law = np.array([rig.level, rig.drop, rig.decay])
    out = _march(
        n,
        m,
        pipe,
        collar,
        rig.bit,
        rig.drive,
        *rig.gains(),
        law,
        wanted,
        rock * random.standard_normal(count),
        every,
        rig.damping,
        0.2,
        lag,
    )
    top, torque = measured(random, out[:, 0], out[:, 1], noise, steps)
    time = np.arange(count) / rate
    kept = np.ones(count, dtype=bool)
    for i in range(gaps):
        begin = (i + 1) * count // (gaps + 1)
        kept[begin : begin + int(3.0 * rate)] = False
    return time[kept], top[kept], torque[kept], out[kept, 2] / RPM
