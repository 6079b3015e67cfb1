"""Recordings of rigs by a program of our own: a chain of discs, a PI drive, a falling friction.

Nothing of drillctrl is used. Symplectic Euler steps of half a millisecond; the bit sticks while
friction can hold it.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass

import numba
import numpy as np
import scipy.linalg

RPM = np.pi / 30.0


@dataclass(frozen=True)
class OtherRig:
    """Uniform pipe above collars, or with ``elements = 1`` one spring and one disc."""

    length: float = 2000.0
    pipe: tuple[float, float] = (0.127, 0.1086)
    collars: tuple[float, float, float] = (200.0, 0.171, 0.071)
    damping: float = 0.15
    retardation: float = 1e-3
    drive: float = 2000.0
    kp: float = 12000.0
    ki: float = 12000.0
    static: float = 4000.0
    drop: float = 3000.0
    decay: float = 5.0
    elements: int = 40

    def chain(self):
        """Inertias from the first disc below the drive to the bit, and springs above each."""
        density, shear = 7850.0, 79.3e9

        def polar(outer, inner):
            return np.pi / 32.0 * (outer**4 - inner**4)

        n = self.elements
        low = max(1, n // 8)
        j, k = np.zeros(n + low + 1), np.zeros(n + low)
        dz, jp = self.length / n, polar(*self.pipe)
        for i in range(n):
            k[i] = shear * jp / dz
            j[i] += 0.5 * density * jp * dz
            j[i + 1] += 0.5 * density * jp * dz
        dz, jc = self.collars[0] / low, polar(*self.collars[1:])
        for i in range(n, n + low):
            k[i] = shear * jc / dz
            j[i] += 0.5 * density * jc * dz
            j[i + 1] += 0.5 * density * jc * dz
        return j, k

    def modes(self, count=2):
        """Hz: top held, bit free, no damping."""
        j, k = self.chain()
        stiff = np.zeros((j.size, j.size))
        for i, value in enumerate(k):
            stiff[i : i + 2, i : i + 2] += value * np.array([[1, -1], [-1, 1]])
        found = scipy.linalg.eigh(stiff[1:, 1:], np.diag(j[1:]), eigvals_only=True)
        return np.sqrt(found[:count]) / (2.0 * np.pi)

    def toml(self, stiffer=1.0, heavier=1.0):
        """Return a rig file that drillctrl reads, its pipe and collars off by these factors."""
        parts = (("pipe", "pipe", self.length, *self.pipe), ("collars", "collar", *self.collars))
        text = rig_text(parts, 79.3e9 * stiffer, 7850.0 * heavier, self.drive, 0.15)
        return text + "kelvin_voigt = 1e-3\n"


def rig_text(parts, shear, density, drive, damping):
    """Return a rig file of parts: name, type, length, outer and inner diameter."""
    rows = "".join(
        f'[[sections]]\nname = "{name}"\ntype = "{kind}"\nlength = "{size} m"\n'
        f'outer_diameter = "{outer} m"\ninner_diameter = "{inner} m"\n'
        f'shear_modulus = "{shear} Pa"\ndensity = "{density} kg/m^3"\n'
        for name, kind, size, outer, inner in parts
    )
    return rows + (
        '[bit]\ndiameter = "0.216 m"\nblades = 4\nwearflat_length = "1.2 mm"\n'
        "cutter_inclination = 0.6\nfriction_coefficient = 0.6\ngeometry = 1.0\n"
        '[rock]\nstrength = "60 MPa"\ncontact_strength = "60 MPa"\n'
        f'[top_drive]\ninertia = "{drive} kg*m^2"\n[damping]\ntorsional = {damping}\n'
    )


def measured(random, speed, torque, noise, steps):
    """Return rpm and N m with noise, rounded to steps where these are not zero."""
    found = []
    for data, size, step in zip((speed / RPM, torque), noise, steps, strict=True):
        data = data + size * random.standard_normal(data.size)
        found.append(step * np.round(data / step) if step else data)
    return found


@numba.njit(cache=True)
def _march(j, k, c, r, drive, kp, ki, law, speed, noise, steps, every, dt, lag):
    n = j.size
    static, drop, decay = law
    theta, omega = np.zeros(n), np.full(n, speed[0])
    torque0 = static + drop * np.exp(-speed[0] / decay)
    below = torque0
    for i in range(n - 2, -1, -1):
        below += c * j[i + 1] * speed[0]
        theta[i + 1] = below
    for i in range(n - 1):
        theta[i + 1] = theta[i] - theta[i + 1] / k[i]
    integral = below + c * 0.0
    lagged = below
    last = omega.copy()
    out = np.zeros((steps // every, 4))
    total = j[0] + drive
    for step in range(steps):
        want = speed[step // every]
        integral += ki * (want - omega[0]) * dt
        pull = kp * (want - omega[0]) + integral
        up = 0.0
        last[:] = omega
        for i in range(n):
            down = 0.0
            if i < n - 1:
                down = k[i] * (theta[i] - theta[i + 1] + r * (last[i] - last[i + 1]))
            torque = up - down
            if i == 0:
                omega[0] += dt / total * (pull - down)
            elif i < n - 1:
                omega[i] += dt / j[i] * (torque - c * j[i] * omega[i])
            else:
                ahead = omega[i] + dt / j[i] * (torque - c * j[i] * omega[i])
                size = (static + drop * np.exp(-abs(omega[i]) / decay)) * (
                    1.0 + noise[step // every]
                )
                least = dt / j[i] * size
                if abs(ahead) <= least:
                    omega[i] = 0.0
                else:
                    omega[i] = ahead - np.sign(ahead) * least
            up = down
        for i in range(n):
            theta[i] += dt * omega[i]
        lagged += (pull - lagged) * (dt / lag if lag > 0.0 else 1.0)
        if step % every == 0:
            out[step // every, 0] = omega[0]
            out[step // every, 1] = lagged
            out[step // every, 2] = omega[n - 1]
            out[step // every, 3] = k[0] * (theta[0] - theta[1])
    return out


def recorded(
    rig,
    speed=60.0,
    seconds=300.0,
    seed=0,
    rock=0.0,
    rate=20.0,
    lag=0.0,
    noise=(0.2, 60.0),
    steps=(0.0, 0.0),
    weight=1.0,
):
    """Return time, rpm and N m as measured, and the bit's true rpm.

    ``rock`` is the relative size of a slow noise of the bit's torque; ``noise`` what is added to
    rpm and torque, ``steps`` what they are rounded to; ``weight`` is that on the bit, over the one
    that the law is of.
    """
    random = np.random.default_rng(seed)
    j, k = rig.chain()
    dt = 5e-4
    every = round(1.0 / rate / dt)
    count = int(seconds * rate)
    wanted = np.broadcast_to(np.asarray(speed, dtype=float) * RPM, (count,)).copy()
    shaken = weight * (1.0 + rock * random.standard_normal(count)) - 1.0
    law = np.array([rig.static, rig.drop, rig.decay])
    out = _march(
        j,
        k,
        rig.damping,
        rig.retardation,
        rig.drive,
        rig.kp,
        rig.ki,
        law,
        wanted,
        shaken,
        count * every,
        every,
        dt,
        lag,
    )
    top, torque = measured(random, out[:, 0], out[:, 1], noise, steps)
    return np.arange(count) / rate, top, torque, out[:, 2] / RPM


def write_csv(path, time, top, torque, bit=None):
    """Write a recording as rigs do."""
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        names = ["Time [s]", "Surface RPM [rpm]", "STOR [kN.m]"]
        writer.writerow(names + (["Bit RPM [rpm]"] if bit is not None else []))
        for i, t in enumerate(time):
            row = [f"{t:.3f}", f"{top[i]:.3f}", f"{torque[i] / 1e3:.4f}"]
            writer.writerow(row + ([f"{bit[i]:.2f}"] if bit is not None else []))
