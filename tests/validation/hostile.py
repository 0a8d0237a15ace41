"""Hostile recipes, models, inputs and lakes: 200 of each, by two seeds."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tests.hostile import KINDS
from tests.hostile.campaign import MEMORY, SECONDS, WALL_SECONDS, campaign

COUNT = 100
"""Examples of a class by one seed."""


def run(*, seed: int, out: Path) -> dict[str, Any]:
    return {
        "limits": {"processor seconds": SECONDS, "seconds": WALL_SECONDS, "bytes": MEMORY},
        "seeds": {
            str(start): {kind: campaign(kind, count=COUNT, start=start) for kind in KINDS} for start in (seed, seed + 1)
        },
    }
