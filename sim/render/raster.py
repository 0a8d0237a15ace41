"""The raster renderer: depth-tested triangles, many samples a pixel, shadow maps of points of the sun."""

from __future__ import annotations

from dataclasses import dataclass, field

import torch
from torch import Tensor

from sim.assets import Assets
from sim.render.develop import develop, plate
from sim.render.geometry import Geometry
from sim.render.meshes import Meshes
from sim.render.parameters import RenderParameters
from sim.render.raster_torch import Light, add_sample
from sim.render.sampling import Samples
from sim.render.shutter import moved
from sim.render.stage import stage
from sim.render.texture import Pyramid


@dataclass(frozen=True, kw_only=True)
class Raster:
    """Renders on the device of the meshes.

    Light is direct: what cloth reflects onto cloth (`cycles_bounces`) is left out, and the sky reaches into every fold.
    Shadows come from `raster_samples` × 2 points of the sun.

    Attributes:
        assets: where textures and backgrounds come from.
    """

    assets: Assets = field(default_factory=Assets)

    def render(self, meshes: Meshes, parameters: RenderParameters) -> Tensor:
        """See `Renderer.render`.

        Raises:
            InputError: cloth behind the camera, or assets that cannot be read.
            UnknownNameError: assets that do not exist.
        """
        zeta, device = parameters, meshes.device
        pyramid = Pyramid.of(self.assets.texture(zeta.texture), device=device)
        behind = torch.from_numpy(plate(self.assets.background(zeta.background), zeta)).to(device)
        placed = stage(meshes, zeta)
        samples = Samples.of(zeta, to_sun=placed.to_sun)
        out = torch.zeros((len(meshes), zeta.height, zeta.width, 4), device=device)
        for index in range(zeta.raster_samples):
            geometry = Geometry.of(moved(meshes, float(samples.time[index])), placed)
            geometry.check(placed.camera)
            light = Light(
                to_sun=tuple(tuple(d) for d in samples.to_sun[index].tolist()), sun_weight=samples.sun_weight,
                sky=zeta.sky_strength, translucency=zeta.translucency,
            )  # fmt: skip
            x, y = samples.jitter[index].tolist()
            add_sample(
                out, geometry, camera=placed.camera, jitter=(x, y), light=light, pyramid=pyramid,
                samples=zeta.raster_samples,
            )  # fmt: skip
        return develop(out, behind, gain=zeta.gain)
