"""Line protocol of InfluxDB, made after its published description: points become one row a site and time."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError, UsageError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
Write = Callable[[str], Path]
START = 1_777_636_800
"""2026-05-01T12:00:00Z, in seconds."""
COUNT = 20


def points(what: str, *, size: int = 10**9, step: int = 60, late: int = 0, count: int = COUNT) -> str:
    """A point every `step` seconds; {v} counts from 1 and {d} from 101; instants count `size` to a second."""
    return "".join(f"{what.format(v=at + 1, d=at + 101)} {(START + late + step * at) * size}\n" for at in range(count))


def kinds(log: WindLog) -> set[str]:
    return {finding.kind for finding in log.findings}


def check(log: WindLog, *, first: float = 1, count: int = COUNT) -> None:
    assert log.series.channels["wind_speed"].tolist() == pytest.approx([first + at for at in range(count)])
    assert np.degrees(log.series.channels["wind_direction"]).tolist() == pytest.approx(
        [101 + at for at in range(count)]
    )


@pytest.mark.parametrize("size", [1, 10**3, 10**6, 10**9])
def test_the_size_of_an_instant_tells_what_it_counts(read: Read, size: int) -> None:
    log = read(points("weather,station=roof wind_speed_mps={v}.0,wind_dir={d}i", size=size))
    check(log)
    assert log.series.time.tolist() == [(START + 60 * at) * 10**9 for at in range(COUNT)]
    assert "malformed-lines" not in kinds(log)


def test_escapes_strings_truths_and_comments_divide_nothing(read: Read) -> None:
    line = (
        r'my\ weather\,roof,at=North\ Pier\,\ A\=1 note="a, b=c \"d\" # e",wind\ speed\ [m/s]={v}u,ok=t,wind\ dir={d}'
    )
    log = read("# written by hand\n" + points(line))
    check(log)
    assert "malformed-lines" not in kinds(log)


def test_tags_tell_sites_apart_by_the_one_that_does_it_alone(log_file: Write) -> None:
    text = points("weather,host=pi,owner=me,station=A wind_speed_mps={v},wind_dir={d}")
    text += points("weather,host=pi,owner=me,station=B wind_speed_mps=4{v},wind_dir={d}", count=9)
    text += points("weather,host=pi,owner=you,station=C wind_speed_mps=5{v},wind_dir={d}", count=9)
    text += points("weather,host=pi,owner=you,station=D water_level={v}")
    path = log_file(text)
    assert anemometers(path) == ("A", "B", "C")
    check(read_log(path, WindOptions(wind="A")))
    log = read_log(path, WindOptions(wind="B"))
    check(log, first=41, count=9)
    assert any(finding.kind == "sites-left-out" and finding.count == 1 for finding in log.findings)


def test_stations_of_one_reading_each_are_sites(log_file: Write) -> None:
    text = "".join(
        f"buoys,station_id=4{at:04d},station_name=Buoy\\ {at % 3} wind_speed_mps={at + 1},wind_dir={10 * at} {START}\n"
        for at in range(12)
    )
    path = log_file(text)
    assert anemometers(path) == tuple(f"4{at:04d}" for at in range(12))
    assert read_log(path, WindOptions(wind="40003")).series.channels["wind_speed"].tolist() == [4]


def test_measurements_without_a_wind_are_left_out_and_told(read: Read) -> None:
    text = points("cpu,host=pi usage={v},speed=1800") + points("wind,host=pi speed={v},direction={d},gust=9{v}")
    log = read(text, unit="m/s")
    check(log)
    told = [finding for finding in log.findings if finding.kind == "measurements-left-out"]
    assert [(finding.count, "'cpu'" in finding.what) for finding in told] == [(COUNT, True)]


def test_measurements_with_a_wind_each_are_sites(log_file: Write) -> None:
    path = log_file(points("mast wind_speed_mps={v},wind_dir={d}") + points("roof wind_speed_mps=4{v}.0", count=9))
    assert anemometers(path) == ("mast", "roof")
    check(read_log(path, WindOptions(wind="mast")))


def test_a_measurement_for_each_quantity_is_one_anemometer(read: Read) -> None:
    check(read(points("wind_speed,site=A mps={v}") + points("wind_direction,site=A deg={d}")))


def test_fields_of_one_point_on_lines_of_their_own_are_put_together(read: Read) -> None:
    log = read(points("weather,site=A wind_dir={d}") + points("weather,site=A wind_speed_mps={v}"))
    check(log)
    assert "told-last" not in kinds(log)


def test_beside_a_speed_stands_the_direction_that_was_told_last(read: Read) -> None:
    text = points("weather,site=A wind_speed_mps={v}", late=20) + points("weather,site=A wind_dir={d}", late=10)
    log = read(text)
    check(log)
    assert "told-last" in kinds(log)


def test_plain_values_are_named_by_their_entity(read: Read) -> None:
    text = points('km/h,entity_id=roof_wind_speed friendly_name_str="Roof",value={v}')
    log = read(text + points("°,entity_id=roof_wind_direction value={d}"))
    assert log.series.channels["wind_speed"][[0, -1]].tolist() == pytest.approx([1 / 3.6, 20 / 3.6])
    assert np.degrees(log.series.channels["wind_direction"])[[0, -1]].tolist() == pytest.approx([101, 120])


@pytest.mark.parametrize("before", ["> ", "INSERT ", "site/roof/wind "])
def test_what_programs_print_before_a_line_is_no_part_of_it(read: Read, before: str) -> None:
    check(read("".join(f"{before}{line}\n" for line in points("mqtt wind_speed_mps={v},wind_dir={d}").splitlines())))


def test_lines_of_another_kind_are_counted(read: Read) -> None:
    text = points("weather,site=A wind_speed_mps={v},wind_dir={d}")
    log = read(f"{text}weather,site=A wind_speed_mps=4.2,wind_d\nweather,site=A wind_speed_mps=4.2\nbroken line\n")
    check(log)
    assert [(found.count, "left out" in found.what) for found in log.findings if found.kind == "malformed-lines"] == [
        (3, True)
    ]


def test_points_without_an_instant_need_a_start_and_a_rate(log_file: Write) -> None:
    path = log_file("".join(f"weather,site=A wind_speed_mps={at + 1},wind_dir={at + 101}\n" for at in range(COUNT)))
    with pytest.raises(FlagdataError) as caught:
        read_log(path)
    assert "--start TIME --rate HZ" in (caught.value.fix or "")
    log = read_log(path, WindOptions(start=START * 10**9, rate=4.0))
    check(log)
    assert log.series.time.tolist() == [START * 10**9 + at * 250_000_000 for at in range(COUNT)]


def test_a_rate_is_refused_where_points_have_instants(log_file: Write) -> None:
    path = log_file(points("weather,site=A wind_speed_mps={v},wind_dir={d}"))
    with pytest.raises(UsageError, match="say when they were"):
        read_log(path, WindOptions(start=START * 10**9, rate=4.0))
