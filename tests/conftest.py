"""Fixtures for all tests."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def reference_data() -> Path:
    """The folder of real recordings and reference outputs; it is not part of the project."""
    folder = Path(os.environ.get("FLAGDATA_REFERENCE", REPOSITORY.parent / "shared" / "data"))
    if not folder.is_dir():
        pytest.skip(f"reference data absent: no folder {folder} (set FLAGDATA_REFERENCE)")
    return folder
