"""A model that is small and untrained, and films that it looks at: what it says means nothing, how
it is used does."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import av
import numpy as np
import pytest
import torch

from flagdata.core.arrays import UInt8Array
from flagdata.core.files.checksums import write_sums
from flagdata.core.rng import stream, torch_draws
from flagdata.ingest.films.film_array import Frames
from models.maps.crops import Cropping
from models.maps.frontend import FrontEnd
from models.networks.learner import Learner, Loss
from models.networks.wave import WaveNetwork
from models.trained import estimator
from models.trained.estimator import CLOUD, Estimator
from models.trained.model_folder import WEIGHTS, renew, tensor_bytes, write_card, write_tensors
from models.trained.outliers import Familiarity

FRAMES, SIZE, RATE = 12, 24, 25.0
TARGETS = ("wind_speed", "area_weight", "bending_scale", "anisotropy")


def pictures(count: int, *, seed: int = 3, height: int = 32, width: int = 40) -> UInt8Array:
    """(count, height, width): a patch of waves that travel across it."""
    rng = stream(seed, "pictures")
    t = np.arange(count)[:, None, None] / RATE
    y, x = np.mgrid[0:height, 0:width]
    patch = np.exp(-(((x - width / 2) / 10) ** 4) - ((y - height / 2) / 8) ** 4)
    waves = np.cos(0.5 * x - 2 * np.pi * rng.uniform(2, 6) * t)
    return np.clip(110 + 80 * patch * waves + rng.normal(0, 2, waves.shape), 0, 255).astype(
        np.uint8
    )


def even(count: int, *, rate: float = RATE, seed: int = 3) -> Frames:
    """A film of an even rate."""
    return Frames(time=np.arange(count) / rate, images=pictures(count, seed=seed))


@pytest.fixture(scope="session")
def model_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The model as a folder, familiar with clips of `pictures`."""
    return written(tmp_path_factory.mktemp("estimate") / "small", TARGETS)


def written(folder: Path, targets: tuple[str, ...]) -> Path:
    """A model of these targets, its weights as they were drawn."""
    folder.mkdir()
    options = {"dimension": 4, "widths": (6, 6, 6)}
    with torch_draws(1, "weights"):
        learner = Learner(
            WaveNetwork(**options), loss=Loss.POSTERIOR, targets=targets, components=2
        ).eval()  # type: ignore[arg-type]
    front_end = FrontEnd(maps="wave-maps", size=SIZE, frames=FRAMES, rate=RATE)
    cropping = Cropping(frames=FRAMES, size=SIZE)
    write_card(
        folder,
        {
            "name": folder.name,
            "seed": 1,
            "front_end": asdict(front_end),
            "cropping": asdict(cropping),
            "recipe": {
                "network": {"name": "wave", "options": options},
                "loss": {
                    "name": "posterior",
                    "targets": list(targets),
                    "components": 2,
                    "margin": 1.0,
                },
                "data": {"dataset": "made", "sequences": None},
            },
        },
    )
    write_tensors(folder / WEIGHTS, learner.state_dict())
    write_sums(folder)
    bare = estimator.load(folder)
    clips = np.stack([pictures(FRAMES, seed=seed) for seed in range(88)])
    with torch.no_grad():
        summaries = bare.embeddings(bare.inputs(clips))[0].numpy()
    cloud = Familiarity.of(summaries[:28], summaries[28:])
    renew(
        folder,
        CLOUD,
        tensor_bytes({name: torch.from_numpy(value) for name, value in cloud.arrays().items()}),
    )
    return folder


@pytest.fixture(scope="session")
def model(model_folder: Path) -> Estimator:
    return estimator.load(model_folder)


@pytest.fixture(scope="session")
def cloth_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model of hanging cloth as a folder."""
    return written(
        tmp_path_factory.mktemp("cloth") / "small-cloth",
        ("cloth_wind", "cloth_area_weight", "cloth_bending"),
    )


@pytest.fixture(scope="session")
def cloth_model(cloth_folder: Path) -> Estimator:
    return estimator.load(cloth_folder)


def write_video(path: Path, images: UInt8Array, *, rate: int = 25) -> Path:
    """A film without loss."""
    with av.open(str(path), "w") as container:
        stream_ = container.add_stream("ffv1", rate=rate)
        stream_.width, stream_.height, stream_.pix_fmt = images.shape[2], images.shape[1], "gray"
        for image in images:
            for packet in stream_.encode(av.VideoFrame.from_ndarray(image, format="gray")):
                container.mux(packet)
        for packet in stream_.encode():
            container.mux(packet)
    return path
