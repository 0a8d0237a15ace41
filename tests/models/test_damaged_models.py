"""Training recipes with absurd numbers and models' cards with values no one meant: only errors of
flagdata come out, at once and before memory is taken."""

from __future__ import annotations

import json
import shutil
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from flagdata.core.files.checksums import write_sums
from flagdata.errors import CorruptError, InputError, LimitError
from models.trained import estimator
from models.trained.estimator import CLOUD
from models.trained.model_folder import CARD, read_tensors, write_tensors
from models.training import TrainingRecipe, checkpoint, parse
from tests.damage import QUICK, changed, paths, wild
from tests.refusals import unrefused
from tests.small import TRAINING
from tests.studies.hostile.models import IDENTITY, WORDS, standing, write_checkpoint, write_model

SECONDS = 5.0
"""Within which a card is read or refused: none takes more than a tenth of one alone."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model of one member and its cloud, without checksums."""
    made = tmp_path_factory.mktemp("damaged") / "small"
    write_model(made)
    return made


def read(text: str) -> TrainingRecipe:
    made = parse(text, name="small", where="test")
    made.check()
    return made


def test_the_small_model_and_recipe_are_whole(folder: Path, tmp_path: Path) -> None:
    copy = Path(shutil.copytree(folder, tmp_path / "small"))
    write_sums(copy)
    assert estimator.load(copy).name == "small"
    assert read(TRAINING).optimiser.batch == 4


@QUICK
@given(path=st.sampled_from(paths(WORDS)), value=wild)
def test_a_card_with_another_value_is_read_or_refused(
    folder: Path, tmp_path_factory: pytest.TempPathFactory, path: tuple[Any, ...], value: Any
) -> None:
    copy = Path(shutil.copytree(folder, tmp_path_factory.mktemp("card") / "small"))
    content = {"format": "flagdata.network/1", **changed(WORDS, path, value)}
    (copy / CARD).write_text(
        json.dumps(content)
    )  # numbers that are not finite, as Python's JSON writes them
    write_sums(copy)
    began = time.process_time()
    with suppress(CorruptError):
        estimator.load(copy)
    assert time.process_time() - began < SECONDS


def test_absurd_numbers_of_a_training_recipe_are_refused_before_any_work() -> None:
    cases = [
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
    ]
    assert not unrefused(lambda old, new: read(TRAINING.replace(old, new)), cases)


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
def test_absurd_numbers_of_a_card_are_refused(
    folder: Path, tmp_path: Path, path: tuple[Any, ...], value: Any
) -> None:
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
def test_weights_that_are_not_finite_are_refused(
    folder: Path, tmp_path: Path, value: float
) -> None:
    copy = Path(shutil.copytree(folder, tmp_path / "small"))
    write_tensors(copy / CLOUD, {"centre": torch.full((4,), value)})
    write_sums(copy)
    with pytest.raises(CorruptError, match="not finite"):
        estimator.load(copy)


def checkpoint_with(folder: Path, path: tuple[Any, ...], value: Any) -> Path:
    """A checkpoint with another value in its card, its checksums made anew."""
    write_checkpoint(folder / "run")
    card = folder / "run" / "last" / CARD
    card.write_text(json.dumps(changed(json.loads(card.read_text()), path, value)))
    write_sums(card.parent)
    return folder / "run"


EPOCH = {"number": 0, "train": 1.0, "validation": 1.0, "rate": 0.1, "seconds": 1.0, "clips": 4}


def test_the_checkpoint_is_whole(tmp_path: Path) -> None:
    taken = standing()
    assert checkpoint.restore(
        checkpoint_with(tmp_path, ("course",), [EPOCH]), taken, identity=IDENTITY
    )
    assert taken.course.as_list() == [EPOCH]
    assert taken.optimiser.state_dict()["state"]


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("identity",), ["small"]),
        (("running",), "aa"),
        (("running",), []),
        (("batches",), 3),
        (("course",), [1]),
        (("course",), [{**EPOCH, "validation": "low"}]),
        (("course",), [{**EPOCH, "train": 10**400}]),
        (("course",), [{**EPOCH, "more": 1}]),
    ],
)
def test_absurd_values_of_a_checkpoint_are_refused(
    tmp_path: Path, path: tuple[Any, ...], value: Any
) -> None:
    run = checkpoint_with(tmp_path, path, value)
    with pytest.raises(CorruptError):
        checkpoint.restore(run, standing(), identity=IDENTITY)


@pytest.mark.parametrize("file", ["weights.safetensors", "moments.safetensors", "best.safetensors"])
def test_tensors_of_another_shape_are_refused_when_the_checkpoint_is_read(
    tmp_path: Path, file: str
) -> None:
    write_checkpoint(tmp_path)
    path = tmp_path / "last" / file
    tensors = read_tensors(path)
    write_tensors(
        path,
        {**tensors, next(name for name in tensors if tensors[name].ndim): torch.zeros(1, 2, 3)},
    )
    write_sums(path.parent)
    with pytest.raises(CorruptError, match="does not fit its recipe"):
        checkpoint.restore(tmp_path, standing(), identity=IDENTITY)
