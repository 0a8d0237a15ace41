"""One sample of every pixel in torch, on any device: the definition of the raster renderer."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from sim.render.coverage import GRID, Triangles, fragments
from sim.render.pixel_view import RasterView
from sim.render.scene_geometry import NEAR, Geometry
from sim.render.scene_light import Light
from sim.render.shadow import ShadowMaps
from sim.render.staging import POLE_ALBEDO
from sim.render.texture import Pyramid

_BITS = 32
_LAST = (1 << 31) - 1


@dataclass(frozen=True, kw_only=True)
class _Visible:
    """The surface each covered sample shows: (point,) pixels, faces, and (point, 3) weights of a
    face's corners."""

    pixel: Tensor
    face: Tensor
    corners: Tensor
    weights: Tensor
    image_area: Tensor


def add_sample(
    out: Tensor, geometry: Geometry, *, view: RasterView, light: Light, pyramid: Pyramid
) -> None:
    """Adds one sample's share to all frames.

    Args:
        out: (frame, height, width, 4) float32 radiance times coverage, and coverage; changed in
            place.
    """
    visible = _visible(geometry, view)
    x, normals = geometry.positions, geometry.normals()
    a, b, c = (x[geometry.corners[visible.face, k]] for k in range(3))
    face_normal = torch.linalg.cross(b - a, c - a)
    front = ((a - x.new_tensor(view.camera.position)) * face_normal).sum(dim=1) < 0
    weights = visible.weights[:, :, None]
    point = (x[visible.corners] * weights).sum(dim=1)
    normal = torch.nn.functional.normalize((normals[visible.corners] * weights).sum(dim=1), dim=1)
    normal = torch.where(front[:, None], normal, -normal)
    uv = (geometry.uv[visible.corners] * weights).sum(dim=1)
    cloth = geometry.cloth[visible.face]
    uv_edges = geometry.uv[visible.corners[:, 1:]] - geometry.uv[visible.corners[:, :1]]
    uv_area = (
        uv_edges[:, 0, 0] * uv_edges[:, 1, 1] - uv_edges[:, 0, 1] * uv_edges[:, 1, 0]
    ).abs() / 2
    level = pyramid.level(uv_area, visible.image_area, view.samples)
    albedo = torch.where(cloth[:, None], pyramid.at(uv, level), x.new_tensor(POLE_ALBEDO))
    through = torch.where(cloth, light.translucency, 0.0)
    frame = geometry.frame[visible.face]
    cosines = torch.zeros_like(through)
    for direction in light.to_sun:
        cosine = normal @ normal.new_tensor(direction)
        share = torch.where(cosine > 0, (1 - through) * cosine, -through * cosine)
        cosines += share * ShadowMaps.of(geometry, direction).lit(point, normal, frame)
    diffuse = cosines * light.point + light.sky
    radiance = (
        torch.cat([albedo * diffuse[:, None], torch.ones_like(diffuse)[:, None]], dim=1)
        / view.samples
    )
    out.view(-1, 4).index_add_(0, visible.pixel, radiance)


def _visible(geometry: Geometry, view: RasterView) -> _Visible:
    x, camera = geometry.positions, view.camera
    size = camera.width * camera.height
    places, depth = view.project(x)
    ahead = (depth > NEAR)[geometry.corners].all(dim=1)
    faces = torch.nonzero(ahead).flatten()
    triangles = Triangles.of(places, geometry.corners[faces])
    nearness = 1 / depth
    parts = fragments(triangles, width=camera.width, height=camera.height)
    best = torch.zeros(len(geometry.cloth_faces) * size, dtype=torch.int64, device=x.device)
    fragments_of: list[tuple[Tensor, Tensor, Tensor, Tensor, Tensor]] = []
    for part in parts:
        face = faces[triangles.face[part.triangle]]
        pixel = geometry.frame[face] * size + part.pixel
        n = nearness[triangles.corners[part.triangle]]
        value = (
            n[:, 0]
            + part.shares[:, 0] * (n[:, 1] - n[:, 0])
            + part.shares[:, 1] * (n[:, 2] - n[:, 0])
        )
        key = (value.view(torch.int32).long() << _BITS) | (_LAST - part.triangle)
        best.scatter_reduce_(0, pixel, key, "amax")
        fragments_of.append((pixel, key, part.triangle, part.shares, n))
    pixel, key, triangle, shares, n = (
        torch.cat(parts) for parts in zip(*fragments_of, strict=True)
    )
    won = best[pixel] == key
    pixel, triangle, shares, n = pixel[won], triangle[won], shares[won], n[won]
    linear = torch.cat([1 - shares.sum(dim=1, keepdim=True), shares], dim=1) * n
    return _Visible(
        pixel=pixel,
        face=faces[triangles.face[triangle]],
        corners=triangles.corners[triangle],
        weights=linear / linear.sum(dim=1, keepdim=True),
        image_area=triangles.area[triangle].float() * (0.5 / GRID**2),
    )
