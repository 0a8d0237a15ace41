"""Every form of recipe that is read, with bytes changed and with values no one meant: only errors of flagdata come out,
and nothing takes long."""

from __future__ import annotations

import json
import sys
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

from flagdata.documents import NESTING_LIMIT
from flagdata.errors import CorruptError, FlagdataError, InputError, LimitError
from flagdata.ingest.anemometer.recipe import parse as parse_sensor
from flagdata.recipes import parsed
from measure.cases.recipe import parse_case
from measure.challenge.recipe import parse as parse_challenge
from measure.closing.toml import dumps
from measure.nulls import bank
from measure.observe.recipe import load as load_experiment
from models.training.recipe import parse as parse_training
from sim.arcsim import read_material, read_scene
from sim.datasets.reading import parse as parse_dataset
from sim.material import Material
from sim.render.prior import read as read_prior
from sim.run.reading import parse as parse_scene

sys.path.insert(0, str(Path(__file__).parents[1]))
from damage import QUICK, changed, damaged, damages, paths, wild

CATALOGS = Path(__file__).parents[2] / "catalogs"
SECONDS = 5.0
"""Within which a recipe is read or refused: none takes more than a tenth of one alone."""

EXPERIMENT = """
title = "Flags"
[cloth]
width = 1.5
height = 1.0
vertices = 200
[pins]
at = "hoist-corners"
[air]
density = 1.2
gravity = 9.81
[material]
name = "camel-ponte-roma"
[test]
level = 0.03
nulls = 20
[[recording]]
source = "one"
rate = 25.0
wind = { speed = 4.0 }
"""

TRAINING = """
title = "small"
seed = 1
[data]
dataset = ["made", "other"]
sequences = 4
[input]
maps = "wave-maps"
size = 24
frames = 12
scales = [1.0, 0.9]
mirror = true
variants = 2
[network]
name = "wave"
dimension = 4
widths = [6, 6, 6]
strides = [2, 2, 2]
[loss]
name = "posterior"
targets = ["wind_speed"]
components = 2
[optimiser]
rate = 1e-2
decay = 1e-4
batch = 4
epochs = 3
schedule = "cosine"
clip-norm = 5.0
patience = 9
"""


def experiment(text: str, folder: Path) -> object:
    path = folder / "experiment.toml"
    path.write_text(text)
    return load_experiment(path)


def first(folder: str) -> str:
    return min((CATALOGS / folder).glob("*.toml")).read_text()


FORMS: dict[str, tuple[str, Callable[[str, Path], object]]] = {
    "sensor": (first("sensors"), lambda text, _: parse_sensor(text, where="recipe")),
    "scene": (
        first("scenes"), lambda text, folder: parse_scene(text, name="recipe", folder=folder, where="recipe")
    ),
    "data set": (
        first("datasets"), lambda text, folder: parse_dataset(text, name="recipe", folder=folder, where="recipe")
    ),
    "challenge": (first("challenges"), lambda text, _: parse_challenge(text, where="recipe")),
    "case": (first("cases"), lambda text, _: parse_case(text, where="recipe")),
    "material": (
        first("materials"), lambda text, _: Material.from_mapping(parsed(text, where="recipe"), name="recipe")
    ),
    "render prior": (first("renders"), lambda text, _: read_prior(parsed(text, where="recipe"), name="recipe")),
    "experiment": (EXPERIMENT, experiment),
    "training": (TRAINING, lambda text, _: parse_training(text, name="recipe", where="recipe").check()),
}  # fmt: skip


def within(seconds: float, work: Callable[[], object]) -> None:
    """Do the work, which may end in an error of flagdata only, in time."""
    begun = time.perf_counter()
    with suppress(FlagdataError):
        work()
    assert time.perf_counter() - begun < seconds


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
    read(dumps_nested(content), tmp_path)  # sound before it is changed
    known = paths(content)

    @QUICK
    @given(path=st.sampled_from(known), value=wild)
    def law(path: tuple[Any, ...], value: Any) -> None:
        with suppress(InputError):  # a value that TOML has no form for
            other = dumps_nested(changed(content, path, value))
            within(SECONDS, lambda: read(other, tmp_path))

    law()


