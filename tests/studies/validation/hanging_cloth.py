"""What the shipped model of hanging cloth says of area weight, beside the paper's errors and beside
knowing nothing.

Runia et al. 2020 (supplement, hanging cloth) measured three of Bouman's recordings by refinement:
0.17, 0.24 and 0.39 kg/m² were found as 0.22, 0.29 and 0.45. Those films are real and ours are
simulated, so that the errors are put beside each other, not compared. The spread of the tested
weights is reported with them: it is the error of always predicting the mean of the training clips.
The error of knowing the material's name, but not its drawn weight, is reported too.

The films are those of the test side of `clothsim-wide`, in a lake that FLAGDATA_CLOTH_LAKE names.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import torch

import flagdata
from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from flagdata.core.schema import Kind
from flagdata.dataset import Pairs
from models.trained import estimator
from models.training import DataSpec

PAPER = ((0.17, 0.22), (0.24, 0.29), (0.39, 0.45))
"""True and measured area weight [kg/m²]."""
TARGETS = 6
"""Materials of which one test clip each is shown."""
LEVEL = 0.9
DRAWS = 1000
RESAMPLES = 2000
_DATASET = "clothsim-wide"


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Errors on six targets of different materials and on the whole test side."""
    place = os.environ.get("FLAGDATA_CLOTH_LAKE")
    if place is None:
        return {"left_out": f"no lake; build {_DATASET} and set FLAGDATA_CLOTH_LAKE to its folder"}
    torch.set_num_threads(1)
    model = estimator.load_shipped("wave-cloth")
    source = flagdata.open(place)
    spec = DataSpec(datasets=(_DATASET,))
    train, test = (source.pairs(spec.rows, split=side) for side in ("train", "test"))
    rows = source.lake.rows(
        {"kind": Kind.RECORDING, **spec.where("test")}, columns=["artifact", "parameters"]
    )
    material = {
        row["artifact"]: json.loads(row["parameters"])["material"] for row in rows.to_pylist()
    }
    found = model.estimate(
        torch.cat([model.inputs(test[k].clip.numpy()) for k in range(len(test))]),
        seed=seed,
        draws=DRAWS,
    )
    low, high = found.interval(LEVEL)
    of = [material[str(recording)] for recording in test.table.recording]
    result: dict[str, Any] = {
        "model": model.name,
        "clips": len(test),
        "level": LEVEL,
        "paper": [list(pair) for pair in PAPER],
        "p_unlike_below_0.05": None
        if found.unlike is None
        else float((found.unlike < 0.05).mean()),
        "of": {},
    }
    for column, target in enumerate(found.targets):
        truth, known = (_of(pairs, target.name) for pairs in (test, train))
        result["of"][target.name] = _scores(
            truth,
            found.mean[:, column],
            low[:, column],
            high[:, column],
            known,
            unit=target.unit,
            seed=seed,
        )
    weight = [target.name for target in found.targets].index("area_weight")
    truth = _of(test, "area_weight")
    mean = found.mean[:, weight]
    result["known_material_rmse"] = _rmse(truth - _mean_of_each(truth, of))
    chosen = _one_of_each(of, seed)
    errors = np.abs(mean - truth)[chosen]
    result["targets"] = [
        {
            "material": of[k],
            "area_weight": float(truth[k]),
            "measured": float(mean[k]),
            "interval": [float(low[k, weight]), float(high[k, weight])],
            "wind": float(test.table.wind[k]),
        }
        for k in chosen
    ]
    result["targets_median_error"] = float(np.median(errors))
    trivial = np.abs(_of(train, "area_weight").mean() - truth)[chosen]
    result["targets_always_the_mean_median_error"] = float(np.median(trivial))
    result["paper_median_error"] = float(np.median([abs(a - b) for a, b in PAPER]))
    _draw(out / "validate-hanging-cloth.png", truth, mean, low[:, weight], high[:, weight], chosen)
    return result


def _of(pairs: Pairs, quantity: str) -> FloatArray:
    known = pairs.table.parameter_columns()
    if quantity in known:
        return known[quantity]
    return np.log10(np.stack([known[f"bending.{index}"] for index in range(15)])).mean(axis=0)


def _scores(
    truth: FloatArray,
    mean: FloatArray,
    low: FloatArray,
    high: FloatArray,
    known: FloatArray,
    *,
    unit: str,
    seed: int,
) -> dict[str, Any]:
    """RMSE with an interval over clips, one of each simulation, beside that of the training clips'
    mean."""
    drawn = stream(seed, "bootstrap", unit).integers(len(truth), size=(RESAMPLES, len(truth)))
    error, trivial = (mean - truth) ** 2, (known.mean() - truth) ** 2
    ours, theirs = np.sqrt(error[drawn].mean(axis=1)), np.sqrt(trivial[drawn].mean(axis=1))
    return {
        "unit": unit,
        "rmse": float(np.sqrt(error.mean())),
        "rmse_interval": np.quantile(ours, [0.05, 0.95]).tolist(),
        "median_error": float(np.median(np.sqrt(error))),
        "bias": float((mean - truth).mean()),
        "always_the_mean_rmse": float(np.sqrt(trivial.mean())),
        "always_the_mean_median_error": float(np.median(np.sqrt(trivial))),
        "rmse_over_always_the_mean": float(np.sqrt(error.mean() / trivial.mean())),
        "ratio_interval": np.quantile(ours / theirs, [0.05, 0.95]).tolist(),
        "spread_of_training": float(known.std()),
        "covered": float(((low <= truth) & (truth <= high)).mean()),
        "pearson": float(np.corrcoef(mean, truth)[0, 1]),
    }


def _rmse(error: FloatArray) -> float:
    return float(np.sqrt((error**2).mean()))


def _mean_of_each(values: FloatArray, of: list[str]) -> FloatArray:
    """The mean of all clips of a clip's own material, that clip left out; of a material with one
    clip that of all."""
    found = np.empty(len(values))
    for k, name in enumerate(of):
        others = [j for j, other in enumerate(of) if other == name and j != k]
        found[k] = values[others].mean() if others else np.delete(values, k).mean()
    return found


def _one_of_each(of: list[str], seed: int) -> list[int]:
    """A clip of each of six materials, drawn by chance before any estimate is looked at."""
    generator = stream(seed, "targets")
    names = generator.permutation(sorted(set(of)))[:TARGETS]
    return [
        int(generator.choice([k for k, name in enumerate(of) if name == wanted]))
        for wanted in names
    ]


def _draw(
    path: Path,
    truth: FloatArray,
    mean: FloatArray,
    low: FloatArray,
    high: FloatArray,
    chosen: list[int],
) -> None:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(4.5, 4.2), dpi=110, layout="constrained")
    axes = figure.subplots()
    ends = [0.07, 0.46]
    axes.plot(ends, ends, color="0.6", linewidth=0.8)
    axes.errorbar(
        truth,
        mean,
        yerr=[mean - low, high - mean],
        fmt="o",
        markersize=3,
        linewidth=0.6,
        color="0.45",
        label="test clips, 90 %",
    )
    axes.plot(truth[chosen], mean[chosen], "o", color="C3", label="six materials")
    axes.plot(*zip(*PAPER, strict=True), "x", color="C0", label="Runia et al., real films")
    axes.set(xlabel="area weight [kg/m²]", ylabel="measured [kg/m²]", xlim=ends, ylim=ends)
    axes.legend(fontsize=7)
    figure.savefig(path)
