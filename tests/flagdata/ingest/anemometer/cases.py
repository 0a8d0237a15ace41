"""Rows of the tables of malformed logs."""

from __future__ import annotations

from typing import Any

import pytest


def case(name: str, **expected: Any) -> Any:
    """A row: its name, and the arguments of `check_refused` or `check_reported`."""
    return pytest.param(expected, id=name)
