"""The kinds of results that are kept in files, and what they are made of."""

from __future__ import annotations

from drillctrl.charts import axes, chains, chart, plane, regions, scan, stabilisable, volume
from drillctrl.charts.decisions import Place
from drillctrl.delay.structure import FeedbackStructure, Tie
from drillctrl.delay.system import DelaySystem
from drillctrl.designs import (
    controlled_swings,
    fragility,
    loop_analysis,
    mode_shift,
    report,
    robustness,
    swings,
    trials,
    verdict,
    worst_case,
)
from drillctrl.designs.drilling import Drilling
from drillctrl.designs.result import Analysis, Design
from drillctrl.drilling.case import Case
from drillctrl.drilling.point import OperatingPoint, RigPoint
from drillctrl.drilling.rig import Rig
from drillctrl.drilling.steady import SteadyState
from drillctrl.motion import band, orbit, response, swing, torsion
from drillctrl.records import columns, drive_seen, fit_values, peaks, record
from drillctrl.records import swings as swung
from drillctrl.records.downhole import Downhole
from drillctrl.records.findings import ComputedMap
from drillctrl.records.study import RecordStudy
from drillctrl.robustness import loop_margins, margins, radius
from drillctrl.simulation import outcome, starts, status
from drillctrl.simulation.controller import Controller
from drillctrl.simulation.result import Simulation
from drillctrl.simulation.scenario import Change, Scenario
from drillctrl.spectrum.multiplicity import Root
from drillctrl.strings import (
    check,
    drill_string,
    drive_control,
    drives,
    line,
    section,
    slopes,
    wall,
)
from drillctrl.strings.drive_measures import DriveMeasures, DriveMode
from drillctrl.strings.drive_roots import DriveRoot
from drillctrl.strings.drive_verdict import DriveVerdict
from drillctrl.strings.falling import FallingTorque
from drillctrl.strings.rig import StringRig, WeightControl
from drillctrl.studies import comparison, lattice, measures, rig_report_values, vibration_values
from drillctrl.studies.campaign import Campaign
from drillctrl.studies.rig_report import RigReport
from drillctrl.studies.vibration import VibrationMap
from drillctrl.synthesis import boundary, certificate, family, objectives
from drillctrl.tables.grid import Axis, Grid

Result = (
    Design
    | Analysis
    | Simulation
    | Campaign
    | comparison.Comparison
    | VibrationMap
    | RigReport
    | chart.StabilityChart
    | stabilisable.StabilisableChart
    | volume.StabilityVolume
    | response.BitResponse
    | band.BitBand
    | swing.DrillingMotion
    | RecordStudy
    | drives.DriveComparison
)
RESULTS: tuple[type, ...] = Result.__args__
_PARTS: tuple[type, ...] = (
    *(kind for kind in RESULTS if kind is not Simulation),
    *(Case, OperatingPoint, RigPoint, Rig, StringRig, DelaySystem),
    *(FeedbackStructure, Tie, Controller, Scenario, Change, Root, Axis, Grid),
    *(loop_analysis.LoopAnalysis, loop_analysis.Certificate, loop_analysis.SpectralRadius),
    *(verdict.Verdict, trials.Trial, starts.Start, mode_shift.ModeShift),
    *(outcome.Figures, status.Outcome, status.Status),
    *(objectives.Exact, objectives.SemiDiscrete, objectives.Robust, objectives.HInfinity),
    *(objectives.Requirements, worst_case.WorstCase, certificate.OptimalityCertificate),
    *(family.ActiveRoot, Drilling, swings.Swing),
    *(controlled_swings.ControlledSwing, controlled_swings.OnMotion),
    *(drill_string.DrillString, drill_string.Damping, section.Section, wall.Wall),
    *(section.Material, section.ToolJoint, drive_control.DriveMachine, WeightControl),
    *(plane.Plane, chains.Curve, regions.Region, scan.ScanLine, Place),
    *(comparison.Row, measures.Response, loop_margins.LoopMargins, radius.StabilityRadius),
    *(margins.DelayMargin, margins.ParameterMargin, lattice.Cell, vibration_values.Severity),
    *(orbit.AxialOrbit, swing.ModeSwing, swing.ModeAt, torsion.TorsionalMode),
    *(SteadyState, check.RigCheck, check.Mode, rig_report_values.Course),
    *(report.Report, report.Alternative, robustness.Robustness, fragility.Fragility),
    *(boundary.BoundaryDecision, record.Record, columns.Taken, swung.Period, swung.Windows),
    *(peaks.Peak, Downhole, fit_values.RecordFit, fit_values.Estimate, drive_seen.DriveSeen),
    *(ComputedMap, line.Line, line.Stretch, line.Piece, DriveMeasures, DriveMode, DriveRoot),
    *(DriveVerdict, FallingTorque, slopes.CriticalSlope, slopes.ModeSlope),
    *(drive_control.DriveControl, drive_control.Transfer),
)
CLASSES = {**{kind.__name__: kind for kind in _PARTS}, "charts.Axis": axes.Axis}
