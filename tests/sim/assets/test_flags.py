"""Flags at points of their construction sheets: height 1, x to the right, y downwards from the
upper hoist corner."""

from __future__ import annotations

import math

import numpy as np
import pytest

from sim.assets import Assets
from sim.assets.colour import of_hex
from sim.assets.flags import FLAGS

WHITE, BLACK = "#ffffff", "#000000"


def at(name: str, x: float, y: float) -> list[int]:
    """The colour at a place."""
    image = Assets().texture(f"flag/{name}")
    return image[int(y * image.shape[0]), int(x * image.shape[0])].tolist()


def polar(x: float, y: float, radius: float, clockwise_from_up: float) -> tuple[float, float]:
    turn = math.radians(clockwise_from_up)
    return x + radius * math.sin(turn), y - radius * math.cos(turn)


DIAGONAL = math.atan2(2, 3)
POINTS: dict[str, list[tuple[float, float, str]]] = {
    "chile": [
        (0.02, 0.02, "#0039a6"),
        (0.49, 0.49, "#0039a6"),
        (0.51, 0.25, WHITE),
        (0.25, 0.25, WHITE),
        (0.01, 0.51, "#d52b1e"),
        (*polar(0.25, 0.25, 0.105, 0), WHITE),
        (*polar(0.25, 0.25, 0.10, 36), "#0039a6"),
        (*polar(0.25, 0.25, 0.13, 72), "#0039a6"),
    ],
    "china": [
        (1.4, 0.9, "#ee1c25"),
        (0.25, 0.25, "#ffff00"),
        (*polar(0.25, 0.25, 0.13, 0), "#ffff00"),
        (*polar(0.25, 0.25, 0.12, 36), "#ee1c25"),
        (0.5, 0.1, "#ffff00"),
        (0.6, 0.2, "#ffff00"),
        (0.6, 0.35, "#ffff00"),
        (0.5, 0.45, "#ffff00"),
        # One point of each small star towards the middle of the large one, its notch on the other
        # side.
        (0.5 - 0.035 * 0.857, 0.1 + 0.035 * 0.515, "#ffff00"),
        (0.5 + 0.04 * 0.857, 0.1 - 0.04 * 0.515, "#ee1c25"),
    ],
    "czechia": [
        (0.01, 0.5, "#11457e"),
        (0.74, 0.5, "#11457e"),
        (0.77, 0.49, WHITE),
        (0.77, 0.51, "#d7141a"),
        (0.375, 0.24, WHITE),
        (0.375, 0.26, "#11457e"),
        (0.375, 0.76, "#d7141a"),
    ],
    "france": [
        (0.49, 0.5, "#000091"),
        (0.51, 0.5, WHITE),
        (0.99, 0.5, WHITE),
        (1.01, 0.5, "#e1000f"),
    ],
    "greece": [
        (1.0, 0.05, "#0d5eaf"),
        (1.0, 0.15, WHITE),
        (1.0, 0.95, "#0d5eaf"),
        (0.1, 0.1, "#0d5eaf"),
        (0.27, 0.1, WHITE),
        (0.1, 0.27, WHITE),
        (0.54, 0.54, "#0d5eaf"),
        (0.57, 0.38, WHITE),
        (0.2, 0.6, WHITE),
        (0.2, 0.7, "#0d5eaf"),
    ],
    "italy": [(0.49, 0.5, "#008c45"), (0.51, 0.5, "#f4f5f0"), (1.01, 0.5, "#cd212a")],
    "japan": [
        (0.75, 0.5, "#bc002d"),
        (0.75, 0.205, "#bc002d"),
        (0.75, 0.195, WHITE),
        (1.045, 0.5, "#bc002d"),
        (1.055, 0.5, WHITE),
    ],
    "netherlands": [
        (0.7, 0.32, "#ae1c28"),
        (0.7, 0.345, WHITE),
        (0.7, 0.66, WHITE),
        (0.7, 0.68, "#21468b"),
    ],
    "south-africa": [
        (1.0, 0.2, "#e03c31"),
        (1.0, 0.8, "#001489"),
        (1.2, 0.5, "#007749"),
        (1.2, 0.59, "#007749"),
        (1.2, 0.61, WHITE),
        (1.2, 0.66, WHITE),
        (1.2, 0.675, "#001489"),
        (0.05, 0.5, BLACK),
        (0.3, 0.2, "#007749"),
        # Across the arm from its line (0, 0) – (3/4, 1/2): green to 1/10, then gold or white to
        # 1/6.
        (0.3 - 0.13 * 0.5547, 0.2 + 0.13 * 0.8321, "#ffb81c"),
        (0.3 + 0.13 * 0.5547, 0.2 - 0.13 * 0.8321, WHITE),
        (0.3 - 0.18 * 0.5547, 0.2 + 0.18 * 0.8321, BLACK),
        (0.3 + 0.18 * 0.5547, 0.2 - 0.18 * 0.8321, "#e03c31"),
    ],
    "south-korea": [
        (0.75, 0.3, "#cd2e3a"),
        (0.75, 0.7, "#0047a0"),
        (0.75, 0.24, WHITE),
        # The red head towards the upper hoist, the blue one towards the lower fly.
        (0.75 - 0.125 * math.cos(DIAGONAL), 0.5 - 0.125 * math.sin(DIAGONAL) + 0.06, "#cd2e3a"),
        (0.75 + 0.125 * math.cos(DIAGONAL), 0.5 + 0.125 * math.sin(DIAGONAL) - 0.06, "#0047a0"),
    ]
    + [
        # Bars at 9.5, 11 and 12.5 twenty-fourths of the height from the middle; in their middles
        # broken ones are white.
        (
            0.75 + sx * r / 24 * math.cos(DIAGONAL),
            0.5 + sy * r / 24 * math.sin(DIAGONAL),
            BLACK if whole else WHITE,
        )
        for sx, sy, bars in (
            (-1, -1, (True, True, True)),
            (1, 1, (False, False, False)),
            (-1, 1, (True, False, True)),
            (1, -1, (False, True, False)),
        )
        for r, whole in zip((9.5, 11, 12.5), bars, strict=True)
    ],
    "turkey": [
        (0.02, 0.5, "#e30a17"),
        (0.255, 0.5, WHITE),
        (0.355, 0.5, WHITE),
        (0.37, 0.5, "#e30a17"),
        (0.55, 0.5, "#e30a17"),
        (0.69, 0.5, "#e30a17"),
        (0.705, 0.5, WHITE),
        (0.82, 0.5, WHITE),
        (0.90, 0.5, "#e30a17"),
        (0.5, 0.26, WHITE),
        (0.5, 0.24, "#e30a17"),
    ],
    "ukraine": [(0.7, 0.495, "#0057b7"), (0.7, 0.505, "#ffd700")],
}


