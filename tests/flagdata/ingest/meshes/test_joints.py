"""T-joints: vertices on the edges of faces that do not have them as corners."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.core.arrays import FloatArray
from flagdata.ingest import findings
from flagdata.ingest.meshes.mesh_artifacts import t_joints
from flagdata.lake import MeshSequence

# A square metre of which the left half is one quad and the right half two, so that vertex 6 lies on
# the edge 1–2.
REST = np.array([[0, 0], [0.5, 0], [0.5, 1], [0, 1], [1, 0], [1, 1], [0.5, 0.5], [1, 0.5]])
JOINED = [[0, 1, 2], [0, 2, 3], [1, 4, 7], [1, 7, 6], [6, 7, 5], [6, 5, 2]]
SPLIT = [[0, 1, 6], [0, 6, 2], [0, 2, 3], *JOINED[2:]]


def sheet(faces: list[list[int]], positions: FloatArray) -> MeshSequence:
    return MeshSequence(
        time=np.array([0]),
        positions=positions[None].astype(np.float32),
        faces=np.array(faces, dtype=np.int32),
        rest=REST.astype(np.float32),
    )


def flat(turn: float = 0.0) -> FloatArray:
    """The square upright, turned about the vertical."""
    return np.stack([REST[:, 0] * np.cos(turn), REST[:, 0] * np.sin(turn), REST[:, 1]], axis=1)


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_a_vertex_on_an_edge_of_another_face_is_reported(turn: float) -> None:
    (finding,) = t_joints(sheet(JOINED, flat(turn)))
    assert (finding.kind, finding.count, finding.where) == ("t-joints", 1, "frame 0")
    assert "vertex 6" in finding.what
    assert "t-joints" in [one.kind for one in findings(sheet(JOINED, flat(turn)))]


def test_an_edge_that_was_split_on_both_sides_and_pieces_that_meet_in_the_texture_alone_are_none() -> (
    None
):
    assert t_joints(sheet(SPLIT, flat())) == ()
    apart = flat()
    apart[6, 1] += 0.2  # beside the edge in space, on it in the texture
    assert t_joints(sheet(JOINED, apart)) == ()
