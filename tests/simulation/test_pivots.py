"""A string in few numbers is the string: rows that follow the ends' rates give the same rates."""

from __future__ import annotations

import numpy as np
import pytest

from drillctrl.drilling.case import as_case
from drillctrl.drilling.point import RigPoint
from drillctrl.simulation.kernel import data
from drillctrl.simulation.pivots import follow_pivots
from drillctrl.simulation.structure import structure_of
from drillctrl.strings.drill_string import Damping, DrillString
from drillctrl.strings.drive_control import DriveMachine
from drillctrl.strings.presets import string_preset
from drillctrl.strings.rig import string_rig
from drillctrl.strings.section import Section


def uneven():
    """Pipe of which nothing is proportional to anything, under a drive."""
    sections = (
        Section("pipe", "pipe", 900.0, 0.127, 0.108),
        Section("collar", "collar", 120.0, 0.1715, 0.0714),
    )
    damping = Damping(torsional=0.3, axial=0.2, retardation=1e-4)
    return string_rig(
        DrillString(sections, damping, hoisting_stiffness=2e7), drive=DriveMachine(1500.0),
        bit_radius=0.1, blades=4, rock_strength=60e6, contact_strength=60e6,
        wearflat_length=1e-3, cutter_inclination=0.6, friction_coefficient=0.3,
        bit_geometry=1.0,
    )  # fmt: skip


@pytest.mark.parametrize("rig", [string_preset("vertical-3000"), uneven()], ids=["deep", "uneven"])
@pytest.mark.parametrize("linear", [False, True])
def test_the_rows_say_what_the_matrices_say(rig, linear):
    where = RigPoint(rig, 12.0, 15.0 / 3600.0)
    structure = structure_of(as_case(where))
    string, names = structure.arrays, structure.state_names
    n = len(names)
    matrix = string.linear if linear else string.A
    rows = np.zeros((n, n + data.PIVOTS))
    rows[:, :n] = matrix
    pivots = follow_pivots(rows, names)
    assert pivots
    assert np.count_nonzero(rows) < 0.55 * np.count_nonzero(matrix)
    rng = np.random.default_rng(1)
    state = rng.normal(size=n) / np.maximum(abs(matrix).max(axis=0), 1e-300)
    exact = matrix @ state
    ends = np.zeros(data.PIVOTS)
    ends[: len(pivots)] = exact[pivots]
    found = rows[:, :n] @ state + rows[:, n:] @ ends
    np.testing.assert_allclose(found, exact, atol=1e-12)
    # A mode keeps its frequency, however small it is beside what holds the bit.
    back = rows[:, :n] + rows[:, n : n + len(pivots)] @ matrix[pivots]
    ours, theirs = (np.sort_complex(np.linalg.eigvals(a)) for a in (back, matrix))
    np.testing.assert_allclose(ours, theirs, rtol=1e-7, atol=1e-7)


def test_the_lumped_string_stays_as_it_is():
    rows = np.eye(4, 4 + data.PIVOTS)
    before = rows.copy()
    assert follow_pivots(rows, ("x", "dx", "theta", "dtheta")) == []
    np.testing.assert_array_equal(rows, before)
