"""Remedies of commands that measure, simulate and learn, as far as a second's work brings them
about."""

from __future__ import annotations

import pytest

from tests.remedies.cases import OR, Case, heal
from tests.remedies.user import User

SHORT = "measure second.mp4"
"""A film of less than a second: refused for its length, once the options fit."""
TOO_SHORT = "s of film, a measurement takes"
BUILD = "build flagsim-small --scheduler tcp://127.0.0.1:1 --workers 1"
NO_WORKERS = "--workers with --scheduler"
"""What is refused next, once the counts fit."""
STAMPS = "align first mast --by stamps --offset-sigma 0.1"
CASES = [
    Case(
        "commands/measure.py",
        "choose one of --json and --csv",
        f"{SHORT} --json --csv",
        (f"{SHORT} --json", OR, f"{SHORT} --csv"),
        shows=TOO_SHORT,
        code=1,
    ),
    Case(
        "commands/measure.py",
        "give --refine N",
        f"{SHORT} --cache c",
        (SHORT, OR, f"{SHORT} --cache c --refine 20 --flag-size 1.5x1"),
        shows=TOO_SHORT,
        code=1,
    ),
    Case(
        "commands/measure_film.py",
        "choose one of --area-weight and --material",
        f"{SHORT} --area-weight 0.1 --material x",
        (f"{SHORT} --area-weight 0.1", OR, f"{SHORT} --material camel-ponte-roma"),
        shows=TOO_SHORT,
        code=1,
    ),
    Case(
        "film/film_source.py",
        "see flagdata measure --help",
        "measure",
        ("measure --help",),
        shows="--query",
    ),
    Case(
        "film/film_source.py",
        "look with flagdata query --where",
        "measure --query \"name = 'mist'\"",
        ("query --where \"name = 'first'\"",),
        shows="first",
    ),
    Case(
        "datasets/dataset_recipe.py",
        "or more: ",
        f"{BUILD} --sequences 2",
        (f"{BUILD} --sequences 3",),
        shows=NO_WORKERS,
        code=2,
    ),
    Case(
        "datasets/dataset_recipe.py",
        "or more, or --sequences",
        f"{BUILD} --films 300",
        (f"{BUILD} --films 400", OR, f"{BUILD} --films 300 --sequences 300"),
        shows=NO_WORKERS,
        code=2,
    ),
    Case(
        "datasets/build_command.py",
        "leave --card out",
        f"{BUILD} --shard 1/2 --card card.html",
        (f"{BUILD} --shard 1/2",),
        shows=NO_WORKERS,
        code=2,
    ),
    Case(
        "evaluation/evaluation_report.py",
        "give a name, and the fol",
        "evaluate shipped --name out/table",
        ("evaluate shipped --name table --out out",),
        shows="no clips of a data set",
        code=1,
    ),
    Case(
        "training/checkpoint.py",
        "give a new or empty fold",
        "train wave --run run",
        ("train wave --run new",),
        files={"run/notes.txt": "mine"},
        shows="no clips of a data set",
        code=1,
    ),
    Case(
        "sim/blender/blender_setup.py",
        "leave out --folder and --python",
        "blender-setup --check --folder x --python y",
        ("blender-setup --check",),
        code=1,
    ),
]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_what_a_remedy_says_heals(case: Case, user: User, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("FLAGDATA_BLENDER", raising=False)
    heal(user, case)


def test_a_film_without_a_log_is_aligned_before_it_is_calibrated(user: User) -> None:
    user.meets(
        "cloth/flag_recordings.py",
        "and name the recording that comes out",
        "calibrate",
        "first",
        "--flag-size",
        "1x1",
    )
    recording = user.follows(*STAMPS.split(), "--json").document["recording"]
    assert (
        "no log of the wind is beside"
        not in user.types("calibrate", recording, "--flag-size", "1x1").err
    )


def test_a_query_of_clips_needs_a_lake(user: User, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("FLAGDATA_LAKE")
    command = ("measure", "--query", "kind = 'clip'")
    user.meets("film/film_source.py", "name the lake by --lake", *command)
    user.follows(*command, "--lake", "lake", code=1, shows="no clip matches")
