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
    Colour,
    Dots,
    Line,
    Note,
    Panel,
    Shade,
)
from flagdata.errors import InputError
from flagdata.pages.chart_drawing import check_format, encode, png, svg
from flagdata.pages.render import text_of

ALL = [
    Line(x=[0, 1], y=[0, 1], label="a line", marker="o"),
    Band(x=[0, 1], low=[0, 0], high=[1, 2]),
    Dots(x=[0, 1], y=[1, 2], low=[0, -np.inf], high=[2, 3], hollow=[True, False]),
    Bins(edges=[0, 1, 2], heights=[3, 4]),
    Across(x=0.5, dashed=True),
    Shade(y=(0.2, 0.4)),
    Note(x=0.1, y=0.1, text="a < b"),
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
    assert png(_chart(*ALL)) == png(_chart(*ALL))


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
    picture = np.asarray(Image.open(io.BytesIO(png(_chart(bars)))).convert("RGB")).astype(int)
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
    with pytest.raises(InputError, match="no picture of format '.xyz'"):
        check_format(tmp_path / "a.xyz")
