"""Texts for terminals: lines of 80 columns, broken between words and never inside a quantity."""

from __future__ import annotations

import pytest

from drillctrl import cli
from drillctrl.base.text import set_out, wrapped

RIG = ("--rig", "table1", "--speed", "150 rpm", "--rop", "20 m/h")


def test_quantities_stay_whole():
    text = " ".join(f"x{i} = {i}.5 kN·m/rad and {i} rpm," for i in range(40))
    lines = wrapped(text, 4).splitlines()
    assert " ".join(line.strip() for line in lines) == text
    assert len(lines) > 5
    for line in lines:
        assert len(line) <= 80
        assert not line.rstrip().endswith(("=", "5", "0"))
        assert not line.strip().startswith(("=", "kN", "rpm"))


def test_what_is_too_long_goes_on_below_its_beginning():
    told = set_out([("Short", "one"), ("", "word " * 40), ("A longer one", "three")])
    lines = told.splitlines()
    assert {line[:14] for line in lines[1:-1]} == {" " * 14}
    assert [line[14:] for line in (lines[0], lines[-1])] == ["one", "three"]
    assert "NO-BREAK" not in told
    assert "\N{NO-BREAK SPACE}" not in told


@pytest.mark.long(but=1)
@pytest.mark.parametrize(
    "arguments",
    [
        ("design", *RIG, "--structure", "pd"),
        ("design", "--structure", "case2", "--omega0", "10", "--delta0", "12"),
        ("analyze", *RIG, "--structure", "p", "--K1", "-2 kN*m/rad"),
        ("simulate", *RIG, "--duration", "20 s"),
        ("simulate", "--starts", "small,kick", "--duration", "40"),
        ("compare", *RIG, "--structures", "p,case2", "--no-charts", "--trials", "none"),
    ],
    ids=lambda arguments: " ".join(arguments[:3]),
)
def test_summaries_fit_a_terminal(capsys, arguments):
    with pytest.raises(SystemExit) as stop:
        cli.main(list(arguments))
    assert stop.value.code == 0
    told = capsys.readouterr().out
    assert max(len(line) for line in told.splitlines()) <= 80
    if "table1" in arguments and arguments[0] != "simulate":
        assert "kN·m/rad" in told


@pytest.mark.long
def test_gains_can_be_copied_to_the_last_digit(capsys):
    def out(*arguments):
        with pytest.raises(SystemExit):
            cli.main(list(arguments))
        return capsys.readouterr().out

    point = ("--omega0", "10", "--delta0", "2.5")
    told = out("design", "--structure", "case1", *point, "--trials", "none")
    copied = [line.split()[-1] for line in told.splitlines() if " K1=" in line or " K2=" in line]
    assert len(copied) == 2
    again = out("analyze", "--structure", "case1", *point, *(f"--{text}" for text in copied))
    alpha = [line for text in (told, again) for line in text.splitlines() if "stabilised" in line]
    assert alpha[0].split("α = ")[1] == alpha[1].split("α = ")[1]
