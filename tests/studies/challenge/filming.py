"""Films of a challenge's sets, and the log of the wind beside them."""

from __future__ import annotations

import math
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import torch

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import child_seed, stream
from flagdata.lake import MeshSequence
from flagdata.timebase import NANOSECONDS
from measure.simulated_camera import write_film
from sim.assets import Assets
from sim.effects import AnemometerLag
from sim.render import render_prior
from tests.studies.challenge.answer_key import AnswerKey
from tests.studies.challenge.films import SCHEMA
from tests.studies.challenge.meshes import mesh_of
from tests.studies.challenge.recipe import ChallengeRecipe, Filming
from tests.studies.challenge.simulation import SimulatedSet, material_of

_START = datetime(2026, 5, 14, 9, 30, tzinfo=UTC)
_CUP = 2.3
"""Distance constant of the cup [m]."""


def films_of(
    folder: Path,
    recipe: ChallengeRecipe,
    filming: Filming,
    seed: int,
    key: AnswerKey,
    made: SimulatedSet,
) -> dict[str, Any]:
    """Write a set's films; what is stated beside them.

    Args:
        folder: of the set; new.
        key: of the set.
    """
    name = key.name
    folder.mkdir(parents=True)
    mesh = mesh_of(recipe.numerics[key.numerics], width=recipe.width, height=recipe.height)
    rng = stream(seed, name, "camera")
    azimuth = filming.azimuth + filming.azimuth_sigma * rng.standard_normal()
    elevation = filming.elevation + filming.elevation_sigma * rng.standard_normal()
    distance = filming.distance * (1 + filming.distance_sigma * rng.standard_normal())
    recordings = []
    for index, (positions, wind) in enumerate(zip(made.positions, made.winds, strict=True)):
        called = "abcdefghijklmnopqrstuvwxyz"[index]
        sequence = MeshSequence(
            time=np.round(np.arange(len(positions)) / filming.rate * NANOSECONDS).astype(np.int64),
            positions=positions.astype(np.float32),
            faces=mesh.faces.astype(np.int32),
            rest=mesh.rest.astype(np.float32),
            attributes={},
        )
        quantities = {
            "camera_angle": math.radians(azimuth),
            "camera_radius": distance * math.cos(math.radians(elevation)),
            "camera_height": filming.height - distance * math.sin(math.radians(elevation)),
            "mesh_height": filming.height + recipe.height / 2,
            "view_angle": math.radians(filming.view),
            "raster_samples": filming.samples,
            "width": filming.width,
            "height": filming.pixels_high,
            "exposure_bias": -0.3,
        }
        look = replace(
            render_prior.named_prior("outdoor").with_quantities(quantities, source="the challenge"),
            backgrounds=filming.backgrounds,
        )
        zeta = look.draw(child_seed(seed, name, "look", index), Assets())
        write_film(
            folder / f"{called}.mp4",
            sequence,
            zeta,
            rate=filming.rate,
            start=_START,
            seed=child_seed(seed, name, "noise", index),
            workers=1,
            advance=lambda frames: None,
        )
        times, speed = logged(recipe, wind)
        recordings.append({"name": called, "times": times.tolist(), "speed": speed.tolist()})
    return {
        "schema": SCHEMA,
        "flag": {"length": recipe.width, "height": recipe.height},
        "camera": {
            "azimuth": [filming.azimuth, filming.azimuth_sigma],
            "elevation": [filming.elevation, filming.elevation_sigma],
            "distance": filming.distance,
        },
        "area_weight": None
        if not filming.weight_sigma
        else [
            material_of(key).area_weight * math.exp(filming.weight_sigma * rng.standard_normal()),
            filming.weight_sigma,
        ],
        "anemometer": {"distance_constant": _CUP, "averaging": 1.0},
        "recordings": recordings,
    }


def logged(recipe: ChallengeRecipe, wind: FloatArray) -> tuple[FloatArray, FloatArray]:
    """What a cup logs once a second of a wind (sample, 3) from the first frame on: the middles of
    its seconds [s], and means over them [m/s]."""
    rate = recipe.log_rate
    times = np.arange(len(wind)) / rate
    speed = np.hypot(wind[:, 0], wind[:, 1])[:, None]
    lagged = (
        AnemometerLag(distance=_CUP)
        .read(torch.from_numpy(times), torch.from_numpy(speed))
        .numpy()[:, 0]
    )
    whole = len(lagged) // rate
    means = lagged[: whole * rate].reshape(whole, rate).mean(axis=1)
    return times[: whole * rate].reshape(whole, rate).mean(axis=1), means
