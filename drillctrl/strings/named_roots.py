"""Roots of a bit on a string, named by the modes that they belong to."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from drillctrl.base.arrays import ComplexArray, FloatArray
from drillctrl.base.kinds import checks_kinds
from drillctrl.base.language import SI, Language
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.drilling.case import Case, Where, as_case
from drillctrl.strings.at_bit import fed_by_weight
from drillctrl.strings.check import AXIAL_BAND, TORSIONAL_BAND, Mode, string_modes
from drillctrl.strings.drive_control import DriveControl
from drillctrl.strings.drive_law import DriveLaw
from drillctrl.strings.drive_measures import BAND
from drillctrl.strings.exact import ExactLoop, exact_loop
from drillctrl.strings.model import PipeString
from drillctrl.strings.slopes import mode_slopes

_BIT = ("x", "dx", "theta", "dtheta")
_LOADS = ("axial", "torque")
# Where Newton's method begins: places in a mode's band, and growth over frequency.
_PLACES, _DAMPED = 6, (0.1, 0.03, -0.01, -0.05, -0.2)
_STEPS, _SHORT, _CONVERGED = 40, 0.1, 1e-9
_MOST_SLOPES, _SAMPLES = 20, 100
# Depths that a shape is given at, and modes of a kind whose nodes are told.
_DEPTHS, _SHOWN = 51, 3


@dataclass(frozen=True)
class NamedRoot:
    """The least damped root of a mode.

    Attributes
    ----------
    mode : Mode
        Whose frequency, top held and bit free, is the nearest; see `string_modes`.
    value : complex or None
        1/s, imag > 0; None where cutting or the drive damps the mode until nothing swings.
    critical_slope : float or None
        By which the torque of a bit that is otherwise free may fall with its speed, N m s/rad;
        of torsional modes.
    """

    mode: Mode
    value: complex | None
    critical_slope: float | None

    @property
    def frequency(self) -> float:
        """Of its modulus, Hz; of the mode with its top held where nothing swings."""
        if self.value is None:
            return self.mode.frequency
        return abs(self.value) / (2.0 * math.pi)

    @property
    def damping_ratio(self) -> float | None:
        """Share of critical; negative where it grows, None where nothing swings."""
        return None if self.value is None else -self.value.real / abs(self.value)

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields."""
        return {
            "name": self.mode.name,
            "kind": self.mode.kind,
            "number": self.mode.number,
            "frequency": self.frequency,
            "damping_ratio": self.damping_ratio,
            "critical_slope": self.critical_slope,
            "shape": self._shape(),
        }

    def _shape(self) -> dict[str, list[float]]:
        """Return depths and amplitudes over the largest, of the mode with its top end held."""
        mode = self.mode
        depths = np.linspace(mode.places.min(), mode.places.max(), _DEPTHS)
        order = np.argsort(mode.places)
        amplitudes = np.interp(depths, mode.places[order], mode.shape[order])
        return {
            "depths": depths.tolist(),
            "amplitudes": (amplitudes / np.abs(mode.shape).max()).tolist(),
        }

    def text(self, language: Language) -> str:
        """Return name, frequency, damping and critical slope."""
        ratio = self.damping_ratio
        damped = "damped out" if ratio is None else f"{1e2 * ratio:.3g} %"
        told = f"{self.mode.name}: {self.frequency:.4g} Hz, {damped}"
        if self.critical_slope is None:
            return told
        slope = language.text("impedance", self.critical_slope).removesuffix("/rad")
        return f"{told}, critical slope {slope}"


