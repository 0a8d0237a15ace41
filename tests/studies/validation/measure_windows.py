"""Whether intervals of one window and of several together hold what they say, on long films whose
truth is known.

Films of six windows of 1.2 s are simulated of the cloths that the shipped model was trained on,
each with a seed of its own (`tests.studies.long_films`). One window of each: ranks of
simulation-based calibration (Talts et al., arXiv:1804.06788), coverage, and expected coverage by
random points (TARP). Two, four and six: coverage, error and width of the answer that `flagdata
measure` gives. Errors of two windows correlate by their distance in time.

FLAGDATA_WINDOWS_FILMS says how many films (300).
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import torch

from flagdata.core.arrays import BoolArray, FloatArray
from flagdata.core.console import progress
from flagdata.core.rng import child_seed, stream
from measure.estimate import OWN, combine_windows, of_model
from models.evaluation import LEVELS, Predictions, Resamples, coverage, rank_histogram, tarp
from models.evaluation.predictions import WIND
from models.evaluation.predictive_calibration import Coverage
from models.trained import estimator
from models.trained.estimator import Estimator
from tests.studies.dependence import Posteriors, posteriors
from tests.studies.long_films import LongFilm, simulated

FILMS = int(os.environ.get("FLAGDATA_WINDOWS_FILMS", "300"))
WINDOWS = 6
TOGETHER = (1, 2, 4, 6)
_DRAWS = 400


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Calibration of one window and of several, and how errors of windows correlate."""
    torch.set_num_threads(1)
    model = estimator.load_shipped()
    own, datasets = child_seed(seed, "measure-windows", "films"), list[str]()
    films = _noted(simulated(model, count=FILMS, windows=WINDOWS, seed=own), datasets)
    found = posteriors(model, films, draws=_DRAWS, seed=own)
    answers = {count: _answers(model, found, count, seed=seed) for count in TOGETHER}
    resamples = Resamples.of(
        answers[1].group, generator=stream(seed, "measure-windows", "bootstrap")
    )
    dependence, dataset = of_model(model), np.array(datasets)
    sheet = {
        "model": model.name,
        "films": len(found.known),
        "windows": WINDOWS,
        "dependence": {
            "wind": dependence.wind,
            "cloth": dependence.cloth,
            "source": dependence.source,
        },
        "correlation_by_distance": _correlations(found),
        "one_window": {
            "ranks": {name: _ranks(answers[1], name) for name in answers[1].targets},
            "tarp": _shares(
                tarp(
                    (answers[1],),
                    resamples,
                    generator=stream(seed, "measure-windows", "tarp"),
                    levels=LEVELS,
                )
            ),
        },
        "together": {
            str(count): {name: _scores(answer, name, resamples) for name in answer.targets}
            for count, answer in answers.items()
        },
        "by_dataset": {
            str(name): {
                str(count): _wind(answer, dataset == name) for count, answer in answers.items()
            }
            for name in np.unique(dataset)
        },
    }
    (out / "validate-measure-windows.md").write_text(page(sheet), encoding="utf-8")
    return sheet


def _noted(films: Iterable[LongFilm], datasets: list[str]) -> Iterator[LongFilm]:
    """The films, with progress; whose cloth each shows is noted."""
    with progress(FILMS, label="windows", unit="film") as advance:
        for film in films:
            yield film
            datasets.append(film.dataset)
            advance(1)


def _answers(model: Estimator, found: Posteriors, count: int, *, seed: int) -> Predictions:
    """The estimate of each film from its first windows together, the wind their mean."""
    learner = model.learners[0]
    names = learner.scaling.quantities
    own = np.array([name in OWN for name in names])
    draws = []
    for number, logits in enumerate(found.logits[:, :count]):
        winds, cloth = combine_windows(
            logits,
            names=names,
            centre=learner.centre.double().numpy(),
            spread=learner.spread.double().numpy(),
            dependence=of_model(model),
            generator=stream(seed, "combine", number),
        )
        whole = np.empty((*winds.shape[:2], len(names)))
        whole[..., own] = winds
        whole[..., ~own] = cloth
        draws.append(learner.scaling.values(torch.from_numpy(whole)).numpy().mean(axis=0))
    samples = np.array(draws, dtype=np.float32)
    return Predictions(
        label=f"{count} windows",
        targets=names,
        truth=found.known,
        mean=samples.mean(axis=1, dtype=np.float64),
        samples=samples,
        embedding=None,
        group=np.arange(len(samples)),
        parameters=0,
        milliseconds=0.0,
        note="",
    )


