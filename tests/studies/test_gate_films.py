"""The films that a gate is calibrated on and those that decide where it refuses share no
simulation."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from flagdata.core.schema import Kind
from flagdata.errors import InputError, RefusedError
from flagdata.lake import Artifact, Lake
from models.trained import estimator
from models.training import DataSpec
from tests.models.conftest import fill
from tests.studies.gate import FilmsOf, rate_of


def lake_of(path: Path, sides: dict[str, Artifact]) -> DataSpec:
    """A lake with one film, and its clip, on each side: side → the sequence that it is of."""
    lake = Lake.create(path)
    with lake.transaction("films") as transaction:
        for seed, (side, sequence) in enumerate(sides.items()):
            film = Artifact(
                kind=Kind.RECORDING,
                name=f"o'brien-{side}-00000",
                parents=(sequence.id,),
                seed=seed,
                dataset="o'brien",
                side=side,
            )
            transaction.add(sequence)
            transaction.add(film)
            transaction.add(replace(film, kind=Kind.CLIP, parents=(film.id,), recording=film.id))
    return DataSpec(datasets=("o'brien",))


def test_sides_that_share_a_sequence_are_refused(tmp_path: Path) -> None:
    sequence = Artifact(kind=Kind.MESHES, name="flag", seed=1)
    data = lake_of(tmp_path / "lake", {"train": sequence, "validation": sequence})
    for side in ("train", "validation"):
        with pytest.raises(
            RefusedError, match=f"meshes {sequence.id} is in train and in validation"
        ):
            FilmsOf(tmp_path / "lake", data, side)


def test_a_side_has_its_own_films(tmp_path: Path) -> None:
    own = {
        side: Artifact(kind=Kind.MESHES, name=side, recipe={"of": side})
        for side in ("train", "validation")
    }
    data = lake_of(tmp_path / "lake", own)
    assert FilmsOf(tmp_path / "lake", data, "validation").names == ("o'brien-validation-00000",)
    with pytest.raises(InputError, match="no films of the test side"):
        FilmsOf(tmp_path / "lake", data, "test")


def test_films_of_a_network_of_conditioned_films_are_conditioned_and_shown_at_its_rate(
    tmp_path: Path,
) -> None:
    """14 frames at 30 Hz are 0.433 s: 11 pictures at 25 Hz, of 300 px, as they are measured."""
    fill(Lake.create(tmp_path / "lake"), period=33_333_333)
    data = DataSpec(datasets=("made",))
    assert FilmsOf(tmp_path / "lake", data, "validation")[0].shape == (14, 40, 48)
    assert FilmsOf(tmp_path / "lake", data, "validation", rate=25.0)[0].shape == (11, 300, 300)
    plain = estimator.load_shipped("flow")
    assert rate_of(plain) is None
    assert rate_of(replace(plain, cropping=replace(plain.cropping, conditioned=True))) == 25.0
