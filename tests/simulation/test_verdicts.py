"""What a run is named, beside a program that shares nothing with it: several motions of each name.

Where neighbours of a motion come apart within the run, the motions taken here have the same name
from all of them.
"""

import math

import pytest

from drillctrl import Controller, RigPoint, as_case, simulate, table1
from drillctrl.simulation.outcome import figures
from drillctrl.simulation.starts import start_named
from tests.simulation.fixed_step import motion, name_of

FREE = (None, (), math.inf)


@pytest.mark.parametrize(
    ("name", "rpm", "rop", "start", "law"),
    [
        ("settles", 146, 30, "stick", ("pd", (0.0, -2.5), math.inf)),
        ("settles", 160, 58, "back", ("case2", (-4.1, -4.0, 3.3, 0.8), 0.3)),
        ("orbit", 150, 20, "small", FREE),
        ("orbit", 98, 10, "rest", FREE),
        ("orbit", 143, 37, "back", FREE),
        ("orbit", 121, 27, "back", ("pd", (0.0, 0.4), 0.3)),
        ("orbit", 131, 12, "kick", ("case2", (-2.6, -2.5, 2.1, 0.5), math.inf)),
        ("bounces", 77, 21, "rest", FREE),
        ("bounces", 113, 38, "rest", ("case2", (-0.6, -0.6, 0.5, 0.12), 3.0)),
        ("stick-slip", 71, 32, "back", FREE),
        ("stick-slip", 71, 39, "rest", FREE),
        ("does-not-keep-up", 60, 20, "kick", FREE),
        ("does-not-keep-up", 52, 42, "kick", ("pd", (0.0, -0.64), 3.0)),
        ("turns-back", 131, 54, "back", ("case2", (0.25, 0.24, -0.2, -0.05), 3.0)),
        ("turns-back", 163, 24, "stick", FREE),
        ("turns-back", 179, 37, "small", ("pd", (0.0, 0.65), 3.0)),
        ("diverges", 100, 10, "small", ("case2", (5.0, 4.9, -4.0, -1.0), math.inf)),
        ("diverges", 150, 30, "small", ("pd", (0.0, 0.4), math.inf)),
    ],
)
def test_a_motion_is_named_as_by_a_program_of_fixed_steps(name, rpm, rop, start, law):
    structure, gains, limit = law
    where = RigPoint(table1(), rpm * math.pi / 30.0, rop / 3600.0)
    controller = None
    if structure:
        bound = None if math.isinf(limit) else limit
        controller = Controller(structure, list(gains[:2]), list(gains[2:]) or None, limit=bound)
    run = simulate(where, controller, scenario=start_named(start).scenario(), duration=80.0)
    options = {"gains": gains, "limit": limit, "start": start, "end": 80.0}
    found, beside = (motion(as_case(where).point, nudge=k, **options) for k in (0.0, 1e-6))
    assert figures(run).outcome == name
    assert name_of(found, beside) == name
