"""Rows of several devices in one table below a heading that does not say so: a column tells them apart by the stamps.

Where the rows of devices stand one below the other, or devices take turns, the stamps of the file run back or stand
still, and those of each device do not. A column with that property names the devices, if they measured at the same
time: the days or the parts of a log that somebody put in another order follow each other, and the hours of summer and
of winter time have one hour in common. Names that come in strict turn, row by row, are devices as well.

Time that runs back, and names in turn, are refused with the line that reads each device by itself. Where rows share
stamps, the column may number the samples of a stamp as well, so that is a warning.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import SeveralDevicesError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.instants.abbreviations import ABBREVIATED, SEVERAL
from flagdata.ingest.anemometer.instants.clock import JITTER
from flagdata.ingest.anemometer.options import WindOptions
from flagdata.ingest.anemometer.reading import Reading
from flagdata.ingest.anemometer.recipe import Recipe
from flagdata.ingest.anemometer.tables import offered_columns, stated_columns
from flagdata.ingest.anemometer.text.layout import Layout, lay_out
from flagdata.ingest.anemometer.text.rows import RowReader
from flagdata.ingest.anemometer.text.source import TextFile
from flagdata.ingest.anemometer.times.timechoice import TimeChoice
from flagdata.ingest.anemometer.times.timecolumns import find_time
from flagdata.ingest.anemometer.winds.angles import compass_unit
from flagdata.ingest.anemometer.winds.found import Wind
from flagdata.ingest.anemometer.winds.instruments import find_winds, named_wind
from flagdata.ingest.anemometer.words.headings import interest, names_time, understand
from flagdata.signals import Instants

_MOST = 50
"""Devices of a column whose heading does not name them."""
_SAMPLE = 100_000
"""Rows, evenly over the file, by which its devices are told."""
_AT_ONCE = 0.5
"""Share of the rows that lie in the time of another device."""
_INSIDE = 0.9
"""Share of the shorter of two devices' rows that lie in the time of the longer."""
_SHARED = 0.5
"""Share of the rows that share a stamp."""
_TURNS, _STRICT = 10, 0.95
"""Turns that names take, row by row, and the share of the rows that keep to them."""
_NAMED = 3
_MEASURED = re.compile(r"[+-]?\d*\.\d+(?:[eE][+-]?\d+)?")
"""A number with a fraction, which names no device."""
_ANSWERS = frozenset({"true", "false", "yes", "no", "on", "off", "0", "1", "y", "n", "t", "f", "ok", "good", "bad"})
"""Words of what is so or not in a row, which name no devices."""


@dataclass(frozen=True, kw_only=True)
class _Rows:
    """Rows of a table in the order of the file.

    Attributes:
        time: (n,) of each.
        code: of columns that may tell devices apart, by index: (n,) number of each row's name.
        names: of the same columns, the names.
    """

    time: Instants
    code: Mapping[int, NDArray[np.int64]]
    names: Mapping[int, tuple[str, ...]]


@dataclass(frozen=True, kw_only=True)
class Mixed:
    """A column that may tell devices apart, and the warning that says so."""

    column: int
    finding: Finding


def check(
    source: TextFile, lines: Sequence[str], reading: Reading, recipe: Recipe, options: WindOptions, where: str
) -> Mixed | None:
    """The column that may tell devices apart; `None` where none does, or the user says whose clock is right.

    Args:
        lines: of the beginning of the file.
        reading: of the table, in any order.
        recipe: that it was read by.

    Raises:
        SeveralDevicesError: a column surely does.
    """
    layout = lay_out(lines, interest=interest)
    if layout is None or recipe.rows is not None or options.clock is not None:
        return None
    order = np.argsort(reading.line, kind="stable")
    time, line = reading.time[order], reading.line[order]
    if len(time) > 2 and float((np.diff(time) < 0).mean()) > 0.5:  # the newest row comes first
        time, line = -time, line
    others = _other_columns(layout, recipe)
    if bool(np.any(np.diff(time) < -JITTER)):
        rows = _sampled(source, recipe, others, time, line)
        found = _best(layout, rows, [at for at in rows.code if _each_rises(rows, at)])
        if found is not None:
            what = f"{_tells(layout, rows, found)}: the stamps of each rise, and those of all together run back"
            raise SeveralDevicesError(what, where=where, fix=_fix(layout, found, options, clock=True))
        return None
    rows = _first(layout, others, time, line)
    found = _best(layout, rows, [at for at in rows.code if _in_turn(layout, rows, at)])
    if found is not None and options.columns is None:
        what = f"{_tells(layout, rows, found)}, row by row in turn"
        raise SeveralDevicesError(what, where=where, fix=_fix(layout, found, options, clock=False))
    found = _best(layout, rows, [at for at in rows.code if _parts_stamps(rows, at)]) if found is None else found
    if found is None:
        return None
    what = f"{stated_columns.named(layout, found)} may tell {len(rows.names[found])} devices apart whose rows "
    what += "are read as those of one"
    fix = _fix(layout, found, options, clock=False)
    finding = Finding(kind="devices-mixed", severity=Severity.WARNING, what=what, fix=f"if it does, {fix}")
    return Mixed(column=found, finding=finding)


