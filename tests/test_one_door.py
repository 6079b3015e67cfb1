"""Every verb takes a point, a rig at its point, a system or a case; or says in one line why not."""

import inspect
import math

import numpy as np
import pytest

import drillctrl
from drillctrl import (
    InputError,
    OperatingPoint,
    RigPoint,
    Stribeck,
    analyze,
    as_case,
    campaign,
    chart,
    compare,
    design,
    dimensionless_grid,
    gain_surface,
    paper_plant,
    plant_system,
    point_margins,
    preset_structure,
    root_locus,
    root_sensitivity,
    simulate,
    spectral_abscissas,
    stabilisable_chart,
    stability_volume,
    table,
    table1,
)

POINT = OperatingPoint(10.0, 2.5, 14.0)
PLACES = {
    "point": POINT,
    "rig": RigPoint(table1(), 150 * math.pi / 30, 20 / 3600),
    "case": as_case(POINT, paper_plant(bit=Stribeck(drop=0.5))),
    "system": plant_system(POINT),
    "mapping": {"omega0": 10.0},
}
STRUCTURE, K1, K2 = preset_structure("case1"), np.array([[-3.8]]), np.array([[3.6]])
WINDOW = ("omega0", 9.0, 9.5), ("delta0", 2.0, 2.2)
COARSE = {"first_lines": 3, "samples": 4, "tolerance": 0.1}
# The verb, and whether a system alone is enough.
VERBS = {
    "design": (lambda w: design(w, "p", trials=False), True),
    "analyze": (analyze, True),
    "chart": (lambda w: chart(w, ("K1_1", -5, 5), ("K2_1", -5, 5), STRUCTURE, K1, K2), True),
    "stabilisable": (lambda w: stabilisable_chart(w, *WINDOW, "p", **COARSE), False),
    "volume": (lambda w: stability_volume(w, *WINDOW, ("psi", 13.0, 14.0), slices=3), False),
    "gain surface": (lambda w: gain_surface(w, count=5), True),
    "root locus": (lambda w: root_locus(w, ("omega0", 9.0, 10.0)), False),
    "compare": (lambda w: compare(w, ("p",), duration=5.0, region=None, trials=False), False),
    "table": (lambda w: table(dimensionless_grid(9.0, 2.0, reference=w), "p", trials=False), False),
    "simulate": (lambda w: simulate(w, duration=2.0), False),
    "campaign": (lambda w: campaign(dimensionless_grid(9.0, 2.0, reference=w), largest=1.0), False),
    "batch": (lambda w: spectral_abscissas(w, None, STRUCTURE, [-3.8, 3.6]), True),
    "sensitivity": (lambda w: root_sensitivity(w, STRUCTURE, K1, K2), False),
    "margins": (lambda w: point_margins(w, STRUCTURE, K1, K2), False),
}


@pytest.mark.parametrize("verb", VERBS)
@pytest.mark.parametrize("kind", PLACES)
def test_every_verb_takes_it_or_says_why_not(verb, kind):
    ask, linear = VERBS[verb]
    if kind == "mapping" or (kind == "system" and not linear):
        with pytest.raises(InputError, match="must be") as caught:
            ask(PLACES[kind])
        assert "\n" not in str(caught.value)
        assert not str(caught.value).endswith("one of")
    else:
        assert ask(PLACES[kind]) is not None


def _first_argument(name):
    value = getattr(drillctrl, name)
    first = next(iter(inspect.signature(value).parameters.values()), None)
    return None if first is None else str(first.annotation)


FUNCTIONS = [name for name in dir(drillctrl) if inspect.isfunction(getattr(drillctrl, name))]
ONE_KIND = {
    "DelaySystem": [name for name in FUNCTIONS if _first_argument(name) == "DelaySystem"],
    "RigPoint": [name for name in FUNCTIONS if _first_argument(name) == "RigPoint"],
    "Grid": [name for name in FUNCTIONS if _first_argument(name) == "Grid"],
}


@pytest.mark.parametrize("kind", ONE_KIND)
def test_what_works_on_one_kind_alone_says_so(kind):
    """Whatever else it takes: the first argument is looked at before anything."""
    assert ONE_KIND[kind]
    for name in ONE_KIND[kind]:
        function = getattr(drillctrl, name)
        for where in (POINT, PLACES["case"], None, 3.0):
            least = [
                parameter
                for parameter in inspect.signature(function).parameters.values()
                if parameter.default is parameter.empty
                and parameter.kind is parameter.POSITIONAL_OR_KEYWORD
            ]
            with pytest.raises(InputError, match=f"must be a {kind}") as caught:
                function(where, *[None] * (len(least) - 1))
            assert "\n" not in str(caught.value)
