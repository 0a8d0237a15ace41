"""Remedies of lakes whose objects, refs or catalog are damaged, and of work that was killed
halfway."""

from __future__ import annotations

import shlex
from functools import partial
from pathlib import Path

import pytest

from flagdata.core.schema import Kind
from flagdata.lake import Artifact, Catalog, Lake, Objects, clone, expire, transfer
from tests.flagdata.lake.conftest import overwrite, put_older_ref
from tests.flagdata.lake.test_remaking import cut, flip, lose
from tests.flagdata.lake.test_transfer import no_bar
from tests.flagdata.lake.test_unfinished import stopped
from tests.remedies.user import User


def the_lake(user: User, name: str = "lake") -> Lake:
    return Lake.open(user.folder / name)


def object_of(lake: Lake, name: str) -> str:
    return str(lake.artifact(name).object)


def keep_measurement(lake: Lake) -> Artifact:
    """A measurement, of which no file is the source."""
    with lake.transaction("measure") as transaction:
        staged = transaction.staging(".zarr")
        staged.mkdir()
        (staged / "zarr.json").write_text("{}")
        row = Artifact(
            kind=Kind.MEASUREMENT,
            name="wave",
            object=transaction.put(staged),
            recipe={"measure": 1},
            code_version="1.0",
        )
        transaction.add(row)
    return row


def test_a_film_whose_object_is_lost_is_put_back_by_its_file_or_by_a_clone(user: User) -> None:
    user.succeeds("clone", "lake", "copy.lake")
    lose(the_lake(user), object_of(the_lake(user), "first"))
    user.meets("flagdata/core/files/durable.py", "flagdata heal FROM, a c", "doctor")
    user.follows("heal", "copy.lake")
    user.succeeds("doctor", shows="(?m)^healthy")
    cut(the_lake(user), object_of(the_lake(user), "first"))
    fix = user.meets("lake/health.py", "again, with the options", "doctor")
    user.follows(*shlex.split(fix.partition("flagdata ")[2].partition(" again")[0]))
    user.succeeds("doctor", shows="(?m)^healthy")
    user.succeeds("verify")


def test_a_measurement_whose_object_is_lost_comes_back_by_a_clone_or_is_withdrawn(
    user: User,
) -> None:
    keep_measurement(the_lake(user))
    user.succeeds("clone", "lake", "copy.lake")
    lose(the_lake(user), object_of(the_lake(user), "wave"))
    user.meets("flagdata/core/files/durable.py", "flagdata heal FROM, a c", "doctor")
    user.follows("heal", "copy.lake")
    user.succeeds("doctor", shows="(?m)^healthy")
    lose(the_lake(user), object_of(the_lake(user), "wave"))
    fix = user.meets("lake/health.py", "-m 'its data are lost'", "doctor")
    user.follows(*shlex.split(fix.rpartition("or flagdata ")[2]))
    user.succeeds("doctor", shows="(?m)^healthy")


def test_a_damaged_object_is_explained_by_verify_and_put_back(user: User) -> None:
    user.succeeds("clone", "lake", "copy.lake")
    export = ("export", "mcap", "--to", "out", "--where", "name = 'first'")
    for words in (("heal", "copy.lake"), None):
        flip(the_lake(user), object_of(the_lake(user), "first"))
        user.meets("lake/objects.py", "do again what made it: f", *export)
        said = user.follows("verify", code=3, shows="object-changed").out
        again = said.partition("fix: ")[2].partition(" again")[0].split()[1:]
        user.follows(*words) if words else user.succeeds(*again)
        user.succeeds(*export[:3], f"out {words}", *export[4:])


def test_a_file_of_the_lake_that_is_damaged_is_taken_from_an_older_clone(user: User) -> None:
    user.succeeds("clone", "lake", "older.lake")
    user.succeeds("label", "mast", "later=1")
    log = user.folder / "lake" / "catalog" / "_delta_log"
    for path in (
        user.folder / "lake" / "lake.json",
        log / f"{1:020d}.json",
        log / f"{0:020d}.json",
    ):
        overwrite(path, b"")
        user.meets("flagdata/core/files/durable.py", "flagdata heal FROM, a c", "ls")
        user.follows("heal", "older.lake", shows="1 item taken, .*; nothing still damaged")
        user.succeeds("doctor", shows="(?m)^healthy")


