"""Experiment recipes: sources of every kind become one checked experiment; what is not known is
refused."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError, InputError, NotFoundError, UnknownNameError, UsageError
from flagdata.ingest import MarkerOptions, ingest_markers, ingest_meshes, write_folder
from flagdata.lake import Lake, MeshSequence
from measure.forecasting import Setting
from measure.trajectories import from_folder, load, read
from sim.cloth.material import named_material
from sim.cloth.mesh import grid
from tests.measure.trajectories.flags import HEIGHT, RATE, WIDTH, flag, flutter

COMMON = f"""
[cloth]
width = {WIDTH}
height = {HEIGHT}
[material]
name = "camel-ponte-roma"
area-weight = 0.2
[attachment]
at = "hoist"
"""


def _recipe(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "experiment.toml"
    path.write_text(text)
    return path


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two recordings in one table, in millimetres, the y axis up."""
    path = tmp_path_factory.mktemp("tracks") / "tracks.csv"
    lines = ["recording,frame,marker,u,v,x,y,z"]
    for name, seed in (("calm", 1), ("brisk", 2)):
        seen = flag(noise=0.5e-3, seed=seed, seconds=2.2)
        positions = 1e3 * seen.positions[:, :, [0, 2, 1]] * [1, 1, -1]
        for frame, at in enumerate(positions):
            for marker, ((u, v), (x, y, z)) in enumerate(zip(1e3 * seen.markers, at, strict=True)):
                lines.append(f"{name},{frame},m{marker},{u:.6f},{v:.6f},{x:.6f},{y:.6f},{z:.6f}")
    path.write_text("\n".join(lines) + "\n")
    return path


def test_a_table_of_two_recordings_with_another_axis_up_and_in_millimetres(
    table: Path, tmp_path: Path
):
    entry = f'[[recording]]\nsource = "{table}"\nrate = {RATE}\nunit = "mm"\nnoise = 0.0005\n'
    text = f'up = "y"\n{COMMON}' + "".join(
        f'{entry}take = "{take}"\nwind = {{ speed = {speed}, toward = 0.1 }}\n'
        for take, speed in (("calm", 4.0), ("brisk", 6.0))
    )
    observed = read(load(_recipe(tmp_path, text)))
    calm, brisk = observed.experiment.recordings
    assert (calm.name, brisk.name, calm.rate) == ("calm", "brisk", pytest.approx(RATE))
    truth = flag(noise=0.5e-3, seed=1, seconds=2.2)
    names = np.argsort([f"m{k}" for k in range(len(truth.markers))])
    np.testing.assert_allclose(calm.positions, truth.positions[:, names], atol=1e-8)
    np.testing.assert_allclose(brisk.wind.velocity, [[6 * math.cos(0.1), 6 * math.sin(0.1), 0]])
    specimen = observed.experiment.specimen
    assert specimen.material.area_weight == 0.2
    np.testing.assert_array_equal(
        specimen.material.bending, named_material("camel-ponte-roma").bending
    )
    np.testing.assert_allclose(specimen.anchors[:, :2], 0.0, atol=1e-3)
    assert observed.findings == ()


@pytest.mark.parametrize(
    ("lines", "uncertainty"),
    [
        ("area-weight = 0.2", 0.3),
        ('area-weight = "0.2±0.004"', 0.02),
        ("area-weight = 0.2\nmass-unknown = true", 1.0),
        ("density = 0.2\ndensity-uncertainty = 0.02", 0.02),  # as in the last version
    ],
)
def test_how_well_the_cloth_was_weighed_is_the_prior_of_its_area_weight(
    table: Path, tmp_path: Path, lines: str, uncertainty: float
):
    entry = (
        f'[[recording]]\nsource = "{table}"\nrate = {RATE}\nunit = "mm"\ntake = "calm"\nwind = {{ '
        f"speed = 4.0 }}\n"
    )
    common = COMMON.replace("area-weight = 0.2", lines)
    observed = read(load(_recipe(tmp_path, f'up = "y"\n{common}{entry}')))
    assert observed.experiment.specimen.material.area_weight == 0.2
    assert Setting.of(observed.experiment).prior.tolist() == [pytest.approx(uncertainty), 1.0, 1.5]


