"""Logs whose rows carry no time, on the clock that the user gives: a start and a rate."""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from operator import xor
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError, UsageError
from flagdata.ingest.anemometer import WindOptions, read_log, sniff
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
Write = Callable[[str], Path]
_START = 1_777_636_800 * 10**9
"""2026-05-01T12:00:00Z."""


def since_start(log: WindLog) -> list[float]:
    return ((log.series.time - _START) / 1e9).tolist()


def sentence(text: str) -> str:
    return f"${text}*{reduce(xor, text.encode(), 0):02X}\n"


@pytest.mark.parametrize("decimal", [".", ","])
def test_rows_of_a_table_are_counted_from_the_start_at_the_rate(read: Read, decimal: str) -> None:
    rows = "".join(f"{7.2 + at};{180 + at}\n".replace(".", decimal) for at in range(8))
    log = read(f"Wind speed (km/h);Direction\n{rows}", start=_START, rate=4.0)
    assert since_start(log) == [at / 4 for at in range(8)]
    assert log.series.channels["wind_speed"].tolist() == pytest.approx([(7.2 + at) / 3.6 for at in range(8)])
    assert np.degrees(log.series.channels["wind_direction"]).tolist() == pytest.approx([180.0 + at for at in range(8)])
    assert [finding.kind for finding in log.findings if "as given" in finding.what] == ["rate-given"]


def test_a_column_of_numbers_alone_is_read_as_the_wind_that_is_named(read: Read) -> None:
    log = read("5.2\n5.4\n5.6\n5.1\n", start=_START, rate=2.0, format="delimited", wind="1", unit="m/s")
    assert since_start(log) == [0.0, 0.5, 1.0, 1.5]
    assert log.series.channels["wind_speed"].tolist() == [5.2, 5.4, 5.6, 5.1]


def test_the_numbers_of_columns_that_nothing_names_stay_what_they_are(read: Read) -> None:
    rows = "".join(f"{21.5},{3 + at / 10:.1f},{1013}\n" for at in range(8))
    log = read(rows, start=_START, rate=1.0, format="delimited", wind="2", unit="m/s")
    assert log.series.channels["wind_speed"][:3].tolist() == pytest.approx([3.0, 3.1, 3.2])


def test_prints_that_name_each_number_are_counted(read: Read) -> None:
    rows = "".join(f"Wind Speed: {3.21 + at / 100:.2f} m/s, Direction: {231 + at}\n" for at in range(6))
    log = read(rows, start=_START, rate=10.0)
    assert since_start(log) == pytest.approx([at / 10 for at in range(6)])
    assert log.series.channels["wind_speed"][0] == pytest.approx(3.21)


def test_sentences_of_the_most_frequent_wind_tick_and_the_others_come_with_them(read: Read) -> None:
    rows = "".join(sentence(f"WIMWV,{100 + at}.0,R,{4 + at}.0,N,A") + sentence("YXXDR,C,16.0,C,T") for at in range(6))
    log = read(rows, start=_START, rate=2.0, platform="fixed", azimuth=0.0)
    assert since_start(log) == [at / 2 for at in range(6)]
    assert log.series.channels["wind_speed"].tolist() == pytest.approx([(4 + at) * 1852 / 3600 for at in range(6)])


@pytest.mark.parametrize(
    "text",
    [
        "time,wind speed [m/s]\n2026-05-01 12:00:00,3\n2026-05-01 12:00:01,4\n2026-05-01 12:00:02,3\n",
        "millis,wind speed [m/s]\n0,3\n100,4\n200,3\n300,4\n",
        "".join(
            sentence(f"GPRMC,12000{at},A,5200.0,N,00500.0,E,5.0,90.0,010526,,,A") + sentence("WIMWV,1.0,R,4.0,N,A")
            for at in range(2)
        ),
        "12:00:01 Wind Speed: 3.21 m/s\n12:00:02 Wind Speed: 3.31 m/s\n12:00:03 Wind Speed: 3.21 m/s\n",
    ],
)
def test_a_rate_is_refused_where_the_rows_say_when_they_were(log_file: Write, text: str) -> None:
    with pytest.raises(UsageError, match="say when they were"):
        read_log(log_file(text), WindOptions(rate=1.0, start=_START))


def test_a_rate_needs_a_start(log_file: Write) -> None:
    with pytest.raises(UsageError) as caught:
        read_log(log_file("wind speed [m/s],x\n3,1\n4,1\n"), WindOptions(rate=1.0))
    assert "--start" in caught.value.fix


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan"), float("inf")])
def test_a_rate_that_is_none_is_refused(rate: float) -> None:
    with pytest.raises(UsageError):
        WindOptions(rate=rate)


def test_a_rate_is_refused_for_what_is_no_log(log_file: Write) -> None:
    with pytest.raises(UsageError, match="neither a table nor sentences"):
        read_log(log_file("Dear reader\nthis is\nno log\nat all\n"), WindOptions(rate=1.0, start=_START))


