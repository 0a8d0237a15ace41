"""Doctor names every kind of damage; garbage collection takes what nothing needs and nothing
else."""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import threading
import time
from collections.abc import Callable
from datetime import timedelta
from pathlib import Path

import pytest

from flagdata.core.findings import Finding, Severity
from flagdata.core.schema import Kind
from flagdata.errors import ConflictError, CorruptError, NotFoundError
from flagdata.lake import (
    Artifact,
    Lake,
    catalog,
    collect,
    collecting,
    difference,
    doctor,
    garbage,
    is_healthy,
    object_names,
    sample_names,
    verify,
    verify_catalog,
)
from flagdata.lake.leases import keeping_collectors_out, leases
from flagdata.storage import Place
from tests.flagdata.lake.conftest import AGES, LINKS, LOCKS, overwrite, put_older_ref, put_text

NOW = timedelta(0)
DAY = timedelta(hours=24)
Put = Callable[..., Artifact]


def kinds(findings: tuple[Finding, ...]) -> list[str]:
    return [finding.kind for finding in findings]


def object_of(lake: Lake, artifact: Artifact) -> Place:
    assert artifact.object is not None
    return lake.objects.path(artifact.object)


def abandon(lake: Lake, text: str) -> str:
    """Put an object and let the transaction fail, as a crash after the put would."""
    name = ""

    def fail() -> None:
        nonlocal name
        with lake.transaction("abandon") as tx:
            path = tx.staging(".mcap")
            path.write_text(text)
            name = tx.put(path)
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    return name


def age(path: Path, by: timedelta) -> None:
    then = time.time() - by.total_seconds()
    os.utime(path, (then, then))


def test_a_sound_lake_has_no_findings(lake: Lake) -> None:
    put_text(lake, "a")
    lake.tag("v1")
    lake.branch("try")
    put_text(lake, "b", branch="try")
    assert doctor(lake, grace=NOW) == ()
    assert verify(lake, object_names(lake)) == ()


def test_a_missing_object_is_a_dangling_row(lake: Lake) -> None:
    object_of(lake, put_text(lake, "a")).unlink()
    findings = doctor(lake)
    assert kinds(findings) == ["dangling-row"]
    assert findings[0].severity is Severity.ERROR
    assert findings[0].fix is not None
    assert kinds(verify(lake, object_names(lake))) == ["object-missing"]


def test_a_truncated_object_is_found_by_its_size_and_a_changed_one_by_its_hash(lake: Lake) -> None:
    short, changed = (
        object_of(lake, put_text(lake, "long enough")),
        object_of(lake, put_text(lake, "same size")),
    )
    overwrite(short, b"long")
    overwrite(changed, b"some size")
    assert kinds(doctor(lake)) == ["object-size"]
    assert kinds(verify(lake, object_names(lake))) == ["object-changed", "object-changed"]


def test_ingesting_again_heals_a_damaged_object(lake: Lake) -> None:
    path = object_of(lake, put_text(lake, "a"))
    overwrite(path, b"b")
    put_text(lake, "a")
    assert path.read_bytes() == b"a"
    assert doctor(lake, grace=NOW) == ()


@pytest.mark.disk(
    "what a folder of a bucket holds is said by its `.sums`; another file of it is not read"
)
def test_a_folder_with_one_file_more_is_not_the_object_any_more(lake: Lake) -> None:
    with lake.transaction("folder") as tx:
        path = tx.staging(".zarr")
        path.mkdir()
        (path / "zarr.json").write_text("{}")
        tx.add(Artifact(kind=Kind.MESHES, name="m", object=(name := tx.put(path))))
    (lake.object_path(name) / "extra").write_text("")
    assert kinds(verify(lake, object_names(lake))) == ["object-changed"]


def test_a_row_of_a_newer_format_is_named(lake: Lake) -> None:
    with lake.transaction("future") as tx:
        tx.add(Artifact(kind=Kind.MODEL, name="m", format_version=99))
    findings = doctor(lake)
    assert kinds(findings) == ["newer-format"]
    assert "99" in findings[0].what


def test_a_ref_that_cannot_be_read_is_an_error_and_stops_collection(lake: Lake) -> None:
    put_text(lake, "a")
    path = put_older_ref(lake, "tags", "v1")
    name = abandon(lake, "orphan")
    path.write_bytes(b"{")
    assert kinds(doctor(lake)) == ["ref-unreadable"]
    with pytest.raises(CorruptError):
        collect(lake, grace=NOW)
    assert lake.object_path(name).exists()


