"""How alike the errors of a model are in two windows of one film: measured on simulated films,
whose truth is known.

All is on the targets' logits z, less the prior's mean and over its standard deviation; a window's
posterior there has mean m and variance v. Correlations are those of all pairs of windows of a film,
over films, one film a simulation.

- Of the wind, of which each window has its own posterior: of the errors (m − z)/√v.
- Of the cloth, of which likelihoods are multiplied: of the scores s = m/v − (1/v − 1) z, the
  derivatives at the truth of the logarithms of the Gaussian likelihoods that the posteriors
  represent. A window without information has a score of 0, whereas its error is that of the prior,
  the same in both. Tempering by the correlation of scores adjusts the magnitude of a composite
  likelihood (Ribatet, Cooley and Davison, Statistica Sinica 22, 2012).

Windows of the films (`tests.studies.long_films`) follow each other and do not overlap, as those do
that an answer rests on. The result belongs to a model. `python -m tests.studies dependence NAME`
measures it and writes it into the model's card under "window_correlation", where
`measure.estimate.combine.of_model` finds it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np
import torch

from flagdata.core.arrays import FloatArray
from flagdata.core.console import LocalPath, progress, say
from flagdata.core.rng import child_seed, stream
from flagdata.errors import InputError
from measure.estimate import CARD_KEY, OWN, Dependence
from models.networks.targets import truth
from models.trained.estimator import SHIPPED, Estimator
from models.trained.model_folder import CARD, card_bytes, read_card, renew

if TYPE_CHECKING:
    from tests.studies.long_films import LongFilm

_DRAWS = 200
_RESAMPLES = 1000
_UPPER = 0.9
"""Level of the one-sided interval whose upper end is used: a correlation that was underestimated
narrows intervals."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Errors:
    """Errors of the windows of each film: of `OWN` targets standardised errors, of the cloth's
    scores.

    Attributes:
        names: of the targets.
        values: (film, window, target).
    """

    names: tuple[str, ...]
    values: FloatArray

    def correlation(self, name: str, *, seed: int = 0) -> tuple[float, float]:
        """The correlation of one target in two windows, and the upper end of its one-sided 90 %
        interval by resampling films."""
        own = self.values[..., self.names.index(name)]
        generator = stream(seed, "window-correlation", name)
        drawn = generator.integers(len(own), size=(_RESAMPLES, len(own)))
        return _about_zero(own), float(
            np.quantile([_about_zero(own[rows]) for rows in drawn], _UPPER)
        )

    def dependence(self, *, seed: int = 0) -> Dependence:
        """What is used: upper ends, not below 0; of the cloth's targets the largest."""
        ends = {
            name: min(max(self.correlation(name, seed=seed)[1], 0.0), 1.0) for name in self.names
        }
        films, windows, _ = self.values.shape
        return Dependence(
            wind=max((end for name, end in ends.items() if name in OWN), default=1.0),
            cloth=max((end for name, end in ends.items() if name not in OWN), default=1.0),
            source=f"upper 90 % limits over {films} simulated films of {windows} windows",
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class Posteriors:
    """What a model says of films.

    Attributes:
        names: of the targets.
        logits: (film, window, draw, target).
        known: (film, target) the truth.
        errors: (film, window, target), as the module's text says.
    """

    names: tuple[str, ...]
    logits: FloatArray
    known: FloatArray
    errors: FloatArray


def posteriors(model: Estimator, films: Iterable[LongFilm], *, draws: int, seed: int) -> Posteriors:
    """What a model says of films whose truth is known, one film a simulation.

    Args:
        films: all of the same number of windows.
        draws: of each window's posterior.

    Raises:
        InputError: films that do not state the truth.
    """
    scaling = model.learners[0].scaling
    logits: list[FloatArray] = []
    parameters: list[dict[str, float]] = []
    for number, film in enumerate(films):
        found = model.logits(
            model.embeddings(model.inputs(film.windows)),
            seed=child_seed(seed, "film", number),
            draws=draws,
        )
        logits.append(found.double().cpu().numpy())
        parameters.append(film.parameters)
    known = truth(columns_of(parameters), scaling.names)
    place = scaling.learned(torch.from_numpy(known)).double().numpy()
    centre, spread = (
        part.double().cpu().numpy() for part in (model.learners[0].centre, model.learners[0].spread)
    )
    return Posteriors(
        names=scaling.quantities,
        logits=np.array(logits),
        known=known,
        errors=errors_of(
            (np.array(logits) - centre) / spread, (place - centre) / spread, scaling.quantities
        ),
    )


def errors(model: Estimator, films: Iterable[LongFilm], *, seed: int = 0) -> Errors:
    """Errors of the windows of films whose truth is known, one film a simulation.

    Args:
        films: all of the same number of windows, two at least.

    Raises:
        InputError: fewer than ten films, or films that do not state the truth.
    """
    found = posteriors(model, films, draws=_DRAWS, seed=seed)
    if len(found.known) < 10:
        raise InputError(f"{len(found.known)} films", where="films", fix="give ten or more")
    return Errors(names=found.names, values=found.errors)


def columns_of(parameters: Sequence[dict[str, float]]) -> dict[str, FloatArray]:
    """Name → (film,) values; NaN where a film does not state one."""
    names = {name for one in parameters for name in one}
    return {name: np.array([one.get(name, np.nan) for one in parameters]) for name in names}


def errors_of(draws: FloatArray, truth: FloatArray, names: Sequence[str]) -> FloatArray:
    """(film, window, target) errors or scores, as the module's text says.

    Args:
        draws: (film, window, draw, target), in units of the prior.
        truth: (film, target), likewise.
        names: of the targets.
    """
    mean, variance = draws.mean(axis=2), draws.var(axis=2)
    error = (mean - truth[:, None]) / np.sqrt(variance)
    precision = 1 / variance - 1
    score = np.where(precision > 0, mean / variance - precision * truth[:, None], 0.0)
    own = np.array([name in OWN for name in names])
    return np.where(own, error, score)


def _about_zero(own: FloatArray) -> float:
    """Correlation of two windows of (film, window) values whose means are known to be 0, over all
    pairs of windows; 1 where all are 0."""
    count = own.shape[1]
    square = np.square(own).sum()
    pairs = np.square(own.sum(axis=1)).sum() - square
    return float(pairs / (count - 1) / square) if square > 0 else 1.0


def card_entry(found: Errors, *, seed: int = 0) -> dict[str, Any]:
    """What a model's card says of it."""
    used = found.dependence(seed=seed)
    each = {name: found.correlation(name, seed=seed) for name in found.names}
    return {
        "wind": used.wind,
        "cloth": used.cloth,
        "source": used.source,
        "targets": {
            name: {"correlation": value, "upper": upper} for name, (value, upper) in each.items()
        },
    }


@click.command()
@click.argument("name")
@click.option(
    "--films",
    type=click.IntRange(10),
    default=200,
    show_default=True,
    help="How many films are simulated.",
)
@click.option(
    "--windows",
    type=click.IntRange(2),
    default=6,
    show_default=True,
    help="How many windows a film has.",
)
@click.option("--seed", type=int, default=0, show_default=True, help="Seed of the films.")
@click.option(
    "--out", type=LocalPath(), default=SHIPPED, help="Folder of the models that are shipped."
)
def main(name: str, films: int, windows: int, seed: int, out: Path) -> None:
    """Measure how alike windows of one film are to the shipped model NAME, and write it into its
    card."""
    from models.trained.estimator import load
    from tests.studies.long_films import simulated

    model = load(out / name)
    with progress(films, label="windows", unit="film") as advance:
        entry = card_entry(
            errors(
                model, _counted(simulated(model, count=films, windows=windows, seed=seed), advance)
            ),
            seed=seed,
        )
    card = {key: value for key, value in read_card(out / name).items() if key != "format"}
    renew(out / name, CARD, card_bytes({**card, CARD_KEY: entry}))
    say(
        f"errors of two windows correlate by {entry['wind']:.2f} in wind and {entry['cloth']:.2f} "
        "in cloth"
    )


def _counted(films: Iterable[LongFilm], advance: Callable[[int], None]) -> Iterable[LongFilm]:
    for film in films:
        advance(1)
        yield film
