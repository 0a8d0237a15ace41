"""Where the cloth is at instants between its frames, for motion blur."""

from __future__ import annotations

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from flagdata.errors import InputError
from sim.cloth.material_points import locate
from sim.render.rendered_meshes import Frame, Meshes


@dataclass(frozen=True, kw_only=True, eq=False)
class VertexMotion:
    """Where vertices are around the instants of their frames.

    Positions are linear in time between frames, and go on at the same velocity before the first and
    after the last one; a single frame stands still. Where the topology changes, a vertex of a frame
    is looked up in the next (or last) one by its place in the texture, which is fixed to the cloth.

    Attributes:
        positions: (all vertices, 3) at the frames' instants [m].
        rate: frames a second [Hz].
        forth, back: (all vertices, 3) displacements from a frame to the next one, and from the one
            before to it [m].
    """

    positions: Tensor
    rate: float
    forth: Tensor
    back: Tensor

    @classmethod
    def of(cls, meshes: Meshes) -> VertexMotion:
        """Estimates the motion of a sequence.

        Raises:
            InputError: texture places of one frame that are not covered by the next one's faces.
        """
        n, x = len(meshes), meshes.positions
        if n == 1:
            return cls(
                positions=x, rate=meshes.rate, forth=torch.zeros_like(x), back=torch.zeros_like(x)
            )
        if meshes.one_topology:
            steps = torch.diff(x.unflatten(0, (n, -1)), dim=0)
            forth, back = (
                torch.cat(parts).flatten(0, 1)
                for parts in ((steps, steps[-1:]), (steps[:1], steps))
            )
        else:
            forth = torch.cat([_step(meshes, i, i + 1 if i < n - 1 else i - 1) for i in range(n)])
            back = torch.cat([_step(meshes, i, i - 1 if i > 0 else 1) for i in range(n)])
        return cls(positions=x, rate=meshes.rate, forth=forth, back=back)

    def part(self, first: int, last: int) -> VertexMotion:
        """Selects the motion of some vertices, by their range among all."""
        rows = slice(first, last)
        return replace(
            self, positions=self.positions[rows], forth=self.forth[rows], back=self.back[rows]
        )

    def at(self, offset: float) -> Tensor:
        """Moves all vertices to `offset` seconds after each frame's instant, within a frame's time
        of it: (all vertices, 3)."""
        share = offset * self.rate
        return (
            self.positions + share * (self.forth if share > 0 else self.back)
            if share
            else self.positions
        )


def move_frames(meshes: Meshes, offset: float) -> Meshes:
    """Moves every frame of the meshes to `offset` seconds later than its instant, see
    `VertexMotion`."""
    return replace(meshes, positions=VertexMotion.of(meshes).at(offset)) if offset else meshes


def _step(meshes: Meshes, index: int, other_index: int) -> Tensor:
    """Computes how far a frame's vertices move in a frame's time, from where they are in another
    frame, one earlier or later."""
    frame = meshes.frame(index)
    positions = _looked_up(
        meshes.frame(other_index), frame.uv, where=f"frames {index} and {other_index}"
    )
    return (positions - frame.positions) * (other_index - index)


def _looked_up(frame: Frame, uv: Tensor, *, where: str) -> Tensor:
    """Looks up positions (point, 3) of texture places (point, 2) in a frame."""
    places, faces = frame.uv.double().cpu().numpy(), frame.faces.cpu().numpy()
    try:
        found = locate(places, faces, uv.double().cpu().numpy(), where=where)
    except InputError as error:
        raise InputError(
            f"the cloth of one frame is in no face of the other: {error.what}",
            where=where,
            fix="give frames whose texture places cover the same cloth, or no exposure time",
        ) from None
    corners = frame.positions[torch.from_numpy(found.corners).to(uv.device).long()]
    weights = torch.from_numpy(found.weights).to(corners)
    return (corners * weights[:, :, None]).sum(dim=1)
