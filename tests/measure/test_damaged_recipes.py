"""Every form of recipe that is read, with bytes changed and with values no one meant: only errors
of flagdata come out, and nothing takes long."""

from __future__ import annotations

import json
import time
import tomllib
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flagdata.errors import CorruptError, FlagdataError, InputError, LimitError
from flagdata.recipes.documents import NESTING_LIMIT
from flagdata.recipes.shelves import parse_recipe
from measure.nulls import bank
from sim.arcsim import read_material, read_scene
from tests.damage import QUICK, as_toml, changed, damaged, damages, paths, wild
from tests.studies.hostile.models import arrays
from tests.studies.hostile.recipes import FORMS, MATERIAL_FILE, SCENE_FILE

SECONDS = 5.0
"""Within which a recipe is read or refused: none takes more than a tenth of one alone."""


def within(seconds: float, work: Callable[[], object]) -> None:
    """Do the work, which may end in an error of flagdata only, in time."""
    begun = time.process_time()
    with suppress(FlagdataError):
        work()
    assert time.process_time() - begun < seconds


@pytest.mark.parametrize("form", FORMS)
def test_a_recipe_with_changed_bytes_is_read_or_refused(form: str, tmp_path: Path) -> None:
    text, read = FORMS[form]
    read(text, tmp_path)  # sound before it is changed, and its modules imported

    @QUICK
    @given(damage=damages)
    def law(damage: list[tuple[str, float, int]]) -> None:
        other = damaged(text.encode(), damage).decode(errors="replace")
        within(SECONDS, lambda: read(other, tmp_path))

    law()


@pytest.mark.parametrize("form", FORMS)
def test_a_recipe_with_a_value_no_one_meant_is_read_or_refused(form: str, tmp_path: Path) -> None:
    text, read = FORMS[form]
    content = tomllib.loads(text)
    read(as_toml(content), tmp_path)  # sound before it is changed
    known = paths(content)

    @QUICK
    @given(path=st.sampled_from(known), value=wild)
    def law(path: tuple[Any, ...], value: Any) -> None:
        within(SECONDS, lambda: read(as_toml(changed(content, path, value)), tmp_path))

    law()


@pytest.mark.parametrize("deep", [NESTING_LIMIT + 1, 1000, 100_000])
def test_lists_that_are_nested_too_deep_are_refused_by_the_limit(deep: int) -> None:
    with pytest.raises(LimitError, match=f"more than {NESTING_LIMIT} deep"):
        parse_recipe("x = " + "[" * deep + "]" * deep, where="recipe")


def test_tables_that_are_nested_too_deep_are_refused_by_the_limit() -> None:
    with pytest.raises(LimitError, match=f"more than {NESTING_LIMIT} deep"):
        parse_recipe("[" + ".".join(["a"] * 1000) + "]", where="recipe")


def test_a_whole_number_of_thousands_of_digits_is_refused() -> None:
    with pytest.raises(InputError, match="not TOML"):
        parse_recipe("x = " + "9" * 5000, where="recipe")


SCENE = """
count = {count}
batch = {batch}
[scene]
columns = {columns}
width = {width}
[material]
name = "camel-ponte-roma"
[wind]
speed = 4.0
[time]
settle = {settle}
frames = {frames}
"""
USUAL = {"count": 4, "batch": 4, "columns": 30, "width": 1.5, "settle": 4.0, "frames": 60}


@pytest.mark.parametrize(
    "asked",
    [
        {"columns": 10**9},
        {"frames": 10**9},
        {"count": 10**29},
        {"batch": 10**9},
        {"settle": 1e12},
        {"width": "1e-9\nheight = 1.0"},
        {"columns": 900, "frames": 100_000},
        {"columns": 1300},
    ],
)
def test_what_no_machine_can_simulate_is_refused_with_the_limit_that_was_passed(
    asked: dict[str, Any], tmp_path: Path
) -> None:
    read = FORMS["scene"][1]
    read(SCENE.format(**USUAL), tmp_path)
    text = SCENE.format(**{**USUAL, **asked})
    with pytest.raises(LimitError, match=r"at most \d+"):
        read(text, tmp_path)


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ("area-weight-factor = 1e29", InputError),
        ("stretching-factor = 1e300", InputError),
        ("damping = 1e300", InputError),
        ("area-weight-factor = 1e-8", LimitError),
        ("stretching-factor = 1e9", LimitError),
    ],
)
def test_a_material_that_no_number_of_steps_can_simulate_is_refused_before_the_first(
    line: str, error: type[FlagdataError], tmp_path: Path
) -> None:
    text, read = FORMS["scene made ready"]
    with pytest.raises(error):
        read(text.replace("area-weight-factor = { low = 0.9, high = 1.1 }", line), tmp_path)


@pytest.mark.parametrize("name", ["scene.json", "material.json"])
def test_a_damaged_arcsim_file_is_read_or_refused(name: str, tmp_path: Path) -> None:
    documents: dict[str, Any] = {"scene.json": SCENE_FILE, "material.json": MATERIAL_FILE}
    content = documents[name]

    @QUICK
    @given(path=st.sampled_from(paths(content)), value=wild, damage=st.one_of(st.none(), damages))
    def law(path: tuple[Any, ...], value: Any, damage: list[tuple[str, float, int]] | None) -> None:
        data = json.dumps(changed(content, path, value)).encode()
        (tmp_path / name).write_bytes(data if damage is None else damaged(data, damage))
        reader = read_scene if name == "scene.json" else read_material
        within(SECONDS, lambda: reader(tmp_path / name))

    law()


def test_a_json_file_nested_without_end_is_refused(tmp_path: Path) -> None:
    (tmp_path / "scene.json").write_text("[" * 200_000)
    with pytest.raises(FlagdataError):
        read_scene(tmp_path / "scene.json")


def test_a_damaged_bank_of_nulls_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bank, "names", lambda: ("a", "b"))
    path = tmp_path / "nulls-0000.npz"
    np.savez_compressed(path, **arrays())
    assert set(bank._content(path)) == set(arrays())
    sound = path.read_bytes()

    @QUICK
    @given(damage=damages)
    def law(damage: list[tuple[str, float, int]]) -> None:
        path.write_bytes(damaged(sound, damage))
        with suppress(CorruptError, LimitError):
            content = bank._content(path)  # damage in what zip keeps twice
            for name, values in arrays().items():
                np.testing.assert_array_equal(content[name], values)

    law()


def test_a_bank_of_an_earlier_version_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bank, "names", lambda: ("a", "b"))
    np.savez(tmp_path / "nulls-0000.npz", **arrays() | {"version": np.array(bank._VERSION - 1)})
    with pytest.raises(CorruptError, match=r"another version.*build the bank again"):
        bank._content(tmp_path / "nulls-0000.npz")


def test_a_bank_whose_arrays_do_not_fit_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bank, "names", lambda: ("a", "b"))
    taken: list[tuple[str, np.ndarray | None]] = []
    for name in sorted(arrays()):
        for values in (np.zeros(0), np.array("x"), np.zeros((5, 1)), np.array([None, None]), None):
            made = {
                key: array for key, array in {**arrays(), name: values}.items() if array is not None
            }
            np.savez(tmp_path / "nulls-0000.npz", **made)
            with suppress(CorruptError):
                bank._content(tmp_path / "nulls-0000.npz")
                taken.append((name, values))
    assert taken == []
