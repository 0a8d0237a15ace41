"""Charts are drawn in the page's colours, each mark where its data are."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from flagdata.answer.charts import (
    SERIES,
    Across,
    Axis,
    Band,
    Bars,
    Bins,
    Cells,
    Chart,
    Cloud,
    Colour,
    Dots,
    Line,
    Note,
    Panel,
    Shade,
)
from flagdata.errors import InputError
from flagdata.pages import chart_drawing
from flagdata.pages.chart_drawing import check_format, encode, svg
from flagdata.pages.render import text_of

PNG = Path("a.png")
ALL = [
    Line(x=[0, 1], y=[0, 1], label="a line", marker="o"),
    Band(x=[0, 1], low=[0, 0], high=[1, 2]),
    Dots(x=[0, 1], y=[1, 2], low=[0, -np.inf], high=[2, 3], hollow=[True, False]),
    Bins(edges=[0, 1, 2], heights=[3, 4]),
    Across(x=0.5, dashed=True),
    Shade(y=(0.2, 0.4)),
    Note(x=0.1, y=0.1, text="a < b"),
    Cloud(x=[0, 1], y=[0, 1], values=[3, 4], label="wind [m/s]"),
]


def _chart(*marks: object, x: Axis | None = None) -> Chart:
    return Chart(rows=[[Panel(marks=marks, x=x or Axis(label="wind [m/s]"))]])  # type: ignore[arg-type]


def test_each_colour_is_the_pages_with_a_value_where_there_is_no_page() -> None:
    drawn = svg(
        _chart(*(Line(x=[0, 1], y=[n, n], colour=c) for n, c in enumerate(Colour))), name="c"
    )
    style = text_of("flagdata.pages", "base.css")
    for colour in Colour:
        assert re.search(rf"var\(--{colour.value}, #[0-9a-f]{{6}}\)", drawn), colour
        assert len(re.findall(rf"--{colour.value}:", style)) == 2, "in a light and a dark page"
    assert len(SERIES) == 10


def test_texts_are_text_and_escaped_and_ids_are_the_charts_own() -> None:
    drawn = svg(_chart(*ALL), name="one")
    assert "wind [m/s]" in drawn
    assert "a line" in drawn
    assert "a &lt; b" in drawn
    ids = re.findall(r'\bid="([^"]+)"', drawn)
    assert ids
    assert all(one.startswith("one-") for one in ids)
    assert set(re.findall(r"url\(#([^)]+)\)", drawn)) <= set(ids)


def test_a_chart_is_drawn_alike_each_time() -> None:
    assert svg(_chart(*ALL), name="x") == svg(_chart(*ALL), name="x")
    assert encode(_chart(*ALL), PNG) == encode(_chart(*ALL), PNG)


def test_an_interval_without_an_end_has_a_triangle_at_the_end_that_is_known() -> None:
    bounded = Dots(x=[0.0], y=[1.0], low=[0.5], high=[1.5])
    open_end = Dots(x=[0.0], y=[1.0], low=[0.5], high=[np.inf])
    plain = Dots(x=[0.0], y=[1.0])
    counts = [svg(_chart(mark), name="x").count("<path") for mark in (plain, bounded, open_end)]
    assert counts[1] > counts[0]
    assert counts[2] > counts[0]
    assert svg(_chart(bounded), name="x") != svg(_chart(open_end), name="x")


def test_bars_stand_from_the_top_in_order_with_their_names_and_texts() -> None:
    bars = Bars(names=["upper", "lower"], lengths=[1.0, 3.0], texts=["100 %", "300 %"])
    drawn = svg(_chart(bars), name="b")
    y = {
        name: float(re.search(rf">{name}<|{name}</text>", drawn).start())  # type: ignore[union-attr]
        for name in ("upper", "lower")
    }
    assert set(y) == {"upper", "lower"}
    assert "300 %" in drawn
    picture = np.asarray(Image.open(io.BytesIO(encode(_chart(bars), PNG))).convert("RGB")).astype(
        int
    )
    blue = (picture[..., 2] - picture[..., 0]) > 60
    half = picture.shape[0] // 2
    assert blue[half:].sum() > 2 * blue[:half].sum(), "the longer bar is the lower one"


@pytest.mark.parametrize("triangles", [(), [[0, 1, 2]]])
def test_cells_are_a_grid_or_triangles_around_zero(triangles: list[list[int]]) -> None:
    values = np.array([2.0]) if triangles else np.array([[-1.0, 2.0]])
    cells = Cells(
        values=values,
        x=[0, 1, 3],
        y=[0, 0, 1],
        triangles=triangles,
        diverging=True,
        label="error [m]",
    )
    assert "error [m]" in svg(_chart(cells), name="c")


def test_a_logarithmic_axis_names_plain_numbers() -> None:
    drawn = svg(
        _chart(Line(x=[1, 1000], y=[0, 1]), x=Axis(logarithmic=True, ticks=[1, 30, 1000])), name="l"
    )
    assert all(f">{text}<" in drawn for text in ("1", "30", "1,000"))


def test_a_file_has_the_format_of_its_name(tmp_path: Path) -> None:
    assert encode(_chart(*ALL), tmp_path / "a.png").startswith(b"\x89PNG")
    assert encode(_chart(*ALL), tmp_path / "a.pdf").startswith(b"%PDF")
    with pytest.raises(InputError, match=r"no picture of format '\.xyz'"):
        check_format(tmp_path / "a.xyz")


def test_a_wide_chart_is_scrolled_on_a_telephone_and_a_narrow_one_is_read_there() -> None:
    wide, narrow = (
        svg(Chart(rows=[[Panel(marks=[Line(x=[0, 1], y=[0, 1])])]], width=width), name="a")
        for width in (9.2, 5.6)
    )
    assert 'class="wide"' in wide.partition(">")[0]
    assert "class=" not in narrow.partition(">")[0]


def test_panels_below_each_other_begin_at_the_same_place_whatever_their_ticks_are_called() -> None:
    panels = [
        Panel(marks=[Line(x=[0, 1], y=[0, 1])], y=Axis(ticks=[0, 1], texts=texts))
        for texts in (["0", "1"], ["nothing at all", "everything"])
    ]
    drawn = chart_drawing._draw(Chart(rows=[[panel] for panel in panels]))
    drawn.canvas.draw()
    first, second = (axes.get_position() for axes in drawn.axes)
    assert first.x0 == pytest.approx(second.x0)


def test_a_legend_has_as_many_columns_as_its_texts_leave_room_for() -> None:
    def columns(*labels: str) -> int:
        marks = [Line(x=[0, 1], y=[0, 1], label=label) for label in labels]
        drawn = chart_drawing._draw(Chart(rows=[[Panel(marks=marks)]], width=5.6))
        return drawn.legends[0]._ncols  # type: ignore[attr-defined]

    assert columns("a", "b", "c") == 3
    assert columns("the ground truth of all clips, by the minute", "a", "b") == 1
