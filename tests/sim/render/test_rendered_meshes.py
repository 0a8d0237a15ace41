"""Meshes: what is taken from stored sequences, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from flagdata.errors import InputError
from flagdata.lake import MeshSequence, RaggedMeshSequence
from sim.render import Meshes
from tests.refusals import unrefused
from tests.sim.render.pieces import meshes, sheet

STEP = 20_000_000  # ns


def stored(frames: int = 3) -> MeshSequence:
    """A 3 × 2 m sheet of nine vertices, hoist at y = 5, rising 0.1 m a frame."""
    _, faces, uv = sheet(cells=2)
    rest = uv * [3.0, 2.0] + [10.0, -4.0]
    flat = np.stack([np.zeros(9), 5 + uv[:, 0] * 3, 1 + uv[:, 1] * 2], axis=1)
    rising = flat + np.arange(frames)[:, None, None] * [0.0, 0.0, 0.1]
    return MeshSequence(
        time=np.arange(frames, dtype=np.int64) * STEP,
        positions=rising.astype(np.float32),
        faces=faces.astype(np.int32),
        rest=rest.astype(np.float32),
    )


def test_a_flag_is_anchored_at_its_upper_hoist_corner() -> None:
    flag = Meshes.flag(stored(), heading=0.4)
    assert flag.anchor == pytest.approx((0.0, 5.0, 3.0))
    assert (flag.heading, flag.rate, len(flag)) == (0.4, 50.0, 3)
    assert flag.frame(0).uv.tolist() == [[u, v] for u in (0.0, 0.5, 1.0) for v in (0.0, 0.5, 1.0)]
    assert flag.frame(-1).positions[0].tolist() == pytest.approx([0.0, 5.0, 1.2])


def test_hanging_cloth_is_anchored_at_the_middle_of_its_upper_edge() -> None:
    assert Meshes.hanging(stored()).anchor == pytest.approx((0.0, 6.5, 3.0))


def test_a_ragged_sequence_keeps_its_frames() -> None:
    one = stored()
    ragged = RaggedMeshSequence(
        time=one.time,
        positions=one.positions.reshape(-1, 3),
        faces=np.tile(one.faces, (3, 1)),
        rest=np.tile(one.rest, (3, 1)),
        vertex_offset=np.arange(4) * 9,
        face_offset=np.arange(4) * 8,
    )
    a, b = Meshes.flag(ragged, heading=0.0), Meshes.flag(one, heading=0.0)
    assert a.one_topology
    assert a.vertex_offset == b.vertex_offset
    assert torch.equal(a.positions, b.positions)
    assert torch.equal(a.faces, b.faces)


def test_a_part_of_a_sequence_has_its_frames() -> None:
    whole = Meshes.flag(stored(5), heading=0.3)
    part = whole.part(1, 4)
    assert len(part) == 3
    for index in range(3):
        assert torch.equal(part.frame(index).positions, whole.frame(index + 1).positions)
        assert torch.equal(part.frame(index).faces, whole.frame(index + 1).faces)
    assert (part.anchor, part.heading, part.rate) == (whole.anchor, whole.heading, whole.rate)


def test_a_single_frame_has_a_rate_too() -> None:
    assert Meshes.flag(stored(1), heading=0.0).rate == 25.0


def test_what_is_no_mesh_sequence_is_refused() -> None:
    cases = [
        ("positions", torch.zeros(4, 2), "positions have shape"),
        ("positions", torch.zeros(4, 3, dtype=torch.float64), "float64"),
        ("positions", torch.full((4, 3), torch.nan), "not finite"),
        (
            "faces",
            torch.tensor([[0, 1, 4], [0, 1, 2]]),
            "faces of frame 0 name vertices outside 0 to 3",
        ),
        ("faces", torch.tensor([[0, 1, -1], [0, 1, 2]]), "outside"),
        ("uv", torch.zeros(3, 2), "3 texture places for 4 vertices"),
        ("vertex_offset", (0, 3), "vertex_offset does not fit"),
        ("face_offset", (0, 1, 2), "different numbers of frames"),
        ("face_offset", (0,), "face_offset does not fit"),
        ("rate", 0.0, "rate"),
        ("heading", float("nan"), "heading"),
    ]
    good = meshes(sheet())
    given = {field: getattr(good, field) for field in good.__dataclass_fields__}
    assert not unrefused(lambda name, value: Meshes(**{**given, name: value}), cases, InputError)
