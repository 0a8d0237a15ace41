"""An answer is one page that refers to no other, with all that it is made of."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from markupsafe import Markup

from flagdata.answer import (
    Answer,
    Array,
    Figure,
    Gallery,
    Head,
    Quantity,
    Section,
    Span,
    Table,
    Tone,
)
from flagdata.answer.charts import Chart, Line, Panel
from flagdata.core.findings import Finding
from flagdata.errors import ConflictError, UsageError

WIND = Quantity(
    name="wind_speed",
    unit="m/s",
    value=5.2,
    sigma=0.3,
    span=Span(low=4.8, high=5.6, level=0.9, bound=None, estimated=True),
)
CHART = Chart(rows=[[Panel(marks=[Line(x=[0, 1], y=[2, 3])])]])
FOUND = Finding.of("not-determined", "bending is <not> known", fix="give more recordings")


def _answer(sections: Sequence[Section] = ()) -> Answer:
    return Answer(
        question="measure",
        subject="clip <1>.mp4",
        sentence="The wind was 5.2 m/s.",
        tone=Tone.OPEN,
        quantities={"wind_speed": WIND},
        findings=[FOUND],
        head=Head(
            figures=[Figure(title="both winds", content=CHART, caption="film and log")],
            facts={"size": "1.5 × 1 m"},
            limits=["The clock is known to 2 s."],
        ),
        make_sections=lambda: sections,
        provenance={"seed": "7"},
    )


def test_a_page_holds_all_that_an_answer_is_made_of() -> None:
    parts = [
        "a <paragraph>",
        Table(
            columns=["quantity", "value"], rows=[["wind", WIND], ["none", None]], caption="below"
        ),
        Gallery(figures=[Figure(title="a frame", content="data:image/png;base64,AA", width=200)]),
        Markup("<b>as it is</b>"),
        [FOUND],
    ]
    page = _answer([Section(title="All", parts=parts, anchor="all")]).page
    for text in (
        "clip &lt;1&gt;.mp4",
        'class="verdict open"',
        "The wind was 5.2 m/s.",
        "1.5 × 1 m",
        "The clock is known to 2 s.",
        "a &lt;paragraph&gt;",
        "5.2 [4.8, 5.6] m/s, 90 %",
        'alt="a frame" src="data:image/png;base64,AA" width="200"',
        "<b>as it is</b>",
        "bending is &lt;not&gt; known",
        "give more recordings",
        'id="all"',
        'role="img" aria-label="both winds"',
        "film and log",
    ):
        assert text in page, text
    assert not re.search(r'(src|href)="(?!data:|#)', page), "it refers to no other file"


def test_a_folded_section_shows_its_heading_alone() -> None:
    page = _answer([Section(title="Details", parts=["hidden at first"], folded=True)]).page
    folded = re.search(r"<details[^>]*><summary>Details</summary>(.*?)</details>", page, re.DOTALL)
    assert folded is not None
    assert "hidden at first" in folded[1]


def test_two_charts_of_a_page_share_no_id() -> None:
    figures = [Figure(title=name, content=CHART) for name in ("one", "two")]
    ids = re.findall(r'\bid="([^"]+)"', _answer([Section(title="Charts", parts=figures)]).page)
    assert len(ids) == len(set(ids))


def test_a_figure_is_drawn_when_its_page_is_asked_for() -> None:
    drawn: list[str] = []

    def draw() -> Chart:
        drawn.append("now")
        return CHART

    answer = _answer([Section(title="Charts", parts=[Figure(title="one", content=draw)])])
    assert "5.2 [4.8, 5.6] m/s" in answer._repr_html_()
    assert drawn == []
    assert "<svg" in answer.page
    assert drawn == ["now"]


def test_a_page_is_saved_in_place_of_an_earlier_one_and_of_nothing_else(tmp_path: Path) -> None:
    target = tmp_path / "page.html"
    assert _answer().save(target) == target
    _answer([Section(title="More", parts=["text"])]).save(target)
    assert "More" in target.read_text()
    other = tmp_path / "other.html"
    other.write_text("mine")
    with pytest.raises(ConflictError):
        _answer().save(other)
    assert other.read_text() == "mine"


def test_the_arrays_that_are_saved_are_those_that_xarray_has(tmp_path: Path) -> None:
    xarray = pytest.importorskip("xarray")
    times = np.array(["2026-05-01T12:00:00", "2026-05-01T12:00:01.5"], dtype="datetime64[ns]")
    arrays = {
        "time": Array(dimensions=("window",), values=times, unit="", coordinate=True),
        "wind": Array(
            dimensions=("window",), values=np.array([np.nan, np.inf]), unit="m/s", about="its wind"
        ),
        "draws": Array(dimensions=("draw",), values=np.arange(3.0)),
    }
    answer = replace(_answer(), arrays=arrays, document={"wind": None})
    folder = answer.save_zarr(tmp_path / "answer.zarr")
    with xarray.open_zarr(folder, consolidated=False) as read:
        xarray.testing.assert_equal(read.load(), answer.to_xarray())
        assert read["wind"].attrs == {"units": "m/s", "long_name": "its wind"}
        assert read.attrs["document"] == {"wind": None}
    with pytest.raises(ConflictError):
        answer.save_zarr(folder)
    with pytest.raises(UsageError, match="no arrays"):
        _answer().save_zarr(tmp_path / "none.zarr")
    assert not (tmp_path / "none.zarr").exists()
