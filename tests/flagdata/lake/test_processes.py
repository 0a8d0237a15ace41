"""Several processes at once, and processes that die: nothing acknowledged is lost, nothing
dangles."""

from __future__ import annotations

import random
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta
from pathlib import Path
from typing import Any

import pytest

from flagdata.core.findings import Severity
from flagdata.errors import ConflictError
from flagdata.lake import Lake, Log, attempts, collect, doctor, object_names, verify
from flagdata.lake.commits import Change, commit
from tests.flagdata.lake.conftest import put_text

NOW = timedelta(0)


def test_four_processes_ingesting_at_once_lose_no_row(
    lake: Lake, start_worker: Callable[..., Any]
) -> None:
    workers = [start_worker(f"w{i}", count=8, shared=5) for i in range(4)]
    for worker in workers:
        worker.await_line("done")
    assert [len(worker.acknowledged()) for worker in workers] == [13] * 4
    expected = {identity for worker in workers for identity in worker.acknowledged()}
    assert len(expected) == 4 * 8 + 5
    rows = lake.rows()["artifact"].to_pylist()
    assert len(rows) == len(expected)  # the five shared sources raced, and are there once
    assert set(rows) == expected
    merges = [
        entry for entry in lake.catalog.history() if entry.get("message", "").startswith("merge ")
    ]
    assert (
        len(merges) == 1
    )  # of the catalog's files, after 32 of some 40 versions, overtaken by no commit
    assert doctor(lake, grace=NOW) == ()
    assert verify(lake, object_names(lake)) == ()


def test_the_history_at_a_head_is_the_same_while_others_commit(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    put_text(lake, "before")
    expected = Lake.open(lake.path).catalog.history()
    assert [entry["version"] for entry in expected] == list(range(len(expected)))[::-1]
    reader = Lake.open(lake.path).catalog
    opened = reader._open

    def then_others_commit(version: int) -> object:
        table = opened(version)
        for text in ("one", "two", "three"):
            put_text(lake, text)
        return table

    monkeypatch.setattr(reader, "_open", then_others_commit)
    assert reader.history() == expected


def test_a_commit_that_waited_for_a_collection_does_not_give_up_at_the_first_other_commit(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(attempts, "_PATIENCE", -1.0)  # used up by the wait
    monkeypatch.setattr(attempts, "_LONGEST_WAIT", 0.0)
    outcomes = iter([attempts.Moved(), attempts.Moved()])

    def attempt() -> str:
        for moved in outcomes:
            raise moved
        return "published"

    assert attempts.persist(attempt, looks=attempts.Looks(), where=Path("catalog")) == "published"

    def overtaken() -> str:
        raise attempts.Moved

    with pytest.raises(ConflictError, match="kept committing"):
        attempts.persist(overtaken, looks=attempts.Looks(), where=Path("catalog"))


def test_an_attempt_looks_for_the_newest_version_once(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    put_text(lake, "one")
    looked: list[str] = []
    head = Log.head

    def counting(log: Log) -> int:
        looked.append(threading.current_thread().name)
        return head(log)

    monkeypatch.setattr(Log, "head", counting)
    lake.tag("v1")
    assert len(looked) <= 3  # before it, within it, after its commit
    looked.clear()
    lake.catalog.head()
    lake.catalog.head()
    assert len(looked) == 2  # outside an attempt nothing is kept


def test_an_attempt_that_another_overtook_looks_anew(lake: Lake) -> None:
    put_text(lake, "one")
    other, seen = Lake.open(lake.path), list[int]()

    def attempt() -> int:
        seen.append(lake.catalog.head())
        if len(seen) == 1:
            put_text(other, "two")
        assert lake.catalog.head() == seen[-1]
        return commit(lake, Change(message="of one moment"), base=seen[-1])

    version = attempts.persist(attempt, looks=lake.catalog.looks, where=lake.path)
    assert seen[1] > seen[0]
    assert version == seen[1] + 1 == lake.catalog.head()


def test_what_an_attempt_found_is_its_threads_own(lake: Lake) -> None:
    put_text(lake, "one")
    with lake.catalog.looks.once():
        before = lake.catalog.head()
        put_text(Lake.open(lake.path), "two")
        with ThreadPoolExecutor(1) as other:
            assert other.submit(lake.catalog.head).result() > before
        assert lake.catalog.head() == before
    assert lake.catalog.head() > before


def test_a_process_reads_what_others_committed_once_and_finds_the_history_that_a_fresh_one_does(
    lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    reader = Lake.open(lake.path).catalog
    put_text(lake, "one")
    assert reader.history()[0]["message"] == "ingest one"
    read: list[int] = []
    of_one = reader._entries._read
    monkeypatch.setattr(
        reader._entries, "_read", lambda version: read.append(version) or of_one(version)
    )
    put_text(lake, "two")
    lake.branch("side")
    put_text(lake, "three", branch="side")
    assert reader.history() == Lake.open(lake.path).catalog.history()
    assert read == [2, 3, 4]
    assert reader.history(1)[0]["message"] == "ingest three"
    assert read == [2, 3, 4]


def test_collection_beside_ingests_deletes_nothing_that_they_publish(
    lake: Lake, start_worker: Callable[..., Any]
) -> None:
    workers = [start_worker(f"w{i}", count=1000, shared=3) for i in range(2)]
    for _ in range(6):
        collect(lake, grace=NOW)
        for worker in workers:
            worker.await_acknowledged(1)
    for worker in workers:
        worker.stop()
    acknowledged = {identity for worker in workers for identity in worker.acknowledged()}
    assert (
        len(acknowledged) >= 2 * 6 - 3
    )  # one at least of each worker and round, three of which they may share
    assert acknowledged == set(lake.rows()["artifact"].to_pylist())
    assert doctor(lake, grace=NOW) == ()
    assert verify(lake, object_names(lake)) == ()


def test_kills_during_ingest_lose_nothing_acknowledged(
    lake: Lake, start_worker: Callable[..., Any]
) -> None:
    began = time.monotonic()
    undisturbed = [start_worker(f"undisturbed-{i}", count=3) for i in range(2)]
    for worker in undisturbed:
        worker.await_line("ready")
        began = time.monotonic()
    for worker in undisturbed:
        worker.await_line("done")
    one_ingest = (
        time.monotonic() - began
    ) / 3  # beside another process's, on this disk or store, under this load
    moments = random.Random(2020)
    killed = []
    for wave in range(6):
        pair = [start_worker(f"wave{wave}-{i}", count=1000, shared=3) for i in range(2)]
        for worker in pair:
            worker.await_line("ready")
        for worker in pair:  # over the waves the kills fall on all steps of the first ingests
            worker.await_acknowledged(moments.randrange(2))
            time.sleep(moments.uniform(0, one_ingest))
            worker.kill()
        killed += pair
    acknowledged = set().union(*(worker.acknowledged() for worker in (*undisturbed, *killed)))
    rows = lake.rows()["artifact"].to_pylist()
    assert sum(worker.was_interrupted() for worker in killed) >= 6  # the test has tested something
    assert any(worker.acknowledged() for worker in killed)
    assert acknowledged <= set(rows)
    assert len(rows) == len(set(rows))
    before = doctor(lake, grace=NOW)
    assert [f for f in before if f.severity is Severity.ERROR] == []
    assert any(f.kind == "staging-left" for f in before)
    collect(lake, grace=NOW)
    assert doctor(lake, grace=NOW) == ()
    assert verify(lake, object_names(lake)) == ()
