"""Laws of all parsers: what is written is read back; whatever is thrown at them, only FlagdataError
comes out."""

from __future__ import annotations

import contextlib
import datetime as dt
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from flagdata.core.units import UNITS
from flagdata.errors import FlagdataError
from flagdata.ingest import FORMATS, Head, WindOptions, read_log, sniff
from flagdata.ingest.anemometer import average
from flagdata.record.signals import WindLog
from tests.flagdata.ingest.anemometer.cases import sentence

QUICK = settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
SECOND = 1_000_000_000
BASE = 1_777_636_800 * SECOND  # 2026-05-01T12:00:00Z

speeds = st.lists(st.integers(0, 4000).map(lambda n: n / 100), min_size=2, max_size=60)
"""Hundredths of m/s, as instruments print them."""
steps = st.integers(1, 10_000)
"""Milliseconds between rows."""


def read(content: bytes, options: WindOptions | None = None) -> WindLog:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "wind.log"
        path.write_bytes(content)
        return read_log(path, options)


def instant(milliseconds: int) -> dt.datetime:
    return dt.datetime(2026, 5, 1, 12, tzinfo=dt.UTC) + dt.timedelta(milliseconds=milliseconds)


def times(count: int, step: int) -> list[int]:
    return [BASE + i * step * 1_000_000 for i in range(count)]


def trimmed(moment: dt.datetime) -> str:
    """A Campbell stamp: no trailing zeros, no fraction where it is 0."""
    text = moment.strftime("%Y-%m-%d %H:%M:%S.%f").rstrip("0")
    return text.removesuffix(".")


@QUICK
@given(values=speeds, step=steps, offset=st.integers(-14 * 60, 14 * 60))
def test_a_written_csv_is_read_back(values: Sequence[float], step: int, offset: int) -> None:
    place = dt.timezone(dt.timedelta(minutes=offset))
    rows = [f"{instant(i * step).astimezone(place).isoformat()},{v}" for i, v in enumerate(values)]
    log = read("\n".join(["time,wind_speed", *rows]).encode(), WindOptions(recipe="generic-csv"))
    assert log.series.time.tolist() == times(len(values), step)
    assert log.series.channels["wind_speed"].tolist() == list(values)


@QUICK
@given(values=speeds, step=st.integers(1, 10_000), u=st.integers(-3000, 3000))
def test_a_written_toa5_is_read_back(values: Sequence[float], step: int, u: int) -> None:
    head = (
        '"TOA5","a","b","c","d","e","f","g"\r\n"TIMESTAMP","RECORD","Ux","Uy","Uz"\r\n'
        '"TS","RN","m/s","m/s","m/s"\r\n"","","","",""\r\n'
    )
    rows = [f'"{trimmed(instant(i * step))}",{i},{u / 100},{v},0\r\n' for i, v in enumerate(values)]
    log = read((head + "".join(rows)).encode(), WindOptions(zone="UTC"))
    assert log.series.time.tolist() == times(len(values), step)
    assert log.series.channels["wind_y"].tolist() == list(values)
    assert log.series.channels["wind_speed"] == pytest.approx(
        [np.hypot(u / 100, v) for v in values], rel=1e-12
    )