@pytest.mark.parametrize("lost", [0, 2, 3])
def test_every_reader_reports_a_lost_log_entry_and_nothing_is_collected(
    lake: Lake, lost: int
) -> None:
    artifacts = [put_text(lake, text) for text in "abc"]
    entry = lake.path / "catalog" / "_delta_log" / f"{lost:020d}.json"
    content = entry.read_bytes()
    entry.unlink()
    fresh = Lake.open(lake.path)
    for refused in (fresh.rows, fresh.catalog.history, lambda: put_text(fresh, "d")):
        with pytest.raises(CorruptError, match=entry.name) as caught:
            refused()
        assert (caught.value.kind, caught.value.where) == ("log-gap", str(entry))
    assert [(f.kind, f.severity, f.where) for f in doctor(fresh, grace=NOW)] == [
        ("log-gap", Severity.ERROR, str(entry))
    ]
    assert kinds(verify_catalog(fresh)) == ["log-gap"]
    with pytest.raises(CorruptError, match=entry.name):
        collect(fresh, grace=NOW)
    entry.write_bytes(content)
    assert fresh.rows()["name"].to_pylist() == ["a", "b", "c"]
    assert all(object_of(fresh, artifact).exists() for artifact in artifacts)
    assert doctor(fresh, grace=NOW) == ()


def test_losing_the_last_commits_can_be_accepted_as_the_fix_says(lake: Lake) -> None:
    for text in "ab":
        put_text(lake, text)
    (lake.path / "catalog" / "_delta_log" / f"{2:020d}.json").unlink()
    finding = doctor(lake, grace=NOW)[0]
    marks = lake.path / "refs" / "newest"
    assert finding.fix is not None
    assert str(marks) in finding.fix
    for path in marks.iterdir():
        path.unlink()
    assert lake.rows()["name"].to_pylist() == ["a"]
    put_text(lake, "c")
    assert lake.rows()["name"].to_pylist() == ["a", "c"]


def flip(path: Place, position: int) -> None:
    data = bytearray(path.read_bytes())
    data[position] ^= 1
    path.write_bytes(data)


