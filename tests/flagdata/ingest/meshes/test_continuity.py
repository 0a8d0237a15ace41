"""Frames that are not of one cloth in motion are reported: vertices that change places, jumps,
other meshes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flagdata.core.arrays import IntArray
from flagdata.errors import InputError
from flagdata.ingest import Obj, findings, frame_files, obj_text, read_folder
from flagdata.ingest.meshes.mesh_artifacts import continuity
from flagdata.lake import MeshSequence, RaggedMeshSequence

N = 6
FRAMES = 8


def sheet(*, uneven: bool = False) -> MeshSequence:
    """A sheet of 1 m that waves; on request with places that are off by up to a fifth of a cell."""
    u, v = (a.ravel() / N for a in np.meshgrid(np.arange(N + 1), np.arange(N + 1), indexing="ij"))
    if uneven:
        rng = np.random.default_rng(1)
        u, v = (a + rng.uniform(-0.2, 0.2, a.shape) / N for a in (u, v))
    corner = [i * (N + 1) + j for i in range(N) for j in range(N)]
    faces = [f for c in corner for f in ((c, c + N + 1, c + N + 2), (c, c + N + 2, c + 1))]
    positions = [np.stack([u, v, 0.05 * np.sin(6 * u + k / 3)], axis=1) for k in range(FRAMES)]
    return MeshSequence(
        time=np.arange(FRAMES, dtype=np.int64) * 40_000_000,
        positions=np.array(positions, dtype=np.float32),
        faces=np.array(faces, dtype=np.int32),
        rest=np.stack([u, v], axis=1).astype(np.float32),
    )


def kinds(sequence: MeshSequence | RaggedMeshSequence) -> set[str]:
    return {finding.kind for finding in findings(sequence)}


def renumbered(whole: MeshSequence, frame: int, order: IntArray) -> MeshSequence:
    positions = whole.positions.copy()
    positions[frame] = positions[frame][order]
    return replace(whole, positions=positions)


@pytest.mark.parametrize("uneven", [False, True])
def test_a_cloth_in_motion_has_no_finding(uneven: bool) -> None:
    assert kinds(sheet(uneven=uneven)) == set()


@pytest.mark.parametrize("pair", [(0, 1), (N + 1, N + 2), (24, 25), (5, 40), (0, (N + 1) ** 2 - 1)])
@pytest.mark.parametrize("uneven", [False, True])
def test_two_vertices_that_change_places_in_one_frame_are_reported(
    pair: tuple[int, int], uneven: bool
) -> None:
    order = np.arange((N + 1) ** 2)
    order[list(pair)] = order[list(pair)[::-1]]
    (found,) = continuity(renumbered(sheet(uneven=uneven), 3, order))
    assert (found.kind, found.where) == ("edges-stretched", "frame 3")


def test_vertices_that_are_numbered_from_the_other_corner_are_reported() -> None:
    # Every edge keeps its length: the sheet is the same, turned by half a turn.
    whole = renumbered(sheet(), 3, np.arange((N + 1) ** 2)[::-1])
    (found,) = continuity(whole)
    assert (found.kind, found.where, found.count) == ("cloth-jumps", "frame 3", 2)  # there and back
    turned = sheet().positions[:, ::-1]
    for_good = replace(whole, positions=np.concatenate([sheet().positions[:3], turned[3:]]))
    (found,) = continuity(for_good)
    assert (found.kind, found.where, found.count) == ("cloth-jumps", "frame 3", 1)


def test_a_cloth_that_starts_to_move_does_not_jump() -> None:
    whole = sheet()
    moved = np.where(
        np.arange(FRAMES)[:, None, None] < 4, 0.0, 0.02 * (np.arange(FRAMES) - 3)[:, None, None]
    )
    assert (
        continuity(replace(whole, positions=(whole.positions[:1] + moved).astype(np.float32))) == ()
    )


def frames(folder: Path, meshes: list[Obj], names: str = "s_{:03d}.obj") -> Path:
    folder.mkdir()
    for number, mesh in enumerate(meshes):
        (folder / names.format(number)).write_text(obj_text(mesh))
    return folder


def objects(whole: MeshSequence) -> list[Obj]:
    return [
        Obj(
            positions=p.astype(float),
            faces=whole.faces.astype(np.int64),
            rest=whole.rest.astype(float),
        )
        for p in whole.positions
    ]


def test_faces_that_are_wound_the_other_way_in_one_frame_are_reported(tmp_path: Path) -> None:
    meshes = objects(sheet())
    meshes[3] = replace(meshes[3], faces=meshes[3].faces[:, ::-1])
    found = {
        one.kind: one for one in findings(read_folder(frames(tmp_path / "flip", meshes), rate=25))
    }
    assert set(found) == {"faces-turned-over", "topology-changes"}
    assert found["faces-turned-over"].where == "frame 3"
    assert found["faces-turned-over"].count == 2 * N * N


def test_the_same_faces_in_another_order_are_the_same_mesh(tmp_path: Path) -> None:
    meshes = objects(sheet())
    rng = np.random.default_rng(2)
    meshes[3] = replace(meshes[3], faces=np.roll(rng.permutation(meshes[3].faces), 1, axis=1))
    sequence = read_folder(frames(tmp_path / "order", meshes), rate=25)
    assert isinstance(sequence, MeshSequence)
    np.testing.assert_allclose(sequence.positions, sheet().positions, atol=1e-6)
    assert findings(sequence) == ()


def test_a_mesh_that_changes_is_noted_with_its_counts(tmp_path: Path) -> None:
    meshes = objects(sheet())
    more = replace(
        meshes[3],
        positions=np.r_[meshes[3].positions, [[1.15, 1.0, 0.0]]],
        rest=np.r_[meshes[3].rest, [[1.15, 1.0]]],
        faces=np.r_[meshes[3].faces, [[(N + 1) ** 2 - 2, (N + 1) ** 2, (N + 1) ** 2 - 1]]],
    )
    found = findings(
        read_folder(frames(tmp_path / "more", [*meshes[:3], more, *meshes[4:]]), rate=25)
    )
    note = next(one for one in found if one.kind == "topology-changes")
    assert (note.count, note.where) == (2, "frame 3")
    assert f"{(N + 1) ** 2} to {(N + 1) ** 2 + 1} vertices" in note.what


@pytest.mark.parametrize(
    "names", ["flag_{}_high.obj", "{:04d}.obj", "take2_flag{}.obj", "v{:02d}-3.OBJ", "a (1) {}.obj"]
)
def test_one_number_that_varies_counts_the_frames_wherever_it_stands(
    tmp_path: Path, names: str
) -> None:
    found = frame_files(frames(tmp_path / "run", objects(sheet()) + objects(sheet()), names))
    assert [number for number, _ in found] == list(range(2 * FRAMES))
    assert [path.name for _, path in found] == [names.format(k) for k in range(2 * FRAMES)]


def test_names_in_which_several_numbers_vary_are_refused(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    folder.mkdir()
    for a in range(2):
        for b in range(2):
            (folder / f"cloth{a}_frame{b}.obj").write_text(obj_text(objects(sheet())[0]))
    with pytest.raises(InputError, match="2 numbers vary in the names"):
        frame_files(folder)
