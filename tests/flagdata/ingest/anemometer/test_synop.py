"""SYNOP reports of land stations (WMO-No. 306, FM 12): after a stamp of their day, and in bulletins without a month."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError, TimeError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log, sniff
from flagdata.signals import WindLog
from flagdata.timebase import iso

Write = Callable[..., Path]
Read = Callable[..., WindLog]
KNOT = 1852 / 3600

_STAMPED = """03999,2026,05,01,00,00,AAXX 01001 03999 11458 72305 10158 20113 40113 333 10201 91009 555 91044==
03999,2026,05,01,03,00,AAXX 01031 03999 11458 /0000 10148=
03999,2026,05,01,06,00,AAXX 01061 03999 11458 79902 10148=
03999,2026,05,01,09,00,AAXX 01091 03999 11458 73699 00104 10148 90915=
03999,2026,05,01,12,00,AAXX 01121 03999 NIL=
03999,2026,05,01,15,00,AAXX 01151 03999 11458 7//// 10148=
"""

_BULLETINS = """
ZCZC 101
SMXX01 EAAA 301200
AAXX 30124
03999 11458 72405 10158 20113
      40113 333 10178 21078=
03998 NIL=
03997 41/70 83612 10148=

SMXX02 EBBB 301200
AAXX 30121
03999 11458 72406 10158=
16001 11458 72410 10158 39990=

SMVX01 EAAA 301200
BBXX
SHIP1 30124 99510 70045 41/97 73412=

