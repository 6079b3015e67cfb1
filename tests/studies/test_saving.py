"""Saved results come back as they were, and files that were tampered with do not."""

import dataclasses
import json
import math

import numpy as np
import pytest

from drillctrl import (
    Controller,
    DelaySystem,
    InputError,
    OperatingPoint,
    RigPoint,
    SemiDiscrete,
    analyze,
    as_case,
    bit_band,
    bit_response,
    campaign,
    chart,
    compare,
    compare_drives,
    design,
    dimensionless_grid,
    example_path,
    linear_axis,
    load_result,
    load_rig,
    paper_plant,
    read_record,
    save_result,
    simulate,
    stabilisable_chart,
    stability_volume,
    string_preset,
    study_record,
    table1,
    vibration_map,
)
from drillctrl.base.codec import decode, encode
from drillctrl.interop import saved_kinds

from ..records.test_fitted_rig import fit_of
from ..strangers import VelocityWeakening

RIG = RigPoint(table1(), rotary_speed=5.0 * math.pi, penetration_rate=20.0 / 3600.0)
POINT = OperatingPoint(10.0, 2.5, 14.0)


@pytest.fixture(scope="module")
def designed():
    return design(RIG, "case1")


@pytest.fixture(scope="module")
def run():
    return simulate(POINT, duration=30.0)


def test_a_design_comes_back_with_all_that_is_told_of_it(designed, tmp_path):
    save_result(designed, tmp_path / "d.json")
    again = load_result(tmp_path / "d.json")
    assert type(again) is type(designed)
    assert again.to_dict() == designed.to_dict()
    assert again.summary() == designed.summary()
    assert again.K1.tobytes() == designed.K1.tobytes()
    # What a design is for: its controller runs.
    assert again.controller().plant == again.case.plant
    save_result(again, tmp_path / "e.json")
    assert (tmp_path / "d.json").read_bytes() == (tmp_path / "e.json").read_bytes()


def test_other_kinds_of_designs(tmp_path):
    plain = DelaySystem([[0.5]], ([[-1.0]],), (1.0,), [[1.0]], [[1.0]])
    string = RigPoint(string_preset("paper-string"), rotary_speed=12.0, penetration_rate=0.005)
    for found in (
        design(POINT, "p", objective=SemiDiscrete(m=10), trials=False),
        analyze(POINT, "case2", [-5.0, -4.9], [-1.7, -0.3]),
        analyze(POINT),
        analyze(plain),
        analyze(string),
    ):
        save_result(found, tmp_path / "some.json")
        again = load_result(tmp_path / "some.json")
        assert again.to_dict() == found.to_dict()
        assert again.case.plant == found.case.plant


def test_a_plant_of_ones_own_is_given_when_it_is_read(tmp_path):
    plant = paper_plant(bit=VelocityWeakening())
    found = analyze(as_case(POINT, plant), "p", [-1.0])
    save_result(found, tmp_path / "own.json")
    assert load_result(tmp_path / "own.json", plant).to_dict() == found.to_dict()
    with pytest.raises(InputError, match="another plant"):
        load_result(tmp_path / "own.json")


@pytest.mark.parametrize(
    "controller",
    [
        None,
        Controller("case1", [-3.82], [3.61], limit=3.0, actuator_lag=0.05),
        Controller("case2", [-1, -1], [0.5, 0], period=0.1, noise={"theta": 0.01}, delay="current"),
    ],
)
def test_a_run_comes_back_to_the_last_bit(controller, tmp_path):
    found = simulate(POINT, controller, duration=30.0, initial={"dx": 0.5})
    save_result(found, tmp_path / "run.json")
    again = load_result(tmp_path / "run.json")
    for name, column in found.motion.columns().items():
        assert np.array_equal(column, again.motion.columns()[name], equal_nan=True), name
    assert again.summary == found.summary
    assert again.events == found.events
    # It goes on as the first would.
    further = [simulate(POINT, duration=5.0, scenario=_after(one)) for one in (found, again)]
    assert further[0].motion.theta.tobytes() == further[1].motion.theta.tobytes()


