"""What needs no network: ridge regression and gradient boosting on a page of hand-made features, beside the
networks."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flagdata.dataset.pairs import Pairs
from flagdata.rng import child_seed
from models.boosting import fit_boosting
from models.crops import Cropping
from models.evaluation.predict import DRAWS, milliseconds
from models.evaluation.predictions import Predictions
from models.frontend import FrontEnd
from models.handmade import FEATURES, features
from models.ridge import fit_ridge
from models.training.inputs import Prepared, prepare_clips, prepare_films

TARGETS = ("wind_speed", "density", "bending_scale", "anisotropy")
_FRONT_END = FrontEnd(maps="handmade")
_VARIANTS = 4

Bars = Callable[[int, str, str], AbstractContextManager[Callable[[int], None]]]


def predictions(train: Pairs, judged: Pairs, *, cache: Path, workers: int, seed: int, bars: Bars) -> list[Predictions]:
    """Ridge and gradient boosting, fitted on crops of the training side's films, for the clips of another side."""
    cropping = Cropping()
    with bars(len(set(train.table.recording.tolist())), "hand-made features to fit on", "film") as advance:
        known = prepare_films(
            train, _FRONT_END, cropping, variants=_VARIANTS, folder=cache, workers=workers, advance=advance
        )
    with bars(len(judged), "hand-made features to judge", "clip") as advance:
        asked = prepare_clips(judged, _FRONT_END, cropping, folder=cache, workers=workers, advance=advance)
    x, y = _table(known, _VARIANTS), np.tile(known.truth(TARGETS), (_VARIANTS, 1))
    group = np.tile(known.sequence, _VARIANTS)
    wanted, truth = _table(asked, 1), asked.truth(TARGETS)

    def work(clip: NDArray[np.uint8]) -> None:
        film = clip[0]
        cut = cropping.cut(film, cropping.whole((film.shape[0], film.shape[1], film.shape[2])))
        features(cut[None].float(), rate=_FRONT_END.rate)

    spent = milliseconds(work, judged)
    ridge = fit_ridge(x, y, group=group)
    boosting = fit_boosting(x, y, seed=child_seed(seed, "boosting") % 2**32)
    common = {"targets": TARGETS, "truth": truth, "group": asked.sequence, "embedding": None}
    note = f"{len(FEATURES)} hand-made features, {_VARIANTS} crops of each film"
    return [
        Predictions(
            label="ridge", mean=ridge.predict(wanted), samples=None, milliseconds=spent, note=note,
            parameters=ridge.weights.size + ridge.intercept.size, **common,
        ),
        Predictions(
            label="boosting", mean=boosting.predict(wanted), samples=boosting.samples(wanted, count=DRAWS),
            milliseconds=spent, note=note, parameters=0, **common,
        ),
    ]  # fmt: skip


def _table(prepared: Prepared, variants: int) -> NDArray[np.float64]:
    entries = np.arange(len(prepared))
    parts = [prepared.batch(entries, np.full(len(entries), variant)).double().numpy() for variant in range(variants)]
    return np.concatenate(parts)
