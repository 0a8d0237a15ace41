"""Training recipes with absurd numbers and models' cards with values no one meant: only errors of flagdata come out, at
once and before memory is taken."""

from __future__ import annotations

import json
import shutil
import sys
import time
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from flagdata.checksums import write_sums
from flagdata.errors import CorruptError, FlagdataError, InputError, LimitError
from models import estimator
from models.crops import Cropping
from models.estimator import CLOUD
from models.frontend import FrontEnd
from models.learner import Loss, build
from models.outliers import Familiarity
from models.storage import CARD, WEIGHTS, write_card, write_tensors
from models.training.recipe import TrainingRecipe, parse
from tests.models.conftest import RECIPE

sys.path.insert(0, str(Path(__file__).parents[1]))
from damage import QUICK, changed, paths, wild

SECONDS = 5.0
"""Within which a card is read or refused: none takes more than a tenth of one alone."""
OPTIONS = {"dimension": 4, "widths": [4, 4, 4]}
WORDS: Any = {
    "name": "small", "seed": 1, "members": 1, "widening": [1.0],
    "front_end": asdict(FrontEnd(maps="wave-maps", size=24, frames=12)),
    "cropping": asdict(Cropping(frames=12, size=24)),
    "recipe": {
        "network": {"name": "wave", "options": OPTIONS},
        "loss": {"name": "posterior", "targets": ["wind_speed"], "components": 2, "margin": 1.0},
        "data": {"dataset": "made", "sequences": None},
    },
}  # fmt: skip


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model of one member and its cloud, without checksums."""
    made = tmp_path_factory.mktemp("damaged") / "small"
    made.mkdir()
    learner = build("wave", OPTIONS, loss=Loss.POSTERIOR, targets=("wind_speed",), components=2, margin=1.0)
    write_card(made, WORDS)
    write_tensors(made / WEIGHTS, {f"0.{name}": value for name, value in learner.state_dict().items()})
    cloud = Familiarity(centre=np.zeros(4), whitening=np.eye(4), reference=np.array([1.0, 2.0]))
    write_tensors(made / CLOUD, {name: torch.from_numpy(value) for name, value in cloud.arrays().items()})
    return made


def read(text: str) -> TrainingRecipe:
    made = parse(text, name="small", where="test")
    made.check()
    return made


def test_the_small_model_and_recipe_are_whole(folder: Path, tmp_path: Path) -> None:
    copy = Path(shutil.copytree(folder, tmp_path / "small"))
    write_sums(copy)
    assert estimator.load(copy).name == "small"
    assert read(RECIPE).optimiser.batch == 4


@QUICK
@given(path=st.sampled_from(paths(WORDS)), value=wild)
def test_a_card_with_another_value_is_read_or_refused(
    folder: Path, tmp_path_factory: pytest.TempPathFactory, path: tuple[Any, ...], value: Any
) -> None:
    copy = Path(shutil.copytree(folder, tmp_path_factory.mktemp("card") / "small"))
    content = {"format": "flagdata.network/1", **changed(WORDS, path, value)}
    (copy / CARD).write_text(json.dumps(content))  # numbers that are not finite, as Python's JSON writes them
    write_sums(copy)
    began = time.perf_counter()
    with suppress(CorruptError):
        estimator.load(copy)
    assert time.perf_counter() - began < SECONDS


@pytest.mark.parametrize(
    ("old", "new", "error"),
    [
        ("dimension = 4", "dimension = 1000000000000", LimitError),
        ("dimension = 4", "dimension = 0", InputError),
        ("dimension = 4", "dimension = true", InputError),
        ("dimension = 4", 'dimension = "4"', InputError),
        ("widths = [6, 6, 6]", "widths = [6, 6, 100000]", LimitError),
        ("widths = [6, 6, 6]", f"widths = {[6] * 1000}", LimitError),
        ("widths = [6, 6, 6]", "widths = [6, -6, 6]", InputError),
        ("rate = 1e-2", "rate = 1e300", InputError),
        ("decay = 1e-4", "decay = 1e300", InputError),
        ("size = 24", "size = 100000", LimitError),
        ("frames = 12", "frames = 100000", LimitError),
        ("variants = 2", "variants = 1000000", LimitError),
        ("components = 2", "components = 1000000000000", LimitError),
        ("scales = [1.0, 0.9]", "scales = [1e-300]", InputError),
        ("seed = 1", "seed = " + "[" * 200_000 + "]" * 200_000, LimitError),
    ],
)
def test_absurd_numbers_of_a_training_recipe_are_refused_before_any_work(
    old: str, new: str, error: type[FlagdataError]
) -> None:
    with pytest.raises(error):
        read(RECIPE.replace(old, new))


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("recipe", "network", "options", "dimension"), 10**12),
        (("recipe", "loss", "components"), 10**12),
        (("front_end", "temporal_sigma"), 1e308),
        (("front_end", "spatial_sigma"), 1e308),
        (("front_end", "frames"), 10**12),
        (("front_end", "rate"), 1e300),
        (("cropping", "size"), 10**12),
        (("widening",), [1e999]),
        (("widening",), [0.0]),
        (("widening",), [1.0, 1.0]),
        (("name",), None),
    ],
)
def test_absurd_numbers_of_a_card_are_refused(folder: Path, tmp_path: Path, path: tuple[Any, ...], value: Any) -> None:
    copy = Path(shutil.copytree(folder, tmp_path / "small"))
    content = changed(WORDS, path, value)
    if value is None:
        del content[path[0]]
    (copy / CARD).write_text(json.dumps({"format": "flagdata.network/1", **content}))
    write_sums(copy)
    with pytest.raises(CorruptError):
        estimator.load(copy)


def test_a_card_that_is_nested_without_end_is_refused(folder: Path, tmp_path: Path) -> None:
    copy = Path(shutil.copytree(folder, tmp_path / "small"))
    (copy / CARD).write_text('{"format":' + "[" * 200_000 + "]" * 200_000 + "}")
    write_sums(copy)
    with pytest.raises(CorruptError, match="more than 100 deep"):
        estimator.load(copy)


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_weights_that_are_not_finite_are_refused(folder: Path, tmp_path: Path, value: float) -> None:
    copy = Path(shutil.copytree(folder, tmp_path / "small"))
    write_tensors(copy / CLOUD, {"centre": torch.full((4,), value)})
    write_sums(copy)
    with pytest.raises(CorruptError, match="not finite"):
        estimator.load(copy)
