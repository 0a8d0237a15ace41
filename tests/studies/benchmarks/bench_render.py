"""Speed of the renderers on one core, with the rasteriser's error at that speed beside it.

300 × 300, a simulated flag of 2,501 vertices and 4,800 faces, shadows, exposure; ζ is drawn, so
that the flag takes as much of the frame as in a data set. Peers in the same run, where Blender is
there: Cycles at the paper's 50 samples, and Blender's Workbench, which draws neither shadows nor
sky.
"""

from __future__ import annotations

import os
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from flagdata.errors import NotFoundError
from flagdata.lake import MeshSequence
from flagdata.timebase import NANOSECONDS
from sim.assets import Assets
from sim.cloth.material import named_material as material
from sim.cloth.scene import assemble, flag
from sim.integrate import Symplectic
from sim.render import RENDERERS, Meshes, Raster, RenderParameters
from sim.render import named_prior as prior

FRAME = 0.04  # s
SETTLE, KEPT = 12, 12  # frames that are simulated
PEER_FRAMES = 6
CLIP = 60  # frames; those kept are played to and fro
DRAWS = 6
EXACT = 512  # samples of a pixel taken as the truth


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Frames a second and their error; nothing is written into `out`."""
    del out
    torch.set_num_threads(1)
    allowed = os.sched_getaffinity(0) if hasattr(os, "sched_setaffinity") else None
    if allowed:
        os.sched_setaffinity(0, {max(allowed)})
    try:
        meshes = _flag()
        zetas = [prior("flags").draw(seed * 1000 + index, Assets()) for index in range(DRAWS)]
        exact = _exact(meshes, zetas[:3])
        result: dict[str, Any] = {
            "size": [300, 300],
            "vertices": len(meshes.frame(0).positions),
            "faces": len(meshes.frame(0).faces),
            "frames": len(meshes),
            "zetas": DRAWS,
            "raster": [_raster(meshes, zetas, samples, exact) for samples in (4, 8, 16)],
        }
    finally:
        if allowed:
            os.sched_setaffinity(0, allowed)
    for name in ("workbench", "cycles"):
        if name in RENDERERS:
            result[name] = _peer(name, meshes, zetas[0])
    return result


def _flag() -> Meshes:
    scene = flag(
        material=material("camel-ponte-roma").scaled(area_weight=0.5), wind_speed=5.0, columns=60
    )
    kept = []
    with torch.no_grad():
        system, state = assemble([scene])
        for frame in range(SETTLE + KEPT):
            state = Symplectic().advance(system, state, FRAME)
            if frame >= SETTLE:
                kept.append(state.position[..., 0].numpy().copy())
    kept += kept[-2:0:-1]
    sequence = MeshSequence(
        time=np.arange(CLIP, dtype=np.int64) * round(FRAME * NANOSECONDS),
        positions=np.stack([kept[frame % len(kept)] for frame in range(CLIP)]),
        faces=scene.mesh.faces.astype(np.int32),
        rest=scene.mesh.rest.astype(np.float32),
    )
    return Meshes.flag(sequence, heading=0.0)


def _raster(
    meshes: Meshes, zetas: list[RenderParameters], samples: int, exact: list[torch.Tensor]
) -> dict[str, float]:
    """Over all ζ; the background and the texture are made anew for each clip, as in a build."""
    renderer = Raster()
    chosen = [replace(zeta, raster_samples=samples) for zeta in zetas]
    renderer.render(meshes, chosen[0])
    wall, used = time.perf_counter(), time.process_time()
    for zeta in chosen:
        renderer.render(meshes, zeta)
    wall, used = time.perf_counter() - wall, time.process_time() - used
    two = meshes.part(0, 2)
    errors = [
        float((renderer.render(two, zeta).double() - true).square().mean().sqrt())
        for zeta, true in zip(chosen, exact, strict=False)
    ]
    frames = len(chosen) * len(meshes)
    return {
        "samples": samples,
        "frames_per_second": frames / wall,
        "frames_per_cpu_second": frames / used,
        "rms_error_of_255": float(np.mean(errors)),
    }


def _exact(meshes: Meshes, zetas: list[RenderParameters]) -> list[torch.Tensor]:
    """Two frames with so many samples that more change nothing."""
    return [
        Raster().render(meshes.part(0, 2), replace(zeta, raster_samples=EXACT)).double()
        for zeta in zetas
    ]


def _peer(name: str, meshes: Meshes, zeta: RenderParameters) -> dict[str, Any]:
    """A renderer of Blender, on all cores that there are, its start not counted."""
    zeta, meshes = replace(zeta, exposure_time=0.0), meshes.part(0, PEER_FRAMES)
    try:
        with RENDERERS[name](Assets()) as renderer:
            renderer.render(meshes, replace(zeta, cycles_samples=1))
            begun = time.perf_counter()
            renderer.render(meshes, zeta)
            seconds = time.perf_counter() - begun
    except NotFoundError as error:
        return {"absent": str(error)}
    return {"samples": zeta.cycles_samples, "frames_per_second": len(meshes) / seconds}
