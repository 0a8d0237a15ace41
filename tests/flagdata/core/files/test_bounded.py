"""A child's memory and time are limited; its caller learns which it was, and outlives it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

import pytest

from flagdata.core.files.bounded import Child, End, EndedError
from flagdata.errors import InputError

MEMORY = 256 << 20
LONG = 60.0  # s: far more than any of these takes


def _act(message: tuple[str, Any]) -> Any:
    what, value = message
    if what == "take":
        return len(bytes(value))
    if what == "abort":
        os.abort()
    if what == "kill":
        os.kill(os.getpid(), 9)
    if what == "bad_alloc":
        os.write(2, b"terminate called after throwing an instance of 'std::bad_alloc'\n")
        os.write(2, b"frame\n" * value)
        os.abort()
    if what == "said, and killed":
        os.write(2, b"MemoryError: went on with less\n")
        os.kill(os.getpid(), value)
    if what == "leave":
        os.write(2, b"for no reason\n")
        os._exit(value)
    if what == "sleep":
        time.sleep(value)
    if what == "print":
        print("no answer")  # noqa: T201
        os.write(1, b"nor this")
    if what == "refuse":
        raise InputError("bad", where="here", fix="mend it")
    if what == "raise":
        raise ValueError("unheard of")
    return os.getpid()


def answers() -> Callable[[tuple[str, Any]], Any]:
    return _act


def _child() -> Child:
    return Child(f"{__name__}:answers", memory=MEMORY)


def _is_running(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    return True


def test_a_child_answers_until_it_is_closed() -> None:
    child = _child()
    assert child.ask(("take", 1000), seconds=LONG) == 1000
    pid = child.ask(("print", None), seconds=LONG)
    assert pid == child.ask(("", None), seconds=LONG) != os.getpid()
    child.close()
    assert not child.usable
    assert not _is_running(pid)


@pytest.mark.parametrize(
    ("message", "end", "detail"),
    [
        (("take", MEMORY + (64 << 20)), End.MEMORY, ""),
        (("bad_alloc", 0), End.MEMORY, "std::bad_alloc"),
        (("bad_alloc", 2000), End.MEMORY, "std::bad_alloc"),
        (("said, and killed", signal.SIGKILL), End.SIGNAL, "SIGKILL"),
        (("said, and killed", signal.SIGSEGV), End.SIGNAL, "SIGSEGV"),
        (("abort", None), End.SIGNAL, "SIGABRT"),
        (("kill", None), End.SIGNAL, "SIGKILL"),
        (("leave", 5), End.EXIT, "exit code 5: for no reason"),
    ],
)
def test_each_end_of_a_child_is_reported_as_what_it_was(
    message: tuple[str, Any], end: End, detail: str
) -> None:
    child = _child()
    with pytest.raises(EndedError) as caught:
        child.ask(message, seconds=LONG)
    assert (caught.value.end, caught.value.late) == (end, False)
    assert detail in caught.value.detail
    assert not child.usable
    with pytest.raises(EndedError) as again:
        child.ask(("", None), seconds=LONG)
    assert again.value.end is End.CLOSED


def test_an_interrupt_ends_the_child_and_is_handed_on(monkeypatch: pytest.MonkeyPatch) -> None:
    child = _child()
    assert child.ask(("", None), seconds=LONG)

    def interrupt(_: object) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("flagdata.core.files.bounded.pickle.load", interrupt)
        with pytest.raises(KeyboardInterrupt):
            child.ask(("", None), seconds=LONG)
    assert not child.usable


def test_a_child_is_ended_when_its_time_is_up_whatever_it_does() -> None:
    child = _child()
    child.ask(("", None), seconds=LONG)
    begun = time.monotonic()
    with pytest.raises(EndedError) as caught:
        child.ask(("sleep", LONG), seconds=0.2)
    assert caught.value.late
    assert time.monotonic() - begun < LONG / 2


def test_an_answer_that_comes_just_as_its_time_is_up_is_late_and_the_child_is_not_asked_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    class FiredAtTheEnd(threading.Timer):
        def start(self) -> None: ...

        def cancel(self) -> None:
            self.function(*self.args, **self.kwargs)

        def join(self, timeout: float | None = None) -> None: ...

    child = _child()
    assert child.ask(("", None), seconds=LONG)
    monkeypatch.setattr("flagdata.core.files.bounded.threading.Timer", FiredAtTheEnd)
    with pytest.raises(EndedError) as ended:
        child.ask(("", None), seconds=LONG)
    assert ended.value.late
    assert not child.usable


def test_what_a_child_raises_is_raised_here_and_it_goes_on() -> None:
    child = _child()
    with pytest.raises(InputError, match="here: bad; mend it"):
        child.ask(("refuse", None), seconds=LONG)
    with pytest.raises(RuntimeError, match="ValueError: unheard of"):
        child.ask(("raise", None), seconds=LONG)
    assert child.ask(("take", 1), seconds=LONG) == 1


def test_a_child_leaves_with_a_parent_that_was_killed() -> None:
    code = (
        f"import sys; sys.path[:] = {sys.path!r}; from {__name__} import _child, os\n"
        "child = _child(); print(child.ask(('', None), seconds=60), flush=True)\n"
        "import threading; threading.Thread(target=child.ask, args=[('sleep', 60)], "
        "kwargs={'seconds': 60}).start()\n"
        "import time; time.sleep(0.2); os.kill(os.getpid(), 9)"
    )
    parent = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )
    pid = int(parent.stdout)
    until = time.monotonic() + LONG / 2
    while _is_running(pid) and time.monotonic() < until:
        time.sleep(0.1)
    assert not _is_running(pid)
