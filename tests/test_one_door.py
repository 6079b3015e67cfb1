"""Every verb takes a point, a rig at its point, a system or a case; or says in one line why not."""

import inspect
import math
import re

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
    close_loop,
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


FUNCTIONS = [name for name in dir(drillctrl) if inspect.isfunction(getattr(drillctrl, name))]
CLASSES = "|".join(name for name in dir(drillctrl) if inspect.isclass(getattr(drillctrl, name)))


def _asking_for_ours(name):
    """Return the parameters of a public function that are annotated with one of our classes."""
    parameters = inspect.signature(getattr(drillctrl, name)).parameters.values()
    own = re.compile(rf"\b({CLASSES}|Where|Line|Mapping)\b")
    return [
        parameter
        for parameter in parameters
        if own.search(str(parameter.annotation))
        and parameter.kind != parameter.VAR_KEYWORD
        # Beside a number, what is given is read as one.
        and "float" not in str(parameter.annotation)
    ]


@pytest.mark.parametrize("name", FUNCTIONS)
def test_an_argument_of_another_kind_is_refused_before_anything(name):
    for parameter in _asking_for_ours(name):
        for wrong in (object(), 3.5, *([] if "None" in parameter.annotation else [None])):
            with pytest.raises(InputError, match=rf"^{parameter.name} = .*: must be ") as caught:
                getattr(drillctrl, name)(**{parameter.name: wrong})
            assert "\n" not in str(caught.value)


def test_a_message_says_where_the_right_kind_comes_from():
    with pytest.raises(InputError) as caught:
        close_loop(plant_system(POINT), "case1", [-5.0], [5.0])
    assert str(caught.value) == (
        "feedback = 'case1': must be a FeedbackStructure, such as preset_structure('case1')"
    )


MADE = [
    made
    for name in drillctrl.__all__
    if inspect.isclass(made := getattr(drillctrl, name)) and not issubclass(made, Exception)
]


@pytest.mark.parametrize("made", MADE, ids=lambda made: made.__name__)
def test_public_classes_are_made_or_refuse_in_one_line(made, tmp_path, monkeypatch):
    # Some take "x" for a file.
    monkeypatch.chdir(tmp_path)
    parameters = inspect.signature(made).parameters.values()
    needed = [p.name for p in parameters if p.default is p.empty and p.kind not in (2, 4)]
    for wrong in (None, object(), "x", 3.5, [1]):
        try:
            one = made(**dict.fromkeys(needed, wrong))
            if hasattr(one, "__exit__"):
                one.__exit__(None, None, None)
        except InputError as error:
            assert len(str(error).splitlines()) == 1
