"""Expiring versions: what only they show goes at once, with a trace; branches, tags and newer
versions lose nothing."""

from __future__ import annotations

from datetime import timedelta
from pathlib import Path

import pytest

from flagdata.errors import ConflictError, NotFoundError
from flagdata.export import Export, export
from flagdata.lake import (
    Artifact,
    Lake,
    collect,
    doctor,
    expire,
    is_healthy,
    last_version,
    lost,
    verify_catalog,
)
from tests.flagdata.lake.conftest import put_text, stored
from tests.program import invoke


def test_what_only_expired_versions_show_goes_and_ls_export_and_doctor_say_alike_by_which_version(
    lake: Lake, tmp_path: Path
) -> None:
    blurred, film = put_text(lake, "blurred"), put_text(lake, "film")  # versions 1 and 2
    lake.withdraw([blurred.id], "out of focus")
    done = expire(lake, 2, "the first season")
    assert (done.version, done.objects, done.size) == (4, (blurred.object,), len("blurred"))
    assert stored(lake) == {film.object}
    (why,) = lost(lake, lake.rows(at="2")).values()
    assert "went when versions up to 2 expired, by version 4 (the first season)" in why.what
    listed = invoke("ls", "--at", "2", "--lake", lake.path)
    assert f"without data: blurred: {why.what}" in listed.err
    with pytest.raises(NotFoundError) as refused:
        export(lake, Export(format="csv", at="2", where="name = 'blurred'"), tmp_path / "out")
    assert refused.value.what == why.what
    (note,) = doctor(lake)
    assert (note.kind, note.where, note.count) == ("expired", "versions up to 2", 1)
    assert "by version 4 (the first season)" in note.what
    assert not verify_catalog(lake)
    newest = invoke("log", "--limit", "1", "--json", "--lake", lake.path).document["commits"][0]
    assert (newest["version"], newest["message"]) == (4, "the first season")


def test_branches_tags_and_versions_that_have_not_expired_keep_their_data(lake: Lake) -> None:
    tagged, branched, later, gone = (
        put_text(lake, name) for name in ("tagged", "branched", "later", "gone")
    )
    lake.tag("v1", at="1")  # version 5
    lake.branch("b", at="2")
    lake.withdraw([gone.id], "version 7")
    lake.withdraw([tagged.id, branched.id, later.id], "version 8")
    assert set(expire(lake, 6).objects) == {gone.object}  # version 7 still shows the others
    assert stored(lake) == {tagged.object, branched.object, later.object}
    assert set(expire(lake, 7).objects) == {later.object}
    assert stored(lake) == {tagged.object, branched.object}
    for ref in ("v1", "b"):
        assert not lost(lake, lake.rows(at=ref))
    assert is_healthy(doctor(lake))
    assert collect(lake, grace=timedelta(0)).objects == ()


def test_no_new_tag_or_branch_shows_what_went_and_ingesting_again_restores_it(lake: Lake) -> None:
    film = put_text(lake, "film")
    lake.withdraw([film.id], "blurred")
    expire(lake, 1)
    for name in (lake.tag, lake.branch):
        with pytest.raises(ConflictError, match="went when versions up to 1 expired"):
            name("old", at="1")
    assert put_text(lake, "film").id == film.id
    assert not lost(lake, lake.rows(at="1"))
    assert doctor(lake) == ()
    lake.tag("old", at="1")


def test_what_a_running_transaction_holds_stays(lake: Lake) -> None:
    film = put_text(lake, "film")
    lake.withdraw([film.id], "blurred")
    with lake.transaction("again") as tx:
        tx.add(Artifact(kind="measurement", name="of it", object=film.object))
        assert expire(lake, 1).objects == ()
    assert stored(lake) == {film.object}


def test_versions_are_chosen_by_age_and_by_how_many_are_newer(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("a", "b", "c"):
        put_text(lake, name)  # versions 1 to 3
    assert [last_version(lake, older_than=None, keep=keep) for keep in (1, 2, 4, 9)] == [
        2,
        1,
        -1,
        -1,
    ]
    now = lake.catalog.history()[0]["timestamp"]
    days = {0: 40, 1: 30, 2: 20, 3: 0}
    dated = [{"version": v, "timestamp": now - days[v] * 86_400_000} for v in (3, 2, 1, 0)]
    monkeypatch.setattr(lake.catalog, "history", lambda: dated)
    # Version 0 was replaced 30 days ago, version 1 20 days ago, version 2 just now.
    ages = {
        day: last_version(lake, older_than=timedelta(days=day), keep=None)
        for day in (35, 25, 15, 0)
    }
    assert ages == {35: -1, 25: 0, 15: 1, 0: 2}
    assert last_version(lake, older_than=timedelta(days=15), keep=4) == -1


def test_the_command_says_what_would_go_and_deletes_nothing_then(lake: Lake) -> None:
    film = put_text(lake, "film")
    lake.withdraw([film.id], "blurred")
    where = ("--lake", lake.path)
    tried = invoke("expire", "--keep", "1", "--dry-run", *where)
    assert (tried.code, tried.out) == (0, f"{film.object}\n")
    assert "versions up to 1 would expire: 1 object, 4 B, would go" in tried.err
    assert stored(lake) == {film.object}
    assert lake.catalog.head() == 2
    done = invoke("expire", "--keep", "1", "--json", *where).document
    assert (done["up_to"], done["objects"], done["version"]) == (1, [film.object], 3)
    assert invoke("expire", *where).code == 2
    assert "no version is that old" in invoke("expire", "--older-than", "9d", *where).err


def test_a_lake_in_a_bucket_expires_alike(remote_lake: Lake) -> None:
    film = put_text(remote_lake, "film")
    remote_lake.withdraw([film.id], "blurred")
    assert expire(remote_lake, 1).objects == (film.object,)
    assert stored(remote_lake) == set()


def test_what_expired_keeps_its_lineage_here_and_in_clones(lake: Lake, tmp_path: Path) -> None:
    log = put_text(lake, "log")
    recording = put_text(lake, "recording", parents=(log.id,))
    clip = put_text(lake, "clip", parents=(recording.id,))  # version 3
    before, after = tmp_path / "before", tmp_path / "after"
    assert invoke("clone", lake.path, before).code == 0
    lake.withdraw([log.id, recording.id, clip.id], "another flag")
    assert expire(lake, 4, "the first season").objects
    assert invoke("pull", lake.path, "--lake", before).code == 0
    assert invoke("clone", lake.path, after).code == 0
    for place in (lake.path, before, after):
        of_it = invoke("lineage", "clip", "--at", "3", "--lake", place, "--json").document
        assert {one["name"] for one in of_it["relatives"]} == {"log", "recording", "clip"}
        kinds = {finding.kind for finding in doctor(Lake.open(place))}
        assert ("expiry-unfinished" in kinds) == (place == before)  # its data are still there
        collect(Lake.open(place), grace=timedelta(days=1))
        assert is_healthy(doctor(Lake.open(place)))
    put_text(Lake.open(after), "spare")
    assert invoke("push", lake.path, "--lake", after).code == 0
    assert lake.rows()["name"].to_pylist() == ["spare"]
