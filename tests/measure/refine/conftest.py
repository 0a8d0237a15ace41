"""A small world: a coarse flag, pictures of 48 px, a network of random weights."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from flagdata.core.rng import torch_draws
from measure.refine import Evaluator, FilmCamera, FixedView, Simulator, fingerprint
from models.maps.crops import Cropping
from models.maps.frontend import FrontEnd
from models.networks.learner import Learner, Loss
from models.networks.wave import WaveNetwork
from models.trained.estimator import Estimator
from sim.render import RenderParameters
from sim.run import Recipe, simulation_toml

FRAMES, RATE, SIZE = 8, 25.0, 48
SCENE = """
seed = 1
[scene]
columns = 3
[material]
name = "camel-ponte-roma"
area-weight = { low = 0.10, high = 0.17 }
bending-factors = { low = 0.1, high = 10.0 }
[wind]
speed = { low = 0.0, high = 10.0 }
[time]
settle = 0.4
frames = 8
rate = 25.0
"""


@pytest.fixture(scope="session")
def recipe() -> Recipe:
    return simulation_toml.parse(SCENE, name="coarse", folder=Path(), where="test")


@pytest.fixture(scope="session")
def view() -> FixedView:
    zeta = RenderParameters(
        texture="flag/france", background="sky/1", width=SIZE, height=SIZE, raster_samples=2
    )
    return FixedView(zeta=zeta, camera=FilmCamera())


@pytest.fixture(scope="session")
def estimator() -> Estimator:
    with torch_draws(3, "network"):
        learner = Learner(
            WaveNetwork(dimension=6, widths=(4, 6, 8)),
            loss=Loss.POSTERIOR,
            components=2,
            targets=("wind_speed", "area_weight", "bending_scale", "anisotropy"),
        )
    return Estimator(
        name="random",
        learners=(learner.eval(),),
        front_end=FrontEnd(maps="wave-maps", size=32, frames=FRAMES),
        cropping=Cropping(frames=FRAMES, size=32),
        widening=torch.ones(4),
        cloud=None,
        card={},
    )


@pytest.fixture
def simulator(recipe: Recipe, view: FixedView) -> Simulator:
    return Simulator.of(recipe, view, frames=FRAMES, rate=RATE, batch=4)


@pytest.fixture
def evaluator(simulator: Simulator, estimator: Estimator, tmp_path: Path) -> Evaluator:
    return Evaluator(simulator, estimator, 5, tmp_path / "cache", fingerprint(estimator))


@pytest.fixture
def points() -> np.ndarray:
    return np.random.default_rng(2).uniform(-1, 1, (3, 17))
