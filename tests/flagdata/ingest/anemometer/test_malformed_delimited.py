"""Malformed delimited logs: an error with place and fix, or samples flagged and findings with
numbers."""

from __future__ import annotations

import datetime as dt
from typing import Any

import pytest

from flagdata.core.schema import SampleFlag
from flagdata.errors import FlagdataError, InputError, TimeError, UnknownNameError, UsageError
from flagdata.ingest import OpenFactsError
from tests.flagdata.ingest.anemometer.cases import GOOD, ROW, case, csv, stamped
from tests.flagdata.ingest.anemometer.conftest import check_refused, check_reported

NEXT = "2026-05-01T12:00:01Z,3.2"

DATE = {"date": dt.date(2026, 5, 1)}

REFUSED = [
    case(
        "column-twice",
        content=csv("2026-05-01T12:00:00Z,3,4", header="time,wind_speed,wind_speed"),
        error=InputError,
        says="2 columns are called 'wind_speed'",
    ),
    case("header-only", content=csv(), error=InputError, where="line 2", says="no row"),
    case("header-without-line-end", content=b"time,wind_speed", error=InputError, says="no row"),
    case("header-and-blank-lines", content=csv("", "", ""), error=InputError, says="no row"),
    case(
        "no-zone",
        content=csv("2026-05-01T12:00:00,3"),
        error=TimeError,
        where="line 2",
        says="--zone",
    ),
    case(
        "wrong-zone-name",
        content=csv("2026-05-01 12:00:00,3"),
        error=UnknownNameError,
        says="Europe/Amsterdam",
        options={"zone": "Europe/Amsterdm"},
    ),
    case(
        "zone-beyond-14-h",
        content=csv("2026-05-01 12:00:00,3"),
        error=TimeError,
        options={"zone": "+15:00"},
    ),
    case(
        "time-set-forward",
        content=csv("2026-03-29 02:30:00,3"),
        error=TimeError,
        where="line 2",
        says="does not exist",
        options={"zone": "Europe/Amsterdam"},
    ),
    case(
        "time-set-back",
        content=csv("2026-10-25 02:30:00,3"),
        error=TimeError,
        where="line 2",
        says="occurs twice",
        options={"zone": "Europe/Amsterdam"},
    ),
    case(
        "no-stamp-readable", content=csv("yesterday,3", "today,4"), error=InputError, where="line 2"
    ),
    case("month-13", content=csv("2026-13-01T12:00:00Z,3"), error=InputError, where="line 2"),
    case("30-february", content=csv("2026-02-30T12:00:00Z,3"), error=InputError, where="line 2"),
    case("29-february-in-a-common-year", content=csv("2026-02-29T12:00:00Z,3"), error=InputError),
    case("hour-25", content=csv("2026-05-01T25:00:00Z,3"), error=InputError, where="line 2"),
    case("minute-60", content=csv("2026-05-01T12:60:00Z,3"), error=InputError, where="line 2"),
    case("year-0000", content=csv("0000-05-01T12:00:00Z,3"), error=InputError, where="line 2"),
    case("most-stamps-bad", content=csv(ROW, "x,1", "y,2", "z,3"), error=InputError, says="3 of 4"),
    case("most-values-bad", content=stamped("a", "b", "d", "3"), error=InputError, says="3 of 4"),
    case(
        "all-values-missing",
        content=stamped("", "NaN", "---", "n/a"),
        error=InputError,
        says="not one value",
    ),
    case(
        "most-lines-ragged",
        content=csv("a,b,c,d", "a,b,c,d", ROW),
        error=InputError,
        where="line 2",
    ),
    case(
        "other-delimiter",
        content=csv("2026-05-01T12:00:00Z;3.1", "2026-05-01T12:00:01Z;3.1"),
        error=InputError,
    ),
    case(
        "column-missing", content=csv(ROW, header="time,speed"), error=OpenFactsError, says="--unit"
    ),
    case(
        "column-missing-recipe-named",
        content=csv(ROW, header="time,wind_sped"),
        error=InputError,
        says="did you mean 'wind_sped'",
        options={"recipe": "generic-csv"},
    ),
    case(
        "recipe-unknown",
        content=csv(ROW),
        error=UnknownNameError,
        says="did you mean 'generic-csv'",
        options={"recipe": "generic-cvs"},
    ),
    case(
        "recipe-file-absent",
        content=csv(ROW),
        error=FlagdataError,
        says="no such recipe file",
        options={"recipe": "/nowhere/x.toml"},
    ),
    case(
        "format-unknown",
        content=csv(ROW),
        error=UnknownNameError,
        says="did you mean 'nmea'",
        options={"format": "nmae"},
    ),
    case(
        "format-without-recipe",
        content=csv(ROW),
        error=OpenFactsError,
        says="--unit",
        options={"format": "delimited"},
    ),
    case(
        "option-of-another-format",
        content=csv(ROW),
        error=UsageError,
        says="--date is not used",
        options=DATE,
    ),
    case(
        "azimuth-without-components",
        content=csv(ROW, NEXT),
        error=UsageError,
        options={"azimuth": 1.0},
    ),
    case(
        "encoding-unknown",
        content=csv(ROW),
        error=InputError,
        says="no encoding",
        options={"encoding": "utf-99"},
    ),
    case(
        "encoding-not-of-text", content=csv(ROW), error=InputError, options={"encoding": "base64"}
    ),
    case(
        "encoding-wrong",
        content="time,wind_speed\n2026-05-01T12:00:00Z,3 §\n".encode("cp1252"),
        error=InputError,
        where="line 2",
        says="cp1252",
        options={"encoding": "utf-8"},
    ),
    case(
        "clock-set-back-an-hour",
        error=TimeError,
        where="line 32",
        says="split the file",
        content=csv(
            *(f"2026-05-01T13:00:{i:02d}Z,3" for i in range(30)),
            *(f"2026-05-01T12:00:{i:02d}Z,3" for i in range(30)),
        ),
    ),
    case(
        "time-all-mixed-up",
        error=TimeError,
        says="backwards",
        content=csv(*(f"2026-05-01T12:{(37 * i) % 60:02d}:00Z,3" for i in range(40))),
    ),
    case(
        "estimate-of-zero-without-idling",
        content=stamped(*GOOD),
        error=FlagdataError,
        says="nowhere idle",
        options={"zero_offset": "estimate"},
    ),
]
REPORTED = [
    case(
        "newest-first",
        finding="newest-first",
        count=40,
        samples=40,
        content=csv(*(f"2026-05-01T12:{59 - i:02d}:00Z,3" for i in range(40))),
    ),
    case(
        "unreadable-stamp",
        content=csv(ROW, "when?,3", NEXT),
        finding="unreadable-stamps",
        count=1,
        where="line 3",
        samples=2,
    ),
    case(
        "second-60",
        content=csv(ROW, "2026-05-01T12:00:60Z,3", NEXT),
        finding="unreadable-stamps",
        count=1,
    ),
    case(
        "unreadable-value",
        content=stamped("3", "abc", "4", "5"),
        finding="unreadable-values",
        count=1,
        where="line 3",
        flag=SampleFlag.MISSING,
        flagged=1,
        samples=4,
    ),
    case(
        "nan",
        content=stamped("3", "NaN", "4"),
        finding="missing-values",
        count=1,
        flag=SampleFlag.MISSING,
        flagged=1,
    ),
    case("nan-lower", content=stamped("3", "nan", "4"), finding="missing-values", count=1),
    case(
        "dashes",
        content=stamped("3", "---", "4"),
        finding="missing-values",
        count=1,
        where="line 3",
    ),
    case("empty-value", content=stamped("3", "", "4"), finding="missing-values", count=1),
    case("blank-value", content=stamped("3", "   ", "4"), finding="missing-values", count=1),
    case(
        "infinity",
        content=stamped("3", "inf", "4"),
        finding="out-of-range",
        count=1,
        flag=SampleFlag.OUT_OF_RANGE,
        flagged=1,
    ),
    case("minus-infinity", content=stamped("3", "-Infinity", "4"), finding="out-of-range", count=1),
    case("overflow", content=stamped("3", "1e999", "4"), finding="out-of-range", count=1),
    case(
        "microsoft-infinity", content=stamped("3", "1.#INF", "4"), finding="out-of-range", count=1
    ),
    case("hexadecimal", content=stamped("3", "0x10", "4"), finding="unreadable-values", count=1),
    case(
        "decimal-comma",
        content=csv(ROW, '2026-05-01T12:00:01Z,"3,2"', "2026-05-01T12:00:02Z,3"),
        finding="unreadable-values",
        count=1,
    ),
    case(
        "thousands",
        content=csv(ROW, '2026-05-01T12:00:01Z,"1,003.2"', "2026-05-01T12:00:02Z,3"),
        finding="unreadable-values",
        count=1,
    ),
    case("unit-in-cell", content=stamped("3", "4 m/s", "4"), finding="unreadable-values", count=1),
    case(
        "negative",
        content=stamped("3", "-0.4", "4"),
        finding="negative-speed",
        count=1,
        where="line 3",
        flag=SampleFlag.OUT_OF_RANGE,
        flagged=1,
    ),
    case(
        "minus-zero-point-zero-one",
        content=stamped("3", "-0.01", "4"),
        finding="negative-speed",
        count=1,
    ),
    case(
        "too-many-cells",
        content=csv(ROW, "2026-05-01T12:00:01Z,3,4", "2026-05-01T12:00:02Z,3"),
        finding="malformed-lines",
        count=1,
        where="line 3",
        samples=2,
    ),
    case(
        "too-few-cells",
        content=csv(ROW, "2026-05-01T12:00:01Z", "2026-05-01T12:00:02Z,3"),
        finding="malformed-lines",
        count=1,
        where="line 3",
    ),
    case(
        "unclosed-quote",
        content=csv(ROW, '2026-05-01T12:00:01Z,"3', "2026-05-01T12:00:02Z,3"),
        finding="malformed-lines",
        count=1,
        where="line 3",
        samples=2,
    ),
    case(
        "cut-off-in-a-stamp",
        content=csv(ROW, NEXT) + b"2026-05-01T12:0",
        finding="cut-off",
        where="line 4",
        samples=2,
    ),
    case(
        "repeated-header",
        content=csv(ROW, "time,wind_speed", NEXT),
        finding="unreadable-stamps",
        count=1,
        where="line 3",
    ),
    case(
        "nul-tail", content=stamped(*GOOD) + bytes(200), finding="nul-bytes", count=200, samples=20
    ),
    case(
        "nul-in-a-value", content=stamped("3", "4\x00", "4"), finding="unreadable-values", count=1
    ),
    case(
        "mixed-line-ends",
        content=b"time,wind_speed\r\n" + f"{ROW}\n{NEXT}\r\n".encode(),
        finding="mixed-line-ends",
        samples=2,
    ),
    case(
        "latin-1",
        content="time,wind_speed,ort\n2026-05-01T12:00:00Z,3,Köln\n".encode("latin-1"),
        finding="encoding-assumed",
        samples=1,
    ),
    case(
        "duplicate-row",
        content=csv(
            ROW,
            NEXT,
            NEXT,
            "2026-05-01T12:00:02Z,3",
            "2026-05-01T12:00:03Z,4",
            "2026-05-01T12:00:04Z,3",
            "2026-05-01T12:00:05Z,4",
        ),
        finding="duplicate-rows",
        count=1,
        where="line 4",
        samples=6,
    ),
    case(
        "duplicate-stamp-other-value",
        finding="duplicate-stamps",
        count=1,
        where="line 4",
        samples=5,
        content=csv(
            ROW,
            NEXT,
            "2026-05-01T12:00:01Z,9",
            "2026-05-01T12:00:02Z,3",
            "2026-05-01T12:00:03Z,4",
            "2026-05-01T12:00:04Z,4",
        ),
    ),
    case(
        "whole-seconds-at-4-hz",
        finding="coarse-stamps",
        count=40,
        flag=SampleFlag.TIME_UNSURE,
        flagged=40,
        samples=40,
        content=csv(*(f"2026-05-01T12:00:{i // 4:02d}Z,{3 + i % 5}" for i in range(40))),
    ),
    case(
        "a-second-late",
        finding="time-backwards",
        count=1,
        where="line 4",
        flag=SampleFlag.TIME_UNSURE,
        flagged=1,
        content=csv(ROW, "2026-05-01T12:00:02Z,3", NEXT, "2026-05-01T12:00:03Z,3"),
        samples=4,
    ),
    case(
        "one-stamp-of-1980",
        finding="time-backwards",
        count=1,
        where="line 12",
        samples=19,
        content=csv(
            *(
                f"{('1980-01-01' if i == 10 else '2026-05-01')}T12:00:{i:02d}Z,{v}"
                for i, v in enumerate(GOOD)
            )
        ),
    ),
    case(
        "one-stamp-of-2099",
        finding="time-backwards",
        count=1,
        where="line 12",
        samples=19,
        content=csv(
            *(
                f"{('2099-01-01' if i == 10 else '2026-05-01')}T12:00:{i:02d}Z,{v}"
                for i, v in enumerate(GOOD)
            )
        ),
    ),
    case(
        "gap",
        finding="gaps",
        count=1,
        where="line 12",
        samples=20,
        content=csv(
            *(f"2026-05-01T12:00:{i + 7 * (i >= 10):02d}Z,{v}" for i, v in enumerate(GOOD))
        ),
    ),
    case(
        "hour-that-occurs-twice",
        finding="clocks-set-back",
        count=120,
        samples=180,
        options={"zone": "Europe/Amsterdam"},
        content=csv(
            *(f"2026-10-25 01:{m:02d}:00,3" for m in range(60)),
            *(f"2026-10-25 02:{m:02d}:00,4" for m in range(60)),
            *(f"2026-10-25 02:{m:02d}:00,5" for m in range(60)),
        ),
    ),
    case(
        "stuck",
        finding="stale-repeats",
        count=30,
        flag=SampleFlag.STALE,
        flagged=30,
        content=stamped(*GOOD, *["7.7"] * 31, *GOOD),
    ),
    case(
        "calm-below-the-threshold",
        finding="dead-zone",
        count=3,
        flag=SampleFlag.DEAD_ZONE,
        flagged=3,
        content=stamped("3", "0", "0", "0", "2"),
    ),
]


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_read_is_refused_with_place_and_fix(case: dict[str, Any]) -> None:
    check_refused(**case)


@pytest.mark.parametrize("case", REPORTED)
def test_a_defect_is_reported_with_its_number_and_flagged(case: dict[str, Any]) -> None:
    check_reported(**case)
