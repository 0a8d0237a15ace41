"""What the user gives of a table's columns in one line:
"date,time,wind_speed[km/h],,wind_direction[deg]".

    ENTRY,ENTRY,…              one entry a column, in the order of the file; a blank entry is a
                               column that is not read
    COLUMN=ENTRY,COLUMN=ENTRY  or only those that are read, each after its heading or number (from
                               1)

An entry is a channel with its unit in brackets, `wind_direction_to` for a direction that the wind
blows to, or a part
of the time: `time`, `date`, `year`, `month`, `day`, `day_of_year`, `hour`, `minute`, `second`.
Behind `time` and `date` the format may stand in brackets, as a recipe's [time] format has it, or
the unit of a count since a start (`time[s]`).
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from flagdata.core.numbered import read_bounded
from flagdata.core.schema import CHANNELS
from flagdata.core.units import canonical
from flagdata.errors import InputError, UnknownNameError, UsageError
from flagdata.ingest.anemometer.draft.table_shape import TableShape
from flagdata.ingest.anemometer.instants.stamp_text import ELAPSED

_WHERE = "--columns"
TOWARDS = "wind_direction_to"
PARTS = {
    "year": "%Y",
    "month": "%m",
    "day": "%d",
    "day_of_year": "%j",
    "hour": "%H",
    "minute": "%M",
    "second": "%S%f",
}
_TIMES = ("date", "time", *PARTS)
_COUNTS = {form.removeprefix("elapsed-"): form for form in ELAPSED}
_NAMES = tuple(name for name, channel in CHANNELS.items() if channel.dims == ("time",))
_ENTRY = re.compile(
    r"(?:(?P<column>.*)=)?\s*(?P<name>[^\[\]=]*?)\s*(?:\[(?P<detail>[^\]]*)\])?\s*", re.DOTALL
)


@dataclass(frozen=True, kw_only=True)
class GivenColumns:
    """Columns as the user gives them.

    Attributes:
        time: their indices, in the order of the file; none where the rows carry no time.
        form: of the time, as far as it is given; "" leaves it to the stamps.
        channels: name → (index, unit).
        towards: whether the direction is the one that the wind blows to.
    """

    time: tuple[int, ...]
    form: str
    channels: Mapping[str, tuple[int, str]]
    towards: bool


def given_columns(text: str, shape: TableShape) -> GivenColumns:
    """Reads the columns of a table as one line gives them.

    Raises:
        UsageError, UnknownNameError: an entry that cannot be read, a name or a unit that is not
            known.
        InputError: a column that the table does not have.
    """
    parts = re.split(r",(?![^\[\]]*\])", text)
    by_name = "=" in re.sub(r"\[[^\]]*\]", "", text)
    times: list[tuple[int, str, str]] = []
    channels: dict[str, tuple[int, str]] = {}
    towards = False
    for number, part in enumerate(parts, start=1):
        if not part.strip():
            continue
        match = _ENTRY.fullmatch(part.strip())
        if (
            match is None
            or not match["name"]
            or by_name != (match["column"] is not None)
            or "?" in part
        ):
            fix = (
                'write NAME[UNIT] for each, as "time,wind_speed[km/h]", or COLUMN=NAME[UNIT] for '
                "each"
            )
            raise UsageError(f"{part.strip()!r} cannot be read", where=_WHERE, fix=fix)
        name, detail = match["name"], (match["detail"] or "").strip()
        index = _index(match["column"].strip(), shape) if by_name else number - 1
        if index >= len(shape.names):
            message = f"entry {number} is beyond the {len(shape.names)} columns of the table"
            raise InputError(
                message, where=_WHERE, fix="count the columns, or name them: COLUMN=NAME[UNIT]"
            )
        if name in _TIMES:
            times.append((index, name, detail))
            continue
        towards = towards or name == TOWARDS
        name = "wind_direction" if name == TOWARDS else name
        if name not in _NAMES:
            raise UnknownNameError.of("column", name, [*_TIMES, TOWARDS, *_NAMES], where=_WHERE)
        if name in channels:
            raise UsageError(f"{name} stands twice", where=_WHERE, fix="name one of them")
        if not detail:
            raise UsageError(
                f"{name} has no unit", where=_WHERE, fix=f"write {name}[UNIT], as {name}[m/s]"
            )
        channels[name] = (index, canonical(detail, where=f"{_WHERE} {name}"))
    if not channels:
        raise UsageError(
            "no channel is named", where=_WHERE, fix="name the column of the wind: wind_speed[m/s]"
        )
    times.sort()
    return GivenColumns(
        time=tuple(i for i, _, _ in times), form=_form(times), channels=channels, towards=towards
    )


def _form(times: list[tuple[int, str, str]]) -> str:
    """Returns the format as far as the entries give it; "" leaves it to the stamps."""
    if any(name in PARTS for _, name, _ in times):
        return " ".join(PARTS.get(name) or detail for _, name, detail in times)
    details = [_COUNTS.get(detail, detail) for _, _, detail in times]
    return " ".join(details) if all(details) else ""


def _index(column: str, shape: TableShape) -> int:
    if column in shape.names:
        if shape.names.count(column) > 1:
            raise InputError(
                f"{column!r} heads several columns", where=_WHERE, fix="give its number (from 1)"
            )
        return shape.names.index(column)
    number = read_bounded(column, most=len(shape.names))
    if number:
        return number - 1
    raise UnknownNameError.of(
        "column", column, [name for name in shape.names if name], where=_WHERE
    )
