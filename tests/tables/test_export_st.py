import re
from pathlib import Path

import blark
import numpy as np
import pytest
from blark.parse import parse_source_code

from drillctrl import Controller, InputError, OperatingPoint, simulate
from drillctrl.tables.export_st import VARIABLES, export_st
from drillctrl.tables.reserved import is_identifier

from .iec import Block, load

POINT = OperatingPoint(10.0, 2.5, 14.0)
PERIOD, LIMIT = POINT.delay / 16, 3.0


@pytest.mark.long
def test_the_block_parses_and_gives_the_simulators_command(small, tmp_path):
    path = export_st(small, tmp_path / "drill.st", period=PERIOD, limit=LIMIT, ramp=0)
    text = path.read_text()
    assert parse_source_code(text).exception is None
    block = Block(load(text)["DRILL"])
    K1, K2 = small.gains_at(10.0, 2.5, 14.0)
    start = 100.0
    control = Controller("case1", K1[0], K2[0], activation=start, period=PERIOD, limit=LIMIT)
    run = simulate(POINT, control, duration=130.0, initial={"dx": 1.0, "dtheta": 1.0})
    samples = np.arange(-100, int(29.0 / PERIOD))
    theta = run.at(start + samples * PERIOD).theta
    held = run.at(start + (samples + 0.5) * PERIOD).torque
    commanded = []
    for k, y in zip(samples.tolist(), theta.tolist(), strict=True):
        block(Measured=[y], Place=[10.0, 2.5, 14.0], DelayTime=POINT.delay, Enable=k >= 0)
        commanded.append(block.COMMAND)
    assert np.abs(held - commanded).max() < 1e-12
    assert block.VOUCHED
    assert any(event.name == "stick" for event in run.events)


def test_lookup_equals_python(small, on_rig, tmp_path):
    rng = np.random.default_rng(4)
    for table in (small, on_rig):
        text = export_st(table, tmp_path / "t_1.st", period=0.5, limit=1e6).read_text()
        block = Block(load(text)["T_1"])
        low, high = table.grid.coordinates.min(axis=0), table.grid.coordinates.max(axis=0)
        places = low + (high - low) * rng.uniform(-0.3, 1.3, (60, 3))
        places[:, 2] = low[2]
        for place in places[(places > 0).all(axis=1)]:
            groups = table.grid.groups(place[None])[0]
            K1, K2 = table.gains_at(*groups)
            expected = np.array([*K1.ravel(), *K2.ravel()])
            rig = table.grid.rig
            if rig is not None:
                expected *= rig.torsional_stiffness * np.array([1.0, rig.time_scale] * 2)
            count = len(table.structure.outputs)
            block(Measured=[0.0] * count, Place=place.tolist(), DelayTime=0.1, Enable=False)
            assert pytest.approx(expected.tolist(), rel=1e-10, abs=1e-9) == block.GAINVALUES
            assert table.stable_at(*groups)[0] == block.VOUCHED


def declared(text):
    """Return the names that a block gives, its own first."""
    block = re.search(r"^FUNCTION_BLOCK (\w+)$", text, re.MULTILINE)[1]
    return [block, *re.findall(r"^    (\w+) : ", text, re.MULTILINE)]


def test_no_name_of_the_block_is_a_word_of_the_language_or_a_library(small, on_rig, tmp_path):
    for table in (small, on_rig):
        path = export_st(table, tmp_path / "drill_gains.st", period=0.5, limit=1.0)
        block, *variables = declared(path.read_text())
        assert block == "drill_gains"
        # Of axes beyond the third there are none here.
        others = {f"{what}{letter}" for what in ("Corner", "Ticks") for letter in "DEFGH"}
        assert set(variables) == VARIABLES - others - {"FastestChange"}
        assert all(is_identifier(name) for name in (block, *VARIABLES))
        assert len({name.upper() for name in (block, *VARIABLES)}) == 1 + len(VARIABLES)


def test_every_word_that_the_grammar_of_another_parser_keeps_is_known():
    grammar = (Path(blark.__file__).parent / "iec.lark").read_text(encoding="utf-8")
    kept = re.search(r"^IDENTIFIER: /\\b\(\?!\(([A-Z_|]+)\)", grammar, re.MULTILINE)[1].split("|")
    assert len(kept) > 50
    assert [word for word in kept if is_identifier(word)] == []


@pytest.mark.parametrize(
    "name",
    [
        *("LIMIT", "limit", "Ramp", "on", "PID", "Delay", "DINT_TO_LREAL", "R", "IB1", "Ton"),
        *("a__b", "a_", "_a", "1a", "a-b", "", "x" * 33, "Measured", "command"),
    ],
)
def test_a_file_whose_name_is_none_for_a_block_is_refused(small, tmp_path, name):
    with pytest.raises(InputError, match="name = "):
        export_st(small, tmp_path / f"{name}.st", period=0.1, limit=1.0)
    assert not list(tmp_path.iterdir())


def test_variables_say_their_units(on_rig, tmp_path):
    text = export_st(on_rig, tmp_path / "rig.st", period=0.1, limit=500.0).read_text()
    assert "LREAL; (* Y: theta in rad, dtheta in rad/s *)" in text
    assert "(* rotary_speed (rad/s), penetration_rate (m/s), rock_strength (Pa) *)" in text
    assert "Command : LREAL; (* u: N m *)" in text
    assert "Dialect: IEC 61131-3, second edition" in text


def test_bad_input_is_refused(small, tmp_path):
    for wrong in ({"period": 0.0}, {"limit": -1.0}):
        with pytest.raises(InputError):
            export_st(small, tmp_path / "t.st", **{"period": 0.1, "limit": 1.0, **wrong})
    assert not list(tmp_path.iterdir())
