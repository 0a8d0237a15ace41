"""Processes that wait at a known place of their work until they are killed or let go on.

A test that kills a process after some time, or once something is there, kills it where the load of
the machine decides, and on a busy machine after its end. The process says where it is instead, and
waits.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import IO

ROOT = Path(__file__).resolve().parents[1]
_PAUSED = "paused\n"


def pause() -> None:
    """In the process: report that it waits, and wait until `go_on`."""
    sys.stdout.write(_PAUSED)
    sys.stdout.flush()
    sys.stdin.readline()


def finding_tests() -> dict[str, str]:
    """Give the environment in which a process finds the package `tests`, wherever it is started."""
    paths = [str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths)}


def start(*arguments: object, stderr: IO[bytes] | None = None) -> subprocess.Popen[str]:
    """Start a Python script that pauses."""
    command = [sys.executable, *map(str, arguments)]
    return subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=stderr,
        text=True,
        env=finding_tests(),
    )


def await_pause(process: subprocess.Popen[str]) -> None:
    """Until the process waits; it must not have ended."""
    assert process.stdout is not None
    assert process.stdout.readline() == _PAUSED


def go_on(process: subprocess.Popen[str]) -> None:
    assert process.stdin is not None
    process.stdin.write("\n")
    process.stdin.flush()
