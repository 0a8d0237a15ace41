"""What needs no network: ridge regression and gradient boosting on a page of hand-made features,
beside the networks."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from torch import Tensor

from flagdata.core.arrays import FloatArray, UInt8Array
from flagdata.core.rng import child_seed
from flagdata.dataset import Pairs
from flagdata.errors import InputError
from models.evaluation import Predictions
from models.evaluation.predict import DRAWS, milliseconds, timed_clips
from models.maps.crops import Cropping
from models.maps.frontend import FrontEnd
from models.maps.handmade import FEATURES, features
from models.networks.targets import stated_targets
from models.training import Prepared, prepare_clips, prepare_films
from models.training.inputs import film_rows, simulations
from tests.studies.yardsticks.boosting import ENSEMBLES, Boosting, fit_boosting
from tests.studies.yardsticks.ridge import Ridge, check_folds, fit_ridge

TARGETS = ("wind_speed", "area_weight", "bending_scale", "anisotropy")
_FRONT_END = FrontEnd(maps="handmade")
_CROPPING = Cropping()
_VARIANTS = 4

Bars = Callable[[int, str, str], AbstractContextManager[Callable[[int], None]]]


@dataclass(frozen=True, kw_only=True, eq=False)
class Fitted:
    """Both models, fitted on the same crops of a data set's films.

    Attributes:
        targets: what they predict, in this order: those of `TARGETS` that all clips state.
    """

    targets: tuple[str, ...]
    ridge: Ridge
    boosting: Boosting

    def quantiles(self, film: UInt8Array) -> FloatArray:
        """Quantiles that boosting predicts for a clip (frame, height, width): (level, target)."""
        return self.boosting.predict_quantiles(_features(film).double().numpy())[0]


def check_stated(train: Pairs, *judged: Pairs) -> tuple[str, ...]:
    """Returns the targets that all clips state, once both models can be fitted to them.

    Raises:
        InputError: there is none, or the training side has too few simulations.
    """
    targets = TARGETS
    for pairs in (train, *judged):
        targets = stated_targets(pairs.table.parameter_columns(), targets)
    if not targets:
        raise InputError(
            "not all clips state any of the targets of hand-made features",
            where="--handmade",
            fix=f"leave it out, or judge on clips that state one of {', '.join(TARGETS)}",
        )
    check_folds(simulations(train, film_rows(train, sequences=None, seed=0)))
    return targets


def fit_baselines(
    train: Pairs, *judged: Pairs, cache: Path, workers: int, seed: int, bars: Bars
) -> Fitted:
    """Fits ridge and gradient boosting on crops of the training side's films, to what the judged
    clips state, too.

    Raises:
        InputError: see `check_stated`.
    """
    targets = check_stated(train, *judged)
    with bars(
        len(set(train.table.recording.tolist())), "hand-made features to fit on", "film"
    ) as advance:
        inputs = prepare_films(
            train,
            _FRONT_END,
            _CROPPING,
            variants=_VARIANTS,
            folder=cache,
            workers=workers,
            advance=advance,
        )
    x, y = _table(inputs, _VARIANTS), np.tile(inputs.truth(targets), (_VARIANTS, 1))
    group = np.tile(inputs.sequence, _VARIANTS)
    ridge = fit_ridge(x, y, group=group)
    with bars(ENSEMBLES * len(targets), "gradient boosting", "ensemble") as advance:
        boosting = fit_boosting(x, y, seed=child_seed(seed, "boosting") % 2**32, advance=advance)
    return Fitted(targets=targets, ridge=ridge, boosting=boosting)


def predictions(
    train: Pairs, pairs: Pairs, *, cache: Path, workers: int, seed: int, bars: Bars
) -> list[Predictions]:
    """Predicts the targets of another side's clips by both models."""
    models = fit_baselines(train, pairs, cache=cache, workers=workers, seed=seed, bars=bars)
    targets, ridge, boosting = models.targets, models.ridge, models.boosting
    with bars(len(pairs), "hand-made features to judge", "clip") as advance:
        inputs = prepare_clips(
            pairs, _FRONT_END, _CROPPING, folder=cache, workers=workers, advance=advance
        )
    wanted, truth = _table(inputs, 1), inputs.truth(targets)
    spent = milliseconds(lambda clip: _features(clip[0]), timed_clips(pairs, _FRONT_END))
    common = {"targets": targets, "truth": truth, "group": inputs.sequence, "embedding": None}
    note = f"{len(FEATURES)} hand-made features, {_VARIANTS} crops of each film"
    if len(targets) < len(TARGETS):
        note += (
            f"; not judged by {', '.join(sorted({*TARGETS} - {*targets}))}, which not all clips "
            "state"
        )
    return [
        Predictions(
            label="ridge",
            mean=ridge.predict(wanted),
            samples=None,
            milliseconds=spent,
            note=note,
            parameters=ridge.weights.size + ridge.intercept.size,
            **common,
        ),
        Predictions(
            label="boosting",
            mean=boosting.predict(wanted),
            samples=boosting.samples(wanted, count=DRAWS),
            milliseconds=spent,
            note=note,
            parameters=0,
            **common,
        ),
    ]


def _features(film: UInt8Array) -> Tensor:
    """Computes (1, feature) of a clip."""
    cut = _CROPPING.cut(film, _CROPPING.whole((film.shape[0], film.shape[1], film.shape[2])))
    return features(cut[None].float(), rate=_FRONT_END.rate)


def _table(prepared: Prepared, variants: int) -> FloatArray:
    entries = np.arange(len(prepared))
    parts = [
        prepared.batch(entries, np.full(len(entries), variant)).double().numpy()
        for variant in range(variants)
    ]
    return np.concatenate(parts)
