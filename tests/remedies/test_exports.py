"""Remedies of exports, of alignments by the contents, of large answers, and of rows that go while a
command runs."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from flagdata.align import methods
from flagdata.core.schema import Kind
from flagdata.dataset import HashedSplit
from flagdata.dataset.splits import Origin
from flagdata.ingest import CameraIngest, CameraOptions, Labels, ingest_camera
from flagdata.lake import Artifact, Lake, selection
from tests.remedies.cases import Case, heal
from tests.remedies.user import User

FAR = "align first mast --centre 50000 --search 10"
CASES = [
    Case(
        "align/bins.py",
        "check start times and zo",
        FAR,
        ("align first mast --centre 0 --search 60",),
        shows="no offset can be estimated: film and wind log share",
        code=3,
    ),
]


@pytest.fixture
def short_films_compared(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lets films of a second be compared with logs, which stand for films of two minutes."""
    monkeypatch.setattr(methods, "_check_lengths", lambda *_: None)


@pytest.mark.usefixtures("short_films_compared")
@pytest.mark.parametrize("case", CASES, ids=str)
def test_what_a_remedy_says_heals(case: Case, user: User) -> None:
    heal(user, case)


@pytest.mark.usefixtures("short_films_compared")
def test_a_film_that_cannot_be_aligned_is_looked_at_or_its_offset_given(user: User) -> None:
    fix = user.meets(
        "align/methods.py", "look at it with --plot FILE.png", "align", "first", "mast"
    )
    user.follows("align", "first", "mast", "--plot", "FILE.png", code=3, shows="plot: FILE.png")
    assert (user.folder / "FILE.png").stat().st_size > 1000
    assert "--by given --clock-offset SECONDS --offset-sigma SECONDS" in fix
    user.succeeds(
        "align", "first", "mast", "--by", "given", "--clock-offset", 1, "--offset-sigma", "0.1"
    )


def sized(name: str, size: int) -> None:
    """The film `second` in frames of that size, as programs ingest it."""
    options = CameraIngest(camera=CameraOptions(size=size))
    ingest_camera(Lake.open("lake"), Path("second.mp4"), options, labels=Labels(name=name))


def test_films_of_one_size_are_chosen(user: User) -> None:
    sized("small", 64)
    command = ("export", "lerobot", "--to", "out", "--frames", "png", "--where")
    user.meets("export/lerobot.py", "a data set of LeRobot ha", *command, "kind = 'camera'")
    user.follows(*command, "name = 'small'")


def test_frames_of_an_odd_size_are_exported_as_png(user: User) -> None:
    sized("odd", 63)
    command = ("export", "lerobot", "--to", "out", "--where", "name = 'odd'")
    user.meets("export/lerobot.py", "export with --frames png", *command)
    user.again("--frames", "png")


