"""Cloth whose triangles share no vertices is put together where that is exact, and reported where
it is not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from flagdata.core.arrays import Float32Array
from flagdata.ingest import MeshIngest, ingest_meshes
from flagdata.ingest.meshes.pieces import in_pieces, slits, weld_vertices
from flagdata.lake import Lake, MeshSequence, RaggedMeshSequence, read_meshes

N = 4
FRAMES = 3


def sheet() -> MeshSequence:
    """A sheet of 1 m, N × N squares of two triangles each, that waves."""
    u, v = (a.ravel() / N for a in np.meshgrid(np.arange(N + 1), np.arange(N + 1), indexing="ij"))
    corner = [i * (N + 1) + j for i in range(N) for j in range(N)]
    faces = [f for c in corner for f in ((c, c + N + 1, c + N + 2), (c, c + N + 2, c + 1))]
    positions = [np.stack([u, v, 0.05 * np.sin(6 * u + k)], axis=1) for k in range(FRAMES)]
    return MeshSequence(
        time=np.arange(FRAMES, dtype=np.int64),
        positions=np.array(positions, dtype=np.float32),
        faces=np.array(faces, dtype=np.int32),
        rest=np.stack([u, v], axis=1).astype(np.float32),
    )


def soup(whole: MeshSequence, **changes: object) -> MeshSequence:
    """The same surface with vertices of its own for each triangle."""
    corners = whole.faces.ravel()
    parts = {
        "time": whole.time,
        "positions": whole.positions[:, corners],
        "rest": whole.rest[corners],
        "faces": np.arange(len(corners), dtype=np.int32).reshape(-1, 3),
        "attributes": {},
    }
    return MeshSequence(**(parts | changes))  # type: ignore[arg-type]


def surface(sequence: MeshSequence) -> Float32Array:
    """(face, corner, frame, xyz) of all faces, in their order."""
    return sequence.positions[:, sequence.faces].transpose(1, 2, 0, 3)


def test_exact_duplicates_are_merged_and_the_surface_stays_what_it_was() -> None:
    whole, loose = sheet(), soup(sheet())
    merged, (finding,) = weld_vertices(loose)
    assert isinstance(merged, MeshSequence)
    assert len(merged.rest) == (N + 1) ** 2
    np.testing.assert_array_equal(surface(merged), surface(whole))
    np.testing.assert_array_equal(merged.rest[merged.faces], whole.rest[whole.faces])
    assert (finding.kind, finding.count) == ("vertices-merged", 6 * N * N - (N + 1) ** 2)
    assert in_pieces(merged) == ()
    assert weld_vertices(whole) == (whole, ())


def test_vertices_that_part_in_one_frame_stay_apart_and_are_reported() -> None:
    loose = soup(sheet())
    positions = loose.positions.copy()
    positions[2] += np.arange(positions.shape[1], dtype=np.float32)[:, None] * 1e-6
    torn = soup(sheet(), positions=positions)
    assert weld_vertices(torn) == (torn, ())
    (finding,) = in_pieces(torn)
    assert (finding.kind, finding.count, finding.where) == ("cloth-in-pieces", 2 * N * N, "frame 0")
    # All but the corners (1, 0) and (0, 1), which one triangle has alone.
    touching = 6 * N * N - 2
    assert f"in {2 * N * N} pieces" in finding.what
    assert f"{touching} of its vertices lie where" in finding.what
    assert f"{touching} of these with the same texture" in finding.what


def test_a_seam_with_two_textures_stays_unlike_duplicates() -> None:
    # Two panels that meet at x = 0.5: alike in space along N + 1 vertices each, apart in the
    # texture.
    whole = sheet()
    right = (whole.rest[whole.faces, 0].mean(axis=1) > 0.5)[:, None]
    faces = np.where(right, whole.faces + len(whole.rest), whole.faces).astype(np.int32)
    rest = np.concatenate([whole.rest, whole.rest + np.float32(2)])
    panels = MeshSequence(
        time=whole.time,
        positions=np.concatenate([whole.positions] * 2, axis=1),
        faces=faces,
        rest=rest,
    )
    assert weld_vertices(panels) == (panels, ())
    (finding,) = in_pieces(panels)
    assert finding.count == 2
    assert (
        f"{2 * (N + 1)} of its vertices lie where a vertex of another piece lies, 0 of these"
        in finding.what
    )


@pytest.mark.parametrize(
    "faces",
    [
        # A front and a back, each with vertices of its own.
        lambda faces: np.concatenate([faces, faces[:, ::-1]]),
        # A face whose corners are one vertex, twice.
        lambda faces: np.concatenate([faces, faces[:1, [0, 1, 1]]]),
    ],
)
def test_what_would_leave_no_surface_is_not_merged(
    faces: Callable[[NDArray[np.int32]], NDArray[np.int32]],
) -> None:
    whole = sheet()
    odd = soup(
        MeshSequence(
            time=whole.time, positions=whole.positions, rest=whole.rest, faces=faces(whole.faces)
        )
    )
    assert weld_vertices(odd) == (odd, ())
    assert in_pieces(odd)[0].count == len(odd.faces)


def test_a_scene_that_numbers_vertices_keeps_its_numbers() -> None:
    loose = soup(sheet(), attributes={"scene": {"handles": [{"nodes": [0]}]}})
    assert weld_vertices(loose) == (loose, ())


def test_pieces_of_a_remeshed_cloth_are_those_of_its_worst_frame() -> None:
    whole, loose = sheet(), soup(sheet())
    parts = [whole.frame(0), loose.frame(1), whole.frame(2)]
    ragged = RaggedMeshSequence(
        time=whole.time,
        positions=np.concatenate([p.positions for p in parts]),
        faces=np.concatenate([p.faces for p in parts]),
        rest=np.concatenate([p.rest for p in parts]),
        vertex_offset=np.cumsum([0, *(len(p.rest) for p in parts)]),
        face_offset=np.cumsum([0, *(len(p.faces) for p in parts)]),
    )
    assert weld_vertices(ragged) == (ragged, ())
    (finding,) = in_pieces(ragged)
    assert (finding.count, finding.where) == (2 * N * N, "frame 1")


def _folder(folder: Path, sequence: MeshSequence) -> Path:
    folder.mkdir()
    for k, frame in enumerate(sequence.positions):
        lines = [f"v {x} {y} {z}" for x, y, z in frame] + [f"vt {x} {y}" for x, y in sequence.rest]
        lines += [f"f {a}/{a} {b}/{b} {c}/{c}" for a, b, c in sequence.faces + 1]
        (folder / f"s_{k:03}.obj").write_text("\n".join(lines) + "\n")
    return folder


def test_both_reach_the_report_and_pieces_the_quality_of_the_artifact(tmp_path: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    done = ingest_meshes(lake, _folder(tmp_path / "soup", soup(sheet())), MeshIngest(rate=25.0))
    assert [f["kind"] for f in done.report["findings"]] == ["vertices-merged"]
    assert done.report["vertices"] == [(N + 1) ** 2] * 2
    stored = read_meshes(lake.object_path(str(done.artifact.object)))
    assert stored.frame(0).rest.shape == ((N + 1) ** 2, 2)
    # Every triangle lies elsewhere in the texture.
    rest = soup(sheet()).rest + np.repeat(np.arange(2 * N * N), 3)[:, None].astype(
        np.float32
    ) * np.float32(0.01)
    split = ingest_meshes(
        lake, _folder(tmp_path / "split", soup(sheet(), rest=rest)), MeshIngest(rate=25.0)
    )
    assert [f["kind"] for f in split.report["findings"]] == ["cloth-in-pieces"]
    assert list(split.artifact.quality) == ["cloth-in-pieces"]


def parted(
    *, below: int, apart: float = 0.0, texture: float = 0.0, opens: float = 0.0
) -> MeshSequence:
    """The sheet with a row of vertices twice, up to a place: a slit from the border, or a seam
    across the sheet.

    Args:
        below: how many vertices are there twice; fewer than all of the row make a slit.
        apart: their distance in space [m], in all frames.
        texture: the same in the material.
        opens: by how much more in each frame.
    """
    whole = sheet()
    middle = N // 2
    row = middle * (N + 1) + np.arange(below)
    second = len(whole.rest) + np.arange(below)
    faces = whole.faces.copy()
    beyond = (whole.rest[faces].mean(axis=1)[:, 0] > middle / N)[:, None]
    for old, new in zip(row, second, strict=True):
        faces[beyond & (faces == old)] = new
    moved = whole.positions[:, row].copy()
    moved[..., 0] += apart + opens * np.arange(FRAMES)[:, None]
    rest = whole.rest[row] + np.array([texture, 0.0], dtype=np.float32)
    return MeshSequence(
        time=whole.time,
        positions=np.concatenate([whole.positions, moved], axis=1),
        faces=faces,
        rest=np.concatenate([whole.rest, rest]),
    )


@pytest.mark.parametrize(
    "change", [{"apart": 1e-5}, {"texture": 1e-4}, {"opens": 0.02}, {"apart": 1e-3, "texture": 0.1}]
)
def test_a_slit_whose_sides_are_next_to_each_other_is_reported(change: dict[str, float]) -> None:
    joined, merged = weld_vertices(parted(below=N - 1, **change))
    assert merged == ()
    (found,) = slits(joined)
    assert (found.kind, found.count) == ("cloth-slit", 2 * (N - 1))


def test_what_is_merged_or_apart_is_no_slit() -> None:
    assert slits(sheet()) == ()
    joined, _ = weld_vertices(parted(below=N - 1))
    assert slits(joined) == ()
    gaping = parted(below=N - 1, apart=0.05, texture=0.05)
    assert slits(gaping) == ()


def test_a_cloth_that_touches_itself_in_a_fold_has_no_slit() -> None:
    # Folded once, the halves a twentieth of an edge apart, as contact holds them.
    whole = sheet()
    folded = whole.positions.copy()
    folded[..., 2] = 0.0
    over = whole.rest[:, 0] > 0.5
    folded[:, over, 0] = 1.0 - folded[:, over, 0]
    folded[:, over, 2] += 0.05 / N
    assert slits(replace(whole, positions=folded)) == ()
