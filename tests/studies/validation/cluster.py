"""A data set built on one machine, and into a bucket by four workers of which one is killed and one
preempted.

The command reaches the bucket and the scheduler through forwarders that count its bytes; the
workers reach both directly. At `KILLED` of all sequences and films one worker is ended by SIGKILL,
at `PREEMPTED` another by SIGTERM, as a batch system takes a node back. Aims: the rows and objects
that one machine makes, and at most 1 % of all bytes through the command.
"""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from threading import Thread
from typing import Any

from flagdata.lake import Lake, doctor
from tests.s3 import BUCKET, SECRETS, moto
from tests.studies.validation.datasets import artifacts, compare

RECIPE = "flagsim-small"
SEQUENCES, FILMS, WORKERS = 12, 40, 4
KILLED, PREEMPTED = 0.2, 0.5
"""Shares of all sequences and films at which a worker is killed, and another asked to end."""


class Forwarder:
    """Passes TCP connections on to an address and counts the bytes of both directions.

    Attributes:
        port: where it listens on loopback.
        count: bytes that have passed.
    """

    def __init__(self, target: tuple[str, int]) -> None:
        self._target = target
        self._listening = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listening.getsockname()[1]
        self.count = 0
        Thread(target=self._accept, daemon=True).start()

    def _accept(self) -> None:
        while True:
            near, _ = self._listening.accept()
            far = socket.create_connection(self._target)
            for source, sink in ((near, far), (far, near)):
                sink.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                Thread(target=self._pass_on, args=(source, sink), daemon=True).start()

    def _pass_on(self, source: socket.socket, sink: socket.socket) -> None:
        with suppress(OSError):
            while content := source.recv(1 << 16):
                self.count += len(content)
                sink.sendall(content)
        with suppress(OSError):
            sink.shutdown(socket.SHUT_WR)


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Builds on one machine and on the cluster, and compares; the recipe has its own seed."""
    del seed, out
    with tempfile.TemporaryDirectory(prefix="flagdata-cluster-") as folder, ExitStack() as stack:
        alone = Path(folder) / "alone"
        began = time.perf_counter()
        _build(alone, workers=["--workers", "2"]).wait()
        seconds_alone = time.perf_counter() - began
        store = stack.enter_context(moto())
        bucket, scheduler = Forwarder(_address(store)), stack.enter_context(_scheduler())
        commands = Forwarder(_address(scheduler))
        keys = {**SECRETS, "AWS_REGION": "us-east-1"}
        direct = {**keys, "AWS_ENDPOINT_URL": store}
        workers = [stack.enter_context(_worker(scheduler, direct)) for _ in range(WORKERS)]
        lake = f"s3://{BUCKET}/lake"
        began = time.perf_counter()
        build = _build(
            lake,
            workers=["--scheduler", f"tcp://127.0.0.1:{commands.port}"],
            environment={**keys, "AWS_ENDPOINT_URL": f"http://127.0.0.1:{bucket.port}"},
        )
        os.environ.update(direct)
        ended = [
            _end(workers[place], signal_, build, lake, share)
            for place, (signal_, share) in enumerate(
                ((signal.SIGKILL, KILLED), (signal.SIGTERM, PREEMPTED))
            )
        ]
        if build.wait() != 0:
            raise RuntimeError("the build on the cluster failed: read its messages above")
        seconds = time.perf_counter() - began
        one, other = Lake.open(alone), Lake.open(lake)
        rows = one.rows(columns=["object", "object_bytes"]).to_pylist()
        sizes = {row["object"]: row["object_bytes"] or 0 for row in rows}
        return {
            "recipe": RECIPE,
            "sequences": SEQUENCES,
            "films": FILMS,
            "workers": WORKERS,
            "artifacts_when_killed_and_preempted": ended,
            "seconds_alone": round(seconds_alone),
            "seconds_on_the_cluster": round(seconds),
            "comparison": compare(one, other),
            "problems": [finding.kind for finding in doctor(other) if finding.severity != "note"],
            "bytes": sum(sizes.values()),
            "bytes_between_command_and_bucket": bucket.count,
            "bytes_between_command_and_scheduler": commands.count,
            "share_through_the_command": (bucket.count + commands.count) / sum(sizes.values()),
        }


def _address(url: str) -> tuple[str, int]:
    host, port = url.split("://")[1].rsplit(":", 1)
    return host, int(port)


def _build(
    lake: object, *, workers: Sequence[str], environment: Mapping[str, str] | None = None
) -> subprocess.Popen[bytes]:
    counts = ["--sequences", str(SEQUENCES), "--films", str(FILMS)]
    command = [
        sys.executable,
        "-m",
        "flagdata.cli",
        "build",
        RECIPE,
        *counts,
        "--lake",
        str(lake),
        *workers,
    ]
    return subprocess.Popen(command, env={**os.environ, **(environment or {})})


@contextmanager
def _scheduler() -> Iterator[str]:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = free.getsockname()[1]
    with _running("scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard"):
        yield f"tcp://127.0.0.1:{port}"


@contextmanager
def _worker(scheduler: str, environment: Mapping[str, str]) -> Iterator[subprocess.Popen[bytes]]:
    options = ["--no-nanny", "--nthreads", "1", "--no-dashboard", "--death-timeout", "60"]
    with _running("worker", scheduler, *options, environment=environment) as process:
        yield process


@contextmanager
def _running(
    *command: str, environment: Mapping[str, str] | None = None
) -> Iterator[subprocess.Popen[bytes]]:
    dask = shutil.which("dask", path=str(Path(sys.executable).parent))
    if dask is None:
        raise RuntimeError("Dask is not installed: pip install 'flagdata[cluster]'")
    process = subprocess.Popen(
        [dask, *command], env={**os.environ, **(environment or {})}, stderr=subprocess.DEVNULL
    )
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def _end(
    worker: subprocess.Popen[bytes],
    signal_: signal.Signals,
    build: subprocess.Popen[bytes],
    lake: str,
    share: float,
) -> int:
    """Ends a worker once a share of the work is in the lake; how many artifacts that were."""
    while build.poll() is None:
        if (found := artifacts(lake)) >= share * (SEQUENCES + FILMS):
            worker.send_signal(signal_)
            return found
        time.sleep(1.0)
    raise RuntimeError("the build ended before a worker could be ended")
