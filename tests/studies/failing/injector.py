"""Commands of flagdata in which one call to the disk fails: `calls.c` lets it fail, `worker.py`
runs them."""

from __future__ import annotations

import errno
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from enum import IntFlag
from pathlib import Path
from typing import IO

HERE = Path(__file__).parent
_STATE_SIZE = 4096


class Kinds(IntFlag):
    """Which calls are counted, and may fail."""

    READS = 1
    WRITES = 2
    ALL = 3


@dataclass(frozen=True, kw_only=True)
class Fault:
    """A call that fails.

    Attributes:
        call: its number, from 0.
        stays: whether all later calls fail too, for want of space (reads: as a broken disk does);
            else it fails alone.
        kills: whether the process is killed (SIGKILL) by that call instead, before the call is
            made.
    """

    call: int
    stays: bool = False
    kills: bool = False

    @property
    def error(self) -> int:
        """The number that `calls.c` takes."""
        return -1 if self.kills else errno.ENOSPC if self.stays else errno.EIO


@dataclass(frozen=True, kw_only=True)
class Done:
    """A command that has ended.

    Attributes:
        code: its exit code.
        calls: how many calls there were.
        trace: function and path of each, in their order, where they were noted.
        stdout, stderr: what it said.
    """

    code: int
    calls: int
    trace: tuple[str, ...]
    stdout: str
    stderr: str


class Injector:
    """Made by `injecting`."""

    def __init__(self, tasks: IO[str], answers: IO[str]) -> None:
        self._tasks = tasks
        self._answers = answers

    def prepare(self, function: str, argument: str) -> None:
        """Call "module:function" in the process that commands are forked from."""
        self._tasks.write(json.dumps({"prepare": function, "argument": argument}) + "\n")
        self._tasks.flush()
        assert json.loads(self._answers.readline()) == {}

    def run(
        self,
        folder: Path,
        arguments: Sequence[str],
        fault: Fault | None = None,
        *,
        kinds: Kinds = Kinds.ALL,
        traced: bool = False,
    ) -> Done:
        """Run a command; calls on files in `folder` count, all that the command reads and writes
        should lie there."""
        task = {
            "arguments": list(arguments),
            "folder": str(folder),
            "kinds": int(kinds),
            "traced": traced,
            "call": -1 if fault is None else fault.call,
            "stays": fault is not None and fault.stays,
            "error": 0 if fault is None else fault.error,
        }
        self._tasks.write(json.dumps(task) + "\n")
        self._tasks.flush()
        answer = json.loads(self._answers.readline())
        shutil.rmtree(folder.with_name(f"{folder.name}.output"))
        trace = [line.partition(" ") for line in answer.pop("trace").splitlines()]
        calls = tuple(call for _, _, call in sorted(trace, key=lambda parts: int(parts[0])))
        return Done(trace=calls, **answer)


@contextmanager
def injecting(scratch: Path) -> Iterator[Injector | None]:
    """An injector, which keeps its files in the folder `scratch`; None where there is no compiler
    of C, or no Linux."""
    compiler = shutil.which("gcc") or shutil.which("cc")
    if compiler is None or not sys.platform.startswith("linux"):
        yield None
        return
    library, state = scratch / "calls.so", scratch / "calls"
    source = str(HERE / "calls.c")
    subprocess.run(
        [compiler, "-shared", "-fPIC", "-O1", "-o", str(library), source, "-ldl"], check=True
    )
    state.write_bytes(bytes(_STATE_SIZE))
    Path(f"{state}.trace").touch()
    environment = {
        **os.environ,
        "LD_PRELOAD": str(library),
        "FAILING_CALLS": str(state),
        "OMP_NUM_THREADS": "1",
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    with subprocess.Popen(
        [sys.executable, "-m", "tests.studies.failing.worker"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env=environment,
        cwd=HERE.parents[2],
    ) as server:
        assert server.stdin is not None
        assert server.stdout is not None
        yield Injector(server.stdin, server.stdout)
        server.stdin.close()
