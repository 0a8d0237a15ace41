"""Recipes are read strictly: what is not understood is refused with the place and the nearest that
is."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from flagdata.core.provenance import canonical
from flagdata.errors import InputError, NotFoundError, UnknownNameError, UsageError
from flagdata.recipes.typed_tables import Range, Scale
from sim.arcsim import STAGES
from sim.cloth.air import QuadraticNormal, Stokes
from sim.cloth.contact import Contact
from sim.cloth.limits import StrainLimits
from sim.effects import EFFECTS
from sim.run import Crew, Shape, load, parse
from sim.run.simulation_toml import SCENES
from tests.refusals import unrefused
from tests.sim.run.conftest import make_recipe

MINIMAL = '[material]\nname = "camel-ponte-roma"\n[wind]\nspeed = 4.0\n'


def read(text: str, folder: Path = Path()):
    return parse(text, name="r", folder=folder, where="r.toml")


def test_every_recipe_of_the_catalog_is_read() -> None:
    assert {"flag-search-space", "hanging-cloth"} <= set(SCENES.names())
    for name in SCENES.names():
        canonical(load(name).identity())


def test_the_search_space_is_the_papers() -> None:
    recipe = load("flag-search-space")
    assert [base.name for base in recipe.material.bases] == ["camel-ponte-roma"]
    assert recipe.material.bending_each == Range(low=0.1, high=10.0)
    assert recipe.material.area_weight == Range(low=0.10, high=0.17)
    assert recipe.wind.speed == Range(low=0.0, high=10.0)
    assert (recipe.time.frames, recipe.time.rate) == (60, 25.0)
    assert recipe.scene.width / recipe.scene.height == 1.5


def test_what_is_left_out_has_its_default_in_the_identity() -> None:
    recipe = read(MINIMAL)
    assert recipe.scene.shape is Shape.FLAG
    assert (
        recipe.identity()
        == read(MINIMAL + "[time]\nsettle = 4.0\nframes = 60\nrate = 25.0\n").identity()
    )
    assert recipe.identity() == read("count = 9\nbatch = 2\n" + MINIMAL).identity()
    for change in ("seed = 1\n", 'precision = "float64"\n'):
        assert read(change + MINIMAL).identity() != recipe.identity()
    assert read(MINIMAL + "[contact]\n").identity() != recipe.identity()


def test_an_angle_is_in_radians_or_in_degrees_where_its_key_says_so() -> None:
    radians = read(MINIMAL + "toward = 1.5707963267948966\n")
    degrees = read(MINIMAL + "toward-deg = 90\n")
    assert degrees.wind.toward == pytest.approx(1.5707963267948966)
    assert degrees.identity() == radians.identity()
    around = read(MINIMAL + "toward-deg = { low = -180.0, high = 180.0 }\n").wind.toward
    assert isinstance(around, Range)
    assert (around.low, around.high) == (pytest.approx(-np.pi), pytest.approx(np.pi))
    # A whole turn, as it is rounded in a file.
    assert read(MINIMAL + "toward = 6.2832\n").wind.toward == 6.2832


@pytest.mark.parametrize(
    ("line", "what", "fix"),
    [
        ("toward = 90.0", "90 rad, more than a whole turn", "toward-deg = 90"),
        ("toward = -45", "-45 rad", "toward-deg = -45"),
        ("toward = { low = 0.0, high = 360.0 }", "360 rad", "toward-deg"),
        ("toward = 1.0\ntoward-deg = 57.3", "given twice", "keep"),
    ],
)
def test_an_angle_that_is_clearly_in_degrees_is_refused_with_the_key_for_it(
    line: str, what: str, fix: str
) -> None:
    with pytest.raises(InputError, match=what) as caught:
        read(f"{MINIMAL}{line}\n")
    assert "[wind]" in (caught.value.where or "")
    assert fix in (caught.value.fix or "")
    with pytest.raises(InputError, match="angle is 90"):
        read(MINIMAL + "[effects.direction-change]\nangle = 90.0\n")


def test_what_is_wrong_is_refused_with_its_place() -> None:
    cases = [
        (MINIMAL + "[tme]\nframes = 3\n", UnknownNameError, "did you mean 'time'"),
        (MINIMAL + "[time]\nframse = 3\n", UnknownNameError, "did you mean 'frames'"),
        (
            MINIMAL.replace("camel-ponte-roma", "camel-ponte-romo"),
            UnknownNameError,
            "camel-ponte-roma",
        ),
        (MINIMAL + "[scene]\nshape = 'flga'\n", UnknownNameError, "did you mean 'flag'"),
        (
            MINIMAL + "[integrator]\nname = 'implicti'\n",
            UnknownNameError,
            "did you mean 'implicit'",
        ),
        (MINIMAL + "[integrator]\nair-shape = 'previous'\n", UnknownNameError, "air-shape"),
        (MINIMAL + "[effects.gust]\nintensity = 0.1\n", UnknownNameError, "did you mean 'gusts'"),
        (
            MINIMAL + "[effects.gusts]\nintensty = 0.1\n",
            UnknownNameError,
            "did you mean 'intensity'",
        ),
        (MINIMAL + "[effects.gusts]\nintensity = -0.1\n", InputError, "at least 0"),
        (MINIMAL + "[effects.logged-gusts]\n", UsageError, "need a log"),
        (
            MINIMAL + "[scene]\nshape = 'hanging-cloth'\nattachment = 'hoist'\n",
            UsageError,
            "no hoist",
        ),
        (MINIMAL + "[scene]\ncolumns = 0\n", InputError, "columns is 0"),
        (MINIMAL + "[scene]\nwidth = -1.0\n", InputError, "width is -1"),
        (MINIMAL + "[time]\nrate = 0\n", InputError, "rate is 0"),
        ("seed = -1\n" + MINIMAL, InputError, "seed is -1"),
        ("batch = true\n" + MINIMAL, InputError, "batch is True"),
        ("precision = 'float16'\n" + MINIMAL, UnknownNameError, "float"),
        (MINIMAL.replace("4.0", "nan"), InputError, "finite"),
        (MINIMAL.replace("4.0", "-4.0"), InputError, "at least 0"),
        (MINIMAL.replace("4.0", "{ low = 5.0, high = 4.0 }"), InputError, "low ≤ high"),
        (
            MINIMAL.replace("4.0", "{ low = 0.0, high = 4.0, scale = 'log' }"),
            InputError,
            "begin above 0",
        ),
        (MINIMAL.replace("4.0", "{ low = 0.0 }"), InputError, "speed: the key high is missing"),
        (
            MINIMAL.replace("4.0", "{ low = 0.0, hihg = 1.0, high = 2.0 }"),
            UnknownNameError,
            "did you mean 'high'",
        ),
        (MINIMAL.replace("speed = 4.0", ""), InputError, "no wind speed"),
        (MINIMAL.replace("speed", "sped"), UnknownNameError, "did you mean 'speed'"),
        ("[wind]\nspeed = 4.0\n", InputError, "no material"),
        (MINIMAL.replace("[wind]", "area-weight = 0.0\n[wind]"), InputError, "above 0"),
        (MINIMAL.replace("[wind]", "file = 'x.toml'\n[wind]"), UsageError, "more than one of name"),
        (
            MINIMAL.replace("[wind]", "names = ['paper']\n[wind]"),
            UsageError,
            "more than one of name",
        ),
        ("[scene]\nshape = 'arcsim'\n" + MINIMAL, InputError, "the key file is missing"),
        ("scene = 3\n" + MINIMAL, InputError, "not a table"),
        ("[wind\n", InputError, "not TOML"),
        (MINIMAL + "[limits]\nhgih = 1.1\n", UnknownNameError, "did you mean 'high'"),
        (MINIMAL + "[limits]\nlow = 1.1\n", InputError, "exclude the rest state"),
        (MINIMAL + "[limits]\nsweeps = 0\n", InputError, "sweeps is 0"),
    ]
    assert not unrefused(lambda text: read(text), cases, where=".")


def test_a_missing_recipe_is_an_error() -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'hanging-cloth'"):
        load("hanging-cloht")
    with pytest.raises(NotFoundError):
        load("nowhere.toml")


def test_a_logarithmic_range_is_uniform_in_the_logarithm() -> None:
    quantity = Range(low=0.1, high=10.0, scale=Scale.LOG)
    assert quantity.at(0.5) == pytest.approx(1.0)
    assert quantity.at(0.25) == pytest.approx(10**-0.5)
    assert Range(low=2.0, high=4.0).at(0.25) == 2.5


def test_winds_force_is_named() -> None:
    recipe = read(MINIMAL.replace("speed", "force = 'stokes'\nviscosity = 2e-5\nspeed"))
    assert recipe.wind.force == Stokes(viscosity=2e-5)
    with pytest.raises(UnknownNameError, match="density"):
        read(MINIMAL.replace("speed", "force = 'stokes'\ndensity = 1.0\nspeed"))


def test_materials_of_a_users_own_files_are_read(tmp_path: Path) -> None:
    tables = {
        "area-weight": 0.2,
        "stretching": [[50.0, 0, 50, 40]] * 6,
        "bending": [[1e-5] * 5] * 3,
    }
    of_arcsim = {"density" if key == "area-weight" else key: value for key, value in tables.items()}
    (tmp_path / "mine.json").write_text(json.dumps(of_arcsim))
    lines = [f"{key} = {json.dumps(value)}" for key, value in tables.items()]
    (tmp_path / "mine.toml").write_text(
        "\n".join([*lines, 'source = "measured"', "damping = 1e-3"])
    )
    for name, damping in (("mine.json", 0.0), ("mine.toml", 1e-3)):
        (base,) = read(f'[material]\nfile = "{name}"\n[wind]\nspeed = 1\n', tmp_path).material.bases
        assert (base.area_weight, base.damping) == (0.2, damping)
        np.testing.assert_array_equal(base.bending, tables["bending"])
    with pytest.raises(NotFoundError):
        read('[material]\nfile = "yours.toml"\n[wind]\nspeed = 1\n', tmp_path)


def test_an_effects_prior_may_be_asked_for_by_name() -> None:
    effect = make_recipe(more='[effects.gusts]\nintensity = "prior"\nlength = 40.0').effects[
        "gusts"
    ]
    low, high = EFFECTS["gusts"].parameters()["intensity"].prior
    assert effect.parameters["intensity"] == Range(low=low, high=high)
    assert effect.length == 40.0


SQUARE = (
    "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nv 0 0 0\nv 0 1 0\nv 0 1 1\nv 0 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 "
    "4/4\n"
)


@pytest.fixture
def scene_folder(tmp_path: Path) -> Path:
    """An ArcSim scene of a square metre in two triangles, that runs with contact and strain
    limits."""
    material = {"density": 0.2, "stretching": [[50.0, 0, 50, 40]] * 6, "bending": [[1e-5] * 5] * 3}
    scene = {
        "frame_time": 0.04,
        "frame_steps": 8,
        "duration": 1,
        "gravity": [0, 0, -9.8],
        "cloths": [
            {"mesh": "square.obj", "materials": [{"data": "m.json", "strain_limits": [0.95, 1.05]}]}
        ],
        "handles": [{"nodes": [0, 3]}],
        "wind": {"velocity": [0, 3, 1], "density": 1.2},
        "friction": 0.2,
        "disable": ["remeshing", "collision"],
    }
    (tmp_path / "square.obj").write_text(SQUARE)
    (tmp_path / "m.json").write_text(json.dumps(material))
    (tmp_path / "scene.json").write_text(json.dumps(scene))
    return tmp_path


ARCSIM = (
    '[scene]\nshape = "arcsim"\nfile = "scene.json"\naccept = ["strainlimiting", "proximity"]\n'
)


def test_an_arcsim_scene_may_be_the_start_of_a_recipe(scene_folder: Path) -> None:
    recipe = read(ARCSIM + "[time]\nsettle = 1.0\n", scene_folder)
    member = Crew(recipe).member(0)
    np.testing.assert_allclose(member.scene.wind, [0, 3, 1], atol=1e-12)
    assert member.scene.gravity == (0, 0, -9.8)
    assert member.scene.material.area_weight == 0.2
    assert recipe.wind.force == QuadraticNormal(density=1.2)
    assert recipe.identity()["scene"]["left_out"] == ["strainlimiting", "proximity"]
    changed = read(ARCSIM + '[material]\nname = "paper"\n[wind]\nspeed = 2.0\n', scene_folder)
    assert Crew(changed).member(0).scene.material.name == "paper"
    assert Crew(changed).member(0).wind_speed == 2.0
    assert changed.identity() != recipe.identity()


def test_a_scene_is_known_by_its_content(scene_folder: Path) -> None:
    before = read(ARCSIM, scene_folder).identity()
    (scene_folder / "scene.json").rename(scene_folder / "other.json")
    assert read(ARCSIM.replace("scene.json", "other.json"), scene_folder).identity() == before
    (scene_folder / "square.obj").write_text(SQUARE.replace("v 0 1 1", "v 0 1 0.9"))
    assert read(ARCSIM.replace("scene.json", "other.json"), scene_folder).identity() != before


def test_a_scene_file_by_itself_runs_with_arcsims_steps(scene_folder: Path) -> None:
    content = json.loads((scene_folder / "scene.json").read_text())
    (scene_folder / "plain.json").write_text(json.dumps({**content, "disable": [*STAGES]}))
    recipe = load(str(scene_folder / "plain.json"))
    assert (recipe.integrator.name, recipe.integrator.step, recipe.time.settle) == (
        "implicit",
        0.005,
        0.0,
    )
    assert (recipe.time.frames, recipe.time.rate) == (26, 25.0)
    assert (recipe.contact, recipe.limits) == (None, None)


def test_a_scenes_contact_and_limits_are_the_recipes_unless_it_says_otherwise(
    scene_folder: Path,
) -> None:
    whole = load(str(scene_folder / "scene.json"))
    # ArcSim's defaults: 1 mm, 1e9 N/m³; the scene's own friction.
    assert whole.contact == Contact(thickness=1e-3, stiffness=1e9, friction=0.2)
    assert whole.limits == StrainLimits(low=0.95, high=1.05, sweeps=50)
    kept = ARCSIM.replace('accept = ["strainlimiting", "proximity"]\n', "")
    recipe = read(kept, scene_folder)
    assert recipe.contact == whole.contact
    assert recipe.limits == StrainLimits(low=0.95, high=1.05, sweeps=1)  # small steps
    scene = Crew(recipe).member(0).scene
    assert (scene.contact, scene.limits) == (recipe.contact, recipe.limits)
    other = read(kept + "[contact]\nthickness = 0.01\n[limits]\nhigh = 1.2\n", scene_folder)
    assert other.contact == Contact(thickness=0.01, stiffness=1e6, friction=0.6)
    assert other.limits == StrainLimits(low=0.95, high=1.2)
    assert other.identity() != recipe.identity()
    assert read(ARCSIM, scene_folder).limits is None


def test_limits_may_be_given_to_any_recipe() -> None:
    assert read(MINIMAL + "[limits]\n").limits == StrainLimits(low=0.95, high=1.05, sweeps=1)
    implicit = '[integrator]\nname = "implicit"\n[limits]\nlow = 0.9\n'
    assert read(MINIMAL + implicit).limits == StrainLimits(low=0.9, high=1.05, sweeps=50)
    assert read(MINIMAL + "[limits]\n").identity() != read(MINIMAL).identity()
    assert (
        "limits" not in read(MINIMAL).identity()
    )  # members of before limits were known keep their names


@pytest.mark.parametrize(
    ("old", "new", "word"),
    [
        ("vt 1 1", "vt 0.5 -1", "inverted"),
        ("vt 1 1", "vt 0.5 0", "degenerate"),
        ("f 1/1 3/3 4/4", "f 1/1 4/4 3/3", "inverted"),
        ("f 1/1 3/3 4/4\n", "", "belong to no face"),
    ],
)
def test_a_mesh_that_cannot_be_simulated_is_refused_with_the_reason(
    scene_folder: Path, old: str, new: str, word: str
) -> None:
    (scene_folder / "square.obj").write_text(SQUARE.replace(old, new))
    with pytest.raises(InputError, match=word):
        read(ARCSIM, scene_folder)