@dataclass(frozen=True)
class NamedRoots:
    """What is told of the modes of a bit on a string.

    Attributes
    ----------
    roots : tuple of NamedRoot
        Torsional ones first, by mode.
    control : DriveControl or None
        What turns the string.
    pipe : float
        ζ of the uppermost pipe, N m s/rad.
    language : Language
        With units, in which they are told.
    """

    roots: tuple[NamedRoot, ...]
    control: DriveControl | None
    pipe: float
    language: Language = SI

    def to_dict(self) -> dict[str, Any]:
        """Return the JSON fields ``modes``, and ``drive`` and ``reflection`` under a drive."""
        fields: dict[str, Any] = {"modes": [root.to_dict() for root in self.roots]}
        if self.control is not None:
            frequencies = np.geomspace(*BAND, _SAMPLES)
            returned = np.abs(self.control.reflection(2j * np.pi * frequencies, self.pipe))
            fields["drive"] = {"structure": self.control.name, "law": self.control.to_dict()}
            fields["reflection"] = {
                "frequencies": frequencies.tolist(),
                "magnitudes": returned.tolist(),
            }
        return fields

    @property
    def lines(self) -> list[tuple[str, str]]:
        """Labels and texts for people: the first modes, and all that grow."""
        named = [("Modes", "the least damped root of each, damping in % of critical")]
        named += [("", root.text(self.language)) for root in self.roots if _matters(root)]
        rest = len(self.others)
        if rest:
            verb = "mode dies" if rest == 1 else "modes die"
            named.append(("", f"{rest} more {verb} away: --verbose lists them, --json too"))
        named += _still(self.roots, self.language)
        if self.control is None:
            return named
        return [("Drive", self.control.name), *named]

    @property
    def others(self) -> list[tuple[str, str]]:
        """Labels and texts of the modes that `lines` leaves out."""
        told = [root.text(self.language) for root in self.roots if not _matters(root)]
        return [("Other modes" if i == 0 else "", text) for i, text in enumerate(told)]


def _matters(root: NamedRoot) -> bool:
    """Whether people are told of a mode at once."""
    ratio = root.damping_ratio
    return root.mode.number <= _SHOWN or (ratio is not None and ratio <= 0.0)


def _still(roots: tuple[NamedRoot, ...], language: Language) -> list[tuple[str, str]]:
    """Return where the first modes of each kind with any nodes stand still, as depths."""
    told = []
    for root in roots:
        mode = root.mode
        if not 2 <= mode.number <= _SHOWN:
            continue
        order = np.argsort(mode.places)
        places, shape = mode.places[order], mode.shape[order]
        # The top end itself is held.
        at = np.flatnonzero(np.signbit(shape[1:-1]) != np.signbit(shape[2:])) + 1
        share = shape[at] / (shape[at] - shape[at + 1])
        depths = places[at] + share * (places[at + 1] - places[at])
        metres = ", ".join(f"{language.number('depth', depth):.0f}" for depth in depths)
        told.append(f"{mode.name}: still {metres} {language.unit('depth')} down")
    return [("Shapes" if i == 0 else "", text) for i, text in enumerate(told)]


def turned_by(case: Case) -> DriveControl | None:
    """Return the law under which a drive turns the string of a case, if one does."""
    blocks = () if case.plant is None else case.plant.blocks
    laws = [block for block in blocks if isinstance(block, DriveLaw)]
    return laws[0].__dict__["control"] if laws else None


@checks_kinds
def named_roots(
    where: Where,
    structure: FeedbackStructure | None = None,
    K1: FloatArray | None = None,
    K2: FloatArray | None = None,
) -> NamedRoots | None:
    """Return the roots of a bit on an exact string by mode.

    Newton's method begins at many places around every mode, up to 5 Hz in torsion and 10 Hz
    along the string, and the least damped root that it finds nearest to a mode bears its name.

    Parameters
    ----------
    where : OperatingPoint, RigPoint, DelaySystem or Case
        What drills, and where.
    structure : FeedbackStructure, optional
        Feedback of the bit's own motion.
    K1, K2 : array, (m, p)
        Its gains.

    Returns
    -------
    NamedRoots or None
        None where the string is none of pipe, nothing is known of what turns it, or the
        feedback is of something else.
    """
    case = as_case(where)
    if case.plant is None or not isinstance(case.plant.string, PipeString):
        return None
    control = turned_by(case)
    if fed_by_weight(case.plant):
        return None
    if (case.plant.blocks and control is None) or case.plant.string.string.hoisting_stiffness:
        return None
    string = case.plant.string.string
    loop = exact_loop(case, None if control is None else _stiffness(control))
    if structure is not None:
        fits = set(structure.outputs) <= set(_BIT) and set(structure.inputs) <= set(_LOADS)
        if not fits or K1 is None or K2 is None:
            return None
        loop = _with_feedback(loop, structure, K1, K2)
    found: list[NamedRoot] = []
    slopes: dict[int, float] = {}
    for kind, line, highest in (
        ("torsional", string.torsion, TORSIONAL_BAND),
        ("axial", string.tension, AXIAL_BAND),
    ):
        modes = string_modes(line, kind, highest)
        if kind == "torsional" and structure is None:
            told = mode_slopes(line, control, min(len(modes), _MOST_SLOPES))
            slopes = {slope.number: slope.slope for slope in told}
        for mode, root in _by_mode(loop, modes, axial=kind == "axial"):
            slope = slopes.get(mode.number) if kind == "torsional" else None
            found.append(NamedRoot(mode, root, slope))
    language = case.language if case.language.units else SI
    return NamedRoots(tuple(found), control, string.torsion.wave_impedance, language)


