"""The address that `Measured` had in the last version; it is in `flagdata.answer.measured` now."""

from __future__ import annotations

from importlib import import_module
from typing import Any


def __getattr__(name: str) -> Any:
    return getattr(import_module("flagdata.answer.measured"), name)
