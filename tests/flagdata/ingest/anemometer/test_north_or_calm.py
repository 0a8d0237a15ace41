"""Directions of 0 in tables of whole tens: calm air where 360 is north anywhere in the file, else doubted."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError, UsageError
from flagdata.ingest.anemometer.log import read_log
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.signals import WindLog
from flagdata.timebase import parse

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


def test_what_stands_for_calm_air_is_a_rule_of_all_sites(log_file: Write) -> None:
    turns = [*_TENS, 360, 0]
    lines = [f"S{at:02d},2026-05-01T12:00:00Z,3,{turn}" for at, turn in enumerate(turns)]
    path = log_file("station_id,observation_time,wind_speed_kt,wind_dir_degrees\n" + "\n".join(lines) + "\n")
    north, calm = (read_log(path, WindOptions(wind=f"S{at:02d}")) for at in (len(turns) - 2, len(turns) - 1))
    assert north.series.channels["wind_direction"][0] == pytest.approx(0.0)
    assert np.isnan(calm.series.channels["wind_direction"][0])
    assert [found for found in calm.findings if found.kind == "code-for-missing"]


def test_dates_before_1970_are_refused_with_a_step_that_works(log_file: Write) -> None:
    path = log_file("Yr,Mo,Dy,RPT\n" + "".join(f"61,1,{day},{10 + day % 5}.5\n" for day in range(1, 21)))
    with pytest.raises(InputError) as caught:
        read_log(path, WindOptions(wind="RPT", unit="kn", zone="UTC"))
    assert "a TIME from 1970 on" in (caught.value.fix or "")
    with pytest.raises(UsageError, match="before 1970"):
        read_log(path, WindOptions(columns=",,,wind_speed[kn]", start=parse("1961-01-01T00:00:00Z"), rate=1 / 86_400))
    log = read_log(path, WindOptions(columns=",,,wind_speed[kn]", start=parse("1971-01-01T00:00:00Z"), rate=1 / 86_400))
    assert len(log.series.time) == 20