SMXX01 EAAA 010000
AAXX 01004
03999 11458 70105=
03997 41/70 8AB12=
"""


def test_stamped_reports_give_speed_direction_and_time(read: Read) -> None:
    log = read(_STAMPED)
    stamps = [iso(int(at))[:16] for at in log.series.time]
    assert stamps == [f"2026-05-01T{at}" for at in ("00:00", "03:00", "06:00", "09:15", "15:00")]
    np.testing.assert_allclose(log.series.channels["wind_speed"], [5, 0, 2, 104, np.nan])
    degrees = np.degrees(log.series.channels["wind_direction"])
    np.testing.assert_allclose(degrees, [230, np.nan, np.nan, 0, np.nan])
    assert not any(finding.kind == "malformed-lines" for finding in log.findings)
    assert "synop-reports" in {finding.kind for finding in log.findings}
    assert any("gust" in finding.what for finding in log.findings if finding.kind == "columns-not-read")


_WEATHER = """202605010000 AAXX 01001 03999 11458 72305 10158 20113 39956 40113 333 10201 20099=
202605010300 AAXX 01031 03999 11458 72305 11034 30122 40279 333 11050=
202605010600 AAXX 01061 03999 11458 72305 00104 1//// 37654=
202605010900 AAXX 01091 03999 11458 72305 40113 333 10201 39940=
"""


def test_temperature_and_station_pressure_are_those_of_the_first_section(read: Read) -> None:
    channels = read(_WEATHER).series.channels
    np.testing.assert_allclose(channels["air_temperature"], [288.95, 269.75, np.nan, np.nan])
    np.testing.assert_allclose(channels["air_pressure"], [99_560, 101_220, 76_540, np.nan])


def test_the_pressure_at_the_level_of_the_sea_is_not_that_of_the_air(read: Read) -> None:
    channels = read(_STAMPED).series.channels
    assert "air_pressure" not in channels
    np.testing.assert_allclose(channels["air_temperature"][:4], [288.95, 287.95, 287.95, 287.95])


def test_impossible_pressures_of_a_station_are_missing(read: Read) -> None:
    channels = read(_WEATHER.replace("30122", "32122")).series.channels
    np.testing.assert_allclose(channels["air_pressure"], [99_560, np.nan, 76_540, np.nan])


@pytest.mark.parametrize(("digit", "scale"), [("0", 1.0), ("1", 1.0), ("3", KNOT), ("4", KNOT)])
def test_the_unit_of_a_report_is_its_own(read: Read, digit: str, scale: float) -> None:
    lines = "".join(f"2026050100{at}0 AAXX 0100{digit} 03999 11458 72310 10158=\n" for at in range(4))
    np.testing.assert_allclose(read(lines).series.channels["wind_speed"], [10 * scale] * 4)


def test_a_report_whose_unit_is_not_told_is_left_out_with_a_word(read: Read) -> None:
    text = _STAMPED + "03999,2026,05,01,18,00,AAXX 0118/ 03999 11458 72305 10148=\n"
    told = [finding for finding in read(text).findings if finding.kind == "malformed-lines"]
    assert [finding.count for finding in told] == [1]


def test_a_report_of_another_day_than_its_stamp_is_left_out_with_a_word(read: Read) -> None:
    text = _STAMPED + "03999,2026,05,02,18,00,AAXX 01181 03999 11458 72305 10148=\n"
    told = [finding for finding in read(text).findings if finding.kind == "malformed-lines"]
    assert [finding.count for finding in told] == [1]


def test_a_report_goes_on_in_the_next_line(read: Read) -> None:
    text = (
        "# SYNOP of 03999\n202605010000 AAXX 01001 03999 11458 72305 10158\n"
        "                  20113 333 10178 21078==\n202605010300 AAXX 01031 03999 11458 72406 10158==\n"
    )
    log = read(text)
    assert log.series.channels["wind_speed"].tolist() == [5, 6]
    assert not any(finding.kind == "malformed-lines" for finding in log.findings)


def test_bulletins_ask_for_the_day_of_the_first(log_file: Write) -> None:
    path = log_file(_BULLETINS, "synop_20260430.txt")
    with pytest.raises(TimeError) as caught:
        read_log(path)
    assert "--date 2026-04-30" in caught.value.fix
    assert sniff(path)[0].winds == ("03997", "03999", "16001")


def test_stations_of_bulletins_are_sites_over_the_end_of_a_month(log_file: Write) -> None:
    path, date = log_file(_BULLETINS), dt.date(2026, 4, 30)
    assert anemometers(path, WindOptions(date=date)) == ("03997", "03999", "16001")
    log = read_log(path, WindOptions(date=date, wind="03999"))
    assert [iso(int(at))[:16] for at in log.series.time] == ["2026-04-30T12:00", "2026-05-01T00:00"]
    np.testing.assert_allclose(log.series.channels["wind_speed"], [6, 5 * KNOT])  # sent again in m/s: the last stands
    np.testing.assert_allclose(np.degrees(log.series.channels["wind_direction"]), [240, 10])
    counts = {finding.kind: finding.count for finding in log.findings}
    assert counts["repeated-messages"] == 1
    assert counts["other-messages"] == 2  # the word BBXX, and the ship's report
    assert counts["malformed-lines"] == 1


def test_reports_that_nothing_ends_are_one_a_line(log_file: Write) -> None:
    text = "AAXX 30121\n03997 11458 72405 10158\n03998 11458 72406 10158\nAAXX 30151\n03997 11458 72407\n"
    options = WindOptions(date=dt.date(2026, 4, 30))
    path = log_file(text)
    assert anemometers(path, options) == ("03997", "03998")
    series = read_log(path, WindOptions(date=options.date, wind="03997")).series
    assert series.channels["wind_speed"].tolist() == [5, 7]


def test_bulletins_of_airfields_and_stations_are_read_together(log_file: Write) -> None:
    text = "SAXX31 EAAA 301220\nMETAR EAAA 301220Z 02010KT 9999=\nSMXX01 EAAA 301200\nAAXX 30124\n03997 11458 72405=\n"
    path, date = log_file(text), dt.date(2026, 4, 30)
    assert anemometers(path, WindOptions(date=date)) == ("03997", "EAAA")


@pytest.mark.parametrize("text", ["BBXX SHIP1 30124 99510 70045 41/97 73412=\n", "AAXX 3012/\n03997 11458 72405=\n"])
def test_what_cannot_be_read_is_refused_with_a_step(log_file: Write, text: str) -> None:
    with pytest.raises(FlagdataError, match="SYNOP") as caught:
        read_log(log_file(text * 3))
    assert "--columns" not in caught.value.fix
