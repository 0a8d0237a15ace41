"""A sealed set whose files are damaged is refused as what it is."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import pytest

from flagdata.errors import InputError
from tests.studies.challenge.folder import read_set

_CUT = b"{'descr': '<f8',\0 'shape': (\n"
"""A header with a zero, at which Python's tokenizer raises an error of its own."""
HEADER = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(_CUT)) + _CUT


@pytest.mark.parametrize("content", [b"", b"\x93NUMPY", b"no array", HEADER])
def test_arrays_that_end_early_are_a_damaged_set(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "set.json").write_text(json.dumps({"flag": {"width": 1.5, "height": 1.0}}))
    (tmp_path / "markers.npy").write_bytes(content)
    with pytest.raises(InputError, match="not a set"):
        read_set(tmp_path)
