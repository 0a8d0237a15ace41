"""JSON with one object a reading, as lines or in a list, made a table that every format reads.

    {"time":"2026-05-01T12:00:00Z","wind_avg_m_s":4.2,"wind_dir_deg":210}       as rtl_433 and many loggers write
    weather/station {"ts":1777636800,"wind":{"speed_kmh":15.1}}                 as mosquitto_sub -v writes
    {"context":"vessels.self","updates":[{"timestamp":"…","values":[{"path":"environment.wind.speedApparent",…

Members become columns called by their keys, joined with points; elements of a list by their number. Two kinds of
message have no keys or no units, and are named by their makers' descriptions: WeatherFlow, "Tempest UDP reference,
version 171" (obs_st and rapid_wind are arrays of stated units), and Signal K specification 1.7.0, "Keys reference"
(values are SI; speedTrue and angleTrueWater are relative to the vessel, so no wind over ground).
"""

from __future__ import annotations

import ast
import csv
import io
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from flagdata.errors import InputError, LimitError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.documents import (
    coverage_json,
    json_choice,
    json_epochs,
    json_keyed,
    json_measures,
    json_series,
)
from flagdata.ingest.anemometer.documents.json_instants import holds_instant, is_instant
from flagdata.ingest.anemometer.text.kinds import cell_kind
from flagdata.ingest.anemometer.text.source import TableText, TextFile
from flagdata.ingest.anemometer.words.headings import fits, understand, words_of
from flagdata.units import spelled

WIDEST = 2000
"""Columns of the widest table that is read."""
_DEEPEST = 8
"""Objects within objects that are looked into."""
_LONGEST = 20_000
"""Characters of the longest dictionary that is read as Python prints it."""
_LOOKED_AT = 50
_TOLD = 5
"""Parts of a coverage that are not read, of which each is told."""
_PLATFORM = frozenset(
    {"lat", "latitude", "lon", "lng", "longitude", "position", "sog", "cog", "heading", "navigation", "course"}
)
"""Words of members that tell where a platform is, or how it moves."""
_REPEAT = "sequence_num"
"""The number of a repeat of one radio message, from 0, as rtl_433 writes it."""
_NUMBERED = re.compile(r"[0-9]{1,9}")
_OF_RECORDING = re.compile(r"@([0-9]+(?:\.[0-9]+)?)s")
"""Seconds since the beginning of a radio recording, as rtl_433 stamps what it reads from a file."""
_DATE_AND_TIME = re.compile(
    r"\s*\[?(?P<date>\d{4}[-/]\d{1,2}[-/]\d{1,2}),?\s+(?P<time>\d{1,2}:\d{2}(:\d{2}([.,]\d+)?)?)\]?(?=\s|$)"
)
"""A stamp of two words before an object."""
_RECEPTION = frozenset({_REPEAT, "rssi", "snr", "noise", "freq", "freq1", "freq2"})
"""Members that tell how a radio message was received, not what it says."""
_INDEX = re.compile(r"\.\d+(?=\.)")
"""The number of an element of a list in the name of a column."""
_LAST_INDEX = re.compile(r"\.\d+$")
_LINE = re.compile(r"\s*(?P<before>[^\s{\[][^{]{0,300}?)?[\s,;]*(?P<object>\{.*\})[\s,]*")
_TEMPEST = {
    "obs_st": (
        "time [epoch]", "wind lull [m/s]", "wind avg [m/s]", "wind gust [m/s]", "wind direction [deg]", "interval",
        "station pressure [hPa]", "air temperature [degC]", "relative humidity [%]",
    ),
    "obs_sky": (
        "time [epoch]", "illuminance", "uv", "rain", "wind lull [m/s]", "wind avg [m/s]", "wind gust [m/s]",
        "wind direction [deg]",
    ),
    "rapid_wind": ("time [epoch]", "rapid wind speed [m/s]", "rapid wind direction [deg]"),
}  # fmt: skip
_SIGNAL_K = {
    "environment.wind.speedApparent": "AWS [m/s]", "environment.wind.angleApparent": "AWA [rad]",
    "environment.wind.speedTrue": "TWS [m/s]", "environment.wind.angleTrueWater": "TWA [rad]",
}  # fmt: skip


