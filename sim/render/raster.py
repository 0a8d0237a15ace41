"""The raster renderer: depth-tested triangles, many samples a pixel, shadow maps of points of the
sun."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass, field

import torch
from torch import Tensor

from sim.assets import Assets
from sim.render import raster_kernel, raster_torch
from sim.render.develop import develop, plate
from sim.render.parameters import RenderParameters
from sim.render.pixel_view import RasterView
from sim.render.raster_kernel import library
from sim.render.rendered_meshes import Meshes
from sim.render.sampling import Samples
from sim.render.scene_geometry import Geometry, check_in_front
from sim.render.scene_light import Light
from sim.render.shutter import VertexMotion
from sim.render.staging import Stage, stage
from sim.render.texture import Pyramid

_TOGETHER = 32  # frames; bounds the memory


@dataclass(frozen=True, kw_only=True)
class Raster:
    """Renders on the device of the meshes.

    Light is direct: what cloth reflects onto cloth (`cycles_bounces`) is left out, and the sky
    reaches into every fold. Shadows come from `raster_samples` × 2 points of the sun.

    Attributes:
        assets: where textures and backgrounds come from.
    """

    assets: Assets = field(default_factory=Assets)

    def render(self, meshes: Meshes, parameters: RenderParameters) -> Tensor:
        """Renders the frames, see `Renderer.render`.

        Raises:
            InputError: cloth behind the camera, or assets that cannot be read.
            UnknownNameError: assets that do not exist.
        """
        return self.part(meshes, parameters, 0, len(meshes))

    def part(self, meshes: Meshes, parameters: RenderParameters, first: int, last: int) -> Tensor:
        """Frames `first` to `last` (the last not included) of what `render` makes of all: the
        camera aims at the cloth of the whole sequence.

        Raises:
            InputError, UnknownNameError: as `render`.
        """
        zeta, device = parameters, meshes.device
        pyramid = Pyramid.of(self.assets.texture(zeta.texture), device=device)
        behind = torch.from_numpy(plate(self.assets.background(zeta.background), zeta)).to(device)
        placed = stage(meshes, zeta)
        samples = Samples.of(zeta, to_sun=placed.to_sun)
        motion = VertexMotion.of(meshes) if zeta.exposure_time > 0 else None
        for instant in (samples.time.min(), samples.time.max()):
            check_in_front(
                meshes.positions if motion is None else motion.at(float(instant)), meshes, placed
            )
        film = []
        for begin in range(first, last, _TOGETHER):
            end = min(begin + _TOGETHER, last)
            moving = motion and motion.part(meshes.vertex_offset[begin], meshes.vertex_offset[end])
            scene = _accumulate_samples(
                meshes.part(begin, end), moving, placed, samples, zeta, pyramid
            )
            film.append(_develop_scene(scene, behind, gain=zeta.gain))
        return torch.cat(film)


def _accumulate_samples(
    meshes: Meshes,
    motion: VertexMotion | None,
    placed: Stage,
    samples: Samples,
    zeta: RenderParameters,
    pyramid: Pyramid,
) -> Tensor:
    """Accumulates linear radiance times coverage, and coverage, over the samples: (frame, height,
    width, 4)."""
    out = torch.zeros((len(meshes), zeta.height, zeta.width, 4), device=meshes.device)
    geometry = Geometry.of(meshes, placed)
    code = _code(meshes.device)
    for index in range(zeta.raster_samples):
        now = geometry if motion is None else geometry.at(motion.at(float(samples.time[index])))
        x, y = samples.jitter[index].tolist()
        view = RasterView(camera=placed.camera, jitter=(x, y), samples=zeta.raster_samples)
        light = Light.of(zeta, samples, index)
        if code is None:
            raster_torch.add_sample(out, now, view=view, light=light, pyramid=pyramid)
        else:
            raster_kernel.add_sample(code, out, now, view=view, light=light, pyramid=pyramid)
    return out


def _develop_scene(scene: Tensor, behind: Tensor, *, gain: float) -> Tensor:
    code = _code(scene.device)
    return (
        develop(scene, behind, gain=gain)
        if code is None
        else raster_kernel.develop(code, scene, behind, gain=gain)
    )


def _code(device: torch.device) -> ctypes.CDLL | None:
    """Returns the kernel, which is for CPUs."""
    return library() if device.type == "cpu" else None
