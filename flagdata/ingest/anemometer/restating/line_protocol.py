r"""Line protocol of InfluxDB, as Telegraf, brokers of messages and exports write it: one row a site and time.

    weather,station=roof,host=pi wind_speed=4.2,wind_dir=231i 1777636800000000000
    wind,station=North\ Pier speed=4.2,note="gusty, cold" 1777636800

Source: InfluxData, "Line protocol": a measurement, tags behind commas, a blank, fields, a blank, an instant. Commas,
blanks and equals signs stand behind a backslash where they divide nothing; integers end with i or u. Instants count
nanoseconds, or microseconds, milliseconds or seconds, which their size tells. Lines of one measurement, of the same
tags and of one instant are one point. Tags that change tell sites apart; of several measurements those with a wind are
read, and the others are told. Fields that are only called "value" are named as in `influx`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.restating import influx
from flagdata.ingest.anemometer.restating.name_value import Record, wide
from flagdata.ingest.anemometer.restating.restate import table
from flagdata.ingest.anemometer.restating.telling_tags import telling
from flagdata.ingest.anemometer.text.kinds import cell_kind
from flagdata.ingest.anemometer.text.source import TableText, TextFile
from flagdata.ingest.anemometer.winds.found import COMPONENTS, SPEEDS
from flagdata.ingest.anemometer.words.headings import understand, words_of
from flagdata.ingest.anemometer.words.wind_words import WIND
from flagdata.timebase import iso

_KEY = r"(?:\\.|[^\\,= ])+"
_TAG = rf",{_KEY}=(?:\\.|[^\\, ])+"
_VALUE = (
    r'(?:"(?:\\.|[^"\\])*"|[-+]?(?:\d++(?:\.\d*+)?|\.\d++)(?:[eE][-+]?\d+)?[iu]?'
    r"|[tT](?:rue|RUE)?|[fF](?:alse|ALSE)?|[nN]a[nN]|null)"
)
_FIELD = rf"{_KEY}={_VALUE}"
_LINE = re.compile(
    rf"\s*(?:>\s+|INSERT\s+|(?P<topic>(?>[^\s,=/]*(?:/[^\s,=/]*)+))\s+)?(?P<name>(?:\\.|[^\\,\s])+)(?P<tags>(?:{_TAG})*)"
    rf" +(?P<fields>{_FIELD}(?:,{_FIELD})*)(?: +(?P<time>-?\d{{1,19}}))?\s*"
)
_ONE_TAG = re.compile(rf",(?P<key>{_KEY})=(?P<value>(?:\\.|[^\\, ])+)")
_ONE_FIELD = re.compile(rf"(?P<key>{_KEY})=(?P<value>{_VALUE})(?:,|$)")
_ESCAPED = re.compile(r"\\([,= \\])")
_NUMBER = re.compile(r"[-+]?[\d.]")
_SHARE = 0.5
_SIZES = ((10**11, 10**9), (10**14, 10**6), (10**17, 10**3), (10**20, 1))
"""Counts below which an instant is one of seconds, milliseconds, microseconds, nanoseconds [each in ns]."""


@dataclass(frozen=True, kw_only=True)
class _Point:
    """One line: its measurement, its tags and fields as text without escapes, and its instant [UTC ns], if any."""

    measurement: str
    tags: Mapping[str, str]
    fields: Mapping[str, str]
    time: int | None

    def stamp(self) -> str:
        """Its instant as text; "" where it has none."""
        return "" if self.time is None else iso(self.time)


def matches(lines: Sequence[str]) -> bool:
    """Half of the lines are points with tags, or with an instant behind their fields."""
    filled = [line for line in lines if line.strip() and not line.lstrip().startswith("#")]
    found = [match for line in filled if (match := _LINE.fullmatch(line.lstrip("\ufeff"))) is not None]
    known = [match for match in found if cell_kind(match["name"]) not in ("number", "stamp")]
    return len(found) > _SHARE * len(filled) and 2 * sum(bool(one["tags"] or one["time"]) for one in known) > len(found)


def as_table(source: TextFile) -> TableText | None:
    """The points that hold a wind, one row a site and time; without a time where most of them have none."""
    points: list[_Point] = []
    other = 0
    for line in source.each_line():
        text = line.lstrip("\ufeff").strip()
        point = _point(text)
        if point is not None:
            points.append(point)
        elif text and not text.startswith("#"):
            other += 1
    timed = 2 * sum(point.time is not None for point in points) > len(points)
    if timed:
        known = [point for point in points if point.time is not None]
        other += len(points) - len(known)
        points = sorted(known, key=lambda point: point.time or 0)
    plain = [point for point in points if _is_plain(point)]
    if timed and 2 * len(plain) > len(points):
        rows = (row for point in plain for row in _series(point))
        stated = influx.of_series(source, rows, what="points of InfluxDB", left_out=other)
        if stated is not None:
            return stated
    kept, remarks = _with_wind(points)
    stated = _rows(source, kept, timed=timed, left_out=other)
    return None if stated is None else replace(stated, findings=(*stated.findings, *remarks))


def _point(line: str) -> _Point | None:
    """What a line says; `None` where it is none of the protocol, or a comment."""
    found = None if line.startswith("#") else _LINE.fullmatch(line)
    if found is None:
        return None
    tags = {} if found["topic"] is None else {"topic": found["topic"]}
    tags |= {_bare(one["key"]): _bare(one["value"]) for one in _ONE_TAG.finditer(found["tags"])}
    fields = {_bare(one["key"]): _cell(one["value"]) for one in _ONE_FIELD.finditer(found["fields"])}
    time = None if found["time"] is None else int(found["time"])
    if time is not None:
        time *= next(size for below, size in _SIZES if abs(time) < below)
    return _Point(measurement=_bare(found["name"]), tags=tags, fields=fields, time=time)


def _bare(text: str) -> str:
    return _ESCAPED.sub(r"\1", text)


def _cell(value: str) -> str:
    """A field's value as a cell: numbers without their suffix, strings without quotes, nothing for no number."""
    if value.startswith('"'):
        return re.sub(r'\\(["\\])', r"\1", value[1:-1])
    if _NUMBER.match(value):
        return value.rstrip("iu")
    return "" if value.lower() in ("nan", "null") else value


