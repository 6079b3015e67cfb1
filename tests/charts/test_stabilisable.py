"""What feedback can reach, against the search over gains and against sampled boxes."""

import json

import numpy as np
import pytest

from drillctrl import (
    InputError,
    OperatingPoint,
    analyze,
    chart,
    design,
    plant_system,
    preset_structure,
    stabilisable_chart,
)
from drillctrl.charts.decisions import Place, Searched, by_curves
from drillctrl.charts.figure import plot_charts
from drillctrl.charts.plane import make_plane
from drillctrl.charts.searched_scan import SearchedScan
from drillctrl.cli import main
from drillctrl.synthesis.family import loop_family
from drillctrl.synthesis.gain_margin import gain_margin

QUICK = {"first_lines": 3, "samples": 5, "tolerance": 1e-2}
POINT = OperatingPoint(omega0=10.0, delta0=1.75, psi=14.0)
SPEEDS = ("omega0", 8.0, 12.0)


NO_GAINS = preset_structure("p").with_bounds({"K1": (-1.0, -1.0)})


def margin_at(point, name):
    structure = preset_structure(name)
    return gain_margin(loop_family(plant_system(point), structure)), structure


@pytest.mark.long(but=1)
@pytest.mark.parametrize("name", ["p", "case1", "pd"])
def test_margin_agrees_with_the_search_over_gains(name):
    rng = np.random.default_rng(2)
    signs = []
    for omega0, delta0 in zip(rng.uniform(3.0, 25.0, 6), rng.uniform(0.2, 17.0, 6), strict=True):
        point = POINT.with_changes(omega0=omega0, delta0=delta0)
        best = design(point, name, trials=False).spectral_abscissa
        if abs(best) > 1e-3:
            assert (margin_at(point, name)[0].margin < 0.0) == (best < 0.0)
            signs.append(best < 0.0)
    assert signs


def test_best_gains_hold_a_root_on_the_line():
    found, _ = margin_at(POINT.with_changes(delta0=12.0), "case1")
    held = analyze(POINT.with_changes(delta0=12.0), "case1", *([g] for g in found.gains))
    assert held.spectral_abscissa == pytest.approx(0.0, abs=1e-9)
    assert found.margin < 0.0
    assert np.abs([root.imag for root in held.loop.dominant_roots]).max() == pytest.approx(
        found.omega, abs=1e-6
    )


@pytest.mark.long
def test_line_where_p_ceases_to_help_follows_from_the_tangency():
    drawn = stabilisable_chart(POINT, SPEEDS, ("delta0", 0.0, 15.0), "p", **QUICK)
    tops = [line.at[-1] for line in drawn.lines]
    assert max(tops) - min(tops) < 0.3
    for line in drawn.lines[::2]:
        top = line.at[-1]
        here = POINT.with_changes(omega0=line.position, delta0=top - 0.01)
        above = here.with_changes(delta0=top + 0.01)
        gains = np.linspace(-10.0, 10.0, 4001)
        for point, possible in ((here, True), (above, False)):
            family = loop_family(plant_system(point), preset_structure("p"))
            assert (family.abscissas(gains[:, None]).min() < 0.0) == possible


@pytest.mark.long
def test_chart_holds_the_open_loop_and_a_wider_box_holds_a_narrower_one():
    axes = SPEEDS, ("delta0", 0.0, 15.0)
    narrow = preset_structure("case1").with_bounds({"K1": (-2.0, 2.0), "K2": (-0.2, 0.2)})
    small = stabilisable_chart(POINT, *axes, narrow, **QUICK)
    large = stabilisable_chart(POINT, *axes, "p", **QUICK)
    assert small.open_loop.stable_area == pytest.approx(chart(POINT, *axes).stable_area)
    assert small.stable_area > 3.0 * small.open_loop.stable_area
    assert large.stable_area < small.stable_area
    assert small.area_ratio == pytest.approx(small.stable_area / small.open_loop.stable_area)
    drawn = plot_charts({"p": large, "narrow": small, "open": small.open_loop})
    texts = [text.get_text() for text in drawn.get_legend().get_texts()]
    assert len(texts) == 3
    assert all("area" in text for text in texts)


def test_low_speeds_are_said_to_be_undecided():
    drawn = stabilisable_chart(POINT, ("omega0", 0.0, 4.0), ("delta0", 0.0, 1.0), "p", **QUICK)
    assert drawn.undecided_area == pytest.approx(2.0 * np.pi / (4 * 6.3))
    assert "undecided" in drawn.summary()