def _correlations(found: Posteriors) -> list[float]:
    """Of the errors of the wind's logit, standardised, in windows that are 1, 2, … apart."""
    error = found.errors[..., found.names.index(WIND)]
    return [
        float((first * second).sum() / np.sqrt(np.square(first).sum() * np.square(second).sum()))
        for first, second in ((error[:, :-apart], error[:, apart:]) for apart in range(1, WINDOWS))
    ]


def _ranks(answer: Predictions, name: str) -> dict[str, Any]:
    histogram = rank_histogram((answer,), name)
    return {
        "share": list(histogram.share),
        "low": histogram.low,
        "high": histogram.high,
        "outside": histogram.outside,
    }


def _shares(found: Sequence[Coverage]) -> dict[str, Any]:
    return {f"{one.level:g}": one.share.as_dict() for one in found}


def _scores(answer: Predictions, name: str, resamples: Resamples) -> dict[str, Any]:
    """Covered shares, error and mean width of the 90 % interval."""
    column = answer.column(name)
    return {
        "covered": _shares(coverage((answer,), name, resamples)),
        "rmse": float(np.sqrt(np.square(answer.mean - answer.truth)[:, column].mean())),
        "width": float(_widths(answer)[:, column].mean()),
    }


def _widths(answer: Predictions) -> FloatArray:
    assert answer.samples is not None
    low, high = np.quantile(answer.samples, [0.05, 0.95], axis=1)
    return high - low


def _wind(answer: Predictions, chosen: BoolArray) -> dict[str, Any]:
    assert answer.samples is not None
    column = answer.column(WIND)
    known, draws = answer.truth[chosen, column], answer.samples[chosen, :, column]
    low, high = np.quantile(draws, [0.05, 0.95], axis=1)
    error = answer.mean[chosen, column] - known
    return {
        "films": int(chosen.sum()),
        "bias": float(error.mean()),
        "rmse": float(np.sqrt(np.square(error).mean())),
        "covered_90": float(((low <= known) & (known <= high)).mean()),
    }


def page(found: Mapping[str, Any]) -> str:
    """The sheet in Markdown."""
    lines = [
        "# Intervals of one window and of several",
        "",
        _about(found),
        "",
        (
            "| windows | wind: RMSE [m/s] | width of the 90 % interval [m/s] | covered at 50 % | at 80 "
            "% | at 90 % |"
        ),
        "|---|---|---|---|---|---|",
        *(_of_wind(count, of[WIND]) for count, of in found["together"].items()),
        "",
        "Expected coverage of all targets together by random points, one window: "
        + "; ".join(
            f"{float(level):.0%}: {_share(share)}"
            for level, share in found["one_window"]["tarp"].items()
        )
        + ".",
        "",
        (
            "| target, one window | covered at 50 % | at 80 % | at 90 % | rank bins out of the 99 % "
            "band, of 10 |"
        ),
        "|---|---|---|---|---|",
        *(
            f"| {name} | "
            + " | ".join(_share(share) for share in of["covered"].values())
            + f" | {found['one_window']['ranks'][name]['outside']} |"
            for name, of in found["together"]["1"].items()
        ),
        "",
        "| films of | how many | windows | bias [m/s] | RMSE [m/s] | covered at 90 % |",
        "|---|---|---|---|---|---|",
        *(
            f"| {name} | {of['films']} | {count} | {of['bias']:+.2f} | {of['rmse']:.2f} | "
            f"{of['covered_90']:.0%} |"
            for name, own in found["by_dataset"].items()
            for count, of in own.items()
        ),
        "",
        "Errors of the wind in two windows that begin 1.2, 2.4, … s apart correlate by "
        + ", ".join(f"{value:.2f}" for value in found["correlation_by_distance"])
        + f"; {found['dependence']['wind']:.2f} is assumed ({found['dependence']['source']}).",
    ]
    return "\n".join(lines) + "\n"


def _about(found: Mapping[str, Any]) -> str:
    return (
        f"The shipped model {found['model']!r} on {found['films']} simulated films of "
        f"{found['windows']} windows "
        "of 1.2 s each, of the cloths that it was trained on (`python -m tests.studies "
        "measure-windows`). "
        "Intervals in brackets are of 90 %, over films."
    )


def _of_wind(count: str, of: Mapping[str, Any]) -> str:
    return (
        f"| {count} | {of['rmse']:.2f} | {of['width']:.2f} | "
        + " | ".join(_share(share) for share in of["covered"].values())
        + " |"
    )


def _share(share: Mapping[str, Any]) -> str:
    low, high = share["interval"]
    return f"{share['value']:.0%} [{low:.0%}, {high:.0%}]"