@QUICK
@given(
    values=speeds,
    unit=st.sampled_from([("N", "kn"), ("K", "km/h"), ("M", "m/s"), ("S", "mph")]),
    angle=st.integers(0, 359),
)
def test_a_written_nmea_stream_is_read_back(
    values: Sequence[float], unit: tuple[str, str], angle: int
) -> None:
    bodies = [
        body
        for i, value in enumerate(values)
        for body in (
            f"GPZDA,{instant(1000 * i):%H%M%S},01,05,2026,00,00",
            f"WIMWV,{angle:03d},R,{value:05.2f},{unit[0]},A",
        )
    ]
    log = read("\r\n".join([*map(sentence, bodies), ""]).encode())
    # wind follows its ZDA by one of two lines a second: half a second later
    assert log.series.time.tolist() == [t + SECOND // 2 for t in times(len(values), 1000)]
    read_back = UNITS[unit[1]].from_si(log.series.channels["apparent_wind_speed"])
    assert read_back == pytest.approx(list(values), rel=1e-12)
    assert np.degrees(log.series.channels["apparent_wind_direction"]) == pytest.approx(
        [angle] * len(values)
    )


@QUICK
@given(values=speeds, minutes=st.integers(1, 300))
def test_a_written_kestrel_export_is_read_back(values: Sequence[float], minutes: int) -> None:
    head = (
        "Device Name;K;;\nDevice Model;5500;;\nFORMATTED DATE-TIME;Direction ° True;Wind "
        "Speed;Temperature\n"
        "YYYY-MM-DD HH:MM:SS;Deg;km/h;°F\n"
    )
    stamps = [instant(i * minutes * 60_000) for i in range(len(values))]
    rows = [
        f"{s.day}/{s.month}/{s.year} {s.hour}:{s.minute:02d};270;{v};50\n"
        for s, v in zip(stamps, values, strict=True)
    ]
    log = read((head + "".join(rows)).encode(), WindOptions(zone="UTC", date_order="dmy"))
    assert log.series.time.tolist() == times(len(values), minutes * 60_000)
    assert log.series.channels["wind_speed"] == pytest.approx([v / 3.6 for v in values], rel=1e-12)
    assert log.series.channels["air_temperature"] == pytest.approx(283.15)


@QUICK
@given(values=speeds, step=steps, junk=st.integers(0, 3))
def test_written_host_lines_are_read_back(values: Sequence[float], step: int, junk: int) -> None:
    rows = [
        f"{instant(i * step).strftime('%Y-%m-%dT%H:%M:%S.%f')},{v}" for i, v in enumerate(values)
    ]
    noise = ["2026-05-01T11:59:59.000,booting"] * junk
    text = "\n".join(["laptop_time,raw_line", *noise, *rows, ""]).encode()
    log = read(text, WindOptions(zone="UTC", recipe="serial-speed"))
    assert log.series.time.tolist() == times(len(values), step)
    assert log.series.channels["wind_speed"].tolist() == list(values)


def swallow(content: bytes, options: WindOptions) -> None:
    """Read and average; anything but a FlagdataError passes through and fails the test."""
    with contextlib.suppress(FlagdataError):
        log = read(content, options)
        if "wind_speed" in log.series.channels:
            average(log.series)


FORMAT_OPTIONS = [
    WindOptions(),
    WindOptions(format="toa5", zone="UTC"),
    WindOptions(format="nmea", date=dt.date(2026, 5, 1)),
    WindOptions(format="kestrel", zone="Europe/Amsterdam"),
    WindOptions(recipe="generic-csv", zone="America/St_Johns"),
    WindOptions(recipe="serial-speed", zone="UTC"),
    WindOptions(recipe="tracked-flag", zone="UTC"),
    WindOptions(recipe="testo-csv", zone="UTC"),
]


@pytest.mark.parametrize("options", FORMAT_OPTIONS, ids=lambda o: o.format or o.recipe or "sniffed")
@settings(max_examples=40, deadline=None)
@given(content=st.binary(max_size=400))
def test_arbitrary_bytes_raise_nothing_but_flagdata_errors(
    options: WindOptions, content: bytes
) -> None:
    swallow(content, options)


HEADERS = [
    "time,wind_speed\n",
    '"TOA5","a","b","c","d","e","f","g"\n"TIMESTAMP","RECORD","WS","diag"\n"TS","RN","m/s",""\n"","","",""\n',
    "$GPZDA,120000,01,05,2026,,\n$WIMWV,010,R,5,N,A\n$GPZDA,120001,01,05,2026,,\n",
    (
        "Device Name;K;;\nDevice Model;5;;\nFORMATTED DATE-TIME;Direction ° True;Wind "
        "Speed;Temperature\nx;Deg;m/s;C\n"
    ),
    "laptop_time,raw_line\n",
    "Date;Time;m/s;°C\n",
]
TOKENS = st.sampled_from(
    [
        ",",
        ";",
        "\n",
        "\r\n",
        '"',
        "$",
        "*",
        "\\",
        "NaN",
        "inf",
        "-",
        "---",
        "1e999",
        "-9999",
        "0",
        "5.25",
        "3,5",
        "2026-05-01T12:00:00Z",
        "2026-10-25 02:30:00",
        "2026-03-29 02:30:00",
        "2026-05-01 12:00:00.5",
        "\x00",
        "13/6/2026 10:00",
        "9999-12-31T23:59:59Z",
        "01.05.2026",
        "12:00:00",
        "$IIMWV,010,R,5.0,N,A",
        "é",
        "λ",
        "$GPZDA,235959.99,31,12,2026,00,00",
        "$GPRMC,120000,A,,,,,5.0,,010526,,",
        "$IIMWD,010,T,,M,5,N,2.6,M",
        "1765296945.951",
        "100",
        "\ufeff",
        "\\c:1777636800*57\\",
        "2199-01-01T00:00:00Z",
        "1970-01-01T00:00:00Z",
    ]
)


@pytest.mark.parametrize("options", FORMAT_OPTIONS, ids=lambda o: o.format or o.recipe or "sniffed")
@settings(max_examples=60, deadline=None)
@given(header=st.sampled_from(HEADERS), tokens=st.lists(TOKENS, max_size=40))
def test_shuffled_fragments_of_logs_raise_nothing_but_flagdata_errors(
    options: WindOptions, header: str, tokens: Sequence[str]
) -> None:
    swallow((header + "".join(tokens)).encode(), options)


@settings(max_examples=80, deadline=None)
@given(content=st.binary(min_size=1, max_size=300))
def test_sniffing_any_file_gives_a_reason(content: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "file"
        path.write_bytes(content)
        guesses = sniff(path)
    assert guesses
    assert all(guess.reasons and 0 <= guess.score <= 1 for guess in guesses)
    assert [g.score for g in guesses] == sorted((g.score for g in guesses), reverse=True)


@pytest.mark.parametrize("name", sorted(FORMATS))
def test_every_format_of_the_table_keeps_the_contract(name: str) -> None:
    reader = FORMATS[name]()
    assert reader.name == name
    assert reader.about
    known = {f for f in WindOptions.__dataclass_fields__ if f not in ("format", "recipe", "limits")}
    assert reader.uses <= known
    assert reader.recognise(Head(lines=())) is None
    assert reader.recognise(Head(lines=("",))) is None
    assert reader.recognise(Head(lines=("The wind blew all day.", "Then it stopped."))) is None
