"""Where the cloth is at instants between its frames, for the blur of an exposure."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import torch
from torch import Tensor

from flagdata.errors import InputError
from sim.render.meshes import Frame, Meshes

_INWARD = 1e-5  # share by which a material point on the very edge is moved towards the middle


def moved(meshes: Meshes, offset: float) -> Meshes:
    """The meshes with every frame `offset` seconds later than its instant.

    Positions are linear in time between frames, and go on at the same velocity before the first and after the last one;
    a single frame stands still. Where the topology changes, a vertex of a frame is looked up in the next (or last) one
    by its place in the texture, which is fixed to the cloth.

    Args:
        offset: [s], at most a frame's time either way.

    Raises:
        InputError: texture places of one frame that are not covered by the next one's faces.
    """
    n, share = len(meshes), offset * meshes.rate
    if share == 0 or n == 1:
        return meshes
    if meshes.one_topology:
        x = meshes.positions.unflatten(0, (n, -1))
        velocity = torch.diff(x, dim=0)
        velocity = torch.cat([velocity, velocity[-1:]] if share > 0 else [velocity[:1], velocity])
        return replace(meshes, positions=(x + share * velocity).flatten(0, 1))
    return replace(meshes, positions=torch.cat([_one(meshes, i, share) for i in range(n)]))


def _one(meshes: Meshes, index: int, share: float) -> Tensor:
    """A frame's positions, `share` of a frame's time later."""
    here = meshes.frame(index)
    step = 1 if share > 0 else -1
    other, sign = (index + step, step) if 0 <= index + step < len(meshes) else (index - step, -step)
    there = _looked_up(meshes.frame(other), here.uv, where=f"frames {index} and {other}")
    return here.positions + share * sign * (there - here.positions)


def _looked_up(frame: Frame, uv: Tensor, *, where: str) -> Tensor:
    """Positions (point, 3) of texture places (point, 2) in a frame."""
    from matplotlib.tri import Triangulation

    own, faces = frame.uv.double().cpu().numpy(), frame.faces.cpu().numpy()
    points = uv.double().cpu().numpy().copy()
    finder = Triangulation(own[:, 0], own[:, 1], faces).get_trifinder()
    face = np.array(finder(points[:, 0], points[:, 1]))
    edge = face < 0
    points[edge] += _INWARD * (own.mean(axis=0) - points[edge])
    face[edge] = finder(points[edge, 0], points[edge, 1])
    if (face < 0).any():
        raise InputError(
            f"{int((face < 0).sum())} places of the cloth in one frame are in no face of the other", where=where,
            fix="give frames whose texture places cover the same cloth, or no exposure time",
        )  # fmt: skip
    a, b, c = (own[faces[face, k]] for k in range(3))
    weights = np.linalg.solve(np.stack([b - a, c - a], axis=2), (points - a)[:, :, None])[:, :, 0]
    weights = np.concatenate([1 - weights.sum(axis=1, keepdims=True), weights], axis=1)
    corners = frame.positions[frame.faces[torch.from_numpy(face).to(uv.device).long()]]
    return (corners * torch.from_numpy(weights).to(corners)[:, :, None]).sum(dim=1)
