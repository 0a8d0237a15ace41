"""Logs whose rows carry no time at all, put on the clock that the user gives: a start and a rate.

A serial print, a tunnel's recording or a boat's stream of wind sentences without a clock can be
used where its owner knows when it began and how many readings a second the instrument sends. Rows
that were lost are not noticed: each loss moves all that follows.
"""

from __future__ import annotations

import csv
import datetime as dt
import io
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

from flagdata.core.findings import Finding, Severity
from flagdata.core.shell import command_line
from flagdata.errors import TimeError, UsageError
from flagdata.ingest.anemometer.draft.table_shape import TableShape, shape_of
from flagdata.ingest.anemometer.formats.log_formats import FORMATS, Format
from flagdata.ingest.anemometer.formats.serial_lines import NOTHING, split_stamp
from flagdata.ingest.anemometer.instants.stamp_text import ENGLISH, HOUR, NEXT_DAY
from flagdata.ingest.anemometer.sniffing import HEAD_LINES, SURE, Head
from flagdata.ingest.anemometer.text.cut_lines import cells_of_lines
from flagdata.ingest.anemometer.text.text_file import RATE_GIVEN, TableText, TextFile
from flagdata.timebase import NANOSECONDS, iso

_NUMBER = re.compile(r"\s*[-+]?(\d+([.,]\d*)?|[.,]\d+)\s*")
_WIND = re.compile(r"[$!](?P<key>[A-Z0-9]{2}(?:MWV,[^,]*,[RT]|MWD|VWR|VWT|MDA))")
_TIMED = re.compile(
    r"^\\|[$!][A-Z0-9]{2}(?:(?:ZDA|RMC|GGA),|GLL,(?:[^,]*,){4})(?P<time>[^,*]*\d{4}[^,*]*)"
)
_CLOCK_BEFORE = re.compile(
    r"\s*[\[(<\"]?(?:(?P<month>[A-Za-z]{3})\s+(?P<day>\d{1,2})\s+)?"
    r"(?P<time>\d{1,2}:\d{2}:\d{2}(?:[.,]\d{1,9})?)[\])>\"]?[\s,;>:-]+"
    r"(?(month)(?:\S+ [\w./-]+(?:\[\d+\])?: )?)(?P<rest>\S.*)$"
)
"""A time of day before a line, with a date without its year or none; and the host and program that
syslog writes."""
_TABLES = frozenset({"delimited", "host-stamped"})
"""Formats of tables, which have a way of their own."""

_CLOCK = "time (UTC), as given"
"""Heading of the instants that are counted."""


def add_times(
    source: TextFile, *, rate: float, start: int | None, columns: str | None = None
) -> TextFile:
    """Puts a time in every row of a file.

    Args:
        rate: readings a second.
        start: instant of the first reading [UTC ns].
        columns: what the columns of a table are, by the user's word; where it names no time, no
            column is one.

    Raises:
        UsageError: no start, or rows that say when they were.
    """
    where = str(source.path)
    if start is None:
        fix = "give the instant of the first reading: --start 2026-05-01T12:00:00+02:00"
        raise UsageError("a rate is given without a start", where=where, fix=fix)
    if start < 0:
        raise UsageError(
            f"the start {iso(start)} is before 1970, which a recording cannot hold",
            where="--start",
            fix="give one from 1970 on that stands for it",
        )
    lines = source.head(HEAD_LINES)
    if columns is not None:
        text, findings = _table(source, rate, start, where)
        return _file_of_lines(source, text, rate, start, findings)
    if sum(bool(_WIND.search(line)) for line in lines) and sum(
        line.startswith(("$", "!", "\\")) for line in lines
    ):
        _refuse_times(_runs(_all_lines(source)), where)
        text = [
            line
            for line in _sentences(source, rate, start)
            if _TIMED.search(line.partition(" ")[2]) is None
        ]
    else:
        _refuse_times(any(split_stamp(line)[0] for line in lines), where)
        stamped = list(_stamped_lines(source, rate, start))
        if not of_an_instrument(stamped[:HEAD_LINES]):
            text, findings = _table(source, rate, start, where)
            return _file_of_lines(source, text, rate, start, findings)
        text = stamped
    return _file_of_lines(source, text, rate, start)


def of_an_instrument(lines: Sequence[str]) -> bool:
    """Checks whether stamped lines are those of an instrument whose format is known."""
    head = Head(lines=tuple(lines))
    for name, form in FORMATS.usable():
        reader: Format = form()
        guess = None if name in _TABLES else reader.recognise(head)
        if guess is not None and guess.score >= SURE:
            return True
    return False


