"""The look-up of recipes: by name in the catalog, by path in the user's files; what is not there is
refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from flagdata.cli import NAMES
from flagdata.core.parts import attribute
from flagdata.errors import FlagdataError, InputError, NotFoundError, UnknownNameError
from flagdata.recipes.shelves import Shelf, parse_recipe
from tests.program import invoke

ROOT = Path(__file__).resolve().parents[3]
SENSORS = Shelf(folder="sensors", noun="sensor recipe")


def test_a_name_is_the_file_of_that_name_in_the_catalog() -> None:
    found = SENSORS.find("generic-csv")
    assert found.data == (ROOT / "catalogs" / "sensors" / "generic-csv.toml").read_bytes()
    assert (found.name, found.folder, found.where) == (
        "generic-csv",
        Path(),
        "sensor recipe 'generic-csv'",
    )


@pytest.mark.parametrize("kind", ["datasets", "sensors"])
def test_the_catalog_prints_a_recipe_that_can_be_copied(kind: str, tmp_path: Path) -> None:
    shelf = attribute(NAMES[kind][0])
    for name in shelf.names():
        copy = tmp_path / f"{name}.toml"
        copy.write_text(invoke("catalog", kind, name).out)
        assert parse_recipe(shelf.find(str(copy)).text, where="") == parse_recipe(
            shelf.named(name).text, where=""
        )
    assert invoke("catalog", kind, "generic-csw").code == 2


def test_every_file_of_a_folder_has_a_name_and_can_be_found_by_it() -> None:
    for folder in ("datasets", "materials", "renders", "scenes", "sensors"):
        shelf = Shelf(folder=folder, noun="recipe")
        stems = sorted(path.stem for path in (ROOT / "catalogs" / folder).glob("*.toml"))
        assert list(shelf.names()) == stems
        assert [shelf.named(name).name for name in stems] == stems


def test_a_path_is_the_users_file_and_its_folder_is_where_its_own_paths_begin(
    tmp_path: Path,
) -> None:
    file = tmp_path / "generic-csv.toml"  # as one of the catalog: a path is never taken for a name
    file.write_bytes("title = 'Zürich'\r\n".encode())
    found = SENSORS.find(str(file))
    assert (found.name, found.folder, found.where) == ("generic-csv", tmp_path, str(file))
    assert found.text == "title = 'Zürich'\r\n"
    assert parse_recipe(found.text, where=found.where) == {"title": "Zürich"}


def test_an_unknown_name_suggests_the_nearest_and_says_where_it_stands() -> None:
    with pytest.raises(
        UnknownNameError, match=r"unknown sensor recipe 'generic-cvs'; did you mean 'generic-csv'\?"
    ):
        SENSORS.find("generic-cvs")
    with pytest.raises(UnknownNameError, match=r"mast\.toml: unknown sensor recipe"):
        SENSORS.named("generic-cvs", where="mast.toml")


def test_a_name_far_from_all_lists_those_there_are() -> None:
    with pytest.raises(UnknownNameError, match="known: clothsim, clothsim-wide, field, flagsim"):
        Shelf(folder="datasets", noun="data set").find("zzz")


@pytest.mark.parametrize(
    ("content", "error", "says"),
    [
        (None, NotFoundError, "no such recipe file"),
        (b"title = '\xff'", InputError, "not UTF-8"),
        (b"title = ", InputError, "not TOML"),
    ],
)
def test_a_file_that_is_not_there_or_no_recipe_is_refused_by_its_path(
    tmp_path: Path, content: bytes | None, error: type[FlagdataError], says: str
) -> None:
    file = tmp_path / "mine.toml"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(error, match=says) as refused:
        _read(str(file))
    assert refused.value.where == str(file)


def _read(source: str) -> dict[str, Any]:
    found = SENSORS.find(source)
    return parse_recipe(found.text, where=found.where)
