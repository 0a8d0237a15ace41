"""Malformed Kestrel exports: an error with place and fix, or samples flagged and findings with numbers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from flagdata.errors import InputError, TimeError, UsageError
from flagdata.schema import SampleFlag

Check = Callable[..., None]

UTC = {"zone": "UTC"}

KESTREL_HEAD = (
    "Device Name;K;;;\nDevice Model;5500;;;\nSerial Number;1;;;\n"
    "FORMATTED DATE-TIME;Direction ° True;Wind Speed;Temperature;Station Pressure\n"
    "YYYY-MM-DD HH:MM:SS;Deg;m/s;°C;mb\n"
)


def kestrel(*rows: str, head: str = KESTREL_HEAD) -> bytes:
    return (head + "\n".join([*rows, ""])).encode()


def kestrel_day(day: int, speed: str = "2.5") -> str:
    return f"{day}/6/2026 10:00;300;{speed};20;1010"


REFUSED = [
    pytest.param({"content": kestrel(), "error": InputError, "where": "line 6", "says": "no rows"}, id="no-rows"),
    pytest.param(
        {"content": kestrel(kestrel_day(13), kestrel_day(14)), "error": TimeError, "says": "--zone"}, id="no-zone"
    ),
    pytest.param(
        {"content": kestrel(kestrel_day(5)), "error": TimeError, "says": "dmy or mdy", "options": UTC},
        id="date-order-unknowable",
    ),
    pytest.param(
        {
            "content": kestrel(kestrel_day(13), "6/14/2026 10:00;300;2;20;1010"),
            "error": TimeError,
            "says": "mixes",
            "options": UTC,
        },
        id="date-orders-mixed",
    ),
    pytest.param(
        {
            "content": kestrel(kestrel_day(13)),
            "error": TimeError,
            "says": "it is dmy",
            "options": {"date_order": "mdy", **UTC},
        },
        id="date-order-told-wrong",
    ),
    pytest.param(
        {
            "content": kestrel(kestrel_day(13), head=KESTREL_HEAD.replace("m/s", "Bft")),
            "error": InputError,
            "where": "line 5",
            "says": "Beaufort",
            "options": UTC,
        },
        id="beaufort",
    ),
    pytest.param(
        {"content": kestrel("13/6/2026;300;2;20;1010"), "error": TimeError, "says": "time of day", "options": UTC},
        id="no-time-of-day",
    ),
    pytest.param(
        {
            "content": kestrel(kestrel_day(13), head=KESTREL_HEAD.replace("Wind Speed", "Gust")),
            "error": InputError,
            "options": {"format": "kestrel", **UTC},
        },
        id="no-wind-column",
    ),
    pytest.param(
        {"content": kestrel(kestrel_day(13)), "error": UsageError, "options": {"date_order": "ydm"}},
        id="date-order-in-words",
    ),
]
REPORTED = [
    pytest.param(
        {"content": kestrel(kestrel_day(13), kestrel_day(14)), "finding": "date-order", "samples": 2, "options": UTC},
        id="header-lies-about-dates",
    ),
    pytest.param(
        {
            "content": kestrel(kestrel_day(13), kestrel_day(14, "99")),
            "finding": "out-of-range",
            "count": 1,
            "flag": SampleFlag.OUT_OF_RANGE,
            "flagged": 1,
            "options": UTC,
        },
        id="speed-beyond-the-impeller",
    ),
    pytest.param(
        {
            "content": kestrel(kestrel_day(13), kestrel_day(14, "--")),
            "finding": "missing-values",
            "count": 1,
            "flag": SampleFlag.MISSING,
            "flagged": 1,
            "options": UTC,
        },
        id="dashes",
    ),
    pytest.param(
        {
            "finding": "units-repaired",
            "count": 1,
            "options": UTC,
            "content": kestrel(kestrel_day(13), kestrel_day(14), head=KESTREL_HEAD.replace("°C", "‚ÑC")),
        },
        id="units-mojibake",
    ),
]


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_read_is_refused_with_place_and_fix(case: dict[str, Any], check_refused: Check) -> None:
    check_refused(**case)


@pytest.mark.parametrize("case", REPORTED)
def test_a_defect_is_reported_with_its_number_and_flagged(case: dict[str, Any], check_reported: Check) -> None:
    check_reported(**case)
