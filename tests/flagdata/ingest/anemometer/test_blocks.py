"""Readings of several lines, dictionaries, and lines after times of day: what prints of programs look like."""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from operator import xor
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer import WindOptions, read_log
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
Write = Callable[[str], Path]
_START = 1_777_636_800 * 10**9
"""2026-05-01T12:00:00Z."""
_DAY = np.datetime64("2026-05-01").astype(object)


def since_start(log: WindLog) -> list[float]:
    return ((log.series.time - _START) / 1e9).tolist()


def sentence(text: str) -> str:
    return f"${text}*{reduce(xor, text.encode(), 0):02X}\n"


@pytest.mark.parametrize("rule", ["", "\n", "------------\n", "*** new reading ***\n"])
@pytest.mark.parametrize("sign", [": ", " = ", ":\t"])
def test_a_reading_of_several_lines_is_a_row(read: Read, sign: str, rule: str) -> None:
    text = "".join(
        f"{rule}Time{sign}2026-05-01 12:00:{at:02d}\n"
        f"Wind Speed{sign}{3 + at / 10:.1f} km/h\nWind Direction{sign}{231 + at}\n"
        for at in range(8)
    )
    log = read(text, zone="UTC")
    assert since_start(log) == [float(at) for at in range(8)]
    assert log.series.channels["wind_speed"].tolist() == pytest.approx([(3 + at / 10) / 3.6 for at in range(8)])
    assert np.degrees(log.series.channels["wind_direction"]).tolist() == pytest.approx([231.0 + at for at in range(8)])


def test_the_stamp_of_the_first_line_is_that_of_the_reading(read: Read) -> None:
    text = "".join(
        f"12:00:{at:02d}.250 -> Wind Speed: {3 + at / 10:.1f} m/s\n12:00:{at:02d}.900 -> Humidity: 51 %\n"
        for at in range(8)
    )
    assert since_start(read(text, zone="UTC", date=_DAY)) == [at + 0.25 for at in range(8)]


def blocks(rule: str = "") -> list[list[str]]:
    return [
        [f"{rule}Time: 2026-05-01 12:00:{at:02d}", f"Wind Speed: {3 + at} m/s", f"Wind Direction: {231 + at}"]
        for at in range(8)
    ]


def test_a_line_that_is_missing_from_a_reading_moves_no_other(read: Read) -> None:
    readings = blocks()
    del readings[3][2]
    log = read("\n".join(line for reading in readings for line in reading), zone="UTC")
    found = np.degrees(log.series.channels["wind_direction"]).tolist()
    assert found == pytest.approx([231, 232, 233, np.nan, 235, 236, 237, 238], nan_ok=True)


def test_a_first_line_that_is_missing_moves_no_other(read: Read) -> None:
    readings = blocks()
    del readings[3][0]
    log = read("\n".join(line for reading in readings for line in reading), zone="UTC")
    assert since_start(log) == [0.0, 1.0, 2.0, 4.0, 5.0, 6.0, 7.0]
    assert log.series.channels["wind_speed"].tolist() == [3.0, 4.0, 5.0, 7.0, 8.0, 9.0, 10.0]


def test_a_file_that_begins_within_a_reading_mixes_none(read: Read) -> None:
    lines = [line for reading in blocks(rule="--\n") for line in reading][2:]
    log = read("\n".join(lines), zone="UTC")
    assert since_start(log) == [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]
    assert np.degrees(log.series.channels["wind_direction"]).tolist() == pytest.approx([232.0 + at for at in range(7)])


def test_readings_of_several_lines_without_a_time_are_counted(read: Read) -> None:
    text = "".join(f"Wind Speed: {3 + at / 10:.1f} m/s\nWind Direction: {231 + at}\n\n" for at in range(8))
    assert since_start(read(text, start=_START, rate=2.0)) == [at / 2 for at in range(8)]


def test_settings_of_a_program_are_no_readings(log_file: Write) -> None:
    text = "".join(f"name{at} = 3\nwind speed {'abcdefgh'[at]} = 4\n" for at in range(8))
    with pytest.raises(FlagdataError, match="known format"):
        read_log(log_file(text))


def test_the_stamp_that_pythons_logging_writes_has_a_fraction(read: Read) -> None:
    text = "".join(f"2026-05-01 12:00:{at:02d},250 - INFO - wind speed {3 + at / 10:.1f} m/s\n" for at in range(8))
    assert since_start(read(text, zone="UTC")) == [at + 0.25 for at in range(8)]


