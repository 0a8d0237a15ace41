"""Observables of cloth whose motion is a formula."""

from __future__ import annotations

import math

import numpy as np
import pytest

from measure.observables import OBSERVABLES, Observable, View
from tests.measure.observables.shapes import HEIGHT, LENGTH, SIDE_ON, hinged, window

DROOPED = 0.3
SWING, BEAT = 0.1, 1.6


def value(name: str, *args: object, **options: object) -> float:
    found: Observable = OBSERVABLES[name]
    reading = found.of_cloth(window(*args, **options))  # type: ignore[arg-type]
    assert reading.reason is None
    return reading.value


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("droop", DROOPED),
        ("extension", 1.0),
        ("area", math.cos(DROOPED)),
        ("asymmetry", 0.0),
        ("outline-speed", 0.0),
    ],
)
def test_a_still_flag(name: str, expected: float) -> None:
    still = hinged(lambda t: DROOPED)
    assert value(name, still) == pytest.approx(expected, abs=0.02)  # a pixel of 1/120 of the length


@pytest.mark.parametrize("azimuth", [60.0, 90.0, 120.0])
def test_a_view_shortens_what_is_along_it(azimuth: float) -> None:
    view = View(azimuth=math.radians(azimuth))
    straight = hinged(lambda t: 0.0)
    assert value("extension", straight, view=view) == pytest.approx(
        math.sin(view.azimuth), abs=1e-6
    )
    assert value("area", straight, view=view) == pytest.approx(math.sin(view.azimuth), abs=0.02)


def test_the_hoist_gives_the_scale_from_any_elevation() -> None:
    """An upright hoist has the flag's height in the picture, as it is by it that people scale."""
    for elevation, distance in ((-0.3, math.inf), (0.0, 5.0), (0.4, 5.0)):
        seen = window(
            hinged(lambda t: 0.1), view=View(elevation=elevation, azimuth=1.2, distance=distance)
        )
        ends = seen.points[:, [seen.hoist[0], seen.hoist[-1]]]
        np.testing.assert_allclose(ends[:, 0, 1] - ends[:, 1, 1], HEIGHT, rtol=1e-9)


def test_what_is_nearer_looks_larger() -> None:
    """The free edge of a flag that flies at 45° to a camera 6 m from its middle, against the
    pinhole's formula: the hoist is nearer by a, the free edge farther by a, both a aside; lengths
    are scaled by the hoist's."""
    view = View(azimuth=math.radians(45), distance=6.0)
    seen = window(hinged(lambda t: 0.0), view=view)
    a = LENGTH / 2 / math.sqrt(2)
    aside = a * 6.0 / (6.0 + a) + a * 6.0 / (6.0 - a)
    np.testing.assert_allclose(seen.free_edge[:, 0], aside * (6.0 - a) / 6.0, rtol=1e-9)


def test_a_swing_has_its_speed_frequency_and_amplitude() -> None:
    swing = hinged(lambda t: SWING * math.sin(2 * math.pi * BEAT * t))
    rate = 2 * math.pi * BEAT
    assert value("droop", swing) == pytest.approx(0.0, abs=1e-3)
    assert value("amplitude-up", swing) == pytest.approx(
        SWING * LENGTH / math.sqrt(2) / HEIGHT, rel=0.03
    )
    assert value("amplitude-across", swing) == pytest.approx(0.0, abs=0.01)
    assert value("frequency", swing) == pytest.approx(BEAT, abs=0.03)
    # Central differences over 80 ms see sin(x)/x of a speed, x = ω · 40 ms; the mean of the middle
    # third is at half.
    seen = math.sin(rate * 0.04) / (rate * 0.04)
    assert value("middle-speed", swing) == pytest.approx(
        SWING * rate / 2 / math.sqrt(2) * seen, rel=0.04
    )
    # Both long edges move up and down by u φ', the free edge along itself: the mean of |φ'| u/L
    # beyond 15 % of L.
    swept = 2 * LENGTH * (1 - 0.15**2) / 2 * SWING * rate * 2 / math.pi * seen
    assert value("outline-speed", swing) == pytest.approx(
        swept / (2 * 0.85 * LENGTH + HEIGHT), rel=0.05
    )


