"""Remedies of commands that look, align and export."""

from __future__ import annotations

import numpy as np
import pytest

from tests.remedies.cases import OR, Case, heal
from tests.remedies.user import User

STAMPS = "align first mast --by stamps --offset-sigma 0.1"
LONG_SQL = "select count(*) from range(200000) a, range(200) b"
AWAY = "".join(
    [
        "time,wind_speed (m/s)\n",
        *(f"2026-05-01T12:{k // 60:02d}:{k % 60:02d},{5 + k % 7 / 10}\n" for k in range(200)),
    ]
)
"""A log whose zone is not in it."""
CASES = [
    Case(
        "commands/catalog_names.py",
        "says what each is",
        "catalog exports csv",
        ("catalog exports",),
        shows="webdataset",
    ),
    Case(
        "align/constant.py",
        "see flagdata ls",
        "declare mast --speed 3 --sigma 0.2",
        ("ls --kind camera", "declare first --speed 3 --sigma 0.2"),
        shows="camera +first",
    ),
    Case(
        "align/film_recording.py",
        "flagdata align CAMERA WIND takes",
        "align mast first --by stamps --offset-sigma 0.1",
        ("ls", STAMPS),
        shows="camera +first(.|\n)*wind +mast",
    ),
    Case(
        "align/film_recording.py",
        "see flagdata ls --kind recording",
        "realign mast --by stamps --offset-sigma 1",
        ("ls --kind recording", "realign first --by given --clock-offset 1 --offset-sigma 0.1"),
        before=(STAMPS,),
        shows="recording +first",
        untried="align",
    ),
    Case(
        "align/film_recording.py",
        "say by --session which",
        "align one two --by stamps --offset-sigma 0.1",
        ("align one two --by stamps --offset-sigma 0.1 --session both",),
        before=(
            "ingest second.mp4 --session a --name one",
            "ingest second.csv --session b --name two",
        ),
    ),
    Case(
        "align/methods.py",
        "use --by given --clock-offset SECONDS",
        "align first mast --by given",
        ("align first mast --by given --clock-offset 1 --offset-sigma 0.1",),
    ),
    Case(
        "align/methods.py",
        "use --by given --clock-offset SECONDS",
        f"{STAMPS} --clock-offset 3",
        ("align first mast --by given --clock-offset 3 --offset-sigma 0.1",),
    ),
    Case(
        "align/methods.py",
        "use --by given --clock-offset SECONDS",
        "align first mast",
        ("align first mast --by given --clock-offset 1 --offset-sigma 0.1",),
        shows="recording",
    ),
    Case(
        "align/methods.py",
        "leave it out, or use --by given",
        "align first mast --offset-sigma 0.1",
        ("align first mast --by given --clock-offset 1 --offset-sigma 0.1",),
    ),
    Case(
        "align/present.py",
        "or take the old one off with flagdata withdraw first",
        f"{STAMPS} --session b",
        ("withdraw first -m again", f"{STAMPS} --session b", OR, STAMPS),
        before=(f"{STAMPS} --session a",),
    ),
    Case(
        "align/apart.py",
        "or search around the difference: --centre SECONDS",
        "align first away",
        (
            "ingest away.csv --name near --zone +02:00",
            "align first near --by stamps --offset-sigma 1",
        ),
        files={"away.csv": AWAY},
        before=("ingest away.csv --zone -10:00",),
        untried="--start --date --centre",
    ),
    Case(
        "align/apart.py",
        "the day of its clips may be wrong too",
        "show r --json",
        ("ingest away.csv --name near --zone +02:00",),
        files={"away.csv": AWAY},
        before=(
            "ingest away.csv --zone -10:00",
            "align first away --by given --clock-offset 43200 --offset-sigma 1 --name r",
        ),
        untried="--start --date",
    ),
    Case(
        "commands/ingest_options.py",
        "add --crop auto",
        "ingest second.mp4 --crop-picture crop.png",
        ("ingest second.mp4 --crop-picture crop.png --crop auto",),
    ),
    Case(
        "commands/lake_versions.py",
        "give FOLDER or --lake, not both",
        "init x --lake y",
        ("init x",),
    ),
    Case(
        "api/lake_verbs.py",
        "leave it out, or see --help",
        "branch side --delete --at v0",
        ("branch --help", "branch side --delete --discard"),
        shows="--discard",
    ),
    Case(
        "api/lake_verbs.py",
        "leave it out, or see --help",
        "tag v1 --discard",
        ("tag --help", "tag v1"),
        shows="--discard",
    ),
    Case(
        "commands/lake_versions.py",
        "leave out --branch",
        "withdraw mast --everywhere --branch side -m x",
        ("withdraw mast --everywhere -m x",),
    ),
    Case(
        "commands/looking.py",
        "flagdata gc --dry-run lists it",
        "du",
        ("gc --dry-run --older-than 0s",),
        shows="left",
    ),
    Case(
        "commands/query.py",
        "choose one of --json, --csv and --arrow",
        "query --json --csv",
        ("query --json", OR, "query --csv", OR, "query --arrow a.arrow"),
    ),
    Case(
        "flagdata/lake/catalog_cells.py",
        "cast it in the SQL, or write it by --arrow",
        "query --csv --sql 'select interval 3 days as x'",
        (
            "query --csv --sql 'select (interval 3 days)::text as x'",
            OR,
            "query --arrow a.arrow --sql 'select interval 3 days as x'",
        ),
    ),
    Case(
        "commands/upkeep.py",
        "give --older-than AGE, --keep N, or both",
        "expire",
        ("expire --older-than 0s", OR, "expire --keep 1", OR, "expire --keep 1 --older-than 0s"),
    ),
    Case(
        "commands/upkeep.py",
        "structure checked, contents not (flagdata verify)",
        "doctor",
        ("verify",),
        shows="healthy",
    ),
    Case(
        "export/export_plan.py",
        "try the filter with flagdata query",
        "export csv --to out --where \"name like 'mi%'\"",
        ("query --where \"name like 'm%'\"", "export csv --to out --where \"name = 'mast'\""),
        shows="mast",
    ),
    Case(
        "export/export_plan.py",
        "choose what it holds: --where",
        "export csv --to out",
        ("export csv --to out --where \"kind in ('clip', 'recording', 'wind')\"",),
    ),
    Case(
        "export/export_plan.py",
        "choose what it holds: --where",
        "export mp4 --to out",
        ("export mp4 --to out --where \"kind in ('camera')\"",),
    ),
    Case(
        "catalog_sql.py",
        "the columns are listed by `flagdata query --describe`",
        "query --sql 'select wind + from catalog'",
        ("query --describe", "query --sql 'select wind from catalog'"),
        shows="wind +double",
    ),
    Case(
        "selection.py",
        "`flagdata query --time-limit SECONDS` allows more",
        f"query --sql '{LONG_SQL}' --time-limit 0.01",
        (f"query --sql '{LONG_SQL}' --time-limit 60",),
    ),
    Case(
        "timebase.py",
        "or name it by --zone",
        "ingest second.mp4 --start 2026-05-01T12:00:00",
        (
            "ingest second.mp4 --start 2026-05-01T12:00:00 --zone +02:00",
            OR,
            "ingest second.mp4 --start 2026-05-01T12:00:00+02:00",
        ),
    ),
]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_what_a_remedy_says_heals(case: Case, user: User) -> None:
    heal(user, case)


