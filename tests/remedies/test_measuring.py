"""Remedies of `flagdata measure`: films that are written here, looked at by a small model that was
not trained."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flagdata.core.arrays import UInt8Array
from flagdata.core.schema import Kind
from flagdata.dataset import clip_rows
from flagdata.lake import Artifact, Lake
from flagdata.record import Record
from tests.measure.estimate.conftest import TARGETS, pictures, write_video, written
from tests.remedies.user import User

SIZED = ("--flag-size", "1.5x1.0")
WIND = "wind"


@pytest.fixture(scope="session")
def models(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a model of flags and one of hanging cloth."""
    folder = tmp_path_factory.mktemp("models")
    written(folder / "model", TARGETS)
    written(folder / "cloth", ("cloth_wind", "cloth_area_weight", "cloth_bending"))
    return folder


@pytest.fixture
def command(user: User, models: Path) -> tuple[str, ...]:
    """Measures the film f.mkv by the model."""
    write_video(user.folder / "f.mkv", pictures(48, height=40, width=56))
    return ("measure", "f.mkv", "--model", str(models / "model"))


def beside(left: UInt8Array, right: UInt8Array) -> UInt8Array:
    return np.concatenate([left, right], axis=2)


def cut(user: User, film: str) -> str:
    """Ingest a film; the id of the one clip that is made of it."""
    user.succeeds("ingest", film, "--start", "2026-05-01T12:00:00Z")
    lake = Lake.open("lake")
    recording = lake.artifact(film.partition(".")[0])
    clips = clip_rows(Record.open(lake.object_path(str(recording.object))), recording, frames=40)
    with lake.transaction("clips") as transaction:
        transaction.add(clips[0])
    return clips[0].id


def test_a_refinement_needs_the_size_of_the_flag(user: User) -> None:
    user.meets(
        "estimate/measuring_options.py",
        "give --flag-size, length along the wind",
        "measure",
        "second.mp4",
        "--refine",
        20,
    )
    user.again(*SIZED, code=1, shows="s of film, a measurement takes")


def test_a_weight_that_the_model_does_not_know_is_given_within_its_range(
    user: User, command: tuple[str, ...]
) -> None:
    user.meets(
        "estimate/measuring_options.py",
        ", and --flag-size",
        *command,
        "--area-weight",
        9,
        "--anyway",
    )
    user.follows(*command, *SIZED, "--area-weight", 0.12, "--anyway", shows=WIND)


def test_hanging_cloth_is_measured_without_simulating_flags(
    user: User, command: tuple[str, ...], models: Path
) -> None:
    cloth = ("measure", "f.mkv", "--model", str(models / "cloth"), *SIZED, "--anyway")
    user.meets("estimate/refined.py", "leave --refine out", *cloth, "--refine", 200)
    user.again(without="--refine", shows=WIND)


def test_a_size_that_was_not_given_is_given(user: User, command: tuple[str, ...]) -> None:
    user.meets("film/similarity.py", "give --flag-size LENGTHxHEIGHT", *command, "--anyway")
    user.again(*SIZED, shows=WIND)


def test_a_weight_that_only_some_sizes_allow_needs_the_size(
    user: User, command: tuple[str, ...]
) -> None:
    user.meets(
        "estimate/film_measuring.py",
        "give --flag-size LENGTHxHEIGHT",
        *command,
        "--area-weight",
        0.23,
        "--anyway",
    )
    user.again("--flag-size", "2.4x1.6", shows=WIND)


def test_a_slow_film_shows_a_flag_that_is_large(user: User, command: tuple[str, ...]) -> None:
    write_video(user.folder / "f.mkv", pictures(60, height=40, width=56), rate=12)
    user.meets("film/similarity.py", "give --flag-size if the ", *command, "--anyway")
    user.again("--flag-size", "9x6", shows=WIND)


def test_a_fabric_of_two_weights_is_given_by_its_weight(
    user: User, command: tuple[str, ...]
) -> None:
    with Lake.open("lake").transaction("declared") as transaction:
        for name, density in (("two", 0.12), ("three", 0.13)):
            cloth = {"cloth": {"fabric": "linen", "density": density}}
            transaction.add(
                Artifact(
                    kind=Kind.RECORDING, name=name, session="linen", recipe=cloth, frame_count=1
                )
            )
    given = (*command, *SIZED, "--anyway")
    user.meets("estimate/named_cloth.py", "give --area-weight", *given, "--material", "linen")
    user.follows(*given, "--area-weight", 0.12, shows=WIND)