def matches(lines: Sequence[str]) -> bool:
    """Whether the first lines of a file are JSON objects, or a list of them; canboat's messages are not meant."""
    filled = [line for line in lines[:_LOOKED_AT] if line.strip()]
    if not filled:
        return False
    if filled[0].lstrip("\ufeff \t").startswith("["):
        return bool(re.match(r"\s*\[\s*(?:\{\s*\"|\[.*,\s*\[)", "".join(filled).lstrip("\ufeff")))
    if filled[0].strip("\ufeff \t\r") == "{":
        return bool(re.match(r"\s*\"[^\"]*\"\s*:", "".join(filled[1:])))
    objects = [match for line in filled if (match := _LINE.fullmatch(line)) is not None and _object(match["object"])]
    messages = sum('"pgn":' in match["object"] for match in objects)
    return 2 * len(objects) >= len(filled) > 2 * messages


def as_table(source: TextFile) -> TableText | None:
    """The objects of a file as a table whose first line names the columns; `None` where a list is no list of objects.

    Raises:
        LimitError: more than `WIDEST` columns.
        InputError: CoverageJSON of which no wind can be read.
    """
    whole = _whole(source)
    series = json_epochs.table(whole) or json_series.table(whole)
    unread = coverage_json.unread(whole)
    if unread and not any("wind" in understand(name).quantity for row in series or () for name in row):
        raise InputError(f"CoverageJSON: {unread[0].what}", where=str(source.path), fix=unread[0].fix)
    columns = None if series is None else [{name: _text(value) for name, value in row.items()} for row in series]
    chosen = json_choice.log_of_several(whole) if isinstance(whole, dict) and columns is None else None
    whole = list(chosen.rows) if chosen is not None else whole
    if columns is None and isinstance(whole, dict) and json_choice.own_reading(whole) is None:
        columns = _columns(whole)
    before: list[tuple[str, str]] = []
    if columns is not None:
        before = [(key, _text(value)) for key, value in _of_all(whole).items() if not isinstance(value, dict | list)]
    table: list[dict[str, str]] = []
    names: dict[str, None] = {}
    broken = 0
    for row in _rows(source, whole) if columns is None else columns:
        broken += row is None
        table.append(row or {})
        names.update(dict.fromkeys(row or {}))
        if len(names) > WIDEST:
            fix = "write the columns needed to a CSV file"
            raise LimitError(f"JSON with more than {WIDEST} kinds of members", where=str(source.path), fix=fix)
    if not names:
        return None
    table, repeats = _once(table)
    table, names = _of_recording(table, names)
    table, names = _in_unit_of_all(whole, table, names)
    _refuse_several_instants(table, where=str(source.path))
    kept, others = _of_wind(table, tuple(names))
    if others:
        names = dict.fromkeys(name for name in names if any(name in row for row in kept))
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerows(before)
    writer.writerow(names)
    writer.writerows([row.get(name, "") for name in names] for row in kept)
    text = f"JSON, read as a table of {len(names)} columns; lines are counted with its heading as the first"
    found = [Finding(kind="json-table", severity=Severity.NOTE, what=text)]
    found += [] if chosen is None else [chosen.finding()]
    if unread:
        text = "; ".join(defect.what for defect in unread[:_TOLD])
        text += f"; and {len(unread) - _TOLD} more" if len(unread) > _TOLD else ""
        text = f"not read: {text}"
        found.append(
            Finding(kind="columns-not-read", severity=Severity.WARNING, count=len(unread), what=text, fix=unread[0].fix)
        )
    if others:
        text = f"{others} objects have no member of the wind that others have: messages of another kind; left out"
        found.append(Finding(kind="other-messages", severity=Severity.NOTE, count=others, what=text))
    if repeats:
        text = f"{repeats} objects are repeats of the same radio message ({_REPEAT}); left out"
        found.append(Finding(kind="repeated-messages", severity=Severity.NOTE, count=repeats, what=text))
    if broken:
        text = f"{broken} lines are no JSON objects; left out"
        found.append(Finding(kind="malformed-lines", severity=Severity.WARNING, count=broken, what=text))
    lines = tuple(out.getvalue().splitlines())
    return TableText.of(source, lines, found)


def members(text: str) -> dict[str, str] | None:
    """The members of an object as JSON or Python prints it, by their joined keys; `None` where a text is none."""
    found = _object(text.strip())
    return None if found is None else _flat(found)


def _of_all(whole: Any) -> dict[str, Any]:
    """The members of an object, or those that all objects of a list have in common."""
    if isinstance(whole, dict):
        return whole
    return {key: value for key, value in whole[0].items() if all(item.get(key) == value for item in whole)}


