"""A speed that hardly varies is of a wind tunnel or of another quantity; km/h beyond every wind are doubted."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from flagdata.rng import stream
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
ROWS = 60


def kinds(read: Read, values: np.ndarray, *, unit: str = "km/h", step: int = 60) -> list[str]:
    stamps = np.datetime64("2026-05-13T12:00:00") + np.arange(ROWS) * np.timedelta64(step, "s")
    rows = "".join(f"{stamp}Z,{value:.3f}\n" for stamp, value in zip(stamps, values, strict=True))
    return [finding.kind for finding in read(f"time,wind speed ({unit})\n{rows}").findings]


def intense(mean: float, intensity: float) -> np.ndarray:
    """Speeds of a mean and a turbulence intensity, both exact."""
    drawn = stream(0, "steady").normal(size=ROWS)
    return mean * (1 + intensity * (drawn - drawn.mean()) / drawn.std())


@pytest.mark.parametrize(("mean", "intensity", "told"), [(91.5, 0.001, 1), (60.0, 0.015, 1), (60.0, 0.04, 0)])
def test_a_speed_that_hardly_varies_is_told(read: Read, mean: float, intensity: float, told: int) -> None:
    assert kinds(read, intense(mean, intensity)).count("steady-wind") == told


def test_neither_a_short_log_nor_a_calm_one_is(read: Read) -> None:
    assert "steady-wind" not in kinds(read, intense(30.0, 0.001), step=5)
    assert "steady-wind" not in kinds(read, intense(2.0, 0.001))


@pytest.mark.parametrize(("mean", "told"), [(60.0, 0), (327.0, 1)])
def test_a_median_in_kilometres_an_hour_that_no_wind_has_is_doubted(read: Read, mean: float, told: int) -> None:
    assert kinds(read, intense(mean, 0.1)).count("unit-doubtful") == told
