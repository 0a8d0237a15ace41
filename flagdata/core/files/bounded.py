"""Work on files and queries of other users, in a process of its own with limited memory, which is
ended in time.

A library of C++ or Rust may ask for any memory that one number of a file or a query states; where
it gets none it may end its process, and it may heed no interrupt. So it works in a child, which the
caller outlives.
"""

from __future__ import annotations

import os
import pickle
import resource
import signal
import subprocess
import sys
import threading
import time
import weakref
from contextlib import suppress
from enum import StrEnum
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Any, cast

from flagdata.errors import FlagdataError

_START = 60.0
"""What a child may take to start [s]: it imports its libraries meanwhile."""
_LOOK = 1.0
"""Seconds between looks of a child whether its parent is still there."""
_BY_MEMORY = 3
"""Exit code of a child that was refused memory."""
_OF_MEMORY = (
    "bad_alloc",
    "memory allocation",
    "memoryerror",
    "out of memory",
    "cannot allocate memory",
)
"""What libraries of C++, Rust, Python and C write last where they end their process for want of
memory."""
_ENDING = frozenset({signal.SIGABRT, signal.SIGILL, signal.SIGTRAP})
"""Signals by which a library ends its own process: for want of memory, or of any other fault that
it finds."""
_LAST = 64 << 10
"""Bytes within which a library writes why it ends its process, the frames of its stack after it
[B]."""
_SHOWN = 200  # letters of these for people


class End(StrEnum):
    """Names how a child ended."""

    LATE = "its time was up"
    MEMORY = "it was refused memory"
    SIGNAL = "it was ended by a signal"
    EXIT = "it ended by itself"
    CLOSED = "it was closed"


class EndedError(Exception):
    """The child is no more.

    Attributes:
        end: how it ended.
        detail: the signal's name, or the exit code and what the child wrote last.
    """

    def __init__(self, end: End, detail: str = "") -> None:
        self.end = end
        self.detail = detail
        super().__init__(f"the child process has ended: {end}{detail and f' ({detail})'}")

    @property
    def late(self) -> bool:
        """Returns whether its time was up."""
        return self.end is End.LATE


