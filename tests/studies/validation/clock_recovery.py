"""Is the hidden offset of two clocks found, and does its interval cover it as often as it says?

Field recordings of 10 minutes are made with drawn flags in gusty wind, each with a hidden offset;
the clock estimator gets the frames (as uint8 pictures at 25 Hz) and the anemometer's log alone. As
many recordings in steady wind must all be refused.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.align import LagEstimate, LagSearch, estimate_offset, motion_energy, wind_bins
from flagdata.core.rng import stream
from flagdata.ingest import WindOptions, read_log
from flagdata.timebase import NANOSECONDS, from_datetime
from measure.demo import SENSOR, START
from measure.demo.logger import ZONE
from sim.wind import VonKarman
from tests.drawn.field import DrawnRecipe, write_drawn_log
from tests.drawn.flag import DrawnFlag

_RATE = 25
_RECORDINGS = 20


def _estimate(recipe: DrawnRecipe) -> tuple[LagEstimate, float]:
    start = from_datetime(START)
    pictures = DrawnFlag().frames(recipe.at_frames(), recipe.rate, stream(recipe.seed, "camera"))
    motion = motion_energy(
        (start + i * NANOSECONDS // _RATE, picture) for i, picture in enumerate(pictures)
    )
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "anemometer.csv"
        offset = write_drawn_log(log, recipe)
        recipe_file = Path(folder) / "cup-logger.toml"
        recipe_file.write_text(SENSOR)
        series = read_log(log, WindOptions(recipe=str(recipe_file), zone=ZONE)).series
    bins = wind_bins(series)
    search = LagSearch(stamp_sigma=bins.sigma)
    estimate = estimate_offset(
        motion, bins.average, search=search, generator=stream(recipe.seed, "surrogates")
    )
    return estimate, offset


def run(*, seed: int, out: Path) -> dict[str, Any]:
    gusty, steady = [], []
    for i in range(_RECORDINGS):
        recipe = DrawnRecipe(seed=seed * 1000 + i)
        estimate, offset = _estimate(recipe)
        gusty.append((estimate, offset))
    for i in range(_RECORDINGS // 4):
        calm = VonKarman(mean=5.0, intensity=0.005, length=60.0)
        steady.append(_estimate(DrawnRecipe(seed=seed * 1000 + 500 + i, wind=calm))[0])
    errors = np.array([abs(e.offset - o) for e, o in gusty if e.is_accepted])
    return {
        "recordings": _RECORDINGS,
        "minutes": 10,
        "accepted": len(errors),
        "median_error_s": float(np.median(errors)),
        "largest_error_s": float(errors.max()),
        "within_half_a_second": int((errors <= 0.5).sum()),
        "covered_by_90_percent_interval": sum(
            e.interval[0] <= o <= e.interval[1] for e, o in gusty if e.is_accepted
        ),
        "median_sigma_s": float(np.median([e.sigma for e, _ in gusty if e.is_accepted])),
        "steady_recordings": len(steady),
        "steady_refused": sum(not e.is_accepted for e in steady),
    }
