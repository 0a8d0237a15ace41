"""Tables of measured cloths: what they say, and what is refused before a film is read."""

from __future__ import annotations

from pathlib import Path

import pytest

from flagdata.errors import InputError, NotFoundError, UnknownNameError
from flagdata.ingest import read_cloths
from tests.refusals import unrefused

HEADING = "film,fabric,area_weight,bending_stiffness,wind_level,wind_speed,wind_sigma"
ROWS = (
    "a.mp4,Faux Fur,0.39,2.1e-5,W1,,",
    "b.mp4,Faux Fur,0.39,2.1e-5,W2,,",
    "c.mp4,silk,0.05,,,2.4,0.3",
)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in "abc":
        (tmp_path / f"{name}.mp4").write_bytes(b"a film")
    return tmp_path


def written(folder: Path, *lines: str) -> Path:
    path = folder / "cloths.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_each_row_is_a_film_with_its_cloths_properties(folder: Path) -> None:
    first, second, third = read_cloths(written(folder, HEADING, *ROWS))
    assert (first.film, first.fabric, first.area_weight) == (folder / "a.mp4", "Faux Fur", 0.39)
    assert first.parameters == {
        "fabric": "Faux Fur",
        "area_weight": 0.39,
        "bending_stiffness": 2.1e-5,
        "wind_level": "W1",
    }
    assert second.wind_level == "W2"
    assert second.wind is None
    assert third.parameters == {"fabric": "silk", "area_weight": 0.05}
    assert third.wind == (2.4, 0.3)


@pytest.mark.parametrize("delimiter", [";", "\t"])
def test_the_delimiter_and_a_byte_order_mark_change_nothing(folder: Path, delimiter: str) -> None:
    plain = read_cloths(written(folder, HEADING, *ROWS))
    marked = "\ufeff" + HEADING.replace(",", delimiter)
    assert (
        read_cloths(written(folder, marked, "", *(row.replace(",", delimiter) for row in ROWS)))
        == plain
    )


def test_a_row_that_does_not_fit_is_refused_with_its_line(folder: Path) -> None:
    cases = [
        ("a.mp4,silk,50,,,,", InputError, "kg/m²"),  # g/m² taken for kg/m²
        ("a.mp4,silk,,,,,", InputError, "area_weight"),
        ("a.mp4,silk,heavy,,,,", InputError, "area_weight"),
        ("a.mp4,silk,0.05,-1,,,", InputError, "bending_stiffness"),
        ("a.mp4,silk,0.05,nan,,,", InputError, "bending_stiffness"),
        ("a.mp4,silk,0.05,,,2.4,", InputError, "uncertainty"),
        ("a.mp4,silk,0.05,,,2.4,0", InputError, "uncertainty"),
        ("a.mp4,silk,0.05", InputError, "cells"),
        ("gone.mp4,silk,0.05,,,,", NotFoundError, "gone.mp4"),
        ("b.mp4,Faux Fur,0.39,2.1e-5,W2,,", InputError, "twice"),
        ("c.mp4,Faux Fur,0.40,2.1e-5,W3,,", InputError, "Faux Fur"),
    ]
    assert not unrefused(
        lambda row: read_cloths(written(folder, HEADING, *ROWS[:2], row)), cases, where="line 4"
    )


def test_a_misspelt_column_is_named_with_the_nearest(folder: Path) -> None:
    with pytest.raises(UnknownNameError, match="area_weight"):
        read_cloths(written(folder, "film,fabric,area_wieght", "a.mp4,silk,0.05"))


def test_missing_and_doubled_columns_are_refused(folder: Path) -> None:
    cases = ["film,fabric", "film,fabric,area_weight,area_weight"]
    assert (
        unrefused(
            lambda heading: read_cloths(written(folder, heading, "a.mp4,silk")),
            zip(cases),
            InputError,
            r"area_weight|twice",
        )
        == []
    )


def test_a_table_without_rows_and_one_that_is_not_there_are_errors(folder: Path) -> None:
    with pytest.raises(InputError, match="no rows"):
        read_cloths(written(folder, HEADING))
    with pytest.raises(NotFoundError):
        read_cloths(folder / "none.csv")
