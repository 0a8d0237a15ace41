"""Cells of the catalog as people read them, and as JSON and CSV hold them."""

from __future__ import annotations

import json
from datetime import date, datetime, time
from decimal import Decimal
from typing import Any

from flagdata.core.schema import CATALOG
from flagdata.errors import UsageError
from flagdata.timebase import iso


def said(column: str, value: object) -> str:
    """Writes a value for people: instants as times, numbers with their unit, mappings and lists as
    JSON."""
    unit = CATALOG[column].unit
    if unit == "ns" and isinstance(value, int):
        return iso(value)
    if isinstance(value, dict | list):
        return json.dumps(value, ensure_ascii=False)
    return f"{value} {unit}" if unit not in ("", "1") else str(value)


def plain(value: Any) -> Any:
    """Converts a cell to what JSON and CSV can hold; times as ISO 8601.

    Raises:
        UsageError: a type with no such form (bytes, intervals).
    """
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, datetime):
        return value.isoformat().replace("+00:00", "Z")
    if isinstance(value, date | time):
        return value.isoformat()
    if isinstance(value, Decimal):
        return int(value) if value == value.to_integral_value() else float(value)
    if isinstance(value, list):
        return [plain(item) for item in value]
    if isinstance(value, dict):
        return {str(key): plain(item) for key, item in value.items()}
    raise UsageError(
        f"a value of type {type(value).__name__} has no form in text",
        fix="cast it in the SQL, or write it by --arrow",
    )