def test_two_beats_have_a_bandwidth() -> None:
    """Two frequencies of the same power: their mean, and half of their distance."""
    swing = hinged(
        lambda t: 0.05 * (math.sin(2 * math.pi * 1.2 * t) + math.sin(2 * math.pi * 4.0 * t))
    )
    assert value("frequency", swing) == pytest.approx(2.6, abs=0.15)
    assert value("bandwidth", swing) == pytest.approx(1.4, abs=0.1)


def test_a_travelling_wave_has_its_speed_and_length() -> None:
    length, beat = 1.2, 2.0  # m, Hz

    def motion(u: np.ndarray, v: np.ndarray, t: float) -> tuple[np.ndarray, ...]:
        return u, 0 * u, v + 0.12 * u / LENGTH * np.sin(2 * np.pi * (u / length - beat * t))

    assert value("wave-length", motion) == pytest.approx(length / LENGTH, rel=0.05)
    assert value("wave-speed", motion) == pytest.approx(length * beat / LENGTH, rel=0.08)


def test_what_a_window_does_not_show_is_a_reason_and_no_number() -> None:
    still = hinged(lambda t: DROOPED)
    swing = hinged(lambda t: SWING * math.sin(2 * math.pi * BEAT * t))
    end_on = View(azimuth=0.02)
    shown = {
        ("frequency", "no-motion"): window(still),
        ("bandwidth", "no-motion"): window(still),
        ("wave-speed", "no-wave"): window(swing),  # all of it at once
        ("droop", "edge-on"): window(still, view=end_on),
        ("middle-speed", "few-frames"): window(swing, seconds=0.5),
    }
    for (name, reason), cloth in shown.items():
        reading = OBSERVABLES[name].of_cloth(cloth)
        assert reading.reason == reason
        assert math.isnan(reading.value)


@pytest.mark.parametrize("name", list(OBSERVABLES))
def test_every_observable_is_the_same_from_the_other_side_and_at_another_rate(name: str) -> None:
    def motion(u: np.ndarray, v: np.ndarray, t: float) -> tuple[np.ndarray, ...]:
        wave = 0.1 * u / LENGTH * np.sin(2 * np.pi * (u / 1.4 - 1.8 * t))
        return 0.9 * u, wave, v - 0.2 * u + wave

    found: Observable = OBSERVABLES[name]
    assert found.name == name
    assert found.unit in ("1", "rad", "1/s", "Hz")
    assert found.meaning
    assert found.blind
    plain = value(name, motion)
    behind = value(name, motion, view=View(azimuth=-SIDE_ON.azimuth))
    assert behind == pytest.approx(plain, rel=0.03, abs=0.02)
    assert value(name, motion, rate=50.0) == pytest.approx(plain, rel=0.03, abs=0.02)


@pytest.mark.parametrize(("sag", "expected"), [(0.0, 0.0), (0.15, 0.15), (0.3, 0.3), (-0.15, 0.0)])
def test_cloth_that_departs_from_the_pole_between_its_corners_is_its_bulge(
    sag: float, expected: float
) -> None:
    """A parabola of a depth [m] between two held corners; what bulges to the pole's other side
    counts as on it."""

    def held(u: np.ndarray, v: np.ndarray, t: float) -> tuple[np.ndarray, ...]:
        return u + sag * (1 - (2 * v / HEIGHT) ** 2) * (1 - u / LENGTH), 0 * u, v

    mean = 1 - 0.9**2 / 3  # of the parabola over the middle 90 % of the hoist
    assert value("hoist-bulge", held) == pytest.approx(expected * mean / LENGTH, abs=1 / 240)


def test_a_hoist_that_is_held_along_its_length_has_no_bulge() -> None:
    assert value("hoist-bulge", hinged(lambda t: 0.3 + 0.1 * math.sin(9 * t))) == pytest.approx(
        0.0, abs=1 / 240
    )