def has_clock_times(source: TextFile) -> bool:
    """Checks whether the lines are those of an instrument, each after a time of day without a date,
    and say no other time."""
    lines = [line for line in source.head(HEAD_LINES) if line.strip()]
    timed = [match for line in lines if (match := _CLOCK_BEFORE.match(line)) is not None]
    if (
        not timed
        or 2 * len(timed) < len(lines)
        or any(_TIMED.search(match["rest"]) for match in timed)
    ):
        return False
    return of_an_instrument([f"2000-01-01T{match['time']} {match['rest']}" for match in timed])


def year_alone(source: TextFile) -> str | None:
    """Finds the month and day of the first line, as 12-31, where the lines stand after dates
    without a year."""
    match = next(
        (
            match_of_clock
            for line in source.head(HEAD_LINES)
            if (match_of_clock := _CLOCK_BEFORE.match(line))
        ),
        None,
    )
    if match is None or not match["month"] or match["month"].lower() not in ENGLISH:
        return None
    return f"{ENGLISH.index(match['month'].lower()) + 1:02d}-{int(match['day']):02d}"


def _of_year(match: re.Match[str], before: dt.date, *, first: bool, where: str) -> dt.date:
    """Completes the date of a line that names its month and day.

    Args:
        before: of the line before, or of the first line as the user gives it.

    Raises:
        TimeError: no such month or day, or another one than the user gives.
    """
    name = match["month"].lower()
    month = ENGLISH.index(name) + 1 if name in ENGLISH else 0
    year = before.year + (month < before.month - 6)
    try:
        date = dt.date(year, month, int(match["day"]))
    except ValueError:
        message = f"{match['month']} {match['day']} is no day of {year}"
        raise TimeError(
            message, where=where, fix="give --date with the year in which the log began"
        ) from None
    if first and date != before:
        message = (
            f"the first line is of {match['month']} {match['day']}, not of {before.isoformat()}"
        )
        fix = f"give its day with its year, such as {command_line('--date', date)}"
        raise TimeError(message, where=where, fix=fix)
    return date


def add_date(source: TextFile, date: dt.date) -> TextFile:
    """Puts the date before the lines of an instrument, each after a time of day.

    Args:
        date: of the first line; the next day begins where the time of day falls by more than two
            hours.
    """
    text: list[str] = []
    day, last = date, ""
    for line in _all_lines(source):
        match = _CLOCK_BEFORE.match(line)
        if match is None:
            text.append(line)
            continue
        hour, _, rest = match["time"].replace(",", ".").partition(":")
        clock = f"{hour:0>2}:{rest}"
        if match["month"]:
            day = _of_year(match, day, first=not last, where=str(source.path))
        elif last and _of_day(clock) < _of_day(last) - NEXT_DAY:
            day += dt.timedelta(days=1)
        last = clock
        text.append(f"{day.isoformat()}T{clock} {match['rest']}")
    days = (day - date).days
    if year_alone(source):
        message = (
            f"dates without a year before each line; the first is of {date.isoformat()}, as given"
        )
        return TableText.of(source, text, [Finding.of("date-given", message)])
    message = (
        f"times of day before each line; the first is of {date.isoformat()}, as given, and {days} "
        "midnights follow"
    )
    finding = Finding.of("date-given", message)
    return TableText.of(source, text, [finding])


def _of_day(clock: str) -> int:
    """Returns the minute of "09:05:03.250" as nanoseconds since midnight."""
    return (60 * int(clock[:2]) + int(clock[3:5])) * HOUR // 60


def _file_of_lines(
    source: TextFile, text: Sequence[str], rate: float, start: int, findings: Sequence[Finding] = ()
) -> TextFile:
    """Returns the file with these lines, and the finding that says whose clock they are on beside
    others."""
    often = f"at {rate:g} Hz" if rate >= 1 else f"every {1 / rate:g} s"
    message = (
        f"its rows carry no time: counted {often} from {iso(start)}, as given; rows that were lost "
        "are not noticed"
    )
    return TableText.of(
        source, text, [Finding(kind=RATE_GIVEN, severity=Severity.WARNING, what=message), *findings]
    )


