"""Floquet multipliers of a periodic motion whose delay depends on the motion."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.errors import InputError, checked_integer, checked_number
from drillctrl.simulation.compile import kernel
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.orbits import limit_cycle
from drillctrl.simulation.past import Past, padded, restrict
from drillctrl.simulation.result import Simulation
from drillctrl.simulation.run import simulate
from drillctrl.simulation.scenario import Scenario

# Nodes of a panel: as many as a quintic has coefficients.
_NODES = 6
_PANELS_PER_DELAY = 4.0
_RTOL = 1e-11
# Least size of a motion; rest has none.
_LEAST = 1e-2
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
        By falling modulus. One of them is 1: a shift along the motion. Those that drown in the
        error of the integrations (below 1e-5 for the usual size) are left out.
    residuals : array, (m,)
        For each: how far the image of its direction is from the multiple of it, relative to
        the size of the direction.
    trivial_error : float
        Distance from 1 of the multiplier that ought to be 1: the accuracy of the large ones.
    section : float
        Instant of the run at which perturbations are compared with what they are a period later.
    """

    period: float
    multipliers: ComplexArray
    residuals: FloatArray
    trivial_error: float
    section: float

    @property
    def largest(self) -> float | None:
        """Modulus of the largest multiplier beside the 1; None if only the 1 was found."""
        others = np.delete(self.multipliers, int(abs(self.multipliers - 1.0).argmin()))
        return float(abs(others).max()) if others.size else None


@dataclass(frozen=True, eq=False)
class _Window:
    """The part of a past that matters, cut into panels on which perturbations are quintics.

    Attributes
    ----------
    past : Past
        Its steps are cut at the edges of the panels; row 0 is what was before everything.
    panel : int array, (rows,)
        The panel that each row lies in; -1 for row 0.
    begin, length : array, (panels,)
        Of the panels.
    stuck, held : bool array, (panels,)
        Where θ' and x' are known, so that only a shift of θ or x can be a perturbation.
    scale : tuple
        Sizes of x and θ in the motion, and of the inputs.
    """

    past: Past
    panel: npt.NDArray[np.int64]
    begin: FloatArray
    length: FloatArray
    stuck: npt.NDArray[np.bool_]
    held: npt.NDArray[np.bool_]
    scale: tuple[float, float, float]

    @property
    def times(self) -> FloatArray:
        """Nodes of all panels, (panels, 6)."""
        return np.asarray(self.begin[:, None] + self.length[:, None] * _nodes()[0])


def floquet(run: Simulation, *, directions: int = 12, size: float = 1e-5, seed: int = 0) -> Floquet:
    """Return the largest Floquet multipliers of the periodic motion that a run tends to.

    Parameters
    ----------
    run : Simulation
        It has come to the orbit; not of a sampled, noisy or scheduled controller.
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
        If the run does not end in a periodic motion.

    Notes
    -----
    With a delay, a perturbation is that of a stretch of the past: of x and θ at six nodes of
    each panel between the breaks. Its image is the difference of two integrations that start
    from perturbed pasts, at the same nodes one period later; stick, release and loss of
    contact shift with the perturbation and need no matching conditions. Arnoldi's method gives
    the multipliers of that map.
    """
    checked_integer("directions", directions, 2, 200)
    checked_number("size", size, 1e-7, 1e-2)
    _check_controller(run.controller)
    if run.scenario.changes and run.scenario.changes[-1].time > 0.5 * run.times[-1]:
        raise InputError("run", "changed on the way", "one that has come to an orbit since")
    orbit = limit_cycle(run, since=0.5 * float(run.times[-1]))
    if orbit is None:
        raise InputError("run", _length(run), "longer, or of a motion that repeats")
    section = _quiet_instant(run, orbit.period)
    found, residuals = multipliers_at(
        run, section, orbit.period, directions=directions, size=size, seed=seed
    )
    apart = float(abs(found - 1.0).min())
    return Floquet(orbit.period, found, residuals, apart, section)


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
    window = _window(run, section)
    controller = run.controller
    if controller is not None:
        controller = dataclasses.replace(controller, activation=0.0)
    reach = float(window.times.min())

    def go_on(past: Past, kick: dict[str, float]) -> FloatArray:
        after = simulate(
            run.point,
            controller,
            duration=period,
            scenario=Scenario(start=past, initial=kick),
            model=run.model,
            cutting=run.cutting,
            rtol=_RTOL,
            atol=0.1 * _RTOL,
        )
        if after.status != "done":
            raise InputError("size", size, f"such that a period is not cut short ({after.status})")
        return _perturbation(after, window, period)

    def image(perturbation: FloatArray) -> FloatArray:
        ahead, behind = (
            go_on(_perturbed(window, sign * size * perturbation), {}) for sign in (1.0, -1.0)
        )
        return (ahead - behind) / (2.0 * size)

    rng = np.random.default_rng(seed)
    scale = (window.scale[0], window.scale[0], window.scale[1], window.scale[1])
    names = ("x", "dx", "theta", "dtheta")
    kick = {n: float(size * s * rng.uniform(0.2, 1.0)) for n, s in zip(names, scale, strict=True)}
    opposite = {name: -value for name, value in kick.items()}
    first = (go_on(window.past, kick) - go_on(window.past, opposite)) / (2.0 * size)
    # A kick of the state alone is not what a motion leaves behind: let it fill the window.
    for _ in range(int(np.ceil(-reach / period)) - 1):
        first = image(first / np.linalg.norm(first))
    return _arnoldi(image, first, directions, _ERROR * _RTOL / size)


