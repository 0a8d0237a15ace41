"""Stations that share their stamps, in tables of any script, are artifacts of their own; their units are read."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.ingest.anemometer import WindOptions, anemometers, read_log
from flagdata.ingest.anemometer.words.headings import understand

Write = Callable[[str], Path]

_POINTS = {"東": 90.0, "南": 180.0, "西北": 315.0, "北": 0.0}


def _at_once(heading: str, minutes: int = 1) -> str:
    rows = [
        f"2026-05-01 12:{minute:02d},{'甲乙丙丁'[at]}山,{point},{2 + at + minute / 10}\n"
        for minute in range(minutes) for at, point in enumerate(_POINTS)
    ]  # fmt: skip
    return heading + "\n" + "".join(rows)


@pytest.mark.parametrize("name", ["氣象站", "测站", "どこ", "wo", "지점명"])
@pytest.mark.parametrize("minutes", [1, 2])
def test_each_row_of_a_stamp_is_a_station(log_file: Write, name: str, minutes: int) -> None:
    path = log_file(_at_once(f"日期時間,{name},風向,風速（公里/小時）", minutes))
    zone = WindOptions(zone="UTC")
    labels = anemometers(path, zone)
    assert sorted(labels) == sorted(f"{sign}山" for sign in "甲乙丙丁")
    for at, (sign, degrees) in enumerate(zip("甲乙丙丁", _POINTS.values(), strict=True)):
        series = read_log(path, WindOptions(zone="UTC", wind=f"{sign}山")).series
        assert len(series.time) == minutes
        assert series.time[0] == 1_777_636_800 * 10**9
        assert series.channels["wind_speed"][0] == pytest.approx((2 + at) / 3.6)
        assert np.degrees(series.channels["wind_direction"][0]) == pytest.approx(degrees)


def test_a_station_in_calm_air_says_so_in_both_columns_and_is_not_lost(log_file: Write) -> None:
    rows = [f"2026-05-01 12:00,{sign}山,北,{3 + at}" for at, sign in enumerate("甲乙丙丁己庚辛壬癸子丑寅")]
    rows = [*rows, "2026-05-01 12:00,戊山,無風,無風"]
    path = log_file("日期時間,測站,風向（方位點）,風速（公里/小時）\n" + "\n".join(rows) + "\n")
    assert "戊山" in anemometers(path, WindOptions(zone="UTC"))
    log = read_log(path, WindOptions(zone="UTC", wind="戊山"))
    assert log.series.channels["wind_speed"].tolist() == [0.0]
    assert np.isnan(log.series.channels["wind_direction"]).all()


def test_rows_of_one_stamp_that_nothing_tells_apart_are_doubted_with_a_way_to_part_them(log_file: Write) -> None:
    path = log_file("time,memo,wind (m/s)\n" + "".join(f"2026-05-01 12:00,{at},{at}.5\n" for at in range(4)))
    (held,) = [found for found in read_log(path, WindOptions(zone="UTC")).findings if found.kind == "held-stamps"]
    assert held.fix is not None
    assert "site" in held.fix


@pytest.mark.parametrize(
    ("heading", "unit"),
    [
        ("風速（公里/小時）", "km/h"), ("风速(公里/小时)", "km/h"), ("风速（千米/小时）", "km/h"),
        ("平均風速（km/時）", "km/h"),
        ("风速(米/秒)", "m/s"), ("風速(m/秒)", "m/s"), ("風速(メートル/秒)", "m/s"), ("風速（節）", "kn"),
        ("风速(节)", "kn"),
        ("風速(ノット)", "kn"), ("風速（海里/小時）", "kn"), ("풍속(미터/초)", "m/s"),
    ],
)  # fmt: skip
def test_units_in_headings_of_the_far_east(heading: str, unit: str) -> None:
    said = understand(heading)
    assert (said.channel, said.unit) == ("wind_speed", unit)
    gust = understand(f"最高陣風{heading}")
    assert gust.spread
