"""How long a command's work will take, stated before it begins."""

from __future__ import annotations

import os

_SHORT = 90.0  # s


def announced(what: str, seconds: float, *, workers: int = 1, kept: str | None = None) -> str:
    """Announces what is to be done, and for about how long.

    Args:
        what: as the subject of a sentence in the singular, as in "simulating 40 flags".
        seconds: that one core takes for it.
        workers: processes or threads that share it.
        kept: what of it is done already, or is kept where it is interrupted.
    """
    cores = "one idle core" if workers == 1 else f"{workers} idle cores"
    return f"{what} takes {_length(seconds / workers)} on {cores}{'' if kept is None else f'; {kept}'}"


def cores() -> int:
    """Counts the cores that the process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _length(seconds: float) -> str:
    if seconds < _SHORT:
        return "a minute or two"
    if seconds < 60 * _SHORT:
        return f"about {seconds / 60:.0f} minutes"
    return f"about {seconds / 3600:.{1 if seconds < 10 * 3600 else 0}f} hours"
