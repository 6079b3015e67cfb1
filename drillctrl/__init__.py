"""Control design for rotary drill strings with state-dependent delay.

The names below are the public interface. Each is loaded when it is first used, so that
importing the package costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from drillctrl.analysis import LoopAnalysis, analyze_loop
    from drillctrl.axial_feedback import feed
    from drillctrl.campaigns.campaign import Campaign, campaign
    from drillctrl.charts.discretised import GainSurface, RootLocus, gain_surface, root_locus
    from drillctrl.charts.stabilisable import StabilisableChart, stabilisable_chart
    from drillctrl.charts.stability_chart import StabilityChart, chart
    from drillctrl.charts.volume import StabilityVolume, stability_volume
    from drillctrl.checkpoint import Checkpoint
    from drillctrl.comparison.comparing import Comparison, compare
    from drillctrl.delay_system import DelaySystem, plant_system
    from drillctrl.design_result import Design
    from drillctrl.designing import analyze, design
    from drillctrl.errors import InputError
    from drillctrl.feedback import FeedbackStructure, Tie, close_loop, preset_structure
    from drillctrl.instrumentation import with_actuator_lag, with_filter
    from drillctrl.interop.controllers import controller_system, scheduled_controller
    from drillctrl.interop.lifted import lifted_system, pade_approximation
    from drillctrl.interop.plants import from_control
    from drillctrl.operating_point import OperatingPoint, RigPoint
    from drillctrl.optimisation.objectives import (
        Exact,
        Requirements,
        Robust,
        SemiDiscrete,
        WorstCase,
    )
    from drillctrl.plant import Plant, dimensional_plant, dimensionless_plant
    from drillctrl.reproduction.agreement import Agreement
    from drillctrl.reproduction.reproducing import reproduce
    from drillctrl.rig import Rig, load_rig, save_rig, table1
    from drillctrl.robustness.margins import delay_margin, parameter_margin, point_margins
    from drillctrl.robustness.radius import (
        pseudospectral_abscissa,
        real_stability_radius,
        stability_radius,
    )
    from drillctrl.simulation import Change, Controller, Past, Scenario, Simulation, simulate
    from drillctrl.simulation.energy import band_energy
    from drillctrl.simulation.floquet import floquet
    from drillctrl.simulation.orbits import limit_cycle, separation
    from drillctrl.spectrum.batch import spectral_abscissas
    from drillctrl.spectrum.comparison import compare_spectra, intervals_for
    from drillctrl.spectrum.count import count_right_of
    from drillctrl.spectrum.proof import prove_count
    from drillctrl.spectrum.roots import (
        Root,
        characteristic_roots,
        dominant_roots,
        spectral_abscissa,
    )
    from drillctrl.spectrum.semidiscretization import SemiDiscretization, semidiscretize
    from drillctrl.spectrum.sensitivity import root_sensitivity
    from drillctrl.steady_drilling import SteadyState, rig_point_at_weight_on_bit, steady_state
    from drillctrl.tables.files import load_table, save_table
    from drillctrl.tables.grid import Axis, Grid, dimensionless_grid, linear_axis, rig_grid
    from drillctrl.tables.table import GainTable, table
    from drillctrl.top_drive import soft_torque, top_drive_plant
    from drillctrl.transfer import frequency_response, loop_frd, loop_transfer, to_frd

_HOME = {
    "Agreement": "reproduction.agreement",
    "Axis": "tables.grid",
    "Campaign": "campaigns.campaign",
    "Change": "simulation",
    "Checkpoint": "checkpoint",
    "Comparison": "comparison.comparing",
    "Controller": "simulation",
    "DelaySystem": "delay_system",
    "Design": "design_result",
    "Exact": "optimisation.objectives",
    "FeedbackStructure": "feedback",
    "GainSurface": "charts.discretised",
    "GainTable": "tables.table",
    "Grid": "tables.grid",
    "InputError": "errors",
    "LoopAnalysis": "analysis",
    "OperatingPoint": "operating_point",
    "Past": "simulation",
    "Plant": "plant",
    "Requirements": "optimisation.objectives",
    "Rig": "rig",
    "RigPoint": "operating_point",
    "Robust": "optimisation.objectives",
    "Root": "spectrum.roots",
    "RootLocus": "charts.discretised",
    "Scenario": "simulation",
    "SemiDiscrete": "optimisation.objectives",
    "SemiDiscretization": "spectrum.semidiscretization",
    "Simulation": "simulation",
    "StabilisableChart": "charts.stabilisable",
    "StabilityChart": "charts.stability_chart",
    "StabilityVolume": "charts.volume",
    "SteadyState": "steady_drilling",
    "Tie": "feedback",
    "WorstCase": "optimisation.objectives",
    "analyze": "designing",
    "analyze_loop": "analysis",
    "band_energy": "simulation.energy",
    "campaign": "campaigns.campaign",
    "characteristic_roots": "spectrum.roots",
    "chart": "charts.stability_chart",
    "close_loop": "feedback",
    "compare": "comparison.comparing",
    "compare_spectra": "spectrum.comparison",
    "controller_system": "interop.controllers",
    "count_right_of": "spectrum.count",
    "delay_margin": "robustness.margins",
    "design": "designing",
    "dimensional_plant": "plant",
    "dimensionless_grid": "tables.grid",
    "dimensionless_plant": "plant",
    "dominant_roots": "spectrum.roots",
    "feed": "axial_feedback",
    "floquet": "simulation.floquet",
    "frequency_response": "transfer",
    "from_control": "interop.plants",
    "gain_surface": "charts.discretised",
    "intervals_for": "spectrum.comparison",
    "lifted_system": "interop.lifted",
    "limit_cycle": "simulation.orbits",
    "linear_axis": "tables.grid",
    "load_rig": "rig",
    "load_table": "tables.files",
    "loop_frd": "transfer",
    "loop_transfer": "transfer",
    "pade_approximation": "interop.lifted",
    "parameter_margin": "robustness.margins",
    "plant_system": "delay_system",
    "point_margins": "robustness.margins",
    "preset_structure": "feedback",
    "prove_count": "spectrum.proof",
    "pseudospectral_abscissa": "robustness.radius",
    "real_stability_radius": "robustness.radius",
    "reproduce": "reproduction.reproducing",
    "rig_grid": "tables.grid",
    "rig_point_at_weight_on_bit": "steady_drilling",
    "root_locus": "charts.discretised",
    "root_sensitivity": "spectrum.sensitivity",
    "save_rig": "rig",
    "save_table": "tables.files",
    "scheduled_controller": "interop.controllers",
    "semidiscretize": "spectrum.semidiscretization",
    "separation": "simulation.orbits",
    "simulate": "simulation",
    "soft_torque": "top_drive",
    "spectral_abscissa": "spectrum.roots",
    "spectral_abscissas": "spectrum.batch",
    "stabilisable_chart": "charts.stabilisable",
    "stability_radius": "robustness.radius",
    "stability_volume": "charts.volume",
    "steady_state": "steady_drilling",
    "table": "tables.table",
    "table1": "rig",
    "to_frd": "transfer",
    "top_drive_plant": "top_drive",
    "with_actuator_lag": "instrumentation",
    "with_filter": "instrumentation",
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
    "Agreement",
    "Axis",
    "Campaign",
    "Change",
    "Checkpoint",
    "Comparison",
    "Controller",
    "DelaySystem",
    "Design",
    "Exact",
    "FeedbackStructure",
    "GainSurface",
    "GainTable",
    "Grid",
    "InputError",
    "LoopAnalysis",
    "OperatingPoint",
    "Past",
    "Plant",
    "Requirements",
    "Rig",
    "RigPoint",
    "Robust",
    "Root",
    "RootLocus",
    "Scenario",
    "SemiDiscrete",
    "SemiDiscretization",
    "Simulation",
    "StabilisableChart",
    "StabilityChart",
    "StabilityVolume",
    "SteadyState",
    "Tie",
    "WorstCase",
    "analyze",
    "analyze_loop",
    "band_energy",
    "campaign",
    "characteristic_roots",
    "chart",
    "close_loop",
    "compare",
    "compare_spectra",
    "controller_system",
    "count_right_of",
    "delay_margin",
    "design",
    "dimensional_plant",
    "dimensionless_grid",
    "dimensionless_plant",
    "dominant_roots",
    "feed",
    "floquet",
    "frequency_response",
    "from_control",
    "gain_surface",
    "intervals_for",
    "lifted_system",
    "limit_cycle",
    "linear_axis",
    "load_rig",
    "load_table",
    "loop_frd",
    "loop_transfer",
    "pade_approximation",
    "parameter_margin",
    "plant_system",
    "point_margins",
    "preset_structure",
    "prove_count",
    "pseudospectral_abscissa",
    "real_stability_radius",
    "reproduce",
    "rig_grid",
    "rig_point_at_weight_on_bit",
    "root_locus",
    "root_sensitivity",
    "save_rig",
    "save_table",
    "scheduled_controller",
    "semidiscretize",
    "separation",
    "simulate",
    "soft_torque",
    "spectral_abscissa",
    "spectral_abscissas",
    "stabilisable_chart",
    "stability_radius",
    "stability_volume",
    "steady_state",
    "table",
    "table1",
    "to_frd",
    "top_drive_plant",
    "with_actuator_lag",
    "with_filter",
]
