"""A small text is the same text in every encoding that states itself, and with every kind of line
end."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.ingest import is_marker_table, read_cloths, read_json, read_obj, read_table
from flagdata.recipes.shelves import parse_recipe, read_recipe

Bytes = Callable[[str], bytes]
SAVED: dict[str, Bytes] = {
    "LF": str.encode,
    "CR LF": lambda text: text.replace("\n", "\r\n").encode(),
    "CR": lambda text: text.replace("\n", "\r").encode(),
    "byte-order mark": lambda text: text.replace("\n", "\r\n").encode("utf-8-sig"),
    "UTF-16": lambda text: text.replace("\n", "\r\n").encode("utf-16"),
    "UTF-16 of the other order": lambda text: b"\xfe\xff" + text.encode("utf-16-be"),
    "UTF-32": lambda text: text.encode("utf-32"),
}
"""How programs save a text."""


def spreadsheets(text: str) -> str:
    """A table as a spreadsheet of a country with decimal commas saves it."""
    return text.replace(",", ";").replace(".", ",").replace("film,mp4", "film.mp4")


TABLES: dict[str, Bytes] = {
    **SAVED,
    "semicolons": lambda text: spreadsheets(text).replace("\n", "\r\n").encode("utf-8-sig"),
    "its delimiter named": lambda text: f"sep=;\r\n{spreadsheets(text)}".encode(),
    "tabs": lambda text: text.replace(",", "\t").replace("\n", "\r\n").encode("utf-16"),
    "quotes": lambda text: (
        '"' + text.rstrip("\n").replace(",", '","').replace("\n", '"\n"') + '"'
    ).encode(),
}
CLOTHS = "film,fabric,area_weight,bending_stiffness,wind_speed,wind_sigma\nfilm.mp4,felt,0.24,3.5e-5,2.4,0.3\n"
MARKERS = "marker,u,v,x,y,z,time\n" + "".join(
    f"m{marker},{marker / 2},0.25,{marker / 10 + frame / 100:.2f},0.5,1.5,{frame * 0.04:.2f}\n"
    for frame in range(3)
    for marker in range(2)
)


@pytest.mark.parametrize("saved", SAVED)
def test_a_recipe_is_read_however_it_was_saved(tmp_path: Path, saved: str) -> None:
    path = tmp_path / "mast.toml"
    path.write_bytes(SAVED[saved]('name = "mast"\nabout = "Böen, 風"\n'))
    assert parse_recipe(read_recipe(path).text, where="mast") == {
        "name": "mast",
        "about": "Böen, 風",
    }


@pytest.mark.parametrize(
    "data", ['about = "Böe"'.encode("cp1252"), 'about = "Böe"'.encode("utf-16-le")]
)
def test_a_recipe_of_an_encoding_that_states_nothing_is_refused_with_what_to_do(
    tmp_path: Path, data: bytes
) -> None:
    path = tmp_path / "mast.toml"
    path.write_bytes(b"\n\n" + data)
    with pytest.raises(InputError) as refused:
        parse_recipe(read_recipe(path).text, where="mast")
    assert "line 3" in refused.value.what
    assert refused.value.fix


@pytest.mark.parametrize("saved", TABLES)
def test_a_table_of_cloths_is_read_however_it_was_saved(tmp_path: Path, saved: str) -> None:
    (tmp_path / "film.mp4").write_bytes(b"a film")
    path = tmp_path / "cloths.csv"
    path.write_bytes(TABLES[saved](CLOTHS))
    (one,) = read_cloths(path)
    assert (one.film.name, one.fabric, one.area_weight, one.bending_stiffness) == (
        "film.mp4",
        "felt",
        0.24,
        3.5e-5,
    )
    assert one.wind == (2.4, 0.3)


@pytest.mark.parametrize("ends", [",,\n", ",\n\n,,,\n"])
def test_blank_cells_and_rows_that_a_spreadsheet_leaves_are_none(tmp_path: Path, ends: str) -> None:
    (tmp_path / "film.mp4").write_bytes(b"a film")
    path = tmp_path / "cloths.csv"
    path.write_text(CLOTHS.replace("\n", ends), encoding="utf-8")
    assert [one.area_weight for one in read_cloths(path)] == [0.24]


def test_a_comma_that_may_be_decimal_or_of_thousands_is_refused(tmp_path: Path) -> None:
    (tmp_path / "film.mp4").write_bytes(b"a film")
    path = tmp_path / "cloths.csv"
    path.write_text('film,fabric,area_weight\nfilm.mp4,felt,"0,24"\n', encoding="utf-8")
    with pytest.raises(InputError, match="'0,24'"):
        read_cloths(path)


@pytest.mark.parametrize("saved", TABLES)
def test_a_marker_table_is_read_however_it_was_saved(tmp_path: Path, saved: str) -> None:
    path = tmp_path / "markers.csv"
    path.write_bytes(TABLES[saved](MARKERS))
    assert is_marker_table(path)
    (sequence,) = read_table(path).values()
    assert np.allclose(sequence.positions[:, 1, 0], [0.1, 0.11, 0.12])


def test_a_byte_order_mark_hides_neither_the_first_vertex_nor_a_scene(tmp_path: Path) -> None:
    mesh, scene = tmp_path / "0000_00.obj", tmp_path / "conf.json"
    mesh.write_text("v 1 2 3\nv 0 1 0\nv 0 0 1\nf 1 2 3\n", encoding="utf-8-sig")
    scene.write_text('{"frame_time": 0.04}', encoding="utf-8-sig")
    assert read_obj(mesh).positions[0].tolist() == [1.0, 2.0, 3.0]
    assert read_json(scene) == {"frame_time": 0.04}
