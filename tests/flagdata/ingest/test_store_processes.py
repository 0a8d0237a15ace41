"""Real files ingested by several processes at once, and by processes that are killed."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path

import pytest

from flagdata.lake import Lake
from flagdata.lake.collect import collect
from flagdata.lake.health import doctor, object_names, verify
from flagdata.record import Record

NOW = timedelta(0)
_WORKER = Path(__file__).with_name("store_worker.py")


@dataclass(frozen=True, kw_only=True)
class Child:
    """A process that ingests; `said` is the file it reports to, see store_worker.py."""

    said: Path

    def lines(self) -> list[str]:
        return self.said.read_text().split("\n")[:-1] if self.said.exists() else []

    def wait(self, lines: int) -> None:
        """Until it has written so many lines."""
        deadline = time.monotonic() + 120
        while len(self.lines()) < lines:
            assert "failed" not in self.lines()
            assert time.monotonic() < deadline
            time.sleep(0.005)

    def acknowledged(self) -> list[str]:
        return [line for line in self.lines()[1:] if line not in ("done", "failed")]

    def kill(self) -> None:
        try:
            os.kill(int(self.lines()[0]), signal.SIGKILL)
        except ProcessLookupError:
            assert self.lines()[-1] == "done"


@pytest.fixture
def lake(tmp_path: Path) -> Lake:
    return Lake.create(tmp_path / "lake")


@pytest.fixture
def start(lake: Lake, tmp_path: Path) -> Iterator[Callable[..., Child]]:
    """Starts a child that ingests the given sources in order."""
    with subprocess.Popen([sys.executable, _WORKER, lake.path], stdin=subprocess.PIPE, text=True) as server:
        assert server.stdin is not None
        stdin, count = server.stdin, 0

        def start(sources: list[Path]) -> Child:
            nonlocal count
            count += 1
            child = Child(said=tmp_path / f"said-{count}")
            stdin.write("\t".join(map(str, [child.said, *sources])) + "\n")
            stdin.flush()
            return child

        yield start
        stdin.close()


def _logs(folder: Path, count: int) -> list[Path]:
    """Logs of a minute, all different."""
    folder.mkdir()
    paths = []
    for number in range(count):
        rows = [f"2026-05-01T12:00:{k:02d}Z,{4 + k % 17 / 10 + number / 1000:.3f}" for k in range(60)]
        path = folder / f"{number}.csv"
        path.write_text("\n".join(["time,wind_speed (m/s)", *rows, ""]))
        paths.append(path)
    return paths


def test_four_processes_times_thirty_ingests_lose_nothing_and_make_nothing_twice(
    lake: Lake, tmp_path: Path, video: Path, start: Callable[..., Child]
) -> None:
    logs = _logs(tmp_path / "logs", 4 + 4 * 25)
    shared = [video, *logs[:4]]
    children = [start([*shared, *logs[4 + 25 * k : 29 + 25 * k]]) for k in range(4)]
    for child in children:
        child.wait(1 + 30 + 1)
    said = [line.split() for child in children for line in child.acknowledged()]
    assert len(said) == 120
    rows = lake.rows()["artifact"].to_pylist()
    assert sorted(rows) == sorted({identity for identity, _ in said})
    # Each was new to exactly one process, however the shared ones raced.
    assert sorted(identity for identity, state in said if state == "new") == sorted(rows)
    assert len(rows) == 4 * 25 + 5
    assert doctor(lake, grace=NOW) == ()
    assert verify(lake, object_names(lake)) == ()


def test_kills_during_ingest_lose_nothing_acknowledged_and_the_next_ingest_completes(
    lake: Lake, tmp_path: Path, write_video: Callable[..., Path], start: Callable[..., Child]
) -> None:
    moments = random.Random(11)
    *logs, first_log = _logs(tmp_path / "logs", 41)
    *videos, first_video = (write_video(tmp_path / f"{k}.mp4", frames=60 + k, rate=25) for k in range(11))
    whole = start([first_video, first_log])
    whole.wait(1)
    began = time.monotonic()
    whole.wait(4)
    pace = time.monotonic() - began
    acknowledged: set[str] = set()
    for wave in range(10):
        pair = [start([videos[wave], *logs[4 * wave : 4 * wave + 2]]), start(logs[4 * wave : 4 * wave + 4])]
        for child in pair:
            child.wait(1)
        # What a video and a log take together, on this machine now: the kills fall on all of their steps.
        for child in pair:
            time.sleep(moments.uniform(0, pace))
            child.kill()
        acknowledged |= {line.split()[0] for child in pair for line in child.acknowledged()}
    rows = lake.rows()["artifact"].to_pylist()
    assert 3 <= len(acknowledged) < 50  # the test has tested something
    assert acknowledged <= set(rows)
    assert len(rows) == len(set(rows))
    last = start([first_video, *videos, first_log, *logs])
    last.wait(1 + 52 + 1)
    again = dict(line.split() for line in last.acknowledged())
    assert all(again[identity] == "known" for identity in rows)
    table = lake.rows().to_pylist()
    assert len(table) == 52
    for row in table:
        assert Record.open(lake.object_path(row["object"])).frame_count == (row["frame_count"] or 0)
    collect(lake, grace=NOW)
    assert doctor(lake, grace=NOW) == ()
    assert verify(lake, object_names(lake)) == ()