def test_a_stamp_of_two_words_before_an_object_keeps_its_date(read: Read) -> None:
    text = "".join(f'2026-05-01 12:00:{at:02d} rtl/1 {{"wind_avg_km_h": {36 + at}}}\n' for at in range(8))
    log = read(text, zone="UTC")
    assert since_start(log) == [float(at) for at in range(8)]
    assert log.series.channels["wind_speed"][0] == pytest.approx(10.0)


def test_dictionaries_are_read_as_python_prints_them(read: Read) -> None:
    text = "".join(
        f"{{'time': '2026-05-01 12:00:{at:02d}', 'wind_speed': {3 + at}, 'ok': True, 'x': None}}\n" for at in range(8)
    )
    log = read(text, zone="UTC", unit="m/s")
    assert since_start(log) == [float(at) for at in range(8)]
    assert log.series.channels["wind_speed"].tolist() == [3.0 + at for at in range(8)]


_LINES = {
    "nmea": lambda at: sentence(f"WIMWV,{100 + at}.0,R,{4 + at}.0,M,A").strip(),
    "vaisala": lambda at: f"0R1,Dn=236D,Dm=283D,Dx=031D,Sn=0.0M,Sm={4 + at}.0M,Sx=9.2M",
}


@pytest.mark.parametrize("kind", sorted(_LINES))
@pytest.mark.parametrize("before", ["{} ", "[{}] ", "{}.500,", "{} > "])
def test_lines_of_an_instrument_after_a_time_of_day_are_put_on_its_day(read: Read, kind: str, before: str) -> None:
    clocks = ["23:59:58", "23:59:59", "00:00:00", "00:00:01"]
    text = "".join(f"{before.format(clock)}{_LINES[kind](at)}\n" for at, clock in enumerate(clocks))
    log = read(text, zone="UTC", date=_DAY)
    first = 43_198.0 + 0.5 * (".5" in before)
    assert since_start(log) == pytest.approx([first + at for at in range(4)])
    name = "apparent_wind_speed" if kind == "nmea" else "wind_speed"
    assert log.series.channels[name].tolist() == pytest.approx([4.0, 5.0, 6.0, 7.0])


@pytest.mark.parametrize("kind", sorted(_LINES))
def test_lines_of_an_instrument_after_a_time_of_day_ask_for_the_day(log_file: Write, kind: str) -> None:
    text = "".join(f"12:00:0{at} {_LINES[kind](at)}\n" for at in range(4))
    with pytest.raises(FlagdataError) as caught:
        read_log(log_file(text), WindOptions(zone="UTC"))
    assert "--date" in (caught.value.fix or "")


def test_lines_of_an_instrument_without_a_stamp_are_counted(read: Read) -> None:
    log = read("".join(f"{_LINES['vaisala'](at)}\n" for at in range(4)), start=_START, rate=4.0)
    assert log.format == "vaisala"
    assert since_start(log) == [0.0, 0.25, 0.5, 0.75]


def test_the_lines_of_the_wind_are_taken_out_of_a_programs_log(read: Read) -> None:
    text = "".join(
        f"[2026-05-01 12:00:{at:02d}][D][sensor]: 'Wind Speed': Sending state {36 + at} km/h\n"
        f"[2026-05-01 12:00:{at:02d}][D][sensor]: 'Temperature': Sending state 21.{at} C\n"
        f"[2026-05-01 12:00:{at:02d}][D][wifi]: signal -6{at} dBm of {at} tries\n"
        for at in range(8)
    )
    log = read(text, zone="UTC")
    assert since_start(log) == [float(at) for at in range(8)]
    assert log.series.channels["wind_speed"].tolist() == pytest.approx([(36 + at) / 3.6 for at in range(8)])
    assert [(f.severity.name, f.count) for f in log.findings if f.kind == "malformed-lines"] == [("WARNING", 16)]


@pytest.mark.parametrize(
    "stamp",
    [
        "Fri May  1 12:00:{:02d} 2026", '"Fri, 01 May 2026 12:00:{:02d} GMT"', "Friday May 01 2026 12:00:{:02d}",
        "1 May 2026 12:00:{:02d}", '"Fri., 1 May 2026 12:00:{:02d}"',
    ],
)  # fmt: skip
def test_a_stamp_may_name_its_month_and_its_day_of_the_week(read: Read, stamp: str) -> None:
    text = "".join(f"{stamp.format(at)},{3 + at}\n" for at in range(8))
    assert since_start(read(f"date,wind speed [m/s]\n{text}", zone="UTC")) == [float(at) for at in range(8)]


