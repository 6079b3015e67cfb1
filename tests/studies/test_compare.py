import base64
import csv
import dataclasses
import html.parser
import io
import json
import math

import control
import numpy as np
import pytest

from drillctrl import (
    InputError,
    OperatingPoint,
    analyze,
    cli,
    close_loop,
    compare,
    loop_frd,
    preset_structure,
    spectral_abscissa,
)
from drillctrl.robustness.loop_margins import loop_margins
from drillctrl.simulation.run import simulate
from drillctrl.simulation.summary import settling_time

PAPER = [
    ("paper p", "p", [-1.55], None),
    ("paper case1", "case1", [-1.981], [0.426]),
    ("paper case2", "case2", [-5.03, -4.91], [-1.67, -0.31]),
]


@pytest.fixture(scope="module")
def at_f():
    """Point F of the paper, without charts."""
    point = OperatingPoint(10.0, 12.0, 14.0)
    return compare(point, given=PAPER, region=None, duration=80.0, trials=False)


def row(comparison, label):
    return next(one for one in comparison.rows if one.label == label).to_dict()


@pytest.mark.long
def test_designs_at_f(at_f):
    assert row(at_f, "p")["spectral_abscissa"] == pytest.approx(0.0441, abs=1e-4)
    assert row(at_f, "case1")["spectral_abscissa"] == pytest.approx(-0.3698, abs=1e-4)
    assert row(at_f, "case2")["spectral_abscissa"] <= -2.244


def test_the_papers_gains_show_their_figures(at_f):
    """Fig. 13 as it was recomputed: the linear motion after x' = θ' = 1."""
    first, second = row(at_f, "paper case1"), row(at_f, "paper case2")
    assert first["max_abs_x"] == pytest.approx(33.47, abs=0.02)
    assert first["max_abs_u"] == pytest.approx(4.41, abs=0.01)
    assert second["max_abs_x"] == pytest.approx(2.71, abs=0.01)
    assert second["max_abs_u"] == pytest.approx(4.91, abs=0.01)
    assert row(at_f, "paper p")["max_abs_x"] is None


def test_rows_are_sorted_and_the_open_loop_is_among_them(at_f):
    values = [one.to_dict()["spectral_abscissa"] for one in at_f.rows]
    assert values == sorted(values)
    assert at_f.rows[-1].label == "none"


@pytest.mark.parametrize(
    ("name", "K1", "K2"),
    [("case1", [-1.981], [0.426]), ("case2", [-5.03, -4.91], [-1.67, -0.31]), ("pd", [-6, -4], 0)],
)
def test_margins_agree_with_python_control_and_with_the_spectrum(name, K1, K2):
    point = OperatingPoint(10.0, 12.0, 14.0)
    K2 = [0.0] * len(K1) if K2 == 0 else K2
    given = analyze(point, name, K1, K2)
    structure = preset_structure(name)
    margins = loop_margins(given.plant, structure, given.K1, given.K2)
    theirs = control.stability_margins(loop_frd(given.plant, structure, K1, K2), returnall=True)
    assert margins.phase == pytest.approx(np.abs(theirs[1]).min(), abs=1e-4)
    for factor in (margins.gain_up, margins.gain_down):
        if 0.0 < factor < math.inf:
            scaled = close_loop(
                given.plant, structure, factor * np.array(K1), factor * np.array(K2)
            )
            assert spectral_abscissa(scaled) == pytest.approx(0.0, abs=1e-8)
    assert margins.sensitivity >= 1.0 / (2.0 * math.sin(math.radians(margins.phase) / 2)) - 1e-6


def test_settling_time_of_a_decay_that_is_known(at_f):
    """The envelope falls to 2 % about when exp(αt) does."""
    run = simulate(OperatingPoint(10.0, 0.5, 14.0), duration=700.0, initial={"dx": 1e-3})
    found = settling_time(run)
    alpha = spectral_abscissa(analyze(OperatingPoint(10.0, 0.5, 14.0)).system())
    assert found == pytest.approx(math.log(50.0) / -alpha, rel=0.35)
    assert settling_time(run, 1e-9) is None
    # After that time nothing exceeds the band, just before it something does.
    motion = run.on_steps(9)
    for late, inside in ((motion.times >= found, True), (motion.times >= 0.97 * found, False)):
        below = all(
            np.abs(v[late]).max() <= 0.02 * np.abs(v).max() for v in (motion.x, motion.theta)
        )
        assert below == inside


def test_basin_ends_between_settling_and_not(at_f):
    fields = row(at_f, "case1")
    from drillctrl.studies.measures import respond

    design = next(one.result for one in at_f.rows if one.label == "case1")
    for factor, expected in ((0.98, True), (1.05, False)):
        size = factor * fields["basin"]
        found = respond(design, {"dx": size, "dtheta": size}, 120.0, "nonlinear")
        assert (found.settling_time is not None) == expected


