"""Which part of a JSON object is the log, where it holds a reading beside lists, or several lists of readings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.documents.json_instants import holds_instant, is_instant
from flagdata.ingest.anemometer.words.headings import understand

_DISTINCT = 0.9
"""Share of the rows of a log that have an instant of their own."""


@dataclass(frozen=True, kw_only=True)
class Chosen:
    """The list of readings that is read, its name, those of the others, and why it is this one."""

    rows: Sequence[dict[str, Any]]
    name: str
    others: Sequence[str]
    why: str = "whose readings are the closest in time"

    def finding(self) -> Finding:
        """What is said of the lists that are not read."""
        others = ", ".join(map(repr, self.others))
        what = f"of the members of one object {self.name!r} is read, {self.why}; not {others}"
        fix = "save another one as a file of its own to read it"
        return Finding(kind="several-lists", severity=Severity.WARNING, count=len(self.others) + 1, what=what, fix=fix)


def own_reading(whole: Mapping[str, Any]) -> dict[str, Any] | None:
    """An object without its lists, where its plain members are a reading of the wind at an instant and no list is."""
    plain = {key: value for key, value in whole.items() if not isinstance(value, dict | list)}
    within = [value for value in whole.values() if isinstance(value, dict)]
    lists = [value for one in (whole, *within) for value in one.values() if isinstance(value, list) and value]
    if not lists or not holds_instant(plain) or any(map(holds_instant, within)):
        return None
    if any(isinstance(row, dict) and holds_instant(row) for rows in lists for row in rows):
        return None
    if any(len(rows) > 1 and _are_instants(rows) for rows in lists):
        return None
    if not any("wind" in understand(key).quantity for key, value in plain.items() if not isinstance(value, bool)):
        return None
    return plain


def log_of_several(whole: Mapping[str, Any]) -> Chosen | None:
    """Of several lists of readings at instants in one object, the one that is closest in time; `None` for no such.

    {"current": {…}, "history": [{"time": "…", "wind": 3.1}, …], "hourly": [{"hour": "…", "windMax": 9}, …]}
    """
    lists = {
        key: member for key, member in whole.items()
        if isinstance(member, list) and len(member) > 1 and all(isinstance(row, dict) for row in member)
    }  # fmt: skip
    timed = {key: rows for key, rows in lists.items() if _is_log(rows)}
    winds = {key: rows for key, rows in timed.items() if _of_wind(rows)}
    if not winds:
        return _with_wind(lists)
    if len(timed) < 2:
        return None
    name = max(winds, key=lambda key: len(str(_instant(winds[key][0]))))
    if sum(len(str(_instant(rows[0]))) == len(str(_instant(winds[name][0]))) for rows in winds.values()) > 1:
        return None
    return Chosen(rows=winds[name], name=name, others=[key for key in timed if key != name])


def _with_wind(lists: Mapping[str, Sequence[dict[str, Any]]]) -> Chosen | None:
    """The only one of several lists whose objects hold a wind at an instant, be it the same of several stations."""
    found = [key for key, rows in lists.items() if _of_wind(rows) and all(map(holds_instant, rows))]
    if len(found) != 1 or len(lists) < 2:
        return None
    others = [key for key in lists if key != found[0]]
    return Chosen(rows=lists[found[0]], name=found[0], others=others, why="which alone holds a wind")


def _is_log(rows: Sequence[dict[str, Any]]) -> bool:
    return all(map(holds_instant, rows)) and len({str(_instant(row)) for row in rows}) > _DISTINCT * len(rows)


def _of_wind(rows: Sequence[dict[str, Any]]) -> bool:
    return any(understand(key).channel.endswith(("wind_speed", "wind_x")) for key in rows[0])


def _instant(item: Mapping[str, Any]) -> Any:
    return next(value for key, value in item.items() if is_instant(key, value))


def _are_instants(values: Sequence[Any]) -> bool:
    return all(is_instant("time", value) for value in values)
