"""Members of JSON objects that are instants of readings."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from flagdata.ingest.anemometer.text.kinds import cell_kind
from flagdata.ingest.anemometer.words.headings import names_time

EPOCH = 1e8
"""Seconds from 1970 to 1973, from which on numbers are instants."""


def is_instant(key: str, value: object) -> bool:
    """Whether a member is the instant of a reading: a stamp, or Unix seconds or milliseconds."""
    if not names_time(key) or isinstance(value, bool):
        return False
    return cell_kind(value) == "stamp" if isinstance(value, str) else isinstance(value, int | float) and value > EPOCH


def holds_instant(item: Mapping[str, Any]) -> bool:
    """Whether a member of an object is the instant of a reading."""
    return any(is_instant(key, value) for key, value in item.items())
