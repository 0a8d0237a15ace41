"""ArcSim's scenes and materials: what is simulated is read, what is not is refused, all of it at
once."""

from __future__ import annotations

import json
import math
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from flagdata.core.arrays import FloatArray
from flagdata.errors import ConflictError, InputError, NotFoundError, UnknownNameError
from flagdata.ingest import read_folder
from flagdata.lake import Mesh as MeshFrame
from sim.arcsim import STAGES, SWEEPS, ArcsimScene, read_material, read_scene, write_scene
from sim.cloth.air import QuadraticNormal, Stokes
from sim.cloth.contact import Contact
from sim.cloth.handles import Handles
from sim.cloth.limits import StrainLimits
from sim.cloth.material import named_material
from sim.cloth.mesh import Mesh
from sim.cloth.scene import Scene, assemble, flag
from sim.cloth.sizing import Remeshing
from sim.cloth.stiffness_tables import Evaluation
from sim.integrate import AirShape, BackwardEuler
from tests.refusals import unrefused

MATERIAL = {"density": 0.284, "stretching": [[50, 1, 60, 40]] * 6, "bending": [[1e-5] * 5] * 3}
SQUARE = (
    "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1/1 2/2 3/3\nf 1/1 3/3 "
    "4/4\n"
)
SCENE: dict[str, Any] = {
    "frame_time": 0.04,
    "frame_steps": 8,
    "duration": 2,
    "cloths": [{"mesh": "square.obj", "materials": [{"data": "m.json"}]}],
    "handles": [{"nodes": [0, 3]}],
    "gravity": [0, 0, -9.8],
    "wind": {"velocity": [4, 1, 0]},
    "disable": list(STAGES),
}
Write = Callable[[dict[str, Any]], Path]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    def make(changes: dict[str, Any]) -> Path:
        (tmp_path / "square.obj").write_text(SQUARE)
        (tmp_path / "m.json").write_text(json.dumps(MATERIAL))
        path = tmp_path / "scene.json"
        content = {**SCENE, **changes}
        path.write_text(
            json.dumps({key: value for key, value in content.items() if value is not None})
        )
        return path

    return make


def cloth(**changes: Any) -> dict[str, Any]:
    return {"cloths": [{**SCENE["cloths"][0], **changes}]}


def test_a_scene_is_what_it_says(write: Write) -> None:
    read = read_scene(write({}))
    assert (read.step, read.frames, read.left_out) == (0.005, 50, ())
    scene = read.scene
    assert scene.handles.vertices == (0, 3)
    assert scene.handles.stiffness == 1e3
    assert (scene.wind, scene.gravity) == ((4, 1, 0), (0, 0, -9.8))
    assert scene.air == QuadraticNormal(density=1.0, drag=0.0)
    assert (scene.material.area_weight, scene.material.damping) == (0.284, 0.0)
    np.testing.assert_array_equal(scene.mesh.rest, [[0, 0], [1, 0], [1, 1], [0, 1]])


def test_comments_are_passed_over_but_not_in_texts(write: Write) -> None:
    path = write({})
    path.write_text(path.read_text().replace("{", "{ // of http://example.org\n", 1))
    assert read_scene(path).frames == 50


def test_a_mesh_is_scaled_then_turned_then_moved(write: Write) -> None:
    transform = {"scale": 2, "rotate": [120, 1, 1, 1], "translate": [0, 0, 5]}
    # A third of a turn about (1, 1, 1) takes x to y, y to z and z to x.
    scene = read_scene(write(cloth(transform=transform))).scene
    np.testing.assert_allclose(
        scene.position, [[0, 0, 5], [0, 2, 5], [0, 2, 7], [0, 0, 7]], atol=1e-12
    )
    # ArcSim scales the material coordinates along: the cloth is larger, not stretched.
    np.testing.assert_allclose(scene.mesh.rest, [[0, 0], [2, 0], [2, 2], [0, 2]])


