"""Films whose wind only an anemometer measures: ground truth comes out as for a real recording."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from flagdata.core.workload import one_thread
from flagdata.dataset import clip_rows
from flagdata.lake import Artifact
from flagdata.record import CAMERA, PROVENANCE, Record
from sim.datasets import DatasetRecipe, PlannedFilm, Sequences, anemometer, build_jobs, casts
from sim.run import Crew


@dataclass(frozen=True, kw_only=True)
class Shown:
    """A film in gusts, its record and its clips."""

    recipe: DatasetRecipe
    film: PlannedFilm
    record: Record
    clips: list[Artifact]
    crew: Crew


@pytest.fixture(scope="module")
def gusty(make: Callable[..., DatasetRecipe], tmp_path_factory: pytest.TempPathFactory) -> Shown:
    recipe = make(
        {"noise = 0.1": 'noise = 0.1\ntruth = "measured"'},
        scene={
            "speed = { low = 0.0, high = 10.0 }": "speed = 6.0",
            "columns = 6": "columns = 3",
            "[time]\nsettle = 0.2\nframes = 30": (
                "[effects.gusts]\nintensity = 0.15\nlength = 20.0\n[time]\nsettle = 62.0\nframes = "
                "60"
            ),
        },
    )
    cast = next(casts(recipe))
    with one_thread():
        outcome = build_jobs.simulate(cast.simulation, 0, [0, 1], "cpu").outcomes[0]
        assert outcome.sequence is not None
        film = next(Sequences(recipe=recipe, side="train", members=((cast, 0, "0" * 32),)).films())
        done = build_jobs.film(recipe, film, outcome.sequence, "cpu")
    path = tmp_path_factory.mktemp("gusty") / "film.mcap"
    path.write_bytes(done.data)
    record = Record.open(path)
    clips = clip_rows(record, film.artifact())
    return Shown(recipe=recipe, film=film, record=record, clips=clips, crew=Crew(cast.simulation))


def test_ground_truth_is_the_anemometers_minute_with_its_uncertainty(gusty: Shown) -> None:
    series = gusty.record.wind()
    assert series is not None
    assert len(gusty.clips) == 2
    for clip in gusty.clips:
        assert clip.end is not None
        inside = (series.time > clip.end - 60 * 10**9) & (series.time <= clip.end)
        assert clip.wind == pytest.approx(series.channels["wind_speed"][inside].mean(), abs=1e-9)
        assert clip.wind_sigma is not None
        assert (
            clip.wind_sigma > 0.2
        )  # what the instrument's data sheet states, and the standard error of gusts
        assert clip.wind_coverage is not None
        assert clip.wind_coverage > 0.98
        assert clip.wind_staleness is not None
        assert clip.wind_staleness <= 1.0


def test_the_air_that_was_simulated_is_within_three_sigma_of_it(gusty: Shown) -> None:
    # Gain within 5 %, lag, noise of 0.1 m/s on 60 samples: all within what the stated 0.2 m/s
    # allows.
    time, velocity = anemometer.air(gusty.recipe.anemometer, gusty.crew, gusty.crew.member(0))
    for clip in gusty.clips:
        assert clip.end is not None
        end = (clip.end - gusty.film.begin) / 1e9
        air = np.hypot(velocity[:, 0], velocity[:, 1])[(time > end - 60) & (time <= end)].mean()
        assert clip.wind is not None
        assert clip.wind_sigma is not None
        assert abs(clip.wind - air) < 3 * clip.wind_sigma


def test_the_simulated_mean_wind_goes_by_a_name_that_is_no_ground_truth(gusty: Shown) -> None:
    truth = gusty.record.truth
    assert truth is not None
    assert "wind_speed" not in truth
    assert truth["mean_wind_speed"] == 6.0
    assert truth["gusts.intensity"] == 0.15


def test_a_record_says_what_it_was_made_from(gusty: Shown) -> None:
    provenance, camera = gusty.record.metadata[PROVENANCE], gusty.record.metadata[CAMERA]
    assert provenance["meshes"] == gusty.film.sequence
    assert json.loads(provenance["recipe"])["renderer"] == "raster"
    assert provenance["recipe_hash"] == gusty.film.artifact().recipe_hash
    assert (camera["width"], camera["height"], float(camera["true_rate"])) == (
        "32",
        "32",
        pytest.approx(25.0),
    )


def test_the_same_film_is_the_same_bytes(gusty: Shown, tmp_path: Path) -> None:
    with one_thread():
        outcome = build_jobs.simulate(gusty.film.cast.simulation, 0, [0], "cpu").outcomes[0]
        assert outcome.sequence is not None
        again = build_jobs.film(gusty.recipe, gusty.film, outcome.sequence, "cpu")
    assert again.data == gusty.record.path.read_bytes()


def test_films_of_a_session_have_the_same_camera_and_anemometer(
    make: Callable[..., DatasetRecipe],
) -> None:
    recipe = make(
        {
            "[sides.train]\nsequences = 3\nrenders = 7": (
                "[sessions]\nspread = 0.25\n[sides.train]\nsequences = 2\nrenders = 2\nsessions = 1"
            ),
            "sequences = 2\nrenders = 3": "sequences = 2\nrenders = 3\nsessions = 1",
        }
    )
    cast = next(casts(recipe))
    films = list(
        Sequences(
            recipe=recipe, side="train", members=((cast, 0, "0" * 32), (cast, 1, "1" * 32))
        ).films()
    )
    with one_thread():
        outcomes = build_jobs.simulate(cast.simulation, 0, [0, 1], "cpu").outcomes
        meshes = {
            outcome.member.index: outcome.sequence
            for outcome in outcomes
            if outcome.sequence is not None
        }
        made = [build_jobs.film(recipe, film, meshes[film.index], "cpu") for film in films]
    one, other = (json.loads(film.parameters) for film in made)
    for name in (
        "camera.jpeg_quality",
        "anemometer-lag.distance",
        "anemometer-gain.gain",
        "render.camera_radius",
    ):
        assert one[name] == other[name]
    assert one["wind_speed"] != other["wind_speed"]
    assert made[0].film.seed != made[1].film.seed
