"""Malformed TOA5 tables: an error with place and fix, or samples flagged and findings with
numbers."""

from __future__ import annotations

from typing import Any

import pytest

from flagdata.core.schema import SampleFlag
from flagdata.errors import InputError, TimeError, UsageError
from tests.flagdata.ingest.anemometer.cases import case
from tests.flagdata.ingest.anemometer.conftest import check_refused, check_reported


def csv(*rows: str, header: str = "time,wind_speed") -> bytes:
    return "\n".join([header, *rows, ""]).encode()


ROW = "2026-05-01T12:00:00Z,3.1"

TOA5_HEAD = (
    '"TOA5","st","CR3000","1","CR3000.Std.22","CPU:x.CR3","1","ts"\r\n'
    '"TIMESTAMP","RECORD","Ux","Uy","Uz","Ts","diag_csat"\r\n'
    '"TS","RN","m/s","m/s","m/s","C",""\r\n'
    '"","","Smp","Smp","Smp","Smp","Smp"\r\n'
)


def toa5(*rows: str, head: str = TOA5_HEAD) -> bytes:
    return (head + "".join(f"{row}\r\n" for row in rows)).encode()


def toa5_row(i: int, *, record: int | None = None, u: str = "1.5", diag: str = "0") -> str:
    stamp = f"2026-05-01 12:00:{i // 20:02d}" + (
        f".{(i % 20) * 5:02d}".rstrip("0") if i % 20 else ""
    )
    return f'"{stamp}",{100 + i if record is None else record},{u},{0.01 * i:.2f},0.1,20.5,{diag}'


UTC = {"zone": "UTC"}

REFUSED = [
    case(
        "header-cut-off",
        content=TOA5_HEAD.encode()[:120],
        error=InputError,
        says="four header lines",
    ),
    case("header-alone", content=toa5(), error=InputError, where="line 5", options=UTC),
    case(
        "no-zone",
        content=toa5(*map(toa5_row, range(5))),
        error=TimeError,
        where="line 5",
        says="--zone",
    ),
    case(
        "no-wind-column",
        content=toa5(head=TOA5_HEAD.replace("Ux", "co2").replace("Uy", "h2o").replace("Uz", "x")),
        error=InputError,
        where="line 2",
        says="co2",
    ),
    case(
        "wind-in-volts",
        content=toa5(toa5_row(0), head=TOA5_HEAD.replace('"m/s","m/s","m/s"', '"V","V","V"')),
        error=InputError,
        where="line 3",
        says="'V'",
        options=UTC,
    ),
    case(
        "no-timestamp-column",
        content=toa5(toa5_row(0), head=TOA5_HEAD.replace("TIMESTAMP", "WHEN")),
        error=InputError,
        where="line 2",
        options=UTC,
    ),
    case(
        "units-line-short",
        content=toa5(toa5_row(0), head=TOA5_HEAD.replace('"C",""', '"C"')),
        error=InputError,
        where="line 2",
        options=UTC,
    ),
    case(
        "named-but-other",
        content=csv(ROW, ROW, ROW, ROW),
        error=InputError,
        where="line 1",
        options={"format": "toa5"},
    ),
    case(
        "azimuth-in-degrees",
        content=toa5(toa5_row(0)),
        error=UsageError,
        says="radians",
        options={"azimuth": 270.0},
    ),
]
REPORTED = [
    case(
        "nan",
        content=toa5(*map(toa5_row, range(5)), toa5_row(5, u='"NAN"')),
        finding="missing-values",
        count=1,
        flag=SampleFlag.MISSING,
        flagged=1,
        options=UTC,
    ),
    case(
        "minus-7999",
        content=toa5(*map(toa5_row, range(5)), toa5_row(5, u="-7999")),
        finding="missing-values",
        count=1,
        where="line 10",
        options=UTC,
    ),
    case(
        "infinite",
        content=toa5(*map(toa5_row, range(5)), toa5_row(5, u='"INF"')),
        finding="out-of-range",
        count=1,
        options=UTC,
    ),
    case(
        "records-lost",
        content=toa5(toa5_row(0), toa5_row(1), toa5_row(5), toa5_row(6)),
        finding="records-lost",
        count=3,
        where="line 7",
        options=UTC,
    ),
    case(
        "records-restarted",
        content=toa5(toa5_row(0), toa5_row(1), toa5_row(2, record=0), toa5_row(3, record=1)),
        finding="records-restarted",
        count=1,
        where="line 7",
        options=UTC,
    ),
    case(
        "diagnostic",
        content=toa5(*map(toa5_row, range(5)), toa5_row(5, diag="4096")),
        finding="sensor-fault",
        count=1,
        where="line 10",
        flag=SampleFlag.SENSOR_FAULT,
        flagged=1,
        options=UTC,
    ),
    case(
        "cut-off-row",
        content=toa5(*map(toa5_row, range(5))) + b'"2026-05-01 12:0',
        finding="cut-off",
        samples=5,
        options=UTC,
    ),
    case(
        "row-short",
        content=toa5(toa5_row(0), '"2026-05-01 12:00:00.05",101,1.5', toa5_row(2)),
        finding="malformed-lines",
        count=1,
        where="line 6",
        options=UTC,
    ),
    case(
        "duplicate",
        content=toa5(*map(toa5_row, (0, 1, 2, 2, 3, 4, 5, 6, 7, 8, 9, 10))),
        finding="duplicate-rows",
        count=1,
        samples=11,
        options=UTC,
    ),
]


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_read_is_refused_with_place_and_fix(case: dict[str, Any]) -> None:
    check_refused(**case)


@pytest.mark.parametrize("case", REPORTED)
def test_a_defect_is_reported_with_its_number_and_flagged(case: dict[str, Any]) -> None:
    check_reported(**case)
