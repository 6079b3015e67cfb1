"""The part of a past that the motion after an instant depends on, and perturbations of it."""

from __future__ import annotations

import dataclasses
import itertools
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from drillctrl.base.arrays import FloatArray
from drillctrl.simulation.kernel import data
from drillctrl.simulation.past import Past, padded, restrict
from drillctrl.simulation.result import Simulation

# Nodes of a panel: as many as a quintic has coefficients.
_NODES = 6
_PANELS_PER_DELAY = 4.0
# Least size of a motion; rest has none.
_LEAST = 1e-2


@dataclass(frozen=True, eq=False)
class Window:
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
    signals : tuple of int
        States that a perturbation has on the panels: x, θ, and those that are fed back late.
    scale : array, (n + m,)
        Sizes of the states in the motion, and of the inputs.
    """

    past: Past
    panel: npt.NDArray[np.int64]
    begin: FloatArray
    length: FloatArray
    stuck: npt.NDArray[np.bool_]
    held: npt.NDArray[np.bool_]
    signals: tuple[int, ...]
    scale: FloatArray

    @property
    def times(self) -> FloatArray:
        """Nodes of all panels, (panels, 6)."""
        return np.asarray(self.begin[:, None] + self.length[:, None] * _nodes()[0])


def _nodes() -> tuple[FloatArray, FloatArray]:
    """Return Gauss nodes in (0, 1) and weights."""
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    return 0.5 * (nodes + 1.0), 0.5 * weights


def _reach(run: Simulation, section: float) -> float:
    """Return the earliest instant that the motion after the section depends on."""
    settings, history = run.settings, run.history
    lags = settings.real[data.LAGS : data.LAGS + 2]
    age = settings.schedule[:, data.PAST_AGE].max()
    if settings.whole[data.SAMPLED]:
        age += settings.real[data.MEASURE_DELAY]
    lag = float(max(*lags, age))
    earliest = section - lag
    if run.model == "linear":
        return earliest
    start, face = history.real[:, data.START], history.whole[:, data.FACE]
    # The faces under the blades between here and one pitch back, and what feedback sees there.
    back = section - float(run.at([section], ("delay",)).delay[0])
    rows = np.flatnonzero((start >= back - run.structure.delay) & (start <= section))
    earliest = min(earliest, back, float(start[face[rows]].min()))
    return earliest - lag


def _late_states(run: Simulation) -> tuple[int, ...]:
    """Return which states beside the bit's reach the controller late."""
    if run.controller is None:
        return ()
    string = run.structure
    _, K1, K2 = run.controller.gains(string.input_names, string.output_names)
    late = K2.any(axis=(0, 1))
    if run.controller.measurement_delay:
        late |= K1.any(axis=(0, 1))
    seen = (string.arrays.C[late] != 0.0).any(axis=0)
    return tuple((4 + np.flatnonzero(seen[4:])).tolist())


