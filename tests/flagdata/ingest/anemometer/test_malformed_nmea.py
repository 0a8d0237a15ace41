"""Malformed NMEA 0183 streams: an error with place and fix, or samples flagged and findings with
numbers."""

from __future__ import annotations

import datetime as dt
from typing import Any

import pytest

from flagdata.core.schema import SampleFlag
from flagdata.errors import InputError, TimeError, UsageError
from flagdata.ingest import OpenFactsError
from tests.flagdata.ingest.anemometer.cases import case, sentence
from tests.flagdata.ingest.anemometer.conftest import check_refused, check_reported


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
    case(
        "no-date",
        content=stream(GOOD_WIND, [f"GPGGA,1200{s:02d},,,,,0,,,,,,,," for s in range(10)]),
        error=TimeError,
        where="line 1",
        says="--date",
    ),
    case("no-time", content=nmea(*GOOD_WIND), error=TimeError, says="no time", options=DATE),
    case("one-time", content=nmea(ZDA[0], *GOOD_WIND), error=TimeError, says="only one time"),
    case(
        "time-stands-still",
        content=stream(GOOD_WIND, [ZDA[0]] * 10),
        error=TimeError,
        says="stands still",
    ),
    case("no-wind", content=nmea(*ZDA), error=InputError, says="known format"),
    case(
        "no-wind-format-named",
        content=nmea(*ZDA),
        error=InputError,
        says="10 ZDA",
        options={"format": "nmea"},
    ),
    case(
        "all-checksums-wrong",
        content=b"\r\n".join([b"$IIMWV,010,R,5.0,N,A*00"] * 10),
        error=OpenFactsError,
    ),
    case(
        "all-checksums-wrong-format-named",
        content=b"\r\n".join([b"$IIMWV,010,R,5.0,N,A*00"] * 10),
        error=InputError,
        says="baud rate",
        options={"format": "nmea"},
    ),
    case(
        "all-speeds-empty",
        content=stream(["IIMWV,,R,,N,A"] * 9),
        error=InputError,
        says="empty or invalid",
    ),
    case(
        "two-talkers",
        content=stream(["IIMWV,010,R,5.0,N,A", "WIMWV,010,R,5.0,N,A"] * 4),
        error=InputError,
        says="II, WI",
    ),
    case(
        "date-contradicts-stream",
        content=stream(GOOD_WIND),
        error=UsageError,
        says="begins on 2026-05-01",
        options={"date": dt.date(2026, 5, 2)},
    ),
    case(
        "fixed-but-moving",
        content=nmea(*(x for z in ZDA for x in (z, GOOD_WIND[0], "GPVTG,10.0,T,,M,6.1,N,11.3,K"))),
        error=InputError,
        says="6.1 kn",
        options={"platform": "fixed"},
    ),
    case(
        "zone-for-utc-stream",
        content=stream(GOOD_WIND),
        error=UsageError,
        says="zone",
        options={"zone": "+02:00"},
    ),
    case(
        "azimuth-of-a-boat", content=stream(GOOD_WIND), error=UsageError, options={"azimuth": 0.5}
    ),
    case(
        "talker-absent",
        content=stream(GOOD_WIND),
        error=InputError,
        says="no valid sentence of wind",
        options={"talker": "WI"},
    ),
]
REPORTED = [
    case(
        "one-checksum-wrong",
        content=stream([*GOOD_WIND[:4], "$IIMWV,040,R,9.0,N,A*00", *GOOD_WIND[5:]]),
        finding="checksum-errors",
        count=1,
        where="line 10",
        samples=8,
    ),
    case(
        "no-checksums",
        content=stream(["$" + w for w in GOOD_WIND]),
        finding="no-checksum",
        count=9,
        samples=9,
    ),
    case(
        "status-void",
        content=stream([*GOOD_WIND[:8], "IIMWV,010,R,5.0,N,V"]),
        finding="sensor-fault",
        count=1,
        flag=SampleFlag.SENSOR_FAULT,
        flagged=1,
        samples=9,
    ),
    case(
        "speed-empty",
        content=stream([*GOOD_WIND[:8], "IIMWV,010,R,,N,A"]),
        finding="missing-values",
        count=1,
        flag=SampleFlag.MISSING,
        flagged=1,
    ),
    case(
        "unit-unknown",
        content=stream([*GOOD_WIND[:8], "IIMWV,010,R,5.0,X,A"]),
        finding="missing-values",
        count=1,
    ),
    case(
        "reference-unknown",
        content=stream([*GOOD_WIND[:8], "IIMWV,010,Q,5.0,N,A"]),
        finding="malformed-sentences",
        count=1,
        samples=8,
    ),
    case(
        "fields-missing",
        content=stream([*GOOD_WIND[:8], "IIMWV,010,R"]),
        finding="malformed-sentences",
        count=1,
    ),
    case(
        "negative-speed-field",
        content=stream([*GOOD_WIND[:8], "IIMWV,010,R,-5.0,N,A"]),
        finding="missing-values",
        count=1,
    ),
    case(
        "half-a-line",
        content=stream(GOOD_WIND) + b"$IIMWV,01",
        finding="malformed-sentences",
        count=1,
        samples=9,
    ),
    case(
        "noise-between",
        content=stream(GOOD_WIND).replace(b"\r\n", b"\r\n%%%%\r\n", 3),
        finding="malformed-lines",
        count=3,
        samples=9,
    ),
    case(
        "mwd-without-direction",
        content=stream([*GOOD_WIND[:8], "IIMWD,,,,,8.1,N,4.2,M"]),
        finding="mwd-without-direction",
        count=1,
        samples=8,
    ),
    case(
        "midnight",
        content=stream(
            GOOD_WIND,
            [
                f"GPGGA,{('2359' if s < 5 else '0000')}{(55 + s) % 60:02d},,,,,0,,,,,,,,"
                for s in range(10)
            ],
        ),
        finding="midnight",
        count=1,
        samples=9,
        options=DATE,
    ),
    case(
        "clock-runs-back",
        content=stream(GOOD_WIND, [*ZDA[:5], "GPZDA,115000.00,01,05,2026,00,00", *ZDA[5:9]]),
        finding="time-backwards",
        count=1,
        where="line 11",
        samples=9,
    ),
    case("boat", content=stream(GOOD_WIND), finding="apparent-wind-only", samples=9),
]


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_read_is_refused_with_place_and_fix(case: dict[str, Any]) -> None:
    check_refused(**case)


@pytest.mark.parametrize("case", REPORTED)
def test_a_defect_is_reported_with_its_number_and_flagged(case: dict[str, Any]) -> None:
    check_reported(**case)
