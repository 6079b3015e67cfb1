"""Control design for rotary drill strings with state-dependent delay.

The names below are the public interface. Each is loaded when it is first used, so that
importing the package costs nothing.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from drillctrl.base.checkpoint import Checkpoint
    from drillctrl.base.errors import InputError
    from drillctrl.charts.chart import StabilityChart, chart
    from drillctrl.charts.discretised import GainSurface, RootLocus, gain_surface, root_locus
    from drillctrl.charts.stabilisable import StabilisableChart, stabilisable_chart
    from drillctrl.charts.volume import StabilityVolume, stability_volume
    from drillctrl.delay.closing import close_loop
    from drillctrl.delay.structure import FeedbackStructure, Tie
    from drillctrl.delay.system import DelaySystem
    from drillctrl.designs.design import analyze, design
    from drillctrl.designs.loop_analysis import LoopAnalysis, analyze_loop
    from drillctrl.designs.loops import spectral_abscissas
    from drillctrl.designs.margins import point_margins
    from drillctrl.designs.result import Design
    from drillctrl.designs.sensitivity import root_sensitivity
    from drillctrl.designs.worst_case import WorstCase
    from drillctrl.drilling.drive import top_drive_plant
    from drillctrl.drilling.linear import plant_system
    from drillctrl.drilling.plant import Plant, dimensional_plant, dimensionless_plant
    from drillctrl.drilling.point import OperatingPoint, RigPoint
    from drillctrl.drilling.rig import Rig, load_rig, save_rig, table1
    from drillctrl.drilling.sensors import with_actuator_lag, with_filter
    from drillctrl.drilling.steady import SteadyState, rig_point_at_weight_on_bit, steady_state
    from drillctrl.drilling.structures import feed, preset_structure, soft_torque
    from drillctrl.interop.controllers import controller_system, scheduled_controller
    from drillctrl.interop.lifted import lifted_system, pade_approximation
    from drillctrl.interop.plants import from_control
    from drillctrl.interop.responses import loop_frd, to_frd
    from drillctrl.paper.agreement import Agreement
    from drillctrl.paper.reproduce import reproduce
    from drillctrl.robustness.margins import delay_margin, parameter_margin
    from drillctrl.robustness.radius import (
        pseudospectral_abscissa,
        real_stability_radius,
        stability_radius,
    )
    from drillctrl.robustness.transfer import frequency_response, loop_transfer
    from drillctrl.simulation.controller import Controller
    from drillctrl.simulation.energy import band_energy
    from drillctrl.simulation.floquet import floquet
    from drillctrl.simulation.orbits import limit_cycle, separation
    from drillctrl.simulation.past import Past
    from drillctrl.simulation.result import Simulation
    from drillctrl.simulation.run import simulate
    from drillctrl.simulation.scenario import Change, Scenario
    from drillctrl.spectrum.count import count_right_of
    from drillctrl.spectrum.proof import prove_count
    from drillctrl.spectrum.roots import (
        Root,
        characteristic_roots,
        dominant_roots,
        spectral_abscissa,
    )
    from drillctrl.spectrum.semidiscretization import SemiDiscretization, semidiscretize
    from drillctrl.spectrum.trust import compare_spectra, intervals_for
    from drillctrl.studies.campaign import Campaign, campaign
    from drillctrl.studies.compare import compare
    from drillctrl.studies.comparison import Comparison
    from drillctrl.synthesis.objectives import Exact, Requirements, Robust, SemiDiscrete
    from drillctrl.tables.files import load_table, save_table
    from drillctrl.tables.grid import Axis, Grid, dimensionless_grid, linear_axis, rig_grid
    from drillctrl.tables.table import GainTable, table

_HOME = {
    "Agreement": "paper.agreement",
    "Axis": "tables.grid",
    "Campaign": "studies.campaign",
    "Change": "simulation.scenario",
    "Checkpoint": "base.checkpoint",
    "Comparison": "studies.comparison",
    "Controller": "simulation.controller",
    "DelaySystem": "delay.system",
    "Design": "designs.result",
    "Exact": "synthesis.objectives",
    "FeedbackStructure": "delay.structure",
    "GainSurface": "charts.discretised",
    "GainTable": "tables.table",
    "Grid": "tables.grid",
    "InputError": "base.errors",
    "LoopAnalysis": "designs.loop_analysis",
    "OperatingPoint": "drilling.point",
    "Past": "simulation.past",
    "Plant": "drilling.plant",
    "Requirements": "synthesis.objectives",
    "Rig": "drilling.rig",
    "RigPoint": "drilling.point",
    "Robust": "synthesis.objectives",
    "Root": "spectrum.roots",
    "RootLocus": "charts.discretised",
    "Scenario": "simulation.scenario",
    "SemiDiscrete": "synthesis.objectives",
    "SemiDiscretization": "spectrum.semidiscretization",
    "Simulation": "simulation.result",
    "StabilisableChart": "charts.stabilisable",
    "StabilityChart": "charts.chart",
    "StabilityVolume": "charts.volume",
    "SteadyState": "drilling.steady",
    "Tie": "delay.structure",
    "WorstCase": "designs.worst_case",
    "analyze": "designs.design",
    "analyze_loop": "designs.loop_analysis",
    "band_energy": "simulation.energy",
    "campaign": "studies.campaign",
    "characteristic_roots": "spectrum.roots",
    "chart": "charts.chart",
    "close_loop": "delay.closing",
    "compare": "studies.compare",
    "compare_spectra": "spectrum.trust",
    "controller_system": "interop.controllers",
    "count_right_of": "spectrum.count",
    "delay_margin": "robustness.margins",
    "design": "designs.design",
    "dimensional_plant": "drilling.plant",
    "dimensionless_grid": "tables.grid",
    "dimensionless_plant": "drilling.plant",
    "dominant_roots": "spectrum.roots",
    "feed": "drilling.structures",
    "floquet": "simulation.floquet",
    "frequency_response": "robustness.transfer",
    "from_control": "interop.plants",
    "gain_surface": "charts.discretised",
    "intervals_for": "spectrum.trust",
    "lifted_system": "interop.lifted",
    "limit_cycle": "simulation.orbits",
    "linear_axis": "tables.grid",
    "load_rig": "drilling.rig",
    "load_table": "tables.files",
    "loop_frd": "interop.responses",
    "loop_transfer": "robustness.transfer",
    "pade_approximation": "interop.lifted",
    "parameter_margin": "robustness.margins",
    "plant_system": "drilling.linear",
    "point_margins": "designs.margins",
    "preset_structure": "drilling.structures",
    "prove_count": "spectrum.proof",
    "pseudospectral_abscissa": "robustness.radius",
    "real_stability_radius": "robustness.radius",
    "reproduce": "paper.reproduce",
    "rig_grid": "tables.grid",
    "rig_point_at_weight_on_bit": "drilling.steady",
    "root_locus": "charts.discretised",
    "root_sensitivity": "designs.sensitivity",
    "save_rig": "drilling.rig",
    "save_table": "tables.files",
    "scheduled_controller": "interop.controllers",
    "semidiscretize": "spectrum.semidiscretization",
    "separation": "simulation.orbits",
    "simulate": "simulation.run",
    "soft_torque": "drilling.structures",
    "spectral_abscissa": "spectrum.roots",
    "spectral_abscissas": "designs.loops",
    "stabilisable_chart": "charts.stabilisable",
    "stability_radius": "robustness.radius",
    "stability_volume": "charts.volume",
    "steady_state": "drilling.steady",
    "table": "tables.table",
    "table1": "drilling.rig",
    "to_frd": "interop.responses",
    "top_drive_plant": "drilling.drive",
    "with_actuator_lag": "drilling.sensors",
    "with_filter": "drilling.sensors",
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
