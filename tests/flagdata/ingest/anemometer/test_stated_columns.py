"""Columns that the user states in one line: what it means, what it refuses, and that refusals offer it."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log, sniff
from flagdata.ingest.anemometer.tables.stated_columns import Entry, parse
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
Write = Callable[[str], Path]
_START = 1_777_636_800 * 10**9
"""2026-05-01T12:00:00Z."""
_BARE = "".join(f"2009 01 01 00 {at:02d} {9 + at} 27{at} -4.8{at}\n" for at in range(8))


def refused(path: Path, **options: object) -> FlagdataError:
    with pytest.raises(FlagdataError) as caught:
        read_log(path, WindOptions(**options))  # type: ignore[arg-type]
    assert caught.value.fix
    return caught.value


def test_columns_are_named_in_the_order_of_the_file(read: Read) -> None:
    log = read(
        _BARE, zone="UTC", columns="year,month,day,hour,minute,wind_speed[kn],wind_direction[deg],air_temperature[degC]"
    )
    channels = log.series.channels
    assert log.series.time.tolist()[:2] == [1_230_768_000 * 10**9, 1_230_768_060 * 10**9]  # 2009-01-01T00:00Z
    assert channels["wind_speed"].tolist() == pytest.approx([(9 + at) * 1852 / 3600 for at in range(8)])
    assert np.degrees(channels["wind_direction"]).tolist() == pytest.approx([270.0 + at for at in range(8)])
    assert channels["air_temperature"].tolist() == pytest.approx([273.15 - 4.8 - at / 100 for at in range(8)])


@pytest.mark.parametrize(
    "columns", ["2=wind_speed[km/h],1=time", "Spd=wind_speed[km/h],When=time", ",wind_speed[km/h]"]
)
def test_columns_are_named_by_place_number_or_heading(read: Read, columns: str) -> None:
    rows = "".join(f"2026-05-01 12:00:{at:02d}Z;{18 + at},5\n" for at in range(8))
    log = read(f"When;Spd\n{rows}", columns=columns)
    assert log.series.channels["wind_speed"][0] == pytest.approx(18.5 / 3.6)
    assert log.series.time[0] == _START


@pytest.mark.parametrize(
    ("cells", "columns"),
    [
        ("01.05.2026;12:00:0{at}", "date,time,"),
        ("12:00:0{at};01.05.2026", "time[%H:%M:%S],date[%d.%m.%Y],"),
        ("26;5;1;12000{at}", "year,month,day,time,"),
        ("1;May;2026;12;0;{at}", "day,month,year,hour,minute,second,"),
        ("12;0;{at};01/05/26", "hour,minute,second,date[%d/%m/%y],"),
        ("12;0;{at};2026-05-01", "hour,minute,second,date,"),
        ("2026;121;12;0;{at}", "year,day_of_year,hour,minute,second,"),
        ("177763680{at}", "time[epoch-s],"),
        ("2026/05/01T12h00m0{at}", "time[%Y/%m/%dT%Hh%Mm%S],"),
    ],
)
def test_a_time_may_be_written_in_parts_and_in_any_format(read: Read, cells: str, columns: str) -> None:
    rows = "".join(f"{cells.format(at=at)};{3 + at / 10}\n" for at in range(8))
    log = read(rows, columns=f"{columns}wind_speed[m/s]", zone="UTC")
    assert ((log.series.time - _START) / 1e9).tolist() == [float(at) for at in range(8)]


def test_a_count_since_a_start_is_named_with_its_unit(read: Read) -> None:
    rows = "".join(f"{250 * at},{3 + at / 10}\n" for at in range(8))
    log = read(rows, columns="time[elapsed-ms],wind_speed[m/s]", start=_START)
    assert ((log.series.time - _START) / 1e9).tolist() == [at / 4 for at in range(8)]


def test_columns_without_a_time_are_counted_from_a_start(read: Read) -> None:
    rows = "".join(f"{1000 + at},{3 + at / 10}\n" for at in range(8))
    log = read(rows, columns=",wind_speed[m/s]", start=_START, rate=2.0)
    assert ((log.series.time - _START) / 1e9).tolist() == [at / 2 for at in range(8)]
    assert log.series.channels["wind_speed"].tolist() == pytest.approx([3 + at / 10 for at in range(8)])


def test_a_direction_to_which_the_wind_blows_is_turned(read: Read) -> None:
    log = read(_BARE, zone="UTC", columns="year,month,day,hour,minute,wind_speed[kn],wind_direction_to[deg]")
    assert np.degrees(log.series.channels["wind_direction"]).tolist() == pytest.approx([90.0 + at for at in range(8)])


def test_a_column_of_sites_makes_an_anemometer_of_each(log_file: Write) -> None:
    rows = "".join(f"{'AB'[at % 2]},2026-05-01 12:0{at // 2}:00,{3 + at}\n" for at in range(12))
    options = WindOptions(columns="site,time,wind_speed[m/s]", zone="UTC")
    path = log_file(f"{rows}C,2026-05-01 12:09:00,7\n")
    assert anemometers(path, options) == ("A", "B", "C")
    log = read_log(path, WindOptions(columns="site,time,wind_speed[m/s]", zone="UTC", wind="B"))
    assert log.series.channels["wind_speed"].tolist() == [4.0 + 2 * at for at in range(6)]


def test_a_direction_alone_is_kept_without_ground_truth(read: Read) -> None:
    rows = "".join(f"2026-05-01 12:00:{at:02d},{'NNE' if at % 2 else 'SW'}\n" for at in range(8))
    log = read(f"time,wind direction\n{rows}", columns="time,wind_direction", zone="UTC")
    assert np.degrees(log.series.channels["wind_direction"])[:2].tolist() == pytest.approx([225.0, 22.5])
    assert [f.severity.name for f in log.findings if f.kind == "no-usable-wind"] == ["ERROR"]


def test_the_unit_is_the_headings_or_the_options_where_the_line_states_none(read: Read) -> None:
    rows = "".join(f"2026-05-01 12:00:{at:02d},{3 + at}\n" for at in range(8))
    assert read(f"time,a (kn)\n{rows}", columns=",wind_speed", zone="UTC").series.channels["wind_speed"][
        0
    ] == pytest.approx(3 * 1852 / 3600)
    log = read(f"time,a\n{rows}", columns=",wind_speed", zone="UTC", unit="km/h")
    assert log.series.channels["wind_speed"][0] == pytest.approx(3 / 3.6)


@pytest.mark.parametrize(
    ("columns", "says"),
    [
        ("", "no column is measured"),
        ("time", "no column is measured"),
        ("time,wind_sped[m/s]", "wind_speed"),
        ("time,wind_speed[furlongs]", "unit"),
        ("time,wind_speed[deg]", "m/s"),
        ("time,wind_speed", "--unit"),
        ("time,?", "question mark"),
        ("?=time,2=wind_speed[m/s]", "question mark"),
        ("time,wind_speed[?]", "question mark"),
        ("time,wind_speed[m/s],,,air_temperature[degC]", "3 columns"),
        ("1=time,9=wind_speed[m/s]", "9"),
        ("1=time,Wind=wind_speed[m/s]", "Wind"),
        ("1=time,wind_speed[m/s]", "cannot be read"),
        ("1=time,1=wind_speed[m/s]", "twice"),
        ("wind_speed[m/s],wind_speed[m/s]", "twice"),
        ("time,wind_direction,wind_speed[m/s]", "wind_direction[deg]"),
        ("time,wind_speed[m/s],wind_direction[deg]", "holds words: 'ok'"),
        ("time[%d.%m.%Y],wind_speed[m/s]", "cannot be read as %d.%m.%Y"),
        ("time[epoch],wind_speed[m/s]", "epoch-s"),
        ("time[%Y-%m-%d %K],wind_speed[m/s]", "%K"),
        (",wind_speed[m/s],time", "cannot be read"),
    ],
)
def test_a_line_that_does_not_fit_is_refused_with_what_to_correct(log_file: Write, columns: str, says: str) -> None:
    rows = "".join(f"2026-05-01 12:00:{at:02d},{3 + at},ok\n" for at in range(8))
    error = refused(log_file(rows), columns=columns, zone="UTC")
    assert says in f"{error.what} {error.fix}"


def test_a_recipe_and_a_line_of_columns_exclude_each_other(log_file: Write) -> None:
    path = log_file("time,wind_speed\n2026-05-01 12:00:00,3\n")
    assert "columns" in refused(path, columns="time,wind_speed[m/s]", recipe="generic-csv", zone="UTC").what


@pytest.mark.parametrize(
    ("text", "answers", "options"),
    [
        (_BARE, ["wind_speed[kn]", "wind_direction[deg]", "air_temperature[degC]"], {"zone": "UTC"}),
        ("".join(f"{at} 3.{at} 7 21{at}\n" for at in range(8)), ["time[elapsed-s]", "wind_speed[m/s]", "",
                                                               "wind_direction[deg]"], {"start": _START}),
        ("".join(f"2026-05-01_12u0{at},x,3.{at}\n" for at in range(8)), ["time[%Y-%m-%d_%Hu%M]", "wind_speed[m/s]"],
         {"zone": "UTC"}),
        ("Stop;Datum;A\n" + "".join(f"x;2026-05-01 12:0{at};3.{at}\n" for at in range(8)), ["wind_speed[m/s]"],
         {"zone": "UTC"}),
    ],
)  # fmt: skip
def test_the_line_that_a_refusal_offers_reads_the_file_once_it_is_completed(
    log_file: Write, text: str, answers: list[str], options: dict[str, object]
) -> None:
    path = log_file(text)
    offered = re.search(r'--columns "([^"]*)"', refused(path).fix)
    assert offered is not None
    line = re.sub(r"\?", lambda _: answers.pop(0), re.sub(r"\w+\[\?\]", "?", offered[1]))
    assert not answers
    log = read_log(path, WindOptions(columns=line, **options))  # type: ignore[arg-type]
    assert len(log.series) == 8
    assert log.series.channels["wind_speed"].min() > 0


def test_a_wide_table_is_offered_by_numbers(log_file: Write) -> None:
    rows = "".join(f"2026-05-01 12:0{at}:00,{','.join(str(at + other) for other in range(20))}\n" for at in range(8))
    assert '--columns "1=time,?=wind_speed[?],?=wind_direction[deg]"' in refused(log_file(rows)).fix


def test_what_is_known_is_filled_in(log_file: Write) -> None:
    rows = "".join(f"x{at},2026-05-01 12:0{at}:00,3.{at},{200 + at},21.{at}\n" for at in range(8))
    fix = refused(log_file(f"no,stamp,val,wind dir,air temp (C)\n{rows}")).fix
    assert '--columns ",time,?,wind_direction[deg],air_temperature[degC]"' in fix
    assert "1: x0; 2: 2026-05-01 12:00:00; 3: 3.0" in fix


def test_a_table_of_which_nothing_is_known_is_offered_too(log_file: Write) -> None:
    guess = sniff(log_file("".join(f"{7 - at} {at % 3} 2\n" for at in range(8))))[0]
    assert '--columns "?,?,?"' in (guess.fix or "")


def test_numbers_alone_are_offered_as_the_wind_at_a_rate(log_file: Write) -> None:
    path = log_file("5.2\n5.4\n5.6\n5.1\n")
    assert '--columns "wind_speed[m/s]" --start TIME --rate HZ' in (sniff(path)[0].fix or "")
    log = read_log(path, WindOptions(columns="wind_speed[m/s]", start=_START, rate=2.0))
    assert log.series.channels["wind_speed"].tolist() == [5.2, 5.4, 5.6, 5.1]


def test_a_count_whose_unit_is_not_told_is_offered_with_it_open(log_file: Write) -> None:
    rows = "".join(f"{100_000 * at},{3 + at / 10},{at % 3}\n" for at in range(12))
    path = log_file(f"timestamp,wind_speed [m/s],x\n{rows}")
    assert '--columns "time[elapsed-?],wind_speed[m/s],"' in refused(path).fix
    log = read_log(path, WindOptions(columns="time[elapsed-us],wind_speed[m/s]", start=_START))
    assert (log.series.time[-1] - _START) / 1e9 == pytest.approx(1.1)


def test_the_entries_of_a_line() -> None:
    assert parse("date[%d,%m,%Y], ,wind_speed[km/h]") == (
        Entry(column=0, name="date", detail="%d,%m,%Y"),
        Entry(column=2, name="wind_speed", detail="km/h"),
    )
    assert parse("Wind (km/h)=wind_speed[km/h],7=time") == (
        Entry(column="Wind (km/h)", name="wind_speed", detail="km/h"),
        Entry(column="7", name="time", detail=""),
    )


def test_points_of_the_compass_are_offered_and_read_without_a_unit(read: Read, log_file: Write) -> None:
    text = "Dir;Mean\n" + "".join(
        f"{point} ;{3 + at},5\n" for at, point in enumerate(("NE", "S", "VRB", "W", "SSW", "N"))
    )
    assert '"wind_direction,' in str(refused(log_file(text)).fix)
    for direction in ("wind_direction", "wind_direction[deg]"):
        log = read(text, columns=f"{direction},wind_speed[m/s]", start=_START, rate=1.0)
        assert log.series.channels["wind_speed"].tolist() == [3.5 + at for at in range(6)]
        degrees = np.degrees(log.series.channels["wind_direction"])
        assert np.isnan(degrees[2])
        assert degrees[[0, 1, 3, 4, 5]].tolist() == pytest.approx([45.0, 180.0, 270.0, 202.5, 0.0])


def test_lines_too_short_for_the_table_are_told(read: Read) -> None:
    rows = [f"3.{at} 23{at} 51" for at in range(9)]
    text = "\n".join([*rows[:5], "new day", *rows[5:], ""])
    log = read(text, columns="wind_speed[m/s],wind_direction[deg],", start=_START, rate=1.0)
    assert ((log.series.time - _START) // 10**9).tolist() == [0, 1, 2, 3, 4, 6, 7, 8, 9]
    assert [f.count for f in log.findings if f.kind == "malformed-lines"] == [1]


def test_a_direction_beside_components_is_named_when_left_out(read: Read) -> None:
    text = "datetime,U,V,W,Winddir\n"
    text += "".join(f"2026-05-01 12:00:{at:02d}+00:00,1.{at},-3.5,0.1,23{at}\n" for at in range(8))
    said = " ".join(f.what for f in read(text, unit="m/s").findings)
    assert "'Winddir' is left out beside the components" in said


def _toa5(*heights: str) -> str:
    columns = [f"{name}_{height}" for height in heights for name in ("WindSpeed_S", "WindDirection_S", "Humidity")]
    head = ['"TOA5","a","CR1000X","1","x","CPU:a.CR1X","1","t"', ",".join(["TIMESTAMP", "RECORD", *columns])]
    head += [",".join(["TS", "RN", *["", "Deg", ""] * len(heights)]), ",".join(["", "", *["Smp"] * len(columns)])]
    rows = [
        f'"2026-05-01 12:{at:02d}:00",{at},'
        + ",".join(f"{3 + n + at % 4}.5,{200 + at},4{at}" for n in range(len(heights)))
        for at in range(10)
    ]
    return "\n".join([*head, *rows, ""])


def test_a_line_that_is_offered_for_several_heights_is_taken_as_it_stands(log_file: Write) -> None:
    path = log_file(_toa5("L", "U"))
    fix = refused(path, zone="UTC").fix
    line = re.search(r'--columns "([^"]+)"', fix)
    assert line is not None
    assert line[1].count("wind_speed") == 1
    assert "'WindSpeed_S_U'" in fix
    series = read_log(path, WindOptions(columns=line[1].replace("?", "m/s"), zone="UTC")).series
    assert series.channels["wind_speed"].tolist() == [3.5 + at % 4 for at in range(10)]


def test_a_program_of_unknown_names_is_read_by_its_headings_for_all_heights(log_file: Write) -> None:
    path = log_file(_toa5("L", "U"))
    assert "--as delimited --unit m/s" in refused(path, zone="UTC").fix
    options = WindOptions(format="delimited", unit="m/s", zone="UTC")
    assert anemometers(path, options) == ("WindSpeed_S_L", "WindSpeed_S_U")
    upper = read_log(path, WindOptions(format="delimited", unit="m/s", zone="UTC", wind="WindSpeed_S_U")).series
    assert upper.channels["wind_speed"].tolist() == [4.5 + at % 4 for at in range(10)]


def test_a_time_in_words_is_offered_for_its_format(log_file: Callable[[str], Path]) -> None:
    stamp = '"As of 11:{:02d} PM, Thu Sep 27 2018"'
    path = log_file("date,Wind Speed\n" + "".join(f"{stamp.format(at)},{3 + at % 4} mph\n" for at in range(20)))
    with pytest.raises(FlagdataError) as caught:
        read_log(path, WindOptions(zone="UTC"))
    line = (caught.value.fix or "").partition('--columns "')[2].partition('"')[0]
    assert line == "time[?],wind_speed[mph]"
    columns = line.replace("?", "As of %I:%M %p, %a %b %d %Y")
    series = read_log(path, WindOptions(zone="UTC", columns=columns)).series
    assert str(series.time[1].astype("datetime64[ns]"))[:16] == "2018-09-27T23:01"
    assert series.channels["wind_speed"][0] == pytest.approx(3 * 0.44704)


@pytest.mark.parametrize("name", ["day_of_year", "doy", "yday"])
def test_a_day_of_the_year_may_have_a_fraction(read: Read, name: str) -> None:
    rows = "".join(f"1996 {255 + at / 48:.4f} {3 + at}.0\n" for at in range(12))
    log = read(rows, zone="UTC", columns=f"year,{name},wind_speed[m/s]")
    start = np.datetime64("1996-09-11T00:00", "s").astype(np.int64)
    assert log.series.time / 1e9 - start == pytest.approx(np.arange(12) * 1800.0, abs=5.0)


def test_a_unit_is_told_as_the_user_wrote_it(read: Callable[..., WindLog]) -> None:
    rows = "".join(f"2026-05-01T12:{at:02d}:00Z,{30 + at}\n" for at in range(12))
    log = read(f"time,speed of the wind\n{rows}", columns="time,wind_speed[0.1m/s]")
    assert log.series.channels["wind_speed"][0] == pytest.approx(3.0)
    assert "in 0.1m/s, as you said" in " ".join(log.reasons)
    assert "in 0.1m/s, as you said" in " ".join(read(f"time,wind speed\n{rows}", unit="0.1m/s").reasons)
