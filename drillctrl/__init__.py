"""Control design for rotary drill strings with state-dependent delay.

The names below are the public interface. Each is loaded when it is first used, so that
importing the package costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from drillctrl.analysis import LoopAnalysis, analyze_loop
    from drillctrl.delay_system import DelaySystem, plant_system
    from drillctrl.designing import Design, analyze, design
    from drillctrl.errors import InputError
    from drillctrl.feedback import FeedbackStructure, close_loop, preset_structure
    from drillctrl.operating_point import OperatingPoint, RigPoint
    from drillctrl.plant import Plant, dimensional_plant, dimensionless_plant
    from drillctrl.rig import Rig, load_rig, save_rig, table1
    from drillctrl.spectrum.batch import spectral_abscissas
    from drillctrl.spectrum.comparison import compare_spectra, intervals_for
    from drillctrl.spectrum.count import count_right_of
    from drillctrl.spectrum.roots import (
        Root,
        characteristic_roots,
        dominant_roots,
        spectral_abscissa,
    )
    from drillctrl.spectrum.semidiscretization import SemiDiscretization, semidiscretize
    from drillctrl.spectrum.sensitivity import root_sensitivity
    from drillctrl.steady_state import SteadyState, rig_point_at_weight_on_bit, steady_state

_HOME = {
    "DelaySystem": "delay_system",
    "Design": "designing",
    "FeedbackStructure": "feedback",
    "InputError": "errors",
    "LoopAnalysis": "analysis",
    "OperatingPoint": "operating_point",
    "Plant": "plant",
    "Rig": "rig",
    "RigPoint": "operating_point",
    "Root": "spectrum.roots",
    "SemiDiscretization": "spectrum.semidiscretization",
    "SteadyState": "steady_state",
    "analyze": "designing",
    "analyze_loop": "analysis",
    "characteristic_roots": "spectrum.roots",
    "close_loop": "feedback",
    "compare_spectra": "spectrum.comparison",
    "count_right_of": "spectrum.count",
    "design": "designing",
    "dimensional_plant": "plant",
    "dimensionless_plant": "plant",
    "dominant_roots": "spectrum.roots",
    "intervals_for": "spectrum.comparison",
    "load_rig": "rig",
    "plant_system": "delay_system",
    "preset_structure": "feedback",
    "rig_point_at_weight_on_bit": "steady_state",
    "root_sensitivity": "spectrum.sensitivity",
    "save_rig": "rig",
    "semidiscretize": "spectrum.semidiscretization",
    "spectral_abscissa": "spectrum.roots",
    "spectral_abscissas": "spectrum.batch",
    "steady_state": "steady_state",
    "table1": "rig",
}


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'drillctrl' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"drillctrl.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(_HOME)


__all__ = [
    "DelaySystem",
    "Design",
    "FeedbackStructure",
    "InputError",
    "LoopAnalysis",
    "OperatingPoint",
    "Plant",
    "Rig",
    "RigPoint",
    "Root",
    "SemiDiscretization",
    "SteadyState",
    "analyze",
    "analyze_loop",
    "characteristic_roots",
    "close_loop",
    "compare_spectra",
    "count_right_of",
    "design",
    "dimensional_plant",
    "dimensionless_plant",
    "dominant_roots",
    "intervals_for",
    "load_rig",
    "plant_system",
    "preset_structure",
    "rig_point_at_weight_on_bit",
    "root_sensitivity",
    "save_rig",
    "semidiscretize",
    "spectral_abscissa",
    "spectral_abscissas",
    "steady_state",
    "table1",
]
