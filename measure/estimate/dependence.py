"""How alike the errors of a model are in two windows of one film: measured on films whose truth is known.

All is on the targets' logits z, less the prior's mean and over its standard deviation; a window's posterior there has
mean m and variance v. Correlations are those over films, one film a simulation.

- Of the wind, of which each window has its own posterior: of the errors (m − z)/√v.
- Of the cloth, of which likelihoods are multiplied: of the scores s = m/v − (1/v − 1) z, the derivatives at the truth
  of the logarithms of the Gaussian likelihoods that the posteriors stand for. A window that tells nothing has a score
  of 0, whereas its error is that of the prior, the same in both. Tempering by the correlation of scores adjusts the
  magnitude of a composite likelihood (Ribatet, Cooley and Davison, Statistica Sinica 22, 2012).

Films of a data set are two seconds long, so that their first and last windows of 1.2 s share up to a third of their
frames; what is found is then an upper bound for windows that follow each other, and errs on the side of wider
intervals.

The result belongs to a model. It stands in the model's card under "window_correlation", where `of_model` finds it;
`python -m measure.estimate.dependence` measures it anew and writes it there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
import numpy as np
import torch
from numpy.typing import NDArray

from flagdata.console import progress, say
from flagdata.dataset import Pairs
from flagdata.errors import CorruptError, InputError
from flagdata.rng import child_seed, stream
from measure.estimate.combine import OWN, UNKNOWN, Dependence
from models.estimator import SHIPPED, Estimator
from models.storage import read_card, write_card
from models.targets import truth

CARD_KEY = "window_correlation"
_DRAWS = 200
_RESAMPLES = 1000
_UPPER = 0.9
"""Level of the one-sided interval whose upper end is used: a correlation that was underestimated narrows intervals."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Errors:
    """Errors of two windows of each film: of `OWN` targets standardised errors, of the cloth's scores.

    Attributes:
        names: of the targets.
        first, last: (film, target).
    """

    names: tuple[str, ...]
    first: NDArray[np.float64]
    last: NDArray[np.float64]

    def correlation(self, name: str, *, seed: int = 0) -> tuple[float, float]:
        """The correlation of one target, and the upper end of its one-sided 90 % interval by resampling films."""
        column = self.names.index(name)
        a, b = self.first[:, column], self.last[:, column]
        generator = stream(seed, "window-correlation", name)
        drawn = generator.integers(len(a), size=(_RESAMPLES, len(a)))
        return _about_zero(a, b), float(np.quantile([_about_zero(a[rows], b[rows]) for rows in drawn], _UPPER))

    def dependence(self, *, seed: int = 0) -> Dependence:
        """What is used: upper ends, not below 0; of the cloth's targets the largest."""
        ends = {name: min(max(self.correlation(name, seed=seed)[1], 0.0), 1.0) for name in self.names}
        return Dependence(
            wind=max((end for name, end in ends.items() if name in OWN), default=1.0),
            cloth=max((end for name, end in ends.items() if name not in OWN), default=1.0),
            source=f"upper 90 % limits over {len(self.first)} simulated films",
        )


