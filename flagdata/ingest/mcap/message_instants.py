"""When the messages of a topic were measured, and in what order they are to be read.

A message's instant is the one that it states. A stamp of zero means that its writer did not set it;
such a message, and one that states none, is dated by when it was logged. Messages are put in the
order of their instants, since files and logs may have another. Where neither the file nor the log
has them in order to within `SLIP`, the clock that stamped
them was set, or single stamps are wrong: then the order of the file stands, for the reader to
judge.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flagdata.core.arrays import BoolArray, IntArray
from flagdata.core.findings import Finding, Severity
from flagdata.errors import CorruptError, TimeError
from flagdata.timebase import NANOSECONDS, parse

SLIP = NANOSECONDS
"""Messages may come this much late without a clock having been set [ns], as in `camera.clock`."""
APART = 1.0
"""Stamps that lie farther than this from when they were logged [s] are reported."""
_UNITS = (NANOSECONDS, 1_000_000, 1000, 1)  # of numbers that count from 1970: s, ms, us, ns
_FROM, _TO = 315_532_800 * NANOSECONDS, 4_102_444_800 * NANOSECONDS
"""1980 and 2100: a number means the unit by which it lies between them. No number does by two."""
_NAMES = ("timestamp", "stamp")


@dataclass(frozen=True, kw_only=True)
class Stamp:
    """What a message says of its instant.

    Attributes:
        instant: [UTC ns]; `None` where it states none, or none that is a time.
        field: whether it has a field for it.
    """

    instant: int | None
    field: bool


def stamp_of(values: Mapping[str, Any]) -> Stamp:
    """Reads what a message of these fields says of its instant: in `timestamp` or `stamp`, of its
    own or of its header.

    Raises:
        CorruptError: an instant beyond those that 64 bits hold.
    """
    header = values.get("header")
    has_field = False
    for holder in (values, header if isinstance(header, Mapping) else {}):
        for name in _NAMES:
            if name in holder:
                has_field = True
                instant = _instant(holder[name])
                if instant:
                    return Stamp(instant=check_instant(instant), field=True)
    return Stamp(instant=None, field=has_field)


def check_instant(instant: int) -> int:
    """Returns an instant, unless 64 bits do not hold it.

    Raises:
        CorruptError: they do not.
    """
    if not -(1 << 63) <= instant < 1 << 63:
        raise CorruptError(
            f"a message states an instant of {instant} ns", fix="mend the recorder's clock"
        )
    return instant


def _instant(stamp: object) -> int | None:
    """Reads UTC nanoseconds of a time as protobuf, ROS, Foxglove's JSON, a number since 1970 or ISO
    8601 state it."""
    if isinstance(stamp, Mapping):
        seconds = stamp.get("seconds", stamp.get("sec", stamp.get("secs")))
        part = stamp.get("nanos", stamp.get("nanosec", stamp.get("nsec", stamp.get("nsecs", 0))))
        if isinstance(seconds, int) and isinstance(part, int):
            return seconds * NANOSECONDS + part
        return None
    if isinstance(stamp, str):
        try:
            return _of_number(int(stamp)) if stamp.strip().isdigit() else parse(stamp)
        except (TimeError, ValueError):
            return None
    if isinstance(stamp, int | float) and not isinstance(stamp, bool):
        return _of_number(stamp)
    return None


def _of_number(number: float) -> int | None:
    for unit in _UNITS:
        if _FROM <= number * unit < _TO:
            return round(number * unit)
    return None


@dataclass(frozen=True, kw_only=True)
class Order:
    """The order in which messages are to be read, and what to report of their clocks.

    Attributes:
        rows: (n,) which message comes at each place, by its number in the file.
        in_time: whether they are in the order of their instants then.
    """

    rows: NDArray[np.intp]
    in_time: bool
    findings: tuple[Finding, ...]


def few_without_date(stamps: IntArray, logged: IntArray) -> BoolArray:
    """Finds (n,) messages that have a stamp before 1980 or after 2100, as of a clock that was not
    set yet, where most have a date and the log has one for these."""
    odd = (stamps < _FROM) | (stamps >= _TO)
    return odd & (logged >= _FROM) & (logged < _TO) & (2 * int(odd.sum()) < len(stamps))


def order_of(stamps: IntArray, logged: IntArray, *, sort: bool, where: str) -> Order:
    """Orders messages by their instants.

    Args:
        stamps, logged: (n,) instants and times of logging [UTC ns], in the order of the file.
        sort: whether they may be put in the order of their instants; else that of the file or the
            log stands.
        where: the topic, for findings.
    """
    rows = np.arange(len(stamps))
    by_log = np.argsort(logged, kind="stable")
    if not _late(stamps):
        in_time, findings = True, ()
    elif not _late(stamps[by_log]):
        in_time, findings, rows = True, (_disordered_finding(stamps, logged, where),), by_log
    else:
        in_time, findings = False, ()
    if in_time and sort:
        rows = rows[np.argsort(stamps[rows], kind="stable")]
    return Order(rows=rows, in_time=in_time, findings=findings)


def _late(stamps: IntArray) -> bool:
    """Checks whether some come after others by more than a slip."""
    return bool(np.any(np.maximum.accumulate(stamps) - stamps > SLIP)) if len(stamps) else False


def _disordered_finding(stamps: IntArray, logged: IntArray, where: str) -> Finding:
    back = float((np.maximum.accumulate(stamps) - stamps).max()) / NANOSECONDS
    steps = int((np.diff(logged) < -SLIP).sum())
    return Finding.of(
        "log-disordered",
        f"the file goes back by up to {back:.3f} s from message to message, by the log as by the "
        "stamps: its "
        "parts are in another order, or the computer's clock was set back; the messages were "
        "ordered by their instants",
        where=where,
        count=steps,
        value=back,
        fix="if the clock was set back, ingest what was recorded before and after it as files of "
        "their own",
    )


def clock_findings(
    stamps: IntArray, logged: IntArray, *, unset: int, unstated: int, where: str
) -> Iterator[Finding]:
    """Reports what is odd of the clocks of messages.

    Args:
        unset: messages whose field for an instant is zero, or holds no date.
        unstated: those that have no such field.
        where: the topic.
    """
    count = len(stamps)
    if unset or 0 < unstated < count:
        message = (
            f"{unset + unstated} of {count} messages state no instant (a stamp of 0, or none that "
            "is a date): "
        )
        yield Finding(
            kind="dated-by-log",
            severity=Severity.WARNING,
            where=where,
            count=unset + unstated,
            what=f"{message}they are dated by when they were logged, which is later by an unknown "
            "delay",
            fix="set the stamp where the messages are made; or align the recording by its contents",
        )
    elif unstated:
        message = "its messages have no stamp: they are dated by when they were logged"
        yield Finding(
            kind="dated-by-log", severity=Severity.NOTE, where=where, count=count, what=message
        )
    if not count:
        return
    most = float(np.abs(stamps.astype(float) - logged).max()) / NANOSECONDS
    if most > APART:
        yield Finding.of(
            "clocks-apart",
            f"the stamps of its messages lie up to {most:.3f} s from when they were logged: a "
            "delay, or another clock",
            where=where,
            value=most,
            fix="compare it with another topic; align it after it is ingested",
        )