@pytest.mark.parametrize("name", sorted(POINTS))
def test_a_flag_has_its_sheets_colours_at_its_sheets_places(name) -> None:
    for x, y, colour in POINTS[name]:
        assert at(name, x, y) == np.rint(of_hex(colour) * 255).astype(int).tolist(), (x, y)


def test_twelve_flags_of_two_to_three_each_with_its_source() -> None:
    assert len(FLAGS) == 12
    assert set(FLAGS) == set(POINTS)
    for name, flag in FLAGS.items():
        height, width, _ = Assets().texture(f"flag/{name}").shape
        assert 2 * width == 3 * height
        assert flag.source
        assert flag.country


@pytest.mark.parametrize(
    ("name", "areas"),
    [
        ("japan", {"#bc002d": math.pi * 0.3**2}),
        ("chile", {"#d52b1e": 0.75}),
        ("czechia", {"#11457e": 0.375, "#d7141a": 0.5625}),
        ("south-korea", {"#cd2e3a": math.pi / 32, "#0047a0": math.pi / 32}),  # halves of a disc
    ],
)
def test_areas_of_colours_are_those_of_the_shapes(name, areas) -> None:
    image = Assets().texture(f"flag/{name}")
    for colour, area in areas.items():
        share = (image == np.rint(of_hex(colour) * 255)).all(axis=2).sum() / image.shape[0] ** 2
        assert share == pytest.approx(
            area, abs=0.008
        )  # pixels on a shape's edge, up to 3 heights of it, are mixed


def test_edges_are_mixed_in_proportion() -> None:
    image = Assets().texture("flag/greece").astype(int)  # 384 rows are 42 2/3 a stripe
    column = image[40:46, -1, 0]
    assert column[0] == column[1] == 0x0D
    assert 0x0D < column[2] < 255
    assert column[3] == 255
