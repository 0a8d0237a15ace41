"""Malformed host-stamped lines: an error with place and fix, or samples flagged and findings with numbers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from flagdata.errors import InputError, TimeError, UsageError
from flagdata.schema import SampleFlag

Check = Callable[..., None]

UTC = {"zone": "UTC"}

HOST = "laptop_time,raw_line"


def hosted(*lines: str) -> bytes:
    return "\n".join([HOST, *lines, ""]).encode()


def host_line(i: int, raw: str = "3.14") -> str:
    return f"2026-05-01T12:00:{i:02d}.5,{raw}"


REFUSED = [
    pytest.param(
        {"content": hosted(*map(host_line, range(5))), "error": TimeError, "where": "line 2", "says": "--zone"},
        id="no-zone",
    ),
    pytest.param({"content": hosted(), "error": InputError}, id="header-alone"),
    pytest.param(
        {"content": hosted(), "error": InputError, "where": "line 2", "options": {"recipe": "serial-speed"}},
        id="header-alone-recipe-named",
    ),
    pytest.param(
        {"content": hosted(*(host_line(i, "READY") for i in range(30))), "error": InputError, "says": "known format"},
        id="menus-only",
    ),
    pytest.param(
        {
            "content": hosted(*(host_line(i, "READY") for i in range(30))),
            "error": InputError,
            "where": "line 2",
            "options": {"recipe": "serial-speed", **UTC},
        },
        id="menus-only-recipe-named",
    ),
    pytest.param(
        {
            "content": hosted(host_line(0)),
            "error": UsageError,
            "options": {"format": "host-stamped", "recipe": "generic-csv"},
        },
        id="recipe-of-another-format",
    ),
]
REPORTED = [
    pytest.param(
        {
            "content": hosted(host_line(0, "boot v1.2"), *map(host_line, range(1, 9))),
            "finding": "non-data-lines",
            "count": 1,
            "where": "line 2",
            "samples": 8,
            "options": UTC,
        },
        id="boot-message",
    ),
    pytest.param(
        {
            "content": hosted(*map(host_line, range(9)), host_line(9, "10000000306")),
            "finding": "out-of-range",
            "count": 1,
            "where": "line 11",
            "flag": SampleFlag.OUT_OF_RANGE,
            "flagged": 1,
            "options": UTC,
        },
        id="counter-instead-of-speed",
    ),
    pytest.param(
        {
            "content": hosted(*map(host_line, range(9)), "2026-05-01T12:00:09.5"),
            "finding": "non-data-lines",
            "count": 1,
            "options": UTC,
        },
        id="no-payload",
    ),
]


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_read_is_refused_with_place_and_fix(case: dict[str, Any], check_refused: Check) -> None:
    check_refused(**case)


@pytest.mark.parametrize("case", REPORTED)
def test_a_defect_is_reported_with_its_number_and_flagged(case: dict[str, Any], check_reported: Check) -> None:
    check_reported(**case)