def test_thickening_scales_density_and_both_tables(write: Write) -> None:
    entry = {"data": "m.json", "thicken": 2, "density_mult": 3, "bending_mult": 5, "damping": 1e-3}
    material = read_scene(write(cloth(materials=[entry]))).scene.material
    assert material.area_weight == pytest.approx(0.284 * 6)
    np.testing.assert_allclose(material.stretching, 2 * np.array(MATERIAL["stretching"]))
    np.testing.assert_allclose(material.bending, 1e-4)
    assert material.damping == 1e-3


def test_the_end_may_be_given_in_three_ways(write: Write) -> None:
    cases = [
        ({"duration": 1}, 25),
        ({"end_time": 0.1}, 2),
        ({"end_frame": 7}, 7),
        ({"duration": 0.12}, 3),
    ]
    assert [read_scene(write({"duration": None, **end})).frames for end, _ in cases] == [
        frames for _, frames in cases
    ]


def test_everything_unsupported_is_reported_at_once(write: Write) -> None:
    entry = {"data": "m.json", "sheen": 1, "strain_limits": [0.95, 1.05]}
    changes = {
        **cloth(materials=[entry], texture="a.png", remeshing={"size": [0.02, 0.5]}),
        "wind": {"velocity": [1, 0, 0], "gusts": 2},
        "obstacles": [{"mesh": "pole.obj"}],
        "camera": {},
        "disable": [],
    }
    with pytest.raises(InputError) as caught:
        read_scene(write(changes), accept=["collision"])
    what = caught.value.what
    for key in (
        "camera",
        "cloths[0].texture",
        "cloths[0].materials[0].sheen",
        "wind.gusts",
        "obstacles",
    ):
        assert key in what
    assert "the stages separation, popfilter" in what
    for stage in ("strainlimiting", "remeshing", "proximity", "plasticity", "collision"):
        assert stage not in what


def test_accepted_stages_are_left_out_and_stated(write: Write) -> None:
    path = write(
        {**cloth(materials=[{"data": "m.json", "strain_limits": [0.9, 1.1]}]), "disable": []}
    )
    read = read_scene(path, accept=STAGES)
    assert read.left_out == (
        "strainlimiting",
        "remeshing",
        "proximity",
        "collision",
        "separation",
        "popfilter",
    )
    assert (read.scene.contact, read.scene.limits) == (None, None)


@pytest.mark.parametrize(
    ("disable", "left"),
    # Separation and the pop filter are parts of ArcSim's remeshing step.
    [
        (["remeshing"], ("collision",)),
        (["collision"], ("remeshing", "separation", "popfilter")),
        ([*STAGES], ()),
    ],
)
def test_stages_of_remeshing_act_only_with_it(
    write: Write, disable: list[str], left: tuple[str, ...]
) -> None:
    accept = ("remeshing", "collision", "separation", "popfilter")
    assert read_scene(write({"disable": disable}), accept=accept).left_out == left


SETTINGS = {"refine_angle": 0.3, "refine_velocity": 1, "size": [0.02, 0.5], "aspect_min": 0.2}
BESIDE = ("collision", "separation", "popfilter")


def test_remeshing_is_the_scenes_where_the_cloth_has_settings_for_it(write: Write) -> None:
    read = read_scene(write({**cloth(remeshing=SETTINGS), "disable": []}), accept=BESIDE)
    # ArcSim's null value of a criterion that is not given is infinite: it asks for nothing.
    assert read.scene.remeshing == Remeshing(
        refine_angle=0.3,
        refine_velocity=1,
        refine_compression=math.inf,
        size_min=0.02,
        size_max=0.5,
        aspect_min=0.2,
    )
    assert read.left_out == BESIDE
    written = write_scene(read, write({}).parent / "out")
    assert read_scene(written).scene.remeshing == read.scene.remeshing
    with pytest.raises(InputError, match="the stages remeshing"):
        read_scene(write({"disable": []}), accept=BESIDE)
    with pytest.raises(InputError, match=r"size is 0\.02"):
        read_scene(
            write({**cloth(remeshing={**SETTINGS, "size": 0.02}), "disable": []}), accept=BESIDE
        )