def _place_on_steps(signal: int) -> tuple[int, int]:
    """Return where the coefficients of a signal are in the history, and how many."""
    if signal < 4:
        return (data.X, data.THETA)[signal // 2], data.QUINTIC
    return data.OTHERS + data.QUARTIC * (signal - 4), data.QUARTIC


def window_of(run: Simulation, section: float) -> Window:
    """Return the steps before an instant that matter, cut into panels."""
    past = run.past(section)
    start, length = past.real[:, data.START], past.real[:, data.LENGTH]
    reach = _reach(run, section) - section
    first = max(int(np.searchsorted(start, reach, side="right")) - 1, 1)
    breaks = start[first:][past.whole[first:, data.LEVEL] <= data.LAST_LEVEL]
    pieces = np.unique([start[first], *breaks, 0.0])
    longest = run.structure.delay / _PANELS_PER_DELAY
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
            restrict(row, (a - start[j]) / length[j], (b - start[j]) / length[j], past.state.size)
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
    held = nonlinear & np.isin(kinds[at_first, data.AXIAL], (data.HELD, data.RIDING))
    held &= kinds[at_first, data.CONTACT] == 1
    names = (*run.state_names, *run.input_names)
    since = max(section - 10.0 * run.structure.delay, 0.5 * float(run.times[-1]))
    tail = run.on_steps(5, since, names)
    scale = np.array([max(float(np.ptp(getattr(tail, name))), _LEAST) for name in names])
    # Rates of the bit as its positions, and one size for all inputs.
    scale[[1, 3]] = scale[[0, 2]]
    scale[len(run.state_names) :] = scale[len(run.state_names) :].max(initial=_LEAST)
    return Window(
        dataclasses.replace(past, real=np.array(real), whole=kinds),
        panels,
        edges,
        np.diff(np.append(edges, 0.0)),
        stuck,
        held,
        (0, 2, *_late_states(run)),
        scale,
    )


def _known(window: Window, signal: int) -> npt.NDArray[np.bool_]:
    """Return on which panels a signal can only be shifted, (panels,)."""
    if signal == 0:
        return window.held
    return window.stuck if signal == 2 else np.zeros_like(window.stuck)


def perturbation_of(after: Simulation, window: Window, time: float) -> FloatArray:
    """Return the signals on the window ending at an instant, scaled so that the norm is L2.

    Behind them come the states and actuators at that instant that have no past.
    """
    real = after.history.real
    times = time + window.times
    j = np.clip(np.searchsorted(real[:, data.START], times, side="right") - 1, 1, None)
    s = (times - real[j, data.START]) / real[j, data.LENGTH]
    roots = np.sqrt(window.length[:, None] * _nodes()[1])
    parts = []
    for signal in window.signals:
        begin, count = _place_on_steps(signal)
        values = sum(real[j, begin + i] * s**i for i in range(count)) / window.scale[signal]
        shift = (values * _nodes()[1]).sum(axis=1, keepdims=True)
        parts.append((roots * np.where(_known(window, signal)[:, None], shift, values)).ravel())
    names = (*after.state_names, *after.input_names)
    end = after.at([time], names)
    rest = np.array([getattr(end, name)[0] for name in names]) / window.scale
    if after.controller is None or not after.controller.actuator_lag:
        rest[len(after.state_names) :] = 0.0
    return np.concatenate([*parts, rest[_without_past(window)]])


def _without_past(window: Window) -> list[int]:
    """Return the states and actuators whose past does not matter."""
    return [i for i in range(4, window.scale.size) if i not in window.signals]


def perturbed(window: Window, perturbation: FloatArray) -> Past:
    """Return the past with a perturbation added."""
    nodes, weights = _nodes()
    panels = window.begin.size
    roots = np.sqrt(window.length[:, None] * weights)
    real, state = window.past.real.copy(), window.past.state.copy()
    end = window.past.real[:, data.START] + window.past.real[:, data.LENGTH]
    for k, signal in enumerate(window.signals):
        begin, count = _place_on_steps(signal)
        fit = np.linalg.pinv(np.sqrt(weights)[:, None] * np.vander(nodes, count, increasing=True))
        values = perturbation[k * panels * _NODES : (k + 1) * panels * _NODES]
        powers = values.reshape(panels, _NODES) / roots * window.scale[signal]
        powers = (powers * np.sqrt(weights)) @ fit.T
        powers[_known(window, signal), 1:] = 0.0
        for j in range(1, len(real)):
            i = window.panel[j]
            low, high = (
                (t - window.begin[i]) / window.length[i] for t in (real[j, data.START], end[j])
            )
            part = np.polynomial.Polynomial(powers[i])(np.polynomial.Polynomial([low, high - low]))
            real[j, begin : begin + count] += padded(part, count)
        state[signal] += powers[-1].sum()
        if signal < 4:
            state[signal + 1] += powers[-1] @ np.arange(count) / window.length[-1]
    rest = _without_past(window)
    state[rest] += perturbation[perturbation.size - len(rest) :] * window.scale[rest]
    return dataclasses.replace(window.past, real=real, state=state)
