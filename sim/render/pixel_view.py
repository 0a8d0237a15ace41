"""What one sample of every pixel sees of the world."""

from __future__ import annotations

from dataclasses import dataclass

from torch import Tensor

from sim.render.pinhole_camera import Camera


@dataclass(frozen=True, kw_only=True)
class RasterView:
    """A camera whose pixels look through one point each.

    Attributes:
        jitter: place of the point in the pixel, from its upper left corner [px].
        samples: of a pixel in all; this one counts for its share.
    """

    camera: Camera
    jitter: tuple[float, float]
    samples: int

    def project(self, points: Tensor) -> tuple[Tensor, Tensor]:
        """As `Camera.project`, moved so that the sample of pixel (i, j) lies at (j + 0.5, i +
        0.5)."""
        places, depth = self.camera.project(points)
        return places + places.new_tensor([0.5 - self.jitter[0], 0.5 - self.jitter[1]]), depth