def _check_controller(controller: Controller | None) -> None:
    """Refuse a controller under which no motion repeats."""
    if controller is None:
        return
    if controller.period is not None or controller.schedule or controller.noise:
        raise InputError(
            "controller", "sampled, noisy or scheduled", "continuous, with fixed gains"
        )


def _length(run: Simulation) -> str:
    return f"{run.duration:g} time units"


def _quiet_instant(run: Simulation, period: float) -> float:
    """Return the middle of the longest stretch without events in the last period but one."""
    end = float(run.times[-1])
    inside = [e.time for e in run.events if end - 2.0 * period <= e.time <= end]
    edges = np.array([end - 2.0 * period, *inside, end])
    middles = 0.5 * (edges[1:] + edges[:-1])
    motion = run.at(middles)
    free = motion.contact & ~motion.stuck & ~motion.held
    if run.controller is not None:
        saturated = run.phases("saturated")
        free &= np.array([not any(a <= t <= b for a, b in saturated) for t in middles])
    if not free.any():
        raise InputError("run", _length(run), "one that turns freely for some of its period")
    return float(middles[np.where(free, np.diff(edges), 0.0).argmax()])


def _nodes() -> tuple[FloatArray, FloatArray]:
    """Return Gauss nodes in (0, 1) and weights."""
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    return 0.5 * (nodes + 1.0), 0.5 * weights


def _reach(run: Simulation, section: float, data: Any) -> float:
    """Return the earliest instant that the motion after the section depends on."""
    settings = run._compiled[0]
    lag = float(max(*settings.lags, settings.gains[:, data.PAST_AGE].max()))
    earliest = section - lag
    if run.model == "linear":
        return earliest
    start, face = run.history["real"][:, data.START], run.history["whole"][:, data.FACE]
    # The faces under the blades between here and one pitch back, and what feedback sees there.
    back = section - float(run.at([section]).delay[0])
    rows = np.flatnonzero((start >= back - run.point.delay) & (start <= section))
    earliest = min(earliest, back, float(start[face[rows]].min()))
    return earliest - lag


