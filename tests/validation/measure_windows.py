"""Whether intervals of several windows together hold what they say: on the test side's films, whose truth is known.

The lake is that of FLAGDATA_LAKE, with the data set that the shipped model was trained on. A film of it is two seconds
long: its first and last 1.2 s are two windows that share up to a third of their frames, as they did when the
correlation of their errors was measured, on the validation side.
"""

from __future__ import annotations

import os
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

import flagdata
from flagdata.console import progress
from flagdata.rng import child_seed, stream
from measure.estimate.combine import OWN, combined
from measure.estimate.dependence import of_model
from models import estimator
from models.estimator import Estimator
from models.targets import truth
from models.training.recipe import DataSpec

LEVELS = (0.5, 0.8, 0.9)
FILMS = 300
_DRAWS = 400


def run(*, seed: int, out: object) -> dict[str, Any]:
    """Coverage, width and error of one window and of two, by target."""
    path = os.environ.get("FLAGDATA_LAKE")
    if path is None:
        return {"left_out": "no lake; set FLAGDATA_LAKE to the one that the shipped model was trained on"}
    model = estimator.shipped()
    recipe: Any = model.card["recipe"]
    data: Any = model.card["data"]
    spec = DataSpec.of_identity(recipe["data"])
    split = spec.split("train", "test")
    pairs = flagdata.open(path).pairs(at=data["at"], split="test", split_by=split)
    chosen = np.unique(pairs.table.seed, return_index=True)[1][:FILMS].tolist()
    names = tuple(model.learners[0].scaling.names)
    columns = pairs.table.parameter_columns(chosen)
    known = truth(columns, names)
    draws: dict[str, list[NDArray[np.float64]]] = {"one window": [], "two windows": []}
    count = model.front_end.frames
    with progress(len(chosen), label="windows", unit="film") as advance:
        for number, index in enumerate(chosen):
            film = pairs.film(index)
            inputs = model.inputs(np.stack([film[:count], film[-count:]]))
            found = model.logits(model.embeddings(inputs), seed=child_seed(seed, "film", number), draws=_DRAWS)
            logits = found.double().numpy()
            for label, windows in (("one window", logits[:1]), ("two windows", logits)):
                draws[label].append(_joint(model, windows, seed=seed, number=number))
            advance(1)
    dependence = of_model(model)
    return {
        "model": model.name, "films": len(chosen),
        "dependence": {"wind": dependence.wind, "cloth": dependence.cloth, "source": dependence.source},
        **{label: _judged(np.stack(values), known, names) for label, values in draws.items()},
    }  # fmt: skip


def _joint(model: Estimator, logits: NDArray[np.float64], *, seed: int, number: int) -> NDArray[np.float64]:
    """(draw, target) of windows together, the wind their mean."""
    learner = model.learners[0]
    names = tuple(learner.scaling.names)
    winds, cloth = combined(
        logits, names=names, centre=learner.centre.double().numpy(), spread=learner.spread.double().numpy(),
        dependence=of_model(model), generator=stream(seed, "combine", number),
    )  # fmt: skip
    whole = np.empty((*winds.shape[:2], len(names)))
    whole[..., [name in OWN for name in names]] = winds
    whole[..., [name not in OWN for name in names]] = cloth
    return learner.scaling.values(torch.from_numpy(whole)).numpy().mean(axis=0)


def _judged(draws: NDArray[np.float64], known: NDArray[np.float64], names: tuple[str, ...]) -> dict[str, Any]:
    """Of draws (film, draw, target) against the truth (film, target)."""
    covered = {}
    for level in LEVELS:
        low, high = np.quantile(draws, [(1 - level) / 2, (1 + level) / 2], axis=1)
        covered[f"{level:g}"] = ((low <= known) & (known <= high)).mean(axis=0)
    low, high = np.quantile(draws, [0.05, 0.95], axis=1)
    error = draws.mean(axis=1) - known
    return {
        name: {
            "rmse": float(np.sqrt(np.mean(error[:, k] ** 2))), "median_absolute": float(np.median(np.abs(error[:, k]))),
            "width": float((high - low)[:, k].mean()), "covered": {level: float(c[k]) for level, c in covered.items()},
        }
        for k, name in enumerate(names)
    }  # fmt: skip
