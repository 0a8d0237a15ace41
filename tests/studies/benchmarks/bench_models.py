"""What a clip costs: the front end from pixels, a step of training, an estimate; medians of one
thread's time.

The plain front end is the definition that tests hold the fast one to: SciPy's filters, torch's
pooling and the periodogram layer.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import torch
from scipy import ndimage
from torch.nn import functional

from models.maps.frontend import FrontEnd, Maps, standardise_clip
from models.maps.spectral_layer import SpectralDecomposition
from models.trained import estimator
from models.training import load

_RUNS = 31
_BATCH = 8
_RECIPES = (
    "flow",
    "wave",
    "sdn",
    "sdn-112",
    "resnet18-1",
    "resnet18-10",
    "resnet18-20",
    "cardona",
    "yang",
)


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Milliseconds a clip of 30 × 224 × 224 (or what the recipe takes)."""
    torch.set_num_threads(1)
    generator = torch.Generator().manual_seed(seed)
    clip = (torch.rand((1, 1, 30, 224, 224), generator=generator) * 255).to(torch.uint8)
    kinds: tuple[Maps, ...] = (
        "frames",
        "spectral-maps",
        "wave-maps",
        "flow-maps",
        "flow-maps-3",
        "handmade",
    )
    ends = {maps: _milliseconds(lambda maps=maps: FrontEnd(maps=maps)(clip)) for maps in kinds}
    model = estimator.load_shipped()
    film = (torch.rand((1, 30, 300, 300), generator=generator) * 255).to(torch.uint8).numpy()
    return {
        "front_end": ends,
        "plain_front_end": _milliseconds(lambda: _plain(clip[0, 0]), runs=3),
        "training_step": {name: _step(name, generator) for name in _RECIPES},
        "estimate_from_pixels": _milliseconds(lambda: model.estimate(model.inputs(film))),
    }


def _milliseconds(work: Callable[[], object], *, runs: int = _RUNS) -> float:
    work()
    found = []
    for _ in range(runs):
        begun = time.process_time()
        work()
        found.append(time.process_time() - begun)
    return round(1e3 * float(np.median(found)), 2)


def _plain(clip: torch.Tensor) -> torch.Tensor:
    video = ndimage.gaussian_filter1d(standardise_clip(clip).numpy(), 1.0, axis=0, mode="nearest")
    slopes = []
    for along, across in ((2, 1), (1, 2)):
        slope = ndimage.gaussian_filter1d(video, 2.0, axis=along, order=1, mode="nearest")
        slopes.append(ndimage.gaussian_filter1d(slope, 2.0, axis=across, mode="nearest"))
    pooled = functional.max_pool2d(torch.from_numpy(np.stack(slopes)), 2)[None]
    return SpectralDecomposition(rate=25.0)(pooled)


def _step(name: str, generator: torch.Generator) -> dict[str, float]:
    """Of a clip in a batch of 8: forward and backward, and forward alone."""
    recipe = load(name)
    learner = recipe.learner()
    inputs = torch.randn((_BATCH, *recipe.front_end.shape), generator=generator)
    values = torch.full((_BATCH, len(recipe.loss.targets)), 5.0)
    sequence = torch.arange(_BATCH)

    def both() -> None:
        learner.loss(inputs, values, sequence).backward()

    @torch.no_grad()
    def forward() -> None:
        learner.network(inputs)

    return {
        "forward_backward": round(_milliseconds(both, runs=3) / _BATCH, 2),
        "forward": round(_milliseconds(forward, runs=3) / _BATCH, 2),
    }