def errors(model: Estimator, pairs: Pairs, *, seed: int = 0, advance: Callable[[int], None] | None = None) -> Errors:
    """Errors of the first and the last window of films whose truth is known, one film a simulation.

    Args:
        pairs: clips of such films; they must not have been trained on.
        advance: called with 1 for each film.

    Raises:
        InputError: fewer than ten simulations, films no longer than a window, or clips that do not state the truth.
    """
    table = pairs.table
    chosen = np.unique(table.seed, return_index=True)[1].tolist()
    if len(chosen) < 10:
        raise InputError(f"{len(chosen)} simulations", where="clips", fix="give clips of ten simulations or more")
    scaling = model.learners[0].scaling
    logits: list[list[NDArray[np.float64]]] = []
    count = model.front_end.frames
    for number, index in enumerate(chosen):
        film = pairs.film(index)
        if len(film) <= count:
            raise InputError(
                f"a film of {len(film)} frames has no two windows of {count}",
                where=str(table.recording[index]), fix="give longer films",
            )  # fmt: skip
        inputs = model.inputs(np.stack([film[:count], film[-count:]]))
        told = model.logits(model.embeddings(inputs), seed=child_seed(seed, "film", number), draws=_DRAWS)
        logits.append([part.double().numpy() for part in told])
        if advance is not None:
            advance(1)
    draws = np.array(logits)  # (film, 2, draw, target)
    parameters = table.parameter_columns(chosen)
    known = scaling.learned(torch.from_numpy(truth(parameters, scaling.names))).double().numpy()
    centre, spread = (part.double().cpu().numpy() for part in (model.learners[0].centre, model.learners[0].spread))
    found = errors_of((draws - centre) / spread, (known - centre) / spread, scaling.quantities)
    return Errors(names=scaling.quantities, first=found[:, 0], last=found[:, 1])


def errors_of(draws: NDArray[np.float64], truth: NDArray[np.float64], names: Sequence[str]) -> NDArray[np.float64]:
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


def _about_zero(a: NDArray[np.float64], b: NDArray[np.float64]) -> float:
    """Correlation of (n,) values whose means are known to be 0; 1 where one of them is 0 throughout."""
    scale = float(np.sqrt(np.square(a).sum() * np.square(b).sum()))
    return float((a * b).sum()) / scale if scale > 0 else 1.0


def card_entry(found: Errors, *, seed: int = 0) -> dict[str, Any]:
    """What a model's card says of it."""
    used = found.dependence(seed=seed)
    each = {name: found.correlation(name, seed=seed) for name in found.names}
    return {
        "wind": used.wind, "cloth": used.cloth, "source": used.source,
        "targets": {name: {"correlation": value, "upper": upper} for name, (value, upper) in each.items()},
    }  # fmt: skip


def of_model(model: Estimator) -> Dependence:
    """What a model's card says; `UNKNOWN` where it says nothing.

    Raises:
        CorruptError: the entry is damaged.
    """
    entry: Any = model.card.get(CARD_KEY)
    if entry is None:
        return UNKNOWN
    try:
        return Dependence(wind=float(entry["wind"]), cloth=float(entry["cloth"]), source=str(entry["source"]))
    except (KeyError, TypeError, ValueError, InputError) as error:
        raise CorruptError(
            f"the card's {CARD_KEY} cannot be used: {error}",
            where=f"model {model.name!r}",
            fix="measure it anew by python -m measure.estimate.dependence",
        ) from None


@click.command()
@click.argument("name")
@click.option("--lake", "lake_path", type=click.Path(path_type=Path, exists=True), required=True,
              help="Where the films are.")  # fmt: skip
@click.option("--at", help="Version of the lake.")
@click.option("--side", default="validation", show_default=True, help="Side of the data; it must not be trained on.")
@click.option("--out", type=click.Path(path_type=Path), default=SHIPPED, help="Folder of the models that are shipped.")
def main(name: str, lake_path: Path, at: str | None, side: str, out: Path) -> None:
    """Measure how alike two windows of one film are to the shipped model NAME, and write it into its card."""
    import flagdata
    from models.estimator import load
    from models.training.recipe import DataSpec

    model = load(out / name)
    recipe: Any = model.card["recipe"]
    spec = DataSpec.of_identity(recipe["data"])
    pairs = flagdata.open(lake_path).pairs(at=at, split=side, split_by=spec.split("train", side))
    with progress(len(set(pairs.table.seed.tolist())), label="windows", unit="film") as advance:
        entry = card_entry(errors(model, pairs, advance=advance))
    card = {key: value for key, value in read_card(out / name).items() if key != "format"}
    write_card(out / name, {**card, CARD_KEY: entry})
    say(f"errors of two windows correlate by {entry['wind']:.2f} in wind and {entry['cloth']:.2f} in cloth")


if __name__ == "__main__":
    main()