DISABLED = ["remeshing", "collision"]


def test_proximity_is_contact_with_arcsims_defaults(write: Write) -> None:
    # ArcSim 0.2.1: repulsion_thickness 1 mm, collision_stiffness 1e9, friction 0.6.
    assert read_scene(write({"disable": DISABLED})).scene.contact == Contact(
        thickness=1e-3, stiffness=1e9, friction=0.6
    )
    magic = {"repulsion_thickness": 10e-3, "collision_stiffness": 1e6, "projection_thickness": 1e-3}
    scene = read_scene(write({"disable": DISABLED, "magic": magic, "friction": 0.1})).scene
    assert scene.contact == Contact(thickness=0.01, stiffness=1e6, friction=0.1)
    assert (
        read_scene(write({"disable": [*DISABLED, "proximity"], "magic": magic})).scene.contact
        is None
    )


def test_strain_limits_are_the_materials_unless_disabled(write: Write) -> None:
    changes = cloth(materials=[{"data": "m.json", "strain_limits": [0.9, 1.2]}])
    limits = read_scene(write({**changes, "disable": DISABLED})).scene.limits
    assert limits is not None
    assert (limits.low, limits.high) == (0.9, 1.2)
    assert (
        read_scene(write({**changes, "disable": [*DISABLED, "strainlimiting"]})).scene.limits
        is None
    )
    assert (
        read_scene(write({"disable": DISABLED})).scene.limits is None
    )  # ArcSim's default is without


@pytest.mark.parametrize("contact", [None, Contact(thickness=0.02, stiffness=1e5, friction=0.3)])
@pytest.mark.parametrize("limits", [None, StrainLimits(low=0.8, high=1.3, sweeps=SWEEPS)])
def test_a_scene_that_is_written_comes_back(
    contact: Contact | None, limits: StrainLimits | None, tmp_path: Path
) -> None:
    scene = flag(
        material=replace(named_material("gray-interlock"), damping=1e-3), wind_speed=4.5, columns=6
    )
    scene = replace(
        scene,
        air=QuadraticNormal(density=1.2, drag=0.1),
        gravity=(0.0, 0.1, -9.7),
        contact=contact,
        limits=limits,
        handles=Handles(vertices=(0, 3, 34), stiffness=500.0),
    )
    file = ArcsimScene(scene=scene, frame_time=0.04, frame_steps=8, frames=12)
    read = read_scene(write_scene(file, tmp_path / "run"))
    assert (read.frame_time, read.frame_steps, read.frames, read.left_out) == (0.04, 8, 12, ())
    for name in ("handles", "wind", "gravity", "air", "evaluation", "contact", "limits"):
        assert getattr(read.scene, name) == getattr(scene, name)
    np.testing.assert_array_equal(read.scene.mesh.faces, scene.mesh.faces)
    np.testing.assert_allclose(read.scene.mesh.rest, scene.mesh.rest, rtol=1e-8)  # nine digits
    np.testing.assert_allclose(read.scene.position, scene.position, rtol=1e-8)
    material = read.scene.material
    assert (material.name, material.area_weight, material.damping) == (
        "gray-interlock",
        scene.material.area_weight,
        1e-3,
    )
    np.testing.assert_array_equal(material.stretching, scene.material.stretching)
    np.testing.assert_array_equal(material.bending, scene.material.bending)
    with pytest.raises(ConflictError, match="exists"):
        write_scene(file, tmp_path / "run")


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"handles": Handles(vertices=(0, 4), stiffness=math.inf)}, "rigid handles"),
        ({"handles": Handles(vertices=(0, 4), offsets=((0, 0, 1),))}, "moving handles"),
        ({"air": Stokes()}, "the wind force Stokes"),
        ({"evaluation": Evaluation.CORRECTED}, "the corrected evaluation"),
        ({"limits": StrainLimits(high=math.inf)}, "without an upper one"),
    ],
)
def test_what_arcsim_cannot_represent_is_not_written(
    changes: dict[str, Any], word: str, tmp_path: Path
) -> None:
    scene = replace(flag(material=named_material("paper"), wind_speed=4, columns=6), **changes)
    with pytest.raises(InputError, match=word):
        write_scene(ArcsimScene(scene=scene, frame_time=0.04, frame_steps=8, frames=1), tmp_path)
    assert not list(tmp_path.iterdir())


