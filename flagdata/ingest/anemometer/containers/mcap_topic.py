"""One topic of numbers in an MCAP file as a table of text: a row a message, a column a number, its
path as the heading.

A message's time is the one that it states, else the one at which it was logged; messages come in
that order. Messages of flagdata's own type, and those of ROS whose type has one unit, get headings
that name quantity and unit; other units are the user's to give.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from flagdata.core.findings import Finding
from flagdata.core.schema import CHANNELS
from flagdata.ingest.anemometer.text.text_file import TableText
from flagdata.ingest.anemometer.wind_options import Limits
from flagdata.ingest.mcap.topics import Decoded, Topic, choose, index, messages, topics
from flagdata.record.messages import WIND_FIELDS
from flagdata.timebase import iso

_WIDEST = 200
"""Columns of the widest message that is read."""
_LONGEST = 16
"""Numbers of the longest list that is read, each as a column."""
_TIMES = frozenset({"timestamp", "stamp", "header", "host_time"})
_HEADINGS: dict[str, dict[str, str]] = {
    "flagdata.WindSample": {
        name: f"{channel} ({CHANNELS[channel].unit})" for channel, (name, _) in WIND_FIELDS.items()
    },
    "sensor_msgs/Temperature": {"temperature": "air_temperature (degC)"},
    "sensor_msgs/FluidPressure": {"fluid_pressure": "air_pressure (Pa)"},
    "sensor_msgs/RelativeHumidity": {"relative_humidity": "relative_humidity (1)"},
}
"""Type of messages, as ROS 1 names it → field → heading."""


def of_numbers(path: Path, present: Sequence[Topic]) -> tuple[Topic, ...]:
    """Selects the topics, not of pictures, whose first message can be read and holds a number
    beside its time."""
    of_numbers: list[Topic] = []
    for topic in present:
        if topic.pictures:
            continue
        try:
            first = next(messages(path, topic.name), None)
        except Exception:  # noqa: BLE001 - no number; it is named where it is chosen
            continue
        if first is not None and any(True for _ in _numbers(first.values)):
            of_numbers.append(topic)
    return tuple(of_numbers)


def open_topic(path: Path, name: str | None, *, limits: Limits) -> TableText:
    """Reads the numbers of a topic over time.

    Args:
        name: of the topic; `None` takes the only one.

    Raises:
        UnknownNameError: no topic of numbers has that name.
        InputError: there is none, or there are several and none is named.
        LimitError: more messages than `limits` allow.
        CorruptError: the file is damaged.
    """
    where = str(path)
    topic = choose(of_numbers(path, topics(path)), name, where=where, noun="numbers")
    headings = _HEADINGS.get(topic.type, {})
    names: dict[str, int] = {}
    rows: list[dict[str, str]] = []

    def add(message: Decoded) -> None:
        row = dict(_numbers(message.values))
        for field in row:
            if field not in names and len(names) < _WIDEST:
                names[field] = len(names)
        rows.append(row)

    messages = index(path, topic.name, limit=limits.rows, visit=add)
    timed = zip(
        messages.stamps.tolist(), (rows[number] for number in messages.rows.tolist()), strict=True
    )
    lines = [",".join(["time", *(headings.get(field, field) for field in names)])]
    lines += [
        ",".join([iso(stamp), *(row.get(field, "") for field in names)]) for stamp, row in timed
    ]
    message = (
        f"the topic {topic.name}: {len(rows)} messages of {topic.schema or topic.encoding}, a row "
        "each"
    )
    read = Finding.of("topic-read", message, count=len(rows))
    return TableText(
        path=path,
        encoding="utf-8",
        lines=len(lines),
        findings=(read, *messages.findings),
        text=tuple(lines),
    )


def _numbers(values: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, str]]:
    """Yields path and text of each number, those within messages and short lists too, but no
    times."""
    for name, value in values.items():
        if not before and name in _TIMES:
            continue
        path = f"{before}{name}"
        if isinstance(value, Mapping):
            yield from _numbers(value, f"{path}.")
        elif isinstance(value, list | tuple):
            if len(value) <= _LONGEST:
                yield from _numbers({f"{path}.{k}": part for k, part in enumerate(value)})
        elif isinstance(value, bool | int):
            yield path, str(int(value))
        elif isinstance(value, float):
            yield path, "" if value != value else repr(value)
