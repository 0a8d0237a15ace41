"""Rows of the tables of malformed logs."""

from __future__ import annotations

from functools import reduce
from operator import xor
from typing import Any

import pytest


def case(name: str, **expected: Any) -> Any:
    """A row: its name, and the arguments of `check_refused` or `check_reported`."""
    return pytest.param(expected, id=name)


def sentence(body: str) -> str:
    """A sentence of NMEA 0183 with its checksum."""
    return f"${body}*{reduce(xor, body.encode()):02X}"


def csv(*rows: str, header: str = "time,wind_speed") -> bytes:
    return "\n".join([header, *rows, ""]).encode()


def stamped(*values: str, start: int = 0, step: int = 1) -> bytes:
    """Rows a second apart with these speeds."""
    return csv(
        *(
            f"2026-05-01T12:{(start + step * i) // 60:02d}:{(start + step * i) % 60:02d}Z,{v}"
            for i, v in enumerate(values)
        )
    )


GOOD = [f"{3 + 0.1 * (i % 7):.1f}" for i in range(20)]
ROW = "2026-05-01T12:00:00Z,3.1"