@pytest.mark.parametrize(
    "text", ["5.2\n5.4\n5.6\n", "Wind speed (km/h),Direction\n7.2,180\n8.1,181\n", "3.1,180\n3.2,181\n3.3,182\n"]
)
def test_what_a_log_without_a_time_needs_is_named(log_file: Write, text: str) -> None:
    assert "--start TIME --rate HZ" in (sniff(log_file(text))[0].fix or "")


def test_a_stream_without_a_time_says_what_is_needed(log_file: Write) -> None:
    path = log_file("".join(sentence(f"WIMWV,{at}.0,R,4.0,N,A") for at in range(10, 20)))
    with pytest.raises(FlagdataError) as caught:
        read_log(path, WindOptions())
    assert "--start TIME --rate HZ" in caught.value.fix


def test_a_sodars_profiles_are_named_as_such(log_file: Write) -> None:
    text = "FORMAT-1\n2014-03-10 13:00:00 0\nXFAS\n6 12 74\n\n# z speed dir\n40 1.33 6.2\n60 2.44 337.3\n"
    guess = sniff(log_file(text))[0]
    assert guess.kind == "other"
    assert "SODAR" in guess.reasons[0]


def test_options_without_a_rate_keep_their_hash() -> None:
    assert "rate" not in WindOptions().as_dict()
    assert WindOptions(rate=2.0, start=_START).as_dict()["rate"] == 2.0


def test_objects_between_lines_of_text_are_counted_from_the_start_at_the_rate(read: Read) -> None:
    rows = "".join(f'uptime: {at} min\n{{"ws":{3.6 + at},"wd":{90 + at}}}\n' for at in range(6))
    log = read(rows, start=_START, rate=1 / 60, unit="km/h")
    assert since_start(log) == pytest.approx([60.0 * at for at in range(6)])
    assert log.series.channels["wind_speed"].tolist() == pytest.approx([(3.6 + at) / 3.6 for at in range(6)])
    assert {"rate-given", "malformed-lines"} <= {finding.kind for finding in log.findings}


def test_the_rate_and_the_start_above_a_table_are_proposed_but_not_taken(read: Read, log_file: Write) -> None:
    head = "Sampling rate: 20 Hz\nStart: 2026-05-01 12:00:00\n"
    rows = "".join(f"{3 + at},0.2\n" for at in range(8))
    path = log_file(f"{head}u (m/s),v (m/s)\n{rows}")
    with pytest.raises(FlagdataError) as caught:
        read_log(path)
    assert "--rate 20" in (caught.value.fix or "")
    assert "--start 2026-05-01T12:00:00" in (caught.value.fix or "")


def test_the_instant_that_a_heading_counts_from_is_proposed(log_file: Write) -> None:
    rows = "".join(f"{60 * at},{3 + at}.5\n" for at in range(8))
    path = log_file(f"seconds since 2026-05-01 12:00:00 UTC,wind speed (m/s)\n{rows}")
    with pytest.raises(FlagdataError) as caught:
        read_log(path)
    assert "--start 2026-05-01T12:00:00" in (caught.value.fix or "")


@pytest.mark.parametrize(("first", "told"), [(420, True), (0, False)])
def test_a_count_that_does_not_begin_at_zero_is_told_with_the_start_that_it_may_mean(
    tmp_path: Path, first: int, told: bool
) -> None:
    path = tmp_path / "wind.csv"
    path.write_text("time [min],wind speed [m/s]\n" + "".join(f"{first + 5 * at},{3 + at % 4}.5\n" for at in range(12)))
    log = read_log(path, WindOptions(start=1_777_636_800 * 10**9, zone="UTC"))
    (what,) = (finding.what for finding in log.findings if finding.kind == "elapsed-time")
    assert ("--start 2026-05-01T19:00:00Z" in what) == told
    assert not any("state their own zone" in finding.what for finding in log.findings)


def test_nothing_is_said_of_stamps_that_were_counted(read: Read) -> None:
    kinds = [f"$IIVWR,{80 + at},L,5.{at},N,,,,\n$IIVWT,{70 + at},L,4.{at},N,,,,\n" for at in range(6)]
    log = read("".join(kinds), start=_START, rate=1.0)
    assert since_start(log) == [at / 2 for at in range(12)]
    assert "they are on the clock that was given" in log.reasons[0]
    assert "computer's stamp" not in " ".join(log.reasons)
    said = {finding.kind: finding for finding in log.findings}
    assert {"rate-given", "counted-together"} <= set(said)
    assert {"coarse-stamps", "held-stamps", "equal-stamps", "uneven-stamps"}.isdisjoint(said)
    assert said["counted-together"].count == 6


def test_lines_of_an_instrument_are_on_the_clock_that_was_given(read: Read) -> None:
    log = read("".join(f"Q,{at:03d},00{at}.10,M,00,\n" for at in range(6)), start=_START, rate=1.0)
    assert "they carry no time of their own: they are on the clock that was given" in log.reasons
