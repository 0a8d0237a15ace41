"""A Dask scheduler and its workers, in processes of their own."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

from tests import pausing


class Cluster:
    """A scheduler and workers in processes of their own, on loopback."""

    def __init__(self, folder: Path, *, workers: int) -> None:
        self._folder = folder
        self._file = folder / "scheduler.json"
        self.scheduler = self._start(
            "scheduler", "--host", "127.0.0.1", "--port", "0", "--idle-timeout", "3600"
        )
        self.workers: list[subprocess.Popen[bytes]] = []
        for _ in range(workers):
            self.add_worker()

    def add_worker(self) -> None:
        place = str(self._folder / f"worker-{len(self.workers)}")
        # The last: nothing stays behind a test run that is killed.
        options = (
            "--nthreads",
            "1",
            "--no-nanny",
            "--local-directory",
            place,
            "--death-timeout",
            "60",
        )
        self.workers.append(self._start("worker", *options))

    def _start(self, role: str, *options: str) -> subprocess.Popen[bytes]:
        command = [
            sys.executable,
            "-m",
            "dask",
            role,
            "--scheduler-file",
            str(self._file),
            "--no-dashboard",
            *options,
        ]
        return subprocess.Popen(
            command,
            env={**pausing.finding_tests(), "OMP_NUM_THREADS": "1", "PYTHONWARNINGS": "ignore"},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )

    @property
    def address(self) -> str:
        for _ in range(600):
            with suppress(OSError, ValueError, KeyError):
                return json.loads(self._file.read_text())["address"]
            time.sleep(0.1)
        raise TimeoutError("the scheduler did not start")

    def close(self) -> None:
        for process in (*self.workers, self.scheduler):
            process.kill()
            process.wait()
