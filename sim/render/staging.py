"""Places in the world for given meshes and ζ: camera, sun, cloth and pole."""

from __future__ import annotations

import math
from dataclasses import dataclass

import torch
from torch import Tensor

from sim.render.parameters import RenderParameters
from sim.render.pinhole_camera import Camera
from sim.render.rendered_meshes import Meshes

POLE_ALBEDO = (0.45, 0.45, 0.47)  # linear sRGB: weathered aluminium, painted grey
_POLE_SIDES = 12
_POLE_ABOVE = 0.05  # m by which the pole stands above the anchor


@dataclass(frozen=True, kw_only=True)
class Stage:
    """The world: origin on the ground beneath the anchor, z up, axes parallel to the meshes'.

    Attributes:
        camera: see `Camera`.
        to_sun: (3,) unit vector towards the middle of the sun.
        shift: (3,) added to the meshes' positions to bring them into the world [m].
        pole_positions: (vertex, 3) float32 [m], in the world; no rows where there is no pole.
        pole_faces: (face, 3) int64, counter-clockwise seen from outside.
    """

    camera: Camera
    to_sun: tuple[float, float, float]
    shift: tuple[float, float, float]
    pole_positions: Tensor
    pole_faces: Tensor


def stage(meshes: Meshes, parameters: RenderParameters) -> Stage:
    """Places everything.

    The camera aims at the middle of the cloth's bounding box over all frames, from `camera_radius`
    away horizontally. The pole is a vertical cylinder from the ground to a little above the anchor;
    it touches the anchor from the side that the heading comes from.

    Raises:
        InputError: see `Camera.looking`.
    """
    zeta = parameters
    x, y, z = meshes.anchor
    shift = (-x, -y, zeta.mesh_height - z)
    low, high = torch.aminmax(meshes.positions, dim=0)
    middle = ((low + high) / 2).double().cpu().tolist()
    aim = (middle[0] + shift[0], middle[1] + shift[1], middle[2] + shift[2])
    axis = meshes.heading + zeta.camera_angle
    camera = Camera.looking(
        position=(
            aim[0] - zeta.camera_radius * math.cos(axis),
            aim[1] - zeta.camera_radius * math.sin(axis),
            zeta.camera_height,
        ),
        target=aim,
        view_angle=zeta.view_angle,
        width=zeta.width,
        height=zeta.height,
        frame_offset=(zeta.frame_offset_x, zeta.frame_offset_y),
    )
    azimuth = meshes.heading + zeta.sun_azimuth
    away = math.hypot(zeta.sun_radius, zeta.sun_height)
    positions, faces = _pole(
        radius=zeta.pole_radius,
        top=zeta.mesh_height + _POLE_ABOVE,
        heading=meshes.heading,
        device=meshes.device,
    )
    return Stage(
        camera=camera,
        shift=shift,
        pole_positions=positions,
        pole_faces=faces,
        to_sun=(
            zeta.sun_radius * math.cos(azimuth) / away,
            zeta.sun_radius * math.sin(azimuth) / away,
            zeta.sun_height / away,
        ),
    )


def _pole(
    *, radius: float, top: float, heading: float, device: torch.device
) -> tuple[Tensor, Tensor]:
    """Makes a closed upright cylinder: a ring on the ground, a ring at the top, and the middle of
    its lid."""
    if radius == 0 or top <= 0:
        return torch.zeros((0, 3), device=device), torch.zeros(
            (0, 3), dtype=torch.int64, device=device
        )
    n = _POLE_SIDES
    turn = torch.arange(n, dtype=torch.float64, device=device) * (2 * math.pi / n)
    x = radius * (turn.cos() - math.cos(heading))
    y = radius * (turn.sin() - math.sin(heading))
    low, high = (torch.stack([x, y, torch.full_like(x, level)], dim=1) for level in (0.0, top))
    lid = torch.tensor(
        [[-radius * math.cos(heading), -radius * math.sin(heading), top]], device=device
    ).double()
    a = torch.arange(n, device=device)
    b = (a + 1) % n
    faces = torch.cat(
        [
            torch.stack([a, b, b + n], dim=1),
            torch.stack([a, b + n, a + n], dim=1),
            torch.stack([a + n, b + n, torch.full_like(a, 2 * n)], dim=1),
        ]
    )
    return torch.cat([low, high, lid]).float(), faces
