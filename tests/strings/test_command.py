"""Real strings on the command line."""

import json

import pytest

from drillctrl import cli


def test_a_string_is_a_rig_like_any_other(capsys):
    point = ("--rig", "paper-string", "--speed", "180 rpm", "--rop", "5 m/h")
    with pytest.raises(SystemExit) as stop:
        cli.main(["analyze", *point, "--json"])
    assert stop.value.code == 0
    fields = json.loads(capsys.readouterr().out)
    # By the exact loop: no root right of the axis, and this one.
    assert fields["stable"]
    assert fields["spectral_abscissa"] == pytest.approx(-0.0257, abs=1e-3)
    assert fields["certificate"]["agrees"]
    assert fields["rig"]["parameters"]["torsional_stiffness"] == pytest.approx(938.096, abs=1e-3)
