"""Malformed host-stamped lines: an error with place and fix, or samples flagged and findings with
numbers."""

from __future__ import annotations

from typing import Any

import pytest

from flagdata.core.schema import SampleFlag
from flagdata.errors import InputError, TimeError, UsageError
from tests.flagdata.ingest.anemometer.cases import case
from tests.flagdata.ingest.anemometer.conftest import check_refused, check_reported, read

UTC = {"zone": "UTC"}

HOST = "laptop_time,raw_line"


def hosted(*lines: str) -> bytes:
    return "\n".join([HOST, *lines, ""]).encode()


def host_line(i: int, raw: str = "3.14") -> str:
    return f"2026-05-01T12:00:{i:02d}.5,{raw}"


REFUSED = [
    case(
        "no-zone",
        content=hosted(*map(host_line, range(5))),
        error=TimeError,
        where="line 2",
        says="--zone",
    ),
    case("header-alone", content=hosted(), error=InputError),
    case(
        "header-alone-recipe-named",
        content=hosted(),
        error=InputError,
        where="line 2",
        options={"recipe": "serial-speed"},
    ),
    case(
        "menus-only", content=hosted(*(host_line(i, "READY") for i in range(30))), error=InputError
    ),
    case(
        "menus-only-recipe-named",
        content=hosted(*(host_line(i, "READY") for i in range(30))),
        error=InputError,
        where="line 2",
        options={"recipe": "serial-speed", **UTC},
    ),
    case(
        "recipe-of-another-format",
        content=hosted(host_line(0)),
        error=UsageError,
        options={"format": "host-stamped", "recipe": "generic-csv"},
    ),
]
REPORTED = [
    case(
        "boot-message",
        content=hosted(host_line(0, "boot v1.2"), *map(host_line, range(1, 9))),
        finding="non-data-lines",
        count=1,
        where="line 2",
        samples=8,
        options=UTC,
    ),
    case(
        "counter-instead-of-speed",
        content=hosted(*map(host_line, range(9)), host_line(9, "10000000306")),
        finding="out-of-range",
        count=1,
        where="line 11",
        flag=SampleFlag.OUT_OF_RANGE,
        flagged=1,
        options=UTC,
    ),
    case(
        "no-payload",
        content=hosted(*map(host_line, range(9)), "2026-05-01T12:00:09.5"),
        finding="non-data-lines",
        count=1,
        options=UTC,
    ),
]


def test_a_log_without_header_loses_no_line() -> None:
    content = "\n".join(map(host_line, range(5))).encode()
    assert len(read(content, recipe="serial-speed", zone="UTC").series) == 5


def test_two_numbers_are_no_decimal_comma() -> None:
    lines = hosted(*map(host_line, range(9)), host_line(9, '"3,2"'))
    check_reported(lines, finding="non-data-lines", count=1, samples=9, options=UTC)


@pytest.mark.timeout(20)
@pytest.mark.parametrize("filler", [" ", "1", "-", "1,", "1e", "\t"])
def test_long_lines_of_anything_take_linear_time(filler: str) -> None:
    # quadratic time in 60,000 characters would be minutes
    junk = [f"2026-05-01T12:00:1{i}.5,{filler * (60_000 // len(filler))}x" for i in range(3)]
    log = read(hosted(*map(host_line, range(9)), *junk), recipe="serial-speed", zone="UTC")
    assert len(log.series) == 9


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_read_is_refused_with_place_and_fix(case: dict[str, Any]) -> None:
    check_refused(**case)


@pytest.mark.parametrize("case", REPORTED)
def test_a_defect_is_reported_with_its_number_and_flagged(case: dict[str, Any]) -> None:
    check_reported(**case)
