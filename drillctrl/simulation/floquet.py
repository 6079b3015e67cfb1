"""Floquet multipliers of a periodic motion whose delay depends on the motion."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.base.kinds import checks_kinds
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.orbits import limit_cycle
from drillctrl.simulation.past import Past
from drillctrl.simulation.result import Simulation
from drillctrl.simulation.run import simulate
from drillctrl.simulation.scenario import Scenario
from drillctrl.simulation.status import Status
from drillctrl.simulation.window import perturbation_of, perturbed, window_of

_RTOL = 1e-11
# Errors of an integration, relative to its tolerance.
_ERROR = 10.0


@dataclass(frozen=True, eq=False)
class Floquet:
    """How small perturbations of a periodic motion grow or die in a period.

    Attributes
    ----------
    period : float
        Of the motion.
    multipliers : complex array, (m,)
        By falling modulus. One of them is 1, a shift along an orbit. Those that drown in the
        error of the integrations (below 1e-5 for the usual size) are left out.
    residuals : array, (m,)
        For each: how far the image of its direction is from the multiple of it, relative to
        the size of the direction.
    trivial_error : float or None
        Distance from 1 of the multiplier that ought to be 1: the accuracy of the large ones.
        None where the motion rests under a sampled controller, and none of them is 1.
    section : float
        Instant of the run at which perturbations are compared with what they are a period later.
    """

    period: float
    multipliers: ComplexArray
    residuals: FloatArray
    trivial_error: float | None
    section: float

    @property
    def largest(self) -> float | None:
        """Modulus of the largest multiplier beside the 1; None if no other was found."""
        others = self.multipliers
        if self.trivial_error is not None:
            others = np.delete(others, int(abs(others - 1.0).argmin()))
        return float(abs(others).max()) if others.size else None


@checks_kinds
def floquet(run: Simulation, *, directions: int = 12, size: float = 1e-5, seed: int = 0) -> Floquet:
    """Return the largest Floquet multipliers of the periodic motion that a run tends to.

    Parameters
    ----------
    run : Simulation
        It has come to the orbit, or rests under a sampled controller; without noise and with
        fixed gains.
    directions : int
        Of the Krylov space; two integrations over a period for each.
    size : float
        Of the perturbations, relative to the motion. What is left out goes with its square.
    seed : int
        Of the first perturbation.

    Returns
    -------
    Floquet
        Multipliers with their residuals.

    Raises
    ------
    InputError
        If the run does not end in a periodic motion, or its controller is noisy, scheduled, or
        sampled with the present delay.

    Notes
    -----
    With a delay, a perturbation is that of a stretch of the past: of x and θ at six nodes of
    each panel between the breaks. Its image is the difference of two integrations that start
    from perturbed pasts, at the same nodes one period later; stick, release and loss of
    contact shift with the perturbation and need no matching conditions. Arnoldi's method gives
    the multipliers of that map.

    Under a sampled controller perturbations begin where a sample is taken. A motion at rest has
    multipliers over any number of samples, none of which is 1; the least number that fills a
    delay is taken. A period of an orbit that is no whole number of samples ends between two of
    them: the motion repeats as far as it does not depend on where in its period samples fall,
    and ``trivial_error`` says how far that is.
    """
    checked_integer("directions", directions, 2, 200)
    checked_number("size", size, 1e-7, 1e-2)
    check_repeats(run.controller)
    if run.scenario.changes and run.scenario.changes[-1].time > 0.5 * run.times[-1]:
        raise InputError("run", "changed on the way", "one that has come to an orbit since")
    sampling = _sampling(run)
    rests = sampling is not None and run.summary.settled
    if sampling is not None and rests:
        period = float(np.ceil(run.structure.delay / sampling)) * sampling
    else:
        orbit = limit_cycle(run, since=0.5 * float(run.times[-1]))
        if orbit is None:
            raise InputError("run", _length(run), "longer, or of a motion that repeats")
        period = orbit.period
    section = _quiet_instant(run, period)
    found, residuals = multipliers_at(
        run, section, period, directions=directions, size=size, seed=seed
    )
    apart = None if rests else float(abs(found - 1.0).min())
    return Floquet(period, found, residuals, apart, section)


def multipliers_at(
    run: Simulation,
    section: float,
    period: float,
    *,
    directions: int = 12,
    size: float = 1e-5,
    seed: int = 0,
) -> tuple[ComplexArray, FloatArray]:
    """Return the multipliers of the map over a period from an instant, with residuals.

    Parameters
    ----------
    run : Simulation
        Its motion repeats after the period, or rests (then any period will do).
    section : float
        The instant: the bit turns, in contact, unsaturated.
    period, directions, size, seed
        As in `floquet`.
    """
    window = window_of(run, section)
    controller = run.controller
    if controller is not None:
        controller = dataclasses.replace(controller, activation=0.0)
    reach = float(window.times.min())

    def go_on(past: Past, kick: dict[str, float]) -> FloatArray:
        after = simulate(
            run.case,
            controller,
            duration=period,
            scenario=Scenario(start=past, initial=kick),
            model=run.model,
            cutting=run.cutting,
            rtol=_RTOL,
            atol=0.1 * _RTOL,
        )
        if after.status != Status.DONE:
            raise InputError("size", size, f"such that a period is not cut short ({after.status})")
        return perturbation_of(after, window, period)

    def image(perturbation: FloatArray) -> FloatArray:
        ahead, behind = (
            go_on(perturbed(window, sign * size * perturbation), {}) for sign in (1.0, -1.0)
        )
        return (ahead - behind) / (2.0 * size)

    rng = np.random.default_rng(seed)
    names = run.state_names
    scale = window.scale[: len(names)]
    kick = {n: float(size * s * rng.uniform(0.2, 1.0)) for n, s in zip(names, scale, strict=True)}
    opposite = {name: -value for name, value in kick.items()}
    first = (go_on(window.past, kick) - go_on(window.past, opposite)) / (2.0 * size)
    # A kick of the state alone is not what a motion leaves behind: let it fill the window.
    for _ in range(int(np.ceil(-reach / period)) - 1):
        first = image(first / np.linalg.norm(first))
    return _arnoldi(image, first, directions, _ERROR * _RTOL / size)


def check_repeats(controller: Controller | None) -> None:
    """Refuse a controller under which no motion repeats.

    Raises
    ------
    InputError
        If it is noisy or scheduled, or sampled with the present delay.
    """
    if controller is None:
        return
    if controller.schedule or controller.noise:
        raise InputError("controller", "noisy or scheduled", "without noise, with fixed gains")
    if controller.period is not None and controller.delay == "current":
        raise InputError("delay", controller.delay, "fixed where the controller is sampled")


def _sampling(run: Simulation) -> float | None:
    return None if run.controller is None else run.controller.period


def _length(run: Simulation) -> str:
    return f"{run.duration:g} time units"


def _quiet_instant(run: Simulation, period: float) -> float:
    """Return the middle of the longest stretch without events in the last period but one.

    Under a sampled controller it is the last sample before.
    """
    end = float(run.times[-1])
    inside = [e.time for e in run.events if end - 2.0 * period <= e.time <= end]
    edges = np.array([end - 2.0 * period, *inside, end])
    middles = 0.5 * (edges[1:] + edges[:-1])
    sampling = _sampling(run)
    if sampling is not None:
        assert run.controller is not None
        begin = run.controller.activation
        middles = begin + np.floor((middles - begin) / sampling) * sampling
    motion = run.at(middles)
    free = motion.contact & ~motion.stuck & ~motion.held & (middles > edges[:-1])
    bound = run.phases("riding") + (() if run.controller is None else run.phases("saturated"))
    free &= np.array([not any(a <= t <= b for a, b in bound) for t in middles])
    if not free.any():
        raise InputError("run", _length(run), "one that turns freely for some of its period")
    return float(middles[np.where(free, np.diff(edges), 0.0).argmax()])


def _arnoldi(
    image: Callable[[FloatArray], FloatArray], first: FloatArray, directions: int, noise: float
) -> tuple[ComplexArray, FloatArray]:
    """Return eigenvalues above the noise of a linear map by falling modulus, with residuals."""
    basis = [first / np.linalg.norm(first)]
    projection = np.zeros((directions + 1, directions))
    used = directions
    for k in range(directions):
        after = image(basis[k])
        for _ in range(2):  # once is not enough to stay orthogonal
            for i, direction in enumerate(basis):
                along = direction @ after
                projection[i, k] += along
                after = after - along * direction
        left = float(np.linalg.norm(after))
        projection[k + 1, k] = left
        if left <= noise:
            used = k + 1
            break
        basis.append(after / left)
    values, vectors = np.linalg.eig(projection[:used, :used])
    residuals = projection[used, used - 1] * abs(vectors[-1]) / np.linalg.norm(vectors, axis=0)
    order = np.lexsort((values.imag, -abs(values)))
    order = order[abs(values[order]) > noise]
    return values[order].astype(complex), residuals[order]