def test_a_scene_and_its_material_do_not_take_each_others_place(tmp_path: Path) -> None:
    file = ArcsimScene(
        scene=flag(material=named_material("paper"), wind_speed=4, columns=6),
        frame_time=0.04,
        frame_steps=8,
        frames=1,
    )
    with pytest.raises(InputError, match="both named paper"):
        write_scene(file, tmp_path, name="paper")
    with pytest.raises(InputError, match="0 frames"):
        replace(file, frames=0)


def test_impossible_scenes_are_refused(write: Write) -> None:
    cases = [
        ({"disable": ["remshing"]}, UnknownNameError, "did you mean 'remeshing'"),
        ({"cloths": []}, InputError, "0 cloths"),
        ({"cloths": [*SCENE["cloths"], *SCENE["cloths"]]}, InputError, "2 cloths"),
        (cloth(materials=[]), InputError, "0 materials"),
        (cloth(mesh="none.obj"), NotFoundError, "no such mesh"),
        (cloth(mesh=3), InputError, "mesh is 3"),
        (cloth(materials=[{"data": "none.json"}]), NotFoundError, "no such file"),
        (cloth(transform={"rotate": [90, 0, 0, 0]}), InputError, "rotate"),
        (cloth(transform={"scale": "2"}), InputError, "scale is '2'"),
        (cloth(transform=3), InputError, "transform is 3"),
        ({"handles": []}, InputError, "not held"),
        ({"handles": [{"nodes": [9]}]}, InputError, "held vertex 9"),
        ({"handles": [{"nodes": [0], "type": "circle"}]}, InputError, "handle's type"),
        ({"gravity": [0, 0]}, InputError, "gravity"),
        ({"wind": {"velocity": "north"}}, InputError, "velocity"),
        ({"frame_steps": 2.5}, InputError, "frame_steps"),
        ({"frame_time": None}, InputError, "frame_time"),
        ({"duration": None}, InputError, "given 0 times"),
        ({"end_time": 3}, InputError, "given 2 times"),
        ({"duration": 0.01}, InputError, "at least one frame"),
        (cloth(materials=[{"data": "m.json", "density_mult": -1}]), InputError, "area weight"),
        (
            {
                **cloth(materials=[{"data": "m.json", "strain_limits": 1.05}]),
                "disable": ["remeshing", "collision"],
            },
            InputError,
            "strain_limits",
        ),
        (
            {
                **cloth(materials=[{"data": "m.json", "strain_limits": [1.1, 1.2]}]),
                "disable": ["remeshing", "collision"],
            },
            InputError,
            "exclude the rest state",
        ),
        (
            {"disable": ["remeshing", "collision"], "magic": {"repulsion_thickness": 0}},
            InputError,
            "thickness",
        ),
        ({"magic": {"friction": 0.6}}, InputError, "magic.friction"),
    ]
    assert not unrefused(lambda changes: read_scene(write(changes)), cases)


def test_a_material_file_is_complete_and_says_no_more(tmp_path: Path) -> None:
    path = tmp_path / "m.json"
    path.write_text(json.dumps({**MATERIAL, "colour": "red"}))
    with pytest.raises(InputError, match="not supported: colour"):
        read_material(path)
    path.write_text(json.dumps({"density": 0.2}))
    with pytest.raises(InputError, match="these keys are missing: bending, stretching"):
        read_material(path)
    path.write_text("[]")
    with pytest.raises(InputError, match="no JSON object"):
        read_material(path)


