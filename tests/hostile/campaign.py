"""One campaign of hostile examples: drawn from one seed, each read in bounded time and memory, every failure kept.

An example fails where anything but an error of flagdata or of the command's usage comes out of it, where it takes
longer than `SECONDS` or `WALL_SECONDS`, or where it takes more memory than `MEMORY`. The campaign runs in a process of
its own (`python -m tests.hostile`): a limit of memory is one of a process, and an example may end it.
"""

from __future__ import annotations

import faulthandler
import io
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from types import FrameType
from typing import Any

import click
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

from flagdata.cli import root
from flagdata.console import foreseen
from flagdata.errors import FlagdataError, UnforeseenError

SECONDS = 20.0
"""Most processor time of an example [s]: none takes a tenth of it."""
WALL_SECONDS = 120.0
"""Longest that an example may take, waiting included [s]."""
MEMORY = 1 << 30
"""Most memory that the examples of a class may take, beyond what the process has with its modules loaded [B]."""
REPOSITORY = Path(__file__).parents[2]


@dataclass(frozen=True, kw_only=True)
class Subject:
    """What is read, and how it is damaged.

    Attributes:
        name: of what is read.
        examples: the damage, as values whose `repr` says all of it.
        act: writes a damaged copy into an empty folder and reads it; raises whatever the reader raises.
    """

    name: str
    examples: st.SearchStrategy[Any]
    act: Callable[[Any, Path], object]


class HangError(BaseException):
    """An example did not end in time."""


def command(*arguments: object) -> str:
    """Run a command of flagdata in this process; what it printed on stdout.

    Raises:
        FlagdataError: as the command line would report it; also for usage.
        MemoryError: there was not enough.
    """
    printed = io.StringIO()
    try:
        with redirect_stdout(printed), redirect_stderr(io.StringIO()):
            root.main(args=[str(argument) for argument in arguments], prog_name="flagdata", standalone_mode=False)
    except click.ClickException as error:
        raise FlagdataError(error.format_message(), fix="see the command's --help") from error
    except (MemoryError, FlagdataError):
        raise
    except SystemExit as ended:
        if ended.code not in (0, 1, 2, 3):
            raise
    except Exception as error:
        raise foreseen(error) from error
    return printed.getvalue()


def campaign(kind: str, *, count: int, start: int) -> dict[str, Any]:
    """Run a class of examples in a process of its own.

    Args:
        kind: of `tests.hostile.KINDS`.
        count: of examples.
        start: seed that all of them are drawn from.

    Returns:
        `examples`, by subject; how many were `refused`; `slowest` [s]; `peak` of memory beyond the start [B]; and the
        `failures`, each with its subject, its example and what came of it.
    """
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "outcome.json"
        environment = {**os.environ, "MALLOC_ARENA_MAX": "2", "ARROW_DEFAULT_MEMORY_POOL": "system", "TMPDIR": folder}
        done = subprocess.run(
            [sys.executable, "-m", "tests.hostile", kind, "--count", str(count), "--seed", str(start), "--out", out],
            cwd=REPOSITORY, env=environment, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False,
        )  # fmt: skip
        if not out.exists():
            raise RuntimeError(f"the campaign did not begin: {done.stderr[-2000:]}")
        outcome: dict[str, Any] = json.loads(out.read_text())
        if done.returncode:  # it ended within an example, which stands there
            last = outcome.pop("last")
            outcome["failures"].append({**last, "what": f"exit code {done.returncode}: {done.stderr[-2000:]}"})
        return outcome


def run(subjects: Sequence[Subject], *, count: int, start: int, out: Path) -> None:
    """Draw the examples of a class, read each and keep the outcome in the file `out`, also while it goes on."""
    outcome: dict[str, Any] = {
        "examples": {subject.name: 0 for subject in subjects}, "refused": 0, "slowest": 0.0, "peak": 0, "failures": [],
    }  # fmt: skip
    begun = _memory("VmRSS")

    def one(subject: Subject, damage: Any) -> None:
        outcome["examples"][subject.name] += 1
        outcome["last"] = {"subject": subject.name, "example": repr(damage)[:4000]}
        out.write_text(json.dumps(outcome))
        clock = time.process_time()
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            try:
                with _limits():
                    subject.act(damage, Path(folder))
            except FlagdataError as error:
                outcome["refused"] += 1
                if isinstance(error, UnforeseenError):
                    outcome["failures"].append({**outcome["last"], "what": _shown(error.__cause__ or error)})
            except BaseException as error:  # noqa: BLE001  every one is what the campaign looks for
                outcome["failures"].append({**outcome["last"], "what": _shown(error)})
        outcome["slowest"] = max(outcome["slowest"], round(time.process_time() - clock, 2))
        outcome["peak"] = max(outcome["peak"], _memory("VmHWM") - begun)

    resource.setrlimit(resource.RLIMIT_DATA, (_memory("VmData") + MEMORY, resource.RLIM_INFINITY))
    for subject in subjects:
        for damage in _drawn(subject, count=max(1, round(count / len(subjects))), start=start):
            one(subject, damage)
    del outcome["last"]
    out.write_text(json.dumps(outcome))


def _drawn(subject: Subject, *, count: int, start: int) -> list[Any]:
    """Examples of a subject; the first that hypothesis draws is the simplest, which damages next to nothing."""
    drawn: list[Any] = []

    @seed(f"{start} {subject.name}")
    @settings(
        max_examples=count + 1, database=None, deadline=None, phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )  # fmt: skip
    @given(example=subject.examples)
    def draw(example: Any) -> None:
        drawn.append(example)

    draw()
    return drawn[1:]


@contextmanager
def _limits() -> Iterator[None]:
    """Ends what takes too long; a call that no signal interrupts ends the process, somewhat later."""

    def stop(number: int, frame: FrameType | None) -> None:
        raise HangError("processor time" if number == signal.SIGPROF else "waiting")

    signal.signal(signal.SIGPROF, stop)
    signal.signal(signal.SIGALRM, stop)
    faulthandler.dump_traceback_later(WALL_SECONDS * 1.5, exit=True)
    signal.setitimer(signal.ITIMER_PROF, SECONDS)
    signal.setitimer(signal.ITIMER_REAL, WALL_SECONDS)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.setitimer(signal.ITIMER_REAL, 0)
        faulthandler.cancel_dump_traceback_later()


def _memory(field: str) -> int:
    """A field of /proc/self/status [B]."""
    (line,) = (line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith(f"{field}:"))
    return int(line.split()[1]) * 1024


def _shown(error: BaseException) -> str:
    return "".join(traceback.format_exception(error))[-3000:]
