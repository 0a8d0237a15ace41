"""Films of flags in gusts that a wind series is calibrated and judged on, made once and kept.

The cloths, lights and cameras are those of the data set `outdoor-damped`, which the default network
learned from; the
gusts are not: the network learned from steady winds alone (`tests.studies.long_films.gusty`).
"""

from __future__ import annotations

import pickle
from pathlib import Path

from flagdata.core.console import progress
from models.trained.estimator import Estimator
from tests.studies.long_films import LongFilm, gusty

DATASET = "outdoor-damped"
SPEED = (3.0, 10.0)
"""m/s, mean winds of films."""
INTENSITY = (0.08, 0.25)
"""Standard deviations of the gusts over the mean."""
WINDOWS = 10
"""Windows of a film, 12 s of it."""


def made(folder: Path, model: Estimator, *, count: int, seed: int) -> list[LongFilm]:
    """Films of a seed, made where the folder has not got them.

    Args:
        folder: where they are kept, a file a seed.
        count: of films.
    """
    path = folder / f"films-{seed}-{count}.pickle"
    if not path.exists():
        folder.mkdir(parents=True, exist_ok=True)
        with progress(count, label=f"films of seed {seed}", unit="film") as advance:
            films = []
            for film in gusty(
                model,
                dataset=DATASET,
                count=count,
                windows=WINDOWS,
                seed=seed,
                speed=SPEED,
                intensity=INTENSITY,
            ):
                films.append(film)
                advance(1)
        path.write_bytes(pickle.dumps(films))
    return list(pickle.loads(path.read_bytes()))
