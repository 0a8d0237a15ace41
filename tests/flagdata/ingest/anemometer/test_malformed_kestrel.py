"""Malformed Kestrel exports: an error with place and fix, or samples flagged and findings with
numbers."""

from __future__ import annotations

from typing import Any

import pytest

from flagdata.core.schema import SampleFlag
from flagdata.errors import InputError, TimeError, UsageError
from tests.flagdata.ingest.anemometer.cases import case
from tests.flagdata.ingest.anemometer.conftest import check_refused, check_reported

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
    case("no-rows", content=kestrel(), error=InputError, where="line 6", says="no rows"),
    case(
        "no-zone", content=kestrel(kestrel_day(13), kestrel_day(14)), error=TimeError, says="--zone"
    ),
    case(
        "date-order-unknowable",
        content=kestrel(kestrel_day(5)),
        error=TimeError,
        says="dmy or mdy",
        options=UTC,
    ),
    case(
        "date-orders-mixed",
        content=kestrel(kestrel_day(13), "6/14/2026 10:00;300;2;20;1010"),
        error=TimeError,
        says="mixes",
        options=UTC,
    ),
    case(
        "date-order-given-wrong",
        content=kestrel(kestrel_day(13)),
        error=TimeError,
        says="it is dmy",
        options={"date_order": "mdy", **UTC},
    ),
    case(
        "beaufort",
        content=kestrel(kestrel_day(13), head=KESTREL_HEAD.replace("m/s", "Bft")),
        error=InputError,
        where="line 5",
        says="Beaufort",
        options=UTC,
    ),
    case(
        "no-time-of-day",
        content=kestrel("13/6/2026;300;2;20;1010"),
        error=TimeError,
        says="time of day",
        options=UTC,
    ),
    case(
        "no-wind-column",
        content=kestrel(kestrel_day(13), head=KESTREL_HEAD.replace("Wind Speed", "Gust")),
        error=InputError,
        options={"format": "kestrel", **UTC},
    ),
    case(
        "date-order-in-words",
        content=kestrel(kestrel_day(13)),
        error=UsageError,
        options={"date_order": "ydm"},
    ),
]
REPORTED = [
    case(
        "header-lies-about-dates",
        content=kestrel(kestrel_day(13), kestrel_day(14)),
        finding="date-order",
        samples=2,
        options=UTC,
    ),
    case(
        "speed-beyond-the-impeller",
        content=kestrel(kestrel_day(13), kestrel_day(14, "99")),
        finding="out-of-range",
        count=1,
        flag=SampleFlag.OUT_OF_RANGE,
        flagged=1,
        options=UTC,
    ),
    case(
        "dashes",
        content=kestrel(kestrel_day(13), kestrel_day(14, "--")),
        finding="missing-values",
        count=1,
        flag=SampleFlag.MISSING,
        flagged=1,
        options=UTC,
    ),
    case(
        "units-mojibake",
        finding="units-repaired",
        count=1,
        options=UTC,
        content=kestrel(kestrel_day(13), kestrel_day(14), head=KESTREL_HEAD.replace("°C", "‚ÑC")),
    ),
]


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_read_is_refused_with_place_and_fix(case: dict[str, Any]) -> None:
    check_refused(**case)


@pytest.mark.parametrize("case", REPORTED)
def test_a_defect_is_reported_with_its_number_and_flagged(case: dict[str, Any]) -> None:
    check_reported(**case)
