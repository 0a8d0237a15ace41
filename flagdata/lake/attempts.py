"""Optimistic concurrency: a commit is tried again until no other writer was faster."""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from typing import TypeVar

from flagdata.errors import ConflictError
from flagdata.storage import Place

T = TypeVar("T")

_PATIENCE = 120.0  # s, how long a commit competes with other writers before it gives up
_LEAST_TRIES = 20  # whatever time these take: an attempt may have waited for a collection
_FIRST_WAIT = 0.01  # s
_LONGEST_WAIT = 0.5  # s


class Moved(Exception):  # noqa: N818 — an outcome to act on, never shown to a user
    """Another writer has published since the version the append was based on."""


def persist(attempt: Callable[[], T], *, where: Place) -> T:
    """Run `attempt` until it does not raise `Moved`, with random waits that grow.

    Raises:
        ConflictError: after two minutes and at least twenty attempts in which others were faster.
    """
    deadline = time.monotonic() + _PATIENCE
    wait, tries = _FIRST_WAIT, 0
    while True:
        tries += 1
        try:
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
