"""Remedies of `flagdata close-loop`, up to where its minutes of simulation begin."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from flagdata.errors import RefusedError
from measure.closing import close
from tests.remedies.user import User

BEGINS = "the loop begins"
AXIS = ("--axis", "1,0,0")
PINS = ("--attachment", "corners")
MATERIAL = ("--material", "camel-ponte-roma")


@pytest.fixture
def cloth(user: User, monkeypatch: pytest.MonkeyPatch) -> str:
    """The name of 60 frames of a square cloth in the lake; a refusal stands for the loop."""

    def begins(*_: Any, **__: Any) -> None:
        raise RefusedError(BEGINS, fix="wait for it")

    monkeypatch.setattr(close, "close_loop", begins)
    (user.folder / "cloth").mkdir()
    places = [(x, y) for y in np.linspace(0, 1, 6) for x in np.linspace(0, 1, 6)]
    corners = [(6 * row + column + 1, row) for row in range(5) for column in range(5)]
    flat = [f"vt {x:g} {y:g}" for x, y in places]
    for at, _ in corners:
        for a, b, c in ((at, at + 1, at + 6), (at + 1, at + 7, at + 6)):
            flat.append(f"f {a}/{a} {b}/{b} {c}/{c}")
    for frame in range(60):
        shown = [f"v {x:g} {0.05 * x * np.sin(1.2 * frame + 3 * x):.6f} {y:g}" for x, y in places]
        (user.folder / "cloth" / f"{frame:04d}_00.obj").write_text("\n".join([*shown, *flat, ""]))
    user.succeeds("ingest", "cloth", "--rate", 25, "--name", "square")
    return "square"


def test_a_speed_has_an_axis(user: User, cloth: str) -> None:
    command = ("close-loop", cloth, *PINS, *MATERIAL, "--wind", 5)
    user.meets("closing/verdict_sources.py", "give --axis, not --north", *command, "--north", 10)
    user.follows(*command, *AXIS, code=3, shows=BEGINS)


def test_options_of_a_log_are_left_out_where_none_is(user: User, cloth: str) -> None:
    command = ("close-loop", cloth, *PINS, *MATERIAL, *AXIS)
    user.meets(
        "closing/verdict_sources.py",
        "leave it out, or name a",
        *command,
        "--wind",
        5,
        "--zone",
        "UTC",
    )
    user.follows(*command, "--wind", "second.csv", "--zone", "UTC", code=3, shows=BEGINS)


def test_what_is_not_known_of_a_cloth_is_named(user: User, cloth: str) -> None:
    command: tuple[str, ...] = ("close-loop", cloth)
    user.meets("trajectories/experiment.py", "give its velocity, or an", *command, *PINS, *MATERIAL)
    user.again("--wind", 5, *AXIS, code=3, shows=BEGINS)
    command = (*command, "--wind", "5", *AXIS)
    user.meets("trajectories/experiment.py", ", or their rest coordina", *command, *MATERIAL)
    user.again(*PINS, code=3, shows=BEGINS)
    user.meets("trajectories/experiment.py", "name one of the catalog", *command, *PINS)
    user.again(*MATERIAL, code=3, shows=BEGINS)


def test_what_is_no_mesh_sequence_is_one_that_is_listed(user: User, cloth: str) -> None:
    rest = ("--wind", 5, *AXIS, *PINS, *MATERIAL)
    user.meets(
        "trajectories/mesh_observations.py", "name a mesh sequence; fl", "close-loop", "mast", *rest
    )
    user.follows("ls", shows=f"meshes +{cloth}")
    ended = user.types("close-loop", cloth, *rest)
    assert BEGINS in ended.err


def test_a_weight_is_stated_once_with_its_uncertainty(user: User, cloth: str) -> None:
    command = ("close-loop", cloth, *PINS, "--wind", 5, *AXIS)
    weight = ("--area-weight", "0.155±0.003")
    user.meets(
        "trajectories/setup.py",
        "leave it out: --area-wei",
        *command,
        *MATERIAL,
        *weight,
        "--density-uncertainty",
        0.02,
    )
    user.follows(*command, *MATERIAL, *weight, code=3, shows=BEGINS)
