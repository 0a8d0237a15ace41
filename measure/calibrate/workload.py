"""How long simulating will take, stated before it begins."""

from __future__ import annotations

_PACE = 25.0
"""Seconds of one flag that one core simulates in a second: 128 flags for two minutes took some ten minutes."""


def announced(flag_seconds: float, *, workers: int) -> str:
    """What is to be simulated, and for about how long.

    Args:
        flag_seconds: simulated seconds of all flags together.
        workers: processes that share them.
    """
    minutes = flag_seconds / _PACE / workers / 60
    length = f"about {minutes:.0f} minutes" if minutes >= 1.5 else "a minute or two"
    cores = "one idle core" if workers == 1 else f"{workers} idle cores"
    return (
        f"simulating flags for {flag_seconds / 60:.0f} minutes in all takes {length} on {cores}; what was simulated "
        "before is kept and taken up"
    )
