"""A process that dies before its next step on the disk or in the store, and what it had flushed.

Each step is a call by which something becomes durable or goes: of the operating system for a lake
in a folder, of `RemotePath` for one in a bucket. `dying` counts them and raises `Killed` at one.
From then on each further step raises too, so that no `finally` of the product mends what a process
that is gone would not; only what the kernel does for a dead process, it drops its locks, is left to
the end of the block.
"""

from __future__ import annotations

import gc
import os
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from flagdata.lake import lake_locks
from flagdata.storage import RemotePath
from tests.flagdata.lake.conftest import dead_owner

_CALLS = ("link", "rename", "replace", "unlink", "remove", "rmdir", "mkdir", "fsync")
_REQUESTS = ("create", "write_bytes", "_upload", "replace_if", "unlink", "remove_tree")
_STORES = ("mcap", "zarr", "model")


class Killed(BaseException):
    """The process ends here."""


@dataclass
class Steps:
    """The steps of a process.

    Attributes:
        dies_at: the step before which it dies, if any.
        for_good: whether the process itself is killed.
        taken: how many it took.
        unflushed: stores from which something was deleted, and which were not flushed since.
    """

    dies_at: int | None
    for_good: bool = False
    taken: int = 0
    dead: bool = False
    unflushed: set[Path] = field(default_factory=set)
    paths: dict[int, Path] = field(default_factory=dict)
    guard: Any = field(default_factory=threading.Lock)

    def step(self) -> None:
        """Count one; the process may die before it.

        Raises:
            Killed: it is dead.
        """
        with self.guard:
            self.dead = self.dead or self.taken == self.dies_at
            if self.dead and self.for_good:
                os.kill(os.getpid(), signal.SIGKILL)
            if self.dead:
                raise Killed
            self.taken += 1

    def deleted(self, path: object) -> None:
        """Notes that something went: an object, not a note beside one."""
        if (
            isinstance(path, str | os.PathLike)
            and Path(path).parent.name in _STORES
            and Path(path).suffix != ".damaged"
        ):
            self.unflushed.add(Path(path).parent)


@contextmanager
def dying(at: int | None, *, for_good: bool = False) -> Iterator[Steps]:
    """Kill what runs in the block before a step; `None` only counts them.

    Args:
        for_good: kill the process itself, by a signal.
    """
    steps = Steps(dies_at=at, for_good=for_good)
    with pytest.MonkeyPatch.context() as patches:
        for name in _CALLS:
            patches.setattr(os, name, _stepping(steps, getattr(os, name), name))
        patches.setattr(os, "open", _remembering(steps, os.open))
        for name in _REQUESTS:
            patches.setattr(RemotePath, name, _stepping(steps, getattr(RemotePath, name), name))
        if at is not None:  # in a bucket others tell by it that the process has ended
            patches.setattr(lake_locks, "owner", _dead_owner)
        yield steps
    if steps.dead:
        gc.collect()  # files that are closed with it, and their locks


@cache
def _dead_owner() -> dict[str, object]:
    return dead_owner()


def _stepping(steps: Steps, call: Callable[..., Any], name: str) -> Callable[..., Any]:
    def stepping(*arguments: Any, **named: Any) -> Any:
        steps.step()
        result = call(*arguments, **named)
        if (
            name in ("unlink", "remove", "rmdir", "rename", "replace")
            and named.get("dir_fd") is None
        ):
            steps.deleted(arguments[0])
        if name == "fsync":
            steps.unflushed.discard(steps.paths.get(arguments[0], Path()))
        return result

    return stepping


def _remembering(steps: Steps, opened: Callable[..., int]) -> Callable[..., int]:
    def remembering(path: Any, *arguments: Any, **named: Any) -> int:
        descriptor = opened(path, *arguments, **named)
        if isinstance(path, str | os.PathLike):
            steps.paths[descriptor] = Path(path)
        return descriptor

    return remembering