def test_sql_that_gives_more_than_can_be_held_is_limited_or_written(
    user: User, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A smaller limit stands for millions of values."""
    monkeypatch.setattr(selection, "CELL_LIMIT", 5000)
    large = "select range as a from range(60000)"
    user.meets(
        "flagdata/lake/selection.py", "aggregate in SQL, or giv", "query", "--json", "--sql", large
    )
    user.succeeds("query", "--json", "--sql", f"select count(*) as n from ({large})", shows="60000")
    user.succeeds("query", "--json", "--sql", f"{large} limit 100")
    user.follows("query", "--csv", "--sql", large)
    user.follows("query", "--arrow", "a.arrow", "--sql", large)


def film_of(number: int, **columns: Any) -> str:
    """Commits a recording with a clip, whose data nobody reads."""
    day = f"2026-06-{number:02d}"
    recording = Artifact(
        kind=Kind.RECORDING, name=f"film-{number}", recipe={"number": number}, day=day, **columns
    )
    clip = replace(
        recording,
        kind=Kind.CLIP,
        name=f"clip-{number}",
        parents=(recording.id,),
        recording=recording.id,
    )
    with Lake.open("lake").transaction(f"film {number}") as transaction:
        transaction.add(recording)
        transaction.add(clip)
    return recording.name


CLIPS = (
    "export",
    "parquet",
    "--to",
    "out",
    "--where",
    "kind = 'clip' and side is not null",
    "--split",
    "train",
)


def test_a_salt_beside_stated_sides_is_left_out(user: User) -> None:
    for number, side in enumerate(["train", "test"], start=1):
        film_of(number, dataset="made", side=side)
    user.meets("dataset/sides.py", "leave out --salt", *CLIPS, "--salt", "x")
    user.again(without="--salt")


def test_relatives_on_two_sides_are_withdrawn_from_one(user: User) -> None:
    for number, side in enumerate(["train", "train", "test"], start=1):
        film_of(number, dataset="made", side=side, session="barn" if number > 1 else None)
    user.meets("dataset/sides.py", "take what they share off", *CLIPS)
    user.follows("withdraw", "film-3", "--with-descendants", "-m", "of the session of film-2")
    user.succeeds(*CLIPS)


def test_a_field_recording_of_a_data_sets_session_is_left_out_or_withdrawn(user: User) -> None:
    """Of the others a hash decides."""
    film_of(1, dataset="made", side="kept", session="barn")
    film_of(2, session="barn")
    side, *_ = HashedSplit().assign([Origin(recording="film-3", days=("2026-06-03",))])
    film_of(3)
    command = ("export", "parquet", "--to", "out", "--split", side, "--where")
    user.meets(
        "dataset/sides.py",
        "leave those that share it out",
        *command,
        "kind = 'clip' and side is null",
    )
    user.succeeds(*command, "kind = 'clip' and side is null and name <> 'clip-2'")
    user.follows("withdraw", "film-2", "--with-descendants", "-m", "of the session of film-1")
    user.succeeds(
        "export", "parquet", "--to", "again", *command[4:], "kind = 'clip' and side is null"
    )


def gone_meanwhile(patch: pytest.MonkeyPatch, method: str, name: str) -> None:
    """Let somebody else withdraw a row between a command's look at the lake and its commit."""
    plain: Callable[..., Any] = getattr(Lake, method)
    withdraw = Lake.withdraw
    first = itertools.count()

    def late(lake: Lake, *arguments: Any, **options: Any) -> Any:
        if not next(first):
            withdraw(Lake.open(lake.path), [lake.artifact(name).id], "meanwhile")
        return plain(lake, *arguments, **options)

    patch.setattr(Lake, method, late)


@pytest.mark.parametrize("verb", ["label", "withdraw"])
def test_a_row_that_somebody_withdrew_meanwhile_is_not_listed(user: User, verb: str) -> None:
    rest = {"label": ("a=1",), "withdraw": ("-m", "x")}[verb]
    with pytest.MonkeyPatch.context() as patch:
        gone_meanwhile(patch, verb, "first")
        if verb == "label":
            fix = user.meets("lake/labels.py", "give ids of rows that fl", verb, "first", *rest)
        else:
            fix = user.meets("lake/removal.py", "give ids of rows that fl", verb, "first", *rest)
    assert "flagdata ls --at main" in fix
    listed = user.follows("ls", "--at", "main").out
    assert "first" not in listed
    (other,) = (line.split()[0] for line in listed.splitlines() if " mast " in line)
    user.succeeds(verb, other, *rest)


def test_what_is_on_a_branch_that_somebody_deletes_meanwhile_is_not_listed(user: User) -> None:
    plain = Lake.erase

    def late(lake: Lake, *arguments: Any, **options: Any) -> Any:
        Lake.open(lake.path).delete_branch("side", discard=True)
        return plain(lake, *arguments, **options)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Lake, "erase", late)
        user.meets(
            "lake/removal.py",
            "flagdata ls --at REF lis",
            "withdraw",
            "third",
            "--everywhere",
            "-m",
            "asked",
        )
    listed = user.follows("ls", "--at", "main").out
    (other,) = (line.split()[0] for line in listed.splitlines() if " mast " in line)
    user.succeeds("withdraw", other, "--everywhere", "-m", "asked")
