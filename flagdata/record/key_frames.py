"""Where decoding of H.264 can start."""

from __future__ import annotations

import re

_KEY_UNIT = re.compile(rb"\x00\x00\x01[\x25\x27\x45\x47\x65\x67]")
"""NAL units of types 5 (IDR slice) and 7 (SPS), of any ref_idc."""


def is_key(picture: bytes | memoryview) -> bool:
    """Checks whether decoding can start at this picture."""
    return _KEY_UNIT.search(picture) is not None
