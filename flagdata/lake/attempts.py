"""Optimistic concurrency: a commit is tried again until no other writer was faster.

An attempt looks once at what it is based on, so that all that it concludes is of one moment; if
another writer comes in between, its commit is refused and the next attempt looks again. In a bucket
each look is a request.
"""

from __future__ import annotations

import random
import threading
import time
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from typing import Any, TypeVar

from flagdata.errors import ConflictError
from flagdata.storage import Place

T = TypeVar("T")

_PATIENCE = 120.0  # s, how long a commit competes with other writers before it gives up
_LEAST_TRIES = 20  # whatever time these take: an attempt may have waited for a collection
_FIRST_WAIT = 0.01  # s
_LONGEST_WAIT = 0.5  # s


class Moved(Exception):  # noqa: N818 — an outcome to act on, never shown to a user
    """Another writer has published since the version the append was based on."""


class Looks(threading.local):
    """What this thread has found since its attempt began; nothing is kept outside one."""

    def __init__(self) -> None:
        self._found: dict[Hashable, Any] | None = None

    @contextmanager
    def once(self) -> Iterator[None]:
        """Keeps what is found within, until a commit of this thread's own."""
        outer, self._found = self._found, {}
        try:
            yield
        finally:
            self._found = outer

    def find(self, what: Hashable, look: Callable[[], T]) -> T:
        """Returns what was found under a name, or looks."""
        if self._found is None:
            return look()
        if what not in self._found:
            self._found[what] = look()
        return self._found[what]

    def forget(self) -> None:
        """Looks anew from here on: this thread has changed what it looks at."""
        if self._found is not None:
            self._found.clear()


def persist(attempt: Callable[[], T], *, looks: Looks, where: Place) -> T:
    """Run `attempt` until it does not raise `Moved`, with random waits that grow, each time with
    one look at what is there.

    Raises:
        ConflictError: after two minutes and at least twenty attempts in which others were faster.
    """
    deadline = time.monotonic() + _PATIENCE
    wait, tries = _FIRST_WAIT, 0
    while True:
        tries += 1
        try:
            with looks.once():
                return attempt()
        except Moved:
            if time.monotonic() > deadline and tries >= _LEAST_TRIES:
                raise ConflictError(
                    f"other processes kept committing for {_PATIENCE:.0f} s",
                    where=str(where),
                    fix="try again",
                ) from None
            time.sleep(random.uniform(0, wait))
            wait = min(2 * wait, _LONGEST_WAIT)
