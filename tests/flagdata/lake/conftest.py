"""A lake, and processes that write to it."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest

from flagdata.core.provenance import recipe_hash
from flagdata.core.schema import Kind
from flagdata.lake import Artifact, Lake, lake_locks
from flagdata.storage import Place

AGES = "it sets the age of files, which a store gives them itself"
LINKS = "a bucket has no links, pipes and permissions of files"
LOCKS = (
    "a bucket has no locks of the kernel; `test_leases_in_a_bucket.py` has those that it has "
    "instead"
)
"""Why a test is marked `disk`."""
_WORKER = Path(__file__).with_name("ingest_worker.py")
_ENDS = {"done", "failed", "killed"}


def dead_owner() -> dict[str, object]:
    """What a process of this machine noted that has ended."""
    with subprocess.Popen(["sleep", "60"]) as process:
        started = lake_locks._start_of_process(process.pid)
        process.kill()
    return {**lake_locks.owner(), "pid": process.pid, "started": started}


def put_text(
    lake: Lake, text: str, *, branch: str = "main", parents: tuple[str, ...] = ()
) -> Artifact:
    """Commits one row whose object is a small text."""
    with lake.transaction(f"ingest {text}", branch=branch) as tx:
        path = tx.staging(".mcap")
        path.write_text(text)
        name = tx.put(path)
        artifact = Artifact(
            kind=Kind.WIND,
            name=text,
            object=name,
            source_hash=name.partition("/")[2],
            parents=parents,
        )
        tx.add(artifact)
    return artifact


def put_older_ref(
    lake: Lake, kind: str, name: str, *, created: str = "2026-05-14T09:30:00+00:00"
) -> Place:
    """Makes a tag or branch from the head of main, as versions of flagdata did whose refs were
    files alone."""
    content: dict[str, object] = {
        "schema": "flagdata.ref/1",
        "name": name,
        "created": created,
        "view": [{"branch": "main", "version": lake.catalog.head()}],
    }
    path = lake.refs.root / kind / f"{name}.json"
    path.write_bytes(
        (json.dumps({**content, "sha256": recipe_hash(content)}, indent=2) + "\n").encode()
    )
    return path


@pytest.fixture(params=["folder", "bucket"])
def place(request: pytest.FixtureRequest) -> Lake:
    """An empty lake, in a folder and in a bucket."""
    return request.getfixturevalue("lake" if request.param == "folder" else "remote_lake")


def stored(lake: Lake) -> set[str]:
    """Names of all objects of a lake."""
    return {one.name for one in lake.objects}


def overwrite(place: Place, data: bytes) -> None:
    """Change a file of a lake behind its back."""
    if isinstance(place, Path):
        place.chmod(0o644)
    place.write_bytes(data)


@dataclass(frozen=True, kw_only=True)
class Worker:
    """A process that ingests; `said` is the file it reports to, see ingest_worker.py."""

    said: Path

    def lines(self) -> list[str]:
        """Whole lines it has written."""
        return self.said.read_text().split("\n")[:-1] if self.said.exists() else []

    def await_line(self, line: str) -> None:
        self._await(lambda: line in self.lines())

    def _await(self, there: Callable[[], bool]) -> None:
        deadline = time.monotonic() + 500
        while not there():
            assert "failed" not in self.lines()
            assert time.monotonic() < deadline
            time.sleep(0.005)

    def await_acknowledged(self, count: int) -> None:
        """Until it has acknowledged so many more artifacts."""
        wanted = len(self.acknowledged()) + count
        self._await(lambda: len(self.acknowledged()) >= wanted)

    def stop(self) -> None:
        """Let it end after what it ingests now."""
        Path(f"{self.said}-stop").touch()
        self.await_line("done")

    def kill(self) -> None:
        assert "failed" not in self.lines()  # its traceback is among what was captured
        os.kill(int(self.lines()[0]), signal.SIGKILL)
        with self.said.open("a") as file:
            file.write("killed\n")

    def is_running(self) -> bool:
        return _ENDS.isdisjoint(self.lines())

    def was_interrupted(self) -> bool:
        """Whether it was killed between the begin of an ingest and its acknowledgement."""
        return self.lines()[-2:] == ["begun", "killed"]

    def acknowledged(self) -> set[str]:
        """Ids of the artifacts whose with-block it had left."""
        return {line for line in self.lines()[2:] if re.fullmatch(r"[0-9a-f]{32}", line)}


@pytest.fixture
def start_worker(lake: Lake, tmp_path: Path) -> Iterator[Callable[..., Worker]]:
    """Starts a process that ingests, given its name and how many sources of its own and shared
    ones."""
    workers: list[Worker] = []
    command = [sys.executable, str(_WORKER), str(lake.path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, text=True) as server:
        assert server.stdin is not None

        def start(prefix: str, *, count: int, shared: int = 0) -> Worker:
            worker = Worker(said=tmp_path / f"said-{prefix}")
            workers.append(worker)
            server.stdin.write(f"{prefix} {count} {shared} {worker.said}\n")
            server.stdin.flush()
            return worker

        yield start
        server.stdin.close()
        for worker in workers:  # of a test that failed
            if worker.is_running() and worker.lines():
                worker.kill()
