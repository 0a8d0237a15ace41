"""The Blender worker as a process: started when first needed, restarted where it crashes or hangs,
ended cleanly.

Blender lives in that process alone: beside torch in one process it hung at exit. The worker knows
nothing of lakes, recipes or torch; it gets resolved scenes and meshes, and gives pictures back
(`sim.blender.protocol`).
"""

from __future__ import annotations

import contextlib
import os
import selectors
import subprocess
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import IO, Self

from flagdata.errors import ErrorKind, FlagdataError
from sim.blender.environment import check, find
from sim.blender.protocol import Message, decode, encode

START_TIMEOUT = 120.0  # s; importing Blender from a cold disk
EXIT_TIMEOUT = 10.0  # s
_CHUNK = 1 << 20
_LOG_TAIL = 2000  # characters of the worker's own output that an error quotes

_LAUNCH = Path(__file__).with_name("launch.py")


def blender_worker() -> tuple[str, ...]:
    """Returns how the worker is started: by the Python of Blender's environment, isolated from this
    one's settings.

    Raises:
        NotFoundError: Blender is not installed.
        BlenderError: it is, and cannot be used.
    """
    return (str(check(find()).python), "-I", str(_LAUNCH))


class RenderError(FlagdataError):
    """A renderer failed, and kept failing."""

    kind = ErrorKind.RENDER_FAILED


class _LostError(Exception):
    """The worker died or did not answer in time."""


class WorkerProcess:
    """A worker that answers requests one after another; a context manager.

    Args:
        command: how it is started; by default `blender_worker`, looked for when the worker is first
            needed.
        attempts: how often a request is tried, each time by a fresh worker, before it is given up.

    Attributes:
        restarts: workers that were lost so far.
    """

    def __init__(self, command: Sequence[str] | None = None, *, attempts: int = 3) -> None:
        self._command = None if command is None else tuple(command)
        self._attempts = attempts
        self._process: subprocess.Popen[bytes] | None = None
        self._log: IO[bytes] | None = None
        self.restarts = 0

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    @property
    def pid(self) -> int | None:
        """Process number of the running worker."""
        return None if self._process is None else self._process.pid

    def request(
        self, messages: Sequence[Message], *, timeout: float, setup: Message | None = None
    ) -> list[Message]:
        """Answers to some messages, in order. A worker that is lost on the way is replaced and the
        message redone.

        Args:
            timeout: for each answer [s].
            setup: first message to a fresh worker: the scene that later messages change.

        Raises:
            RenderError: the worker refused a message, or was lost as often as `attempts` at the
                same one.
            NotFoundError, BlenderError: Blender is not installed, or cannot be used.
        """
        answers: list[Message] = []
        failures = 0
        while len(answers) < len(messages):
            try:
                if self._process is None:
                    self._start()
                    if setup is not None:
                        self._exchange(setup, timeout)
                answers.append(self._exchange(messages[len(answers)], timeout))
                failures = 0
            except _LostError as lost:
                self._kill()
                self.restarts += 1
                failures += 1
                if failures >= self._attempts:
                    raise RenderError(
                        f"the render worker failed {failures} times at the same frame: {lost}",
                        where="render worker",
                        fix="look at its output above; give a longer timeout, or take renderer = "
                        '"raster"',
                    ) from None
        return answers

    def close(self) -> None:
        """Ends the worker; it may be asked again afterwards, and is then started anew."""
        process = self._process
        if process is None:
            return
        with contextlib.suppress(OSError):
            _pipe(process.stdin).write(encode(Message(kind="exit")))
            _pipe(process.stdin).close()
        try:
            process.wait(EXIT_TIMEOUT)
        except subprocess.TimeoutExpired:
            process.kill()
        self._forget()

    def _start(self) -> None:
        command = blender_worker() if self._command is None else self._command
        self._log = tempfile.TemporaryFile()  # noqa: SIM115 — as long as the process
        self._process = subprocess.Popen(
            command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._log, bufsize=0
        )
        for pipe in (self._process.stdin, self._process.stdout):
            os.set_blocking(_pipe(pipe).fileno(), False)
        self._answer(START_TIMEOUT)  # it says when it is ready

    def _exchange(self, message: Message, timeout: float) -> Message:
        """Sends one message and waits for its answer."""
        process = self._running()
        out = _pipe(process.stdin).fileno()
        data, sent, deadline = encode(message), 0, time.monotonic() + timeout
        with selectors.DefaultSelector() as ready:
            ready.register(out, selectors.EVENT_WRITE)
            while sent < len(data):
                if not ready.select(max(0.0, deadline - time.monotonic())):
                    raise _LostError(f"it did not take a message for {timeout:g} s")
                try:
                    sent += os.write(out, data[sent : sent + _CHUNK])
                except OSError:
                    raise _LostError(self._last_words()) from None
        answer = self._answer(max(0.0, deadline - time.monotonic()), of=timeout)
        if answer.kind == "error":
            raise RenderError(
                f"Blender refused: {answer.fields['what']}",
                where="render worker",
                fix="check the scene's values",
            )
        return answer

    def _answer(self, timeout: float, *, of: float | None = None) -> Message:
        source = _pipe(self._running().stdout).fileno()
        deadline = time.monotonic() + timeout
        with selectors.DefaultSelector() as ready:
            ready.register(source, selectors.EVENT_READ)

            def read(count: int) -> bytes:
                parts: list[bytes] = []
                while count:
                    if not ready.select(max(0.0, deadline - time.monotonic())):
                        raise _LostError(
                            f"it did not answer for {timeout if of is None else of:g} s"
                        )
                    part = os.read(source, min(count, _CHUNK))
                    if not part:
                        raise _LostError(self._last_words())
                    parts.append(part)
                    count -= len(part)
                return b"".join(parts)

            return decode(read)

    def _last_words(self) -> str:
        """Describes why the worker is gone, with the end of what it printed."""
        process = self._running()
        try:
            code = process.wait(EXIT_TIMEOUT)
        except subprocess.TimeoutExpired:
            return "it closed its pipe"
        output = ""
        if self._log is not None:
            size = self._log.seek(0, os.SEEK_END)
            self._log.seek(max(0, size - _LOG_TAIL))
            output = self._log.read().decode(errors="replace").strip()
        how = f"signal {-code}" if code < 0 else f"exit code {code}"
        return f"it ended with {how}" + (f"; its last words: {output}" if output else "")

    def _running(self) -> subprocess.Popen[bytes]:
        if self._process is None:
            raise _LostError("it is not running")
        return self._process

    def _kill(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._forget()

    def _forget(self) -> None:
        process, self._process = self._process, None
        if process is not None:
            process.wait()
            for pipe in (process.stdin, process.stdout):
                with contextlib.suppress(OSError):
                    _pipe(pipe).close()
        if self._log is not None:
            self._log.close()
            self._log = None


def _pipe(pipe: IO[bytes] | None) -> IO[bytes]:
    """Returns the pipe, which `Popen` made since it was asked to."""
    if pipe is None:
        raise _LostError("it has no pipe")
    return pipe
