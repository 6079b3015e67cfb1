"""The layout: what a module may import, so that data flows one way."""

import ast
import functools
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ROOMS = (
    *("base", "delay", "spectrum", "robustness", "synthesis", "drilling", "strings", "simulation"),
    *("motion", "designs", "charts", "tables", "hardware", "studies", "records", "paper"),
    *("interop", "explorer", "cli"),
)
LOOPS = ("delay", "spectrum", "robustness", "synthesis")
RESULTS = (
    *(
        "designs.values",
        "designs.result",
        "designs.report",
        "charts.chart",
        "charts.stabilisable",
        "charts.volume",
    ),
    *(
        "tables.gain_table",
        "simulation.result",
        "motion.swing",
        "studies.campaign",
        "studies.comparison",
        "studies.vibration",
        "studies.vibration_values",
        "records.study",
        "records.findings",
        "records.fit_values",
        "records.fitting",
    ),
)


def _statements(node: ast.AST, typing: bool) -> Iterator[ast.AST]:
    """Yield all statements, those inside functions too; those for the type checker if asked."""
    for child in ast.iter_child_nodes(node):
        checked = isinstance(child, ast.If) and ast.unparse(child.test) == "TYPE_CHECKING"
        if typing or not checked:
            yield child
            yield from _statements(child, typing)


@functools.cache
def _imports(typing: bool) -> dict[str, set[str]]:
    """Return the modules that each module of the package imports, by their dotted names."""
    names = {}
    for path in (ROOT / "drillctrl").rglob("*.py"):
        parts = path.relative_to(ROOT).with_suffix("").parts
        names[".".join(parts).removesuffix(".__init__")] = path
    graph: dict[str, set[str]] = {}
    for name, path in names.items():
        found = graph.setdefault(name, set())
        above = name.split(".") if path.name == "__init__.py" else name.split(".")[:-1]
        for node in _statements(ast.parse(path.read_text(encoding="utf-8")), typing):
            if isinstance(node, ast.Import):
                found |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                base = above[: len(above) + 1 - node.level] if node.level else []
                home = ".".join([*base, *([node.module] if node.module else [])])
                found |= {
                    full if (full := f"{home}.{alias.name}") in names else home
                    for alias in node.names
                }
        graph[name] = {other for other in found if other in names} - {"drillctrl", name}
    return graph


def _room(name: str) -> str:
    return name.partition(".")[2].partition(".")[0]


@pytest.fixture(scope="module")
def imports() -> dict[str, set[str]]:
    return _imports(typing=True)


def test_no_module_imports_itself_by_way_of_others(imports):
    """Not even inside functions, nor for the type checker alone."""
    assert len(list(TopologicalSorter(imports).static_order())) == len(imports) > 100


def test_a_room_leans_only_on_rooms_before_it(imports):
    upwards = [
        (name, other)
        for name, others in imports.items()
        for other in others
        if _room(name) in ROOMS and ROOMS.index(_room(other)) > ROOMS.index(_room(name))
    ]
    assert upwards == []
    assert {_room(name) for name in imports} - {"", "__main__"} == set(ROOMS)


def test_loops_know_no_drilling_and_drilling_no_spectra():
    crossing = [
        (name, other)
        for name, others in _imports(typing=True).items()
        for other in others
        if (_room(name) in LOOPS and _room(other) == "drilling")
        or (_room(name) in ("drilling", "simulation") and _room(other) in LOOPS[1:])
    ]
    assert crossing == []


def test_figures_know_no_results():
    imports = _imports(typing=True)
    results = {f"drillctrl.{name}" for name in RESULTS}
    assert results <= imports.keys()
    figures = {name for name in imports if name.endswith("figure")}
    assert len(figures) >= 8
    assert {name: imports[name] & results for name in figures if imports[name] & results} == {}