def _after(run):
    from drillctrl import Scenario

    return Scenario(start=run.past())


def test_a_run_of_a_rig_keeps_its_units(tmp_path):
    found = simulate(RIG, duration=10.0)
    save_result(found, tmp_path / "run.json")
    again = load_result(tmp_path / "run.json")
    assert again.in_rig_units().bit_speed.tolist() == found.in_rig_units().bit_speed.tolist()


def test_a_campaign_comes_back(tmp_path):
    grid = dimensionless_grid(linear_axis("omega0", 8, 12, 2), linear_axis("delta0", 0.5, 2, 2))
    found = campaign(grid, sizes=(0.01,), sharpness=math.inf, duration=30.0)
    save_result(found, tmp_path / "c.json")
    again = load_result(tmp_path / "c.json")
    assert again.to_dict() == found.to_dict()
    assert again.summary() == found.summary()


def test_what_cannot_be_kept_is_refused(run, tmp_path):
    with pytest.raises(InputError, match="result = "):
        save_result(3.0, tmp_path / "x.json")
    with pytest.raises(InputError, match="ends in .json"):
        save_result(run, tmp_path / "x.pickle")
    with pytest.raises(InputError, match="goes on from another"):
        save_result(simulate(POINT, duration=1.0, scenario=_after(run)), tmp_path / "x.json")
    assert list(tmp_path.iterdir()) == []


def _sealed(document):
    """The document with the checksum that belongs to it: whoever forges one can make it."""
    from drillctrl.interop.saving import _checksum

    return {**document, "checksum": _checksum(document["result"])}


def _set(document, path, value):
    *inner, last = path
    place = document
    for key in inner:
        place = place[key]
    place[last] = value


FORGED = [
    (("result", "Design", "K1", "values"), [1e3]),
    (("result", "Design", "K1", "values"), ["a"]),
    (("result", "Design", "K1", "shape"), [10**9]),
    (("result", "Design", "K1", "array"), "object"),
    (("result", "Design", "loop", "spectral_abscissa"), -99.0),
    (("result", "Design", "loop", "is"), "Popen"),
    (("result", "Design", "loop", "more"), 1),
    (("result", "Design", "plant", "A0", "values"), [0.0] * 16),
    (("result", "Design", "case", "plant", "plant"), "another"),
    (("result", "Design", "verdict", "reason"), {"map": {}}),
    (("result", "Design", "is"), "Campaign"),
    (("result", "Campaign"), {}),
    (("result",), {}),
    (("result",), []),
    (("schema",), "drillctrl/gain-table/1"),
]


@pytest.mark.parametrize(("path", "value"), FORGED)
def test_forged_designs_are_refused(designed, tmp_path, path, value):
    save_result(designed, tmp_path / "d.json")
    document = json.loads((tmp_path / "d.json").read_text())
    _set(document, path, value)
    (tmp_path / "d.json").write_text(json.dumps(_sealed(document)))
    with pytest.raises(InputError, match="result = ") as caught:
        load_result(tmp_path / "d.json")
    assert "\n" not in str(caught.value)


def test_forged_runs_are_refused(run, tmp_path):
    save_result(run, tmp_path / "r.json")
    whole = json.loads((tmp_path / "r.json").read_text())
    width = whole["result"]["Simulation"]["whole"]["shape"][1]
    kept = ("result", "Simulation")
    for path, value in (
        ((*kept, "whole", "values", 4), -5),
        ((*kept, "whole", "values", 3 * width + 4), 10**7),
        ((*kept, "whole", "values", 3 * width + 5), 10**7),
        ((*kept, "real", "values", 0), 1e9),
        ((*kept, "real", "shape"), [1, 2]),
        ((*kept, "first"), 0),
        ((*kept, "duration"), -1.0),
        ((*kept, "case"), None),
        ((*kept, "status"), "done"),
        ((*kept, "further"), 1),
    ):
        document = json.loads(json.dumps(whole))
        _set(document, path, value)
        (tmp_path / "f.json").write_text(json.dumps(_sealed(document)))
        with pytest.raises(InputError, match="result = "):
            load_result(tmp_path / "f.json")


