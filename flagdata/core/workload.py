"""How long a command's work will take, stated before it begins, and how many processors and threads
it takes."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_SHORT = 90.0  # s
_GROUPS = Path("/proc/self/cgroup")
_MOUNT = Path("/sys/fs/cgroup")
_OF_PROCESSORS = {
    "",
    "cpu",
}  # the one hierarchy of cgroup 2, and that of cgroup 1 which limits processors


def announce_work(what: str, seconds: float, *, workers: int = 1, kept: str | None = None) -> str:
    """Announces what is to be done, and for about how long.

    Args:
        what: as the subject of a sentence in the singular, as in "simulating 40 flags".
        seconds: that one core takes for it.
        workers: processes or threads that share it.
        kept: what of it is done already, or is kept where it is interrupted.
    """
    cores = "one idle core" if workers == 1 else f"{workers} idle cores"
    return (
        f"{what} takes {_length(seconds / workers)} on {cores}{'' if kept is None else f'; {kept}'}"
    )


def cores() -> int:
    """Counts the processors that the process may use: those that it may run on, and what its
    group's quota is worth, as in a container."""
    there = (
        len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    )
    return max(1, min([there, *map(int, _quotas())]))


@contextmanager
def one_thread() -> Iterator[None]:
    """Limits torch to the calling thread during the block.

    What works on one small window after another gains nothing by several threads, and they wait for
    each other by
    spinning: beside other processes that takes many times the work. The order of sums, and so their
    last bits, depends on their number, too.
    """
    import torch

    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def _quotas() -> Iterator[float]:
    """Yields the processors that each control group above this process grants it, where the kernel
    states any."""
    lines: list[str] = []
    with suppress(OSError):
        lines = _GROUPS.read_text(encoding="ascii", errors="replace").splitlines()
    for line in lines:
        _, controllers, group = line.split(":", 2)
        if not _OF_PROCESSORS.intersection(controllers.split(",")):
            continue
        mount = _MOUNT / controllers if controllers else _MOUNT
        inside = mount / group.lstrip("/")
        for folder in (inside, *(above for above in inside.parents if above.is_relative_to(mount))):
            with suppress(OSError, ValueError, ZeroDivisionError):  # no such group here, or "max"
                yield _quota(folder)


def _quota(folder: Path) -> float:
    """Reads what a control group grants: processor time over time.

    Raises:
        OSError, ValueError: it limits nothing.
    """
    limit = folder / "cpu.max"
    names = ("cpu.cfs_quota_us", "cpu.cfs_period_us")
    stated = (
        limit.read_text().split()
        if limit.exists()
        else [(folder / name).read_text() for name in names]
    )
    quota, period = map(int, stated)
    if quota <= 0:  # cgroup 1 writes -1
        raise ValueError("no quota")
    return quota / period


def _length(seconds: float) -> str:
    if seconds < _SHORT:
        return "a minute or two"
    if seconds < 60 * _SHORT:
        return f"about {seconds / 60:.0f} minutes"
    return f"about {seconds / 3600:.{1 if seconds < 10 * 3600 else 0}f} hours"