def _is_plain(point: _Point) -> bool:
    """Whether the numbers of a point are called nothing but a value."""
    if influx.PLAIN.isdisjoint(point.fields):
        return False
    numbers = {name for name, cell in point.fields.items() if cell_kind(cell) == "number"}
    return bool(numbers) and numbers <= influx.PLAIN


def _series(point: _Point) -> Iterator[dict[str, str]]:
    """The rows of an annotated table that a point with plain fields makes."""
    for name, cell in point.fields.items():
        if name in influx.PLAIN:
            yield {**point.tags, "_time": point.stamp(), "_value": cell, "_field": name,
                   "_measurement": point.measurement}  # fmt: skip


def _heading(measurement: str, field: str) -> str:
    """What a field is called: by its own words, or behind its measurement where only both name a wind."""
    both = f"{measurement} {field}"
    own = understand(field).quantity and not WIND.isdisjoint(words_of(field))
    return field if own or not _is_named_wind(both) else both


def _is_wind(name: str) -> bool:
    heading = understand(name)
    return heading.sure and "wind" in heading.quantity


def _is_named_wind(name: str) -> bool:
    return _is_wind(name) and not WIND.isdisjoint(words_of(name))


def _is_speed(name: str) -> bool:
    heading = understand(name)
    return heading.sure and heading.channel in (*SPEEDS, *COMPONENTS)


