"""Embeddings laid out in the plane by t-SNE, for a picture with the wind as colour.

Barnes-Hut t-SNE (van der Maaten, JMLR 15:3221, 2014) of scikit-learn, which is loaded only here.
Distances between clusters and their sizes in such a picture mean nothing.
"""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from flagdata.core import rng
from flagdata.core.arrays import FloatArray
from flagdata.errors import InputError, UsageError
from models.evaluation import Predictions
from models.evaluation.predictions import WIND

PERPLEXITY = 30.0
CLIPS = 2000
"""Most clips in a picture."""


@dataclass(frozen=True, kw_only=True, eq=False)
class TsneLayout:
    """Places (n, 2) of clips in the plane and their true wind (n,) [m/s], of `clips` that were
    tested."""

    JSON_NAMES: ClassVar = ("label", "places", "wind")

    label: str
    places: FloatArray
    wind: FloatArray
    clips: int


def layout(
    predictions: Predictions, *, seed: int, perplexity: float = PERPLEXITY, most: int = CLIPS
) -> TsneLayout:
    """Lays out the embedding of a model; the same for one seed.

    Args:
        predictions: with an embedding and the wind among its targets.
        seed: of the choice of clips, where there are more than `most`, and of the optimiser.
        perplexity: about how many neighbours a clip has; below the number of clips.
        most: clips to lay out.

    Raises:
        UsageError: scikit-learn is not installed.
        InputError: no embedding, or no more clips than the perplexity.
    """
    if importlib.util.find_spec("sklearn") is None:
        raise UsageError(
            "t-SNE needs scikit-learn",
            where="tsne",
            fix="pip install scikit-learn, or leave t-SNE out",
        )
    from sklearn.manifold import TSNE  # pyright: ignore[reportMissingImports]

    where = f"predictions of {predictions.label!r}"
    if predictions.embedding is None:
        raise InputError("the model gives no embedding", where=where, fix="choose a model with one")
    wind = predictions.truth[:, predictions.column(WIND)]
    chosen = np.arange(predictions.clips)
    if predictions.clips > most:
        chosen = np.sort(
            rng.stream(seed, "evaluation", "t-sne", "clips").choice(
                predictions.clips, most, replace=False
            )
        )
    if len(chosen) <= perplexity:
        raise InputError(
            f"{len(chosen)} clips do not admit a perplexity of {perplexity:g}",
            where=where,
            fix="lay out more clips, or lower it",
        )
    optimiser = TSNE(
        n_components=2,
        perplexity=perplexity,
        method="barnes_hut",
        init="pca",
        learning_rate="auto",
        random_state=rng.child_seed(seed, "evaluation", "t-sne", "optimiser") % 2**32,
    )
    places = optimiser.fit_transform(predictions.embedding[chosen]).astype(np.float64)
    return TsneLayout(
        label=predictions.label, places=places, wind=wind[chosen], clips=predictions.clips
    )
