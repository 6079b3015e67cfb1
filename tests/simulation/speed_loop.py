"""PI control of a top drive that feeds angle and speed back: another route to what a law asks."""

import numpy as np

from drillctrl import Controller, FeedbackStructure
from drillctrl.drilling.case import as_case
from drillctrl.simulation.structure import structure_of

NONE, ANY = np.zeros((1, 2)), np.full((1, 2), 1e12)
LOOP = FeedbackStructure("drive speed", ("phi", "dphi"), -ANY, ANY, -NONE, NONE, ("drive",))


def speed_loop(where, control, period=None):
    """Return the controller; its integral, the drive's angle, goes on at the torque limit."""
    rig, machine = where.rig, control.machine
    unit, time = rig.torsional_stiffness, rig.time_scale
    assert control.speed.denominator in ((1.0,), (1.0, 0.0))
    law = control.speed
    whole = law.numerator if len(law.denominator) > 1 else (*law.numerator, 0.0)
    proportional, integral = (0.0, *whole)[-2:]
    steady = float(structure_of(as_case(where)).arrays.steady[1])
    limit = None if machine.torque_limit is None else machine.torque_limit / unit - steady
    return Controller(
        LOOP,
        [-integral / unit, -proportional / (unit * time)],
        [0.0, 0.0],
        limit=limit,
        measurement_delay=machine.delay / time,
        actuator_lag=machine.lag / time,
        period=None if period is None else period / time,
    )