def dumps_nested(content: dict[str, Any]) -> str:
    """TOML with all tables in line, so that they may lie in lists."""
    return "".join(f"{json.dumps(key)} = {inline_value(value)}\n" for key, value in content.items())


def inline_value(value: Any) -> str:
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(key)} = {inline_value(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(inline_value(inner) for inner in value) + "]"
    return dumps({"x": value}).removeprefix("x = ").strip()


@pytest.mark.parametrize("deep", [NESTING_LIMIT + 1, 1000, 100_000])
def test_lists_that_are_nested_too_deep_are_refused_by_the_limit(deep: int) -> None:
    with pytest.raises(LimitError, match=f"more than {NESTING_LIMIT} deep"):
        parsed("x = " + "[" * deep + "]" * deep, where="recipe")


def test_tables_that_are_nested_too_deep_are_refused_by_the_limit() -> None:
    with pytest.raises(LimitError, match=f"more than {NESTING_LIMIT} deep"):
        parsed("[" + ".".join(["a"] * 1000) + "]", where="recipe")


def test_a_whole_number_of_thousands_of_digits_is_refused() -> None:
    with pytest.raises(InputError, match="not TOML"):
        parsed("x = " + "9" * 5000, where="recipe")


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
        {"columns": 10**9}, {"frames": 10**9}, {"count": 10**29}, {"batch": 10**9}, {"settle": 1e12},
        {"width": "1e-9\nheight = 1.0"}, {"columns": 900, "frames": 100_000}, {"columns": 1300},
    ],
)  # fmt: skip
def test_what_no_machine_can_simulate_is_refused_with_the_limit_that_was_passed(
    asked: dict[str, Any], tmp_path: Path
) -> None:
    read = FORMS["scene"][1]
    read(SCENE.format(**USUAL), tmp_path)
    text = SCENE.format(**{**USUAL, **asked})
    with pytest.raises(LimitError, match=r"at most \d+"):
        read(text, tmp_path)


@pytest.mark.parametrize("name", ["scene.json", "material.json"])
def test_a_damaged_arcsim_file_is_read_or_refused(name: str, tmp_path: Path) -> None:
    documents: dict[str, Any] = {
        "scene.json": {
            "frame_time": 0.04, "frame_steps": 8, "end_time": 1, "cloths": [{"mesh": "m.obj", "materials": [{}]}],
            "gravity": [0, 0, -9.8], "wind": {"velocity": [1, 0, 0]}, "magic": {"repulsion_thickness": 5e-3},
        },
        "material.json": {"density": 0.2, "stretching": [[1, 0, 1, 1]] * 6, "bending": [[1e-5] * 5] * 3},
    }  # fmt: skip
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


def arrays() -> dict[str, np.ndarray]:
    """The arrays of a batch of two segments, by their names; of other columns than this version's."""
    rows = np.zeros((2, 3))
    return {
        **dict.fromkeys(bank._SEGMENTS, rows), "recording": np.arange(2), "columns": np.array(["a", "b"]),
        "cloth": np.array(["x", "y"]), "duration": np.array(1.0), "anchors_told": np.array(True),
        "version": np.array(bank._VERSION),
    }  # fmt: skip


def test_a_damaged_bank_of_nulls_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
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


def test_a_bank_of_an_earlier_version_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bank, "names", lambda: ("a", "b"))
    np.savez(tmp_path / "nulls-0000.npz", **arrays() | {"version": np.array(bank._VERSION - 1)})
    with pytest.raises(CorruptError, match=r"another version.*build the bank again"):
        bank._content(tmp_path / "nulls-0000.npz")


@pytest.mark.parametrize("name", sorted(arrays()))
@pytest.mark.parametrize("values", [np.zeros(0), np.array("x"), np.zeros((5, 1)), np.array([None, None]), None])
def test_a_bank_whose_arrays_do_not_fit_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, values: np.ndarray | None
) -> None:
    monkeypatch.setattr(bank, "names", lambda: ("a", "b"))
    made = {key: array for key, array in {**arrays(), name: values}.items() if array is not None}
    np.savez(tmp_path / "nulls-0000.npz", **made)
    with pytest.raises(CorruptError):
        bank._content(tmp_path / "nulls-0000.npz")
