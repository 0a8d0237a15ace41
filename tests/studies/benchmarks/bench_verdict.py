"""What a verdict costs on this machine's cores: three recordings of 9 s, with a bank of nulls and
without one.

The recordings are nulls of `tests.studies.validation.stressors`, at 25 Hz in winds that fluctuate,
with 70, 204 and 513 markers. The time with a bank is that of the verdict alone, the median of
several; without one the bank is simulated before.
"""

from __future__ import annotations

import os
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

from flagdata.core.rng import child_seed
from measure.forecasting import Setting
from measure.loop import LoopOptions, solve
from measure.nulls import bank as banks
from measure.nulls import batches
from measure.verdict import CRITERIA
from tests.studies.validation import stressors

_ACROSS = (10, 17, 27)
"""Markers along the flag: 70, 204 and 513 in all."""
_RUNS = 3


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Seconds of verdicts by the number of markers, and of the bank's simulation; nothing is
    written into `out`."""
    del out
    return {
        "cores": _cores(),
        "recordings": len(stressors.SPEEDS),
        "seconds_each": stressors.DURATION,
        "kinds": CRITERIA.simulated_kinds,
        "verdicts": [_timed(across, seed) for across in _ACROSS],
    }


def _cores() -> int:
    return len(os.sched_getaffinity(0))


def _timed(across: int, seed: int) -> dict[str, Any]:
    """Seconds with a bank, least and median, and of simulating it: all, or the kinds that end the
    simulation where the base model is sufficient."""
    truth = stressors.simulated("", 0, seed, across=across)
    experiment = stressors.experiment(truth, "none", seed, across=across)
    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        wanted = batches(
            Setting.of(experiment), kinds=CRITERIA.simulated_kinds, seed=child_seed(seed, "bank")
        )
        banks.build(Path(folder), wanted[: CRITERIA.first_kinds], workers=_cores())
        first = time.perf_counter() - began
        banks.build(Path(folder), wanted, workers=_cores())
        built = time.perf_counter() - began
        options = LoopOptions(bank=Path(folder), seed=seed, workers=_cores())
        found: list[float] = []
        for _ in range(_RUNS):
            began = time.perf_counter()
            solve(experiment, options)
            found.append(time.perf_counter() - began)
    return {
        "markers": len(stressors.markers(across)),
        "bank": built,
        "with_bank": min(found),
        "with_bank_median": statistics.median(found),
        "without_bank": built + statistics.median(found),
        "without_bank_sufficient": first + statistics.median(found),
    }
