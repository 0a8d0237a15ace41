"""How long simulating flags beside films will take."""

from __future__ import annotations

from flagdata import workload

_PACE = 25.0
"""Seconds of one flag that one core simulates in a second: 128 flags for two minutes took some ten minutes."""


def announced(flag_seconds: float, *, workers: int) -> str:
    """What is to be simulated, and for about how long.

    Args:
        flag_seconds: simulated seconds of all flags together.
        workers: processes that share them.
    """
    return workload.announced(
        f"simulating flags for {flag_seconds / 60:.0f} minutes in all",
        flag_seconds / _PACE,
        workers=workers,
        kept="what was simulated before is kept and taken up",
    )
