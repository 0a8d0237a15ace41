"""Does every command that writes report what it did, whichever call to the disk fails, and wherever it is killed?

Hours of one core; `python -m tests.failing.campaign` runs parts of it.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from tests.failing.campaign import campaign

_KILLED = ("close-loop", "propose", "build")
_KILLS = 32


def run(*, seed: int, out: Path) -> dict[str, Any]:
    results = out / "failing-calls.json"
    campaign((), results, seed=seed)
    return campaign(_KILLED, results, seed=seed, kills=_KILLS)
