"""Values that no wind, vane or air can have are no ground truth, and are said."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from flagdata.ingest.anemometer import average
from flagdata.schema import SampleFlag
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
HEAD = "time,wind_speed,wind_direction,air_temperature,air_pressure,relative_humidity\n"


def table(*rows: str) -> str:
    """A plain table with a row a second: speed, direction [deg], temperature [°C], pressure [hPa], humidity [%]."""
    return HEAD + "".join(f"2026-05-01T12:00:{second:02d}Z,{row}\n" for second, row in enumerate(rows))


def out_of_range(log: WindLog) -> list[tuple[int, str | None, str]]:
    return [(f.count, f.where, f.what) for f in log.findings if f.kind == "out-of-range"]


@pytest.mark.parametrize("speed", ["1e30", "-1e30", "1e308", "151", "999.9"])
def test_an_impossible_speed_is_flagged_reported_and_in_no_mean(read: Read, speed: str) -> None:
    log = read(table("4,10,20,1013,50", f"{speed},10,20,1013,50", "5,10,20,1013,50", f"{speed},10,20,1013,50"))
    assert [bool(flag & SampleFlag.OUT_OF_RANGE) for flag in log.series.flags] == [False, True, False, True]
    ((count, where, what),) = out_of_range(log)
    assert (count, where) == (2, "line 3")
    assert "wind_speed" in what
    assert average(log.series, 10.0).speed == pytest.approx([4, 5])  # bins that end at 12:00:00 and 12:00:10


@pytest.mark.parametrize("angle", ["999", "361", "-181", "1e30"])
def test_an_impossible_direction_is_left_out_and_not_wrapped(read: Read, angle: str) -> None:
    log = read(table("4,10,20,1013,50", f"4,{angle},20,1013,50"))
    direction = np.degrees(log.series.channels["wind_direction"])
    assert direction[0] == pytest.approx(10)
    assert np.isnan(direction[1])
    ((count, where, what),) = out_of_range(log)
    assert (count, where) == (1, "line 3")
    assert "wind_direction" in what
    assert not log.series.flags.any()  # the speed beside it is as good as ever


def test_signed_directions_and_full_circles_are_possible(read: Read) -> None:
    log = read(table("4,-180,20,1013,50", "4,-90,20,1013,50", "4,360,20,1013,50"))
    assert np.degrees(log.series.channels["wind_direction"]) == pytest.approx([180, 270, 0])
    assert out_of_range(log) == []


@pytest.mark.parametrize(
    ("row", "channel"),
    [
        ("4,10,999,1013,50", "air_temperature"),
        ("4,10,20,0,50", "air_pressure"),
        ("4,10,20,1013,400", "relative_humidity"),
    ],
)
def test_impossible_air_is_left_out_and_leaves_the_wind_usable(read: Read, row: str, channel: str) -> None:
    log = read(table("4,10,20,1013,50", row))
    assert np.isfinite(log.series.channels[channel]).tolist() == [True, False]
    ((count, where, what),) = out_of_range(log)
    assert (count, where) == (1, "line 3")
    assert channel in what
    assert not log.series.flags.any()


RECIPE = """
name = "vane"
about = "a vane with a range"
source = "a test"
[time]
columns = ["time"]
format = "iso"
[channels.wind_speed]
column = "speed"
unit = "m/s"
range = [0, 60]
[channels.wind_direction]
column = "direction"
unit = "deg"
{vane}
[sensor]
name = "vane"
"""


def test_a_recipe_narrows_what_is_possible_and_each_value_is_reported_once(read: Read, tmp_path) -> None:
    recipe = tmp_path / "vane.toml"
    recipe.write_text(RECIPE.format(vane="rotation = 20"))
    rows = "2026-05-01T12:00:00Z,59,350\n2026-05-01T12:00:01Z,61,350\n2026-05-01T12:00:02Z,1e9,350\n"
    log = read("time,speed,direction\n" + rows, recipe=str(recipe))
    assert [count for count, _, _ in out_of_range(log)] == [2]
    assert np.degrees(log.series.channels["wind_direction"]) == pytest.approx([10, 10, 10])


def test_an_offset_that_turns_a_vane_past_north_is_no_defect(read: Read, tmp_path) -> None:
    recipe = tmp_path / "vane.toml"
    recipe.write_text(RECIPE.format(vane="offset = 45"))
    log = read("time,speed,direction\n2026-05-01T12:00:00Z,5,350\n", recipe=str(recipe))
    assert np.degrees(log.series.channels["wind_direction"]) == pytest.approx([35])
    assert out_of_range(log) == []


def test_an_impossible_angle_of_a_stream_is_left_out_and_said(read: Read) -> None:
    def sentence(body: str) -> str:
        total = 0
        for character in body:
            total ^= ord(character)
        return f"${body}*{total:02X}\r\n"

    lines = [
        sentence(body)
        for body in (
            "GPZDA,120000.00,01,05,2026,00,00", "WIMWV,010.0,R,5.0,M,A", "WIMWV,999.0,R,5.0,M,A",
            "WIMWV,010.0,R,5.0,M,A", "GPZDA,120004.00,01,05,2026,00,00",
        )
    ]  # fmt: skip
    log = read("".join(lines))
    angle = np.degrees(log.series.channels["apparent_wind_direction"])
    assert np.isnan(angle).tolist() == [False, True, False]
    assert [(count, where) for count, where, _ in out_of_range(log)] == [(1, "line 3")]


def test_a_stamp_of_a_clock_that_was_not_set_is_said_to_be_outside_the_years(read: Read) -> None:
    rows = ["2026-05-01T12:00:00Z,3", "1900-01-01T00:00:00Z,3", "2026-05-01T12:00:02Z,3", "2026-05-01T12:00:03Z,3"]
    log = read("time,wind_speed\n" + "\n".join(rows) + "\n")
    (finding,) = [f for f in log.findings if f.kind == "unreadable-stamps"]
    assert (finding.count, finding.where) == (1, "line 3")
    assert "outside the accepted years, 1970 to 2200" in finding.what
    assert "iso" not in finding.what
