"""Several processes at once, and processes that die: nothing acknowledged is lost, nothing dangles."""

from __future__ import annotations

import random
import subprocess
import time
from collections.abc import Callable
from datetime import timedelta

from flagdata.findings import Severity
from flagdata.lake import Lake
from flagdata.lake.collect import collect
from flagdata.lake.health import doctor, object_names, verify

NOW = timedelta(0)
Start = Callable[..., subprocess.Popen[str]]


def finish(worker: subprocess.Popen[str]) -> list[str]:
    """Ids acknowledged by a worker that has ended or been killed."""
    out, errors = worker.communicate(timeout=120)
    assert worker.returncode in (0, -9), errors
    lines = out.split("\n")
    assert lines[0] in ("ready", "")
    return lines[1:-1]  # the last is empty, or was being written when it died


def test_four_processes_ingesting_at_once_lose_no_row(lake: Lake, start_worker: Start) -> None:
    workers = [start_worker(f"w{i}", count=25, shared=5) for i in range(4)]
    acknowledged = [finish(worker) for worker in workers]
    assert [len(ids) for ids in acknowledged] == [30] * 4
    expected = {identity for ids in acknowledged for identity in ids}
    assert len(expected) == 4 * 25 + 5
    rows = lake.rows()["artifact"].to_pylist()
    assert len(rows) == len(expected)  # the five shared sources raced, and are there once
    assert set(rows) == expected
    assert doctor(lake, grace=NOW) == ()
    assert verify(lake, object_names(lake)) == ()


def test_collection_beside_ingests_deletes_nothing_that_they_publish(lake: Lake, start_worker: Start) -> None:
    workers = [start_worker(f"w{i}", count=20, shared=3) for i in range(2)]
    collections = 0
    while any(worker.poll() is None for worker in workers):
        collect(lake, grace=NOW)
        collections += 1
    acknowledged = {identity for worker in workers for identity in finish(worker)}
    assert collections >= 10  # the test has tested something
    assert acknowledged == set(lake.rows()["artifact"].to_pylist())
    assert len(acknowledged) == 2 * 20 + 3
    assert doctor(lake, grace=NOW) == ()
    assert verify(lake, object_names(lake)) == ()


def test_fifty_kills_during_ingest_lose_nothing_acknowledged(lake: Lake, start_worker: Start) -> None:
    moments = random.Random(2020)
    acknowledged: set[str] = set()
    for wave in range(25):
        pair = [start_worker(f"wave{wave}-{i}", count=1000, shared=3) for i in range(2)]
        for worker in pair:
            assert worker.stdout is not None
            assert worker.stdout.readline() == "ready\n"
        # An ingest takes 30 to 150 ms; over the waves the kills fall on all of its steps.
        for worker in pair:
            time.sleep(moments.uniform(0, 0.3))
            worker.kill()
        for worker in pair:
            out, _ = worker.communicate(timeout=60)
            acknowledged.update(out.split("\n")[:-1])
    rows = lake.rows()["artifact"].to_pylist()
    assert len(acknowledged) >= 25  # the test has tested something
    assert acknowledged <= set(rows)
    assert len(rows) == len(set(rows))
    before = doctor(lake, grace=NOW)
    assert [f for f in before if f.severity is Severity.ERROR] == []
    assert any(f.kind == "staging-left" for f in before)
    collect(lake, grace=NOW)
    assert doctor(lake, grace=NOW) == ()
    assert verify(lake, object_names(lake)) == ()
