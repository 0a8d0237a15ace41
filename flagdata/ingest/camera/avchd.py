"""The recording time that AVCHD camcorders (MTS files) write into the video stream itself.

An H.264 message of unregistered user data (ITU-T H.264, D.1.6) with the identifier below holds "MDPM", a count, and
entries of a tag and four bytes, after the packs of DV (IEC 61834-4): 0x18 is a zone byte, century, year, month; 0x19 is
day, hour, minute, second, all as binary-coded decimals. The zone byte is left aside: many cameras leave it at zero
whatever zone they are set to. So the time is wall-clock time without a zone.
"""

from __future__ import annotations

from datetime import datetime

_IDENTIFIER = bytes.fromhex("17ee8c60f84d11d98cd60800200c9a66") + b"MDPM"


def recording_time(message: bytes) -> str | None:
    """ISO 8601 wall-clock time, to the second and without a zone, of one user-data message; `None` if it has none."""
    if not message.startswith(_IDENTIFIER):
        return None
    body = message[len(_IDENTIFIER) :]
    entries = {body[i]: body[i + 1 : i + 5] for i in range(1, len(body) - 4, 5)}
    if not {0x18, 0x19} <= entries.keys():
        return None
    digits = (entries[0x18][1:] + entries[0x19]).hex()
    try:
        # A wall-clock time; the caller attaches the camera's zone.
        return datetime.strptime(digits, "%Y%m%d%H%M%S").isoformat()  # noqa: DTZ007
    except ValueError:
        return None