def test_formation_change_ends_at_the_boundary(at_f):
    design = next(one.result for one in at_f.rows if one.label == "case2")
    change = row(at_f, "case2")["formation_change"]
    ends = []
    for sign in (-1, 1):
        point = design.point.with_changes(psi=design.point.psi * (1 + sign * change))
        ends.append(abs(analyze(point, "case2", design.K1, design.K2).spectral_abscissa))
    assert min(ends) < 1e-8


def test_every_form_holds_every_row(at_f):
    fields = at_f.to_dict()
    assert json.loads(json.dumps(fields, allow_nan=False)) == fields
    wanted = {
        "structure", "K1", "K2", "spectral_abscissa", "stability_radius", "max_abs_u",
        "settling_time", "stick_fraction",
    }  # fmt: skip
    assert all(wanted <= one.keys() for one in fields["rows"])
    lines = list(csv.DictReader(io.StringIO(at_f.to_csv())))
    assert [line["label"] for line in lines] == [one.label for one in at_f.rows]
    assert float(lines[0]["spectral_abscissa"]) == fields["rows"][0]["spectral_abscissa"]
    text = at_f.summary()
    best = min(at_f.rows, key=lambda one: row(at_f, one.label)["spectral_abscissa"])
    told = " ".join(text.split())
    assert told.startswith(f"{best.label} does best: with it small vibration dies away; it was not")
    assert all(one.label in text for one in at_f.rows)
    assert "stabilises the point, p does not" in told
    # Where no control comes first by what they are sorted by, nothing else is offered first.
    turned = dataclasses.replace(at_f, rows=at_f.rows[::-1])
    assert turned.summary().startswith("No control does better here")


class _Page(html.parser.HTMLParser):
    def __init__(self):
        super().__init__()
        self.open, self.images, self.links = [], [], []

    def handle_starttag(self, tag, attrs):
        if tag not in ("meta", "img"):
            self.open.append(tag)
        self.images += [v for k, v in attrs if tag == "img" and k == "src"]
        self.links += [v for k, v in attrs if k in ("href", "src") and not v.startswith("data:")]

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


@pytest.mark.long
def test_the_page_is_whole_and_needs_nothing_else(at_f):
    page = _Page()
    text = at_f.to_html()
    page.feed(text)
    assert not page.open
    assert not page.links
    assert len(page.images) == 5
    for image in page.images:
        assert base64.b64decode(image.partition(",")[2]).lstrip().startswith(b"<?xml")
    assert text == at_f.to_html()


@pytest.mark.long
def test_the_command(capsys, tmp_path):
    out = tmp_path / "rows.csv"
    with pytest.raises(SystemExit) as stop:
        cli.main(
            ["compare", "--structures", "p", "--given", "paper=case1:-5.17:5.06", "--no-charts",
             "--duration", "60", "--json", "--sort", "stability_radius", "--out", str(out)]
        )  # fmt: skip
    fields = json.loads(capsys.readouterr().out)
    assert stop.value.code == 0
    assert {one["label"] for one in fields["rows"]} == {"none", "p", "paper"}
    assert out.read_text().count("\n") == 4


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (["--sort", "beauty"], "sort = beauty"),
        (["--given", "mine"], "--given = mine"),
        (["--given", "mine=case1:x:1"], "--given"),
        (["--structures", "p,p"], "structures"),
        (["--structures", "q"], "structure = q"),
        (["--out", "report.doc"], "--out = report.doc"),
        (["--initial", "dx=0"], "disturbance"),
        (["--duration", "-1"], "duration = -1"),
    ],
)
def test_bad_input_is_refused_in_one_line(capsys, options, named):
    with pytest.raises(SystemExit) as stop:
        cli.main(["compare", "--no-charts", *options])
    captured = capsys.readouterr()
    assert (stop.value.code, captured.out) == (2, "")
    assert named in captured.err
    assert captured.err.count("\n") == 1


@pytest.mark.long
def test_charts_give_areas_and_ratios(point_c):
    found = compare(point_c, ["p"], duration=20.0)
    fields = {one.label: one.to_dict() for one in found.rows}
    assert fields["none"]["stable_area"] == pytest.approx(22.81, abs=0.05)
    assert fields["none"]["area_ratio"] == 1.0
    assert fields["p"]["area_ratio"] == pytest.approx(
        fields["p"]["stable_area"] / fields["none"]["stable_area"]
    )


def test_a_given_row_may_not_bear_the_name_of_another(point_c):
    with pytest.raises(InputError, match="structures"):
        compare(point_c, ["p"], given=[("p", "p", [-1.0], None)], region=None)


def test_a_bound_on_no_gain_is_refused():
    point = OperatingPoint(10.0, 12.0, 14.0)
    with pytest.raises(InputError, match="bound = theta_typo"):
        compare(point, ["p", "case1"], bounds={"theta_typo": (-1.0, 1.0)})
