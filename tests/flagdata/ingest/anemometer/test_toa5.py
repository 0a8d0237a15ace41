"""TOA5: columns by the names that Campbell programs give them, units by the header, diagnostics by
the manual."""

from __future__ import annotations

import datetime as dt
from collections.abc import Sequence

import numpy as np
import pytest

from flagdata.core.schema import SampleFlag
from tests.flagdata.ingest.anemometer.conftest import read


def table(
    columns: Sequence[tuple[str, str, str]], rows: Sequence[Sequence[object]], *, rate: int = 1
) -> str:
    """A table of (name, unit, processing) columns with a row every 1/rate seconds."""
    names = [("TIMESTAMP", "TS", ""), ("RECORD", "RN", ""), *columns]
    head = ['"TOA5","site","CR1000X","1234","CR1000X.Std.07","CPU:wind.CR1X","1","Table1"']
    head += [",".join(f'"{column[i]}"' for column in names) for i in range(3)]
    start = dt.datetime(2026, 5, 1, 12, tzinfo=dt.UTC)
    stamps = [
        (start + dt.timedelta(seconds=i / rate)).strftime("%F %T.%f").rstrip("0").rstrip(".")
        for i in range(len(rows))
    ]
    body = [
        f'"{stamp}",{i},' + ",".join(map(str, row))
        for i, (stamp, row) in enumerate(zip(stamps, rows, strict=True))
    ]
    return "\r\n".join([*head, *body, ""])


WS = ("WS_ms_Avg", "meters/second", "Avg")


@pytest.mark.parametrize(
    ("name", "unit", "channel", "value", "si"),
    [
        ("WS_ms_Avg", "meters/second", "wind_speed", 5, 5),
        ("WS_ms", "m/s", "wind_speed", 5, 5),
        ("WS_ms_S_WVT", "meters/second", "wind_speed", 5, 5),
        ("WindSpd", "mph", "wind_speed", 10, 4.4704),
        ("Wind_Speed", "kph", "wind_speed", 36, 10),
        ("WindDir_D1_WVT", "Deg", "wind_direction", 180, np.pi),
        ("WindDir", "degrees", "wind_direction", 90, np.pi / 2),
        ("Ts_1", "C", "sonic_temperature", 20, 293.15),
        ("AirTC_Avg", "Deg C", "air_temperature", 20, 293.15),
        ("AirTF", "Deg F", "air_temperature", 50, 283.15),
        ("RH", "%", "relative_humidity", 55, 0.55),
        ("RH", "", "relative_humidity", 55, 0.55),
        ("BP_mbar_Avg", "mbar", "air_pressure", 1013, 101_300),
        ("Press", "kPa", "air_pressure", 101.3, 101_300),
    ],
)
def test_usual_column_names_find_their_channel(
    name: str, unit: str, channel: str, value: float, si: float
) -> None:
    columns = [(name, unit, "Smp")] if channel == "wind_speed" else [WS, (name, unit, "Smp")]
    log = read(table(columns, [[5, value][-len(columns) :]] * 3), zone="UTC")
    assert log.series.channels[channel] == pytest.approx([si] * 3)


def test_columns_that_are_not_read_are_listed_with_their_units() -> None:
    log = read(
        table([WS, ("SlrW_Avg", "W/m^2", "Avg"), ("BattV", "Volts", "Min")], [[3, 500, 12.6]] * 2),
        zone="UTC",
    )
    found = next(f for f in log.findings if f.kind == "columns-not-read")
    assert found.what == "SlrW_Avg [W/m^2], BattV [Volts]"


@pytest.mark.parametrize(
    ("processing", "averaging"), [("Smp", 0.0), ("Avg", 1.0), ("WVc", 1.0), ("Max", None)]
)
def test_the_header_says_how_long_the_logger_averages(
    processing: str, averaging: float | None
) -> None:
    log = read(table([("WS_ms", "m/s", processing)], [[3 + i % 3] for i in range(10)]), zone="UTC")
    assert log.series.sensor.averaging == averaging


U = [
    ("Ux", "m/s", "Smp"),
    ("Uy", "m/s", "Smp"),
    ("Uz", "m/s", "Smp"),
    ("diag_csat", "unitless", "Smp"),
]


def csat(words: Sequence[int]) -> str:
    return table(
        U, [[1.5 + 0.1 * (i % 7), 0.3, 0.1, word] for i, word in enumerate(words)], rate=20
    )


def test_the_csat3s_counter_is_no_fault() -> None:
    # bits 0 to 5 count measurements, 0 to 63 and round again
    log = read(csat([i % 64 for i in range(200)]), zone="UTC")
    assert not log.series.flags.any()


@pytest.mark.parametrize("bit", [12, 13, 14, 15])
def test_each_warning_bit_of_the_csat3_is_a_fault(bit: int) -> None:
    log = read(csat([(i % 64) | (1 << bit if i == 100 else 0) for i in range(200)]), zone="UTC")
    assert np.flatnonzero(log.series.flags & SampleFlag.SENSOR_FAULT).tolist() == [100]


def test_a_diagnostic_that_does_not_count_is_a_fault_wherever_it_is_not_zero() -> None:
    log = read(csat([0, 0, 4, 0, 61_503, 0]), zone="UTC")
    assert np.flatnonzero(log.series.flags & SampleFlag.SENSOR_FAULT).tolist() == [2, 4]


def test_records_show_what_the_stamps_alone_would_hide() -> None:
    text = table([("WS_ms", "m/s", "Smp")], [[3 + i % 3] for i in range(10)]).replace(
        ",7,4", ",9,4"
    )
    log = read(text, zone="UTC")
    lost = next(f for f in log.findings if f.kind == "records-lost")
    assert (lost.count, lost.where) == (2, "line 12")


def test_a_direction_that_was_averaged_as_a_number_is_a_warning() -> None:
    rows = [(3 + at % 7 / 10, (350 + at) % 360) for at in range(30)]
    warned = {
        how: "direction-mean-of-numbers"
        in {
            found.kind
            for found in read(
                table([("WS_ms_Avg", "meters/second", how), ("WindDir_Avg", "degrees", how)], rows),
                zone="UTC",
            ).findings
        }
        for how in ("Avg", "WVc")
    }
    assert warned == {"Avg": True, "WVc": False}
