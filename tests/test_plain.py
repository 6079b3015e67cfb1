"""What a rig is told speaks a driller's words; theory stands behind --verbose."""

from __future__ import annotations

import json

import pytest

from drillctrl.cli import cli, main

RIG = ("--rig", "table1", "--speed", "150 rpm", "--rop", "20 m/h")
THEORY = ("ψ", "α", "ω0", "δ0", "τ0", "Clarke", "vouch", "ρ(D)", "argument principle",
          "Re H", "A =")  # fmt: skip
VERBS = {
    "analyze": ("--structure", "pd", "--K1", "-2 kN*m/rad,-400 N*m*s/rad"),
    "design": ("--structure", "p", "--trials", "none"),
    "simulate": ("--duration", "2 s"),
    "chart": ("--x", "speed=100:200 rpm", "--y", "rop=10:30 m/h"),
    "compare": ("--structures", "p"),
    "map": ("--x", "speed=140:150:2 rpm", "--y", "rop=10:20:2 m/h", "--refine", "0",
            "--starts", "small", "--duration", "2 s", "--workers", "1"),
    "bit": ("--amplitudes", "0.03", "--frequency", "0.45 Hz"),
    "bench": ("--duration", "0.05 s", "--speedup", "max", "--limit", "5 kN*m", "--table"),
}  # fmt: skip
# What is asked otherwise, and how its answer begins.
ASKED_OTHERWISE = {
    "record": (("example", "--to", "300 s", "--no-fit"), "The bit sticks and slips"),
    "rig": (("check", "table1"), "Rig     with its top end held the bit swings at 0.453 Hz"),
}
# Symbols of the paper; a page and a file of their own tests.
LEFT_OUT = {"reproduce", "explore", "report", "table"}


def told(capsys, *words):
    with pytest.raises(SystemExit) as stop:
        main(list(words))
    assert stop.value.code == 0
    return capsys.readouterr().out


def in_plain_words(text):
    assert [word for word in THEORY if word in text] == []
    assert text.strip()
    assert max(map(len, text.splitlines())) <= 80


def test_no_verb_is_forgotten():
    assert set(cli.commands) == {*VERBS, *ASKED_OTHERWISE, *LEFT_OUT}


@pytest.mark.long(but=1)
@pytest.mark.parametrize("verb", VERBS)
def test_a_rig_is_told_no_symbols(capsys, verb, tmp_path):
    words = VERBS[verb]
    if words[-1] == "--table":
        words = (*words, str(tmp_path / "gains.csv"))
        grid = ("--speed", "140:150:2 rpm", "--rop", "15:25:2 m/h", "--structure", "pd")
        told(capsys, "table", "--rig", "table1", *grid, "--trials", "none", "--out", words[-1])
    in_plain_words(told(capsys, verb, *RIG, *words))


@pytest.mark.parametrize("verb", ASKED_OTHERWISE)
def test_the_answer_comes_first(capsys, verb):
    words, begins = ASKED_OTHERWISE[verb]
    text = told(capsys, verb, *words)
    in_plain_words(text)
    assert text.startswith(begins)


@pytest.mark.long(but=1)
@pytest.mark.parametrize(
    ("verb", "theory"),
    [("analyze", "argument principle"), ("design", "argument principle"), ("bit", "Re H")],
)
def test_theory_stands_behind_verbose(capsys, verb, theory):
    short, whole = (told(capsys, verb, *RIG, *VERBS[verb], *more) for more in ((), ("--verbose",)))
    assert theory in whole
    assert theory not in short
    assert verb == "bit" or "α = " in whole
    # Nothing is lost, nothing said otherwise.
    assert set(short.splitlines()) <= set(whole.splitlines())


def test_json_is_the_same(capsys):
    one, two = (
        json.loads(told(capsys, "analyze", *RIG, *more, "--json")) for more in ((), ("--verbose",))
    )
    one.pop("elapsed_seconds", None), two.pop("elapsed_seconds", None)
    assert one == two


def test_a_point_without_a_rig_keeps_its_symbols(capsys):
    assert "δ0" in told(capsys, "analyze", "--delta0", "2.5")
