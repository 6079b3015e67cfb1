"""Points of the paper that several tests use, and how hypothesis draws."""

import os
from collections import Counter

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


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items):
    """Order and choose what runs.

    The simulator, which compiles, comes first, beside what has no need of it; files of few tests
    come last. Of cases that are marked ``long(but=1)`` the first is not.
    """
    rooms = ("spectrum", "charts", "delay", "base", "robustness", "synthesis")
    seen = Counter()
    many = Counter(item.path for item in items)

    def turn(item):
        room, name = item.path.parts[-2:]
        if (room, name) == ("simulation", "test_string.py"):
            return 0, 0
        return 1 if room in rooms else 2, -many[item.path]

    for item in items:
        mark = item.get_closest_marker("long")
        if mark is not None:
            which = item.path, item.originalname
            seen[which] += 1
            if seen[which] <= mark.kwargs.get("but", 0):
                item.own_markers = [own for own in item.own_markers if own.name != "long"]
    items.sort(key=turn)


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
