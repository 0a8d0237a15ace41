"""Annotated CSV of InfluxDB, made after its published description: series below each other become one row a time."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.ingest.anemometer import WindOptions, anemometers, read_log
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
COUNT = 90
"""Rows of a series: more than the lines by which the kind of a text is told."""


def series(
    number: int, field: str, first: float, *, tags: str = "", measurement: str = "weather", late: int = 0
) -> str:
    """A row a minute, of values from `first` in steps of 1; its stamps are `late` seconds."""
    return "".join(
        f",,{number},2026-05-01T{12 + at // 60}:{at % 60:02d}:{late:02d}Z,{first + at:g},{field},{measurement}{tags}\n"
        for at in range(COUNT)
    )


def heading(tags: str = "") -> str:
    more = tags.count(",")
    return (
        f"#datatype,string,long,dateTime:RFC3339,double,string,string{',string' * more}\n"
        f"#group,false,false,false,false,true,true{',true' * more}\n#default,_result,,,,,{',' * more}\n"
        f",result,table,_time,_value,_field,_measurement{tags}\n"
    )


def test_a_series_of_each_field_is_a_column(read: Read) -> None:
    text = heading() + series(0, "humidity", 10) + series(1, "wind_dir", 100) + "\n"
    log = read(text + heading() + series(2, "wind_speed", 1), unit="km/h")
    assert len(log.series) == COUNT
    assert log.series.channels["wind_speed"][[0, -1]].tolist() == pytest.approx([1 / 3.6, 90 / 3.6])
    assert np.degrees(log.series.channels["wind_direction"])[[0, -1]].tolist() == pytest.approx([100, 189])
    assert not [found for found in log.findings if "left out" in found.what and "humidity" not in found.what]


def test_an_entity_names_a_plain_value_and_the_measurement_is_its_unit(read: Read) -> None:
    text = heading(",entity_id")
    text += series(0, "value", 1, tags=",roof_wind_speed", measurement="km/h", late=20)
    text += series(1, "value", 100, tags=",roof_wind_direction", measurement="°", late=10)
    log = read(text)
    assert log.series.channels["wind_speed"][[0, -1]].tolist() == pytest.approx([1 / 3.6, 90 / 3.6])
    # each direction was told 10 s before its speed
    assert np.degrees(log.series.channels["wind_direction"])[[0, -1]].tolist() == pytest.approx([100, 189])


def test_tags_that_change_tell_sites_apart(log_file: Callable[[str], Path]) -> None:
    text = heading(",station") + series(0, "wind_speed", 1, tags=",A") + series(1, "wind_speed", 5, tags=",B")
    path = log_file(text)
    assert anemometers(path, WindOptions(unit="m/s")) == ("A", "B")
    log = read_log(path, WindOptions(unit="m/s", wind="B"))
    assert log.series.channels["wind_speed"][[0, -1]].tolist() == pytest.approx([5, 94])


def test_sites_are_called_by_the_tag_that_names_them_and_no_more(log_file: Callable[[str], Path]) -> None:
    text = heading(",owner,lat,station") + series(0, "wind_speed", 1, tags=",city,52.1,A")
    text += series(1, "wind_speed", 5, tags=",club,52.3,B") + series(2, "wind_speed", 9, tags=",club,52.4,C")
    assert anemometers(log_file(text), WindOptions(unit="m/s")) == ("A", "B", "C")


def test_fields_in_columns_of_their_own_are_an_ordinary_table(read: Read) -> None:
    rows = "".join(f",_result,0,2026-05-01T12:{at:02d}:00Z,{at + 1},{200 + at}\n" for at in range(20))
    text = "#group,false,false,false,false,false\n#datatype,string,long,dateTime:RFC3339,double,double\n#default,,,,,\n"
    log = read(f"{text},result,table,_time,wind_speed,wind_dir\n{rows}", unit="m/s")
    assert log.series.channels["wind_speed"][[0, -1]].tolist() == pytest.approx([1, 20])
