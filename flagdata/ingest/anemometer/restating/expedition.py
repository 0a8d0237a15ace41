"""Logs of the sailing program Expedition, whose rows hold pairs of a channel's number and its value.

    !Boat,Utc,BSP,AWA,AWS,TWA,TWS,TWD,HDG
    !boat,0,1,2,3,4,5,6,13
    !v12.5.1
    0,45859.15310,1,6.81,2,31.35,3,13.67

The first line names the channels, the second numbers them in the same order; a row holds those that are new. Channel 0
is UTC: days since 1899-12-30, or steps of 100 ns since 1601. Angles are degrees. The log does not say in which unit its
speeds are: that is asked for.
"""

from __future__ import annotations

import datetime as dt
import re
from collections.abc import Iterator, Sequence

from flagdata.ingest.anemometer.restating.restate import table
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_ROW = re.compile(r"\s*0,\d+(?:\.\d+)?(?:,\d{1,4},[^,]*)*\s*")
_WANTED = ("AWA", "AWS", "TWA", "TWS", "TWD", "Lat", "Lon", "SOG")
_PLACE = ("Lat", "Lon", "SOG")
"""Channels that hold until they are written again."""
_ANGLES = ("AWA", "TWA", "TWD")
_SPEEDS = ("AWS", "TWS")
_DAYS = dt.datetime(1899, 12, 30, tzinfo=dt.UTC)
_STEPS = dt.datetime(1601, 1, 1, tzinfo=dt.UTC)
_LATEST = 100_000.0
"""Days since 1899-12-30 after which a number counts steps: the year 2173."""


def matches(lines: Sequence[str]) -> bool:
    """A line of names and one of numbers at the beginning."""
    return _channels(lines) is not None


def as_table(source: TextFile) -> TableText | None:
    """The rows that hold a speed of wind, with time, wind, position and speed over ground."""
    numbers = _channels(source.head()) or {}
    names = [name for name in _WANTED if name in numbers]
    other = 0
    where: dict[str, str] = {}

    def rows() -> Iterator[list[str]]:
        nonlocal other
        for _, lines in source.blocks():
            for line in lines:
                if line.startswith("!") or not line.strip():
                    continue
                cells = line.strip().split(",")
                values = dict(zip(cells[0::2], cells[1::2], strict=False))
                stamp = _stamp(values["0"]) if _ROW.fullmatch(line) else None
                if stamp is None:
                    other += 1
                    continue
                where.update({name: values[numbers[name]] for name in _PLACE if values.get(numbers.get(name, ""))})
                if any(values.get(numbers[name], "") for name in _SPEEDS if name in numbers):
                    told = {name: values.get(numbers[name], "").strip() for name in names} | where
                    yield [stamp, *(told[name] for name in names)]

    kept = list(rows())
    heads = [f"{name} [deg]" if name in _ANGLES else name for name in names]
    return table(
        source, ["Utc", *heads], kept, kind="expedition-log", what="a log of Expedition, one row for those with wind",
        left_out=other,
    )  # fmt: skip


def _channels(lines: Sequence[str]) -> dict[str, str] | None:
    """Name → number of the channels; `None` where the first lines do not say."""
    at = next((i for i, line in enumerate(lines[:10]) if line.lstrip("\ufeff").lower().startswith("!boat,utc")), None)
    if at is None or at + 1 >= len(lines):
        return None
    names = [name.strip() for name in lines[at].strip().split(",")[1:]]
    numbers = [number.strip() for number in lines[at + 1].strip().split(",")]
    if numbers[:1] != ["!boat"] or numbers[1:2] != ["0"] or not all(number.isdigit() for number in numbers[1:]):
        return None
    return dict(zip(names, numbers[1:], strict=False))


def _stamp(text: str) -> str | None:
    """ISO 8601 of a value of channel 0."""
    try:
        if float(text) < _LATEST:
            instant = _DAYS + dt.timedelta(days=float(text))
        else:
            instant = _STEPS + dt.timedelta(microseconds=int(text) // 10)
    except (ValueError, OverflowError):
        return None
    return f"{instant:%Y-%m-%dT%H:%M:%S.%f}Z"
