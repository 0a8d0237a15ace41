"""Cloth whose triangles share no vertices: exact duplicates are merged, and what stays in pieces is
reported.

Exporters that give each triangle vertices of its own (split normals, STL, glTF) leave a cloth that
holds together only
by the eye: it has no inner edge and no hinge.
"""

from __future__ import annotations

from dataclasses import replace
from hashlib import blake2b

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from flagdata.core.arrays import IntArray
from flagdata.core.findings import Finding
from flagdata.lake.mesh_sequences import Mesh, MeshSequence, RaggedMeshSequence

_NEXT = 1e-2
"""Distance of two vertices at one place, in edge lengths; exporters keep four digits or more."""


def weld_vertices(
    sequence: MeshSequence | RaggedMeshSequence,
) -> tuple[MeshSequence | RaggedMeshSequence, tuple[Finding, ...]]:
    """Merges vertices whose material coordinates and whole trajectories agree to the bit.

    As it is, without a finding, where there are none; where merging leaves no surface (a face with
    one corner twice, an edge of more than two faces, as of cloth exported with a front and a back);
    and where the sequence's own scene names vertices by number. A sequence that is remeshed has no
    trajectories.
    """
    if isinstance(sequence, RaggedMeshSequence) or "scene" in sequence.attributes:
        return sequence, ()
    twin = _twins(sequence)
    faces = twin[sequence.faces]
    stays = twin == np.arange(len(twin))
    if stays.all() or not _is_surface(faces):
        return sequence, ()
    number = np.cumsum(stays) - 1
    merged = replace(
        sequence,
        positions=np.ascontiguousarray(sequence.positions[:, stays]),
        rest=sequence.rest[stays],
        faces=number[faces].astype(np.int32),
    )
    gone = int((~stays).sum())
    return merged, (
        Finding.of(
            "vertices-merged",
            f"{gone} of {len(stays)} vertices have the texture coordinates of another one and its "
            "place in every "
            f"frame, and were merged with it; the {int(stays.sum())} that stay are numbered anew, "
            "in their order",
            count=gone,
        ),
    )


def in_pieces(sequence: MeshSequence | RaggedMeshSequence) -> tuple[Finding, ...]:
    """Reports that the cloth is in several pieces in some frame, of the frame with most of them."""
    frames = range(1) if isinstance(sequence, MeshSequence) else range(len(sequence))
    pieces = [
        len(np.unique(_piece(sequence.frame(index))[sequence.frame(index).faces]))
        for index in frames
    ]
    worst = int(np.argmax(pieces))
    if pieces[worst] < 2:
        return ()
    mesh = sequence.frame(worst)
    touching, in_texture = _touching(mesh), _touching(mesh, texture=True)
    between = (
        f"; {touching} of its vertices lie where a vertex of another piece lies, {in_texture} of "
        "these with the same "
        "texture coordinates"
    )
    return (
        Finding.of(
            "cloth-in-pieces",
            f"the cloth is in {pieces[worst]} pieces that share no vertex"
            + (between if touching else ""),
            count=pieces[worst],
            where=f"frame {worst}",
            fix="merge vertices by distance before the export, or export one sheet",
        ),
    )


def slits(sequence: MeshSequence | RaggedMeshSequence) -> tuple[Finding, ...]:
    """Reports vertices of one piece that lie at or next to others that no edge joins them to, of
    the frame with most of
    them: a slit, or a seam that an exporter left open."""
    frames = range(1) if isinstance(sequence, MeshSequence) else range(len(sequence))
    open_vertices = [_unjoined_vertices(sequence.frame(index)) for index in frames]
    worst = max(frames, key=lambda index: len(open_vertices[index]))
    vertices = open_vertices[worst]
    if not len(vertices):
        return ()
    return (
        Finding.of(
            "cloth-slit",
            f"{len(vertices)} vertices lie within {100 * _NEXT:g} % of an edge's length of another "
            "one that they "
            f"are not joined to, in the material or in space (the first is vertex {vertices[0]}): "
            "the cloth has a slit "
            "there, or a seam that is not closed",
            count=len(vertices),
            where=f"frame {worst}",
            fix="if it is a seam, merge its vertices by distance before the export; a slit may "
            "stay",
        ),
    )


def _unjoined_vertices(mesh: Mesh) -> IntArray:
    """Vertices at open edges that lie next to another such one of their piece, without an edge
    between them."""
    edges = np.sort(
        np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]]),
        axis=1,
    )
    edges, counts = np.unique(edges, axis=0, return_counts=True)
    border = np.unique(edges[counts == 1]).astype(np.int64)
    if not len(border):
        return border
    piece, joined = _piece(mesh), {tuple(edge) for edge in edges.tolist()}
    vertices: set[int] = set()
    for points in (mesh.rest.astype(np.float64), mesh.positions.astype(np.float64)):
        lengths = np.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
        close = KDTree(points[border]).query_pairs(
            _NEXT * float(np.median(lengths)), output_type="ndarray"
        )
        pairs = np.sort(border[close].reshape(-1, 2), axis=1)
        pairs = pairs[piece[pairs[:, 0]] == piece[pairs[:, 1]]]
        vertices.update(
            vertex for pair in pairs.tolist() if tuple(pair) not in joined for vertex in pair
        )
    return np.array(sorted(vertices), dtype=np.int64)


def _piece(mesh: Mesh) -> IntArray:
    """Labels (vertex,) the connected piece of each vertex."""
    rows, columns = mesh.faces.ravel(), np.roll(mesh.faces, -1, axis=1).ravel()
    graph = coo_array(
        (np.ones(len(rows), dtype=bool), (rows, columns)), shape=(len(mesh.rest), len(mesh.rest))
    )
    return connected_components(graph, directed=False)[1].astype(np.int64)


def _touching(mesh: Mesh, *, texture: bool = False) -> int:
    """Counts vertices of faces that lie exactly at one of another piece in space, and in the
    texture as well if asked."""
    used = np.unique(mesh.faces)
    piece = _piece(mesh)[used]
    positions = np.concatenate([mesh.positions, mesh.rest], axis=1) if texture else mesh.positions
    group = np.unique(positions[used], axis=0, return_inverse=True)[1].ravel()
    group_and_piece = np.unique(np.stack([group, piece], axis=1), axis=0)
    return int((np.bincount(group_and_piece[:, 0])[group] > 1).sum())


def _twins(sequence: MeshSequence) -> IntArray:
    """Finds (vertex,) the first vertex of the faces that is the same throughout; a vertex by itself
    is its own."""
    twins = np.arange(len(sequence.rest))
    used = np.unique(sequence.faces)
    start = np.concatenate([sequence.rest, sequence.positions[0]], axis=1)[used]
    _, group, size = np.unique(start, axis=0, return_inverse=True, return_counts=True)
    group = group.ravel()
    first: dict[tuple[int, bytes], int] = {}
    for index in np.flatnonzero(size[group] > 1).tolist():
        # The sum makes zeros of both signs one.
        course = blake2b(
            (sequence.positions[:, used[index]] + np.float32(0)).tobytes(), digest_size=16
        ).digest()
        twins[used[index]] = first.setdefault((int(group[index]), course), int(used[index]))
    return twins


def _is_surface(faces: IntArray) -> bool:
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    _, counts = np.unique(edges, axis=0, return_counts=True)
    return bool((edges[:, 0] != edges[:, 1]).all() and counts.max() <= 2)
