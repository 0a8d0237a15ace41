"""Members whose mesh follows the cloth: stored as ragged sequences, and read by what reads such
sequences."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import flagdata
from flagdata.answer.simulated import Simulated
from flagdata.errors import LimitError, UnknownNameError, UsageError
from flagdata.ingest import read_folder
from flagdata.lake import Lake, RaggedMeshSequence, read_meshes
from measure.trajectories import from_sequence
from sim.cloth.limits import StrainLimits
from sim.cloth.sizing import Remeshing
from sim.render import Meshes
from sim.run import Crew, Recipe, load, parse, simulate

TEXT = """
seed = 1
[scene]
shape = "flag"
width = 0.9
height = 0.6
columns = 6
[material]
name = "camel-ponte-roma"
[wind]
speed = 5.0
[remeshing]
refine-angle = 0.4
size-min = 0.08
[integrator]
name = "implicit"
[time]
settle = 0.2
frames = 5
[effects.lift]
coefficient = 1.0
"""


def read(text: str) -> Recipe:
    return parse(text, name="r", folder=Path(), where="r")


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> tuple[Lake, RaggedMeshSequence, str]:
    """A lake, the one member in it, and its id."""
    lake = Lake.create(tmp_path_factory.mktemp("remeshed") / "lake")
    report = simulate(lake, read(TEXT))
    assert not report.failed
    sequence = read_meshes(lake.object_path(lake.rows()["object"][0].as_py()))
    assert isinstance(sequence, RaggedMeshSequence)
    return lake, sequence, report.added[0]


def test_a_member_is_stored_with_a_mesh_for_each_frame_and_is_there_already_the_second_time(
    stored: tuple[Lake, RaggedMeshSequence, str],
) -> None:
    lake, sequence, _ = stored
    counts = np.diff(sequence.vertex_offset)
    assert (len(sequence), len({*counts.tolist()}) > 1) == (5, True)
    assert len(sequence.attributes["energies"]["kinetic"]) == 5
    for frame in map(sequence.frame, range(5)):
        corners = frame.rest[frame.faces].astype(np.float64)
        doubled = np.linalg.det(corners[:, 1:] - corners[:, :1])
        assert doubled.min() > 0
        # float32 of coordinates of a metre
        assert doubled.sum() / 2 == pytest.approx(0.54, abs=1e-6)
    assert simulate(lake, read(TEXT)).added == ()


def test_it_is_observed_rendered_and_exported_as_remeshed_runs_of_others_are(
    stored: tuple[Lake, RaggedMeshSequence, str], tmp_path: Path
) -> None:
    lake, sequence, artifact = stored
    observation = from_sequence(sequence, name="r", markers=24)
    assert observation.positions.shape[0] == 5
    assert np.isfinite(observation.positions).all()
    assert not Meshes.flag(sequence, heading=0.0).one_topology
    flagdata.export("obj", to=tmp_path / "out", where=f"artifact = '{artifact}'", lake=lake.path)
    frames = sorted((tmp_path / "out").rglob("*.obj"))
    assert len(frames) == 5
    again = read_folder(frames[0].parent)
    assert isinstance(again, RaggedMeshSequence)
    np.testing.assert_array_equal(again.vertex_offset, sequence.vertex_offset)


def test_arrays_of_all_frames_are_refused_and_each_frame_is_there() -> None:
    answer = flagdata.simulate(None, **_tables(frames=2))
    assert isinstance(answer, Simulated)
    assert answer[0].frame(1).positions.shape[1] == 3
    assert "vertices" in repr(answer)
    with pytest.raises(UsageError, match="no single array"):
        _ = answer.positions


def _tables(*, frames: int) -> dict[str, Mapping[str, Any]]:
    return {
        "scene": {"width": 0.9, "columns": 6},
        "wind": {"speed": 5.0},
        "integrator": {"name": "implicit"},
        "time": {"settle": 0.1, "frames": frames},
        "remeshing": {"size-min": 0.1},
    }


def test_a_recipe_says_how_finely_and_that_is_part_of_what_a_member_is() -> None:
    recipe = read(TEXT)
    assert recipe.remeshing == Remeshing(refine_angle=0.4, size_min=0.08)
    assert recipe.batch == 1
    assert Crew(recipe).member(0).scene.remeshing == recipe.remeshing
    assert recipe.identity()["remeshing"]["size_min"] == 0.08
    plain = replace(recipe, remeshing=None)
    assert "remeshing" not in plain.identity()
    limited = read(TEXT + "[limits]\nhigh = 1.1\n")
    assert limited.limits == StrainLimits(high=1.1, sweeps=500)


@pytest.mark.parametrize(
    ("old", "new", "kind", "word"),
    [
        ('name = "implicit"', 'name = "symplectic"', UsageError, "steps that suit one mesh"),
        ("seed = 1", "seed = 1\nbatch = 4", UsageError, "batches of 4 members"),
        ("size-min", "size-mni", UnknownNameError, "did you mean 'size-min'"),
        ("size-min = 0.08", "size-min = 0.001", LimitError, "vertices"),
    ],
)
def test_what_cannot_be_remeshed_is_refused(
    old: str, new: str, kind: type[Exception], word: str
) -> None:
    with pytest.raises(kind, match=word):
        read(TEXT.replace(old, new))


@pytest.mark.reference
def test_the_papers_scene_is_a_recipe_with_its_remeshing(
    reference_data: Path, tmp_path: Path
) -> None:
    folder = reference_data / "arcsim" / "raw_remeshed"
    (tmp_path / "meshes").mkdir()
    (tmp_path / "materials").mkdir()
    (tmp_path / "meshes" / "flag.obj").write_bytes((folder / "flag.obj").read_bytes())
    material = "camel-ponte-roma.json"
    (tmp_path / "materials" / material).write_bytes(
        (reference_data / "materials" / material).read_bytes()
    )
    (tmp_path / "conf.json").write_bytes((folder / "conf.json").read_bytes())
    text = (
        '[scene]\nshape = "arcsim"\nfile = "conf.json"\naccept = ["collision", "separation", '
        '"popfilter"]\n'
    )
    (tmp_path / "r.toml").write_text(text + '[integrator]\nname = "implicit"\n')
    recipe = load(str(tmp_path / "r.toml"))
    # The listing of the paper's appendix.
    assert recipe.remeshing == Remeshing(
        refine_angle=0.3,
        refine_compression=0.01,
        refine_velocity=1.0,
        size_min=0.02,
        size_max=0.5,
        aspect_min=0.2,
    )