def _meshes(seconds: float = 2.2) -> MeshSequence:
    mesh = grid(width=WIDTH, height=HEIGHT, columns=9, rows=6)
    times = np.arange(round(seconds * RATE)) / RATE
    return MeshSequence(
        time=np.rint(times * 1e9).astype(np.int64),
        positions=flutter(mesh.rest, times).astype(np.float32),
        faces=mesh.faces.astype(np.int32),
        rest=mesh.rest.astype(np.float32),
    )


SCENE = {
    "frame_time": 1 / RATE,
    "frame_steps": 4,
    "gravity": [0, 0, -9.81],
    "wind": {"velocity": [5, 0, 0], "density": 1.2},
    "cloths": [
        {
            "mesh": "flag.obj",
            "materials": [{"data": "materials/camel-ponte-roma.json", "thicken": 2}],
        }
    ],
    "handles": [{"nodes": list(range(7))}],
    "magic": {"handle_stiffness": 2e3},
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An ArcSim output folder whose hoist is held."""
    path = tmp_path_factory.mktemp("arcsim") / "run"
    write_folder(path, _meshes(), scene=SCENE)
    return path


def test_an_arcsim_folder_needs_nothing_else(folder: Path, tmp_path: Path):
    observed = read(load(_recipe(tmp_path, f'[[recording]]\nsource = "{folder}"\n')))
    specimen, (recording,) = observed.experiment.specimen, observed.experiment.recordings
    base = named_material("camel-ponte-roma")
    assert specimen.material.area_weight == pytest.approx(2 * base.area_weight)
    np.testing.assert_allclose(specimen.material.bending, 2 * base.bending)
    assert (specimen.stiffness, specimen.air.plain.density) == (2e3, 1.2)
    np.testing.assert_allclose(specimen.mesh.rest[list(specimen.held), 0], 0.0, atol=1e-6)
    assert len(specimen.held) == 7
    np.testing.assert_array_equal(recording.wind.velocity, [[5, 0, 0]])
    assert recording.rate == pytest.approx(RATE, rel=1e-6)
    assert {f.kind for f in observed.findings} == {
        "simulated-with-numerical-damping",
        "simulated-with-other-stages",
    }


def test_a_rate_other_than_the_folders_own_is_reported(folder: Path):
    assert "rate-not-as-described" not in {f.kind for f in from_folder(folder, rate=RATE).findings}
    assert "rate-not-as-described" in {f.kind for f in from_folder(folder, rate=25.0).findings}


def test_artifacts_are_the_parents_of_what_is_read(folder: Path, table: Path, tmp_path: Path):
    lake = Lake.create(tmp_path / "lake")
    meshes = ingest_meshes(lake, folder).artifact
    assert read(
        load(_recipe(tmp_path, f'[[recording]]\nsource = "{meshes.id}"\n')), lake
    ).experiment.recordings[0].source == (meshes.id)
    small = tmp_path / "small.csv"
    lines = table.read_text().splitlines()
    small.write_text(
        "\n".join([lines[0], *(line for line in lines if line.startswith("calm,"))]) + "\n"
    )
    (markers,) = ingest_markers(lake, small, MarkerOptions(rate=RATE, unit="mm"))
    text = (
        f'up = "y"\n{COMMON}[[recording]]\nsource = "{markers.artifact.id[:12]}"\nwind = {{ speed '
        f"= 5.0 }}\n"
    )
    (recording,) = read(load(_recipe(tmp_path, text)), lake).experiment.recordings
    assert recording.source == markers.artifact.id
    assert recording.name == "small calm"


@pytest.mark.parametrize(
    ("text", "kind", "what"),
    [
        ("title = 'none'", InputError, "no recording"),
        ("[[recording]]\nsorce = 'a'", UnknownNameError, "did you mean 'source'"),
        ("[[recording]]\nname = 'a'", InputError, "the key source is missing"),
        ("[[recording]]\nsource = 'a'\nnoize = 1", UnknownNameError, "did you mean 'noise'"),
        (
            "[[recording]]\nsource = 'a'\nwind = { speed = 1, velocity = [1, 0, 0] }",
            UsageError,
            "2 winds",
        ),
        (
            "[[recording]]\nsource = 'a'\nwind = { velocity = [1, 0] }",
            InputError,
            r"velocity is \[1, 0\]; give a list, \[0.0, 0.0, 0.0\]",
        ),
        ("[[recording]]\nsource = 'a'\nwind = { log = 'b', speed = 1 }", UsageError, "2 winds"),
        (
            "[[recording]]\nsource = 'a'\nwind = { speed = 5, toward = 90 }",
            InputError,
            "90 rad, more than a whole turn",
        ),
        ("[[recording]]\nsource = 'a'\nwind = { log = 'b', north = 270 }", InputError, "270 rad"),
        (
            "[[recording]]\nsource = 'a'\nwind = { speed = 5, direction-sigma = 10 }",
            InputError,
            "direction-sigma is 10 rad",
        ),
        (
            "[[recording]]\nsource = 'a'\nwind = { speed = 5, direction-sigma = -0.1 }",
            InputError,
            "direction-sigma is -0.1",
        ),
        ("[cloth]\nwidth = 1\n[[recording]]\nsource = 'a'", UsageError, "half a size"),
        (
            "[attachment]\nat = 'hoist'\npoints = [[0, 0]]\n[[recording]]\nsource = 'a'",
            UsageError,
            "both at and points",
        ),
        (
            "[attachment]\nat = 'hoists'\n[[recording]]\nsource = 'a'",
            UnknownNameError,
            "did you mean 'hoist'",
        ),
        (
            (
                "[material]\nmass-unknown = true\ndensity-uncertainty = 0.1\n[[recording]]\nsource = "
                "'a'"
            ),
            UsageError,
            "both mass-unknown and an uncertainty",
        ),
        (
            "[material]\ndensity-uncertainty = 2\n[[recording]]\nsource = 'a'",
            InputError,
            "uncertainty of the area weight is 2.0",
        ),
        (
            "[material]\ndensity-uncertainty = 0\n[[recording]]\nsource = 'a'",
            InputError,
            "density-uncertainty",
        ),
        (
            (
                "[material]\narea-weight = '0.2±0.01'\ndensity-uncertainty = "
                "0.1\n[[recording]]\nsource = 'a'"
            ),
            UsageError,
            "given twice",
        ),
        (
            "[material]\narea-weight = '-0.2±0.01'\n[[recording]]\nsource = 'a'",
            UsageError,
            "not above 0",
        ),
        (
            "[material]\narea-weight = 0.2\ndensity = 0.2\n[[recording]]\nsource = 'a'",
            UsageError,
            "both are given",
        ),
        ("[material]\nname = 'camel'\n[[recording]]\nsource = 'a'", UnknownNameError, "camel"),
        ("up = 'w'\n[[recording]]\nsource = 'a'", UnknownNameError, "unknown up 'w'"),
    ],
)
def test_what_does_not_fit_is_refused_with_its_place(
    tmp_path: Path, text: str, kind: type[FlagdataError], what: str
):
    with pytest.raises(kind, match=what):
        load(_recipe(tmp_path, text))


def test_angles_of_a_wind_may_be_in_degrees(tmp_path: Path):
    degrees = "wind = { speed = 2, toward-deg = 90, direction-sigma-deg = 180 }"
    (constant,) = load(_recipe(tmp_path, f"[[recording]]\nsource = 'a'\n{degrees}")).recordings
    assert constant.wind is not None
    assert constant.wind.velocity == pytest.approx((0.0, 2.0, 0.0), abs=1e-12)
    assert constant.wind.direction == pytest.approx(math.pi)
    (logged,) = load(
        _recipe(tmp_path, "[[recording]]\nsource = 'a'\nwind = { log = 'b', north-deg = 90 }")
    ).recordings
    assert logged.wind is not None
    assert logged.wind.placement.north == pytest.approx(math.pi / 2)


def test_a_source_that_is_not_there_is_named(tmp_path: Path):
    with pytest.raises(NotFoundError, match="nowhere"):
        read(load(_recipe(tmp_path, "[[recording]]\nsource = 'nowhere'\n")))


def test_a_table_of_several_recordings_asks_which(table: Path, tmp_path: Path):
    text = f'[[recording]]\nsource = "{table}"\nrate = 50\nunit = "mm"\nwind = {{ speed = 5.0 }}\n'
    with pytest.raises(UsageError, match="one of calm, brisk"):
        read(load(_recipe(tmp_path, text)))
