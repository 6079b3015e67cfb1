"""The border of stick-slip on a distributed string: a public map, and waves by characteristics."""

import pytest

from tests.strings.public_map import (
    BORDERS,
    STICKS,
    public_case,
    swing,
    swing_by_characteristics,
    upwind_retardation,
)


def both_routes(cutting, feed, speed):
    ours = swing(*public_case(cutting, feed, speed), rtol=1e-4)
    return ours, swing_by_characteristics(cutting, feed, speed, cells=80)


def test_the_border_of_the_public_map_lies_between_the_same_two_speeds():
    row = 10, 1.0826
    sticking, free = BORDERS[row]
    assert swing(*public_case(*row, sticking), rtol=1e-4) >= STICKS
    ours, waves = both_routes(*row, free)
    assert ours == pytest.approx(waves, abs=0.02)
    assert 0.3 < ours < 0.4


def test_in_hard_rock_the_string_sticks_where_the_public_scheme_damps_it():
    # First-order upwind on 1000 cells lets the axial waves decay that the bit feeds.
    row = 40, 2.3950
    sticking, free = BORDERS[row]
    ours, waves = both_routes(*row, free)
    assert ours >= STICKS
    assert waves >= STICKS
    damped = {"retardation": upwind_retardation(1000, free)}
    assert swing(*public_case(*row, free, **damped), rtol=1e-4) < 0.8
    assert swing(*public_case(*row, sticking, **damped), rtol=1e-4) >= STICKS
