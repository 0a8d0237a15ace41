"""What a trained model of the lake says of the clips of a side: the `Predictions` that all scores are made of."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping

import numpy as np
import torch
from torch import Tensor

from flagdata.arrays import UInt8Array
from flagdata.dataset.pairs import Pairs
from flagdata.rng import child_seed
from flagdata.stated import Stated
from flagdata.workload import one_thread
from models.estimator import Estimator
from models.evaluation.predictions import Predictions
from models.learner import Learner, Loss
from models.restriction import Known
from models.training.inputs import Prepared

DRAWS = 200
_TOGETHER = 64
_TIMED = 12  # clips
_RIDGE = 1e-3  # of the mean eigenvalue of the embeddings' covariance
READ_FROM = ("wind_speed", "area_weight", "bending_scale", "anisotropy")
"""Targets that a model without a head is read for, by ridge regression of its embeddings of training clips."""


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
        note: what tables say beside the model; clips whose truth lies beyond the model's ranges are added to it.
        known: statements about quantities of all clips, by name; only distributions use it.
        fitted_on: clips of the training side, needed by a model without a head, whose embeddings are then read by ridge
            regression.
    """
    learner = estimator.learners[0]
    if learner.objective is Loss.CONTRASTIVE:
        targets = names = READ_FROM
        embedding = embedded(learner, prepared)
        mean = _read(embedding, prepared, fitted_on if fitted_on is not None else prepared, learner, targets)
        samples = None
    else:
        targets, names = learner.scaling.quantities, learner.scaling.names
        samples, mean, embedding = _predicted(estimator, prepared, seed=seed, known=known)
    truth = prepared.truth(names)
    if learner.objective is not Loss.CONTRASTIVE:
        note = "; ".join([note, *learner.scaling.beyond(truth)])
    return Predictions(
        label=label,
        targets=targets,
        truth=truth,
        mean=mean,
        samples=samples,
        embedding=embedding,
        group=prepared.sequence,
        parameters=sum(w.numel() for member in estimator.learners for w in member.network.parameters()),
        milliseconds=milliseconds,
        note=note,
    )


def _predicted(
    estimator: Estimator, prepared: Prepared, *, seed: int, known: Mapping[str, Stated] | None
) -> tuple[np.ndarray | None, np.ndarray, np.ndarray]:
    learner = estimator.learners[0]
    draws, means, embeddings = [], [], []
    for first in range(0, len(prepared), _TOGETHER):
        inputs = _batch(prepared, first).to(estimator.device)
        if learner.objective is Loss.POSTERIOR:
            statements = [
                Known.everywhere(name, statement, count=len(inputs)) for name, statement in (known or {}).items()
            ]
            estimates = estimator.estimate(inputs, seed=child_seed(seed, "clips", first), draws=DRAWS, known=statements)
            draws.append(estimates.draws)
            means.append(estimates.mean)
            embeddings.append(estimates.summary)
            continue
        with torch.no_grad():
            embedding = learner.network(inputs)
            means.append(learner.point_estimates(embedding).double().cpu().numpy())
            embeddings.append(embedding.float().cpu().numpy())
    return np.concatenate(draws) if draws else None, np.concatenate(means), np.concatenate(embeddings)


@torch.no_grad()
def embedded(learner: Learner, prepared: Prepared) -> np.ndarray:
    """Computes (n, dimension) float32 embeddings of the first variant of each entry."""
    device = next(learner.parameters()).device
    parts = [
        learner.network(_batch(prepared, first).to(device)).float().cpu().numpy()
        for first in range(0, len(prepared), _TOGETHER)
    ]
    return np.concatenate(parts)


def _read(
    embedding: np.ndarray, prepared: Prepared, fitted_on: Prepared, learner: Learner, targets: tuple[str, ...]
) -> np.ndarray:
    """Predicts (n, target) by ridge regression on the embeddings of `fitted_on`."""
    fitted = embedded(learner, fitted_on).astype(np.float64)
    truth = fitted_on.truth(targets)
    centre, level = fitted.mean(axis=0), truth.mean(axis=0)
    gram = (fitted - centre).T @ (fitted - centre)
    gram += _RIDGE * np.trace(gram) / len(gram) * np.eye(len(gram))
    weights = np.linalg.solve(gram, (fitted - centre).T @ (truth - level))
    return (embedding.astype(np.float64) - centre) @ weights + level


def _batch(prepared: Prepared, first: int) -> Tensor:
    entries = np.arange(first, min(first + _TOGETHER, len(prepared)))
    return prepared.batch(entries, np.zeros(len(entries), dtype=np.int64))


@torch.no_grad()
def time_a_clip(estimator: Estimator, pairs: Pairs) -> float:
    """Milliseconds a clip takes on one core from its pixels: the median of some clips, one at a time."""

    def work(clip: UInt8Array) -> None:
        inputs = estimator.inputs(clip)
        for learner in estimator.learners:
            learner.head(learner.network(inputs))

    return milliseconds(work, pairs)


def milliseconds(work: Callable[[UInt8Array], object], pairs: Pairs) -> float:
    """Times what one clip (1, frames, height, width) costs on one core: the median of some, decoded before [ms]."""
    clips = [pairs[index].clip.numpy() for index in range(min(_TIMED, len(pairs)))]
    times = []
    with one_thread():
        for clip in clips:
            begun = time.perf_counter()
            work(clip)
            times.append(time.perf_counter() - begun)
    return 1e3 * float(np.median(times))