def _with_wind(points: Sequence[_Point]) -> tuple[list[_Point], list[Finding]]:
    """Points of the measurements with a wind, their fields called by headings, and what is said of the others.

    Where several have a speed, each keeps its measurement as a tag and is a site of its own; where one has, others
    with a wind belong to it. Where none has a wind, all stay, for the table's reader to say what is missing.
    """
    names: dict[str, dict[str, str]] = {}
    for point in points:
        own = names.setdefault(point.measurement, {})
        for field in point.fields:
            if field not in own:
                own[field] = _heading(point.measurement, field)
    windy = [one for one in names if any(map(_is_named_wind, names[one].values()))]
    windy = windy or [one for one in names if any(map(_is_wind, names[one].values()))] or list(names)
    speeds = [one for one in windy if any(map(_is_speed, names[one].values()))]
    wanted = speeds if len(speeds) > 1 else windy
    kept = [
        replace(
            point, fields={names[point.measurement][field]: cell for field, cell in point.fields.items()},
            tags={"measurement": point.measurement, **point.tags} if len(speeds) > 1 else point.tags,
        )
        for point in points if point.measurement in wanted
    ]  # fmt: skip
    others = [one for one in names if one not in wanted]
    if not others:
        return kept, []
    count = len(points) - len(kept)
    shown = ", ".join(map(repr, others[:10])) + (f" and {len(others) - 10} more" if len(others) > 10 else "")
    what = f"{count} points of other measurements hold no speed of the wind: {shown}; left out"
    return kept, [Finding(kind="measurements-left-out", severity=Severity.NOTE, count=count, what=what)]


def _rows(source: TextFile, points: Sequence[_Point], *, timed: bool, left_out: int) -> TableText | None:
    """Points as rows of one table, those of a site and an instant together; sites without a speed are left out."""
    apart = _apart(points)
    quantities = [tag for tag in dict.fromkeys(tag for point in points for tag in point.tags) if _is_wind(tag)]
    merged: dict[tuple[str, ...], dict[str, str]] = {}
    for at, point in enumerate(points):
        site = ("/".join(filter(None, (point.tags.get(tag, "") for tag in apart))),) if apart else ()
        key = (point.stamp() if timed else f"{at}", *site)
        told = {tag: point.tags[tag] for tag in quantities if tag in point.tags}
        merged.setdefault(key, {}).update({**told, **point.fields})
    names = list(dict.fromkeys(name for row in merged.values() for name in row))
    speeds = [name for name in names if _is_speed(name)]
    if apart and speeds:
        with_speed = {key[1] for key, row in merged.items() if not row.keys().isdisjoint(speeds)}
        silent = len({key[1] for key in merged} - with_speed)
        merged = {key: row for key, row in merged.items() if key[1] in with_speed}
    else:
        silent = 0
    heading = ["time", *(["site"] if apart else [])]
    what = "points of InfluxDB's line protocol"
    if timed and _alone(merged.values(), speeds):
        records = [
            Record(stamp=key, name=name, value=cell) for key, row in merged.items() for name, cell in row.items()
        ]
        stated = wide(source, heading, records, what=what, left_out=[left_out])
    else:
        names = list(dict.fromkeys(name for row in merged.values() for name in row))
        columns = [*(heading if timed else heading[1:]), *names]
        cells = ([*(key if timed else key[1:]), *(row.get(name, "") for name in names)] for key, row in merged.items())
        stated = table(source, columns, cells, kind="line-protocol", what=what, left_out=left_out)
    if stated is None or not silent:
        return stated
    text = f"{silent} sites have no speed of the wind in any point; left out"
    finding = Finding(kind="sites-left-out", severity=Severity.NOTE, count=silent, what=text)
    return replace(stated, findings=(*stated.findings, finding))


def _alone(rows: Iterable[Mapping[str, str]], speeds: Sequence[str]) -> bool:
    """Whether most speeds stand in rows of their own, and other quantities of the wind in others."""
    held = [[name for name in row if _is_wind(name)] for row in rows]
    with_speed = [row for row in held if not set(row).isdisjoint(speeds)]
    return len(with_speed) < len([row for row in held if row]) and 2 * sum(
        set(row) <= set(speeds) for row in with_speed
    ) > len(with_speed)


def _apart(points: Sequence[_Point]) -> list[str]:
    """The tags that tell sites apart, quantities set aside."""
    tags = list(dict.fromkeys(tag for point in points for tag in point.tags))
    tags = [tag for tag in tags if tag == "measurement" or not understand(tag).quantity]
    return telling((point.tags for point in points), tags, first="measurement")
