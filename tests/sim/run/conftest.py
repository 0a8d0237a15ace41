"""Small recipes."""

from __future__ import annotations

from pathlib import Path

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
area-weight = {{ low = 0.10, high = 0.17 }}
bending-factors = {{ low = 0.1, high = 10.0 }}
{material}
[wind]
speed = {{ low = 0.0, high = 10.0 }}
[time]
settle = 0.1
frames = 4
{more}
"""


def small(*, top: str = "", scene: str = "", material: str = "", more: str = "") -> str:
    """The text of a small recipe of the search space, with additions to its tables."""
    return SMALL.format(top=top, scene=scene, material=material, more=more)


def make_recipe(**additions: str) -> Recipe:
    """That recipe, read."""
    return parse(small(**additions), name="small", folder=Path(), where="small.toml")
