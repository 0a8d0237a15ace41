"""Which samples a triangle covers: exact, watertight, and the same on every machine.

Places are rounded to 1/256 px; edge functions are then whole numbers. A sample on an edge belongs
to the one of two neighbours whose edge runs down, or level to the right, so that no sample is
covered twice or not at all.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

GRID = 256
"""Steps of a pixel."""
REACH = 1 << 22
"""Places are limited to this many steps either way: products of two stay well within 63 bits."""
_FRAGMENTS = 1 << 22  # candidates looked at together; bounds the memory


@dataclass(frozen=True, kw_only=True)
class Triangles:
    """Triangles in an image, made counter-clockwise in a frame with y downwards (positive area);
    flat ones left out.

    Attributes:
        face: (triangle,) which face it is.
        corners: (triangle, 3) vertex indices.
        places: (triangle, 3, 2) int64, in steps.
        area: (triangle,) int64 twice the area, in steps², above 0.
    """

    face: Tensor
    corners: Tensor
    places: Tensor
    area: Tensor

    @classmethod
    def of(cls, places: Tensor, corners: Tensor) -> Triangles:
        """Makes triangles from places (vertex, 2) in pixels and corners (face, 3)."""
        steps = (places.double() * GRID).round().clamp(-REACH, REACH).long()
        p = steps[corners]
        area = _cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])
        turned = torch.where((area < 0)[:, None], corners[:, [0, 2, 1]], corners)
        faces = torch.nonzero(area != 0).flatten()
        return cls(
            face=faces, corners=turned[faces], places=steps[turned[faces]], area=area[faces].abs()
        )


@dataclass(frozen=True, kw_only=True)
class Fragments:
    """Samples that triangles cover.

    Attributes:
        triangle: (fragment,) which of the triangles.
        pixel: (fragment,) index into the flattened image.
        shares: (fragment, 2) float32 weights of the second and third corner, linear in the image.
    """

    triangle: Tensor
    pixel: Tensor
    shares: Tensor


def fragments(triangles: Triangles, *, width: int, height: int) -> list[Fragments]:
    """Computes what the triangles cover of the samples at the middles of an image's pixels: one
    part or more, maybe empty."""
    low, high = triangles.places.amin(dim=1), triangles.places.amax(dim=1)
    half, size = GRID // 2, triangles.places.new_tensor([width, height])
    first = torch.div(low - half + GRID - 1, GRID, rounding_mode="floor").clamp_min(0)
    last = torch.minimum(torch.div(high - half, GRID, rounding_mode="floor"), size - 1)
    span = (last - first + 1).clamp_min(0)
    counts = span.prod(dim=1)
    ends = counts.cumsum(0)
    parts: list[Fragments] = []
    begin = 0
    while begin < len(counts) or not parts:
        done = int(ends[begin - 1]) if begin else 0
        end = min(
            len(counts),
            max(begin + 1, int(torch.searchsorted(ends, done + _FRAGMENTS, right=True))),
        )
        parts.append(_cover_pixels(triangles, begin, end, first, span, counts, width=width))
        begin = end
    return parts


def _cover_pixels(
    triangles: Triangles,
    begin: int,
    end: int,
    first: Tensor,
    span: Tensor,
    counts: Tensor,
    *,
    width: int,
) -> Fragments:
    part = counts[begin:end]
    triangle = torch.repeat_interleave(torch.arange(begin, end, device=part.device), part)
    cell = torch.arange(len(triangle), device=part.device) - torch.repeat_interleave(
        part.cumsum(0) - part, part
    )
    across = span[triangle, 0]
    column = first[triangle, 0] + cell % across
    row = first[triangle, 1] + cell // across
    sample = torch.stack([column, row], dim=1) * GRID + GRID // 2
    p = triangles.places[triangle]
    edges = torch.stack([_edge(p[:, i], p[:, (i + 1) % 3], sample) for i in range(3)], dim=1)
    inside = (edges >= 0).all(dim=1)
    triangle, edges = triangle[inside], edges[inside]
    shares = edges[:, [2, 0]].float() / triangles.area[triangle].float()[:, None]
    return Fragments(triangle=triangle, pixel=(row * width + column)[inside], shares=shares)


def _edge(a: Tensor, b: Tensor, sample: Tensor) -> Tensor:
    """Computes twice the area of (a, b, sample), less 1 where samples on the edge belong to the
    neighbour."""
    along = b - a
    owned = (along[:, 1] > 0) | ((along[:, 1] == 0) & (along[:, 0] > 0))
    return _cross(along, sample - a) - (~owned).long()


def _cross(a: Tensor, b: Tensor) -> Tensor:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
