"""Columns by which a logger marks rows that are wrong are not passed over without a word."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer import WindOptions, read_log
from flagdata.signals import WindLog

Read = Callable[..., WindLog]


def rows(marks: tuple[str, str]) -> str:
    return "".join(f"2026-05-01T12:{at:02d}:00Z,{3 + at % 5},{marks[at % 7 == 2]}\n" for at in range(30))


@pytest.mark.parametrize(
    ("name", "marks"), [("status", ("OK", "ERR")), ("qc_ws", ("1", "4")), ("sensor status", ("A", "V"))]
)
def test_marks_that_change_are_told(read: Read, name: str, marks: tuple[str, str]) -> None:
    log = read(f"time,wind speed (m/s),{name}\n{rows(marks)}")
    (told,) = [found.what for found in log.findings if found.kind == "heading-doubtful"]
    assert told.startswith(f"column {name!r} ({', '.join(sorted(marks))}) may mark rows that are wrong")
    assert len(log.series) == 30


@pytest.mark.parametrize(
    ("name", "marks"), [("status", ("OK", "OK")), ("battery status", ("good", "low")), ("rssi", ("-97", "-98"))]
)
def test_marks_that_say_nothing_of_the_wind_are_not(read: Read, name: str, marks: tuple[str, str]) -> None:
    log = read(f"time,wind speed (m/s),{name}\n{rows(marks)}")
    assert not [found for found in log.findings if found.kind == "heading-doubtful"]


def test_a_lone_component_is_not_offered_as_one(log_file: Callable[[str], Path]) -> None:
    text = "".join(f"2026-05-01T12:{at:02d}:00Z,{3 + at % 5},{200 + at}\n" for at in range(30))
    with pytest.raises(FlagdataError) as caught:
        read_log(log_file("time,v_Wind in m/s,Richtung in Grad\n" + text))
    assert '--columns "time,wind_speed[m/s],wind_direction[deg]"' in caught.value.fix


@pytest.mark.parametrize("letter", ["U", "V"])
def test_a_letter_with_heights_is_a_speed_at_each_where_no_other_component_is_beside_it(
    log_file: Callable[[str], Path], letter: str
) -> None:
    text = "".join(f"2026-05-01T12:{at:02d}:00Z,{8 + at % 5},{6 + at % 4},{200 + at}\n" for at in range(30))
    path = log_file(f"time,{letter}_46,{letter}_20,Direction\n{text}")
    with pytest.raises(FlagdataError) as caught:
        read_log(path)
    assert f"'{letter}_46', '{letter}_20' may be a wind or another speed" in caught.value.what
    assert '--columns "time,wind_speed[?],,wind_direction[deg]"' in caught.value.fix
    assert f"name '{letter}_20' in its place in a run of its own" in caught.value.fix
    log = read_log(path, WindOptions(wind=f"{letter}_20", unit="m/s"))
    assert log.series.channels["wind_speed"].tolist() == [6 + at % 4 for at in range(30)]
