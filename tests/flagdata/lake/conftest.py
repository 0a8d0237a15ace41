"""A lake, and processes that write to it."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from flagdata.lake import Artifact, Lake
from flagdata.schema import Kind

_WORKER = Path(__file__).with_name("ingest_worker.py")


@pytest.fixture
def lake(tmp_path: Path) -> Lake:
    return Lake.create(tmp_path / "lake")


@pytest.fixture
def put_text() -> Callable[..., Artifact]:
    """Commits one row whose object is a small text."""

    def put(lake: Lake, text: str, *, branch: str = "main", parents: tuple[str, ...] = ()) -> Artifact:
        with lake.transaction(f"ingest {text}", branch=branch) as tx:
            path = tx.staging(".mcap")
            path.write_text(text)
            name = tx.put(path)
            artifact = Artifact(
                kind=Kind.WIND, name=text, object=name, source_hash=name.partition("/")[2], parents=parents
            )
            tx.add(artifact)
        return artifact

    return put


@pytest.fixture
def start_worker(lake: Lake) -> Callable[..., subprocess.Popen[str]]:
    """Starts a process that ingests into the lake; see ingest_worker.py for what it prints."""

    def start(prefix: str, *, count: int, shared: int = 0) -> subprocess.Popen[str]:
        command = [sys.executable, str(_WORKER), str(lake.path), prefix, str(count), str(shared)]
        return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)

    return start
