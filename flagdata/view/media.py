"""What a page shows of films, winds and alignments, made when it is asked for.

Thumbnails are kept in memory only: nothing of a film that is erased from the lake stays behind.
"""

from __future__ import annotations

import math
import threading
from collections import OrderedDict
from collections.abc import Mapping
from typing import Any

import numpy as np

from flagdata.align.film_recording import CURVE
from flagdata.core.arrays import FloatArray
from flagdata.core.schema import Kind
from flagdata.errors import CorruptError, NotFoundError, UsageError
from flagdata.lake import Lake
from flagdata.lake.removal import explain_missing
from flagdata.recipes.documents import from_stored_json
from flagdata.record import Record
from flagdata.timebase import NANOSECONDS
from flagdata.view.moving_pictures import DRAWN, FilmStrip, film_of, thumbnail

FRAMES_AT_ONCE = 64
POINTS = 2000
"""Points of a line at most; more are drawn as their lowest and highest by stretches."""
_SIDE = 320  # px of a thumbnail
_KEPT = 64 << 20  # B of thumbnails
_OPENED, _DRAWN = 8, 2  # records and sequences that are kept open
_AT_ONCE = 2


class Media:
    """Pictures and series of the artifacts of a lake."""

    def __init__(self, lake: Lake) -> None:
        self._lake = lake
        self._lock = threading.Lock()
        self._busy = threading.BoundedSemaphore(_AT_ONCE)
        self._thumbnails: OrderedDict[str, bytes] = OrderedDict()
        self._records: OrderedDict[str, Record] = OrderedDict()
        self._drawn: dict[str, FilmStrip | None] = {}

    def film(self, row: Mapping[str, Any]) -> FilmStrip:
        """Finds what moves in an artifact.

        Raises:
            NotFoundError: nothing does, or its data are lost.
            CorruptError: it is damaged.
        """
        film = self._film(row)
        if film is None:
            raise NotFoundError(
                "nothing moves in this artifact", where=row["artifact"], fix="look at its page"
            )
        return film

    def thumbnail(self, row: Mapping[str, Any]) -> bytes:
        """Draws a small JPEG of an artifact.

        Raises:
            NotFoundError: it has no picture, or its data are lost.
        """
        self._check_there(row)
        key = row["artifact"]
        with self._lock:
            if key in self._thumbnails:
                self._thumbnails.move_to_end(key)
                return self._thumbnails[key]
        with self._busy:
            thumbnail_bytes = thumbnail(self.film(row), side=_SIDE)
        with self._lock:
            self._thumbnails[key] = thumbnail_bytes
            while sum(map(len, self._thumbnails.values())) > _KEPT:
                self._thumbnails.popitem(last=False)
        return thumbnail_bytes

    def frames(self, row: Mapping[str, Any], first: int) -> bytes:
        """Encodes at most `FRAMES_AT_ONCE` JPEGs from a frame on, each behind its length in four
        bytes.

        Raises:
            UsageError: no such frame.
        """
        with self._busy:
            film = self.film(row)
            if not 0 <= first < len(film):
                raise UsageError(
                    f"there is no frame {first} among {len(film)}",
                    where=row["artifact"],
                    fix="ask for one that it has",
                )
            pictures = film.jpegs(first, min(FRAMES_AT_ONCE, len(film) - first))
        return b"".join(len(picture).to_bytes(4, "big") + picture for picture in pictures)

    def series(self, row: Mapping[str, Any]) -> dict[str, Any]:
        """Returns the frames' times and the wind beside them as JSON values: seconds from the first
        frame, or from the first mean of a wind; m/s; radians, blowing from, clockwise from
        north."""
        film = self._film(row)
        record = (
            film.record
            if film is not None
            else self._record(row["object"])
            if row["kind"] == Kind.WIND
            else None
        )
        mean = record.wind_1hz() if record is not None else None
        charts: dict[str, Any] = {"frames": None, "wind": None, "clip": None}
        origin = 0
        if film is not None:
            origin = int(film.times[0])
            step = math.ceil(len(film) / POINTS)
            frame_indices = np.unique([*range(0, len(film), step), len(film) - 1])
            seconds = (film.times[frame_indices] - origin) / NANOSECONDS
            charts["frames"] = {
                "count": len(film),
                "index": frame_indices.tolist(),
                "time": np.round(seconds, 6).tolist(),
            }
        if mean is not None:
            low, high = (
                (-(2**63), 2**63 - 1) if film is None or film.wind_span is None else film.wind_span
            )
            inside = (mean.time >= low) & (mean.time <= high)
            if not inside.any():
                return charts
            origin = origin or int(mean.time[inside][0])
            middle = (mean.time[inside] - origin) / NANOSECONDS - mean.period / 2
            charts["wind"] = _line(
                middle, mean.speed[inside], mean.sigma[inside], mean.direction[inside]
            )
        return charts

    def evidence(self, row: Mapping[str, Any]) -> dict[str, Any]:
        """Returns the search that led to a recording's clock model: offsets [s], score, evidence,
        and what accidents reach.

        Raises:
            NotFoundError: nothing was searched.
            CorruptError: it cannot be read.
        """
        self._check_there(row)
        record = self._record(row["object"])
        if CURVE not in record.attachments:
            raise NotFoundError(
                "no search led to its clock model", where=row["artifact"], fix="look at its report"
            )
        try:
            curve = from_stored_json(record.attachment(CURVE).decode())
            shown_curve = {
                name: curve[name] for name in ("offset", "score", "evidence", "chance_score")
            }
        except (ValueError, KeyError, TypeError):
            raise CorruptError(
                "its search cannot be read", where=row["artifact"], fix="run flagdata verify"
            ) from None
        return shown_curve

    def is_lost(self, row: Mapping[str, Any]) -> bool:
        """Checks whether the artifact's object is not in the lake."""
        return row["object"] is not None and not self._lake.objects.has(row["object"])

    def _check_there(self, row: Mapping[str, Any]) -> None:
        """Checks that the object is there, also of what is kept here: an erased film is shown no
        more.

        Raises:
            NotFoundError: it has no data, or they are lost; why.
        """
        name = row["object"]
        if name is None:
            raise NotFoundError(
                "it has no data of its own", where=row["artifact"], fix="look at its page"
            )
        if self.is_lost(row):
            raise explain_missing(self._lake, name, self._lake.objects.missing(name))

    def _film(self, row: Mapping[str, Any]) -> FilmStrip | None:
        self._check_there(row)
        if row["kind"] not in DRAWN:
            return film_of(self._lake, row, self._record)
        key = row["artifact"]
        with self._lock:
            if key in self._drawn:
                return self._drawn[key]
        film = film_of(self._lake, row, self._record)
        with self._lock:
            self._drawn = {key: film, **dict(list(self._drawn.items())[: _DRAWN - 1])}
        return film

    def _record(self, name: str) -> Record:
        with self._lock:
            if name in self._records:
                self._records.move_to_end(name)
                return self._records[name]
        record = Record.open(self._lake.record_place(name))
        with self._lock:
            self._records[name] = record
            while len(self._records) > _OPENED:
                self._records.popitem(last=False)
        return record


def _line(
    time: FloatArray, speed: FloatArray, sigma: FloatArray, direction: FloatArray
) -> dict[str, Any]:
    """Reduces a line to at most `POINTS` points, and a band: ± σ, or the lowest and highest of the
    stretch of each point."""
    stretch = math.ceil(len(time) / POINTS)
    starts = np.arange(0, len(time), stretch)
    if stretch == 1:
        half = np.where(np.isfinite(sigma), sigma, 0.0)
        mean, low, high = speed, speed - half, speed + half
    else:
        finite = np.isfinite(speed)
        count = np.maximum(np.add.reduceat(finite, starts), 1)
        mean = np.add.reduceat(np.where(finite, speed, 0.0), starts) / count
        low = np.fmin.reduceat(speed, starts)
        high = np.fmax.reduceat(speed, starts)
        mean = np.where(np.isfinite(low), mean, np.nan)
    return {
        "band": "±σ" if stretch == 1 else "lowest to highest",
        "time": np.round(time[starts], 3).tolist(),
        **{
            name: [round(value, 4) if math.isfinite(value) else None for value in values.tolist()]
            for name, values in (
                ("speed", mean),
                ("low", low),
                ("high", high),
                ("direction", direction[starts]),
            )
        },
    }