@pytest.mark.reference
def test_the_reference_materials_are_the_catalogs(reference_data: Path) -> None:
    # The catalog's entries are transcriptions of the same tables (Wang et al. 2011).
    read = read_material(reference_data / "materials" / "camel-ponte-roma.json")
    camel = named_material("camel-ponte-roma")
    np.testing.assert_allclose(read.bending, camel.bending, rtol=1e-6)
    np.testing.assert_allclose(read.stretching, camel.stretching, rtol=1e-6)


@pytest.mark.reference
def test_the_papers_own_scene_names_what_it_needs(reference_data: Path) -> None:
    # Its scene runs with all of ArcSim's stages on.
    with pytest.raises(InputError, match="stages collision, separation, popfilter"):
        read_scene(reference_data / "arcsim" / "raw_remeshed" / "conf.json")


@pytest.fixture
def papers_scene(reference_data: Path, tmp_path: Path) -> Scene:
    """The paper's flag of 3 × 2 m, put together as its user had it."""
    folder = reference_data / "arcsim" / "raw_remeshed"
    for kind in ("meshes", "materials"):
        (tmp_path / kind).mkdir()
    shutil.copy(folder / "flag.obj", tmp_path / "meshes")
    shutil.copy(reference_data / "materials" / "camel-ponte-roma.json", tmp_path / "materials")
    shutil.copy(folder / "conf.json", tmp_path)
    return read_scene(
        tmp_path / "conf.json", accept=("remeshing", "collision", "separation", "popfilter")
    ).scene


@pytest.mark.reference
def test_the_papers_own_scene_has_its_contact_and_limits(papers_scene: Scene) -> None:
    scene = papers_scene
    assert scene.contact == Contact(thickness=0.01, stiffness=1e6, friction=0.6)
    assert scene.limits == StrainLimits(low=0.95, high=1.05, sweeps=SWEEPS)
    # thicken = 2
    np.testing.assert_allclose(
        scene.material.area_weight, 2 * named_material("camel-ponte-roma").area_weight, rtol=1e-9
    )


def centre(positions: NDArray[np.floating], mesh: Mesh | MeshFrame) -> FloatArray:
    """(3,) centre of mass of a mesh with these positions [m]."""
    (a, b), (c, d) = (mesh.rest[mesh.faces[:, k]].T - mesh.rest[mesh.faces[:, 0]].T for k in (1, 2))
    return np.average(positions[mesh.faces].mean(axis=1), axis=0, weights=np.abs(a * d - b * c))


@pytest.mark.reference
def test_with_its_limits_the_papers_flag_goes_where_arcsims_does(
    papers_scene: Scene, reference_data: Path
) -> None:
    # ArcSim's run is remeshed from 72 to 2,261 vertices, so that only the whole is compared: its
    # centre of mass, which moves by 1.65 m in these twelve frames. On a fixed grid of 25 cm it is
    # followed to 63 mm, on one of 10 cm to 69 mm; without limits the cloth stretches to 1.9 times
    # its length, and it is half a metre off.
    run = read_folder(reference_data / "arcsim" / "raw_remeshed")
    grid_ = flag(material=papers_scene.material, wind_speed=6.0, width=3.0, height=2.0, columns=12)
    assert grid_.wind == papers_scene.wind
    furthest = {}
    for limits in (papers_scene.limits, None):
        # Layers do not meet in these frames: with contact the result is the same, after forty times
        # as long.
        scene = replace(
            papers_scene,
            mesh=grid_.mesh,
            position=grid_.position,
            handles=grid_.handles,
            limits=limits,
            contact=None,
        )
        system, state = assemble([scene], dtype=torch.float64)
        gaps = []
        for frame in range(1, len(run)):
            state = BackwardEuler(air_shape=AirShape.PREVIOUS).advance(system, state, 0.04)
            theirs = run.frame(frame)
            gap = centre(state.position[..., 0].numpy(), grid_.mesh) - centre(
                theirs.positions, theirs
            )
            gaps.append(float(np.linalg.norm(gap)))
        furthest[limits] = max(gaps)
    assert furthest[papers_scene.limits] < 0.1
    assert furthest[None] > 0.4
