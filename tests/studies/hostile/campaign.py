"""One campaign of hostile examples: drawn from one seed, each read in bounded time and memory,
every failure kept.

An example fails where anything but an error of flagdata or of the command's usage comes out of it,
where it takes longer than `SECONDS` or `WALL_SECONDS`, or where it takes more memory than `MEMORY`.
Each is read in a process of its own, forked from one that has all modules loaded (`python -m
tests.studies.hostile`), which is measured and may end.
"""

from __future__ import annotations

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
from collections.abc import Callable, Mapping, Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

from flagdata.cli import root
from flagdata.core.console import foreseen
from flagdata.errors import FlagdataError, UnforeseenError

SECONDS = 60.0
"""Most processor time of an example [s]."""
WALL_SECONDS = 240.0
"""Longest that an example may take where other work shares the processor [s]."""
MEMORY = 1 << 30
"""Most memory that an example may take, with all modules loaded; a process that it starts may take
as much [B]."""
GUARD = 4 << 30
"""Memory beyond which an example is refused more, so that it does not take the machine's [B]."""
REPOSITORY = Path(__file__).parents[3]
_LOOK = 0.02  # s between looks at an example
_DEFECT = "this is a defect of flagdata"


@dataclass(frozen=True, kw_only=True)
class Subject:
    """What is read, and how it is damaged.

    Attributes:
        name: of what is read.
        examples: the damage, as values whose `repr` says all of it.
        act: writes a damaged copy into an empty folder and reads it; raises whatever the reader
            raises.
        prepare: writes what is sound, in a process that is not measured; `None` where `act` does.
    """

    name: str
    examples: st.SearchStrategy[Any]
    act: Callable[[Any, Path], object]
    prepare: Callable[[], object] | None = None


def command(*arguments: object) -> str:
    """Run a command of flagdata in this process; what it printed on stdout.

    Raises:
        FlagdataError: as the command line would report it; also for usage, and for a defect that it
            reported.
        MemoryError: there was not enough.
    """
    printed, said = io.StringIO(), io.StringIO()
    try:
        with redirect_stdout(printed), redirect_stderr(said):
            root.main(
                args=[str(argument) for argument in arguments],
                prog_name="flagdata",
                standalone_mode=False,
            )
    except click.ClickException as error:
        raise FlagdataError(error.format_message(), fix="see the command's --help") from error
    except (MemoryError, FlagdataError):
        raise
    except SystemExit as ended:
        if ended.code not in (0, 1, 2, 3):
            raise
    except Exception as error:
        raise foreseen(error) from error
    if _DEFECT in printed.getvalue() + said.getvalue():
        raise UnforeseenError((printed.getvalue() + said.getvalue())[-3000:], fix=_DEFECT)
    return printed.getvalue()


