"""What a trained model of the lake says of the clips of a side: the `Predictions` that all scores
are made of."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import FloatArray, UInt8Array
from flagdata.core.rng import child_seed
from flagdata.core.stated import Stated
from flagdata.core.workload import one_thread
from flagdata.dataset.pairs import Pairs
from flagdata.errors import InputError
from models.evaluation.predictions import Predictions
from models.maps.frontend import FrontEnd
from models.networks.learner import Learner, Loss
from models.networks.targets import Scaling, stated_targets
from models.trained.estimator import Estimator
from models.trained.restriction import Known
from models.training.inputs import Prepared, clip_as_taken

DRAWS = 200
_TOGETHER = 64
_TIMED = 12  # clips
_RIDGE = 1e-3  # of the mean eigenvalue of the embeddings' covariance
READ_FROM = ("wind_speed", "area_weight", "bending_scale", "anisotropy")
"""Targets that a model without a head is read for, by ridge regression of its embeddings of
training clips."""


def judged_targets(estimator: Estimator, *clips: Mapping[str, FloatArray]) -> tuple[str, ...]:
    """Selects the targets that a model is judged by: those that every clip states, by their keys.

    Args:
        clips: name → (n,) parameters of the clips that are judged, and of those that embeddings are
            read by.

    Raises:
        InputError: there is none.
    """
    learner = estimator.learners[0]
    names = READ_FROM if learner.objective is Loss.CONTRASTIVE else learner.scaling.names
    for parameters in clips:
        names = stated_targets(parameters, names)
    if not names:
        raise InputError(
            f"not all clips state any of the targets of the model {estimator.name!r}",
            where="the clips' parameters",
            fix="leave the model out, or judge it on simulated clips",
        )
    return names


def predict(
    estimator: Estimator,
    prepared: Prepared,
    *,
    label: str,
    note: str,
    milliseconds: float,
    seed: int,
    fitted_on: Prepared | None = None,
    known: Mapping[str, Stated] | None = None,
) -> Predictions:
    """Predicts the targets of prepared clips by a model.

    Args:
        note: what tables say beside the model; targets that are not judged, since not all clips
            state them, and clips whose truth lies beyond the model's ranges are added to it.
        known: statements about quantities of all clips, by name; only distributions use it.
        fitted_on: clips of the training side, needed by a model without a head, whose embeddings
            are then read by ridge regression.

    Raises:
        InputError: see `judged_targets`.
    """
    learner = estimator.learners[0]
    if learner.objective is Loss.CONTRASTIVE:
        fitted_on = fitted_on if fitted_on is not None else prepared
        names = targets = judged_targets(estimator, prepared.parameters, fitted_on.parameters)
        embedding = embed_entries(learner, prepared)
        mean = _read(embedding, prepared, fitted_on, learner, names)
        samples, truth, left_out = None, prepared.truth(names), set(READ_FROM) - set(names)
    else:
        names = judged_targets(estimator, prepared.parameters)
        judged = Scaling(names=names)
        columns = [learner.scaling.names.index(name) for name in names]
        samples, mean, embedding = _predict_entries(estimator, prepared, seed=seed, known=known)
        samples, mean = None if samples is None else samples[:, :, columns], mean[:, columns]
        targets, truth = judged.quantities, prepared.truth(names)
        left_out = set(learner.scaling.quantities) - set(targets)
        note = "; ".join([note, *judged.beyond(truth)])
    if left_out:
        note = f"{note}; not judged by {', '.join(sorted(left_out))}, which not all clips state"
    return Predictions(
        label=label,
        targets=targets,
        truth=truth,
        mean=mean,
        samples=samples,
        embedding=embedding,
        group=prepared.sequence,
        parameters=sum(
            w.numel() for member in estimator.learners for w in member.network.parameters()
        ),
        milliseconds=milliseconds,
        note=note,
    )


def _predict_entries(
    estimator: Estimator, prepared: Prepared, *, seed: int, known: Mapping[str, Stated] | None
) -> tuple[np.ndarray | None, np.ndarray, np.ndarray]:
    learner = estimator.learners[0]
    draws, means, embeddings = [], [], []
    for first in range(0, len(prepared), _TOGETHER):
        inputs = _batch(prepared, first).to(estimator.device)
        if learner.objective is Loss.POSTERIOR:
            statements = [
                Known.everywhere(name, statement, count=len(inputs))
                for name, statement in (known or {}).items()
            ]
            estimates = estimator.estimate(
                inputs, seed=child_seed(seed, "clips", first), draws=DRAWS, known=statements
            )
            draws.append(estimates.draws)
            means.append(estimates.mean)
            embeddings.append(estimates.summary)
            continue
        with torch.no_grad():
            embedding = learner.network(inputs)
            means.append(learner.point_estimates(embedding).double().cpu().numpy())
            embeddings.append(embedding.float().cpu().numpy())
    return (
        np.concatenate(draws) if draws else None,
        np.concatenate(means),
        np.concatenate(embeddings),
    )


@torch.no_grad()
def embed_entries(learner: Learner, prepared: Prepared) -> np.ndarray:
    """Computes (n, dimension) float32 embeddings of the first variant of each entry."""
    device = next(learner.parameters()).device
    parts = [
        learner.network(_batch(prepared, first).to(device)).float().cpu().numpy()
        for first in range(0, len(prepared), _TOGETHER)
    ]
    return np.concatenate(parts)


def _read(
    embedding: np.ndarray,
    prepared: Prepared,
    fitted_on: Prepared,
    learner: Learner,
    targets: tuple[str, ...],
) -> np.ndarray:
    """Predicts (n, target) by ridge regression on the embeddings of `fitted_on`."""
    fitted = embed_entries(learner, fitted_on).astype(np.float64)
    truth = fitted_on.truth(targets)
    centre, level = fitted.mean(axis=0), truth.mean(axis=0)
    gram = (fitted - centre).T @ (fitted - centre)
    gram += _RIDGE * np.trace(gram) / len(gram) * np.eye(len(gram))
    weights = np.linalg.solve(gram, (fitted - centre).T @ (truth - level))
    return (embedding.astype(np.float64) - centre) @ weights + level


def _batch(prepared: Prepared, first: int) -> Tensor:
    entries = np.arange(first, min(first + _TOGETHER, len(prepared)))
    return prepared.batch(entries, np.zeros(len(entries), dtype=np.int64))


def timed_clips(pairs: Pairs, front_end: FrontEnd) -> list[UInt8Array]:
    """Decodes some clips (1, frames, height, width) to time a model by."""
    return [clip_as_taken(pairs, row, front_end)[None] for row in range(min(_TIMED, len(pairs)))]


@torch.no_grad()
def time_a_clip(estimator: Estimator, pairs: Pairs) -> float:
    """Milliseconds a clip takes on one core from its pixels: the median of some clips, one at a
    time."""

    def work(clip: UInt8Array) -> None:
        inputs = estimator.inputs(clip)
        for learner in estimator.learners:
            learner.head(learner.network(inputs))

    return milliseconds(work, timed_clips(pairs, estimator.front_end))


def milliseconds(work: Callable[[UInt8Array], object], clips: Sequence[UInt8Array]) -> float:
    """Times what one clip costs on one core: the median of some [ms]."""
    times = []
    with one_thread():
        for clip in clips:
            begun = time.perf_counter()
            work(clip)
            times.append(time.perf_counter() - begun)
    return 1e3 * float(np.median(times))
