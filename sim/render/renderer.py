"""What a renderer does."""

from __future__ import annotations

from typing import Protocol

from torch import Tensor

from sim.render.parameters import RenderParameters
from sim.render.rendered_meshes import Meshes


class Renderer(Protocol):
    """Meshes and ζ in, frames out. The same arguments give the same bytes on the same device.

    The cloth is a perfectly diffuse sheet seen from both sides, with smooth vertex normals, that
    reflects the share 1 − t of its texture's albedo and transmits t
    (`RenderParameters.translucency`). It is lit by a uniform sky all around and by the sun, a disc
    of uniform radiance; cloth and pole cast shadows. The background is composited behind, unlit.
    """

    def render(self, meshes: Meshes, parameters: RenderParameters) -> Tensor:
        """Frames (frame, height, width, 3) uint8 sRGB, on the device of the meshes.

        Raises:
            InputError: a background or texture that cannot be read.
            UnknownNameError: one that does not exist.
        """
        ...
