"""Mesh sequences into the lake: by content, once, with the scene's wind; a folder that is refused
leaves no trace."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.core.schema import Kind
from flagdata.errors import InputError, UsageError
from flagdata.ingest import MeshIngest, ingest_meshes, read_folder, scene_wind
from flagdata.lake import Lake, MeshSequence, RaggedMeshSequence, read_meshes
from tests.program import Run, invoke


@pytest.fixture
def run(lake: Lake) -> Run:
    return lambda *arguments: invoke("ingest", *arguments, "--lake", lake.path)


def test_a_folder_becomes_one_artifact_once(lake: Lake, make_folder: Callable[..., Path]) -> None:
    folder = make_folder()
    first, again = ingest_meshes(lake, folder), ingest_meshes(lake, folder)
    assert (first.created, again.created) == (True, False)
    assert again.artifact.id == first.artifact.id
    artifact = first.artifact
    assert (artifact.kind, artifact.frame_count, artifact.rate, artifact.wind) == (
        Kind.MESHES,
        3,
        25.0,
        5.0,
    )
    assert json.loads(artifact.parameters or "") == {"wind_x": 3, "wind_y": 4, "wind_z": 0}
    sequence, expected = read_meshes(lake.object_path(artifact.object or "")), read_folder(folder)
    np.testing.assert_array_equal(sequence.positions, expected.positions)
    assert first.report["topology"] == "fixed"
    (folder / "0002_00.obj").unlink()
    assert ingest_meshes(lake, folder).created


def test_other_options_make_another_artifact(lake: Lake, make_folder: Callable[..., Path]) -> None:
    folder = make_folder()
    plain, fast = ingest_meshes(lake, folder), ingest_meshes(lake, folder, MeshIngest(rate=100.0))
    assert fast.artifact.id != plain.artifact.id
    assert fast.artifact.rate == pytest.approx(100.0)
    assert len(lake.rows()) == 2


def test_a_refused_folder_leaves_the_lake_as_it_was(
    lake: Lake, make_folder: Callable[..., Path]
) -> None:
    folder = make_folder()
    (folder / "0001_00.obj").write_text("v 0 0 nan\n")
    with pytest.raises(InputError, match="finite"):
        ingest_meshes(lake, folder)
    assert len(lake.rows()) == 0
    assert not list((lake.path / "zarr").glob("*"))


def test_impossible_options_are_refused() -> None:
    for rate in (0.0, -1.0, float("nan")):
        with pytest.raises(UsageError, match="rate"):
            MeshIngest(rate=rate)
    with pytest.raises(UsageError, match="no unit of length"):
        MeshIngest(unit="kn")


def test_a_scene_without_a_wind_has_none() -> None:
    cases = [
        None,
        {},
        {"wind": 3},
        {"wind": {}},
        {"wind": {"velocity": [1, 2]}},
        {"wind": {"velocity": [1, 2, "x"]}},
    ]
    assert [scene_wind(scene) for scene in cases] == [None for scene in cases]


def test_the_command_identifies_meshes_by_their_content(
    run: Run, make_folder: Callable[..., Path], lake: Lake
) -> None:
    folder = make_folder()
    code, out, _ = run(folder, "--name", "square", "--session", "s1")
    assert code == 0
    assert "3 at 25 Hz" in out
    assert "4 vertices, 2 faces, fixed topology" in out
    row = lake.rows().to_pylist()[0]
    assert (row["kind"], row["name"], row["session"]) == ("meshes", "square", "s1")
    assert "already in the lake" in run(folder)[1]
    code, out, _ = run(folder, "--rate", "50", "--json")
    result = json.loads(out)["results"][0]
    assert (code, result["kind"], result["report"]["rate"]) == (0, "meshes", 50.0)


@pytest.mark.parametrize(
    ("options", "word"),
    [
        (["--crop", "auto"], "--crop means nothing for a mesh sequence"),
        (
            ["--sensor", "generic-csv", "--as", "meshes"],
            "--sensor means nothing for a mesh sequence",
        ),
        (["--zone", "UTC"], "--zone means nothing for a mesh sequence"),
        (["--unit", "furlong"], "furlong"),
        (["--rate", "fast"], "--rate"),
    ],
)
def test_options_of_other_sources_are_refused(
    run: Run, make_folder: Callable[..., Path], options: list[str], word: str
) -> None:
    code, _, err = run(make_folder(), *options)
    assert code == 2
    assert word in err


def test_a_unit_means_nothing_for_a_log(run: Run, tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    log.write_text("time,speed\n2026-01-01T00:00:00Z,1.0\n")
    code, _, err = run(log, "--unit", "mm", "--sensor", "generic-csv")
    assert code == 2
    assert "'mm' is no unit of speed" in err


def test_mixed_units_are_reported_with_a_fix(run: Run, make_folder: Callable[..., Path]) -> None:
    text = "vt 0 0\nvt 1 0\nvt 0 1\nv 0 0 0\nv 0 1000 0\nv 0 0 1000\nf 1/1 2/2 3/3\n"
    folder = make_folder({"0000_00.obj": text, "0001_00.obj": text})
    code, _, err = run(folder)
    assert code == 1
    assert "mm and m mixed?" in err
    assert run(folder, "--unit", "mm")[0] == 0


@pytest.mark.reference
@pytest.mark.parametrize(
    ("name", "type_", "frames", "least", "most"),
    [
        ("raw_fixed_mesh", MeshSequence, 51, 117, 117),
        ("raw_remeshed", RaggedMeshSequence, 13, 72, 2261),
    ],
)
def test_arcsims_own_folders_are_ingested(
    run: Run,
    lake: Lake,
    reference_data: Path,
    name: str,
    type_: type,
    frames: int,
    least: int,
    most: int,
) -> None:
    folder = reference_data / "arcsim" / name
    assert run(folder)[0] == 0
    row = lake.rows().to_pylist()[0]
    report = json.loads(row["report"])
    # Counted in the files themselves: grep -c '^v ' NNNN_00.obj.
    counts = [
        sum(line.startswith("v ") for line in f.read_text().splitlines())
        for f in sorted(folder.glob("[0-9]*_00.obj"))
    ]
    assert (len(counts), min(counts), max(counts)) == (frames, least, most)
    assert report["vertices"] == [least, most]
    assert row["wind"] == json.loads((folder / "conf.json").read_text())["wind"]["velocity"][0]
    assert isinstance(read_meshes(lake.object_path(row["object"])), type_)
