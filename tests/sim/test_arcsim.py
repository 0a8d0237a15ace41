"""ArcSim scenes and materials: read as typed scenes, and refused with all reasons where they ask for more."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from flagdata.errors import InputError, NotFoundError, UnknownNameError
from flagdata.ingest.meshes import read_folder
from sim.arcsim import STAGES, read_material, read_scene
from sim.integrate.implicit import AirShape, BackwardEuler
from sim.material import named
from sim.scene import assemble

Write = Callable[[dict[str, Any]], Path]

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 2 0\nv 0 2 0\nf 1 2 3\nf 1 3 4\n"
MATERIAL = """// measured
{{"density": 0.1, "stretching": [{}], "bending": [{}]}}
""".format(", ".join(["[50, 1, 60, 20]"] * 6), ", ".join(["[1e-5, 1e-5, 1e-5, 1e-5, 1e-5]"] * 3))  # fmt: skip


@pytest.fixture
def scene() -> dict[str, Any]:
    return {
        "frame_time": 0.04,
        "frame_steps": 8,
        "duration": 4,
        "cloths": [
            {
                "mesh": "flag.obj",
                "transform": {"translate": [0, 0, 1], "rotate": [120, 1, 1, 1], "scale": 2},
                "materials": [{"data": "cloth.json", "thicken": 2, "bending_mult": 3, "damping": 1e-3}],
                "remeshing": {"size": [0.02, 0.5]},
            }
        ],
        "handles": [{"nodes": [0, 3]}],
        "gravity": [0, 0, -9.8],
        "wind": {"velocity": [6, 0, 0], "density": 1.2, "drag": 0.1},
        "disable": list(STAGES),
        "magic": {"handle_stiffness": 500, "repulsion_thickness": 0.01},
    }


@pytest.fixture
def write(tmp_path: Path) -> Write:
    (tmp_path / "flag.obj").write_text(SQUARE)
    (tmp_path / "cloth.json").write_text(MATERIAL)

    def to_file(content: dict[str, Any]) -> Path:
        path = tmp_path / "conf.json"
        path.write_text(json.dumps(content))
        return path

    return to_file


def test_a_scene_file_says_what_is_simulated(scene: dict[str, Any], write: Write) -> None:
    found = read_scene(write(scene))
    # A third of a turn about (1, 1, 1) takes x to y, y to z, z to x; scaled before, moved after.
    np.testing.assert_allclose(found.scene.position, [[0, 0, 1], [0, 2, 1], [0, 2, 5], [0, 0, 5]], atol=1e-12)
    np.testing.assert_allclose(found.scene.mesh.rest, [[0, 0], [1, 0], [1, 2], [0, 2]])
    material = found.scene.material
    assert material.density == pytest.approx(0.2)
    assert material.damping == 1e-3
    np.testing.assert_allclose(material.bending, 6e-5)
    np.testing.assert_allclose(material.stretching[0], [100, 2, 120, 40])
    assert found.scene.handles.vertices == (0, 3)
    assert found.scene.handles.stiffness == 500
    assert (found.scene.wind, found.scene.gravity) == ((6, 0, 0), (0, 0, -9.8))
    assert (found.frame_time, found.frame_steps, found.frames) == (0.04, 8, 100)
    assert found.step == pytest.approx(5e-3)
    assert found.left_out == ()


def test_stages_that_would_act_are_all_named_or_accepted(scene: dict[str, Any], write: Write) -> None:
    scene["disable"] = ["plasticity"]
    scene["cloths"][0]["materials"][0]["strain_limits"] = [0.95, 1.05]
    with pytest.raises(InputError, match="strainlimiting, remeshing, proximity, collision, separation, popfilter"):
        read_scene(write(scene))
    accepted = read_scene(write(scene), accept=set(STAGES))
    assert accepted.left_out == ("strainlimiting", "remeshing", "proximity", "collision", "separation", "popfilter")
    with pytest.raises(UnknownNameError, match="remeshing"):
        read_scene(write(scene), accept=["remesh"])


def change(path: str, value: Any) -> Callable[[dict[str, Any]], None]:
    def apply(scene: dict[str, Any]) -> None:
        *parents, last = path.split(".")
        target: Any = scene
        for key in parents:
            target = target[int(key)] if key.isdigit() else target[key]
        target[last] = value

    return apply


@pytest.mark.parametrize(
    ("edit", "word"),
    [
        (change("colour", "red"), "colour"),
        (change("wind.gusts", 3), "gusts"),
        (change("cloths.0.materials.0.friction", 3), "friction"),
        (change("magic.tangential_stiffness", 3), "tangential_stiffness"),
        (change("obstacles", [{"mesh": "pole.obj"}]), "obstacles"),
        (change("cloths", []), "0 cloths"),
        (change("frame_time", 0), "frame_time"),
        (change("frame_steps", 2.5), "frame_steps"),
        (change("end_time", 3), "given 2 times"),
        (change("gravity", [0, 1]), "gravity"),
        (change("wind.velocity", "fast"), "velocity"),
        (change("handles", [{"type": "circle"}]), "circle"),
        (change("handles", []), "not held"),
        (change("handles", [{"nodes": [9]}]), "held vertex 9"),
        (change("cloths.0.transform.rotate", [90, 0, 0, 0]), "rotate"),
        (change("cloths.0.materials.0.thicken", -1), "density"),
    ],
)
def test_what_is_not_supported_or_impossible_is_refused_by_name(
    edit: Callable[[dict[str, Any]], None], word: str, scene: dict[str, Any], write: Write
) -> None:
    edit(scene)
    with pytest.raises(InputError, match=word):
        read_scene(write(scene))


def test_missing_files_and_malformed_json_are_told(scene: dict[str, Any], write: Write, tmp_path: Path) -> None:
    scene["cloths"][0]["mesh"] = "gone.obj"
    with pytest.raises(NotFoundError, match=r"gone\.obj"):
        read_scene(write(scene))
    (tmp_path / "conf.json").write_text("{]")
    with pytest.raises(InputError, match="not JSON"):
        read_scene(tmp_path / "conf.json")


@pytest.mark.reference
def test_material_files_are_the_catalogs(reference_data: Path) -> None:
    for name in ("camel-ponte-roma", "aluminium", "11oz-black-denim"):
        found = read_material(reference_data / "materials" / f"{name}.json")
        np.testing.assert_array_equal(found.stretching, named(name).stretching)
        np.testing.assert_array_equal(found.bending, named(name).bending)
        assert found.density == named(name).density
        assert found.damping == 0.0


@pytest.mark.reference
def test_an_output_folders_scene_reproduces_its_frames(reference_data: Path, tmp_path: Path) -> None:
    # The folder as ArcSim left it: its scene, read here, its first frame as the mesh, gives its following frames.
    folder = reference_data / "arcsim" / "raw_fixed_mesh"
    content = json.loads((folder / "conf.json").read_text())
    content["cloths"][0]["mesh"] = "0000_00.obj"
    content["cloths"][0]["transform"] = {}
    content["cloths"][0]["materials"][0]["data"] = "camel-ponte-roma.json"
    for source in (folder / "0000_00.obj", reference_data / "materials" / "camel-ponte-roma.json"):
        (tmp_path / source.name).write_bytes(source.read_bytes())
    (tmp_path / "conf.json").write_text(json.dumps(content))
    found = read_scene(tmp_path / "conf.json")
    expected = read_folder(folder)
    system, state = assemble([found.scene], dtype=torch.float64)
    method = BackwardEuler(step=found.step, air_shape=AirShape.PREVIOUS)
    for frame in range(1, 4):
        state = method.advance(system, state, found.frame_time)
        gap = state.position[..., 0].numpy() - expected.frame(frame).positions
        # The files have six digits.
        assert np.abs(gap).max() < 2e-5, f"frame {frame}"
