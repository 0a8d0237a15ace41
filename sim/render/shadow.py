"""Shadow maps: how far from the sun the first surface is, seen from one point of the sun, for every
frame."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Self

import torch
from torch import Tensor

from sim.render.coverage import Triangles, fragments
from sim.render.scene_geometry import Geometry
from sim.render.scene_light import Direction

SIZE = 256
"""Texels of a map along each side; the frame's cloth just fits in."""
_MARGIN = 2  # texels around it
# texels that a point is moved off its surface, times the sine of the light's angle to the normal
_AWAY = 1.5
_BIAS = 0.3  # texels that a surface may be nearer to the sun and still not shade


def basis(direction: Direction) -> tuple[Direction, Direction, Direction]:
    """Returns two unit vectors across a direction and each other, and the direction."""
    x, y, z = direction
    if abs(z) < 0.9:
        length = (x * x + y * y) ** 0.5
        first = (-y / length, x / length, 0.0)
    else:
        length = (x * x + z * z) ** 0.5
        first = (z / length, 0.0, -x / length)
    second = (y * first[2] - z * first[1], z * first[0] - x * first[2], x * first[1] - y * first[0])
    return first, second, direction


@dataclass(frozen=True, kw_only=True)
class ShadowMaps:
    """One map a frame.

    Attributes:
        basis: (3, 3) rows: across, across, towards the sun.
        middle: (frame, 2) middle of the cloth across [m].
        texel: (frame,) side of a texel [m].
        nearest: (frame, SIZE, SIZE) coordinate towards the sun of the surface nearest to it [m];
            −inf where none is.
    """

    basis: Tensor
    middle: Tensor
    texel: Tensor
    nearest: Tensor

    @classmethod
    def of(cls, geometry: Geometry, direction: Direction) -> Self:
        """Renders the maps for light from a direction (unit vector towards it)."""
        x = geometry.positions
        across = torch.tensor(basis(direction), dtype=x.dtype, device=x.device)
        in_light = x @ across.T
        offset = geometry.vertex_offset.tolist()
        bounds = [torch.aminmax(in_light[a:b, :2], dim=0) for a, b in itertools.pairwise(offset)]
        low, high = (
            torch.stack([getattr(bound, end) for bound in bounds]) for end in ("min", "max")
        )
        middle, texel = (
            (low + high) / 2,
            (high - low).amax(dim=1).clamp_min(1e-6) / (SIZE - 2 * _MARGIN),
        )
        nearest = torch.full(
            (len(bounds) * SIZE * SIZE,), -torch.inf, dtype=x.dtype, device=x.device
        )
        corners, frame = geometry.corners, geometry.frame
        places = (in_light[corners, :2] - middle[frame, None]) / texel[frame, None, None] + SIZE / 2
        index = torch.arange(3 * len(corners), device=x.device).unflatten(0, (-1, 3))
        triangles = Triangles.of(places.flatten(0, 1), index)
        height = in_light[corners, 2].flatten()
        for part in fragments(triangles, width=SIZE, height=SIZE):
            h = height[triangles.corners[part.triangle]]
            value = (
                h[:, 0]
                + part.shares[:, 0] * (h[:, 1] - h[:, 0])
                + part.shares[:, 1] * (h[:, 2] - h[:, 0])
            )
            pixel = frame[triangles.face[part.triangle]] * SIZE * SIZE + part.pixel
            nearest.scatter_reduce_(0, pixel, value, "amax")
        return cls(
            basis=across, middle=middle, texel=texel, nearest=nearest.unflatten(0, (-1, SIZE, SIZE))
        )

    def lit(self, points: Tensor, normals: Tensor, frame: Tensor) -> Tensor:
        """Computes the share of the light that reaches points (point, 3) on surfaces with normals
        (point, 3): (point,).

        Bilinear over the four nearest texels' answers; 1 outside of the map.
        """
        cosine = normals @ self.basis[2]
        sine = (1 - cosine * cosine).clamp_min(0.0).sqrt()
        texel = self.texel[frame]
        away = torch.where(cosine < 0, -_AWAY, _AWAY) * sine * texel
        in_light = (points + away[:, None] * normals) @ self.basis.T
        texels = (in_light[:, :2] - self.middle[frame]) / texel[:, None] + (SIZE / 2 - 0.5)
        within = ((texels >= 0) & (texels < SIZE - 1)).all(dim=1)
        corner = texels.clamp(0, SIZE - 2).floor()
        s, t = (texels - corner).clamp(0.0, 1.0).unbind(dim=1)
        column, row = corner.long().unbind(dim=1)
        limit = in_light[:, 2] + _BIAS * texel
        flat, index = self.nearest.flatten(), (frame * SIZE + row) * SIZE + column
        free = [(flat[index + step] <= limit).float() for step in (0, 1, SIZE, SIZE + 1)]
        upper, lower = free[0] + s * (free[1] - free[0]), free[2] + s * (free[3] - free[2])
        return torch.where(within, upper + t * (lower - upper), 1.0)
