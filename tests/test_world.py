"""The data sets of the looks and fabrics of the world, from their recipes to what a network learns
from."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import flagdata
from flagdata.cli import root
from measure.refine.refine_command import LEARNED
from models.networks.targets import TARGETS, Scaling
from models.training import TrainingRecipe, load, parse, prepare_films, sides_of
from models.training.training_recipe import TRAININGS
from sim.assets import Assets
from sim.datasets import DATASETS
from sim.datasets import load as load_dataset
from sim.render import named_prior
from sim.run.simulation_toml import SCENES

SIDE = 96
"""Of the small films [px]."""


def changed(text: str, **values: object) -> str:
    """A recipe's text with values in place of its own, each of them wherever its key is."""
    for key, value in values.items():
        text, count = re.subn(rf"(?m)^{key} = \S+", f"{key} = {value}", text)
        assert count, key
    return text


@pytest.fixture(scope="module")
def lake(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Both data sets with a sequence a side, of coarse flags that settle briefly, in small
    pictures."""
    folder = tmp_path_factory.mktemp("world")
    for name in ("world", "world-damped"):
        scene = SCENES.named(f"flag-{name}").text
        (folder / "scene.toml").write_text(changed(scene, columns=6, settle=0.2), encoding="utf-8")
        text = changed(DATASETS.named(name).text, scene='"scene.toml"', sequences=1, renders=1)
        small = f"[render]\nwidth = {SIDE}\nheight = {SIDE}"
        (folder / f"{name}.toml").write_text(text.replace("[render]", small), encoding="utf-8")
        arguments = [
            "build",
            str(folder / f"{name}.toml"),
            "--lake",
            str(folder / "lake"),
            "--workers",
            "1",
        ]
        done = CliRunner().invoke(root, arguments, catch_exceptions=False)
        assert done.exit_code == 0, done.output
    return folder / "lake"


@pytest.fixture(scope="module")
def small() -> TrainingRecipe:
    """`flow-world` with maps of 32 × 32 and one crop a film."""
    text = changed(TRAININGS.named("flow-world").text, size=32, variants=1)
    return parse(text, name="flow-world", where="flow-world.toml")


def test_a_film_of_each_data_set_becomes_a_record_and_an_input_of_the_network(
    lake: Path, small: TrainingRecipe, tmp_path: Path
) -> None:
    pairs = sides_of(flagdata.open(lake), small, "train", at=None)
    samples = [pairs[index] for index in range(len(pairs))]
    assert {sample.clip.shape[-2:] for sample in samples} == {(SIDE, SIDE)}
    assert len({sample.seed for sample in samples}) == 2  # one flag of either
    ready = prepare_films(
        pairs,
        small.front_end,
        small.cropping,
        variants=1,
        folder=tmp_path,
        workers=1,
        advance=lambda count: None,
        augment=small.augment,
    )
    maps = ready.batch(np.arange(len(ready)), np.zeros(len(ready), dtype=np.int64)).numpy()
    assert maps.shape[1:] == small.front_end.shape
    assert np.isfinite(maps).all()
    assert (maps.reshape(len(maps), -1).std(axis=1) > 0).all()
    assert "world_area_weight" in small.loss.targets
    values = ready.truth(small.loss.targets)
    assert np.isfinite(values).all()
    Scaling(names=small.loss.targets).check(values, where="the films")


def test_the_network_learns_from_as_many_films_as_its_refinement_takes_for_its_prior() -> None:
    learned = LEARNED["outdoor_wind", "world_area_weight"]
    recipes = [load_dataset(name) for name in load("flow-world").data.datasets]
    assert {one.simulation.name: one.side("train").renders for one in recipes} == learned.films
    assert set(learned.scenes) == set(learned.films)


def test_the_range_of_weights_holds_the_cloth_that_lay_at_the_end_of_the_one_before() -> None:
    world, fabric = TARGETS["world_area_weight"], TARGETS["fabric_area_weight"]
    assert (world.name, world.unit, world.cloth) == (fabric.name, fabric.unit, fabric.cloth)
    assert place(0.383, fabric.low, fabric.high) > 0.95
    assert place(0.383, world.low, world.high) < 0.85


def place(value: float, low: float, high: float) -> float:
    """Where a value lies in a range of its logarithm, 0 to 1."""
    return float(np.log(value / low) / np.log(high / low))


def test_the_looks_of_the_world_reach_what_those_outdoors_leave_out() -> None:
    world, outdoor = named_prior("world"), named_prior("outdoor")
    assert world.textures.count("banner") * 2 == len(world.textures)
    assert set(outdoor.textures) < set(world.textures)
    assert set(outdoor.backgrounds) < set(world.backgrounds)
    looks = [world.draw(seed, Assets()) for seed in range(400)]
    elevation = np.degrees([np.arctan2(look.sun_height, look.sun_radius) for look in looks])
    assert elevation.min() < 12
    assert elevation.max() > 80
    behind = np.array([np.cos(look.sun_azimuth - look.camera_angle) for look in looks])
    assert behind.max() > 0.99  # the camera looks into the sun
    assert behind.min() < -0.99
    softness = np.array([look.sun_softness for look in looks])
    assert (softness < 0.05).mean() > 0.2  # hard shadows
    assert (softness > 1).mean() > 0.2
