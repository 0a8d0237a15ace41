"""Keeps the scheduling of this process where a library would change it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_THREADS = Path("/proc/self/task")


@contextmanager
def kept_scheduling() -> Iterator[None]:
    """Puts all threads of this process back to how the calling one was scheduled.

    SVT-AV1 gives its threads, and the one that opens it, real-time priority wherever it may, as
    root in a container
    may: all that the process does from then on, and every process that it starts, would come before
    all others.
    """
    policy, parameters = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        yield
    finally:
        for thread in _THREADS.iterdir():
            with suppress(ProcessLookupError):  # it has ended
                if os.sched_getscheduler(int(thread.name)) != policy:
                    os.sched_setscheduler(int(thread.name), policy, parameters)
