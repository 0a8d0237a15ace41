"""Simple things to look at, and pictures that a test names itself."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
import torch

from flagdata.core.arrays import FloatArray, IntArray, UInt8Array
from sim.assets import Assets
from sim.render import Meshes

Piece = tuple[FloatArray, IntArray, FloatArray]
"""Positions (vertex, 3), faces (face, 3), texture places (vertex, 2)."""
BLACK, WHITE = (0, 0, 0), (255, 255, 255)


def plain(colour: tuple[int, int, int], *, rows: int = 8, columns: int = 8) -> UInt8Array:
    """A picture of one colour."""
    return np.full((rows, columns, 3), colour, dtype=np.uint8)


@dataclass(frozen=True, kw_only=True)
class Given(Assets):
    """Pictures that a test names itself."""

    pictures: Mapping[str, UInt8Array] = field(default_factory=dict)

    def texture(self, name: str) -> UInt8Array:
        return self.pictures[name]

    def background(self, name: str) -> UInt8Array:
        return self.pictures[name]


def sheet(
    *,
    side: float = 1.0,
    middle: tuple[float, float, float] = (0.0, 0.0, 0.0),
    cells: int = 1,
    turn: float = 0.0,
) -> Piece:
    """A flat upright square whose front faces −y, turned about the vertical: positions, faces,
    texture places."""
    n = cells + 1
    u, v = (
        index.ravel() / cells for index in np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    )
    across = (u - 0.5) * side
    position = np.stack(
        [across * math.cos(turn), across * math.sin(turn), (v - 0.5) * side], axis=1
    )
    i, j = (
        index.ravel() for index in np.meshgrid(np.arange(cells), np.arange(cells), indexing="ij")
    )
    a = i * n + j
    faces = np.concatenate(
        [np.stack([a, a + n, a + n + 1], axis=1), np.stack([a, a + n + 1, a + 1], axis=1)]
    )
    return position + np.array(middle), faces, np.stack([u, v], axis=1)


def together(*parts: Piece) -> Piece:
    """Several pieces as one mesh."""
    starts = np.cumsum([0, *(len(part[0]) for part in parts)])
    faces = [part[1] + start for part, start in zip(parts, starts[:-1], strict=True)]
    return (
        np.concatenate([part[0] for part in parts]),
        np.concatenate(faces),
        np.concatenate([p[2] for p in parts]),
    )


def meshes(
    part: Piece,
    *,
    moves: FloatArray | None = None,
    rate: float = 25.0,
) -> Meshes:
    """A mesh that stands still for a frame, or is moved by (frame, 3); the anchor is the origin."""
    position, faces, uv = part
    moves = np.zeros((1, 3)) if moves is None else moves
    return Meshes.fixed(
        positions=torch.from_numpy(position + moves[:, None]).float(),
        faces=torch.from_numpy(faces),
        uv=torch.from_numpy(uv),
        anchor=(0.0, 0.0, 0.0),
        rate=rate,
    )


def linear(image: torch.Tensor) -> FloatArray:
    """(…, 3) bytes as linear values, by the formula of IEC 61966-2-1."""
    code = image.cpu().numpy() / 255
    return np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)
