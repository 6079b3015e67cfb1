"""Points of the paper that several tests use, and how hypothesis draws."""

import os

import pytest
from hypothesis import HealthCheck, settings

from drillctrl import OperatingPoint, design, plant_system, report

# Commands that tests start need not compile the package each time.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

settings.register_profile(
    "drillctrl",
    deadline=None,
    derandomize=True,
    max_examples=50,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("drillctrl")


def pytest_collection_modifyitems(items):
    """Let one process begin with the simulator: the other finds it compiled when it comes to it."""
    items.sort(key=lambda item: item.path.parts[-2:] != ("simulation", "test_string.py"))


@pytest.fixture(scope="session")
def point_c():
    """Point C of Fig. 8."""
    return OperatingPoint(10.0, 1.75, 14.0)


@pytest.fixture(scope="session")
def plant_c(point_c):
    """The open loop at point C."""
    return plant_system(point_c)


@pytest.fixture(scope="session")
def best_c(point_c):
    """The gains of case1 of least abscissa at point C."""
    return design(point_c, "case1", trials=False)


@pytest.fixture(scope="session")
def told_c(best_c):
    """All that is said of them."""
    return report(best_c)