def _once(table: Sequence[dict[str, str]]) -> tuple[list[dict[str, str]], int]:
    """The rows without those that repeat the radio message before them, and the number of these.

    A sender repeats each message in case it is lost; a receiver that numbers the repeats writes them under one stamp.
    """
    kept: list[dict[str, str]] = []
    last: dict[str, str] = {}
    for row in table:
        numbers = [_NUMBERED.fullmatch(each.get(_REPEAT, "")) for each in (last, row)]
        if all(numbers) and int(row[_REPEAT]) > int(last[_REPEAT]):
            same = {k: v for k, v in row.items() if k not in _RECEPTION}
            if same == {k: v for k, v in last.items() if k not in _RECEPTION}:
                last = row
                continue
        kept.append(row)
        last = row
    return kept, len(table) - len(kept)


def _of_recording(table: list[dict[str, str]], names: dict[str, None]) -> tuple[list[dict[str, str]], dict[str, None]]:
    """The rows and columns, with seconds since the beginning of a radio recording made numbers."""
    said = [row["time"] for row in table if row.get("time")]
    if not said or not all(_OF_RECORDING.fullmatch(text) for text in said):
        return table, names
    counted = [
        {"time [s]" if name == "time" else name: cell for name, cell in row.items()}
        | ({"time [s]": _OF_RECORDING.sub(r"\1", row["time"])} if row.get("time") else {})
        for row in table
    ]
    return counted, dict.fromkeys("time [s]" if name == "time" else name for name in names)


def _refuse_several_instants(table: Sequence[Mapping[str, str]], *, where: str) -> None:
    """Refuse rows that hold readings of several instants, in lists within them: all would be put at one.

    Raises:
        InputError: there are such rows.
    """
    fix = "export them as a list of objects or as CSV, one row a reading with its own time"
    listed = _listed_instants(table[0]) if len(table) == 1 else []
    if len(listed) > 1 and len(set(listed)) == 1:
        what = f"JSON with {len(listed)} instants in its list {listed[0]!r}, and readings that no rule puts at them"
        raise InputError(what, where=where, fix=fix)
    for row in table[:_LOOKED_AT]:
        alike = {name: _INDEX.sub(".#", name) for name in row}
        counted: dict[str, set[str]] = {}
        for name, like in alike.items():
            if like != name and is_instant(name.rpartition(".")[2], row[name]):
                counted.setdefault(like, set()).add(row[name])
        like, instants = max(counted.items(), key=lambda item: len(item[1]), default=("", set[str]()))
        within = like.rpartition(".#")[0]
        if len(instants) > 1 and any(
            like.startswith(f"{within}.#") and "wind" in understand(name.rpartition(".")[2]).quantity
            for name, like in alike.items()
        ):
            what = f"JSON with readings of {len(instants)} instants in one object, in its list {within!r}"
            raise InputError(what, where=where, fix=fix)


def _listed_instants(row: Mapping[str, str]) -> list[str]:
    """The lists of plain values that instants of a row stand in, one for each of them."""
    lists = ((name.rpartition(".")[0], cell) for name, cell in row.items() if _LAST_INDEX.search(name))
    return [name for name, cell in lists if is_instant(name.rpartition(".")[2], cell)]


def _in_unit_of_all(
    whole: Any, table: list[dict[str, str]], names: dict[str, None]
) -> tuple[list[dict[str, str]], dict[str, None]]:
    """The rows and columns with the units that the whole object states, one for all speeds or one for each name."""
    stated = [whole.get(key) for key in ("unit", "units")] if isinstance(whole, dict) else []
    of_each = next((own for own in stated if isinstance(own, dict)), None)
    if of_each is not None:
        named = {name: of_each.get(name.rpartition(".")[2]) for name in names}
        return _renamed(table, names, {
            name: f"{name} [{unit}]" for name, unit in named.items()
            if isinstance(unit, str) and spelled(unit) is not None and understand(name).unit is None
        })  # fmt: skip
    known = next((unit for text in stated if isinstance(text, str) and (unit := spelled(text)) is not None), None)
    if known is None:
        return table, names
    headings = {name: understand(name) for name in names}
    renamed = {
        name: f"{name} [{known}]" for name, heading in headings.items()
        if heading.quantity.endswith("wind_speed") and heading.unit is None and fits("wind_speed", known)
    }  # fmt: skip
    return _renamed(table, names, renamed)


def _renamed(
    table: list[dict[str, str]], names: dict[str, None], renamed: Mapping[str, str]
) -> tuple[list[dict[str, str]], dict[str, None]]:
    """The rows and columns under other names."""
    changed = [{renamed.get(name, name): cell for name, cell in row.items()} for row in table]
    return changed, {renamed.get(name, name): None for name in names}


