"""Event-driven simulation of the nonlinear plant, and of the linear one."""

from drillctrl.simulation.controller import Controller
from drillctrl.simulation.past import Past
from drillctrl.simulation.result import Event, Motion, Simulation
from drillctrl.simulation.run import simulate
from drillctrl.simulation.scenario import Change, Scenario
from drillctrl.simulation.summary import Summary

__all__ = [
    "Change",
    "Controller",
    "Event",
    "Motion",
    "Past",
    "Scenario",
    "Simulation",
    "Summary",
    "simulate",
]
