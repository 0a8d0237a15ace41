"""Logs whose columns change on the way: named anew in the middle, or of another form above the table."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from flagdata.ingest.anemometer import WindOptions, read_log

Write = Callable[[str], Path]


def stamp(minute: int) -> str:
    return f"2026-05-{1 + minute // 1440:02d}T{minute // 60 % 24:02d}:{minute % 60:02d}:00Z"


def speeds(count: int, first: int = 0) -> list[float]:
    return [2 + (first + at) % 9 / 10 for at in range(count)]


def plain(first: int, count: int) -> str:
    return "".join(f"{stamp(first + at)},{speed:.1f},20\n" for at, speed in enumerate(speeds(count, first)))


def sited(first: int, count: int) -> str:
    return "".join(f"{stamp(first + at)},A,{speed:.1f},20\n" for at, speed in enumerate(speeds(count, first)))


PLAIN, SITED = "time,wind_speed_ms,temp_c\n", "time,mast,wind_speed_ms,temp_c\n"


def test_columns_that_are_named_anew_are_read_by_the_names_above_them(log_file: Write) -> None:
    # Beyond the lines by which a table is told.
    log = read_log(log_file(PLAIN + plain(0, 1200) + SITED + sited(1200, 50)))
    assert log.series.channels["wind_speed"] == pytest.approx(speeds(1250))
    told = next(finding for finding in log.findings if finding.kind == "headings-anew")
    assert told.what.startswith("lines 1 and 1202 name the columns differently")


def test_columns_that_change_places_are_not_taken_for_one_another(log_file: Write) -> None:
    turned = "".join(f"{stamp(60 + at)},20,{speed:.1f}\n" for at, speed in enumerate(speeds(60, 60)))
    log = read_log(log_file(PLAIN + plain(0, 60) + "time,temp_c,wind_speed_ms\n" + turned))
    assert log.series.channels["wind_speed"] == pytest.approx(speeds(120))
    assert log.series.channels["air_temperature"] == pytest.approx([293.15] * 120)


def test_decimal_commas_are_kept_where_columns_are_named_anew(log_file: Write) -> None:
    rows = [(PLAIN + plain(0, 30)), SITED + sited(30, 30)]
    text = "".join(rows).replace(",", ";").replace(".", ",")
    log = read_log(log_file(text))
    assert log.series.channels["wind_speed"] == pytest.approx(speeds(60))


def test_a_heading_that_is_only_repeated_is_no_new_one(log_file: Write) -> None:
    log = read_log(log_file(PLAIN + plain(0, 30) + PLAIN + plain(30, 30)))
    assert log.series.channels["wind_speed"] == pytest.approx(speeds(60))
    assert "headings-anew" not in {finding.kind for finding in log.findings}


def test_rows_of_another_form_above_the_table_are_told(log_file: Write) -> None:
    log = read_log(log_file(plain(0, 3) + "time,mast,wind_speed_ms,temp_c\n" + sited(3, 60)))
    assert log.series.channels["wind_speed"] == pytest.approx(speeds(60, 3))
    told = [finding for finding in log.findings if finding.kind == "heading-doubtful"]
    assert [finding.severity.value for finding in told] == ["warning"]
    assert "lines 1 to 3 hold 3 rows of another form than the 4 columns below" in told[0].what


def test_a_stamp_that_few_rows_have_is_not_their_time(log_file: Write) -> None:
    other = ["", "", "", "2026-05-01T00:00:59Z"]
    rows = "".join(f"{stamp(at // 2)},{other[at % 4]},{3 + at / 10:.1f},m/s\n" for at in range(40))
    log = read_log(log_file(rows), WindOptions(wind="3", unit="m/s"))
    assert len(set(log.series.time.tolist())) == 40
    assert "unreadable-stamps" not in {finding.kind for finding in log.findings}


def test_rows_of_two_cells_and_rows_of_other_widths_above_the_table_are_told(log_file: Write) -> None:
    words = "time,wind_dir\n2026-05-01 15:31:43,Southeast by South\n2026-05-01 15:33:10,Southwest by West\n"
    later = "".join(f"2026-05-02T00:{at:02d}:00Z,{200 + at}.5\n" for at in range(30))
    log = read_log(log_file(words + later), WindOptions(columns="time,wind_direction[deg]", zone="UTC"))
    told = [finding.what for finding in log.findings if finding.kind == "heading-doubtful"]
    assert any("lines 2 to 3 hold 2 rows of another form" in text for text in told)
    wider = "".join(f"{at},43337.5{at:02d},{at % 4}.5,1,2,3\n" for at in range(8))
    rows = "".join(f"2026-05-02T00:{at:02d}:00Z,{3 + at % 4}.5\n" for at in range(40))
    log = read_log(log_file(wider + rows), WindOptions(columns="time,wind_speed[m/s]"))
    told = [finding.what for finding in log.findings if finding.kind == "heading-doubtful"]
    assert any("8 of lines 1 to 8 hold numbers as the rows do" in text for text in told)
    counted = "".join(f"{at},{3 + at % 4}.5\n" for at in range(40))
    log = read_log(log_file(wider + counted), WindOptions(columns=",wind_speed[m/s]", start=0, rate=1.0))
    told = [finding.what for finding in log.findings if finding.kind == "heading-doubtful"]
    assert any("8 of lines 1 to 8 hold numbers as the rows do" in text for text in told)