def test_a_file_of_one_reading_is_a_row_at_the_start(read: Read) -> None:
    log = read("WindDir   = 79\nWindSpeed = 0.5\nTS4Temp   = 24.4\n", unit="m/s", start=_START, rate=0.5)
    assert since_start(log) == [0.0]
    assert log.series.channels["wind_speed"].tolist() == [0.5]
    assert np.degrees(log.series.channels["wind_direction"]).tolist() == pytest.approx([79.0])


def test_words_among_readings_are_told(read: Read) -> None:
    text = "".join(
        f"$ ./read -v\nWind Speed: {3 + at} m/s\nChecksum: 19\nWind Direction: 231\nreading is not valid!\n"
        for at in range(6)
    )
    found = [f for f in read(text, start=_START, rate=1.0).findings if f.kind == "malformed-lines"]
    assert [f.count for f in found] == [12]


_HALVES = ("11:58:58 AM", "12:03:58 PM", "12:08:58 PM", "12:13:58 PM", "12:18:58 PM", "12:23:58 PM")
_NOON = [-62.0, 238.0, 538.0, 838.0, 1138.0, 1438.0]


@pytest.mark.parametrize(
    ("heading", "line", "options"),
    [
        ("date,time,half,wind_speed", "05/13/2026,{clock},{half},{speed}", {}),
        ("", "05/13/2026 {clock} {half} {speed}", {"wind": "4"}),
        ("when,half,wind_speed", "05/13/2026 {clock},{half},{speed}", {}),
        ("time,half,wind_speed", "{clock},{half},{speed}", {"date": np.datetime64("2026-05-13").astype(object)}),
        ("", "[05/13/2026 {clock} {half}] {speed}", {"wind": "4"}),
        ("", "[05/13/2026 {clock} {half}] Wind Speed: {speed}", {}),
        ("", "[2026-05-13 {clock} {half}] new speed: {speed}", {}),
    ],
)
def test_morning_and_afternoon_may_stand_apart_from_the_clock(
    read: Read, heading: str, line: str, options: dict[str, object]
) -> None:
    rows = [line.format(clock=text[:8], half=text[9:], speed=3 + at / 10) for at, text in enumerate(_HALVES)]
    log = read("\n".join([*([heading] if heading else []), *rows, ""]), zone="UTC", unit="m/s", **options)
    day = 12 * 86_400
    assert [at - day for at in since_start(log)] == _NOON
    assert log.series.channels["wind_speed"].tolist() == pytest.approx([3 + at / 10 for at in range(6)])


@pytest.mark.parametrize(
    "stamp", ["2026-05-01 12:00:{at:02d}", "2026-05-01T12:00:{at:02d}Z", "01.05.2026 12:00:{at:02d},0"]
)
def test_stamps_in_brackets_before_a_table(read: Read, stamp: str) -> None:
    text = "".join(f"[{stamp.format(at=at)}] {3 + at / 10:.1f} 23{at}\n" for at in range(8))
    columns = (
        "time,wind_speed[m/s],wind_direction[deg]" if "T" in stamp else "date,time,wind_speed[m/s],wind_direction[deg]"
    )
    log = read(text, columns=columns, zone=None if "Z" in stamp else "UTC")
    assert since_start(log) == [float(at) for at in range(8)]
    assert np.degrees(log.series.channels["wind_direction"]).tolist() == pytest.approx([230.0 + at for at in range(8)])


def test_pairs_of_name_and_value_in_a_line_may_hold_nan(read: Read) -> None:
    speeds = ("nan", "0.0", "1.2", "3.4", "2.2", "1.1")
    text = "".join(f"$,winddir={40 + at},windspeedmph={speed},batt_lvl=4.42,#\n" for at, speed in enumerate(speeds))
    log = read(text, start=_START, rate=1.0)
    assert since_start(log) == [float(at) for at in range(6)]
    assert np.isnan(log.series.channels["wind_speed"][0])
    assert log.series.channels["wind_speed"][1:].tolist() == pytest.approx(
        [float(speed) * 0.44704 for speed in speeds[1:]]
    )


def test_a_data_systems_words_around_the_stamp_of_a_message(read: Read) -> None:
    text = "".join(
        f"MET 2026/05/01 12:00:{at:02d}.250 WXTP PR0,Dm=01{at}D,Sn=2.3M,Sm=12.{at}M,Sx=13.2M\n" for at in range(8)
    )
    log = read(text, zone="UTC")
    assert since_start(log) == [at + 0.25 for at in range(8)]
    assert log.series.channels["wind_speed"].tolist() == pytest.approx([12 + at / 10 for at in range(8)])