def _other_columns(layout: Layout, recipe: Recipe) -> list[int]:
    """Columns that are neither the time nor measured."""
    used = {*recipe.time.columns, *(channel.column for channel in recipe.channels.values())}
    numbered = {column - 1 for column in used if isinstance(column, int)}
    return [
        at for at, name in enumerate(layout.names)
        if at not in numbered and not (name and name in used) and not names_time(name) and not understand(name).quantity
    ]  # fmt: skip


def _sampled(
    source: TextFile, recipe: Recipe, columns: Sequence[int], time: Instants, line: NDArray[np.int64]
) -> _Rows:
    """Rows evenly over the file."""
    every = max(1, len(line) // _SAMPLE)
    wanted = dict(zip(line[::every].tolist(), time[::every].tolist(), strict=True))
    cells: dict[int, list[str]] = {at: [] for at in columns}
    kinds: dict[int, set[str]] = {at: set() for at in columns}
    kept: list[int] = []
    for where, block in RowReader(source, recipe.file).rows(1 + max(columns, default=0)):
        for number, row in zip(where.tolist(), block, strict=True):
            if number not in wanted:
                continue
            kept.append(wanted[number])
            for at in list(cells):
                cell = row[at].strip()
                cells[at].append(cell)
                kinds[at].add(cell)
                if len(kinds[at]) > _MOST:
                    del cells[at]
    return _coded(np.array(kept, dtype=np.int64), cells)


def _first(layout: Layout, columns: Sequence[int], time: Instants, line: NDArray[np.int64]) -> _Rows:
    """The first rows of the file."""
    at = dict(zip(line.tolist(), time.tolist(), strict=True)) if len(line) <= len(layout.rows) else None
    if at is None:
        head = line <= layout.lines[-1]
        at = dict(zip(line[head].tolist(), time[head].tolist(), strict=True))
    kept = [index for index, number in enumerate(layout.lines) if number in at]
    cells = {column: [layout.rows[index][column].strip() for index in kept] for column in columns}
    return _coded(np.array([at[layout.lines[index]] for index in kept], dtype=np.int64), cells)


def _coded(time: Instants, cells: Mapping[int, Sequence[str]]) -> _Rows:
    """The columns of two to `_MOST` names, none of them empty."""
    code: dict[int, NDArray[np.int64]] = {}
    names: dict[int, tuple[str, ...]] = {}
    for at, column in cells.items():
        kinds = sorted(set(column))
        measured = all(_MEASURED.fullmatch(kind) for kind in kinds) or _ANSWERS.issuperset(map(str.lower, kinds))
        if 2 <= len(kinds) <= min(_MOST, len(column) // _NAMED) and "" not in kinds and not measured:
            number = {kind: index for index, kind in enumerate(kinds)}
            code[at] = np.array([number[cell] for cell in column], dtype=np.int64)
            names[at] = tuple(kinds)
    return _Rows(time=time, code=code, names=names)


def _steps(rows: _Rows, at: int) -> NDArray[np.int64]:
    """The steps of time within each device of a column [ns], one device behind the other."""
    code = rows.code[at]
    order = np.argsort(code, kind="stable")
    return np.diff(rows.time[order])[np.diff(code[order]) == 0]


def _each_rises(rows: _Rows, at: int) -> bool:
    """Whether no device's time runs back, and most rows lie in the time of another device."""
    if bool(np.any(_steps(rows, at) < -JITTER)):
        return False
    code, time = rows.code[at], rows.time
    within = np.zeros(len(time), dtype=bool)
    for device in range(len(rows.names[at])):
        own = time[code == device]
        within |= (code != device) & (time >= own.min()) & (time <= own.max())
    return float(within.mean()) >= _AT_ONCE or _follow(rows, at)


def _follow(rows: _Rows, at: int) -> bool:
    """Whether names of letters follow each other, time runs back where they change, and the shorter lies in the longer.

    So a long table of several stations looks that was cut in the second one. Names of zones change with the clock.
    """
    code, time, names = rows.code[at], rows.time, rows.names[at]
    changes = np.flatnonzero(np.diff(code))
    back = np.flatnonzero(np.diff(time) < -JITTER)
    worded = all(any(map(str.isalpha, name)) and name.upper() not in {*ABBREVIATED, *SEVERAL} for name in names)
    if len(names) != 2 or not worded or len(changes) != 1 or not np.array_equal(changes, back):
        return False
    first, second = time[: changes[0] + 1], time[changes[0] + 1 :]
    shorter, longer = sorted((first, second), key=len)
    return float(((shorter >= longer[0]) & (shorter <= longer[-1])).mean()) >= _INSIDE


def _parts_stamps(rows: _Rows, at: int) -> bool:
    """Whether rows share their stamps, and those of one device do not."""
    return float((np.diff(rows.time) == 0).mean()) >= _SHARED * 0.9 and not bool(np.any(_steps(rows, at) == 0))


def _in_turn(layout: Layout, rows: _Rows, at: int) -> bool:
    """Whether names, of letters, follow each other in one order, row by row."""
    names, code = rows.names[at], rows.code[at]
    count = len(names)
    worded = all(any(letter.isalpha() for letter in name) for name in names) and compass_unit(layout, at) is None
    if not worded or len(code) < _TURNS * count or len(set(code[:count].tolist())) < count:
        return False
    changes = float((np.diff(code) != 0).mean())  # a name that most rows have is no turn
    return changes >= _STRICT and float((code[count:] == code[:-count]).mean()) >= _STRICT


def _best(layout: Layout, rows: _Rows, columns: Sequence[int]) -> int | None:
    """Of several columns one with words, of few names, on the left."""

    def rank(at: int) -> tuple[bool, int, int]:
        worded = all(any(letter.isalpha() for letter in name) for name in rows.names[at])
        return not worded, len(rows.names[at]), at

    return min(columns, key=rank, default=None)


def _tells(layout: Layout, rows: _Rows, at: int) -> str:
    names = rows.names[at]
    shown = ", ".join(names[:_NAMED]) + (", …" if len(names) > _NAMED else "")
    return f"{stated_columns.named(layout, at)} tells {len(names)} devices apart ({shown})"


def _fix(layout: Layout, at: int, options: WindOptions, *, clock: bool) -> str:
    """The line of columns that reads each device by itself, and what else the rows may be."""
    if options.columns is not None:
        line = f'say which column tells them apart: --columns "{stated_columns.with_site(options.columns, at)}"'
    else:
        time = find_time(layout, order=options.date_order)
        line = offered_columns.offer(replace(layout, site=at), time, _winds(layout, time, options))
    line += "" if options.wind is None else ", in place of --wind"
    if not clock:
        return line
    return (
        f"{line}; if they are of one device whose clock was set anew, say whose stamps are right: --clock first "
        "(before it) or --clock last (after it); if its rows are only out of order: --clock sort"
    )


def _winds(layout: Layout, time: TimeChoice | None, options: WindOptions) -> Sequence[Wind]:
    """The wind that the user names, be it one by that word alone; else all that the headings tell."""
    columns = time.columns if time is not None else ()
    winds, _, _ = find_winds(layout, time=columns, told=options.unit)
    if options.wind is None:
        return winds
    named = [wind for wind in winds if wind.label == options.wind]
    return named or named_wind(layout, options.wind, time=columns, told=options.unit)[0] or winds
