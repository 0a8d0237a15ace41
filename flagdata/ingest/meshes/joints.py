"""T-joints: a vertex on an edge of a face that does not have it as a corner.

Where one side of a line was subdivided and the other was not, the cloth looks whole and is open: the two sides share no
edge, so that no force crosses it and it opens as soon as it is simulated.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from flagdata.findings import Finding, Severity
from flagdata.lake.meshes import Mesh, MeshSequence, RaggedMeshSequence

_ON_THE_LINE = 1e-3  # distance from the edge in the material, in edge lengths; exporters keep four digits or more
_NEAR = 0.1  # the same in space, along the edge too: cloth stretches, and bends away from an edge's middle
_WITHIN = 1e-2  # from an edge's ends, in edge lengths


def t_joints(sequence: MeshSequence | RaggedMeshSequence) -> tuple[Finding, ...]:
    """A finding where vertices lie on open edges of other faces, of the frame with most of them."""
    frames = range(1) if isinstance(sequence, MeshSequence) else range(len(sequence))
    joints = [_joints(sequence.frame(index)) for index in frames]
    worst = max(frames, key=lambda index: len(joints[index]), default=0)
    if not joints or not len(joints[worst]):
        return ()
    first = int(joints[worst][0])
    return (
        Finding(
            kind="t-joints",
            severity=Severity.WARNING,
            count=len(joints[worst]),
            where=f"frame {worst}",
            what=f"{len(joints[worst])} vertices lie on an edge of a face that they are no corner of (the first is "
            f"vertex {first}): the cloth is open there",
            fix="split those faces at the vertex, or subdivide both sides alike, and export it anew",
        ),
    )


def _joints(mesh: Mesh) -> NDArray[np.int64]:
    """Numbers of the vertices on the inside of an edge that only one face has, in the material and in space."""
    edges = np.sort(np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]]), axis=1)
    edges, counts = np.unique(edges, axis=0, return_counts=True)
    border = edges[counts == 1]
    corners = np.unique(border).astype(np.int64)
    if not len(corners):
        return corners
    rest, space = mesh.rest.astype(np.float64), mesh.positions.astype(np.float64)
    ends = rest[border]
    half = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / 2
    beside = KDTree(rest[corners]).query_ball_point(ends.mean(axis=1), half)
    number = np.repeat(np.arange(len(border)), [len(found) for found in beside])
    vertex = corners[np.concatenate([np.asarray(found, dtype=np.int64) for found in beside])]
    first, last = border[number].astype(np.int64).T
    along, off = _beside(rest, vertex, first, last)
    along_in_space, off_in_space = _beside(space, vertex, first, last)
    inside = (off < _ON_THE_LINE) & (off_in_space < _NEAR) & (np.abs(along_in_space - along) < _NEAR)
    for share in (along, along_in_space):
        inside &= (share > _WITHIN) & (share < 1 - _WITHIN)
    return np.unique(vertex[inside])


def _beside(
    place: NDArray[np.float64], vertex: NDArray[np.int64], first: NDArray[np.int64], last: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Where vertices lie along edges, 0 at the first end and 1 at the last, and how far beside, in edge lengths."""
    edge, arm = place[last] - place[first], place[vertex] - place[first]
    square = np.maximum((edge**2).sum(axis=1), np.finfo(np.float64).tiny)
    along = (edge * arm).sum(axis=1) / square
    return along, np.linalg.norm(arm - along[:, None] * edge, axis=1) / np.sqrt(square)
