"""Every form of recipe: a sound text of it, and how it is read; with the subjects that a campaign
draws from them."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

from hypothesis import strategies as st

from flagdata.ingest.anemometer.sensor_recipe import parse as parse_sensor
from flagdata.recipes.shelves import parse_recipe
from measure.trajectories import load as load_experiment
from models.training import parse as parse_training
from sim.arcsim import read_material, read_scene
from sim.cloth.material import Material
from sim.datasets import parse as parse_dataset
from sim.render.render_prior import read as read_prior
from sim.run import Crew, Stepper
from sim.run import parse as parse_scene
from tests.damage import as_toml, damaged, damages, edited, edits
from tests.small import EXPERIMENT, SCENE, TRAINING
from tests.studies.challenge.recipe import CHALLENGES
from tests.studies.challenge.recipe import parse as parse_challenge
from tests.studies.hostile.campaign import Subject, command

CATALOGS = Path(__file__).parents[3] / "catalogs"

SCENE_FILE = {
    "frame_time": 0.04,
    "frame_steps": 8,
    "end_time": 1,
    "cloths": [{"mesh": "m.obj", "materials": [{}]}],
    "gravity": [0, 0, -9.8],
    "wind": {"velocity": [1, 0, 0]},
    "magic": {"repulsion_thickness": 5e-3},
}
MATERIAL_FILE = {"density": 0.2, "stretching": [[1, 0, 1, 1]] * 6, "bending": [[1e-5] * 5] * 3}
SQUARE = (
    "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nv 0 0 0\nv 0 1 0\nv 0 1 1\nv 0 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 "
    "4/4\n"
)


LEARNED = {
    'dataset = "made"': 'dataset = ["made", "other"]\nsequences = 4',
    "variants = 2": "variants = 2\nmirror = true",
    "widths = [6, 6, 6]": "widths = [6, 6, 6]\nstrides = [2, 2, 2]",
    "batch = 4": "batch = 4\nclip-norm = 5.0",
}
"""What the form of a training recipe has beyond `TRAINING`."""


def experiment(text: str, folder: Path) -> object:
    path = folder / "experiment.toml"
    path.write_text(text)
    return load_experiment(path)


def training() -> str:
    text = TRAINING
    for old, new in LEARNED.items():
        text = text.replace(old, new)
    return text


def first(folder: str) -> str:
    return min((CATALOGS / folder).glob("*.toml")).read_text()


def ready(text: str, folder: Path) -> None:
    """Everything of a small scene that comes before its first step."""
    crew = Crew(parse_scene(text, name="recipe", folder=folder, where="recipe"))
    crew.member(0)
    Stepper.of(crew)


FORMS: dict[str, tuple[str, Callable[[str, Path], object]]] = {
    "sensor": (first("sensors"), lambda text, _: parse_sensor(text, where="recipe")),
    "scene": (
        first("scenes"),
        lambda text, folder: parse_scene(text, name="recipe", folder=folder, where="recipe"),
    ),
    "data set": (
        first("datasets"),
        lambda text, folder: parse_dataset(text, name="recipe", folder=folder, where="recipe"),
    ),
    "challenge": (
        CHALLENGES.named("films-3").text,
        lambda text, _: parse_challenge(text, where="recipe"),
    ),
    "material": (
        first("materials"),
        lambda text, _: Material.from_mapping(parse_recipe(text, where="recipe"), name="recipe"),
    ),
    "render prior": (
        first("renders"),
        lambda text, _: read_prior(parse_recipe(text, where="recipe"), name="recipe"),
    ),
    "scene made ready": (SCENE, ready),
    "experiment": (EXPERIMENT, experiment),
    "training": (
        training(),
        lambda text, _: parse_training(text, name="recipe", where="recipe").check(),
    ),
}


def _toml(form: str) -> Subject:
    text, read = FORMS[form]
    content = tomllib.loads(text)

    def act(example: Any, folder: Path) -> None:
        edit, damage = example
        data = as_toml(edited(content, edit))
        read(
            data if damage is None else damaged(data.encode(), damage).decode(errors="replace"),
            folder,
        )

    return Subject(
        name=form, examples=st.tuples(edits, st.one_of(*[st.none()] * 4, damages)), act=act
    )


def _json(name: str, content: dict[str, Any], read: Callable[[Path], object]) -> Subject:
    def act(example: Any, folder: Path) -> None:
        (folder / "m.obj").write_text(SQUARE)
        path = folder / name
        path.write_text(json.dumps(edited(content, example)))
        read(path)

    return Subject(name=f"ArcSim's {name}", examples=edits, act=act)


def _plan(example: Any, folder: Path) -> None:
    path = folder / "own.toml"
    path.write_text(
        as_toml(
            edited(
                tomllib.loads((CATALOGS / "datasets" / "flagsim-small.toml").read_text()), example
            )
        )
    )
    command("init", "--lake", folder / "lake")
    command("build", path, "--plan", "--lake", folder / "lake")


def subjects() -> list[Subject]:
    """All recipes."""
    return [
        *map(_toml, FORMS),
        _json("scene.json", SCENE_FILE, read_scene),
        _json("material.json", MATERIAL_FILE, read_material),
        Subject(name="build --plan", examples=edits, act=_plan),
    ]
