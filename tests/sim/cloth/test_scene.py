"""Scenes and handles: what they describe, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from flagdata.errors import InputError, UsageError
from sim.cloth import handles as held
from sim.cloth.handles import Handles
from sim.cloth.material import MATERIALS, named_material
from sim.cloth.mesh import Mesh, grid
from sim.cloth.scene import Scene, assemble, flag, hanging_cloth, upright
from sim.cloth.stiffness_tables import Evaluation
from sim.integrate import Symplectic, advance
from sim.wind import UniformWind
from tests.refusals import unrefused

CAMEL = named_material("camel-ponte-roma")


def test_a_flag_is_held_at_its_two_hoist_corners_and_a_cloth_at_its_top_ones() -> None:
    scene = flag(material=CAMEL, wind_speed=4, columns=6)
    assert scene.mesh.rest[list(scene.handles.vertices)].tolist() == [[0, 0], [0, 1]]
    cloth = hanging_cloth(material=CAMEL, wind=(1, 2), columns=4)
    assert cloth.mesh.rest[list(cloth.handles.vertices)].tolist() == [[0, 1], [1, 1]]
    assert cloth.wind == (1, 2, 0)
    assert [scene.mesh.rest[v].tolist() for v in held.full_hoist(scene.mesh.rest)] == [
        [0, j / 4] for j in range(5)
    ]


def test_members_differ_in_material_and_wind_but_not_in_mesh() -> None:
    scenes = [
        flag(material=named_material(n), wind_speed=u, columns=6)
        for n, u in (("paper", 1.0), ("gray-interlock", 7.0))
    ]
    system, state = assemble(scenes, dtype=torch.float64)
    assert state.position.shape == (35, 3, 2)
    np.testing.assert_allclose(system.cloth.mass.sum(0), [0.1 * 1.5, 0.187 * 1.5])
    np.testing.assert_allclose(system.wind.velocity(3.0), [[1, 7], [0, 0], [0, 0]])
    with pytest.raises(UsageError, match="scene 1 differs"):
        assemble([scenes[0], flag(material=CAMEL, wind_speed=1, columns=9)])
    with pytest.raises(UsageError, match="no scenes"):
        assemble([])


def test_impossible_scenes_are_refused_with_the_reason() -> None:
    cases = [
        ({"wind": (float("nan"), 0, 0)}, "wind"),
        ({"gravity": (0, 0)}, "gravity"),
        ({"position": np.zeros((3, 3))}, "positions have shape"),
        ({"position": np.full((35, 3), np.inf)}, "finite"),
        ({"handles": Handles(vertices=())}, "not held"),
        ({"handles": Handles(vertices=(35,))}, "held vertex 35"),
    ]
    assert (
        unrefused(
            lambda change: replace(flag(material=CAMEL, wind_speed=4, columns=6), **change),
            cases,
            InputError,
        )
        == []
    )


def test_a_second_piece_that_nothing_holds_is_refused() -> None:
    one = grid(width=1, height=1, columns=2, rows=2)
    two = Mesh(
        rest=np.concatenate([one.rest, one.rest + 5]),
        faces=np.concatenate([one.faces, one.faces + 9]),
    )
    with pytest.raises(InputError, match="not held anywhere"):
        Scene(mesh=two, position=upright(two), material=CAMEL, handles=Handles(vertices=(0,)))


@pytest.mark.parametrize(
    ("fields", "word"),
    [
        ({"vertices": (1, 1)}, "twice"),
        ({"vertices": (1,), "stiffness": 0.0}, "stiffness"),
        ({"vertices": (1,), "stiffness": float("nan")}, "stiffness"),
        ({"vertices": (1,), "times": (0.0, 1.0)}, "key times"),
        ({"vertices": (1,), "times": (1.0, 1.0), "offsets": ((0, 0, 0), (1, 0, 0))}, "increase"),
    ],
)
def test_impossible_handles_are_refused(fields: dict[str, object], word: str) -> None:
    with pytest.raises(InputError, match=word):
        Handles(**fields)  # type: ignore[arg-type]


def test_offsets_are_linear_between_key_frames_and_constant_outside() -> None:
    moving = Handles(vertices=(0,), times=(1.0, 3.0), offsets=((0, 0, 0), (2, 0, -4)))
    assert moving.offset(0.0).tolist() == [0, 0, 0]
    assert moving.offset(2.0).tolist() == [1, 0, -2]
    assert moving.offset(9.0).tolist() == [2, 0, -4]


def test_rigid_handles_follow_their_motion_exactly() -> None:
    scene = flag(material=CAMEL, wind_speed=4, columns=6)
    moving = replace(
        scene.handles, stiffness=float("inf"), times=(0.0, 0.2), offsets=((0, 0, 0), (0.3, 0.1, 0))
    )
    system, state = assemble([replace(scene, handles=moving)], dtype=torch.float64)
    for _ in range(5):
        state = advance(system, state, 0.04, steps=60)
    expected = system.anchors + torch.tensor([0.3, 0.1, 0.0], dtype=torch.float64)[:, None]
    torch.testing.assert_close(state.position[system.held], expected, rtol=0, atol=1e-12)


def test_uniform_wind_refuses_what_is_not_finite() -> None:
    with pytest.raises(InputError, match="member 1"):
        UniformWind(constant=torch.tensor([[1.0, float("inf")], [0, 0], [0, 0]]))
    with pytest.raises(InputError, match="shape"):
        UniformWind(constant=torch.ones(3))


@pytest.mark.parametrize("evaluation", list(Evaluation))
def test_every_measured_cloth_flies_in_strong_wind(evaluation: Evaluation) -> None:
    cloths = [name for name in MATERIALS.names() if name not in ("paper", "aluminium")]
    scenes = [
        flag(material=named_material(name), wind_speed=10.0, columns=9, evaluation=evaluation)
        for name in cloths
    ]
    system, state = assemble(scenes)
    state = Symplectic().advance(system, state, 2.0)
    assert bool(state.healthy().all())
    # All stream downwind, and none has been pulled out beyond twice its length.
    free = np.flatnonzero(scenes[0].mesh.rest[:, 0] > 1.5 - 1e-6)
    downwind = state.position[free, 0].mean(0)
    assert float(downwind.min()) > 0.7
    assert float(state.position.abs().max()) < 3.0
