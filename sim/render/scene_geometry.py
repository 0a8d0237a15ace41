"""The world at one instant of every frame, in the arrays a rasteriser reads."""

from __future__ import annotations

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from flagdata.errors import InputError
from sim.render.rendered_meshes import Meshes
from sim.render.staging import Stage

NEAR = 0.02
"""What is nearer to the camera's plane is not drawn [m]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Geometry:
    """All frames' cloth, then the pole, which is the same in all of them.

    Attributes:
        positions: (vertex, 3) float32, in the world [m].
        uv: (vertex, 2) float32.
        corners: (face, 3) int64 vertex indices: frame after frame, in each the cloth's faces, then
            the pole's.
        frame: (face,) int64 the frame that a face belongs to.
        cloth: (face,) whether it is cloth.
        vertex_offset: (frame + 1,) int64; frame i has the cloth's vertices offset[i] to offset[i +
            1], and the pole's, which come after all of them.
        face_offset: (frame + 1,) int64.
        cloth_faces: (frame,) int64 how many of a frame's faces are cloth.
        shift: (3,) what brings meshes into the world [m].
    """

    positions: Tensor
    uv: Tensor
    corners: Tensor
    frame: Tensor
    cloth: Tensor
    vertex_offset: Tensor
    face_offset: Tensor
    cloth_faces: Tensor
    shift: tuple[float, float, float]

    @classmethod
    def of(cls, meshes: Meshes, placed: Stage) -> Geometry:
        """Joins the meshes and their stage."""
        device, pole = meshes.device, len(meshes.positions)
        vertex_offset, offset = (
            torch.tensor(o, device=device) for o in (meshes.vertex_offset, meshes.face_offset)
        )
        poles = len(placed.pole_faces)
        corners = []
        for i in range(len(meshes)):
            faces = (
                meshes.faces[meshes.face_offset[i] : meshes.face_offset[i + 1]]
                + meshes.vertex_offset[i]
            )
            corners += [faces, placed.pole_faces + pole]
        index = torch.arange(len(meshes), device=device)
        frame = torch.repeat_interleave(index, offset.diff() + poles)
        face_offset = offset + poles * torch.arange(len(offset), device=device)
        face = torch.arange(len(frame), device=device) - face_offset[frame]
        return cls(
            positions=torch.cat(
                [
                    meshes.positions + meshes.positions.new_tensor(placed.shift),
                    placed.pole_positions,
                ]
            ),
            uv=torch.cat([meshes.uv, meshes.uv.new_zeros((len(placed.pole_positions), 2))]),
            corners=torch.cat(corners),
            frame=frame,
            cloth=face < offset.diff()[frame],
            vertex_offset=vertex_offset,
            face_offset=face_offset,
            cloth_faces=offset.diff(),
            shift=placed.shift,
        )

    def at(self, positions: Tensor) -> Geometry:
        """Replaces the positions of the cloth's vertices: (all vertices, 3), as the meshes have
        them [m]."""
        cloth = positions + positions.new_tensor(self.shift)
        return replace(self, positions=torch.cat([cloth, self.positions[len(cloth) :]]))

    def normals(self) -> Tensor:
        """Computes float32 unit normals (vertex, 3): the mean of the faces around a vertex,
        weighted by their areas."""
        a, b, c = (self.positions[self.corners[:, k]].double() for k in range(3))
        face = torch.linalg.cross(b - a, c - a)
        total = torch.zeros(
            (len(self.positions), 3), dtype=torch.float64, device=self.positions.device
        )
        for k in range(3):
            total.index_add_(0, self.corners[:, k], face)
        return torch.nn.functional.normalize(total, dim=1, eps=1e-30).float()


def check_in_front(positions: Tensor, meshes: Meshes, placed: Stage) -> None:
    """Checks that the cloth is in front of the camera.

    Args:
        positions: (all vertices, 3) of the cloth at some instant of each frame, as the meshes have
            them [m].

    Raises:
        InputError: part of it is beside or behind the camera.
    """
    _, depth = placed.camera.project(positions + positions.new_tensor(placed.shift))
    behind = torch.nonzero(depth <= NEAR).flatten()
    if len(behind):
        frame = sum(offset <= int(behind[0]) for offset in meshes.vertex_offset) - 1
        raise InputError(
            f"{len(behind)} vertices of the cloth are behind the camera",
            where=f"frame {frame}",
            fix="enlarge camera_radius, or render fewer frames where the cloth travels",
        )
