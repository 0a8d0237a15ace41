"""Calibrate the gate of a model on the films of a lake: `python -m tests.studies gate --help`.

It is run anew whenever a network is replaced. Training-side films shape the checks, some five
minutes of one core; validation-side films alone, one of each simulation, decide where the gate
refuses.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import numpy as np
import torch

from flagdata.core.arrays import FloatArray
from flagdata.core.console import LocalPath, progress, say
from flagdata.core.rng import stream
from flagdata.core.schema import Kind
from flagdata.dataset import HashedSplit
from flagdata.dataset.sides import divide, select_columns
from flagdata.errors import InputError
from flagdata.lake.matching import matching
from flagdata.timebase import NANOSECONDS
from measure.gate import DISTORTIONS, Gate
from measure.gate.distortions import Film
from measure.gate.gate_features import Features, features_of
from models.trained.estimator import DEFAULT, SHIPPED, Estimator, load
from models.training import DataSpec, FitFilm

PLAIN, DISTORTED = 360, 30
"""Training-side films that are taken as they are, and others of which every distortion is made."""
_LEAST = 60
Advance = Callable[[int], None]


def calibrated(
    model: Estimator,
    training: Sequence[Film],
    validation: Sequence[Film],
    *,
    seed: int,
    advance: Advance,
    plain: int = PLAIN,
    distorted: int = DISTORTED,
) -> Gate:
    """The gate of a model.

    Args:
        training: films (frames, height, width) gray at the model's rate, one of each simulation.
        validation: films of other simulations, which the network was not trained on, one of each.
        seed: of the distortions.
        advance: called with the number of clips measured.
        plain, distorted: how many of the training films are taken as they are, and how many are
            distorted.

    Raises:
        InputError: too few films, or films that are too short.
    """
    if plain < _LEAST or len(training) < plain + distorted:
        raise InputError(
            f"{len(training)} training films for {plain} plain and {distorted} distorted clips",
            fix=f"give as many films, {_LEAST} plain ones or more",
        )
    count = model.front_end.frames

    def measured(clip: Film) -> Features:
        advance(1)
        return features_of(model, clip)

    with torch.no_grad():
        references = [measured(film[:count]) for film in validation]
        plains = [measured(training[index][:count]).vector(model) for index in range(plain)]
        made: dict[str, FloatArray] = {}
        for name, distortion in DISTORTIONS.items():
            clips = []
            for index in range(distorted):
                other = training[plain + (index + 1) % distorted]
                rng = stream(seed, "distortion", name, index)
                clips.append(
                    measured(distortion.apply(training[plain + index], other, rng, count)).vector(
                        model
                    )
                )
            made[name] = np.array(clips)
    return Gate.of(np.array(plains), made, np.array([one.vector(model) for one in references]))


class FilmsOf(Sequence[Film]):
    """One film of each simulation of one side of data sets, in a random order that is always the
    same, read when asked for.

    Args:
        lake_path: of the lake.
        data: the data sets.
        side: "train", "validation" or "test".
        at: ref of the lake; None for its head.
        rate: at which films are shown [Hz], once they were conditioned; None for films as they are.

    Raises:
        InputError: there are none.
        RefusedError: films of this side share a sequence or a session with those of another side.
    """

    def __init__(
        self,
        lake_path: Path,
        data: DataSpec,
        side: str,
        *,
        at: str | None = None,
        rate: float | None = None,
    ) -> None:
        import flagdata

        self._lake, self._rate = flagdata.open(lake_path).lake, rate
        catalog = self._lake.table(self._lake.view(at))
        films = matching(catalog, {"kind": Kind.RECORDING, **data.rows})
        of_side = divide(catalog, select_columns(films), hashed=HashedSplit()).artifacts.get(
            side, frozenset()
        )
        rows = matching(films, {"artifact": of_side}).select(["name", "seed", "object"]).to_pylist()
        if not rows:
            raise InputError(
                f"no films of the {side} side of {', '.join(data.datasets)}",
                where=str(lake_path),
                fix=f"build them: flagdata build {data.datasets[0]}",
            )
        firsts: dict[int, tuple[str, str]] = {}
        for row in sorted(rows, key=lambda row: row["name"]):
            firsts.setdefault(row["seed"], (row["name"], row["object"]))
        found = list(firsts.values())
        order = stream(0, "films", side).permutation(len(found)).tolist()
        self.names, self._objects = zip(*(found[place] for place in order), strict=True)

    def __len__(self) -> int:
        return len(self.names)

    def __getitem__(self, index: int) -> Film:  # pyright: ignore[reportIncompatibleMethodOverride]
        from flagdata.record import Record

        record = Record.open(self._lake.record_place(self._objects[index]))
        film = record.frames(0, record.frame_count)
        if self._rate is None:
            return film
        return FitFilm.of(film, (record.frame_times - record.frame_times[0]) / NANOSECONDS).whole(
            self._rate
        )


def data_of(model: Estimator) -> DataSpec:
    """The data sets that a model was trained on, all of their simulations."""
    recipe: Any = model.card["recipe"]
    return replace(DataSpec.of_identity(recipe["data"]), sequences=None)


def rate_of(model: Estimator) -> float | None:
    """The rate at which a model's films are conditioned [Hz]; None where they are taken as they
    are."""
    return model.front_end.rate if model.cropping.conditioned else None


@click.command()
@click.argument("model", type=LocalPath(), default=SHIPPED / DEFAULT)
@click.option(
    "--lake",
    "lake_path",
    type=LocalPath(exists=True),
    required=True,
    help="Where the films are that the network was trained on and validated by.",
)
@click.option(
    "--dataset",
    "datasets",
    multiple=True,
    help="Name of the films' data set; by default all that it was trained on.",
)
@click.option("--at", metavar="REF", help="Version of the lake; by default its head.")
@click.option(
    "--seed", type=int, default=1, show_default=True, help="Random seed of the distortions."
)
def main(
    model: Path, lake_path: Path, datasets: tuple[str, ...], at: str | None, seed: int
) -> None:
    """Calibrate the gate of the model in the folder MODEL and store it there."""
    from measure.gate import write

    torch.set_num_threads(1)
    loaded = load(model)
    data = DataSpec(datasets=datasets) if datasets else data_of(loaded)
    training, validation = (
        FilmsOf(lake_path, data, side, at=at, rate=rate_of(loaded))
        for side in ("train", "validation")
    )
    with progress(
        len(validation) + PLAIN + DISTORTED * len(DISTORTIONS), label="measure", unit="clip"
    ) as advance:
        gate = calibrated(loaded, training, validation, seed=seed, advance=advance)
    say(f"{len(gate.calibration)} calibration clips; stored in {write(model, gate, loaded)}")
