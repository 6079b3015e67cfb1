"""A string in finite elements with its drive as one system with a delay: the second route."""

import numpy as np
import scipy.signal

from drillctrl import DelaySystem
from drillctrl.strings.elements import elements

_NOTHING = (np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0)), np.zeros((1, 1)))


def root_near(system, s):
    """Return the root near s by inverse iteration and Rayleigh quotients on Δ(s)."""
    rng = np.random.default_rng(0)
    vector = rng.normal(size=system.order) + 0j
    for _ in range(30):
        delta = s * np.eye(system.order) - system.A0
        slope = np.eye(system.order, dtype=complex)
        for matrix, tau in zip(system.delayed, system.delays, strict=True):
            delta = delta - matrix * np.exp(-s * tau)
            slope = slope + tau * matrix * np.exp(-s * tau)
        vector = np.linalg.solve(delta, slope @ vector)
        vector = vector / np.linalg.norm(vector)
        left = np.linalg.solve(delta.T, np.conj(vector))
        change = (left @ delta @ vector) / (left @ slope @ vector)
        s = s - change
        if abs(change) < 1e-11:
            return s
    raise AssertionError("no root near")


def driven_string(line, control, slope=0.0, element_length=50.0, delay=None):
    """Return bit, string, drive and law as a DelaySystem in SI.

    The pipe's torque is J times the drive's acceleration less the drive's own torque.
    """
    machine = control.machine
    chain = elements(line, element_length)
    n = chain.diagonal.shape[1]
    mass, damping, stiffness = (
        np.diag(d) + np.diag(b, 1) + np.diag(b, -1)
        for d, b in zip(chain.diagonal, chain.beside, strict=True)
    )
    mass[-1, -1] += machine.inertia
    damping[0, 0] -= slope
    inverse = np.linalg.inv(mass)
    laws = [
        scipy.signal.tf2ss(law.numerator, law.denominator) if law else _NOTHING
        for law in (control.speed, control.torque)
    ]
    orders = [len(law[0]) if np.size(law[0]) else 0 for law in laws]
    names = ["q"] * n + ["v"] * n + ["a"] * orders[0] + ["b"] * orders[1] + ["T", "drive", "w"]
    size = len(names)
    pipe, given, measured = size - 3, size - 2, size - 1
    a0, late = np.zeros((size, size)), np.zeros((size, size))
    a0[:n, n : 2 * n] = np.eye(n)
    a0[n : 2 * n, :n] = -inverse @ stiffness
    a0[n : 2 * n, n : 2 * n] = -inverse @ damping
    # What the law wants, as a row of the states.
    speed = np.zeros(size)
    if machine.encoder:
        speed[measured] = 1.0
        a0[measured, 2 * n - 1], a0[measured, measured] = 1 / machine.encoder, -1 / machine.encoder
    else:
        speed[2 * n - 1], a0[measured, measured] = 1.0, -1.0
    torque = np.eye(size)[pipe]
    wanted, at = np.zeros(size), 2 * n
    for (a, b, c, d), order, seen, sign in zip(
        laws, orders, (speed, torque), (-1.0, 1.0), strict=True
    ):
        own = slice(at, at + order)
        if order:
            a0[own, own] = a
            a0[own] += np.outer(b[:, 0], seen)
            wanted[own] += sign * c[0]
        wanted += sign * d[0, 0] * seen
        at += order
    acts = np.zeros(size)
    if machine.lag:
        late[given] += wanted / machine.lag
        a0[given, given] = -1.0 / machine.lag
        acts[given] = 1.0
        a0[n : 2 * n] += np.outer(inverse[:, -1], acts)
        late_acts = np.zeros(size)
    else:
        a0[given, given] = -1.0
        late_acts = wanted
        late[n : 2 * n] += np.outer(inverse[:, -1], wanted)
    a0[pipe] = (machine.inertia * a0[2 * n - 1] - acts) / machine.torque_filter
    a0[pipe, pipe] -= 1.0 / machine.torque_filter
    late[pipe] = (machine.inertia * late[2 * n - 1] - late_acts) / machine.torque_filter
    tau = machine.delay if delay is None else delay
    if tau == 0.0:
        return DelaySystem(a0 + late)
    return DelaySystem(a0, (late,), (tau,))
