"""Locks of a lake in a bucket: leases that their holders renew, and that count no longer where they
were not."""

from __future__ import annotations

import itertools
import json
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta
from pathlib import Path

import pytest

from flagdata.errors import ConflictError, FlagdataError
from flagdata.lake import Lake, Lease, Transaction, collect, collecting, doctor, lake_locks
from flagdata.lake.leases import leases
from flagdata.storage import RemotePath
from tests.flagdata.lake.conftest import dead_owner, put_text

NOW = timedelta(0)
Use = Callable[[str], None]


def test_locks_of_a_process_that_was_killed_hold_nobody_up(remote_lake: Lake) -> None:
    text = json.dumps(dead_owner()).encode() + b"\n"
    (remote_lake.staging / "collect").write_bytes(text)
    (remote_lake.staging / "shared" / "a").write_bytes(text)
    (remote_lake.staging / ("0" * 32) / "lease").write_bytes(text)
    put_text(remote_lake, "gusts")
    remote_lake.tag("v1")
    assert [state.alive for state in leases(remote_lake.staging)] == [False]
    collect(remote_lake, grace=NOW)
    assert doctor(remote_lake, grace=NOW) == ()


def test_a_lease_of_another_machine_counts_until_it_was_not_renewed_for_its_life(
    bucket_folder: str,
) -> None:
    staging = RemotePath.parse(bucket_folder)
    owner = {**lake_locks.owner(), "machine": "another", "pid": 1, "started": 1}
    for life, folder in ((60.0, "0" * 32), (-60.0, "1" * 32)):
        (staging / folder / "lease").write_bytes(
            json.dumps({**owner, "life": life}).encode() + b"\nmcap/x\n"
        )
    assert [(state.alive, state.objects) for state in leases(staging)] == [
        (True, frozenset({"mcap/x"})),
        (False, frozenset({"mcap/x"})),
    ]


def test_a_lease_that_names_no_objects_stops_no_collection(remote_lake: Lake) -> None:
    lease = remote_lake.staging / ("0" * 32) / "lease"
    lease.write_bytes(json.dumps(lake_locks.owner()).encode() + b"\n../../x\n\xff\x1b[2J\nmcap/01")
    put_text(remote_lake, "gusts")
    assert [state.alive for state in leases(remote_lake.staging)] == [True]
    assert collect(remote_lake, grace=NOW).objects == ()


def test_who_was_cut_off_for_long_publishes_nothing(
    remote_lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    put = Transaction.put

    def slow(transaction: Transaction, path: Path) -> str:
        name = put(transaction, path)
        monkeypatch.setattr(lake_locks, "LIFE", 0.0)  # has passed since the lease was renewed
        return name

    monkeypatch.setattr(Transaction, "put", slow)
    with pytest.raises(FlagdataError, match="take this process for dead"):
        put_text(remote_lake, "late")
    monkeypatch.undo()
    assert remote_lake.rows().num_rows == 0


def test_a_long_wait_for_a_lock_is_reported_once(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(lake_locks, "_SILENT", 0.0)
    tries = list(itertools.islice(lake_locks._pauses(RemotePath("bucket", "lake/staging")), 4))
    assert len(tries) == 4
    assert caplog.text.count("waiting for another process") == 1


def test_a_lease_is_renewed_and_counts_where_the_system_has_no_clock_of_its_time_since_start(
    remote_lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr(time, "CLOCK_BOOTTIME")
    put_text(remote_lake, "gusts")
    assert remote_lake.rows().num_rows == 1


def test_the_exclusive_lock_keeps_writers_waiting(remote_lake: Lake) -> None:
    with ThreadPoolExecutor(1) as pool:
        with collecting(remote_lake.staging):
            written = pool.submit(put_text, Lake.open(remote_lake.path), "waits")
            time.sleep(0.5)
            assert remote_lake.rows().num_rows == 0
        written.result()
    assert remote_lake.rows().num_rows == 1


def test_a_lease_that_the_store_refuses_leaves_nothing_on_this_machine(
    remote_lake: Lake, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(*_: object) -> None:
        raise OSError("no answer")

    monkeypatch.setattr(lake_locks.TimedLocks, "note", refused)
    with pytest.raises(OSError, match="no answer"):
        Lease(remote_lake.staging)
    assert leases(tmp_path / "cache" / "staging") == []


def test_erasing_stops_where_its_lock_was_lost_on_the_way(
    remote_lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    one, two = put_text(remote_lake, "one"), put_text(remote_lake, "two")
    remove = remote_lake.objects.remove

    def slow(path: RemotePath) -> None:
        remove(path)
        monkeypatch.setattr(lake_locks, "LIFE", 0.0)  # has passed since the lock was renewed

    monkeypatch.setattr(remote_lake.objects, "remove", slow)
    with pytest.raises(ConflictError, match="take this process for dead"):
        remote_lake.erase([one.id, two.id], "asked to")
    monkeypatch.undo()
    assert sorted(remote_lake.objects.has(str(artifact.object)) for artifact in (one, two)) == [
        False,
        True,
    ]


def test_an_exclusive_lock_whose_renewal_was_answered_to_nobody_is_still_its_holders(
    remote_lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace = RemotePath.replace_if

    def unanswered(place: RemotePath, e_tag: str | None, data: bytes) -> str | None:
        replace(place, e_tag, data)
        return None  # what a second try finds after the first has acted

    with collecting(remote_lake.staging) as check:
        monkeypatch.setattr(RemotePath, "replace_if", unanswered)
    check()
    assert not (remote_lake.staging / "collect").exists()
