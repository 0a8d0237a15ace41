"""The edge that cloth is attached to, as the mask network places it."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from models.conditioning import Stills, conditioning_of, halve_picture
from models.conditioning.outline import Hoist, hoist_of
from tests.measure.gate.test_counted import FLAG, drawn


def hoist(upper: tuple[float, float], lower: tuple[float, float]) -> Hoist:
    still = np.zeros((4, 4), np.uint8)
    return Hoist(
        stills=Stills(usual=still, least=still, greatest=still),
        logits=torch.zeros(1, 3, 4, 4),
        ends=np.array([upper, lower]),
        certainty=1.0,
    )


def test_a_hoist_leans_by_the_angle_from_its_upper_to_its_lower_end_and_the_downright() -> None:
    for angle in (0.0, 19.0, 90.0, 180.0):
        across, down = math.sin(math.radians(angle)), math.cos(math.radians(angle))
        for side in (-1, 1):
            found = hoist((5.0, 5.0), (5.0 + side * 20 * across, 5.0 + 20 * down))
            assert math.degrees(found.lean) == pytest.approx(angle, abs=1e-6)


def test_both_ends_of_a_drawn_flag_s_hoist_are_placed_and_turned_with_the_film() -> None:
    film = drawn()
    found = conditioning_of(film, size=300)
    (placed,) = found.hoists()
    assert placed.certainty > 0.5
    x, y, _, height = FLAG
    step = found.square.side / found.size
    ends = 2 * step * placed.ends + (found.square.x, found.square.y)
    np.testing.assert_allclose(ends, [(x, y), (x, y + height)], atol=6)
    (mirrored,) = conditioning_of(np.ascontiguousarray(film[:, :, ::-1]), size=300).hoists()
    np.testing.assert_allclose(150 - mirrored.ends[:, 0], placed.ends[:, 0], atol=3)


def test_few_and_small_pictures_show_no_hoist() -> None:
    film = drawn()
    assert list(conditioning_of(film[:9], size=300).hoists()) == []
    assert list(conditioning_of(film, size=120).hoists()) == []
    assert hoist_of(np.stack([halve_picture(frame) for frame in film[:9]])) is None


def test_a_hoist_has_cloth_beside_it_where_the_network_sees_some() -> None:
    """Of 40 rows of the hoist 30 have cloth to the right of it in one of two pictures, all 40 in
    the other."""
    still = np.zeros((60, 60), np.uint8)
    logits = torch.full((2, 3, 60, 60), -9.0)
    logits[0, 0, 10:40, 22:50] = logits[1, 0, 10:50, 22:50] = 9.0
    found = Hoist(
        stills=Stills(usual=still, least=still, greatest=still),
        logits=logits,
        ends=np.array([(20.0, 10.0), (20.0, 50.0)]),
        certainty=1.0,
    )
    assert found.side == 1.0
    assert found.length == 40.0
    assert found.held == pytest.approx((30 / 40 + 1) / 2)
    assert hoist((20.0, 50.0), (20.0, 50.0)).held == 0.0


def test_a_long_film_is_looked_at_in_parts_too() -> None:
    film = np.concatenate([drawn(), drawn()])
    for seconds, hoists in ((9.0, 1), (10.5, 3), (60.0, 5)):
        times = np.linspace(0, seconds, len(film))
        assert len(list(conditioning_of(film, size=300, times=times).hoists())) == hoists
    few = conditioning_of(film[::4], size=300, times=np.linspace(0, 60, 30))
    assert len(list(few.hoists())) == 1 + 3
