"""Small tables that several tests use."""

import shutil

import pytest

from drillctrl import dimensionless_grid, linear_axis, rig_grid, table, table1
from drillctrl.base.units import ROTARY_SPEED, SPEED, to_si


@pytest.fixture(scope="session")
def small():
    """3 × 3 nodes of case1, all of which can be made stable."""
    grid = dimensionless_grid(linear_axis("omega0", 8, 14, 3), linear_axis("delta0", 1, 6, 3), 14.0)
    return table(grid, "case1", trials=False)


@pytest.fixture(scope="session")
def on_rig():
    """3 × 2 nodes of Table 1's rig; nothing stabilises the slowest."""
    speeds = [to_si("speed", f"{rpm} rpm", ROTARY_SPEED) for rpm in (100, 220)]
    rates = [to_si("rop", f"{rate} m/h", SPEED) for rate in (20, 60)]
    grid = rig_grid(
        table1(),
        linear_axis("rotary_speed", *speeds, 3),
        penetration_rate=linear_axis("penetration_rate", *rates, 2),
    )
    return table(grid, "case2", trials=False)


@pytest.fixture
def tool():
    """Skip a test whose program is not on the path."""

    def needed(name):
        if shutil.which(name) is None:
            pytest.skip(f"no {name} on the path")

    return needed
