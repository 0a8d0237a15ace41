"""Whether a film of hanging cloth constrains its area weight, and what a stated weight is worth.

Films of one window are simulated of cloths as the shipped network was trained on, from a seed of
their own (`tests.studies.long_films`), and measured as `flagdata measure --model wave-cloth
--flag-size 1x1` does, once without and once with the true weight. The network's mixture is also
conditioned on the true wind, which the program does not
offer: it shows whether it is the unknown wind that hides the weight. Criteria, counts and seed are
those of decision 077, fixed before the films were drawn.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import child_seed, stream
from flagdata.core.stated import Stated
from flagdata.ingest.films.film_array import Frames
from measure.estimate import DRAWS, FilmAnswer, Measurement, Options, measure, of_model
from measure.estimate.film_posterior import WEIGHT, WIND
from measure.film import FlagSize
from measure.measuring_model import gate_beside, network
from models.trained.estimator import Estimator
from models.trained.restriction import Known
from tests.studies.long_films import LongFilm, simulated

FILMS = 40
LEVEL = 0.9
COVERED = (32, 39)
"""Films of 40 whose interval may hold the truth: a binomial count of 0.9 lies there with a
probability of 97 %."""
INFORMATIVE = 0.8
"""Median width over the prior's, below which films tell the weight."""
FALSELY = 0.1
"""Share of films on which a weight may be given although films do not tell it."""
_RESAMPLES = 2000


