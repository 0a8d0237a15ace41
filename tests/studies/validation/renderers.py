"""Do Cycles and the rasteriser show the same? Silhouettes, places and light of 50 drawn scenes of
simulated flags.

Silhouettes are those of unlit cloth and pole before a bright sky; places are those of four small
patches on the flag's corners, by their centre in the picture. Light is compared where both see
cloth or pole.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch
from PIL import Image

from flagdata.core.arrays import BoolArray, FloatArray
from flagdata.lake import MeshSequence
from sim.assets import Assets
from sim.render import (
    Cycles,
    Meshes,
    Raster,
    Renderer,
    RenderParameters,
    Workbench,
    named_prior,
    plate,
    stage,
    to_bytes,
)
from sim.run import Crew, Stepper, load
from sim.run import run as simulate

SCENES = 50
SHEET = 12  # scenes of the picture
PATCH = 0.03  # m, half the side of a patch
MARGIN = 8  # px; patches nearer to the frame's rim are left out
DARK = 60  # sum of three bytes below which a pixel is cloth; the sky's is above 200


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Agreement over all scenes, seconds a frame of one core, and a sheet of the first scenes side
    by side."""
    torch.set_num_threads(1)
    assets = Assets()
    prior = named_prior("flags")
    flags = _flags(seed)
    overlap, misplaced, brightness, difference, pairs = [], [], [], [], []
    seconds: dict[str, list[float]] = {"cycles": [], "raster": [], "workbench": []}
    with Cycles(assets) as cycles, Workbench(assets) as workbench:
        raster = Raster(assets=assets)
        for scene in range(SCENES):
            meshes = flags[scene % len(flags)]
            zeta = prior.draw(seed * 1000 + scene, assets)
            shown = []
            for name, renderer in (
                ("cycles", cycles),
                ("raster", raster),
                ("workbench", workbench),
            ):
                begun = time.perf_counter()
                shown.append(renderer.render(meshes, zeta)[0].numpy().astype(np.int64))
                seconds[name].append(time.perf_counter() - begun)
            one, other = (_covered(renderer, meshes, zeta) for renderer in (cycles, raster))
            overlap.append((one & other).sum() / (one | other).sum())
            misplaced += [_misplaced(renderer, meshes, zeta) for renderer in (cycles, raster)]
            both = one & other
            brightness.append(float((shown[0][both] - shown[1][both]).mean()))
            difference.append(float(np.abs(shown[0][both] - shown[1][both]).mean()))
            pairs.append(np.concatenate(shown[:2]).astype(np.uint8))
    picture = out / "validate-renderers.jpg"
    rows = [np.concatenate(pairs[i : i + 4], axis=1) for i in range(0, SHEET, 4)]
    Image.fromarray(np.concatenate(rows)).save(picture, quality=85, optimize=True)
    places = np.array(misplaced).reshape(SCENES, 2, 4)
    return {
        "scenes": SCENES,
        "size": [300, 300],
        "vertices": len(flags[0].frame(0).positions),
        "silhouette_iou": {"least": float(np.min(overlap)), "median": float(np.median(overlap))},
        "corner_error_px": {
            name: {
                "median": float(np.nanmedian(places[:, k])),
                "largest": float(np.nanmax(places[:, k])),
            }
            for k, name in enumerate(("cycles", "raster"))
        },
        "corners_out_of_frame": int(np.isnan(places[:, 0]).sum()),
        "mean_difference_of_255": {
            "median": float(np.median(brightness)),
            "largest": float(np.abs(brightness).max()),
        },
        "pixel_difference_of_255": {
            "median": float(np.median(difference)),
            "largest": float(np.max(difference)),
        },
        "seconds_a_frame": {name: float(np.median(values)) for name, values in seconds.items()},
        "cycles_samples": 50,
        "picture": picture.name,
    }


def _flags(seed: int) -> list[Meshes]:
    """Single frames of simulated flags in the paper's search space."""
    recipe = load("flag-search-space")
    recipe = replace(recipe, seed=seed, time=replace(recipe.time, settle=3.0, frames=1))
    crew = Crew(recipe)
    members = [crew.member(index) for index in range(recipe.batch)]
    outcomes = simulate(crew, Stepper.of(crew), members, size=recipe.batch)
    sequences: Sequence[MeshSequence] = [o.sequence for o in outcomes if o.sequence is not None]
    return [Meshes.flag(sequence, heading=0.0) for sequence in sequences]


def _black(zeta: RenderParameters) -> RenderParameters:
    return replace(
        zeta,
        sun_strength=0.0,
        sky_strength=0.0,
        exposure_time=0.0,
        background="sky/1",
        cycles_samples=8,
    )


def _covered(renderer: Renderer, meshes: Meshes, zeta: RenderParameters) -> BoolArray:
    return renderer.render(meshes, _black(zeta))[0].numpy().astype(int).sum(-1) < DARK


def _behind(zeta: RenderParameters) -> FloatArray:
    """The background alone, the sum of its three bytes."""
    return (
        to_bytes(torch.from_numpy(plate(Assets().background(zeta.background), zeta)))
        .double()
        .sum(-1)
        .numpy()
    )


def _misplaced(renderer: Renderer, meshes: Meshes, zeta: RenderParameters) -> list[float]:
    """How far each corner's patch is from where `Camera.project` puts it [px]; NaN where it is not
    in the frame."""
    frame = meshes.frame(0)
    axes = stage(meshes, zeta).camera
    right, down = (
        torch.tensor(axis, dtype=torch.float32) * PATCH for axis in (axes.right, axes.down)
    )
    unlit = replace(_black(zeta), pole_radius=0.0)
    empty = _behind(unlit)
    found: list[float] = []
    for u, v in ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)):
        corner = frame.positions[int((frame.uv - torch.tensor([u, v])).abs().sum(-1).argmin())]
        square = torch.stack(
            [corner + x * right + y * down for x, y in ((-1, 1), (1, 1), (1, -1), (-1, -1))]
        )
        patch = len(frame.positions) + torch.tensor([[0, 1, 2], [0, 2, 3]])
        alone = Meshes.fixed(  # with all vertices, since the camera aims at the middle of them
            positions=torch.cat([frame.positions, square])[None],
            faces=patch,
            anchor=meshes.anchor,
            uv=torch.cat([frame.uv, torch.zeros(4, 2)]),
            heading=meshes.heading,
        )
        placed = stage(alone, unlit)
        place = placed.camera.project((corner + torch.tensor(placed.shift)).double())[0].numpy()
        if not (
            MARGIN < place[0] < zeta.width - MARGIN and MARGIN < place[1] < zeta.height - MARGIN
        ):
            found.append(float("nan"))
            continue
        seen = renderer.render(alone, unlit)[0].double().sum(-1).numpy()
        weights = np.clip(empty - seen, 0.0, None)
        y, x = (
            np.average(np.arange(n) + 0.5, weights=weights.sum(axis))
            for axis, n in ((1, 300), (0, 300))
        )
        found.append(float(np.hypot(x - place[0], y - place[1])))
    return found
