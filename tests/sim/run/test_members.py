"""Members are drawn from named streams: each depends on the recipe's seed and its index alone."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import torch

from sim.cloth.material import named_material
from sim.cloth.scene import upright
from sim.effects import EFFECTS
from sim.run import Crew, parse
from tests.sim.run.conftest import make_recipe, small

CAMEL = named_material("camel-ponte-roma")


def test_draws_cover_the_search_space_uniformly() -> None:
    crew = Crew(make_recipe())
    members = [crew.member(index) for index in range(400)]
    speed = np.array([m.parameters["wind_speed"] for m in members])
    area_weight = np.array([m.parameters["area_weight"] for m in members])
    factors = np.array([m.scene.material.bending / CAMEL.bending for m in members])
    # A uniform distribution's mean over n draws has a standard deviation of width/√(12 n): four of
    # them.
    for values, low, high in ((speed, 0, 10), (area_weight, 0.10, 0.17), (factors, 0.1, 10)):
        assert low <= values.min()
        assert values.max() <= high
        assert abs(values.mean() - (low + high) / 2) < 4 * (high - low) / np.sqrt(12 * values.size)
    # The fifteen coefficients are drawn apart: correlations are those of chance (four standard
    # deviations of 1/√n).
    correlation = np.corrcoef(factors.reshape(400, 15).T) - np.eye(15)
    assert np.abs(correlation).max() < 4 / np.sqrt(400)


def test_materials_are_drawn_alike_often() -> None:
    text = small().replace(
        'name = "camel-ponte-roma"', 'names = ["paper", "gray-interlock", "camel-ponte-roma"]'
    )
    crew = Crew(parse(text, name="r", folder=Path(), where="r"))
    drawn = [crew.member(index) for index in range(300)]
    counts = np.unique([m.parameters["material"] for m in drawn], return_counts=True)[1]
    # Binomial: 300/3 ± four standard deviations of √(300 · 1/3 · 2/3).
    assert np.abs(counts - 100).max() < 4 * np.sqrt(300 * 2 / 9)
    for member in drawn[:9]:
        base = named_material(str(member.parameters["material"]))
        np.testing.assert_array_equal(member.scene.material.stretching, base.stretching)
    crew.assemble(drawn[:9])


def test_an_area_weight_factor_multiplies_each_materials_own_area_weight() -> None:
    """Log-uniform from 0.7 to 1.4: the mean logarithm of n draws has a standard deviation of ln
    2/√(12 n)."""
    text = small(material="area-weight-factor = { low = 0.7, high = 1.4, scale = 'log' }")
    text = text.replace('name = "camel-ponte-roma"', 'names = ["paper", "gray-interlock"]')
    text = text.replace("area-weight = { low = 0.10, high = 0.17 }\n", "")
    crew = Crew(parse(text, name="r", folder=Path(), where="r"))
    members = [crew.member(index) for index in range(200)]
    own = {"paper": 0.1, "gray-interlock": 0.187}  # kg/m², of the catalog's files
    area_weight = np.array([m.parameters["area_weight"] for m in members], dtype=np.float64)
    factors = area_weight / [own[str(m.parameters["material"])] for m in members]
    assert factors.min() >= 0.7
    assert factors.max() <= 1.4
    assert abs(np.log(factors).mean() - np.log(0.7 * 1.4) / 2) < 4 * np.log(2) / np.sqrt(12 * 200)
    np.testing.assert_allclose([m.scene.material.area_weight for m in members], area_weight)


def test_the_stable_step_is_looked_for_at_the_lightest_cloth() -> None:
    light, plain = (
        Crew(parse(small(material=extra), name="r", folder=Path(), where="r"))
        for extra in ("area-weight-factor = { low = 0.5, high = 2.0 }", "")
    )
    mass = [float(crew.corners(0)[0].cloth.mass.sum(dim=0)[0]) for crew in (light, plain)]
    assert mass[0] / mass[1] == pytest.approx(0.5, rel=1e-5)


def test_a_recipe_without_an_area_weight_factor_is_the_recipe_it_was() -> None:
    """Its hash is in lakes: artifacts made before there were such factors are found again."""
    plain, one = (
        parse(small(material=extra), name="r", folder=Path(), where="r").identity()
        for extra in ("", "area-weight-factor = 1.0")
    )
    assert plain == one
    assert "area_weight_factor" not in plain["material"]


def test_a_new_draw_does_not_move_the_others() -> None:
    plain, more = (
        Crew(make_recipe()).member(2),
        Crew(make_recipe(material="damping = { low = 0.0, high = 1e-3 }")).member(2),
    )
    assert more.parameters["damping"] != plain.parameters["damping"]
    for name in ("wind_speed", "area_weight", "bending"):
        assert more.parameters[name] == plain.parameters[name]
    np.testing.assert_array_equal(more.scene.position, plain.scene.position)


def test_handles_start_where_they_are_held() -> None:
    crew = Crew(make_recipe(scene='attachment = "hoist"'))
    held = list(crew.handles.vertices)
    assert len(held) == 5
    start = crew.member(0).scene.position
    np.testing.assert_allclose(start[held], [[0, 0, j / 4] for j in range(5)], atol=1e-12)
    # 90 draws of the declared 1 mm: four standard errors of a standard deviation, 1/√(2 n) each.
    noise = (start - upright(crew.mesh))[5:]
    assert noise.std() == pytest.approx(1e-3, rel=4 / np.sqrt(2 * noise.size))


def test_wind_blows_towards_its_angle_from_x_to_y() -> None:
    text = small().replace(
        "speed = { low = 0.0, high = 10.0 }", "speed = 2.0\ntoward = 1.5707963267948966"
    )
    scene = Crew(parse(text, name="r", folder=Path(), where="r")).member(0).scene
    np.testing.assert_allclose(scene.wind, [0, 2, 0], atol=1e-12)


def test_gusts_are_each_members_own() -> None:
    crew = Crew(make_recipe(more="[effects.gusts]\nintensity = 0.2"))
    members = [crew.member(index) for index in range(3)]
    times = torch.linspace(0, 0.2, 5).tolist()

    def winds(chosen: list) -> torch.Tensor:
        system, _ = crew.assemble(chosen)
        return torch.stack([system.wind.velocity(t) for t in times])

    together = winds(members)
    for place, member in enumerate(members):
        assert torch.equal(winds([member])[..., 0], together[..., place])
    still = torch.tensor([m.scene.wind for m in members]).T
    assert float((together[0] - still).abs().max()) > 0.1


def test_seeds_of_members_are_theirs_alone() -> None:
    crew, other = Crew(make_recipe()), Crew(make_recipe(top=""))
    seeds = [crew.seed(index) for index in range(100)]
    assert len(set(seeds)) == 100
    assert [other.seed(index) for index in range(100)] == seeds
    assert all(0 <= seed < 2**63 for seed in seeds)


@pytest.mark.parametrize(
    "effect", ["porosity", "shear", "hem-mass", "wagner-lag", "finite-span-loading", "pole-wake"]
)
def test_effects_are_named_by_their_registry(effect: str) -> None:
    parameters = "\n".join(
        f'{key.replace("_", "-")} = "prior"' for key in EFFECTS[effect].parameters()
    )
    crew = Crew(make_recipe(more=f"[effects.{effect}]\n{parameters}"))
    member = crew.member(0)
    for key, described in EFFECTS[effect].parameters().items():
        low, high = described.prior
        assert low <= member.parameters[f"{effect}.{key}"] <= high
    crew.assemble([member, crew.member(1)])
