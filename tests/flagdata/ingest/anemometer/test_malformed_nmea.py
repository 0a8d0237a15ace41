"""Malformed NMEA 0183 streams: an error with place and fix, or samples flagged and findings with numbers."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable
from typing import Any

import pytest

from flagdata.errors import InputError, TimeError, UsageError
from flagdata.ingest.anemometer.draft.questions import OpenFactsError
from flagdata.ingest.anemometer.formats.sentences import checksum
from flagdata.schema import SampleFlag

Check = Callable[..., None]


def sentence(body: str) -> str:
    return f"${body}*{checksum(body):02X}"


def nmea(*bodies: str) -> bytes:
    return "\r\n".join([*(b if b.startswith("$") else sentence(b) for b in bodies), ""]).encode()


ZDA = [f"GPZDA,1200{s:02d}.00,01,05,2026,00,00" for s in range(10)]

MWV = "IIMWV,{},R,{},N,A"


def stream(wind: list[str], times: list[str] | None = None) -> bytes:
    """Time, wind, time, wind, …"""
    out: list[str] = []
    for at, time in enumerate(times or ZDA):
        out.append(time)
        if at < len(wind):
            out.append(wind[at])
    return nmea(*out)


GOOD_WIND = [MWV.format(10 * i, 5 + i) for i in range(9)]

DATE = {"date": dt.date(2026, 5, 1)}

REFUSED = [
    pytest.param(
        {
            "content": stream(GOOD_WIND, [f"GPGGA,1200{s:02d},,,,,0,,,,,,,," for s in range(10)]),
            "error": TimeError,
            "where": "line 1",
            "says": "--date",
        },
        id="no-date",
    ),
    pytest.param({"content": nmea(*GOOD_WIND), "error": TimeError, "says": "no time", "options": DATE}, id="no-time"),
    pytest.param({"content": nmea(ZDA[0], *GOOD_WIND), "error": TimeError, "says": "only one time"}, id="one-time"),
    pytest.param(
        {"content": stream(GOOD_WIND, [ZDA[0]] * 10), "error": TimeError, "says": "stands still"},
        id="time-stands-still",
    ),
    pytest.param({"content": nmea(*ZDA), "error": InputError, "says": "known format"}, id="no-wind"),
    pytest.param(
        {"content": nmea(*ZDA), "error": InputError, "says": "10 ZDA", "options": {"format": "nmea"}},
        id="no-wind-format-named",
    ),
    pytest.param(
        {"content": b"\r\n".join([b"$IIMWV,010,R,5.0,N,A*00"] * 10), "error": OpenFactsError}, id="all-checksums-wrong"
    ),
    pytest.param(
        {
            "content": b"\r\n".join([b"$IIMWV,010,R,5.0,N,A*00"] * 10),
            "error": InputError,
            "says": "baud rate",
            "options": {"format": "nmea"},
        },
        id="all-checksums-wrong-format-named",
    ),
    pytest.param(
        {"content": stream(["IIMWV,,R,,N,A"] * 9), "error": InputError, "says": "empty or invalid"},
        id="all-speeds-empty",
    ),
    pytest.param(
        {"content": stream(["IIMWV,010,R,5.0,N,A", "WIMWV,010,R,5.0,N,A"] * 4), "error": InputError, "says": "II, WI"},
        id="two-talkers",
    ),
    pytest.param(
        {
            "content": stream(GOOD_WIND),
            "error": UsageError,
            "says": "begins on 2026-05-01",
            "options": {"date": dt.date(2026, 5, 2)},
        },
        id="date-contradicts-stream",
    ),
    pytest.param(
        {
            "content": nmea(*(x for z in ZDA for x in (z, GOOD_WIND[0], "GPVTG,10.0,T,,M,6.1,N,11.3,K"))),
            "error": InputError,
            "says": "6.1 kn",
            "options": {"platform": "fixed"},
        },
        id="fixed-but-moving",
    ),
    pytest.param(
        {"content": stream(GOOD_WIND), "error": UsageError, "says": "zone", "options": {"zone": "+02:00"}},
        id="zone-for-utc-stream",
    ),
    pytest.param(
        {"content": stream(GOOD_WIND), "error": UsageError, "options": {"azimuth": 0.5}}, id="azimuth-of-a-boat"
    ),
    pytest.param(
        {
            "content": stream(GOOD_WIND),
            "error": InputError,
            "says": "no valid sentence of wind",
            "options": {"talker": "WI"},
        },
        id="talker-absent",
    ),
]
REPORTED = [
    pytest.param(
        {
            "content": stream([*GOOD_WIND[:4], "$IIMWV,040,R,9.0,N,A*00", *GOOD_WIND[5:]]),
            "finding": "checksum-errors",
            "count": 1,
            "where": "line 10",
            "samples": 8,
        },
        id="one-checksum-wrong",
    ),
    pytest.param(
        {"content": stream(["$" + w for w in GOOD_WIND]), "finding": "no-checksum", "count": 9, "samples": 9},
        id="no-checksums",
    ),
    pytest.param(
        {
            "content": stream([*GOOD_WIND[:8], "IIMWV,010,R,5.0,N,V"]),
            "finding": "sensor-fault",
            "count": 1,
            "flag": SampleFlag.SENSOR_FAULT,
            "flagged": 1,
            "samples": 9,
        },
        id="status-void",
    ),
    pytest.param(
        {
            "content": stream([*GOOD_WIND[:8], "IIMWV,010,R,,N,A"]),
            "finding": "missing-values",
            "count": 1,
            "flag": SampleFlag.MISSING,
            "flagged": 1,
        },
        id="speed-empty",
    ),
    pytest.param(
        {"content": stream([*GOOD_WIND[:8], "IIMWV,010,R,5.0,X,A"]), "finding": "missing-values", "count": 1},
        id="unit-unknown",
    ),
    pytest.param(
        {
            "content": stream([*GOOD_WIND[:8], "IIMWV,010,Q,5.0,N,A"]),
            "finding": "malformed-sentences",
            "count": 1,
            "samples": 8,
        },
        id="reference-unknown",
    ),
    pytest.param(
        {"content": stream([*GOOD_WIND[:8], "IIMWV,010,R"]), "finding": "malformed-sentences", "count": 1},
        id="fields-missing",
    ),
    pytest.param(
        {"content": stream([*GOOD_WIND[:8], "IIMWV,010,R,-5.0,N,A"]), "finding": "missing-values", "count": 1},
        id="negative-speed-field",
    ),
    pytest.param(
        {"content": stream(GOOD_WIND) + b"$IIMWV,01", "finding": "malformed-sentences", "count": 1, "samples": 9},
        id="half-a-line",
    ),
    pytest.param(
        {
            "content": stream(GOOD_WIND).replace(b"\r\n", b"\r\n%%%%\r\n", 3),
            "finding": "malformed-lines",
            "count": 3,
            "samples": 9,
        },
        id="noise-between",
    ),
    pytest.param(
        {
            "content": stream([*GOOD_WIND[:8], "IIMWD,,,,,8.1,N,4.2,M"]),
            "finding": "mwd-without-direction",
            "count": 1,
            "samples": 8,
        },
        id="mwd-without-direction",
    ),
    pytest.param(
        {
            "content": stream(
                GOOD_WIND,
                [f"GPGGA,{('2359' if s < 5 else '0000')}{(55 + s) % 60:02d},,,,,0,,,,,,,," for s in range(10)],
            ),
            "finding": "midnight",
            "count": 1,
            "samples": 9,
            "options": DATE,
        },
        id="midnight",
    ),
    pytest.param(
        {
            "content": stream(GOOD_WIND, [*ZDA[:5], "GPZDA,115000.00,01,05,2026,00,00", *ZDA[5:9]]),
            "finding": "time-backwards",
            "count": 1,
            "where": "line 11",
            "samples": 9,
        },
        id="clock-runs-back",
    ),
    pytest.param({"content": stream(GOOD_WIND), "finding": "apparent-wind-only", "samples": 9}, id="boat"),
]


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_read_is_refused_with_place_and_fix(case: dict[str, Any], check_refused: Check) -> None:
    check_refused(**case)


@pytest.mark.parametrize("case", REPORTED)
def test_a_defect_is_reported_with_its_number_and_flagged(case: dict[str, Any], check_reported: Check) -> None:
    check_reported(**case)
