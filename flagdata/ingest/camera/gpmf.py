"""GPS time in the telemetry of GoPro's cameras (GPMF): key-length-value records in a track of their
own.

A record is a key of four letters, a type, the size of an element [B], their number, and the
elements, big-endian and filled up to four bytes; type 0 holds further records
(https://github.com/gopro/gpmf-parser). Cameras up to the HERO10 state in each payload one `GPSU`,
"yymmddhhmmss.sss" in UTC, and in `GPSF` whether satellites were found; later ones state both in
each row of `GPS9`. The time of a payload without a fix is the camera's own, and is not used.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from fractions import Fraction
from itertools import islice

import av
import av.error
import numpy as np
from av.container import InputContainer
from av.stream import DataStream

from flagdata.timebase import NANOSECONDS, from_datetime

_HANDLER = "GoPro MET"  # as the cameras name their track
_ENOUGH = 60
"""Payloads with a time that are read: a minute of film, so that a long file is not read through."""
_HEAD = struct.Struct(">4scBH")
_NESTED = b"\0"
_FIXED = (2, 3)  # dimensions of a fix
_ROW = struct.Struct(
    ">7l2H"
)  # GPS9: latitude, longitude, altitude, speeds, days since 2000, ms of the day, DOP, fix
_ROW_TYPE = b"lllllllSS"


@dataclass(frozen=True, kw_only=True)
class GpsTimes:
    """Times of payloads whose GPS had a fix; all arrays are (n,).

    Attributes:
        instants: stated [UTC ns].
        after: from the first frame to the payload's begin, by the container's clock [s].
        length: a payload's, the median [s].
    """

    instants: tuple[int, ...]
    after: tuple[float, ...]
    length: float

    def start(self, scale: float) -> tuple[int, float]:
        """Computes when the first frame was taken [UTC ns], and its standard uncertainty [s].

        The median over payloads of the instant less the time since the first frame. At which moment
        of its payload a
        time was taken, nothing states: it is taken as the begin, and the uncertainty is the root
        mean square for any moment within, together with the scatter.

        Args:
            scale: seconds that pass in one second of the container's clock.
        """
        first = self.instants[0]
        starts = np.array(
            [instant - first for instant in self.instants]
        ) / NANOSECONDS - scale * np.array(self.after)
        middle = float(np.median(starts))
        scatter = 1.4826 * float(np.median(np.abs(starts - middle)))
        sigma = float(np.hypot(scale * self.length / 3**0.5, scatter))
        return first + round(middle * NANOSECONDS), sigma


def telemetry_of(container: InputContainer) -> DataStream | None:
    """Finds the track with GPMF, if there is one."""
    streams = (
        stream
        for stream in container.streams.data
        if stream.metadata.get("handler_name", "").strip() == _HANDLER
    )
    return next(streams, None)


def gps_times(
    container: InputContainer, stream: DataStream, *, origin: Fraction
) -> GpsTimes | None:
    """Reads the times of the first payloads with a fix; None if no payload has one that can be
    read.

    Args:
        container: at its begin; it is read on.
        origin: time of the first frame by the container's clock [s].
    """
    timed = list(islice(_time(container, stream), _ENOUGH))
    if not timed:
        return None
    instants, begins, lengths = zip(*timed, strict=True)
    return GpsTimes(
        instants=instants,
        after=tuple(float(begin - origin) for begin in begins),
        length=float(np.median([float(length) for length in lengths])),
    )


def _time(
    container: InputContainer, stream: DataStream
) -> Iterator[tuple[int, Fraction, Fraction]]:
    """Yields (instant, begin, length) of each payload with a fix; damage of the container ends
    them."""
    try:
        for packet in container.demux(stream):
            if packet.pts is None or packet.time_base is None or not packet.size:
                continue
            instant = _instant(bytes(packet))
            if instant is not None:
                yield (
                    instant,
                    packet.pts * packet.time_base,
                    (packet.duration or 0) * packet.time_base,
                )
    except (av.error.FFmpegError, IndexError):
        return


def _instant(payload: bytes) -> int | None:
    """Reads the first time that a payload states with a fix [UTC ns]."""
    for device in _within(_records(payload), b"DEVC"):
        for stream in _within(_records(device), b"STRM"):
            records = {key: content for key, kind, content in _records(stream) if kind != _NESTED}
            if b"GPS9" in records and records.get(b"TYPE", b"")[: len(_ROW_TYPE)] == _ROW_TYPE:
                instant = _row_instant(records[b"GPS9"])
            else:
                instant = _text_instant(records.get(b"GPSU", b""), records.get(b"GPSF", b""))
            if instant is not None:
                return instant
    return None


def _row_instant(rows: bytes) -> int | None:
    """Reads the instant of the first row of `GPS9`, where it has a fix."""
    if len(rows) < _ROW.size:
        return None
    *_, days, milliseconds, _, fix = _ROW.unpack_from(rows)
    if fix not in _FIXED or not (0 <= days < 36525 and 0 <= milliseconds < 86_400_000):
        return None
    return from_datetime(
        datetime(2000, 1, 1, tzinfo=UTC) + timedelta(days=days, milliseconds=milliseconds)
    )


def _text_instant(text: bytes, fix: bytes) -> int | None:
    """Reads the instant of `GPSU`, where `GPSF` states a fix."""
    if len(fix) < 4 or int.from_bytes(fix[:4], "big") not in _FIXED:
        return None
    try:
        return from_datetime(
            datetime.strptime(text.decode("ascii"), "%y%m%d%H%M%S.%f").replace(tzinfo=UTC)
        )
    except ValueError:
        return None


def _within(records: Iterable[tuple[bytes, bytes, bytes]], key: bytes) -> Iterator[bytes]:
    return (content for name, kind, content in records if name == key and kind == _NESTED)


def _records(data: bytes) -> Iterator[tuple[bytes, bytes, bytes]]:
    """Yields (key, type, content) of successive records; one that is longer than its payload ends
    them."""
    position = 0
    while position + _HEAD.size <= len(data):
        key, kind, size, count = _HEAD.unpack_from(data, position)
        position += _HEAD.size
        end = position + size * count
        if end > len(data):
            return
        yield key, kind, data[position:end]
        position = end + -end % 4
