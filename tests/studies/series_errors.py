"""How a model errs in the windows of a gusty film: what its card states for
`measure.estimate.gusty_series`.

Each window's error is d, m_w of `measure.estimate.gusty_series` less the logarithm of the true mean
wind of the window, and s is s_w. Over films of 10 windows, and the 9 that share halves with two:

- *own*: σ_e² is the mean of (d_v − d_w)²/(s_v² + s_w²) over pairs of windows of a film that begin
  two lengths apart or more. What is common to a film drops out of the difference.
- *correlations*: 1 − ρ is the same mean over pairs half a length apart, or one, over σ_e²; averaged
  over both pairs of constants, and moved to the nearest values at which the correlation is convex.
- *shared*: σ_b² is the mean over films of the square of the mean d over s̄², less the part of the
  windows' own errors.

Errors count about 0: an offset common to all films is part of the shared error. Two films of one
cloth are unlike each other in weight, damping, light and view, so that films are independent.

`python -m tests.studies series-errors NAME` measures them on films of its own seed and writes them
into the card of the shipped model NAME.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click
import numpy as np
import torch

from flagdata.core.arrays import FloatArray, UInt8Array
from flagdata.core.console import LocalPath, progress, say
from flagdata.core.rng import child_seed, stream
from flagdata.core.stated import Stated
from flagdata.errors import InputError
from measure.estimate import DRAWS, SERIES_KEY, FilmAnswer, Options, Pair, SeriesErrors
from measure.estimate.gusty_series import error_correlation, log_moments
from measure.film import FlagSize, sizes
from measure.film.similarity import trained_on
from models.trained.estimator import SHIPPED, Estimator
from models.trained.model_folder import CARD, card_bytes, read_card, renew
from tests.studies.long_films import LongFilm
from tests.studies.validation.wind_series_films import made

SEED, FILMS = 1, 24
_APART = 4
"""Half windows between windows whose own errors are taken for independent."""
_RESAMPLES = 1000
_LEAST_FILMS = 10


@dataclass(frozen=True, kw_only=True, eq=False)
class FilmErrors:
    """Errors of a film's windows, each half a window after the one before.

    Attributes:
        off: (w,) estimated less true logarithm of the wind.
        sigma: (w,) standard deviation of the posterior of the same.
    """

    off: FloatArray
    sigma: FloatArray


def size_of(film: LongFilm) -> FlagSize:
    """The size of a film's flag."""
    return FlagSize(length=film.parameters["width"], height=film.parameters["height"])


def half_steps(film: LongFilm) -> tuple[UInt8Array, FloatArray]:
    """Windows (2 k − 1, frames, height, width) that begin half a window apart, and the true mean
    wind of each [m/s]."""
    count, frames = film.windows.shape[:2]
    whole = film.windows.reshape(count * frames, *film.windows.shape[2:])
    step = frames // 2
    windows = np.stack(
        [whole[first : first + frames] for first in range(0, (count - 1) * frames + 1, step)]
    )
    halves = film.winds.ravel()
    return windows, (halves[:-1] + halves[1:]) / 2


@torch.no_grad()
def errors_of_film(film: LongFilm, model: Estimator, *, stated: bool, seed: int) -> FilmErrors:
    """Errors of the windows of one film, its flag's size given.

    Args:
        stated: whether the weight of the cloth is given too.
    """
    options = Options(
        size=size_of(film),
        seed=seed,
        area_weight=Stated.of(film.parameters["area_weight"]) if stated else None,
    )
    considered = sizes(
        options.size,
        rate=model.front_end.rate,
        frames_rate=model.front_end.rate,
        draws=DRAWS,
        generator=stream(seed, "sizes"),
        trained=trained_on(model.targets),
    )
    answer = FilmAnswer(model=model, sizes=considered, options=options)
    column = answer.names.index("wind_speed")
    windows, winds = half_steps(film)
    off, sigma = np.empty(len(windows)), np.empty(len(windows))
    for number, window in enumerate(windows):
        posterior = model.posterior(model.embeddings(model.inputs(window[None])))
        logits, _ = answer.given(posterior, seed=child_seed(seed, "window", number))
        mean, sigma[number] = log_moments(
            model.learners[0].scaling.values(torch.from_numpy(logits[0])).numpy()[:, column]
        )
        off[number] = mean - np.log(winds[number])
    return FilmErrors(off=off, sigma=sigma)


def variogram(films: Sequence[FilmErrors], *, least: int, most: int) -> float:
    """Mean of (d_v − d_w)²/(s_v² + s_w²) over pairs of windows of a film from `least` to `most`
    half windows apart."""
    squares = []
    for film in films:
        first, second = np.triu_indices(len(film.off), k=least)
        near = second - first <= most
        first, second = first[near], second[near]
        squares.append(
            (film.off[first] - film.off[second]) ** 2
            / (film.sigma[first] ** 2 + film.sigma[second] ** 2)
        )
    return float(np.concatenate(squares).mean())


def own_variance(films: Sequence[FilmErrors]) -> float:
    """σ_e²."""
    return variogram(films, least=_APART, most=max(len(film.off) for film in films))