def _stiffness(control: DriveControl) -> Callable[[ComplexArray], ComplexArray]:
    return lambda s: np.asarray(s * control.impedance(s))


def _with_feedback(
    loop: ExactLoop, structure: FeedbackStructure, K1: FloatArray, K2: FloatArray
) -> ExactLoop:
    """Return the loop with torque and force that follow the bit's motion."""
    now, then = loop.now.copy(), loop.then.copy()
    rows = [_LOADS.index(name) for name in structure.inputs]
    columns = [_BIT.index(name) for name in structure.outputs]
    # What drives the bit is a load with the other sign.
    now[np.ix_(rows, columns)] -= K1
    then[np.ix_(rows, columns)] -= K2
    return replace(loop, now=now, then=then)


def _by_mode(
    loop: ExactLoop, modes: tuple[Mode, ...], *, axial: bool
) -> list[tuple[Mode, complex | None]]:
    """Return modes of a kind with the least damped root of each, 1/s, if any swings."""
    held = 2.0 * np.pi * np.array([mode.frequency for mode in modes])
    edges = np.concatenate([[0.0], 0.5 * (held[1:] + held[:-1])])
    edges = np.append(edges, held[-1] + (held[-1] - edges[-1]))
    places = np.linspace(edges[:-1], edges[1:], _PLACES + 1, axis=1)[:, 1:].ravel()
    begin = np.concatenate([places * (1j + grows) for grows in _DAMPED] + [held * 1j])
    roots = _newton(loop, np.asarray(begin / loop.rate, dtype=complex))
    # A root is of the motion whose own root is nearer.
    own, other = _distances(loop, roots)
    roots = roots[own < other] if axial else roots[other <= own]
    roots = roots * loop.rate
    roots = roots[(roots.imag > 0.0) & (np.abs(roots.real) < 0.999 * np.abs(roots))]
    found: list[tuple[Mode, complex | None]] = []
    for mode, low, high in zip(modes, edges[:-1], edges[1:], strict=True):
        here = roots[(np.abs(roots) > low) & (np.abs(roots) <= high)]
        least = complex(here[np.argmax(here.real / np.abs(here))]) if here.size else None
        found.append((mode, least))
    return found


def _newton(loop: ExactLoop, begin: ComplexArray) -> ComplexArray:
    """Return the roots that Newton's method reaches from many places at once."""
    s = np.array(begin, dtype=complex)
    change = np.full(s.shape, np.inf, dtype=complex)
    left = np.arange(s.size)
    for _ in range(_STEPS):
        here = s[left]
        step = 1e-6 * np.maximum(np.abs(here), 1e-3)
        values = [loop(here), loop(here + step), loop(here - step)]
        with np.errstate(all="ignore"):
            move = 2.0 * step * values[0] / (values[1] - values[2])
            size = np.abs(move) / (_SHORT * np.abs(here) + 1e-300)
            move = np.where(size > 1.0, move / size, move)
        change[left] = np.where(np.isfinite(move), move, 0.0)
        s[left] -= change[left]
        left = left[np.abs(change[left]) >= _CONVERGED * np.maximum(np.abs(s[left]), 1e-3)]
        if not left.size:
            break
    done = np.abs(change) < _CONVERGED * np.maximum(np.abs(s), 1e-3)
    return np.asarray(s[done & (np.abs(loop(s)) < 1e-3)])


def _distances(loop: ExactLoop, s: ComplexArray) -> tuple[FloatArray, FloatArray]:
    """Return how far, by a Newton step, roots of axial and of torsional motion alone are."""
    step = 1e-6 * np.maximum(np.abs(s), 1e-3)
    low, here, high = loop.parts(s - step), loop.parts(s), loop.parts(s + step)
    found = []
    for i in (0, 1):
        # The growth that is left out changes no zero, and little over a step.
        found.append(np.abs(2.0 * step * here[i] / (high[i] - low[i])))
    return found[0], found[1]
