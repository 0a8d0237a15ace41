"""Jobs of the tests beside it, in a module that a new process imports at once."""

from __future__ import annotations

import os
import signal
from pathlib import Path


def environment(names: tuple[str, ...]) -> list[str | int | None]:
    import torch

    return [*(os.environ.get(name) for name in names), torch.get_num_threads()]


def once(note: Path, number: int) -> int:
    """Dies the first time that number 1 is asked for."""
    if number == 1 and not note.exists():
        note.write_text("died")
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def fatal(number: int) -> int:
    os.kill(os.getpid(), signal.SIGKILL)
    return number


class _Fatal:
    """A result whose worker dies over sending it."""

    def __reduce__(self) -> tuple[type, tuple[()]]:
        os.kill(os.getpid(), signal.SIGKILL)
        return _Fatal, ()


def fatal_result() -> _Fatal:
    return _Fatal()