class Child:
    """A process that answers one message after another.

    Args:
        serve: "module:name" of what makes a function, which answers a message by a value; both can
            be pickled.
        memory: most that it may take beyond what it has with its modules loaded [B].

    The child starts meanwhile; its first answer waits for it. It ends with its owner, and is of no
    use in a process that was forked from this one.
    """

    def __init__(self, serve: str, *, memory: int) -> None:
        code = (
            f"import sys; sys.path[:] = {sys.path!r}; from flagdata.core.files.bounded import run; "
            f"run({serve!r}, {memory})"
        )
        self._said: IO[bytes] = TemporaryFile()  # noqa: SIM115  closed with the pipes
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-c", code],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._said,
        )
        self._pipes = cast(tuple[IO[bytes], IO[bytes]], (self._process.stdin, self._process.stdout))
        self._owner = os.getpid()
        self._ready = False
        self._end = weakref.finalize(
            self, _end, self._process, (*self._pipes, self._said), self._owner
        )

    @property
    def usable(self) -> bool:
        """Whether it is there, and this process's own."""
        return self._end.alive and self._owner == os.getpid()

    def ask(self, message: object, *, seconds: float) -> Any:
        """Sends a message and returns the answer.

        Raises:
            EndedError: it has none after so many seconds, or ended.
            FlagdataError: whatever of these it raised.
            RuntimeError: it raised anything else.
        """
        self.wait_for_start()
        return self._exchange(message, seconds)

    def wait_for_start(self) -> None:
        """Wait until it has started, which takes none of the time of a message.

        Raises:
            EndedError: it did not start.
        """
        if not self._ready:
            self._ready = self._exchange(None, _START)

    def close(self) -> None:
        """End it."""
        self._end()

    def _exchange(self, message: object, seconds: float) -> Any:
        if not self.usable:
            raise EndedError(End.CLOSED)
        questions, answers = self._pipes
        late = threading.Event()
        timer = threading.Timer(min(seconds, threading.TIMEOUT_MAX), self._stop, [late])
        timer.daemon = True
        timer.start()
        try:
            pickle.dump(message, questions, protocol=5)
            questions.flush()
            answered, value = pickle.load(answers)
        except (EOFError, OSError, pickle.UnpicklingError):
            end, detail = (End.LATE, "") if late.is_set() else self._find_end()
            self.close()
            raise EndedError(end, detail) from None
        except (
            BaseException
        ):  # an interrupt: what it answers later would be taken for the next answer
            self.close()
            raise
        finally:
            timer.cancel()
            timer.join()
        if late.is_set():  # its time was up just as the answer came: it was ended all the same
            self.close()
            raise EndedError(End.LATE)
        if not answered:
            raise value
        return value

    def _find_end(self) -> tuple[End, str]:
        """Finds out how it ended without having been asked to.

        A limit of memory leaves no trace in the exit code: the library that is refused memory
        aborts, as for any other fault. That it was memory is only known from what it wrote last.
        """
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(timeout=_LOOK)
        code = self._process.poll()
        size = self._said.seek(0, os.SEEK_END)
        self._said.seek(max(0, size - _LAST))
        lines = [
            line for line in self._said.read().decode(errors="replace").split("\n") if line.strip()
        ]
        said = " ".join(lines)[-_SHOWN:]
        if code == _BY_MEMORY:
            return End.MEMORY, said
        by_itself = code is not None and (code >= 0 or -code in _ENDING)
        of_memory = [line for line in lines if any(word in line.lower() for word in _OF_MEMORY)]
        if by_itself and of_memory:
            return End.MEMORY, of_memory[-1].strip()[:_SHOWN]
        if code is not None and code < 0:
            return End.SIGNAL, signal.Signals(-code).name
        return End.EXIT, f"exit code {code}{said and f': {said}'}"

    def _stop(self, late: threading.Event) -> None:
        late.set()
        self._process.kill()


def _end(process: subprocess.Popen[bytes], pipes: tuple[IO[bytes], ...], owner: int) -> None:
    if owner != os.getpid():
        return
    process.kill()
    process.wait()
    for pipe in pipes:
        with suppress(OSError):  # what was not written yet
            pipe.close()


def run(serve: str, memory: int) -> None:
    """Answers messages from standard input until it ends: what the child does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent's business
    threading.Thread(target=_leave_with, args=[os.getppid()], daemon=True).start()
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print is no answer
    module, _, name = serve.partition(":")
    answer = getattr(import_module(module), name)()
    _limit(memory)
    while True:
        try:
            message = pickle.load(sys.stdin.buffer)
        except EOFError:
            os._exit(0)
        try:
            reply = (True, True if message is None else answer(message))
            data = pickle.dumps(reply, protocol=5)
        except MemoryError:
            os._exit(_BY_MEMORY)  # libraries keep what they have taken
        except FlagdataError as error:
            data = pickle.dumps((False, error), protocol=5)
        except Exception as error:  # noqa: BLE001  the parent reports it
            data = pickle.dumps(
                (False, RuntimeError(f"its process raised {type(error).__name__}: {error}")),
                protocol=5,
            )
        answers.write(data)
        answers.flush()


def _leave_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_LOOK)
    os._exit(0)


def _limit(memory: int) -> None:
    """Limits the memory that this process may write to: what it has, and so much more."""
    (line,) = (
        line
        for line in Path("/proc/self/status").read_text().splitlines()
        if line.startswith("VmData:")
    )
    most = int(line.split()[1]) * 1024 + memory
    _, hard = resource.getrlimit(resource.RLIMIT_DATA)
    resource.setrlimit(
        resource.RLIMIT_DATA, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard)
    )
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
