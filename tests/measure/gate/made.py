"""Small made films of a waving patch before a still background, a small network that was never
trained, and gates learned from drawn feature vectors."""

from __future__ import annotations

import numpy as np
import torch

from flagdata.core.arrays import FloatArray, UInt8Array
from measure.gate import DISTORTIONS, ClipStatistics, Gate
from measure.gate.checks import CHECKS
from models.maps.crops import Cropping
from models.maps.frontend import FrontEnd
from models.maps.handmade import FEATURES
from models.networks.learner import Learner, Loss
from models.networks.networks_by_name import NETWORKS
from models.trained.estimator import Estimator
from models.trained.outliers import Familiarity

SIZE, FRAMES = 112, 30
DIMENSION = len(CHECKS) + len(FEATURES) + 4 + 3
KINDS = list(DISTORTIONS)


def background(seed: int = 0) -> FloatArray:
    """(SIZE, SIZE) gray levels with structure of all lengths, 60 to 190."""
    from scipy import ndimage

    rng = np.random.default_rng(seed)
    noise = rng.normal(size=(SIZE, SIZE))
    picture = np.sum(
        [ndimage.gaussian_filter(noise, s, mode="wrap") * s for s in (1.5, 4, 12)], axis=0
    )
    return 60 + 130 * (picture - picture.min()) / np.ptp(picture)


def film(
    *, seed: int = 0, at: tuple[float, float] = (0.5, 0.5), frames: int = FRAMES, noise: float = 0.7
) -> UInt8Array:
    """(frames, SIZE, SIZE): a patch with travelling waves, its middle at (x, y) in sides of the
    picture."""
    rng = np.random.default_rng(seed)
    t = np.arange(frames)[:, None, None] / 25
    y, x = np.mgrid[:SIZE, :SIZE]
    inside = (np.abs(x - at[0] * SIZE) < 22) & (np.abs(y - at[1] * SIZE) < 15)
    wind = rng.uniform(1, 4)
    waves = 120 + 70 * np.cos(0.35 * x - 2 * np.pi * wind * t + rng.uniform(0, 6)) * np.cos(
        0.2 * y + wind * t
    )
    gray = np.where(inside, waves, background(seed)) + rng.normal(0, noise, (frames, SIZE, SIZE))
    return np.clip(np.rint(gray), 0, 255).astype(np.uint8)


def value(name: str, frames: UInt8Array) -> float:
    """One statistic of a clip."""
    return CHECKS[name].measure(ClipStatistics.of(frames))


def small_model(seed: int = 0) -> Estimator:
    """A network with random weights on 12 frames of 32 px, with a cloud of made films."""
    torch.manual_seed(seed)
    front_end = FrontEnd(maps="wave-maps", size=32, frames=12)
    network = NETWORKS["wave"](dimension=4, widths=(6, 6, 6))
    learner = Learner(network, loss=Loss.POSTERIOR, targets=("wind_speed",), components=2).eval()
    rng = np.random.default_rng(seed)
    cloud = Familiarity.of(rng.normal(size=(40, 4)), rng.normal(size=(19, 4)))
    return Estimator(
        name="small",
        learners=(learner,),
        front_end=front_end,
        cropping=Cropping(frames=12, size=32),
        widening=torch.ones(1),
        cloud=cloud,
        card={"name": "small"},
    )


def plain(seed: int, count: int) -> FloatArray:
    """(count, DIMENSION) of a heavy-tailed law: Student's t with five degrees of freedom,
    correlated."""
    rng = np.random.default_rng(seed)
    mixing = (
        np.eye(DIMENSION)
        + 0.3 * np.random.default_rng(0).normal(size=(DIMENSION, DIMENSION)) / DIMENSION**0.5
    )
    return rng.standard_t(5, (count, DIMENSION)) @ mixing


def distorted(seed: int, count: int, kind: str, strength: float = 40.0) -> FloatArray:
    """Plain vectors moved along a direction of the distortion's own, among the hand-made
    features."""
    moved = plain(seed, count)
    moved[:, len(CHECKS) + 2 * KINDS.index(kind)] += strength
    return moved


def learned(seed: int, calibration: int = 199) -> Gate:
    made = {kind: distorted(1000 * seed + place, 80, kind) for place, kind in enumerate(KINDS)}
    return Gate.of(plain(seed, 300), made, plain(seed + 500, calibration))