def test_a_bit_that_flips_anywhere_in_a_file_of_the_catalog_is_found_and_stops_collection(
    lake: Lake,
) -> None:
    put_text(lake, "a")
    lake.withdraw([put_text(lake, "b").id], "so that one file is of an older version only")
    name = abandon(lake, "orphan")
    assert verify_catalog(lake) == ()
    for path in (lake.path / "catalog").glob("*.parquet"):
        for position in (4, path.stat().st_size // 2, -9):
            flip(path, position)
            damage = [
                f for f in verify_catalog(Lake.open(lake.path)) if f.kind == "catalog-file-changed"
            ]
            assert [(f.where, f.severity) for f in damage] == [(str(path), Severity.ERROR)]
            with pytest.raises(CorruptError):
                collect(Lake.open(lake.path), grace=NOW)
            flip(path, position)
    assert lake.object_path(name).exists()
    path.unlink()
    assert "catalog-file-missing" in kinds(verify_catalog(Lake.open(lake.path)))


def of_an_earlier_version(lake: Lake) -> None:
    """Makes the log one that says nothing of refs, as versions of flagdata wrote it whose refs were
    files alone."""
    folder = lake.path / "catalog" / "_delta_log"
    noted: dict[str, str] = {}
    for path in sorted(folder.glob("*.json")):
        actions = [json.loads(line) for line in path.read_text().splitlines()]
        for action in actions:
            info = action.get("commitInfo", {})
            info.pop("flagdata.made", None)
            info.update(
                {"flagdata.previous_sha256": noted["before"]}
                if "flagdata.previous_sha256" in info
                else {}
            )
        text = "\n".join(
            json.dumps(action, ensure_ascii=False, separators=(",", ":")) for action in actions
        )
        overwrite(path, text.encode())
        noted["before"] = hashlib.sha256(text.encode()).hexdigest()
    for mark in (lake.path / "refs" / "newest").iterdir():
        overwrite(mark, f"{noted['before']}\n".encode())


def test_a_branch_whose_ref_is_lost_is_reported_and_its_objects_are_kept(lake: Lake) -> None:
    lake.branch("try")
    artifact = put_text(lake, "a", branch="try")
    of_an_earlier_version(lake)
    (lake.path / "refs" / "branches" / "try.json").unlink()
    lake = Lake.open(lake.path)
    assert kinds(doctor(lake, grace=NOW)) == ["branch-lost"]
    with pytest.raises(CorruptError, match="try"):
        collect(lake, grace=NOW)
    assert object_of(lake, artifact).exists()


def test_files_that_are_no_objects_are_strays_and_are_not_deleted(lake: Lake) -> None:
    stray = lake.path / "mcap" / "holiday.mcap"
    stray.write_bytes(b"mine")
    findings = doctor(lake)
    assert kinds(findings) == ["stray-file"]
    assert "move it out of the lake" in str(findings[0].fix)
    collect(lake, grace=NOW)
    assert stray.exists()


@pytest.mark.disk(AGES)
def test_an_orphan_is_left_alone_for_the_grace_period(lake: Lake) -> None:
    name = abandon(lake, "orphan")
    young = doctor(lake, grace=DAY)
    assert [(f.kind, f.severity) for f in young] == [("orphan", Severity.NOTE)]
    assert is_healthy(young)
    assert collect(lake, grace=DAY).objects == ()
    age(lake.object_path(name), timedelta(hours=25))
    assert not is_healthy(doctor(lake, grace=DAY))
    assert garbage(lake, grace=DAY).objects == (name,)
    assert lake.object_path(name).exists()
    assert collect(lake, grace=DAY).objects == (name,)
    with pytest.raises(NotFoundError):
        lake.object_path(name)
    assert doctor(lake, grace=NOW) == ()


@pytest.mark.parametrize("ahead", [-7200.0, 7200.0])
def test_what_is_young_by_the_clock_of_its_disk_is_kept_whatever_this_machines_says(
    lake: Lake, monkeypatch: pytest.MonkeyPatch, ahead: float
) -> None:
    orphan, withdrawn = abandon(lake, "orphan"), put_text(lake, "withdrawn")
    lake.withdraw([withdrawn.id], "out of focus")
    hour = timedelta(hours=1)
    with monkeypatch.context() as patch:
        patch.setattr(time, "time", lambda now=time.time: now() + ahead)
        assert [found.severity for found in doctor(lake, grace=hour)] == [Severity.NOTE]
        assert collect(lake, grace=hour).objects == ()
    assert set(collect(lake, grace=NOW).objects) == {orphan, str(withdrawn.object)}


def test_collection_spares_what_a_running_transaction_has_put(lake: Lake) -> None:
    with lake.transaction("long running") as tx:
        path = tx.staging(".mcap")
        path.write_text("slow")
        name = tx.put(path)
        unfinished = tx.staging(".mcap")
        unfinished.write_text("half")
        assert collect(lake, grace=NOW).leftovers == ()
        assert unfinished.exists()
        artifact = Artifact(kind=Kind.WIND, name="slow", object=name)
        tx.add(artifact)
    assert lake.object_path(name).read_text() == "slow"
    assert doctor(lake, grace=NOW) == ()


@pytest.mark.disk(AGES)
def test_collection_spares_an_old_orphan_that_a_running_transaction_has_found_again(
    lake: Lake,
) -> None:
    name = abandon(lake, "again")
    age(lake.object_path(name), timedelta(days=30))
    with lake.transaction("again") as tx:
        path = tx.staging(".mcap")
        path.write_text("again")
        assert tx.put(path) == name
        assert collect(lake, grace=NOW).objects == ()
        tx.add(Artifact(kind=Kind.WIND, name="again", object=name))
    assert lake.object_path(name).read_text() == "again"


@pytest.mark.disk("a lease in a bucket is one object, which nobody finds half gone")
def test_a_transaction_ends_only_when_no_collector_can_see_it_half_gone(lake: Lake) -> None:
    begun, go_on = threading.Event(), threading.Event()

    def hold() -> None:
        with lake.transaction("held open"):
            begun.set()
            go_on.wait(500)

    holder = threading.Thread(target=hold)
    holder.start()
    assert begun.wait(500)
    with collecting(lake.staging):
        go_on.set()
        holder.join(0.3)  # it wants to end, and may not yet
        assert [state.alive for state in leases(lake.staging)] == [True]
    holder.join(500)
    assert leases(lake.staging) == []


@pytest.mark.disk(LOCKS)
def test_a_collector_that_waits_is_let_in_before_the_writers_that_come_after_it(lake: Lake) -> None:
    entered: list[str] = []

    def collector() -> None:
        with collecting(lake.staging):
            entered.append("collector")

    def writer() -> None:
        with keeping_collectors_out(lake.staging):
            entered.append("writer")

    first, second = threading.Thread(target=collector), threading.Thread(target=writer)
    with keeping_collectors_out(lake.staging):
        first.start()
        while is_free(lake.staging / ".turn"):
            time.sleep(0.001)
        second.start()  # without the turnstile it would enter at once, beside this writer
        second.join(0.3)
        assert entered == []
    for thread in (first, second):
        thread.join()
    assert entered == ["collector", "writer"]


def is_free(lock: Path) -> bool:
    """Whether nobody holds the lock."""
    with lock.open("a") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
    return True


@pytest.mark.disk(AGES)
def test_a_withdrawn_row_leaves_the_branch_stays_at_tags_and_keeps_its_object_while_a_tag_needs_it(
    lake: Lake,
) -> None:
    tagged = put_text(lake, "tagged")
    lake.tag("v1")
    untagged = put_text(lake, "untagged")
    lake.withdraw([tagged.id, untagged.id], "a person asked for it")
    assert lake.rows().num_rows == 0
    assert lake.rows(at="v1")["name"].to_pylist() == ["tagged"]
    for artifact in (tagged, untagged):
        age(object_of(lake, artifact), timedelta(days=30))
    assert collect(lake, grace=DAY).objects == ()  # old, but withdrawn only now
    time.sleep(0.01)  # so that the withdrawal is older than no time at all
    assert collect(lake, grace=NOW).objects == (untagged.object,)
    assert object_of(lake, tagged).read_bytes() == b"tagged"
    assert [(f.kind, f.severity) for f in doctor(lake, grace=NOW)] == [
        ("withdrawn-collected", Severity.NOTE)
    ]
    assert put_text(lake, "untagged").id == untagged.id
    assert doctor(lake, grace=NOW) == ()
    assert lake.rows()["name"].to_pylist() == ["untagged"]


def test_withdrawal_spares_what_others_were_made_from_and_what_other_branches_show(
    lake: Lake,
) -> None:
    parent = put_text(lake, "parent")
    child = put_text(lake, "child", parents=(parent.id,))
    lake.branch("try")
    with pytest.raises(ConflictError, match="child"):
        lake.withdraw([parent.id], "no")
    later = put_text(lake, "later")
    with pytest.raises(NotFoundError, match="is not on branch 'try'"):
        lake.withdraw([later.id], "no", branch="try")
    lake.withdraw([child.id], "to try without it", branch="try")
    assert lake.rows(at="try")["name"].to_pylist() == ["parent"]
    assert lake.rows().num_rows == 3
    lake.withdraw([parent.id, child.id], "both")
    assert lake.rows(at="try")["name"].to_pylist() == ["parent"]


def clips(lake: Lake, recording: Artifact, count: int) -> list[Artifact]:
    made = [
        Artifact(
            kind=Kind.CLIP,
            name=f"clip {i}",
            object=recording.object,
            parents=(recording.id,),
            frame_first=30 * i,
            frame_count=30,
        )
        for i in range(count)
    ]
    with lake.transaction("clips") as tx:
        for clip in made:
            tx.add(clip)
    return made


def test_clips_go_along_with_their_recording_and_what_was_made_from_it_otherwise_does_not(
    lake: Lake,
) -> None:
    recording, other = put_text(lake, "recording"), put_text(lake, "other")
    own, others = clips(lake, recording, 3), clips(lake, other, 2)
    measured = put_text(lake, "measured", parents=(own[1].id,))
    of_measured = put_text(lake, "of measured", parents=(measured.id, other.id))
    with pytest.raises(ConflictError, match=r"measured.*--with-descendants"):
        lake.withdraw([recording.id], "wrong camera")
    assert lake.descendants([recording.id]) == {clip.id for clip in own} | {
        measured.id,
        of_measured.id,
    }
    done = lake.withdraw([recording.id, measured.id, of_measured.id], "wrong camera")
    assert done.clips == tuple(sorted(clip.id for clip in own))
    assert set(lake.rows()["artifact"].to_pylist()) == {other.id, *(clip.id for clip in others)}
    one = lake.withdraw([others[0].id], "blurred")
    assert (one.asked, one.clips) == ((others[0].id,), ())
    assert doctor(lake, grace=DAY) == ()


def test_a_difference_names_rows_and_objects_both_ways(lake: Lake) -> None:
    gone = put_text(lake, "gone")
    lake.tag("before")
    came = put_text(lake, "came")
    lake.withdraw([gone.id], "wrong file")
    found = difference(lake, "before", None)
    assert found.added["artifact"].to_pylist() == [came.id]
    assert found.removed["artifact"].to_pylist() == [gone.id]
    assert found.objects_added == (came.object,)
    assert found.objects_removed == (gone.object,)
    back = difference(lake, "main", "before")
    assert back.removed["artifact"].to_pylist() == [came.id]


@pytest.mark.disk(LOCKS)
def test_leftovers_of_the_commit_protocol_are_explained_and_collected(lake: Lake) -> None:
    put_text(lake, "a")
    orphan = abandon(lake, "orphan")
    left = [
        lake.path / "catalog" / "0123.parquet",
        lake.path / "catalog" / "_delta_log" / "00000000000000000009.json#1",
        *(
            lake.path / folder / f".{0:032x}"
            for folder in (".", "refs/tags", "refs/newest", "catalog/_delta_log")
        ),
    ]
    for path in left:
        path.write_text("half")
    dead = lake.staging / "0123"
    dead.mkdir()
    owner = {"pid": 1, "host": "here", "since": "then"}
    (dead / "lease").write_text(f"{json.dumps(owner)}\n{orphan}\n")
    findings = doctor(lake, grace=NOW)
    assert sorted(kinds(findings)) == ["orphan", "staging-left", *["write-left"] * len(left)]
    assert "process 1 on here" in next(f.what for f in findings if f.kind == "staging-left")
    collected = collect(lake, grace=NOW)
    assert set(collected.leftovers) == {*left, dead}
    assert collected.objects == (orphan,)  # the dead hold nothing
    assert doctor(lake, grace=NOW) == ()
    assert lake.rows().num_rows == 1


@pytest.mark.disk(AGES)
def test_staged_files_without_a_lease_are_reported_and_collected_after_the_grace_period(
    lake: Lake,
) -> None:
    file, folder = lake.staging / "notes.txt", lake.staging / "mine"
    folder.mkdir()
    for path in (file, folder / "inner.mcap"):
        path.write_text("mine")
    young = doctor(lake, grace=DAY)
    assert [(f.kind, f.severity, f.where) for f in young] == [
        ("staging-unleased", Severity.NOTE, str(path)) for path in (folder, file)
    ]
    assert {f.fix for f in young} == {"none needed; flagdata gc takes it, once it is 24 h old"}
    assert collect(lake, grace=DAY).leftovers == ()
    age(file, timedelta(days=3))
    age(folder, timedelta(days=3))
    assert not is_healthy(doctor(lake, grace=DAY))
    assert collect(lake, grace=DAY).leftovers == (file,)  # in the folder something is young
    age(folder / "inner.mcap", timedelta(days=3))
    age(folder, timedelta(days=3))
    assert collect(lake, grace=DAY).leftovers == (folder,)
    assert doctor(lake, grace=NOW) == ()


@pytest.mark.disk(LINKS)
def test_a_link_in_staging_is_deleted_and_what_it_leads_to_is_not(
    lake: Lake, tmp_path: Path
) -> None:
    target = tmp_path / "mine"
    target.mkdir()
    (target / "thesis.txt").write_text("mine")
    link = lake.staging / "link"
    link.symlink_to(target)
    assert kinds(doctor(lake, grace=NOW)) == ["staging-unleased"]
    assert collect(lake, grace=NOW).leftovers == (link,)
    assert (target / "thesis.txt").read_text() == "mine"
    assert doctor(lake, grace=NOW) == ()


def test_a_sample_is_of_the_size_asked_for_and_never_larger_than_all() -> None:
    names = [f"mcap/{i}" for i in range(10)]
    drawn = sample_names(names, 4)
    assert len(set(drawn)) == 4
    assert set(drawn) <= set(names)
    assert sample_names(names, 99) == names


def test_values_in_the_log_that_no_writer_writes_are_refused(lake: Lake) -> None:
    put_text(lake, "a")
    entry = max((lake.path / "catalog" / "_delta_log").glob("*.json"))
    sound = entry.read_bytes().decode()
    assert Lake.open(lake.path).catalog.history()
    for key, value in (
        ("timestamp", "now"),
        ("timestamp", 10**18),
        ("timestamp", -1),
        ("timestamp", None),
        ("operation", 3),
        ("flagdata.branch", None),
        ("flagdata.message", [1]),
    ):
        lines = [json.loads(line) for line in sound.splitlines()]
        (holder,) = (line["commitInfo"] for line in lines if "commitInfo" in line)
        assert key in holder
        holder[key] = value
        if value is None:
            del holder[key]
        entry.write_bytes("\n".join(map(json.dumps, lines)).encode())
        with pytest.raises(CorruptError, match="log"):
            Lake.open(lake.path).catalog.history()


def test_an_entry_before_the_checkpoint_that_is_cut_off_is_named(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(catalog, "_TIDY_EVERY", 3)
    for text in "abcde":
        put_text(lake, text)
    log = lake.path / "catalog" / "_delta_log"
    assert list(log.glob("*.checkpoint.parquet"))
    entry = log / f"{1:020d}.json"
    entry.write_bytes(entry.read_bytes()[: len(entry.read_bytes()) // 2])
    with pytest.raises(CorruptError, match=entry.name):
        Lake.open(lake.path).catalog.changed_entries()