def _of_wind(table: Sequence[dict[str, str]], names: Sequence[str]) -> tuple[list[dict[str, str]], int]:
    """The rows that hold the wind or where the platform is, and the number of the others; all where no row holds it.

    A logger writes messages of several kinds, with and without wind; those without are no missing readings.
    """
    filled = [row for row in table if row]
    headings = {name: understand(name) for name in names}
    windy = {name for name in names if "wind" in headings[name].quantity}
    if not windy:
        return filled, 0
    wanted = windy | {name for name in names if set(words_of(name)) & _PLATFORM}
    kept = [row for row in filled if not wanted.isdisjoint(row)]
    return kept, len(filled) - len(kept)


def _whole(source: TextFile) -> Any:
    """What a file holds that is one list or one object; `None` for objects in lines."""
    filled = [line for line in source.head(_LOOKED_AT) if line.strip()]
    first = filled[0].lstrip("\ufeff \t") if filled else ""
    if not first.startswith("[") and first.strip() != "{" and len(filled) > 1:
        return None
    return json_keyed.as_list(_parsed("\n".join(source.each_line()).lstrip("\ufeff")))


def _columns(item: dict[str, Any]) -> list[dict[str, str]] | None:
    """Rows of an object that holds its columns as lists of one length, with their units in a member "…_units"."""
    for name, member in [("", item), *item.items()]:
        lists = {k: v for k, v in member.items() if isinstance(v, list)} if isinstance(member, dict) else {}
        if len(lists) < 2 or len({len(values) for values in lists.values()}) > 1:
            continue
        units = item.get(f"{name}_units")
        units = units if isinstance(units, dict) else {}
        heads = {key: f"{key} [{units[key]}]" if isinstance(units.get(key), str) else key for key in lists}
        rows = zip(*lists.values(), strict=True)
        return [{heads[key]: _text(value) for key, value in zip(lists, row, strict=True)} for row in rows]
    return None


def _rows(source: TextFile, whole: Any) -> Iterator[dict[str, str] | None]:
    """Each object's cells by name; `None` for a line that is none."""
    if whole is not None:
        for item in _items(whole):
            yield _flat(item) if isinstance(item, dict) else _listed(item) if isinstance(item, list) else None
        return
    for _, lines in source.blocks():
        for line in lines:
            if not line.strip():
                continue
            match = _LINE.fullmatch(line)
            found = _object(match["object"]) if match is not None else None
            if match is None or found is None:
                yield None
                continue
            yield {**_before(match["before"] or ""), **_flat(found)}


def _items(whole: Any) -> list[Any]:
    """The rows of a whole file: a list, the one list of objects or of rows that an object holds, or the object.

    The list may lie in an object within ("observations": {"header": …, "data": [ … ]}).
    """
    if isinstance(whole, list):
        return json_measures.by_station(whole)
    own = json_choice.own_reading(whole)
    if own is not None:
        return [own]
    timed = json_measures.by_time(whole)
    if timed is not None:
        return timed
    if isinstance(whole.get("obs"), list) and str(whole.get("type")) in _TEMPEST:
        return [{**whole, "obs": [row]} for row in whole["obs"]]
    level = [whole]
    for _ in range(_DEEPEST):
        lists = [
            member for item in level for member in item.values()
            if isinstance(member, list) and len(member) > 1 and {type(item) for item in member} in ({dict}, {list})
        ]  # fmt: skip
        # Beside readings there may be a list of stations, which has no times.
        lists = [one for one in lists if _timed(one)] or lists
        if len(lists) == 1:
            above = next(item for item in level if any(member is lists[0] for member in item.values()))
            return json_measures.by_station(_at_one_time(above, _readings_within(lists[0])))
        level = [inner for item in level for member in item.values() for inner in _objects(member)]
        if lists or not level:
            break
    return [whole]


def _objects(member: Any) -> list[dict[str, Any]]:
    """The object that a member is, or that is alone in its list; none in any other."""
    alone = member[0] if isinstance(member, list) and len(member) == 1 else member
    return [alone] if isinstance(alone, dict) else []


def _readings_within(items: list[Any]) -> list[Any]:
    """The readings of sensors that hold a list of them each, beside what is said of the sensor; else the items.

    {"sensors":[{"lsid":1,"data":[{"ts":1777636800,"wind_speed_avg":3}, …]}, …]}   Davis, "WeatherLink v2 API"
    """
    found: list[Any] = []
    for item in items:
        lists = {key: value for key, value in item.items() if isinstance(value, list)} if isinstance(item, dict) else {}
        if len(lists) != 1:
            return items
        ((key, readings),) = lists.items()
        if not readings or not all(isinstance(one, dict) for one in readings):
            return items
        if not all(map(holds_instant, readings)):
            return items
        found += [{name: value for name, value in item.items() if name != key} | one for one in readings]
    return found if len(found) > len(items) else items