def campaign(counts: Mapping[str, int], *, start: int) -> dict[str, dict[str, Any]]:
    """Run classes of examples in a process of their own.

    Args:
        counts: of examples of each class, of `tests.studies.hostile.KINDS`.
        start: seed that all of them are drawn from.

    Returns:
        By class: `examples`, by subject; how many were `refused`; `slowest`, the most processor
            time of one [s];
        `peak`, the most memory of one [B]; and the `failures`, each with its subject, its example
            and what came of it.
    """
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "outcome.json"
        environment = {
            **os.environ,
            "MALLOC_ARENA_MAX": "2",
            "ARROW_DEFAULT_MEMORY_POOL": "system",
            "TMPDIR": folder,
            "OMP_NUM_THREADS": "1",
            "OPENBLAS_NUM_THREADS": "1",
        }
        drawn = [f"{kind}={count}" for kind, count in counts.items()]
        done = subprocess.run(
            [
                sys.executable,
                "-m",
                "tests.studies.hostile",
                *drawn,
                "--seed",
                str(start),
                "--out",
                out,
            ],
            cwd=REPOSITORY,
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode:
            raise RuntimeError(f"the campaign ended with {done.returncode}: {done.stderr[-2000:]}")
        outcomes: dict[str, dict[str, Any]] = json.loads(out.read_text())
        return outcomes


def run(subjects: Sequence[Subject], *, count: int, start: int) -> dict[str, Any]:
    """Draw the examples of a class and read each; the outcome."""
    outcome: dict[str, Any] = {
        "examples": {subject.name: 0 for subject in subjects},
        "refused": 0,
        "slowest": 0.0,
        "peak": 0,
        "failures": [],
    }
    for number, subject in enumerate(subjects):
        prepare(subject)
        share = (number + 1) * count // len(subjects) - number * count // len(subjects)
        for damage in _drawn(subject, count=max(1, share), start=start):
            seen = _apart(subject, damage)
            outcome["examples"][subject.name] += 1
            outcome["refused"] += seen["refused"]
            outcome["slowest"] = max(outcome["slowest"], seen["seconds"])
            outcome["peak"] = max(outcome["peak"], seen["peak"])
            if seen["failure"] is not None:
                example = {"subject": subject.name, "example": repr(damage)[:4000]}
                outcome["failures"].append({**example, "what": seen["failure"]})
    return outcome


def prepare(subject: Subject) -> None:
    """Write what is sound of a subject."""
    if subject.prepare is None:
        return
    child = os.fork()
    if child == 0:
        try:
            subject.prepare()
        except BaseException:  # noqa: BLE001  of the campaign itself
            traceback.print_exc()
            os._exit(1)
        os._exit(0)
    _, status = os.waitpid(child, 0)
    if status:
        raise RuntimeError(f"{subject.name} was not written")


def _apart(subject: Subject, damage: Any) -> dict[str, Any]:
    """What came of an example in a process of its own: `refused` or not, its `failure`, its
    `seconds` and `peak`."""
    seen: dict[str, Any] = {"refused": False, "failure": None, "peak": 0}
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        report = Path(name) / "report.json"
        child = os.fork()
        if child == 0:
            _read(subject, damage, report)
        late, code, used = _awaited(child)
        if report.exists():
            seen |= json.loads(report.read_text())
        else:
            seen["failure"] = late or f"it ended with {code}"
    seen["seconds"] = round(used.ru_utime + used.ru_stime, 2)
    if seen["failure"] is None and seen["peak"] > MEMORY:
        seen["failure"] = f"it took {seen['peak'] >> 20} MiB"
    return seen


def _read(subject: Subject, damage: Any, report: Path) -> None:
    """Read an example and write down what came of it; ends the process."""
    os.setpgid(0, 0)
    folder = report.parent / "files"
    folder.mkdir()
    seen: dict[str, Any] = {}
    Path("/proc/self/clear_refs").write_text("5")  # the peak of memory begins anew
    resource.setrlimit(resource.RLIMIT_DATA, (_memory("VmData") + GUARD, resource.RLIM_INFINITY))
    try:
        subject.act(damage, folder)
    except FlagdataError as error:
        seen["refused"] = True
        if isinstance(error, UnforeseenError):
            seen["failure"] = _shown(error.__cause__ or error)
    except BaseException as error:  # noqa: BLE001  every one is what the campaign looks for
        seen["failure"] = _shown(error)
    others = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024
    seen["peak"] = max(_memory("VmHWM"), others)
    report.with_suffix(".part").write_text(json.dumps(seen))
    report.with_suffix(".part").rename(report)
    os._exit(0)


def _awaited(child: int) -> tuple[str | None, int, resource.struct_rusage]:
    """Why a process was ended, if it was, its exit code and what it used; what it started ends with
    it."""
    begun = time.monotonic()
    late = None
    while True:
        ended, status, used = os.wait4(child, os.WNOHANG)
        if ended:
            break
        if late is None:
            late = _over(child, time.monotonic() - begun)
        if late is not None:
            _kill(child)
        time.sleep(_LOOK)
    _kill(child)
    return late, os.waitstatus_to_exitcode(status), used


def _over(child: int, waited: float) -> str | None:
    try:
        words = Path(f"/proc/{child}/stat").read_text().rpartition(")")[2].split()
    except (FileNotFoundError, ProcessLookupError):
        return None
    used = sum(map(int, words[11:15])) / os.sysconf(
        "SC_CLK_TCK"
    )  # its own, and that of its children that ended
    if used > SECONDS:
        return f"it took more than {SECONDS:g} s of processor time"
    return f"it took more than {WALL_SECONDS:g} s" if waited > WALL_SECONDS else None


def _kill(child: int) -> None:
    for end in (os.kill, os.killpg):
        try:
            end(child, signal.SIGKILL)
        except ProcessLookupError:
            continue


def _drawn(subject: Subject, *, count: int, start: int) -> list[Any]:
    """Examples of a subject; the first that hypothesis draws is the simplest, which damages next to
    nothing."""
    drawn: list[Any] = []

    @seed(f"{start} {subject.name}")
    @settings(
        max_examples=count + 1,
        database=None,
        deadline=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(example=subject.examples)
    def draw(example: Any) -> None:
        drawn.append(example)

    draw()
    return drawn[1:]


def _memory(field: str) -> int:
    """A field of /proc/self/status [B]."""
    (line,) = (
        line
        for line in Path("/proc/self/status").read_text().splitlines()
        if line.startswith(f"{field}:")
    )
    return int(line.split()[1]) * 1024


def _shown(error: BaseException) -> str:
    return "".join(traceback.format_exception(error))[-3000:]
