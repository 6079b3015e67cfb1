"""What would stabilise a point that no gains found do: other structures, another speed."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from drillctrl.base.arrays import FloatArray
from drillctrl.delay.structure import FeedbackStructure
from drillctrl.designs.design import analyze, design
from drillctrl.designs.result import Analysis, Design
from drillctrl.drilling.point import OperatingPoint, RigPoint
from drillctrl.drilling.structures import STRUCTURE_NAMES, feed, preset_structure
from drillctrl.spectrum.count import count_right_of
from drillctrl.spectrum.pseudospectral import degree_for
from drillctrl.spectrum.roots import spectral_abscissa
from drillctrl.synthesis.family import loop_family
from drillctrl.synthesis.reach import Reach, searched_reach

# How much faster the bit is let turn, and in how many steps that is looked at.
_FASTEST = 4.0
_STEPS = 40
_BISECTIONS = 30
_CONTROLLED_STEPS = 8
_CONTROLLED_BISECTIONS = 5
# Plants of more states are searched for structures of few gains alone.
_MANY_STATES, _FEW_GAINS = 40, 2

_Range = tuple[float, float]


@dataclass(frozen=True, eq=False)
class Remedy:
    """Something that stabilises where a design did not.

    Attributes
    ----------
    kind : {"structure", "feed", "speed"}
        Other torque feedback; an axial actuator; faster rotation.
    name : str
        Of the structure; ``"none"`` for rotation without feedback.
    result : Analysis
        The stable loop, with its point and gains.
    """

    kind: str
    name: str
    result: Analysis

    @property
    def spectral_abscissa(self) -> float:
        """α of the stable loop."""
        return self.result.spectral_abscissa

    def to_dict(self) -> dict[str, object]:
        """Return the JSON fields."""
        found = self.result
        assert found.point is not None
        return {
            "kind": self.kind,
            "structure": None if found.structure is None else self.name,
            "omega0": found.point.omega0,
            "delta0": found.point.delta0,
            "K1": found.K1.ravel().tolist(),
            "K2": found.K2.ravel().tolist(),
            "spectral_abscissa": found.spectral_abscissa,
        }


def remedies(failed: Design) -> tuple[Remedy, ...]:
    """Return what stabilises the point of a design that is not stable.

    Tried are the presets that allow more than the structure, within the paper's bounds, the
    feed alone and beside the structure, and faster rotation at the same rate of penetration
    with the structure asked for and without feedback. Each that is returned has been designed
    and its roots counted; that one is missing proves nothing. Of a plant of many states, such
    as a string of pipe, only structures of one or two gains are tried, and rotation without
    feedback.

    Parameters
    ----------
    failed : Design
        Of a point.

    Returns
    -------
    tuple of Remedy
        In the order in which they are easy to have; empty for a stable design, a design that
        is not of an operating point, and where nothing that was tried helps.
    """
    if failed.stable or failed.point is None or failed.structure is None:
        return ()
    found: list[Remedy] = []
    many = failed.plant.order > _MANY_STATES
    for kind, candidate in _candidates(failed):
        if kind == "structure" and any(remedy.kind == kind for remedy in found):
            # The presets become richer: the first that stabilises is the simplest.
            continue
        if many and candidate.lower.size > _FEW_GAINS:
            continue
        result = design(failed.case, candidate, trials=False)
        if result.stable:
            found.append(Remedy(kind, candidate.name, result))
    alone = _stable_speed(failed)
    most = _FASTEST if alone is None or alone.point is None else alone.point.omega0
    if alone is not None:
        most /= failed.point.omega0
    controlled = None if many else _controlled_speed(failed, most)
    if controlled is not None:
        found.append(Remedy("speed", failed.structure.name, controlled))
    return tuple(found) if alone is None else (*found, Remedy("speed", "none", alone))


def _candidates(failed: Design) -> Iterator[tuple[str, FeedbackStructure]]:
    """Yield structures to try, those with few gains first."""
    structure = failed.structure
    assert structure is not None
    if "torque" in structure.inputs:
        for name in STRUCTURE_NAMES:
            preset = preset_structure(name)
            if _offers_more(preset, structure):
                yield "structure", preset
    physics, _ = failed.case.physics("a remedy")
    if "axial" in structure.inputs or "axial" not in physics.input_names:
        return
    yield "feed", feed()
    if not structure.ties and not {"x", "dx"} & set(structure.outputs):
        yield "feed", feed(structure)


def _offers_more(candidate: FeedbackStructure, structure: FeedbackStructure) -> bool:
    """Whether a candidate permits every gain of the structure and further ones."""
    old, new = _ranges(structure), _ranges(candidate)
    nothing = (0.0, 0.0)
    keys = old.keys() | new.keys()
    pairs = [(old.get(key, nothing), new.get(key, nothing)) for key in keys]
    covers = all(b[0] <= a[0] and a[1] <= b[1] for a, b in pairs)
    return covers and any(a != b for a, b in pairs)


def _ranges(structure: FeedbackStructure) -> dict[tuple[str, str, str], _Range]:
    """Return the bounds of each gain by matrix, input and output."""
    return {
        (matrix, input_name, output): (
            float(getattr(structure, f"{matrix}_lower")[i, j]),
            float(getattr(structure, f"{matrix}_upper")[i, j]),
        )
        for matrix in ("K1", "K2")
        for i, input_name in enumerate(structure.inputs)
        for j, output in enumerate(structure.outputs)
    }


def _faster(failed: Design, factor: float) -> OperatingPoint:
    """Return a faster point: at the same rate of penetration the bit cuts less in each turn."""
    point = failed.point
    assert point is not None
    return point.with_changes(omega0=point.omega0 * factor, delta0=point.delta0 / factor)


def _controlled_speed(failed: Design, most: float) -> Design | None:
    """Return a design with the same structure at the lowest higher speed at which one is found.

    The gains are followed from speed to speed by descent, so a lower one may exist.
    """
    structure = failed.structure
    assert structure is not None
    gains = structure.vector(failed.K1, failed.K2)

    def reach(factor: float, known: FloatArray) -> Reach:
        plant = failed.case.at(_faster(failed, factor)).system(structure.inputs)
        family = loop_family(plant, structure, degree_for(plant) + 3)
        return searched_reach(family, 0.0, [known], everywhere=False)

    low, high, stable = 1.0, most, None
    # Clearly below the speed that needs no feedback at all.
    for factor in np.geomspace(1.0, most, _CONTROLLED_STEPS + 1)[1:-1].tolist():
        there = reach(factor, gains)
        gains = there.gains
        if there.margin < 0.0:
            high, stable = factor, gains
            break
        low = factor
    if stable is None:
        return None
    for _ in range(_CONTROLLED_BISECTIONS):
        middle = 0.5 * (low + high)
        there = reach(middle, stable)
        if there.margin < 0.0:
            high, stable = middle, there.gains
        else:
            low = middle
    chosen = min(1.01 * high, most)
    point = _with_rig(failed, _faster(failed, chosen), chosen)
    result = design(failed.case.at(point), structure, trials=False)
    return result if result.stable else None


def _stable_speed(failed: Design) -> Analysis | None:
    """Return the open loop at the lowest higher speed found at which it is stable."""

    def at(factor: float) -> OperatingPoint:
        return _faster(failed, factor)

    def stable_at(factor: float) -> bool:
        system = failed.case.at(at(factor)).system(())
        count = count_right_of(system, 0.0).count
        return spectral_abscissa(system) < 0.0 if count is None else count == 0

    factors = np.geomspace(1.0, _FASTEST, _STEPS + 1).tolist()
    for low, high in itertools.pairwise(factors):
        if not stable_at(high):
            continue
        unstable, stable = low, high
        for _ in range(_BISECTIONS):
            middle = 0.5 * (unstable + stable)
            unstable, stable = (unstable, middle) if stable_at(middle) else (middle, stable)
        # On the stable side of the boundary by a thousandth, if that is still stable.
        beyond = stable * (1.0 + 1e-3)
        chosen = beyond if beyond <= high and stable_at(beyond) else high
        result = analyze(failed.case.at(_with_rig(failed, at(chosen), chosen)))
        return result if result.stable else None
    return None


def _with_rig(failed: Design, point: OperatingPoint, factor: float) -> OperatingPoint | RigPoint:
    """Return the faster point as a rig point where the design was for one."""
    rig_point = failed.rig_point
    if rig_point is None:
        return point
    return replace(rig_point, rotary_speed=rig_point.rotary_speed * factor)