def _at_one_time(above: Mapping[str, Any], items: list[Any]) -> list[Any]:
    """Readings that tell no time, at the one instant that the object around their list tells; others as they are."""
    plain = all(isinstance(item, dict) for item in items)
    if not plain or any(map(holds_instant, items)):
        return items
    told = {name: value for name, value in above.items() if is_instant(name, value) or _is_update(name, value)}
    return [told | item for item in items] if len(told) == 1 else items


def _is_update(key: str, value: object) -> bool:
    """Whether a member tells when what is beside it was brought up to date."""
    return "updated" in words_of(key) and isinstance(value, str) and cell_kind(value) == "stamp"


def _timed(items: Sequence[Any]) -> bool:
    """Whether the first of the items of a list holds a stamp among its plain members."""
    first = items[0]
    return isinstance(first, dict) and any(
        isinstance(value, str) and cell_kind(value) == "stamp" for value in first.values()
    )


def _listed(row: list[Any]) -> dict[str, str] | None:
    """Cells of a row without names, by their numbers; `None` where they are no plain values."""
    if any(isinstance(item, dict | list) for item in row):
        return None
    return {f"item {number}": _text(item) for number, item in enumerate(row, start=1)}


def _before(text: str) -> dict[str, str]:
    """Cells of what stands before an object: a stamp, a topic."""
    found: dict[str, str] = {}
    stamp = _DATE_AND_TIME.match(text)
    if stamp is not None:
        found["logged time"] = f"{stamp['date']} {stamp['time'].replace(',', '.')}"
        text = text[stamp.end() :]
    for number, word in enumerate(text.split(), start=1):
        timed = cell_kind(word) == "stamp" or re.fullmatch(r"\d{10}(\.\d+)?", word)
        found.setdefault("logged time" if timed else f"topic{number}", word)
    return found


def _object(text: str) -> dict[str, Any] | None:
    found = _parsed(text)
    return found if isinstance(found, dict) else None


def _parsed(text: str) -> Any:
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        pass
    if not text.startswith("{'") or len(text) > _LONGEST:
        return None
    try:
        return ast.literal_eval(text)  # a dictionary as Python prints it
    except (ValueError, SyntaxError, RecursionError, MemoryError):
        return None


def _flat(item: dict[str, Any]) -> dict[str, str]:
    """Cells of an object by name."""
    found: dict[str, str] = {}
    kind = item.get("type")
    names = _TEMPEST.get(kind) if isinstance(kind, str) else None
    if names is not None:
        rows = item.get("obs") if str(kind).startswith("obs") else [item.get("ob")]
        row = rows[0] if isinstance(rows, list) and rows else None
        if isinstance(row, list):
            return {"type": str(kind)} | {name: _text(value) for name, value in zip(names, row, strict=False)}
    _fill(found, "", item, 0)
    return found


def _fill(found: dict[str, str], name: str, value: Any, depth: int) -> None:
    if depth > _DEEPEST or len(found) > WIDEST:
        return
    if isinstance(value, dict):
        if set(value) == {"path", "value"} and isinstance(value["path"], str):
            path = value["path"]
            _fill(found, _SIGNAL_K.get(path, path), value["value"], depth + 1)
            return
        measured = json_measures.plain(value, name) if name else None
        for key, inner in ({} if measured is None else measured).items():
            _fill(found, key, inner, depth + 1)
        for key, inner in (value if measured is None else {}).items():
            _fill(found, f"{name}.{key}" if name else str(key), inner, depth + 1)
    elif isinstance(value, list) and (named := json_measures.by_name(value)) is not None:
        _fill(found, name, named, depth + 1)
    elif isinstance(value, list):
        for number, inner in enumerate(value, start=1):
            named = len(value) == 1 or (isinstance(inner, dict) and set(inner) == {"path", "value"})
            _fill(found, name if named else f"{name}.{number}", inner, depth + 1)
    elif name:
        found.setdefault(name, _text(value))


def _text(value: object) -> str:
    """A cell on one line."""
    if value is None or isinstance(value, bool | list | dict):
        return ""
    return repr(value) if isinstance(value, float) else " ".join(str(value).split())
