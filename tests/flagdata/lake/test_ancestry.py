"""Lineages: all generations up and down, as text, document and picture; many of a kind are
counted."""

from __future__ import annotations

import io
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from pathlib import Path

import pyarrow as pa
import pytest
from PIL import Image

from flagdata.commands.looking import _lines
from flagdata.core.printable import printable
from flagdata.core.schema import catalog_schema
from flagdata.lake import Lake
from flagdata.lake.ancestry import ancestry
from flagdata.pages import COLOURS, picture
from flagdata.pages.graph import PAPER, RULE, Box, svg
from flagdata.pages.graph_png import _ascii, png
from tests.flagdata.lake.conftest import put_text
from tests.program import Run, invoke

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture
def run(lake: Lake, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Runs `flagdata ...` on the lake."""
    monkeypatch.setenv("FLAGDATA_LAKE", str(lake.path))
    return lambda *arguments: invoke(*arguments)


def rows(
    parents: Mapping[str, Sequence[str]], *, names: Mapping[str, str] | None = None
) -> pa.Table:
    """Rows of a catalog: id → parents; of the kind "wind", named as their id."""
    values = {
        "kind": "wind",
        "branch": "main",
        "recipe_hash": "f" * 64,
        "code_version": "1",
        "format_version": 3,
        "created": 0,
        "quality": [],
    }
    return pa.Table.from_pylist(
        [
            {**values, "artifact": one, "name": (names or {}).get(one, one), "parents": p}
            for one, p in parents.items()
        ],
        schema=catalog_schema(),
    )


def test_generations_count_the_longest_way_and_leave_out_what_is_neither_above_nor_below() -> None:
    found = ancestry(
        rows(
            {
                "camera": [],
                "wind": [],
                "recording": ["camera", "wind"],
                "clip": ["recording"],
                "other": ["wind"],
                "measure": ["camera", "recording"],
                "model": ["measure"],
            }
        ),
        "measure",
    )
    assert {one.artifact: one.generation for one in found.relatives.values()} == {
        "camera": -2,
        "wind": -2,
        "recording": -1,
        "measure": 0,
        "model": 1,
    }
    assert set(found.edges) == {
        ("camera", "measure"),
        ("recording", "measure"),
        ("camera", "recording"),
        ("wind", "recording"),
        ("measure", "model"),
    }


def test_a_circle_in_a_damaged_catalog_and_a_parent_that_is_not_there_end_the_search() -> None:
    found = ancestry(rows({"a": ["b"], "b": ["a", "lost"]}), "a")
    assert set(found.relatives) == {"a", "b", "lost"}
    assert found.relatives["lost"].kind is None
    assert any("lost not at this version" in line for line in _lines(found, details=False, most=8))
    ET.fromstring(picture(found))


def test_the_tree_shows_each_relative_once_with_what_belongs_to_it(run: Run, lake: Lake) -> None:
    mast = put_text(lake, "mast")
    first = put_text(lake, "first", parents=(mast.id,))
    second = put_text(lake, "second", parents=(mast.id,))
    last = put_text(lake, "last", parents=(first.id, second.id))
    assert run("lineage", "last").out.splitlines() == [
        f"{last.id[:12]} wind last",
        "made from",
        f"├─ {first.id[:12]} wind first",
        f"│  └─ {mast.id[:12]} wind mast",
        f"└─ {second.id[:12]} wind second",
        f"   └─ {mast.id[:12]} wind mast (see above)",
        "made into no other artifact",
    ]
    details = run("lineage", mast.id, "--details").out.splitlines()[0]
    assert (
        details
        == f"{mast.id[:12]} wind mast  (recipe {mast.recipe_hash[:12]}, code {mast.code_version})"
    )
    document = run("lineage", mast.id, "--json").document
    assert [relative["name"] for relative in document["relatives"]] == [
        "mast",
        "first",
        "second",
        "last",
    ]
    assert [last.id, mast.id] not in document["edges"]
    assert [first.id, last.id] in document["edges"]
    assert run("lineage", "absent").code == 1


def test_many_of_a_kind_are_counted_and_their_own_parents_still_shown() -> None:
    many = {f"film{number}": ["mast"] for number in range(9)}
    found = ancestry(rows({"mast": [], **many, "network": list(many)}), "network")
    assert list(_lines(found, details=False, most=8)) == [
        "network wind network",
        "made from",
        "└─ 9 × wind (--all lists them)",
        "   └─ mast wind mast",
        "made into no other artifact",
    ]
    assert len(list(_lines(found, details=False, most=None))) == 3 + 9 * 2
    drawn = picture(found)
    assert "9 × wind" in drawn
    assert drawn.count('class="edge"') == 2
    assert picture(found, most=None).count('class="edge"') == 18


def test_a_name_moves_no_cursor_and_adds_no_element() -> None:
    found = ancestry(rows({"a": []}, names={"a": "\x1b[2J\u202e<script>x</script>"}), "a")
    (line, *_) = _lines(found, details=False, most=8)
    assert line == "a wind \\x1b[2J\\u202e<script>x</script>"
    drawn = picture(found)
    assert not list(ET.fromstring(drawn).iter(f"{SVG}script"))
    assert not {"\x1b", "\u202e"}.intersection(drawn)
    assert printable("caf\udce9") == "caf\\udce9"


def test_boxes_of_a_picture_are_apart_and_lines_that_pass_a_column_cross_none() -> None:
    columns = {"a": 0, "b": 0, "c": 0, "d": 1, "e": 1, "f": 2, "g": 3, "h": 3}
    edges = [
        ("a", "d"),
        ("b", "d"),
        ("c", "g"),
        ("a", "h"),
        ("d", "f"),
        ("e", "f"),
        ("f", "g"),
        ("b", "h"),
    ]
    boxes = [
        Box(
            key=key,
            column=column,
            kind="wind",
            title=key * 40,
            lines=["w"],
            about=key,
            link=f"/{key}",
        )
        for key, column in columns.items()
    ]
    whole = ET.fromstring(svg(boxes, edges, title="t"))
    assert [link.get("href") for link in whole.iter(f"{SVG}a")] == [f"/{key}" for key in columns]
    frames = [
        (
            float(r.get("x", "")),
            float(r.get("y", "")),
            float(r.get("width", "")),
            float(r.get("height", "")),
        )
        for r in whole.iter(f"{SVG}rect")
        if "box" in r.get("class", "")
    ]
    assert len(frames) == len(columns)
    for number, (x, y, width, height) in enumerate(frames):
        for other_x, other_y, *_ in frames[number + 1 :]:
            assert abs(x - other_x) >= width or abs(y - other_y) >= height
    level = [  # the straight parts, which lie in a column: from x, y, to x
        (float(before.split()[-2]), float(before.split()[-1]))
        for path in whole.iter(f"{SVG}path")
        for before in path.get("d", "").split(" H")[0:1]
        if "H" in path.get("d", "")
    ]
    assert len(level) == 3
    for x, y in level:
        assert all(frame[0] != x or not frame[1] <= y <= frame[1] + frame[3] for frame in frames)


def test_a_png_writes_names_in_letters_that_its_font_has() -> None:
    assert _ascii("115 × café über …") == "115 x cafe uber ..."
    assert _ascii("旗 σ") == "? ?"


def test_a_png_shows_the_boxes_and_lines_of_the_svg() -> None:
    columns = {"one": 0, "other": 0, "between": 1, "last": 2}
    edges = [("one", "between"), ("between", "last"), ("other", "last")]  # the last passes a column
    boxes = [
        Box(key=key, column=column, kind="wind", title=key, lines=["w"], about=key)
        for key, column in columns.items()
    ]
    whole = ET.fromstring(svg(boxes, edges, title="t"))
    picture = Image.open(io.BytesIO(png(boxes, edges))).convert("RGB")
    assert picture.size == (2 * int(whole.get("width", "")), 2 * int(whole.get("height", "")))

    def pixel(x: float, y: float) -> str:
        found = picture.getpixel((round(2 * x), round(2 * y)))
        assert isinstance(found, tuple)
        return "#{:02x}{:02x}{:02x}".format(*map(int, found))

    bars = [rect for rect in whole.iter(f"{SVG}rect") if rect.get("fill") not in (PAPER, None)]
    assert len(bars) == len(columns)
    for bar in bars:
        x, y, width, height = (float(bar.get(name, "")) for name in ("x", "y", "width", "height"))
        assert pixel(x + width / 2, y + height / 2) == bar.get("fill") == COLOURS["wind"]
    paths = [path.get("d", "") for path in whole.iter(f"{SVG}path")]
    for path in paths:
        x, y = (float(number.lstrip("M")) for number in path.split()[:2])
        assert pixel(x + 2, y) == RULE
    (passing,) = [path for path in paths if "H" in path]
    x, y = passing.split(" H")[0].split()[-2:]
    assert pixel(float(x) + 50, float(y)) == RULE


@pytest.mark.parametrize(("name", "begin"), [("l.svg", b"<svg"), ("l.png", b"\x89PNG")])
def test_a_picture_is_written_as_svg_or_png_and_on_top_of_nothing(
    run: Run, lake: Lake, tmp_path: Path, name: str, begin: bytes
) -> None:
    put_text(lake, "mast")
    assert run("lineage", "mast", "--picture", tmp_path / name).code == 0
    assert (tmp_path / name).read_bytes().startswith(begin)
    assert run("lineage", "mast", "--picture", tmp_path / name).code == 1
    assert run("lineage", "mast", "--picture", tmp_path / "l.jpg").code == 2
