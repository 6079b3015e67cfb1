"""Motion by fixed steps and its name, written from the equations and from what the names mean.

Nothing here is the package's: groups in, arrays out. Steps are of first order, loads at Φ' = 0
and Z' = 0 implicit (what holds the bit, if they can bear it), the rock face a list of angles that
the bit has reached and of the deepest place there.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np

# Ω0, δ0, ψ, η, ξ, κ, λ, β, n.
GROUPS = ("omega0", "delta0", "psi", "eta", "xi", "kappa", "lam", "beta", "blades")
KICKS = {"small": (0.05, 0.1), "kick": (0.5, 0.5), "back": (0.5, -0.5)}
# Columns of what is found; BEHIND is by what angle it has turned back.
X, V, THETA, W, CONTACT, STUCK, BEHIND, PLACE, WEIGHT, TORQUE, COLUMNS = range(11)


@numba.njit
def march(groups, gains, limit, start, end, dt, every, multiple):
    """Integrate; a row every so many steps. Starts: 0 steady drilling, 1 rest, 2 a stick of 1."""
    omega, delta, psi, eta, xi, kappa, lam, beta, blades = groups
    p1, p2, q1, q2 = gains
    kind, dx, dtheta = start
    feed, pitch = delta * omega, 2.0 * math.pi / blades
    weight0, torque0 = psi * blades * delta * pitch + lam, blades * delta * pitch + beta
    lag_steps = round(pitch / omega / dt)
    stood = round(1.0 / dt) if kind == 2 else 0
    before = 3 * lag_steps + stood
    steps = int(end / dt)
    reached, place = np.empty(before + steps + 1), np.empty(before + steps + 1)
    angles, rates = np.zeros(before + steps + 1), np.zeros(before + steps + 1)
    x, v, theta, w = 0.0, dx, 0.0, dtheta
    if kind == 1:
        # Damping is against the hole: at rest it takes nothing of what it does in steady drilling.
        x, theta = (weight0 + 2.0 * xi * eta * feed) / eta**2, torque0 + 2.0 * kappa * omega
        v, w = v - feed, w - omega
    if kind == 2:
        x, theta = -feed * stood * dt, -omega * stood * dt
        v, w = v - feed, w - omega
    for i in range(before + 1):
        t = (i - before) * dt
        # A bit that stands reaches no new angle.
        reached[i], place[i] = omega * t + theta, feed * t + x
        if kind == 1:
            place[i], angles[i] = x, theta
        if kind == 2:
            since = min(t + stood * dt, 0.0)
            reached[i], place[i] = omega * (since - stood * dt), feed * (since - stood * dt)
            reached[i] += omega * stood * dt + theta
            place[i] += feed * stood * dt + x
            angles[i] = 0.0 if since < 0.0 else -omega * (t + stood * dt)
            rates[i] = 0.0 if since < 0.0 else -omega
    found, j = np.empty((steps // every + 1, COLUMNS)), 0
    furthest = reached[before]
    for i in range(before, before + steps + 1):
        t = (i - before) * dt
        angle = omega * t + theta
        furthest = max(furthest, angle)
        ahead = furthest - pitch
        while reached[j + 1] < ahead or reached[j + 1] == reached[j]:
            j += 1
        share = (ahead - reached[j]) / (reached[j + 1] - reached[j])
        face = place[j] + share * (place[j + 1] - place[j])
        z = feed * t + x
        reached[i], place[i] = furthest, max(z, face) if multiple else z
        if furthest > angle and i > 0:
            # While it is behind its cutters leave the face as it was.
            place[i] = place[i - 1]
        angles[i], rates[i] = theta, w
        cut = max(blades * (z - face), 0.0)
        touches = z > face
        resting = furthest > angle
        u = p1 * theta + p2 * w + q1 * angles[i - lag_steps] + q2 * rates[i - lag_steps]
        u = min(max(u, -limit), limit)
        pull = weight0 - 2.0 * xi * eta * v - eta * eta * x - psi * cut
        pressed = 0.0
        if touches:
            pressed = min(max((feed + v + dt * pull) / (dt * lam), 0.0), 1.0)
        turn = torque0 - 2.0 * kappa * w - theta + u
        bears = (0.0 if resting else cut) + beta * pressed
        after = omega + w + dt * turn
        stuck, torque = False, bears
        if after > dt * bears:
            after -= dt * bears
        elif after < -dt * beta * pressed:
            after += dt * beta * pressed
            torque = -beta * pressed
        else:
            torque, after, stuck = after / dt, 0.0, True
        if (i - before) % every == 0:
            row = found[(i - before) // every]
            row[X], row[V], row[THETA], row[W] = x, v, theta, w
            row[CONTACT], row[STUCK], row[BEHIND] = touches, stuck, furthest - angle
            row[PLACE], row[WEIGHT], row[TORQUE] = z, psi * cut + lam * pressed, torque
        v += dt * (pull - lam * pressed)
        x += dt * v
        w = after - omega
        theta += dt * w
        # It grows beyond what such steps can follow.
        if not (abs(v) < 1e9 and abs(w) * dt < 0.1 * pitch):
            found[(i - before) // every + 1 :] = np.nan
            break
    return found


class Motion(NamedTuple):
    """What was found; ``rows`` as of `march`, ``gap`` apart."""

    rows: np.ndarray
    gap: float
    groups: tuple[float, ...]


def motion(
    point, *, gains=(), limit=math.inf, start="small", kick=None, end=60.0, dt=2e-4, nudge=0.0
):
    """Return the motion of an operating point by fixed steps.

    ``gains`` are those on θ, θ' and both a delay ago; ``kick`` is one of x' and θ' in
    place of the start's, and ``nudge`` one by a share of Ω0.
    """
    groups = tuple(float(getattr(point, name)) for name in GROUPS)
    kind = ("rest", "stick").index(start) + 1 if start in ("rest", "stick") else 0
    feed, turn = KICKS.get(start, (0.0, 0.0))
    begin = (feed * groups[0] * groups[1], (turn + nudge) * groups[0]) if kick is None else kick
    gains, every = (*map(float, gains), *(0.0,) * (4 - len(gains))), 10
    rows = march(groups, gains, limit, (kind, *begin), end, dt, every, True)
    return Motion(rows, every * dt, groups)


def name_of(found, beside):
    """Return in one word what became of a motion, as far as its last quarter tells.

    ``beside`` is a motion that started next to it: the two come apart where it is chaotic.
    """
    rows = found.rows
    omega, delta, psi, eta, _, _, lam, beta, _ = found.groups
    feed = delta * omega
    weight, torque = psi * 2.0 * math.pi * delta + lam, 2.0 * math.pi * delta + beta
    if not np.isfinite(rows).all():
        return "diverges"
    size, late = np.abs(rows).max(axis=0), weight + eta**2 * max(0.0, -rows[:, X].mean())
    if size[V] > 20.0 * (feed + late / eta) or size[W] > 20.0 * (omega + torque):
        return "diverges"
    if rows[:, BEHIND].max() > 1e-9:
        return "turns-back"
    tail = rows[3 * len(rows) // 4 :]
    if tail[:, STUCK].mean() > 0.999:
        return "stalls"
    deepest = np.maximum.accumulate(rows[:, PLACE])[-len(tail) :]
    if deepest[-1] - deepest[0] < 0.9 * feed * found.gap * (len(tail) - 1):
        return "does-not-keep-up"
    if tail[:, WEIGHT].mean() > 2.0 * weight:
        return "does-not-keep-up"
    if tail[:, STUCK].any():
        return "stick-slip"
    before = rows[len(rows) // 2 : 3 * len(rows) // 4]
    whole, now, earlier = (np.ptp(part[:, [V, W]], axis=0) for part in (rows, tail, before))
    if ((now < 1e-3 * whole) | ((now < 2e-2 * whole) & (now < 0.7 * earlier))).all():
        return "settles"
    if not tail[:, CONTACT].all():
        return "bounces"
    apart = np.abs(rows - beside.rows)[-len(tail) :, [V, W]].max(axis=0)
    return "chaotic" if (apart > 1e-2 * now).all() else "orbit"
