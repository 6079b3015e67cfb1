"""What a rig is told speaks a driller's words; theory stands behind --verbose."""

from __future__ import annotations

import json

import pytest

from drillctrl.cli import main

RIG = ("--rig", "table1", "--speed", "150 rpm", "--rop", "20 m/h")
THEORY = ("ψ", "α", "ω0", "δ0", "τ0", "Clarke", "vouch", "ρ(D)", "argument principle")
VERBS = {
    "analyze": ("--structure", "pd", "--K1", "-2 kN*m/rad,-400 N*m*s/rad"),
    "design": ("--structure", "p", "--trials", "none"),
    "simulate": ("--duration", "2 s"),
    "chart": ("--x", "speed=100:200 rpm", "--y", "rop=10:30 m/h"),
    "compare": ("--structures", "p"),
    "map": ("--x", "speed=140:150:2 rpm", "--y", "rop=10:20:2 m/h", "--refine", "0",
            "--starts", "small", "--duration", "2 s", "--workers", "1"),
}  # fmt: skip


def told(capsys, *words):
    with pytest.raises(SystemExit) as stop:
        main(list(words))
    assert stop.value.code == 0
    return capsys.readouterr().out


@pytest.mark.parametrize("verb", VERBS)
def test_a_rig_is_told_no_symbols(capsys, verb):
    text = told(capsys, verb, *RIG, *VERBS[verb])
    assert [word for word in THEORY if word in text] == []
    assert text.strip()


@pytest.mark.parametrize("verb", ["analyze", "design"])
def test_theory_stands_behind_verbose(capsys, verb):
    short, whole = (told(capsys, verb, *RIG, *VERBS[verb], *more) for more in ((), ("--verbose",)))
    assert "argument principle" in whole
    assert "α = " in whole
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