def _window(run: Simulation, section: float) -> _Window:
    """Return the steps before an instant that matter, cut into panels."""
    data = kernel("data")
    past = run.past(section)
    start, length = past.real[:, data.START], past.real[:, data.LENGTH]
    reach = _reach(run, section, data) - section
    first = max(int(np.searchsorted(start, reach, side="right")) - 1, 1)
    breaks = start[first:][past.whole[first:, data.LEVEL] <= data.LAST_LEVEL]
    pieces = np.unique([start[first], *breaks, 0.0])
    longest = run.point.delay / _PANELS_PER_DELAY
    edges = np.concatenate(
        [np.linspace(a, b, max(int(np.ceil((b - a) / longest)), 1) + 1)[:-1]
         for a, b in itertools.pairwise(pieces)]
    )  # fmt: skip
    real, whole, panel = [past.real[0]], [past.whole[0]], [-1]
    for j in range(first, len(start)):
        end = start[j + 1] if j + 1 < len(start) else 0.0
        cuts = edges[(edges > start[j] + 1e-9) & (edges < end - 1e-9)]
        corners = [start[j], *cuts, start[j] + length[j]]
        for i, (a, b) in enumerate(itertools.pairwise(corners)):
            row, kind = past.real[j].copy(), past.whole[j].copy()
            restrict(row, (a - start[j]) / length[j], (b - start[j]) / length[j])
            row[data.START] = a
            if i > 0:
                kind[data.LEVEL] = data.LAST_LEVEL + 1
            # Places of steps have moved; the march finds them anew.
            kind[data.LAG] = kind[data.FACE] = 0
            real.append(row)
            whole.append(kind)
            panel.append(int(np.searchsorted(edges, a + 1e-9, side="right")) - 1)
    panels = np.array(panel, dtype=np.int64)
    kinds = np.array(whole)
    nonlinear = run.model == "nonlinear"
    at_first = [int(np.flatnonzero(panels == i)[0]) for i in range(edges.size)]
    stuck = nonlinear & (kinds[at_first, data.TORSION] == data.STUCK)
    held = nonlinear & (kinds[at_first, data.AXIAL] == data.HELD)
    held &= kinds[at_first, data.CONTACT] == 1
    tail = run.on_steps(5, max(section - 10.0 * run.point.delay, 0.5 * float(run.times[-1])))
    size_x, size_theta = (max(float(np.ptp(v)), _LEAST) for v in (tail.x, tail.theta))
    size_u = max(float(np.ptp(tail.axial)), float(np.ptp(tail.torque)), _LEAST)
    return _Window(
        dataclasses.replace(past, real=np.array(real), whole=kinds),
        panels,
        edges,
        np.diff(np.append(edges, 0.0)),
        stuck,
        held,
        (size_x, size_theta, size_u),
    )


def _perturbation(after: Simulation, window: _Window, time: float) -> FloatArray:
    """Return the signals on the window ending at an instant, scaled so that the norm is L2."""
    data = kernel("data")
    real = after.history["real"]
    times = time + window.times
    j = np.clip(np.searchsorted(real[:, data.START], times, side="right") - 1, 1, None)
    s = (times - real[j, data.START]) / real[j, data.LENGTH]
    roots = np.sqrt(window.length[:, None] * _nodes()[1])
    parts = []
    for begin, known, scale in zip(
        (data.X, data.THETA), (window.held, window.stuck), window.scale, strict=False
    ):
        values = sum(real[j, begin + i] * s**i for i in range(6)) / scale
        shift = (values * _nodes()[1]).sum(axis=1, keepdims=True)
        parts.append(roots * np.where(known[:, None], shift, values))
    end = after.at([time])
    inputs = np.array([end.axial[0], end.torque[0]]) / window.scale[2]
    if after.controller is None or not after.controller.actuator_lag:
        inputs[:] = 0.0
    return np.concatenate([*(part.ravel() for part in parts), inputs])


def _perturbed(window: _Window, perturbation: FloatArray) -> Past:
    """Return the past with a perturbation added."""
    data = kernel("data")
    nodes, weights = _nodes()
    panels = window.begin.size
    roots = np.sqrt(window.length[:, None] * weights)
    to_powers = np.linalg.inv(np.vander(nodes, increasing=True)).T
    real, state = window.past.real.copy(), window.past.state.copy()
    end = window.past.real[:, data.START] + window.past.real[:, data.LENGTH]
    for k, begin in enumerate((data.X, data.THETA)):
        values = perturbation[k * panels * _NODES : (k + 1) * panels * _NODES]
        powers = (values.reshape(panels, _NODES) / roots * window.scale[k]) @ to_powers
        powers[(window.held, window.stuck)[k], 1:] = 0.0
        for j in range(1, len(real)):
            i = window.panel[j]
            low, high = (
                (t - window.begin[i]) / window.length[i] for t in (real[j, data.START], end[j])
            )
            part = np.polynomial.Polynomial(powers[i])(np.polynomial.Polynomial([low, high - low]))
            real[j, begin : begin + 6] += padded(part, 6)
        state[2 * k] += powers[-1].sum()
        state[2 * k + 1] += powers[-1] @ np.arange(6) / window.length[-1]
    state[4:] += perturbation[-2:] * window.scale[2]
    return dataclasses.replace(window.past, real=real, state=state)


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