@pytest.mark.long
def test_four_gains_reach_further_each_stable_place_proved():
    narrow = ("omega0", 9.9, 10.1), ("delta0", 0.0, 40.0)
    drawn = stabilisable_chart(POINT, *narrow, "case2", first_lines=3, samples=5, tolerance=0.05)
    tops = [line.at[-1] for line in drawn.lines]
    assert 19.0 < min(tops) <= max(tops) < 35.0
    # Searches of their own, below and above the edge.
    assert design(POINT.with_changes(delta0=min(tops) - 0.5), "case2", trials=False).stable
    assert not design(POINT.with_changes(delta0=max(tops) + 1.0), "case2", trials=False).stable
    stable = [place for place in drawn.places if place.stable]
    for place in stable[:: len(stable) // 5]:
        here = POINT.with_changes(omega0=place.x, delta0=place.y)
        found = analyze(here, "case2", *preset_structure("case2").gains(place.gains))
        assert found.stable
        assert found.spectral_abscissa == pytest.approx(place.margin, abs=1e-9)
    fields = json.loads(json.dumps(drawn.to_dict(), allow_nan=False))
    assert fields["method"] == "search and count"
    assert {place["decided_by"] for place in fields["places"]} == {"count", "search"}
    assert "no proof" in drawn.summary()


@pytest.mark.long
def test_four_gains_reach_a_band_of_depths_at_low_speed():
    axes = ("omega0", 2.9, 3.1), ("delta0", 2.0, 18.0)
    drawn = stabilisable_chart(POINT, *axes, "case2", first_lines=3, samples=5, tolerance=0.1)
    for line in drawn.lines:
        # Differential evolution finds α = -1.06 at 13.8, -0.85 at 15 and 0.333 at 3.
        ((low, high, _, _),) = line.stable_intervals
        assert 3.2 < low < 5.0
        assert high > 15.0


class Unreachable:
    """In the place of `Searched`: remembers where the whole box was searched, and finds nothing."""

    def __init__(self):
        self.asked = []

    def delay(self, x, y):
        return 1.0 / x

    def known(self, x, y, *, search):
        self.asked += [(x, y)] * search
        return Place(x, y, np.zeros(4), 1.0, stable=False)


@pytest.mark.parametrize(("low", "high", "together"), [(0.6, 0.75, True), (0.5, 25.0, False)])
def test_lines_that_are_alike_share_the_samples_that_are_searched(low, high, together):
    asked = Unreachable()
    SearchedScan(asked, 0.0, 7.0, 8, lambda: None)(np.linspace(low, high, 9))
    depths = [y for _, y in asked.asked]
    if together:
        # All samples, though none twice over but for the few lines that are far apart.
        assert set(depths) == set(range(8))
        assert len(depths) <= 12
    else:
        assert set(depths) == {0.0, 4.0}


def test_search_and_curves_agree():
    axes = ("omega0", 9.9, 10.1), ("delta0", 0.0, 15.0)
    plane = make_plane(POINT, *axes, None, None, None)
    structure = preset_structure("case1")
    searched, curves = Searched(plane, structure, 0.0), by_curves(plane, structure, 0.0)
    for y in (1.0, 6.0, 12.0, 13.5, 14.5):
        assert searched.known(10.0, y, search=True).stable == (curves(10.0, y, True).margin < 0.0)


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"structure": NO_GAINS}, "structure"),
        ({"samples": 1}, "samples"),
        ({"level": 1e9}, "level"),
    ],
)
def test_bad_input_is_named(options, named):
    with pytest.raises(InputError, match=named):
        stabilisable_chart(POINT, SPEEDS, ("delta0", 0.0, 15.0), **options)


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as stop:
        main([str(argument) for argument in arguments])
    out, err = capsys.readouterr()
    return stop.value.code, out, err


@pytest.mark.long
def test_command_line(capsys, tmp_path):
    figure = tmp_path / "reach.png"
    status, out, err = run(
        capsys,
        *("chart", "--optimise", "--structure", "p", "--x", "omega0=9:10", "--y", "delta0=0:4"),
        *("--bound", "K1=-3:0", "--json", "--plot", figure),
    )
    assert (status, err) == (0, "")
    fields = json.loads(out)
    assert fields["optimised"] is True
    assert fields["bounds"] == {"K1_1": [-3.0, 0.0]}
    assert fields["area_ratio"] == pytest.approx(fields["stable_area"] / fields["open_loop_area"])
    assert figure.stat().st_size > 10_000


@pytest.mark.parametrize(
    "arguments",
    [
        ("--optimise",),
        ("--optimise", "--structure", "p", "--K1", "-2"),
        ("--bound", "K1=-1:1"),
    ],
)
def test_command_line_refuses(capsys, arguments):
    status, out, err = run(capsys, "chart", *arguments)
    assert (status, out) == (2, "")
    assert err.count("\n") == 1