@dataclass(frozen=True, kw_only=True)
class Film:
    """What was answered on one film.

    Attributes:
        weight, wind: true [kg/m², m/s].
        refused: whether the gate refused it.
        constrained: whether a weight or a bound of it was given.
        low, high: of the interval of the weight [kg/m²]; of a bound one end is that of the range or
            infinite.
        width: of the weight's central 90 %, over that of the prior.
        width_wind_known: the same with the true wind stated.
        covered_wind_known: whether that interval contains the weight.
        wind_error, wind_error_stated: without and with the true weight stated, mean less truth
            [m/s].
        wind_covered, wind_covered_stated: whether the wind's interval contains the truth.
    """

    weight: float
    wind: float
    refused: bool
    constrained: bool
    low: float
    high: float
    width: float
    width_wind_known: float
    covered_wind_known: bool
    wind_error: float
    wind_error_stated: float
    wind_covered: bool
    wind_covered_stated: bool


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Measures all films, grades them and writes the page."""
    torch.set_num_threads(1)
    chosen = network("wave-cloth", lake=None, at=None)
    model, gate = chosen.estimator, gate_beside(chosen, false_alarm=0.05)
    films = []
    for number, film in enumerate(simulated(model, count=FILMS, windows=1, seed=seed)):
        images = film.windows.reshape(-1, *film.windows.shape[2:])
        frames = Frames(
            time=np.arange(len(images)) / model.front_end.rate,
            images=images,
            name=f"cloth {number}",
        )
        answers = [
            measure(
                frames,
                model,
                gate=gate,
                dependence=of_model(model),
                options=Options(
                    size=FlagSize(length=1.0, height=1.0),
                    level=LEVEL,
                    seed=child_seed(seed, "answer", number),
                    area_weight=known,
                ),
            )
            for known in (None, Stated.of(film.parameters[WEIGHT]))
        ]
        films.append(_film(film, model, *answers))
    sheet = {
        "model": model.name,
        "level": LEVEL,
        **grade(films, seed=seed),
        "films": [_row(film) for film in films],
    }
    (out / "validate-hanging-weight.md").write_text(page(sheet), encoding="utf-8")
    return sheet


def _film(film: LongFilm, model: Estimator, unstated: Measurement, stated: Measurement) -> Film:
    weight, wind = film.parameters[WEIGHT], film.parameters[WIND]
    column = unstated.names.index(WEIGHT)
    answer = FilmAnswer(model=model, sizes=unstated.sizes, options=unstated.options)
    prior = _width(answer.prior[:, column])
    (quantity,) = (quantity for quantity in unstated.quantities if quantity.name == WEIGHT)
    posterior = model.posterior(model.embeddings(model.inputs(film.windows)))
    known = Known.everywhere(WIND, Stated.of(wind), count=1)
    restricted = model.given(posterior, (known,), seed=unstated.options.seed, draws=DRAWS)
    given = model.learners[0].scaling.values(restricted.logits).cpu().numpy()[0, :, column]
    low, high = np.quantile(given, [0.05, 0.95])
    winds = [
        next(quantity for quantity in measured.quantities if quantity.name == WIND)
        for measured in (unstated, stated)
    ]
    means = [
        float(measured.draws[:, measured.names.index(WIND)].mean())
        for measured in (unstated, stated)
    ]
    return Film(
        weight=weight,
        wind=wind,
        refused=unstated.verdict.refused,
        constrained=quantity.constrained,
        low=quantity.span.low,
        high=quantity.span.high,
        width=_width(unstated.draws[:, column]) / prior,
        width_wind_known=_width(given) / prior,
        covered_wind_known=bool(low <= weight <= high),
        wind_error=means[0] - wind,
        wind_error_stated=means[1] - wind,
        wind_covered=winds[0].span.low <= wind <= winds[0].span.high,
        wind_covered_stated=winds[1].span.low <= wind <= winds[1].span.high,
    )


def _row(film: Film) -> dict[str, Any]:
    """Returns JSON values; an end of an interval that nothing bounds is null."""
    return {name: value if np.isfinite(value) else None for name, value in asdict(film).items()}


def _width(draws: FloatArray) -> float:
    low, high = np.quantile(draws, [(1 - LEVEL) / 2, (1 + LEVEL) / 2])
    return float(high - low)


def grade(films: Sequence[Film], *, seed: int) -> dict[str, Any]:
    """Computes the figures of the sheet and whether each criterion holds; films that the gate
    refuses count in none but the first."""
    shown = [film for film in films if not film.refused]
    covered = sum(film.low <= film.weight <= film.high for film in shown)
    scale = len(shown) / FILMS
    width = float(np.median([film.width for film in shown]))
    claimed = sum(film.constrained for film in shown)
    tells = width < INFORMATIVE
    errors = np.array([[film.wind_error, film.wind_error_stated] for film in shown])
    drawn = stream(seed, "hanging-weight").integers(len(shown), size=(_RESAMPLES, len(shown)))
    rmse = np.sqrt(np.square(errors).mean(axis=0))
    resampled = np.sqrt(np.square(errors[drawn]).mean(axis=1))
    change = np.quantile(resampled[:, 1] - resampled[:, 0], [0.05, 0.95])
    winds = [
        sum(film.wind_covered for film in shown),
        sum(film.wind_covered_stated for film in shown),
    ]
    least, most = COVERED[0] * scale, COVERED[1] * scale
    return {
        "drawn": len(films),
        "refused": len(films) - len(shown),
        "covered": covered,
        "claimed": claimed,
        "median_width_over_prior": width,
        "median_width_over_prior_wind_known": float(
            np.median([film.width_wind_known for film in shown])
        ),
        "covered_wind_known": sum(film.covered_wind_known for film in shown),
        "wind_rmse": float(rmse[0]),
        "wind_rmse_weight_stated": float(rmse[1]),
        "wind_rmse_change": change.tolist(),
        "wind_covered": winds[0],
        "wind_covered_weight_stated": winds[1],
        "criteria": {
            "refused": len(films) - len(shown) <= FALSELY * len(films),
            "weight covered": least <= covered <= most,
            "constrains the weight": tells,
            "says so": claimed >= len(shown) / 2 if tells else claimed <= FALSELY * len(shown),
            "wind covered, weight stated": least <= winds[1] <= most,
            "a stated weight lowers the wind's error": bool(change[1] < 0),
        },
    }


def page(sheet: dict[str, Any]) -> str:
    """Renders the sheet in Markdown."""
    of = sheet["drawn"] - sheet["refused"]
    low, high = sheet["wind_rmse_change"]
    lines = [
        "# The area weight of hanging cloth, from films",
        "",
        (
            f"{sheet['drawn']} films of simulated cloths, one window each, measured with the "
            "shipped network "
            f"`{sheet['model']}`; the gate refused {sheet['refused']}. Criteria, counts and seed "
            "were fixed before the "
            "films were drawn ([decision 077](../decisions/077-the-weight-of-hanging-cloth.md))."
        ),
        "",
        "| | |",
        "|---|---|",
        (
            f"| films on which the weight's 90 % interval contains the truth | {sheet['covered']} of "
            f"{of} |"
        ),
        (
            "| median width of that interval over the prior's | "
            f"{sheet['median_width_over_prior']:.2f} |"
        ),
        (
            "| the same with the true wind stated | "
            f"{sheet['median_width_over_prior_wind_known']:.2f}, "
            f"contains the truth on {sheet['covered_wind_known']} |"
        ),
        f"| films on which a weight or a bound is given | {sheet['claimed']} |",
        (
            f"| wind RMSE, weight not stated | {sheet['wind_rmse']:.2f} m/s, its interval contains "
            "the truth on "
            f"{sheet['wind_covered']} |"
        ),
        (
            f"| wind RMSE, true weight stated | {sheet['wind_rmse_weight_stated']:.2f} m/s, its "
            "interval contains the "
            f"truth on {sheet['wind_covered_weight_stated']} |"
        ),
        f"| change of the RMSE by the stated weight, 90 % | [{low:+.2f}, {high:+.2f}] m/s |",
        "",
        "| criterion | holds |",
        "|---|---|",
        *(f"| {name} | {'yes' if holds else 'no'} |" for name, holds in sheet["criteria"].items()),
    ]
    return "\n".join(lines) + "\n"
