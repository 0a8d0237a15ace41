"""Remedies of lakes: their rows, versions, copies, and what crashes leave."""

from __future__ import annotations

import os
import shlex
import time
from pathlib import Path

from flagdata.lake import Lake
from tests.remedies.user import User

NOBODY = "0123456789abcdef0123456789abcdef"


def aligned(user: User, *more: str) -> str:
    """The id of the recording that a user makes of the film and the log."""
    ended = user.succeeds(
        "align", "first", "mast", "--by", "stamps", "--offset-sigma", "0.1", "--json", *more
    )
    return ended.document["recording"]


def test_a_name_that_nothing_has_is_found_where_the_fix_says(user: User) -> None:
    user.meets("lake/store.py", "flagdata ls lists them", "show", "nothing")
    listed = user.follows("ls", shows="camera +first").out
    user.succeeds("show", listed.splitlines()[1].split()[0])


def test_a_name_of_a_branch_is_listed_with_the_branch_that_was_asked(user: User) -> None:
    fix = user.meets("lake/store.py", "flagdata ls --at", "show", "thrid", "--at", "side")
    assert "flagdata ls --at side" in fix
    user.follows("ls", "--at", "side", shows="camera  third")


def test_a_name_of_several_is_made_certain_by_the_ids_that_are_listed(user: User) -> None:
    one = aligned(user)
    user.succeeds(
        "align", "first", "mast", "--by", "given", "--clock-offset", 1, "--offset-sigma", "0.1"
    )
    user.meets("lake/store.py", "flagdata ls lists them", "show", "first")
    user.follows("ls", shows=one[:12])
    user.succeeds("show", one[:12])


def test_versions_before_the_first_are_listed(user: User) -> None:
    user.meets("lake/refs.py", "flagdata log lists its versions", "ls", "--at", "2001-01-01")
    user.follows("log", shows=r"\n +1 ")
    user.succeeds("ls", "--at", "1", shows="camera  first")


def test_the_older_of_two_labels_of_one_column_is_taken_off(user: User) -> None:
    for old, new in (("A", "a"), ("b", "B")):
        user.succeeds("label", "mast", f"{old}=1")
        fix = user.meets("lake/label_columns.py", "flagdata label", "label", "first", f"{new}=1")
        command = fix.partition("flagdata ")[2].partition(" takes")[0]
        user.follows(*command.split())
        user.succeeds("label", "first", f"{new}=1")


def test_a_label_without_an_artifact_is_written_as_the_fix_writes_it(user: User) -> None:
    fix = user.meets("commands/label.py", "flagdata label ARTIFACT NAME=VALUE", "label", "mast")
    user.follows(*fix.replace("ARTIFACT", "mast").replace("NAME=VALUE", "side=west").split()[1:])


def test_where_there_is_no_lake_one_is_made_or_named(user: User, monkeypatch) -> None:
    monkeypatch.setenv("FLAGDATA_LAKE", "nowhere")
    user.meets("lake/lake.py", "make one with flagdata init", "ls")
    user.follows("init", "nowhere")
    user.succeeds("ls")
    user.follows("ls", "--lake", "lake", shows="mast")


def test_a_log_that_a_recording_needs_is_withdrawn_with_it(user: User) -> None:
    aligned(user)
    user.meets(
        "lake/removal.py", "flagdata withdraw --with-descendants", "withdraw", "mast", "-m", "zero"
    )
    user.follows("withdraw", "mast", "-m", "zero", "--with-descendants")
    user.succeeds("doctor")


def test_a_merge_that_lacks_a_parent_goes_on_after_either_way(user: User) -> None:
    for number, branch in enumerate(("one", "two")):
        user.succeeds("branch", branch)
        aligned(user, "--branch", branch)
        user.succeeds("withdraw", "mast", "-m", "zero")
        fix = user.meets("lake/merging.py", "flagdata withdraw", "merge", branch)
        withdrawing = shlex.split(fix.partition("flagdata ")[2].partition(",")[0])
        if number:
            user.follows(*withdrawing)
        else:
            user.follows("ingest", "mast.csv", "--branch", "main")
        user.succeeds("merge", branch)
        user.succeeds("doctor")
        if not number:
            user.succeeds("withdraw", "mast", "-m", "zero", "--with-descendants")
            user.succeeds("ingest", "mast.csv")


def test_a_branch_that_alone_shows_rows_is_tagged_or_given_up(user: User) -> None:
    user.meets("lake/ref_commits.py", "add --discard", "branch", "side", "--delete")
    user.again("--discard")


def test_lakes_that_went_apart_are_brought_together_in_a_clone(user: User) -> None:
    user.succeeds("clone", "lake", "copy.lake")
    user.succeeds("label", "mast", "here=1")
    user.succeeds("label", "mast", "there=1", "--lake", "copy.lake")
    fix = user.meets("lake/copying.py", "commit there what it lacks", "push", "copy.lake")
    cloning = fix.partition("flagdata ")[2].partition(",")[0].split()
    user.follows(*[word.replace("NEW", "new.lake") for word in cloning])
    user.succeeds("label", "mast", "here=1", "--lake", "new.lake")
    user.succeeds("push", "copy.lake", "--lake", "new.lake")
    user.follows("label", "mast", "here=1", "--lake", "copy.lake")


def test_versions_are_moved_the_way_that_they_went(user: User) -> None:
    user.succeeds("clone", "lake", "ahead.lake")
    user.succeeds("label", "mast", "there=1", "--lake", "ahead.lake")
    fix = user.meets("lake/copying.py", "brings them here", "push", "ahead.lake")
    user.follows(*shlex.split(fix.partition("flagdata ")[2].partition(" brings")[0]))
    user.succeeds("log", shows="label there")


