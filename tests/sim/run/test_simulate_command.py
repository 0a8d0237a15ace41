"""`flagdata simulate`: results on stdout, the rest on stderr, exit codes; ArcSim scenes run with
ArcSim's own steps."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from flagdata.ingest import read_folder
from flagdata.lake import Lake, MeshSequence, read_meshes
from tests.program import Run, invoke
from tests.sim.run.conftest import small


@pytest.fixture
def run(tmp_path: Path) -> Run:
    Lake.create(tmp_path / "lake")

    return lambda *arguments: invoke("simulate", *arguments, "--lake", tmp_path / "lake")


def test_artifacts_are_printed_one_a_line(run: Run, tmp_path: Path) -> None:
    recipe = tmp_path / "small.toml"
    recipe.write_text(small())
    code, out, err = run(recipe, "--count", "3", "--batch", "2")
    assert code == 0
    assert len(out.split()) == 3
    assert "3 simulated" in err
    assert "flags/s" in err
    code, out, err = run(recipe, "--count", "3", "--json")
    result = json.loads(out)
    assert (code, result["schema"], result["added"], len(result["existing"])) == (
        0,
        "flagdata.simulate/1",
        [],
        3,
    )


def test_the_airs_inertia_acts_where_a_recipe_names_it(run: Run, tmp_path: Path) -> None:
    moved: list[np.ndarray] = []
    for share in ("0.0", "0.2"):
        recipe = tmp_path / f"share-{share}.toml"
        recipe.write_text(small(more=f"[effects.finite-span-loading]\nshare = {share}"))
        assert run(recipe, "--count", "1")[0] == 0
        (row,) = [
            row
            for row in Lake.open(tmp_path / "lake").rows().to_pylist()
            if json.loads(row["parameters"])["finite-span-loading.share"] == float(share)
        ]
        sequence = read_meshes(Lake.open(tmp_path / "lake").object_path(row["object"]))
        assert isinstance(sequence, MeshSequence)
        moved.append(np.asarray(sequence.positions[-1] - sequence.positions[0], dtype=np.float64))
    # Air that has to be moved with the cloth: it falls and swings less far in its first tenths of a
    # second.
    assert np.abs(moved[1]).max() < 0.95 * np.abs(moved[0]).max()


def test_a_failed_member_makes_the_command_fail_and_is_named(run: Run, tmp_path: Path) -> None:
    recipe = tmp_path / "undamped.toml"
    text = small(material="damping = 0.0").replace("settle = 0.1", "settle = 2.4")
    recipe.write_text(
        text.replace("low = 0.0, high = 10.0", "low = 6.0, high = 10.0").replace(
            "columns = 6", "columns = 12"
        )
    )
    code, out, err = run(recipe, "--count", "1", "--batch", "1")
    assert (code, out) == (1, "")
    assert "member 0 is not stored: crumpled" in err


@pytest.mark.parametrize(
    ("arguments", "code", "word"),
    [
        (["hanging-cloht"], 2, "did you mean 'hanging-cloth'"),
        (["nowhere.toml"], 1, "no such recipe file"),
        (["nowhere.json"], 1, "no such file"),
        (["hanging-cloth", "--device", "cuda:97"], 2, "is not there"),
        (["hanging-cloth", "--branch", "trail"], 1, "trail"),
    ],
)
def test_what_cannot_be_done_is_an_error(
    run: Run, arguments: list[str], code: int, word: str
) -> None:
    assert run(*arguments)[0] == code
    assert word in run(*arguments)[2]


@pytest.mark.reference
def test_an_arcsim_scene_becomes_arcsims_own_output(
    run: Run, tmp_path: Path, reference_data: Path
) -> None:
    # The folder's scene, its mesh and its material, put together as its user had them. Positions
    # are written with six digits; a chaotic sheet makes more of that from frame to frame: observed
    # 1 µm at first, 8 µm after 1 s and 0.4 mm after 2 s (mean over the vertices, which move by a
    # metre), allowed ten times as much.
    folder = reference_data / "arcsim" / "raw_fixed_mesh"
    (tmp_path / "materials").mkdir()
    shutil.copy(folder / "grid12x8.obj", tmp_path)
    shutil.copy(folder / "conf.json", tmp_path / "scene.json")
    shutil.copy(reference_data / "materials" / "camel-ponte-roma.json", tmp_path / "materials")
    code, out, _ = run(tmp_path / "scene.json", "--json")
    assert code == 0
    lake = Lake.open(tmp_path / "lake")
    sequence = read_meshes(
        lake.object_path(lake.artifact(json.loads(out)["added"][0]).object or "")
    )
    expected = read_folder(folder)
    assert isinstance(sequence, MeshSequence)
    assert isinstance(expected, MeshSequence)
    np.testing.assert_array_equal(sequence.faces, expected.faces)
    np.testing.assert_array_equal(sequence.time, expected.time)
    distance = np.linalg.norm(sequence.positions - expected.positions, axis=2).mean(axis=1)
    assert distance[:6].max() < 1e-5
    assert distance[:26].max() < 1e-4
    assert distance.max() < 5e-3
