"""Names of the last version are read, with a warning where a user typed them; identities and draws
are what they were.

The expected hashes and values were computed by the version before area weight had one name.
"""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from flagdata.align import ClothFilm
from flagdata.align.cloth_recording import _recipe
from flagdata.core.provenance import canonical, digest, recipe_hash
from flagdata.core.schema import CATALOG, catalog_schema
from flagdata.errors import UsageError
from flagdata.lake import Slice, View, select
from flagdata.recipes.documents import column_json
from flagdata.recipes.retired_names import (
    hashed_names,
    present_names,
    present_query,
    present_recipe,
)
from flagdata.record import Record, RecordWriter
from measure.verdict import CRITERIA
from models.networks.targets import Scaling
from models.training import load as load_training
from sim.run import Crew, load, parse
from tests.small import SIMULATION

SCENES = {
    "flag-fabrics": "9b6d2679740675dd7faa84350dd3dc65a26b955909d50b5bd0cb9008b947e75f",
    "hanging-cloth-wide": "28cfb477d1d9aac525161ab31c725b880e00a92ee155a3f8b9e168934bfb6bf7",
}
TRAININGS = {
    "flow": "1d7bd4bd1c5fe9e7a8690dbddda3a0315cfd5f43cc161bb2e872f50cbb2a5f67",
    "wave-cloth": "dcd3bf94f9f6cbcf5ebd3714162a28cb3dfc26345c550f2c3004145034ca3545",
}
DRAWN = {"flag-fabrics": 0.3704432196286176, "hanging-cloth-wide": 0.2355647217166727}
"""Area weight of the first member [kg/m²]."""
SINCE = {"course_share", "passing", "alike_scores"}
"""Criteria of the test along the effects, which that version had not."""


def test_identities_are_those_of_the_version_before() -> None:
    assert {name: digest(canonical(load(name).identity())) for name in SCENES} == SCENES
    assert {
        name: digest(canonical(load_training(name).identity())) for name in TRAININGS
    } == TRAININGS
    cloth = ClothFilm(film=Path("a"), fabric="felt", area_weight=0.24, bending_stiffness=3.5e-5)
    assert (
        recipe_hash(_recipe(cloth))
        == "867f047571e80878ad1361c7423bc6545968b09b12c3656621486f1e366f2ac4"
    )
    before = {name: value for name, value in asdict(CRITERIA).items() if name not in SINCE}
    assert (
        recipe_hash(hashed_names(before))
        == "999b17463b15113c95d16b1fd14adf339bd40f8bdf934d8d0641e860c799f600"
    )


def test_members_draw_what_they_drew() -> None:
    drawn = {name: Crew(load(name)).member(0).parameters["area_weight"] for name in DRAWN}
    assert drawn == pytest.approx(DRAWN, rel=1e-12)


def test_a_recipe_with_the_former_keys_is_the_recipe_and_says_so(
    capsys: pytest.CaptureFixture[str],
) -> None:
    present = SIMULATION.replace("bending-factors", "area-weight-factor = 1.1\nbending-factors")
    former = present.replace("area-weight", "density")
    recipes = [
        parse(text, name="r", folder=Path(), where="r").identity() for text in (present, former)
    ]
    assert recipes[0] == recipes[1]
    warned = capsys.readouterr().err.splitlines()
    assert sorted(warned) == [
        "warning: density is called area-weight now",
        "warning: density-factor is called area-weight-factor now",
    ]
    with pytest.raises(UsageError, match="both are given"):
        parse(present.replace("area-weight-factor", "density"), name="r", folder=Path(), where="r")


def test_a_stored_cloth_model_is_read_without_a_warning() -> None:
    stored = {"seed": 1, "material": {"name": "paper", "density": 0.2}, "wind": {"density": 1.2}}
    assert present_recipe(stored)["material"] == {"name": "paper", "area-weight": 0.2}
    assert present_recipe(stored)["wind"] == {"density": 1.2}
    table = present_recipe({"material": {"table": {"density": 0.2}}})
    assert table["material"]["table"] == {"area-weight": 0.2}


def test_stored_parameters_have_their_present_names(tmp_path: Path) -> None:
    assert column_json('{"density":0.2,"lift.density":1.2}', "parameters", artifact="a") == {
        "area_weight": 0.2,
        "lift.density": 1.2,
    }
    assert column_json('{"density":0.2}', "recipe", artifact="a") == {
        "density": 0.2
    }  # what a hash was made of
    path = tmp_path / "old.mcap"
    with RecordWriter(path, metadata={}) as writer:
        writer.frame(
            log_time=1, publish_time=1, timestamp=1, image=np.zeros((16, 16), dtype=np.uint8)
        )
        writer.truth({"density": 0.25}, log_time=1)
    assert Record.open(path).truth == {"area_weight": 0.25}


class Rows:
    """A catalog of one clip of the version before, one of this version, and a cloth model."""

    def view(self, at: str | None) -> View:
        return (Slice(branch="main", version=1),)

    def scan(self, view: View) -> pa.Table:
        blank: dict[str, object] = dict.fromkeys(CATALOG) | {
            "branch": "main",
            "parents": [],
            "quality": [],
        }
        blank |= {
            "recipe_hash": "0" * 64,
            "code_version": "1",
            "format_version": 1,
            "created": 0,
            "name": "n",
        }
        texts = {
            "clip": ('{"density":0.2}', '{"area_weight":0.2}'),
            "model": ('{"wind":{"density":1.2}}',),
        }
        rows = [(kind, text) for kind, of_kind in texts.items() for text in of_kind]
        return pa.Table.from_pylist(
            [
                blank | {"artifact": str(n), "kind": k, "parameters": p}
                for n, (k, p) in enumerate(rows)
            ],
            schema=catalog_schema(),
        )


@pytest.mark.parametrize("name", ["area_weight", "density"])
def test_sql_finds_the_clips_of_either_version(
    name: str, capsys: pytest.CaptureFixture[str]
) -> None:
    found = select(Rows(), f"(parameters->>'{name}')::double = 0.2")
    assert found["parameters"].to_pylist() == ['{"area_weight":0.2}'] * 2
    assert ("density is called area_weight now" in capsys.readouterr().err) == (name == "density")
    (air,) = select(Rows(), "kind = 'model'")["parameters"].to_pylist()
    assert air == '{"wind":{"density":1.2}}'


def test_sql_about_something_else_is_left_as_it_is() -> None:
    assert present_query("name = 'density'") == "name = 'density'"
    assert (
        present_query("json_extract(parameters, '$.density') > 1")
        == "json_extract(parameters, '$.area_weight') > 1"
    )


def test_targets_have_one_name_and_hashes_the_former() -> None:
    assert Scaling(names=("wind_speed", "fabric_area_weight")).quantities == (
        "wind_speed",
        "area_weight",
    )
    names = {"fabric_density": 1, "wind_speed": 2}
    assert present_names(names) == {"fabric_area_weight": 1, "wind_speed": 2}
    assert hashed_names(present_names(names)) == names