def damage(user: User, name: str, *, branch: str = "main") -> Path:
    """Change a byte in the middle of an artifact's object."""
    lake = Lake.open(user.folder / "lake")
    path = Path(lake.object_path(str(lake.artifact(name, at=branch).object)))
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.chmod(0o644)
    path.write_bytes(data)
    return path


def test_an_object_that_is_missing_is_explained_by_doctor(user: User) -> None:
    path = damage(user, "first")
    path.unlink()
    user.meets("lake/objects.py", "run flagdata doctor", "measure", "first", "--lake", "lake")
    user.follows("doctor", code=3, shows="error: dangling-row: its object mcap/.* is missing")


def test_a_record_that_was_cut_off_is_saved_by_recover(user: User) -> None:
    path = damage(user, "first")
    with path.open("r+b") as file:
        file.truncate(path.stat().st_size - 5000)
    user.meets("lake/health.py", "flagdata recover saves what a cut-off record", "doctor")
    user.follows("recover", path, "saved.mcap", shows="recovered")


def test_leftovers_are_deleted_by_gc_and_a_record_in_them_saved_before(user: User) -> None:
    old = time.time() - 2 * 86400
    lake = user.folder / "lake"
    os.utime(lake / "staging" / "left", (old, old))
    for path in (lake / "mcap").iterdir():
        os.utime(path, (old, old))
    user.meets("lake/health.py", "move it away, or let flagdata gc delete it", "doctor")
    user.follows("gc", shows="left")
    user.succeeds("doctor")


def test_a_file_that_is_no_object_is_moved_out_and_ingested(user: User) -> None:
    user.succeeds("gc", "--older-than", "0s")
    stray = user.folder / "lake" / "mcap" / "log.csv"
    stray.write_bytes((user.folder / "second.csv").read_bytes())
    user.meets("lake/health.py", "move it out of the lake", "doctor")
    stray.rename(user.folder / "log.csv")
    user.follows("ingest", "log.csv")
    user.succeeds("doctor", shows="(?m)^healthy")


def test_what_a_killed_ingest_leaves_is_young_at_first_and_then_taken_by_gc(user: User) -> None:
    lake = Lake.open(user.folder / "lake")
    name = str(lake.artifact("third", at="side").object)
    user.succeeds("gc", "--older-than", "0s")
    user.succeeds("branch", "side", "--delete", "--discard")
    dead = user.folder / "lake" / "staging" / "0123"
    dead.mkdir()
    (dead / "lease").write_text('{"pid": 1, "host": "here", "since": "then"}\n')
    record = dead / "half.mcap"
    record.write_bytes((user.folder / "cut.mcap").read_bytes())
    half = user.folder / "lake" / "catalog" / "0123.parquet"
    half.write_text("half")
    fix = user.meets(
        "lake/health.py", "; to save its unfinished record first: flagdata recover", "doctor"
    )
    user.follows(
        "recover", *fix.partition("flagdata recover ")[2].split(), "saved.mcap", shows="recovered"
    )
    user.meets(
        "lake/health.py", "; to save its unfinished record first: flagdata recover", "doctor"
    )
    user.follows("gc", shows="0123")
    user.meets("lake/health.py", "none needed; flagdata gc takes it", "doctor")
    user.follows("gc")
    for path in (half, Path(lake.object_path(name))):
        os.utime(path, (1e9, 1e9))
    user.meets("lake/health.py", "run flagdata gc", "doctor", "--older-than", "1h")
    user.follows("gc", shows="0123.parquet")
    user.succeeds("doctor", shows="(?m)^healthy")


def test_what_was_erased_is_left_out_of_an_export(user: User) -> None:
    gone = aligned(user)
    user.succeeds("tag", "v1")
    user.succeeds("withdraw", gone, "--everywhere", "-m", "a person asked")
    user.meets("lake/removal_findings.py", "leave them out by --where", "doctor")
    user.follows("export", "mcap", "--to", "out", "--at", "v1", "--where", "kind = 'camera'")
    user.meets(
        "lake/removal.py",
        "leave its artifact out by --where",
        "export",
        "mcap",
        "--to",
        "more",
        "--at",
        "v1",
        "--where",
        "kind in ('camera', 'recording')",
    )
    user.follows(
        "export",
        "mcap",
        "--to",
        "more",
        "--at",
        "v1",
        "--where",
        f"kind in ('camera', 'recording') and artifact <> '{gone}'",
    )


def test_labels_that_a_merge_would_bring_into_one_column_are_taken_off_as_the_fix_says(
    user: User,
) -> None:
    user.succeeds("branch", "other")
    user.succeeds("label", "mast", "A=1")
    user.succeeds("label", "first", "a=1", "--branch", "other")
    fix = user.meets("lake/label_columns.py", "flagdata label", "merge", "other")
    command = fix.partition("flagdata ")[2].partition(" takes")[0]
    user.follows(*command.split())
    user.succeeds("merge", "other")
    user.succeeds("query", "--where", "kind = 'wind'", shows="mast")


def test_a_label_that_two_branches_changed_is_made_the_same_as_the_fix_says(user: User) -> None:
    user.succeeds("branch", "other")
    user.succeeds("label", "mast", "note=as seen")
    user.succeeds("label", "mast", "note=otherwise", "--branch", "other")
    fix = user.meets("lake/label_merging.py", "or another: flagdata label", "merge", "other")
    command = fix.partition("flagdata ")[2].partition("; then")[0]
    user.follows(*shlex.split(command))
    user.succeeds("merge", "other")
