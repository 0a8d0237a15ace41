"""A sealed set whose files are damaged is refused as what it is."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from flagdata.errors import InputError
from measure.challenge.folder import read_set


@pytest.mark.parametrize("content", [b"", b"\x93NUMPY", b"no array"])
def test_arrays_that_end_early_are_a_damaged_set(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "set.json").write_text(json.dumps({"flag": {"width": 1.5, "height": 1.0}}))
    (tmp_path / "markers.npy").write_bytes(content)
    with pytest.raises(InputError, match="not a set"):
        read_set(tmp_path)
