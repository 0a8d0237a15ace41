"""Tables of names and values: what was measured at one time is one row, and a speed keeps its own direction."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log

Write = Callable[[str], Path]
_SPEEDS = [3.0 + 0.25 * (at % 5) for at in range(20)]
_DIRECTIONS = [200.0 + at for at in range(20)]


def _stamp(at: int) -> str:
    return f"2026-05-01T12:00:{at:02d}Z"


@pytest.mark.parametrize(
    ("heading", "row"),
    [
        ("item,time,value", "{name},{stamp},{value}"),
        ("time,measurement,value", "{stamp},{name},{value}"),
        ("entity_id,state,last_changed", "sensor.mast_{name},{value},{stamp}"),
        ("State Code;Parameter Name;When;Sample Measurement;Units of Measure", "6;{name};{stamp};{value};{unit}"),
        ("", "{stamp} weather/{name} {value}"),
    ],
)
def test_names_and_values_of_one_stamp_are_one_row(log_file: Write, heading: str, row: str) -> None:
    lines = [heading] if heading else []
    for at, (speed, direction) in enumerate(zip(_SPEEDS, _DIRECTIONS, strict=True)):
        for name, value, unit in (("wind_speed", speed, "m/s"), ("wind_direction", direction, "Degrees Compass")):
            lines.append(row.format(name=name, stamp=_stamp(at), value=value, unit=unit))
    log = read_log(log_file("\n".join(lines) + "\n"), WindOptions(unit="m/s"))
    np.testing.assert_allclose(log.series.channels["wind_speed"], _SPEEDS)
    np.testing.assert_allclose(np.rad2deg(log.series.channels["wind_direction"]), _DIRECTIONS)
    assert np.all(np.diff(log.series.time) == 1_000_000_000)


def test_a_direction_with_stamps_of_its_own_stands_until_the_next_is_told(log_file: Write) -> None:
    lines = ["entity_id,state,last_changed"]
    for at in range(20):
        if at % 4 == 0:
            lines.append(f"sensor.wind_direction,{100 + at},2026-05-01T12:00:{at:02d}.250Z")
        lines.append(f"sensor.wind_speed,{_SPEEDS[at]},2026-05-01T12:00:{at:02d}.500Z")
    log = read_log(log_file("\n".join(lines) + "\n"), WindOptions(unit="m/s"))
    expected = [100 + at - at % 4 for at in range(20)]
    np.testing.assert_allclose(np.rad2deg(log.series.channels["wind_direction"]), expected)
    assert len(log.series.time) == 20
    assert "told-last" in {finding.kind for finding in log.findings}


def test_speeds_with_stamps_of_their_own_are_anemometers_apart(log_file: Write) -> None:
    lines = ["item,time,value"]
    for at in range(20):
        lines.append(f"roof_wind_speed,2026-05-01T12:00:{at:02d}.100Z,{_SPEEDS[at]}")
        lines.append(f"mast_wind_speed,2026-05-01T12:00:{at:02d}.600Z,{_SPEEDS[at] + 2}")
    path = log_file("\n".join(lines) + "\n")
    assert anemometers(path, WindOptions(unit="m/s")) == ("mast_wind_speed", "roof_wind_speed")
    log = read_log(path, WindOptions(unit="m/s", wind="mast_wind_speed"))
    np.testing.assert_allclose(log.series.channels["wind_speed"], np.add(_SPEEDS, 2))


def test_states_that_are_words_are_no_values(log_file: Write) -> None:
    lines = ["entity_id,state,last_changed"]
    for at in range(20):
        value = "unavailable" if at == 7 else _SPEEDS[at]
        lines.append(f"sensor.wind_speed,{value},{_stamp(at)}")
        lines.append(f"binary_sensor.door,{'on' if at % 2 else 'off'},{_stamp(at)}")
    speed = read_log(log_file("\n".join(lines) + "\n"), WindOptions(unit="m/s")).series.channels["wind_speed"]
    assert np.flatnonzero(np.isnan(speed)).tolist() == [7]


def test_a_table_with_a_speed_of_its_own_is_no_list_of_names(log_file: Write) -> None:
    rows = "".join(f"{_stamp(at)},wind sensor {at // 10},{_SPEEDS[at]}\n" for at in range(20))
    log = read_log(log_file(f"time,remark,wind speed (m/s)\n{rows}"))
    np.testing.assert_allclose(log.series.channels["wind_speed"], _SPEEDS)


def test_a_date_and_a_clock_of_different_zones_are_not_joined(log_file: Write) -> None:
    rows = "".join(f"2026-04-30,22:{at:02d},2026-05-01,05:{at:02d},{_SPEEDS[at]}\n" for at in range(20))
    log = read_log(log_file(f"Date Local,Time Local,Date GMT,Time GMT,wind speed (m/s)\n{rows}"))
    assert log.series.time.astype("datetime64[ns]")[0] == np.datetime64("2026-05-01T05:00")


def test_of_columns_of_the_same_values_the_first_is_read_with_the_unit_beside_it(log_file: Write) -> None:
    rows = "".join(
        f'4,Vindhastighet,"medelvärde 10 min",meter per sekund,{_stamp(at)},{speed},{speed},G\n'
        for at, speed in enumerate(_SPEEDS)
    )
    heading = "parameter_id,parameter_name,summary,unit,datetime_utc,value,value_numeric,quality\n"
    np.testing.assert_allclose(read_log(log_file(heading + rows)).series.channels["wind_speed"], _SPEEDS)
    other = rows.replace(f"{_SPEEDS[3]},{_SPEEDS[3]}", f"{_SPEEDS[3]},9.9")
    with pytest.raises(InputError, match="no column is surely a wind"):
        read_log(log_file(heading + other))


def test_semicolons_divide_rows_of_few_numbers_with_decimal_commas(log_file: Write) -> None:
    head = "MEETPUNT;LOCATIE_CODE;GROOTHEID_CODE;GROOTHEID_OMSCHRIJVING;EENHEID_CODE;DATUM;TIJD (MET/CET);WAARDE\n"
    rows = [f";VLIS;WINDSHD;Windsnelheid;m/s;13-05-2026;12:00:{at:02d};{speed}" for at, speed in enumerate(_SPEEDS)]
    log = read_log(log_file(head + "\n".join(rows).replace(".", ",") + "\n"), WindOptions())
    assert log.series.channels["wind_speed"].tolist() == _SPEEDS
    assert str(log.series.time[0].astype("datetime64[ns]"))[:19] == "2026-05-13T11:00:00"