def test_two_logs_are_aligned_as_the_remedies_say(user: User) -> None:
    for name, late, count in (("a", 0, 850), ("b", 40, 850), ("short", 0, 100)):
        rng = np.random.default_rng(7)
        gusts = np.convolve(rng.normal(size=900), np.ones(3), "valid")[late : late + count]
        rows = [
            f"2026-05-01T{10 + k // 3600:02d}:{k // 60 % 60:02d}:{k % 60:02d}Z,{6 + gust:.2f}"
            for k, gust in enumerate(gusts)
        ]
        (user.folder / f"{name}.csv").write_text("\n".join(["time,wind_speed (m/s)", *rows, ""]))
        user.succeeds("ingest", f"{name}.csv")
    user.meets(
        "commands/align.py",
        "leave --by out",
        "align",
        "a",
        "b",
        "--by",
        "given",
        "--clock-offset",
        1,
        "--offset-sigma",
        1,
    )
    user.follows("align", "a", "b", "--dry-run", "--max-sigma", 1, shows=r"offset [+-]40\.")
    user.meets(
        "align/logs.py",
        "search around another offset: --centre, --search",
        "align",
        "a",
        "b",
        "--centre",
        5000,
    )
    user.follows(
        "align",
        "a",
        "b",
        "--centre",
        60,
        "--search",
        60,
        "--max-sigma",
        1,
        "--dry-run",
        shows=r"offset [+-]40\.",
    )
    user.meets(
        "align/logs.py", "or compare logs that last longer", "align", "a", "short", "--centre", 0
    )
    user.follows("align", "a", "b", "--name", "c", "--search", 100, "--max-sigma", 1)


def test_what_no_lake_was_named_for_is_found_in_one(
    user: User, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("FLAGDATA_LAKE")
    user.meets(
        "examples/__init__.py",
        "or name the lake by --lake",
        "observe",
        "first",
        "--flag-size",
        "1.5x1",
    )
    user.follows("observe", "first", "--flag-size", "1.5x1", "--lake", "lake", code=3)


def test_salt_is_of_a_side(user: User) -> None:
    user.succeeds(*STAMPS.split())
    command = ("export", "mcap", "--to", "out", "--where", "kind = 'recording'")
    user.meets("api/lake_verbs.py", "name the side by --split", *command, "--salt", "x")
    user.again(without="--salt")
    user.meets("api/lake_verbs.py", "name the side by --split", *command, "--salt", "x")
    user.leaves(["--split"])
    (user.folder / "out").rename(user.folder / "all")
    user.meets(
        "export/export_plan.py",
        "choose another side by --split",
        *command,
        "--salt",
        "x",
        "--split",
        "train",
    )
    user.follows(*command)


def test_a_recording_that_was_superseded_is_taken_off(user: User) -> None:
    old = user.succeeds(*STAMPS.split(), "--json").document["recording"]
    command = ("realign", "first", "--by", "given", "--clock-offset", 1, "--offset-sigma", "0.1")
    fix = user.meets("commands/align.py", "flagdata withdraw takes it off", *command)
    assert old[:12] in fix
    user.follows("withdraw", old[:12], "-m", "superseded")
