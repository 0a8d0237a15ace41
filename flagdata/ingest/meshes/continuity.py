"""Whether frames are of one cloth in motion: vertices that change places, jumps, a topology that changes.

Programs that export each frame by itself may number vertices anew. Then one row of the positions is two points of the
cloth, and whatever is measured along time is of neither.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from flagdata.findings import Finding, Severity
from flagdata.lake.meshes import Mesh, MeshSequence, RaggedMeshSequence

_STRETCHED = 1.5
"""Length of an edge over that in the material beyond which it is no cloth's: knits tear at 1.3 to 1.5, and a vertex
that takes its neighbour's place doubles an edge."""
_SUDDEN = 10.0
"""Times the usual way between two frames beyond which a frame is elsewhere."""
_FAR = 0.2
"""The same, in sizes of the cloth."""


def continuity(sequence: MeshSequence | RaggedMeshSequence) -> tuple[Finding, ...]:
    """Return what speaks against one cloth in motion: `edges-stretched`, `cloth-jumps`, `topology-changes`."""
    return (*_stretched(sequence), *_jumps(sequence), *_changes(sequence))


def _stretched(sequence: MeshSequence | RaggedMeshSequence) -> Iterator[Finding]:
    counts = np.array([_long_edges(sequence.frame(index)) for index in range(len(sequence))])
    worst = int(counts.argmax())
    if not counts[worst]:
        return
    where = np.flatnonzero(counts)
    frames = f"frame {where[0]}" if len(where) == 1 else f"{len(where)} frames, the first frame {where[0]}"
    yield Finding(
        kind="edges-stretched",
        severity=Severity.WARNING,
        count=int(counts[worst]),
        where=f"frame {worst}",
        what=f"{counts[worst]} edges are more than {_STRETCHED:g} times as long as in the material ({frames}): "
        "vertices that change places, a tear, or texture coordinates that are not the cloth's own lengths",
        fix="export all frames with the vertices in one order, and texture coordinates in metres",
    )


def _long_edges(mesh: Mesh) -> int:
    edges = np.concatenate([mesh.faces[:, [0, 1]], mesh.faces[:, [1, 2]], mesh.faces[:, [2, 0]]])
    edges = np.unique(np.sort(edges, axis=1), axis=0)
    space, rest = (
        np.linalg.norm(np.diff(points[edges].astype(np.float64), axis=1)[:, 0], axis=1)
        for points in (mesh.positions, mesh.rest)
    )
    return int((space > _STRETCHED * rest)[rest > 0].sum())


def _jumps(sequence: MeshSequence | RaggedMeshSequence) -> Iterator[Finding]:
    if isinstance(sequence, RaggedMeshSequence) or len(sequence) < 4:
        return
    used = np.unique(sequence.faces)
    places = sequence.positions[:, used].astype(np.float64)
    ways = np.median(np.linalg.norm(np.diff(places, axis=0), axis=2), axis=1)
    size = float(np.linalg.norm(np.ptp(sequence.rest[used].astype(np.float64), axis=0)))
    usual = float(np.median(ways))
    sudden: NDArray[np.int64] = np.flatnonzero((ways > _SUDDEN * usual) & (ways > _FAR * size))
    if len(sudden):
        first = int(sudden[0])
        yield Finding(
            kind="cloth-jumps",
            severity=Severity.WARNING,
            count=len(sudden),
            where=f"frame {first + 1}",
            value=float(ways[first]),
            what=f"half of the vertices move {ways[first]:.3g} m or more from frame {first} to frame {first + 1}, and "
            f"{usual:.2g} m between others: vertices that are numbered anew, or frames of another run",
            fix="export all frames of one run, with the vertices in one order",
        )


def _changes(sequence: MeshSequence | RaggedMeshSequence) -> Iterator[Finding]:
    if isinstance(sequence, MeshSequence):
        return
    vertices, faces = np.diff(sequence.vertex_offset), np.diff(sequence.face_offset)
    frames = [sequence.frame(index) for index in range(len(sequence))]
    other = [
        index
        for index in range(1, len(frames))
        if not (
            np.array_equal(frames[index].faces, frames[index - 1].faces)
            and np.array_equal(frames[index].rest, frames[index - 1].rest)
        )
    ]
    yield Finding(
        kind="topology-changes",
        severity=Severity.NOTE,
        count=len(other),
        where=f"frame {other[0]}",
        what=f"the mesh changes at {len(other)} of {len(frames) - 1} frames: {vertices.min()} to {vertices.max()} "
        f"vertices, {faces.min()} to {faces.max()} faces",
        fix="none needed, if the simulator remeshes; else export all frames with one mesh",
    )