def shared_variance(
    films: Sequence[FilmErrors], *, own: float, halves: float, neighbours: float
) -> float:
    """σ_b², 0 where the windows' own errors explain all."""
    parts = []
    for film in films:
        starts = np.arange(len(film.off)) / 2
        correlation = error_correlation(starts, window=1.0, halves=halves, neighbours=neighbours)
        of_mean = own * float((np.outer(film.sigma, film.sigma) * correlation).mean())
        parts.append((film.off.mean() ** 2 - of_mean) / np.mean(film.sigma**2))
    return max(float(np.mean(parts)), 0.0)


def series_errors(
    opened: Sequence[FilmErrors], stated: Sequence[FilmErrors], *, source: str
) -> SeriesErrors:
    """The constants of a model.

    Args:
        opened: of films whose weight is not given.
        stated: of the same with it.

    Raises:
        InputError: fewer than ten films.
    """
    if len(opened) < _LEAST_FILMS or len(opened) != len(stated):
        raise InputError(
            f"{len(opened)} and {len(stated)} films", where="films", fix="give ten or more of both"
        )
    own = [own_variance(films) for films in (opened, stated)]

    def correlation(halves: int) -> float:
        ratios = [
            variogram(films, least=halves, most=halves) / variance
            for films, variance in zip((opened, stated), own, strict=True)
        ]
        return 1 - float(np.mean(ratios))

    neighbours = float(np.clip(correlation(2), 0.0, 0.5))
    halves = float(np.clip(correlation(1), 1.5 * neighbours, (1 + neighbours) / 2))
    pairs = [
        Pair(
            shared=shared_variance(films, own=variance, halves=halves, neighbours=neighbours)
            ** 0.5,
            own=variance**0.5,
        )
        for films, variance in zip((opened, stated), own, strict=True)
    ]
    return SeriesErrors(
        opened=pairs[0], stated=pairs[1], halves=halves, neighbours=neighbours, source=source
    )


def spread(
    opened: Sequence[FilmErrors], stated: Sequence[FilmErrors], *, seed: int
) -> dict[str, list[float]]:
    """90 % of the constants by resampling films, by their names."""
    generator = stream(seed, "series-errors")
    rows = []
    for _ in range(_RESAMPLES):
        drawn = generator.integers(len(opened), size=len(opened)).tolist()
        found = series_errors([opened[k] for k in drawn], [stated[k] for k in drawn], source="")
        rows.append(
            (
                found.opened.shared,
                found.opened.own,
                found.stated.shared,
                found.stated.own,
                found.halves,
                found.neighbours,
            )
        )
    ends = np.quantile(np.array(rows), [0.05, 0.95], axis=0)
    names = ("open.shared", "open.own", "stated.shared", "stated.own", "halves", "neighbours")
    return {name: ends[:, k].tolist() for k, name in enumerate(names)}


def card_entry(films: Sequence[LongFilm], model: Estimator, *, seed: int) -> dict[str, Any]:
    """What a model's card says of its series."""
    both: dict[bool, list[FilmErrors]] = {False: [], True: []}
    with progress(len(films), label="errors", unit="film") as advance:
        for number, film in enumerate(films):
            for stated, found in both.items():
                found.append(
                    errors_of_film(
                        film, model, stated=stated, seed=child_seed(seed, "film", number)
                    )
                )
            advance(1)
    windows = len(films[0].windows)
    errors = series_errors(
        both[False],
        both[True],
        source=f"{len(films)} simulated films of {windows} windows in gusts, of seed {seed}",
    )
    return {**errors.entry(), "spread": spread(both[False], both[True], seed=seed)}


@click.command()
@click.argument("name")
@click.option(
    "--films",
    type=click.IntRange(_LEAST_FILMS),
    default=FILMS,
    show_default=True,
    help="How many films.",
)
@click.option("--seed", type=int, default=SEED, show_default=True, help="Seed of the films.")
@click.option(
    "--kept",
    type=LocalPath(),
    required=True,
    help="Folder of the films, where missing ones are made.",
)
@click.option(
    "--out", type=LocalPath(), default=SHIPPED, help="Folder of the models that are shipped."
)
def main(name: str, films: int, seed: int, kept: Path, out: Path) -> None:
    """Measure how the shipped model NAME errs in windows of gusty films, and write it into its
    card."""
    from models.trained.estimator import load

    torch.set_num_threads(1)
    model = load(out / name)
    entry = card_entry(made(kept, model, count=films, seed=seed), model, seed=seed)
    card = {key: value for key, value in read_card(out / name).items() if key != "format"}
    renew(out / name, CARD, card_bytes({**card, SERIES_KEY: entry}))
    for weight in ("open", "stated"):
        pair = entry[weight]
        say(
            f"weight {weight}: a shared error of {pair['shared']:.2f} and an own of "
            f"{pair['own']:.2f} of the network's"
        )
    say(
        f"own errors correlate by {entry['halves']:.2f} at half a window and "
        f"{entry['neighbours']:.2f} at one"
    )
