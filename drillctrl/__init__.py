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
    from drillctrl.delay.instrumentation import with_actuator_lag, with_filter
    from drillctrl.delay.structure import FeedbackStructure, Tie
    from drillctrl.delay.system import DelaySystem
    from drillctrl.designs.design import analyze, design
    from drillctrl.designs.loop_analysis import LoopAnalysis, analyze_loop
    from drillctrl.designs.loops import spectral_abscissas
    from drillctrl.designs.margins import point_margins
    from drillctrl.designs.result import Design
    from drillctrl.designs.sensitivity import root_sensitivity
    from drillctrl.designs.worst_case import WorstCase
    from drillctrl.drilling.bit_rock import BitRock, Contact, Load, PaperLaw, Rates
    from drillctrl.drilling.block import Block
    from drillctrl.drilling.case import Case, as_case, plant_system
    from drillctrl.drilling.coefficients import Coefficients
    from drillctrl.drilling.drive import TopDrive
    from drillctrl.drilling.friction import Stribeck
    from drillctrl.drilling.plant import Plant, paper_plant, top_drive_plant
    from drillctrl.drilling.point import OperatingPoint, RigPoint
    from drillctrl.drilling.rig import Rig, load_rig, save_rig, table1
    from drillctrl.drilling.sensors import Filtered, Lagging
    from drillctrl.drilling.steady import SteadyState, rig_point_at_weight_on_bit, steady_state
    from drillctrl.drilling.string import String, StringModel, spring_string
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
    "BitRock": "drilling.bit_rock",
    "Block": "drilling.block",
    "Campaign": "studies.campaign",
    "Case": "drilling.case",
    "Change": "simulation.scenario",
    "Checkpoint": "base.checkpoint",
    "Coefficients": "drilling.coefficients",
    "Comparison": "studies.comparison",
    "Contact": "drilling.bit_rock",
    "Controller": "simulation.controller",
    "DelaySystem": "delay.system",
    "Design": "designs.result",
    "Exact": "synthesis.objectives",
    "FeedbackStructure": "delay.structure",
    "Filtered": "drilling.sensors",
    "GainSurface": "charts.discretised",
    "GainTable": "tables.table",
    "Grid": "tables.grid",
    "InputError": "base.errors",
    "Lagging": "drilling.sensors",
    "Load": "drilling.bit_rock",
    "LoopAnalysis": "designs.loop_analysis",
    "OperatingPoint": "drilling.point",
    "PaperLaw": "drilling.bit_rock",
    "Past": "simulation.past",
    "Plant": "drilling.plant",
    "Rates": "drilling.bit_rock",
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
    "Stribeck": "drilling.friction",
    "String": "drilling.string",
    "StringModel": "drilling.string",
    "spring_string": "drilling.string",
    "Tie": "delay.structure",
    "TopDrive": "drilling.drive",
    "WorstCase": "designs.worst_case",
    "analyze": "designs.design",
    "analyze_loop": "designs.loop_analysis",
    "as_case": "drilling.case",
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
    "dimensionless_grid": "tables.grid",
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
    "paper_plant": "drilling.plant",
    "parameter_margin": "robustness.margins",
    "plant_system": "drilling.case",
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
    "top_drive_plant": "drilling.plant",
    "with_actuator_lag": "delay.instrumentation",
    "with_filter": "delay.instrumentation",
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
    "BitRock",
    "Block",
    "Campaign",
    "Case",
    "Change",
    "Checkpoint",
    "Coefficients",
    "Comparison",
    "Contact",
    "Controller",
    "DelaySystem",
    "Design",
    "Exact",
    "FeedbackStructure",
    "Filtered",
    "GainSurface",
    "GainTable",
    "Grid",
    "InputError",
    "Lagging",
    "Load",
    "LoopAnalysis",
    "OperatingPoint",
    "PaperLaw",
    "Past",
    "Plant",
    "Rates",
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
    "Stribeck",
    "String",
    "StringModel",
    "Tie",
    "TopDrive",
    "WorstCase",
    "analyze",
    "analyze_loop",
    "as_case",
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
    "dimensionless_grid",
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
    "paper_plant",
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
    "spring_string",
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
