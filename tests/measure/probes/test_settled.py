"""What a recording settles at, of motions whose figures are known."""

from __future__ import annotations

import numpy as np
import pytest

from measure.probes.settled import NAMES, settling_of

PERIOD, WIDTH, HEIGHT = 0.04, 1.5, 1.0
U, V = (part.ravel() for part in np.meshgrid(np.linspace(0, WIDTH, 16), np.linspace(0, HEIGHT, 11)))
TIMES = PERIOD * np.arange(250)


def found(positions: np.ndarray, noise: float = 0.0) -> dict[str, float]:
    values = settling_of(np.stack([U, V], axis=1), positions, period=PERIOD, noise=noise)
    return dict(zip(NAMES, values.tolist(), strict=True))


def swinging(amplitude: float) -> np.ndarray:
    """A sheet whose fly swings across by an amplitude of that share of u at 0.5 Hz; its hoist
    stands still."""
    across = amplitude * np.sin(np.pi * TIMES)[:, None] * U / WIDTH
    return np.stack(
        [np.broadcast_to(U, across.shape), across, np.broadcast_to(V, across.shape)], axis=-1
    )


def test_a_sheet_that_hangs_by_an_angle_and_is_folded_has_that_droop_and_extension() -> None:
    angle, folded = np.radians(30), 0.8
    line = np.stack([folded * U * np.cos(angle), 0 * U, V - folded * U * np.sin(angle)], axis=-1)
    values = found(np.broadcast_to(line, (len(TIMES), *line.shape)))
    assert values["droop"] == pytest.approx(angle)
    # Edges are the outer eighths of the width: their middles are 14/15 of it apart.
    assert values["extension"] == pytest.approx(folded * 14 / 15)


def test_amplitude_and_speed_are_those_of_the_motion() -> None:
    once, twice = found(swinging(0.1)), found(swinging(0.2))
    for name in ("speed", "amplitude"):
        assert twice[name] - once[name] == pytest.approx(np.log(2), abs=1e-6)
    # The outer two columns swing by 14/15 of the amplitude of the edge and by all of it.
    expected = 0.1 / np.sqrt(2) * np.sqrt(np.mean([1, (14 / 15) ** 2])) / HEIGHT
    assert np.exp(once["amplitude"]) == pytest.approx(expected, rel=1e-3)


def test_a_hoist_that_stands_still_is_far_below_one_that_bulges() -> None:
    still = swinging(0.1)
    still[:, U < 0.12 * WIDTH] = still[:1, U < 0.12 * WIDTH]
    assert found(swinging(0.1))["hoist amplitude"] - found(still)["hoist amplitude"] > 2


def test_noise_of_the_markers_is_taken_out() -> None:
    jitter = 2e-3 * np.random.default_rng(1).normal(size=(*swinging(0.1).shape,))
    clean, noisy = found(swinging(0.1)), found(swinging(0.1) + jitter, noise=2e-3)
    assert noisy["speed"] == pytest.approx(clean["speed"], abs=0.03)
    assert noisy["amplitude"] == pytest.approx(clean["amplitude"], abs=0.01)
