"""Whether a table states all of itself: its time in ISO 8601, and each quantity by its own name with its unit."""

from __future__ import annotations

import re

from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.times.timechoice import TimeChoice
from flagdata.ingest.anemometer.winds.found import Wind

_NAME = re.compile(r"\s*(?P<name>[A-Za-z_ ]+?)\s*[\[(](?P<unit>[^\])]+)[\])]\s*")
_TIMES = frozenset({"time", "timestamp", "date time", "datetime"})


def of(layout: Layout, time: TimeChoice | None, wind: Wind | None) -> bool:
    """Whether nothing of a table is inferred or assumed.

    ISO 8601 stamps stand below a heading of a time, and every column that is read below the name of its channel and its
    unit in brackets, in a first line that names the columns. A zone that the stamps lack is the user's to give.
    """
    if time is None or wind is None or not layout.by_name or (layout.preamble, layout.header) != (0, 1):
        return False
    if time.form != "iso" or len(time.columns) != 1 or layout.short or wind.site is not None:
        return False
    if _words(layout.names[time.columns[0]]) not in _TIMES:
        return False
    for channel, column in wind.columns.items():
        found = _NAME.fullmatch(layout.names[column.index])
        if found is None or column.towards or _words(found["name"]) != channel.replace("_", " "):
            return False
    return True


def _words(name: str) -> str:
    return " ".join(name.lower().replace("_", " ").split())
