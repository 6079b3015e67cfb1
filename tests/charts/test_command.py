"""`drillctrl chart`: JSON for programs, words for people, figures, refusals."""

import json

import numpy as np
import pytest

from drillctrl import OperatingPoint, chart
from drillctrl.charts.figure import plot_charts
from drillctrl.cli import main

POINT = OperatingPoint(omega0=10.0, delta0=1.75, psi=14.0)


def run(capsys, *arguments):
    """Return status, standard output and standard error."""
    with pytest.raises(SystemExit) as stop:
        main([str(argument) for argument in arguments])
    out, err = capsys.readouterr()
    return stop.value.code, out, err


def test_json_holds_the_contract(capsys, tmp_path):
    saved = tmp_path / "chart.json"
    status, out, err = run(
        capsys, "chart", "--x", "omega0=0:25", "--y", "delta0=0:15", "--json", "--out", saved
    )
    assert (status, err) == (0, "")
    fields = json.loads(out)
    assert fields["stable_area"] == pytest.approx(22.8, abs=0.05)
    assert fields["method"] == "delay"
    assert fields["elapsed_seconds"] > 0.0
    assert np.array(fields["boundaries"][0]).shape[1] == 2
    details = fields["boundary_details"][0]
    assert len(details["omega"]) == len(fields["boundaries"][0])
    assert all(region["confirmed"] for region in fields["regions"])
    assert saved.read_text() == out


def test_summary_and_figure_in_rig_units(capsys, tmp_path):
    figure = tmp_path / "chart.png"
    status, out, _ = run(
        capsys,
        *("chart", "--rig", "table1", "--speed", "120 rpm", "--rop", "20 m/h"),
        *("--x", "speed=60:240 rpm", "--y", "rop=0:40 m/h", "--plot", figure),
    )
    assert status == 0
    assert "rotary speed, rpm" in out
    assert "±" in out
    assert figure.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("--x", "omega0"), "--x"),
        (("--x", "omega0=1:2 rpm"), "omega0"),
        (("--x", "speed=1:200 rpm"), "axis"),
        (("--structure", "case1"), "K1"),
        (("--level", "nan"), "level"),
        (("--plot", "chart.bmp"), "plot"),
        (("--out", "chart.csv"), "--out"),
    ],
)
def test_refusals_are_one_line(capsys, arguments, named):
    status, out, err = run(capsys, "chart", *arguments)
    assert status == 2
    assert out == ""
    assert err.count("\n") == 1
    assert named in err


def test_the_picture_shows_boundary_frequency_counts_and_units():
    drawn = chart(POINT, ("omega0", 0.0, 25.0), ("delta0", 0.0, 5.0))
    ax = drawn.plot()
    assert "omega_0" in ax.get_xlabel()
    boundary = ax.collections[0]
    assert len(boundary.get_segments()) == sum(len(c.points) - 1 for c in drawn.curves)
    assert boundary.get_array().max() == pytest.approx(
        max(curve.omega.max() for curve in drawn.curves)
    )
    assert {text.get_text() for text in ax.texts} >= {"2"}
    assert "unstable roots" in ax.get_legend().get_title().get_text()


def test_charts_compare_on_one_axes():
    axes = ("omega0", 0.5, 25.0), ("delta0", 0.0, 15.0)
    charts = {"open loop": chart(POINT, *axes), "p": chart(POINT, *axes, "p", [-1.55])}
    labels = [text.get_text() for text in plot_charts(charts).get_legend().get_texts()]
    assert len(labels) == 2
    assert labels[0].startswith("open loop (area 22.8")
