"""What the lake keeps of a wind that is bounded on one side only: no value, and no end where there
is none."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from measure.commands import read
from measure.commands.measurement_artifact import artifact, write
from measure.estimate import beside
from measure.film import ConditionedFilm, FilmReading, Subject
from measure.measuring_model import Network
from models.trained.estimator import Estimator
from tests.measure.estimate.conftest import FRAMES, even
from tests.measure.estimate.test_film_measuring import far, measured


def test_a_bound_is_no_wind_of_the_catalog(model: Estimator) -> None:
    film, strong = even(3 * FRAMES), far(model, 0, 1.0)
    network = Network(estimator=strong, identity="0" * 64, artifact=None, folder=Path())
    row = artifact(
        measured(film, strong), Subject(film=ConditionedFilm(film)), network, FilmReading()
    )
    assert (row.wind, row.wind_sigma) == (None, None)
    assert "wind_speed" not in json.loads(str(row.parameters))
    assert "wind-speed-at-end" in row.quality
    kept = json.loads(str(row.report))
    assert kept["sentence"].startswith("wind at least ")
    assert kept["quantities"]["wind_speed"]["interval"][1] is None


def test_the_series_of_bounds_is_kept_with_infinite_ends_and_without_values(
    model: Estimator, tmp_path: Path
) -> None:
    found = measured(even(3 * FRAMES), far(model, 0, 1.0))
    write(tmp_path / "found.zarr", found, beside(found, start=None, wind=None))
    answer, arrays = read(tmp_path / "found.zarr")
    assert answer["windows"][0]["quantities"]["wind_speed"]["bound"] == "at-least"
    assert np.isnan(arrays["wind"]).all()
    assert np.isposinf(arrays["high"]).all()
    assert (arrays["low"] > 5).all()