def _runs(lines: Iterable[str]) -> bool:
    """Checks whether lines of a stream state more than one time, as those of a clock do that does
    not stand still.

    A line with a TAG block states a time of its own.
    """
    times: set[str] = set()
    for number, line in enumerate(lines):
        timed = _TIMED.search(line)
        if timed is not None:
            times.add(timed["time"] or f"line {number}")
        if len(times) > 1:
            return True
    return False


def _refuse_times(has_times: bool, where: str) -> None:
    if has_times:
        raise UsageError(
            "the rows say when they were: --rate is not used", where=where, fix="leave it out"
        )


def _all_lines(source: TextFile) -> Iterator[str]:
    for _, lines in source.blocks():
        yield from lines


def _sentences(source: TextFile, rate: float, start: int) -> Iterator[str]:
    """Sentences with a stamp that moves on with each wind sentence of the most frequent kind."""
    keys = Counter(
        _key(match["key"])
        for line in _all_lines(source)
        if (match := _WIND.search(line)) is not None
    )
    main = keys.most_common(1)[0][0]
    count = -1
    for line in _all_lines(source):
        match = _WIND.search(line)
        count += match is not None and _key(match["key"]) == main
        if line.strip():
            yield f"{_stamp(start, max(count, 0), rate)} {line.strip()}"


def _key(text: str) -> str:
    """Returns talker, sentence and reference of a wind sentence, without its angle."""
    return re.sub(r",[^,]*,", ",", text)


def _stamped_lines(source: TextFile, rate: float, start: int) -> Iterator[str]:
    filled = (line for line in _all_lines(source) if line.strip(NOTHING))
    for count, line in enumerate(filled):
        yield f"{_stamp(start, count, rate)} {line.strip()}"


def _stamp(start: int, count: int, rate: float) -> str:
    return iso(start + round(count * NANOSECONDS / rate))


def _table(
    source: TextFile, rate: float, start: int, where: str
) -> tuple[list[str], list[Finding]]:
    """Puts a column of instants behind a table's own, whose numbers stay what they are; also
    reports what is not of the table."""
    layout = shape_of(source.head(HEAD_LINES))
    if layout is None:
        return _single(source, rate, start, where), []
    first = layout.lines[0]
    width = len(layout.names)
    rows: list[list[str]] = []
    left_out = 0
    for at, line in enumerate(_lines_from(source, first)):
        row = [cell.strip() for cell in cells_of_lines([line], layout.delimiter)[0]]
        if len(row) >= width and not any(row[width:]):
            rows.append([*_points(row[:width], layout), _stamp(start, at, rate)])
        else:
            left_out += 1
    findings: list[Finding] = []
    if left_out:
        message = (
            f"{left_out} lines have another number of columns than the table; left out, each "
            "counted as a reading"
        )
        findings.append(
            Finding(kind="malformed-lines", severity=Severity.ERROR, count=left_out, what=message)
        )
    names = [
        f"{name} [{unit.strip('[]()')}]" if unit else name
        for name, unit in zip(layout.names, layout.units, strict=True)
    ]
    return _written([*names, _CLOCK], rows), findings


def _single(source: TextFile, rate: float, start: int, where: str) -> list[str]:
    """Reads a column of numbers and nothing else, below its heading if it has one."""
    filled = [line.strip() for line in _all_lines(source) if line.strip()]
    heading = filled[0] if filled and not _NUMBER.fullmatch(filled[0]) else ""
    rows = filled[1:] if heading else filled
    if not rows or sum(bool(_NUMBER.fullmatch(row)) for row in rows) < 0.9 * len(rows):
        raise UsageError(
            "neither a table nor sentences of wind: --rate is not used",
            where=where,
            fix="leave it out",
        )
    cells = ([row.replace(",", "."), _stamp(start, at, rate)] for at, row in enumerate(rows))
    return _written([heading, _CLOCK], cells)


def _lines_from(source: TextFile, first: int) -> Iterator[str]:
    for number, lines in source.blocks():
        yield from (
            line for at, line in enumerate(lines, start=number) if at >= first and line.strip()
        )


def _points(row: Sequence[str], layout: TableShape) -> list[str]:
    """Cells with decimal points."""
    if layout.decimal == ".":
        return list(row)
    return [re.sub(r"^([-+]?\d+),(\d+)", r"\1.\2", cell) for cell in row]


def _written(names: Sequence[str], rows: Iterable[list[str]]) -> list[str]:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(names)
    writer.writerows(rows)
    return out.getvalue().splitlines()
