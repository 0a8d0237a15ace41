"""Predictions made for tests."""

from __future__ import annotations

import dataclasses

import numpy as np
from numpy.typing import NDArray

from flagdata.answer import Quantity, Span
from models.evaluation import Predictions
from models.evaluation.bootstrap import LEVEL, ScoreEstimate
from models.evaluation.curves import LearningPoint
from models.evaluation.evaluation import Evaluation, evaluate


def generator(seed: int) -> np.random.Generator:
    return np.random.Generator(np.random.PCG64(seed))


def of_wind(
    truth: list[float] | NDArray,
    mean: list[float] | NDArray,
    *,
    group: list[int] | NDArray | None = None,
    label: str = "made",
    embedding: NDArray | None = None,
    samples: NDArray | None = None,
) -> Predictions:
    """Predictions of wind speed alone; each clip is its own sequence unless `group` is given."""
    return Predictions(
        label=label,
        targets=("wind_speed",),
        truth=np.asarray(truth, dtype=np.float64)[:, None],
        mean=np.asarray(mean, dtype=np.float64)[:, None],
        samples=None if samples is None else samples.astype(np.float32)[:, :, None],
        embedding=None if embedding is None else embedding.astype(np.float32),
        group=np.arange(len(truth)) if group is None else np.asarray(group, dtype=np.int64),
        parameters=10,
        milliseconds=1.5,
        note="made",
    )


def score(value: float, low: float, high: float) -> ScoreEstimate:
    """A score with its interval."""
    span = Span(low=low, high=high, level=LEVEL, bound=None, estimated=False)
    quantity = Quantity(name="made", unit="1", value=value, sigma=None, span=span)
    return ScoreEstimate(quantity=quantity, clips=10, groups=5)


def posterior(
    *, clips: int, draws: int, wide: float, shift: float, targets: int, seed: int, group: int = 1
) -> Predictions:
    """θ ~ N(0, 1) seen with noise of variance 1: the posterior is N(x / 2, σ²) with σ² = 1/2.

    Draws are of N(x / 2 + shift σ, (wide σ)²), so wide = 1 and shift = 0 is exact. Each clip has
    its own θ; `group` of them form one sequence.
    """
    random = generator(seed)
    truth = random.normal(size=(clips, targets))
    mean = (truth + random.normal(size=truth.shape)) / 2 + shift * np.sqrt(0.5)
    samples = mean[:, None, :] + wide * np.sqrt(0.5) * random.normal(size=(clips, draws, targets))
    return Predictions(
        label="posterior",
        targets=("wind_speed", "area_weight", "anisotropy")[:targets],
        truth=truth,
        mean=mean,
        samples=samples.astype(np.float32),
        embedding=None,
        group=np.arange(clips) // group,
        parameters=10,
        milliseconds=1.5,
        note="",
    )


GROUP = np.repeat(np.arange(30), 4)
WIND = np.repeat(np.linspace(0, 10, 30), 4)


def run(label: str, scale: float, seed: int, *, group: np.ndarray = GROUP) -> Predictions:
    error = scale * generator(seed).normal(size=120)
    return of_wind(WIND, WIND + error, group=group, label=label, embedding=WIND[:, None])


def ours(seed: int) -> Predictions:
    made = posterior(clips=120, draws=20, wide=1, shift=0, targets=2, seed=seed)
    truth = np.column_stack(
        [WIND, made.truth[:, 1] * 0 + np.repeat(np.linspace(0.05, 0.15, 30), 4)]
    )
    mean = truth + [0.1, 0.01] * generator(seed).normal(size=(120, 2))
    samples = mean[:, None] + [0.1, 0.01] * generator(seed + 1).normal(size=(120, 20, 2))
    return dataclasses.replace(
        made,
        label="ours <&>",
        truth=truth,
        mean=mean,
        samples=samples.astype(np.float32),
        group=GROUP,
    )


def compared() -> Evaluation:
    """Three models, one of two runs, and a learning curve."""
    return evaluate(
        [run("SDN", 0.3, 1), ours(3), run("SDN", 0.5, 2), run("ResNet-18", 1.5, 4)],
        data="made@v1",
        seed=0,
        draws=100,
        learning=[
            LearningPoint(label="SDN", sequences=n, score=score(9 / n, 8 / n, 10 / n))
            for n in (10, 20)
        ],
    )
