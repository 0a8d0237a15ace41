"""Directions of 0 in tables of whole tens: calm air where 360 is north anywhere in the file, else doubted."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.signals import WindLog

Read = Callable[..., WindLog]
Write = Callable[..., Path]


def rows(turns: list[int], speeds: list[float] | None = None) -> str:
    """Hourly rows of one site."""
    lines = [f"2026-05-01 {hour:02d}:00,{(speeds or [4.0] * 24)[hour]},{turn}" for hour, turn in enumerate(turns)]
    return "time,ws [m/s],wd [deg]\n" + "\n".join(lines) + "\n"


def doubts(log: WindLog) -> list[str]:
    return [found.what for found in log.findings if found.kind == "north-or-calm"]


_TENS = [10 * (1 + hour % 34) for hour in range(20)]


def test_a_zero_among_whole_tens_without_a_north_is_doubted(read: Read) -> None:
    log = read(rows([*_TENS, 350, 0]), zone="UTC")
    assert doubts(log)
    assert log.series.channels["wind_direction"][-1] == 0.0


def test_a_zero_beside_a_north_is_calm_and_not_doubted(read: Read) -> None:
    log = read(rows([*_TENS, 360, 0]), zone="UTC")
    assert not doubts(log)
    assert np.isnan(log.series.channels["wind_direction"][-1])


@pytest.mark.parametrize("turns", [[*_TENS, 350, 340], [*(turn + 3 for turn in _TENS), 350, 0]])
def test_without_a_zero_or_in_whole_degrees_nothing_is_doubted(read: Read, turns: list[int]) -> None:
    assert not doubts(read(rows(turns), zone="UTC"))


def test_a_zero_at_a_speed_of_nothing_is_calm_anyway(read: Read) -> None:
    assert not doubts(read(rows([*_TENS, 350, 0], [*[4.0] * 21, 0.0]), zone="UTC"))