def test_a_damaged_ref_of_an_earlier_version_is_taken_from_a_clone(user: User) -> None:
    path = put_older_ref(the_lake(user), "tags", "v9")
    user.succeeds("clone", "lake", "copy.lake")
    overwrite(path, b"{")
    user.meets("flagdata/core/files/durable.py", "flagdata heal FROM, a c", "doctor")
    user.follows("heal", "copy.lake", shows="ref .*v9.json: had changed")
    user.succeeds("ls", "--at", "v9", shows="camera +first")
    user.succeeds("doctor", shows="(?m)^healthy")


def test_an_erasure_is_refused_until_a_damaged_ref_is_healed(user: User) -> None:
    path = put_older_ref(the_lake(user), "tags", "v9")
    user.succeeds("clone", "lake", "copy.lake")
    overwrite(path, b"{")
    erase = ("withdraw", "first", "--everywhere", "-m", "asked")
    user.meets("flagdata/core/files/durable.py", "flagdata heal FROM, a c", *erase)
    user.follows("heal", "copy.lake")
    user.succeeds(*erase)
    user.succeeds("doctor", shows="(?m)^healthy")


def test_an_erasure_that_was_killed_is_ended_by_gc_or_by_the_same_command(user: User) -> None:
    for words in (("gc",), ("withdraw", "first", "--everywhere", "-m", "asked")):
        user.begins()
        lake = the_lake(user)
        with pytest.MonkeyPatch.context() as patch:
            stopped(
                patch,
                Objects,
                "delete",
                partial(lake.erase, [lake.artifact("first").id], "asked"),
                at=0,
            )
        user.meets("lake/removal_findings.py", "run flagdata gc, which d", "doctor")
        user.follows(*words)
        user.succeeds("doctor", shows="(?m)^healthy")


def test_an_expiry_that_was_killed_is_ended_by_gc(user: User) -> None:
    user.succeeds("ingest", "second.csv")
    gone = object_of(the_lake(user), "second")
    user.succeeds("withdraw", "second", "-m", "wrong")
    lake = the_lake(user)
    with pytest.MonkeyPatch.context() as patch:
        stopped(patch, Objects, "delete", partial(expire, lake, lake.catalog.head() - 1), at=0)
    user.meets("lake/removal_findings.py", "what expired goes at once", "doctor")
    user.follows("gc")
    assert not the_lake(user).objects.has(gone)


def test_a_disk_that_lets_nothing_be_deleted_keeps_what_gc_or_the_same_command_deletes_later(
    user: User,
) -> None:
    erase = ("withdraw", "first", "--everywhere", "-m", "asked")
    for words in (("gc",), erase):
        user.begins()

        def refuse(self: Objects, name: str) -> None:
            raise PermissionError(13, "Permission denied", name)

        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(Objects, "delete", refuse)
            user.meets("lake/removal.py", "let its folder and what", *erase)
        user.follows("gc") if words == ("gc",) else user.succeeds(*words)
        user.succeeds("doctor", shows="(?m)^healthy")


def test_a_clone_that_was_killed_is_ended_by_the_push_that_is_named(user: User) -> None:
    with pytest.MonkeyPatch.context() as patch:
        stopped(
            patch,
            Objects,
            "publish",
            partial(clone, the_lake(user), Path("copy.lake"), bars=no_bar),
            at=0,
        )
    fix = user.meets("lake/copying.py", "brings it up to date, a", "clone", "lake", "copy.lake")
    user.follows(*shlex.split(fix.partition("flagdata ")[2].partition(" brings")[0]))
    user.succeeds("doctor", "--lake", "copy.lake", shows="(?m)^healthy")
    user.succeeds("ls", "--lake", "copy.lake", shows="camera +first")


def test_a_push_or_pull_that_was_killed_is_ended_by_the_same_one(user: User) -> None:
    for words in (("push", "copy.lake"), ("pull", "lake", "--lake", "copy.lake")):
        user.begins()
        user.succeeds("clone", "lake", "copy.lake")
        user.succeeds("branch", "later")
        user.succeeds("ingest", "second.csv", "--branch", "later")
        with pytest.MonkeyPatch.context() as patch:
            push = partial(transfer, the_lake(user), the_lake(user, "copy.lake"), bars=no_bar)
            stopped(patch, Catalog, "adopt", push, at=1)
        user.succeeds(*words)
        user.succeeds("doctor", "--lake", "copy.lake", shows="(?m)^healthy")
