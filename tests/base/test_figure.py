"""Figures for journals, and the data of a figure as a table."""

import csv
import io
import re

import numpy as np
import pytest

from drillctrl import InputError
from drillctrl.base.figure import new_axes, new_figure, save_figure
from drillctrl.base.figure_data import figure_table


def drawn():
    ax = new_axes()
    ax.plot([1.0, 2.0], [3.0, 4.0], label="line")
    ax.scatter([5.0], [6.0], c=[7.0], label="point")
    mesh = ax.pcolormesh([0.0, 1.0], [0.0, 1.0], np.ma.masked_invalid([[1.0, np.nan], [2.0, 3.0]]),
                         shading="nearest")  # fmt: skip
    ax.figure.colorbar(mesh, ax=ax, label="a colour whose name is longer than a column, 1/s")
    ax.set_xlabel("time, s")
    ax.set_ylabel("speed, rpm")
    return ax


def test_all_that_is_drawn_is_in_the_table():
    rows = list(csv.DictReader(io.StringIO(figure_table(drawn()))))
    told = {(row["series"], float(row["x"]), float(row["y"]), row["value"]) for row in rows}
    assert {("line", 1.0, 3.0, ""), ("line", 2.0, 4.0, ""), ("point", 5.0, 6.0, "7.0")} <= told
    squares = {place for place in told if not place[0]}
    assert squares == {("", 0.0, 0.0, "1.0"), ("", 1.0, 0.0, ""), ("", 0.0, 1.0, "2.0"),
                       ("", 1.0, 1.0, "3.0")}  # fmt: skip
    assert {row["horizontal"] for row in rows} == {"time, s"}
    assert {row["panel"] for row in rows} == {"1"}


@pytest.mark.parametrize(("wide", "millimetres"), [(6.4, 88.0), (9.0, 180.0)])
def test_a_figure_of_a_journal_is_as_wide_as_its_columns(tmp_path, wide, millimetres):
    figure = new_figure(wide, 4.0)
    figure.add_subplot().set_xlabel("time, s")
    save_figure(figure, tmp_path / "f.svg", "journal")
    text = (tmp_path / "f.svg").read_text("utf-8")
    points = float(re.search(r"<svg [^>]*width=\"([\d.]+)pt\"", text)[1])
    assert points / 72.0 * 25.4 == pytest.approx(millimetres)
    # Texts stay texts, of 7 points.
    assert re.search(r"<text [^>]*style=\"[^\"]*7px", text)
    assert ">time, s<" in text


def test_no_label_is_longer_than_a_column(tmp_path):
    ax = drawn()
    save_figure(ax, tmp_path / "f.pdf", "journal")
    assert any("\n" in other.get_ylabel() for other in ax.figure.axes)
    width, _ = ax.figure.get_size_inches()
    renderer = ax.figure.canvas.get_renderer()
    ax.figure.draw(renderer)
    for other in ax.figure.axes:
        box = other.yaxis.label.get_window_extent(renderer)
        assert box.y0 >= 0.0
        assert box.y1 <= ax.figure.bbox.height
    assert width == pytest.approx(88.0 / 25.4)


def test_what_is_no_style_or_flat_is_refused(tmp_path):
    with pytest.raises(InputError, match="style"):
        save_figure(drawn(), tmp_path / "f.png", "poster")
    deep = new_figure(4.0, 4.0)
    deep.add_subplot(projection="3d")
    with pytest.raises(InputError, match="three dimensions"):
        save_figure(deep, tmp_path / "f.csv")
    assert not list(tmp_path.iterdir())