def test_clips_that_are_all_strange_are_looked_at(user: User, command: tuple[str, ...]) -> None:
    noise = np.random.default_rng(1).integers(0, 256, size=(60, 40, 56)).astype(np.uint8)
    write_video(user.folder / "noise.mkv", noise)
    clip = cut(user, "noise.mkv")
    query = ("measure", "--query", "kind = 'clip'", *command[2:], *SIZED)
    fix = user.meets(
        "commands/measure.py", "look at one with --report, or at all with --anyway", *query
    )
    assert "--anyway" in fix
    user.again("--anyway", shows=WIND)
    user.follows("measure", clip, *command[2:], *SIZED, "--report", "page.html", code=3)
    assert (user.folder / "page.html").exists()


def test_several_clips_are_answered_as_json(user: User, command: tuple[str, ...]) -> None:
    clip = cut(user, "f.mkv")
    query = ("measure", "--query", "kind = 'clip'", *command[2:], *SIZED, "--anyway")
    user.meets("commands/measure.py", "measure one clip by its id, or use --json", *query, "--csv")
    user.follows(*query, "--json", shows=WIND)
    user.succeeds("measure", clip, *command[2:], *SIZED, "--anyway", "--csv", shows=WIND)


def test_a_part_between_two_cuts_is_chosen(user: User, command: tuple[str, ...]) -> None:
    scene = pictures(48, height=40, width=56)
    write_video(user.folder / "f.mkv", np.concatenate([scene, 255 - scene[:, ::-1]]))
    user.meets(
        "gate/reasons.py", "choose a part of the film between two such places", *command, *SIZED
    )
    user.again("--start", "0s", "--end", "1.8s", "--anyway", shows=WIND)


def test_one_of_several_flags_is_chosen(user: User, command: tuple[str, ...]) -> None:
    write_video(
        user.folder / "f.mkv",
        beside(pictures(48, height=40, width=56), pictures(48, height=40, width=56, seed=4)),
    )
    user.meets(
        "film/conditioned_film.py",
        "choose another by --flag, as numbered",
        *command,
        *SIZED,
        "--anyway",
    )
    user.succeeds(*command, *SIZED, "--anyway", "--report", "page.html")
    assert (user.folder / "page.html").exists()
    user.leaves(["--report"])
    user.follows(*command, *SIZED, "--anyway", "--flag", 2, shows=WIND)


def test_a_flag_that_is_longer_than_its_size_says_is_given_its_size(
    user: User, command: tuple[str, ...]
) -> None:
    given = ("measure", "example:flag", *command[2:], "--anyway")
    user.meets(
        "gate/reasons.py",
        "check --flag-size: length along the wind",
        *given,
        "--flag-size",
        "1.5x5",
    )
    user.follows(*given, *SIZED, shows=WIND)


def test_a_film_of_few_frames_a_second_shows_a_flag_of_its_size(
    user: User, command: tuple[str, ...]
) -> None:
    user.meets("film/similarity.py", "give --flag-size, or fil", *command, "--anyway")
    user.again(*SIZED, shows=WIND)


def test_another_film_is_observed_in_its_crop_where_nothing_moves(
    user: User, command: tuple[str, ...]
) -> None:
    still = np.repeat(pictures(1, height=40, width=56), 70, axis=0)
    write_video(user.folder / "f.mkv", still)
    user.meets("observables/watching.py", "give another film, or --", "observe", "f.mkv", *SIZED)
    write_video(user.folder / "other.mkv", pictures(70, height=40, width=56))
    ended = user.follows("observe", "other.mkv", *SIZED, "--crop", "0,0,40,40", code=3)
    assert "no motion like cloth's" not in ended.err


def test_a_flag_beside_another_is_chosen_where_the_film_is_refused(
    user: User, command: tuple[str, ...]
) -> None:
    noise = np.random.default_rng(1).integers(0, 256, size=(60, 40, 56)).astype(np.uint8)
    write_video(user.folder / "f.mkv", noise)
    user.meets("gate/reasons.py", "film so that the whole f", *command, *SIZED)
    write_video(
        user.folder / "f.mkv",
        beside(pictures(48, height=40, width=56), pictures(48, height=40, width=56, seed=4)),
    )
    ended = user.follows(*command, *SIZED, "--flag", 2, code=3)
    assert "outside the picture" not in ended.err
