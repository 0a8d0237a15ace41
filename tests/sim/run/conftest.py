"""Small recipes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from sim.run import Recipe, parse

SMALL = """
seed = 3
count = 6
batch = 4
{top}
[scene]
columns = 6
start-noise = 1e-3
{scene}
[material]
name = "camel-ponte-roma"
density = {{ low = 0.10, high = 0.17 }}
bending-factors = {{ low = 0.1, high = 10.0 }}
{material}
[wind]
speed = {{ low = 0.0, high = 10.0 }}
[time]
settle = 0.1
frames = 4
{more}
"""
MakeRecipe = Callable[..., Recipe]


@pytest.fixture
def small() -> Callable[..., str]:
    """The text of a small recipe of the search space, with additions to its tables."""

    def text(*, top: str = "", scene: str = "", material: str = "", more: str = "") -> str:
        return SMALL.format(top=top, scene=scene, material=material, more=more)

    return text


@pytest.fixture
def make_recipe(small: Callable[..., str]) -> MakeRecipe:
    """That recipe, read."""

    def make(**additions: str) -> Recipe:
        return parse(small(**additions), name="small", folder=Path(), where="small.toml")

    return make
