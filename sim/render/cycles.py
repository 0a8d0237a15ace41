"""Blender's renderers: Cycles, a path tracer, as the reference; Workbench, its viewport, as a peer
in speed.

Both run in a process of their own (`sim.blender`), which gets what `stage` placed and gives linear
light back; the background, the exposure and the bytes are made here, as for every renderer. The
motion blur of an exposure is the mean of as many pictures as it takes for the cloth to move by a
pixel between them, at most `_MOST_PICTURES`; the samples of a pixel are dealt to them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from types import TracebackType
from typing import Any, ClassVar, Self

import numpy as np
import torch
from torch import Tensor

from flagdata.core.arrays import Float32Array
from sim.assets import Assets
from sim.blender.process import WorkerProcess
from sim.blender.protocol import Message
from sim.render.develop import develop, plate
from sim.render.parameters import RenderParameters
from sim.render.pinhole_camera import Camera
from sim.render.rendered_meshes import Meshes
from sim.render.shutter import move_frames
from sim.render.staging import POLE_ALBEDO, Stage, stage

_MOST_PICTURES = 8
_LEAST_TIMEOUT = 120.0  # s for one picture
_SLOWEST = 2e-5  # s a sample of a pixel, with a margin of thirty on a core of 2020


class Cycles:
    """Cycles on the CPU: one `WorkerProcess` for as long as this lives. A context manager.

    The sun is a disc light and the sky a uniform world, `cycles_samples` paths a pixel with
    `cycles_bounces` bounces; their noise differs from frame to frame and stays in the picture. The
    same arguments give the same bytes on the same machine.

    Args:
        assets: that textures and backgrounds are taken from.
        threads: of Blender.
        command: how the worker is started; by default in Blender's own environment.
    """

    ENGINE: ClassVar[str] = "CYCLES"

    def __init__(
        self, assets: Assets, *, threads: int = 1, command: Sequence[str] | None = None
    ) -> None:
        self._assets = assets
        self._threads = threads
        self.worker = WorkerProcess(command)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Ends the worker; rendering again starts another."""
        self.worker.close()

    def render(self, meshes: Meshes, parameters: RenderParameters) -> Tensor:
        """As `sim.render.Renderer`.

        Raises:
            NotFoundError, BlenderError: Blender is not installed, or cannot be used.
            RenderError: Blender refused the scene, or crashed or hung at the same frame three
                times.
        """
        placed = stage(meshes, parameters)
        pictures = self._pictures(meshes, parameters, placed.camera)
        setup = self._scene(placed, parameters, pictures)
        timeout = (
            _LEAST_TIMEOUT
            + _SLOWEST * parameters.width * parameters.height * parameters.cycles_samples
        )
        self.worker.request([setup], timeout=timeout)
        frames: list[Float32Array] = []
        for messages in _frames(meshes, placed, parameters, pictures):
            answers = self.worker.request(messages, timeout=timeout, setup=setup)
            frames.append(np.mean([answer.arrays["rgba"] for answer in answers], axis=0))
        scene = torch.from_numpy(np.stack(frames))
        behind = torch.from_numpy(plate(self._assets.background(parameters.background), parameters))
        return develop(scene, behind, gain=parameters.gain).to(meshes.device)

    def _pictures(self, meshes: Meshes, zeta: RenderParameters, camera: Camera) -> int:
        """Counts the pictures that make one exposure."""
        half = zeta.exposure_time / 2
        first, last = (
            camera.project(move_frames(meshes, offset).positions)[0] for offset in (-half, half)
        )
        return min(_MOST_PICTURES, max(1, math.ceil(float((last - first).norm(dim=-1).max()))))

    def _scene(self, placed: Stage, zeta: RenderParameters, pictures: int) -> Message:
        objects: list[dict[str, Any]] = [
            {"name": "cloth", "albedo": [1.0, 1.0, 1.0], "translucency": zeta.translucency},
        ]
        if len(placed.pole_faces):
            objects.append({"name": "pole", "albedo": list(POLE_ALBEDO), "translucency": 0.0})
        return Message(
            kind="scene",
            fields={
                "engine": self.ENGINE,
                "width": zeta.width,
                "height": zeta.height,
                "threads": self._threads,
                "samples": math.ceil(zeta.cycles_samples / pictures),
                "bounces": zeta.cycles_bounces,
                "camera": _camera(placed.camera),
                "sky": zeta.sky_strength,
                "objects": objects,
                "sun": {
                    "toward": list(placed.to_sun),
                    "irradiance": zeta.sun_strength,
                    "angle": zeta.sun_angular_radius,
                },
            },
            arrays={"texture/cloth": self._assets.texture(zeta.texture)},
        )


class Workbench(Cycles):
    """Blender's Workbench: flat studio light instead of sun and sky; for comparisons of speed and
    of silhouettes."""

    ENGINE = "BLENDER_WORKBENCH"


def _frames(
    meshes: Meshes, placed: Stage, zeta: RenderParameters, pictures: int
) -> Iterator[list[Message]]:
    """Yields the pictures of each frame: the meshes at instants that share out its exposure."""
    shift = torch.tensor(placed.shift, dtype=torch.float32)
    pole = {
        "positions/pole": placed.pole_positions.cpu().numpy(),
        "faces/pole": placed.pole_faces.cpu().int().numpy(),
        "uv/pole": torch.zeros(len(placed.pole_positions), 2).numpy(),
    }
    instants = [
        move_frames(meshes, zeta.exposure_time * ((k + 0.5) / pictures - 0.5))
        for k in range(pictures)
    ]
    for index in range(len(meshes)):
        messages: list[Message] = []
        for picture, instant in enumerate(instants):
            frame = instant.frame(index)
            cloth = {
                "positions/cloth": (frame.positions.cpu() + shift).numpy(),
                "faces/cloth": frame.faces.cpu().int().numpy(),
                "uv/cloth": frame.uv.cpu().numpy(),
            }
            seed = picture * len(meshes) + index
            messages.append(Message(kind="frame", fields={"seed": seed}, arrays={**cloth, **pole}))
        yield messages


def _camera(camera: Camera) -> dict[str, Any]:
    """As the worker takes it: Blender's cameras look along their −z, with y up."""
    axes = (camera.right, [-v for v in camera.down], [-v for v in camera.forward], camera.position)
    rows = [[axis[i] for axis in axes] for i in range(3)]
    return {
        "matrix": [*rows, [0.0, 0.0, 0.0, 1.0]],
        "focal": camera.focal,
        "centre": list(camera.centre),
    }