def test_broken_files_are_refused(designed, tmp_path):
    save_result(designed, tmp_path / "d.json")
    text = (tmp_path / "d.json").read_text()
    changed = text.replace('"stable": true', '"stable": false', 1)
    assert changed != text
    for bad in (text[: len(text) // 2], changed, "", "[]", "null", "7", "[" * 5000, "\x00"):
        (tmp_path / "bad.json").write_text(bad)
        with pytest.raises(InputError, match="result = "):
            load_result(tmp_path / "bad.json")
    for path in (tmp_path / "none.json", tmp_path):
        with pytest.raises(InputError, match="result = "):
            load_result(path)


def test_numbers_of_every_kind_survive():
    @dataclasses.dataclass(frozen=True)
    class Some:
        value: object

    values = (
        1.0, -0.0, math.inf, -math.inf, 5e-324, 2**60, True, None, "ω", 1 + 2j,
        complex(math.inf, -1.0), (1, (2.5, "a")), {"a": (1,)},
        np.array([[1.5, math.nan]]), np.array([2, 3]), np.array([True]), np.array(["x"]),
        np.array([1j]), np.zeros((0, 3)),
    )  # fmt: skip
    for value in values:
        text = json.dumps(encode(Some(value), {"Some": Some}), allow_nan=False)
        again = decode(json.loads(text), {"Some": Some}).value
        assert type(again) is type(value)
        assert repr(again) == repr(value)
    with pytest.raises(TypeError, match="Some"):
        encode(Some(1), {})
    with pytest.raises(KeyError):
        decode({"is": "Some", "value": 1}, {})


def _study():
    """A minute and a half of the recording that ships, its string carried down, and a fit."""
    rig = load_rig(example_path("rig"))
    shipped = read_record(example_path("record")).part(0.0, 100.0)
    return dataclasses.replace(study_record(shipped, rig, fit=False), fit=fit_of(rig))


RESULTS = {
    "record": _study,
    "drives": lambda: compare_drives(string_preset("vertical-3000"), ("stiff", "soft-torque")),
    "chart": lambda: chart(RIG, ("speed", 60, 180), ("rop", 5, 40)),
    "stabilisable": lambda: stabilisable_chart(
        POINT, ("omega0", 9, 12), ("delta0", 0, 4), "p", first_lines=3, tolerance=0.1
    ),
    "volume": lambda: stability_volume(
        POINT, ("omega0", 9, 10), ("delta0", 0, 2), ("psi", 13, 14), slices=3, lines=3
    ),
    "response": lambda: bit_response(RIG, 2.8, 0.03),
    "band": lambda: bit_band(RIG, 0.03),
    "comparison": lambda: compare(POINT, ("p",), duration=20.0, trials=False),
    "map": lambda: vibration_map(
        RIG, ("speed", 120, 160), ("rop", 10, 20), counts=(2, 2), duration=20.0, refine=0
    ),
}


@pytest.mark.long(but=1)
@pytest.mark.parametrize("name", RESULTS)
def test_other_results_come_back_to_the_last_digit(tmp_path, name):
    found = RESULTS[name]()
    save_result(found, tmp_path / "one.json")
    again = load_result(tmp_path / "one.json")
    save_result(again, tmp_path / "two.json")
    assert (tmp_path / "one.json").read_bytes() == (tmp_path / "two.json").read_bytes()
    assert type(again) is type(found)
    if hasattr(found, "summary"):
        assert again.summary() == found.summary()
        assert again.to_dict() == found.to_dict()


def test_no_two_kinds_share_a_name():
    assert len(saved_kinds.CLASSES) == len(saved_kinds._PARTS) + 1
