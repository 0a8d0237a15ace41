"""Which columns of an unknown table are its time, in what format, and in which zone."""

from __future__ import annotations

import itertools
import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import TimeError
from flagdata.ingest.anemometer.instants import counted, month_names
from flagdata.ingest.anemometer.instants.abbreviations import ABBREVIATED
from flagdata.ingest.anemometer.instants.dates import Order, decide
from flagdata.ingest.anemometer.instants.midnight import parse_as, parse_with_bare_dates
from flagdata.ingest.anemometer.instants.stamps import Stamps
from flagdata.ingest.anemometer.text.cells import Cell, numbers
from flagdata.ingest.anemometer.text.kinds import cell_kind
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.times import (
    count_units,
    dateparts,
    dates_beside,
    given_clock,
    months,
    rare_stamps,
    second_times,
    yearless_columns,
)
from flagdata.ingest.anemometer.times.dateparts import CLOCKS, clocks_of, date_forms, order_of
from flagdata.ingest.anemometer.times.timechoice import SHARE, TimeChoice, fits, hours_and_minutes, share, time_choice
from flagdata.ingest.anemometer.times.truncated import before_1970
from flagdata.ingest.anemometer.words.events import of_event
from flagdata.ingest.anemometer.words.headings import names_time, understand, words_of, zone_of

_CLOCK_NAMES = frozenset({"time", "hhmm", "hhmmss", "hour", "hh", "hr", "uur"})
_DATE = re.compile(
    rf"^\s*(?:[{month_names.LETTERS}]{{2,13}}\.?,?\s+)?\d{{1,4}}[-/.]\d{{1,2}}[-/.]\d{{1,4}}\s*$"
    r"|^\s*\d{1,2}[- /][A-Za-z]{3,9}[- /]\d{2,4}\s*$|^\s*(19|20)\d{6}\s*$"
    r"|^\s*(19|20)\d\d-?(?:[0-2]\d\d|3[0-6]\d)\s*$|^\s*(19|20)\d\d:\d{2}:\d{2}\s*$"
)
_CLOCK = re.compile(
    r"^\s*\d{1,2}:\d{2}(:\d{2}([.,]\d+|:\d{3})?)?\s*([AaPp]\.?\s?[Mm]\.?)?\s*$|^\s*\d{1,2} ?h ?\d{2}\s*$"
    r"|^\s*\d{4} UTC\s*$|^\s*\d{1,2}\.\d{2}\.\d{2}([.,]\d+)?\s*$"
)
_COLONS = re.compile(r"^\s*(19|20)\d\d:\d{2}:\d{2}[ T]")
"""Dates with colons, as cameras write them (EXIF)."""
_HALF = re.compile(r"^\s*[AaPp]\.?[Mm]\.?\s*$")
"""Before or after noon, in a column of its own."""
_ZONED = rf"(?:Z|UTC|GMT|{'|'.join(ABBREVIATED)}|(?:0:00|:00[.,]0+|[T ]0{{4,6}}|[APap][Mm]) ?[+-]00(?::?00)?)$"
"""How stamps end that state their zone, their digits as 0: an offset stands behind minutes, not behind an hour."""
_DATE_AND_HOUR = re.compile(r"^\s*(19|20)\d{2}(0[1-9]|1[0-2])(0[1-9]|[12]\d|3[01])([01]\d|2[0-4])\s*$")
_STAMPLIKE = re.compile(
    r"\d[-/.:]\d{1,2}[-/.:]|\d[- /][A-Za-z]{3,9}[- /,]|[A-Za-z]{3}\s+\d|^\d{9}|^\d{8}[ T_:-]|\d\s+\d{1,2}:"
)
"""What a cell must have in it to be a date and a time."""
_BLANKS = re.compile(r"\s*(?:\d{1,2} \d{1,2} (?:19|20)\d\d|(?:19|20)\d\d \d{1,2} \d{1,2}) \d{1,2}(?::\d{2}|\s*$)")
"""A date whose numbers are divided by blanks, and a clock or an hour."""
_DAY_OF_WEEK = re.compile(rf"\s*(?!{month_names.NAME}[-\s])[{month_names.LETTERS}]{{2,13}}\.?,?\s", re.IGNORECASE)
_MILLISECONDS = "%H:%M:%S:%L"
"""A clock with its milliseconds behind a colon, as LabVIEW's and .NET's programs write it."""
_EPOCHS = ("epoch-s", "epoch-ms", "epoch-us", "epoch-ns")


def find_time(layout: Layout, *, order: Order | None = None, told: bool = False) -> TimeChoice | None:
    """The columns that are the time; `None` where there are none.

    A column whose heading is of a special event, such as the last lightning, is none.

    Args:
        order: of dates written with numbers only, as the user says.
        told: whether the user says that the columns of the table are its time.
    """
    if (added := given_clock.index(layout)) is not None:
        return time_as(layout, (added,), "iso")
    best: TimeChoice | None = None
    events = set[int]() if told else {index for index, name in enumerate(layout.names) if of_event(name)}
    choices = [choice for choice in _choices(layout, order, events) if not events & set(choice.columns)]
    choices = [choice for choice in choices if not _hundredths(layout, choice)]
    choices = [
        replace(choice, score=choice.score - 2.0 * (1.0 - _filled(layout, choice)))
        for choice in _without_false_epochs(layout, choices)
    ]
    for choice in choices:
        if best is None or choice.score > best.score + 1e-9:
            best = choice
    if best is None:
        return None
    if best.form is not None:
        best = second_times.with_part_of_second(layout, second_times.settle(layout, best, choices), time_as)
    remark = best.remark or second_times.disagreement(layout, best, choices)
    return replace(best, remark=remark, others=second_times.left_out(layout, best, choices))


def event_stamps(layout: Layout) -> tuple[int, ...]:
    """The columns of stamps whose heading is of a special event, so that they are not the time of a row."""
    found: list[int] = []
    for index, name in enumerate(layout.names):
        texts = [cell for cell in layout.column(index) if cell and cell_kind(cell) != "missing"]
        stamps = _whole(layout, (index,), texts, "dmy") if texts and of_event(name) else None
        found += [] if stamps is None else [index]
    return tuple(found)


def _hundredths(layout: Layout, choice: TimeChoice) -> bool:
    """Whether a time is read as milliseconds behind a colon, and none has three digits: they may be hundredths."""
    if not (choice.form or "").endswith(_MILLISECONDS):
        return False
    return not any(re.search(r":\d{3}\s*$", text) for text in _texts(layout, choice))


def _filled(layout: Layout, choice: TimeChoice) -> float:
    """The share of rows that have something in a time's first column: one that few rows have is of something else."""
    cells = layout.column(choice.columns[0]) if choice.columns else []
    return sum(map(bool, cells)) / len(cells) if cells else 1.0


def time_as(layout: Layout, columns: tuple[int, ...], form: str) -> TimeChoice | None:
    """These columns as a time written as `form`; `None` where nine rows of ten are not.

    Raises:
        UsageError: see `stamps.pattern`.
    """
    texts = [" ".join(cells) for cells in zip(*(layout.column(index) for index in columns), strict=True)]
    texts = [text for text in texts if text.strip()]
    found, _ = parse_as(texts, form)
    return time_choice(layout, columns, form, found, 2.0) if fits(found) else None


def _without_false_epochs(layout: Layout, choices: Sequence[TimeChoice]) -> list[TimeChoice]:
    """The choices without those that count seconds since 1970 to another year than the dates in the same rows."""
    dated = {
        int(year[0])
        for choice in choices if not (choice.form or "").startswith("epoch")
        for text in _texts(layout, choice)[:20] if (year := re.search(r"(?<!\d)(?:19|20)\d\d(?!\d)", text))
    }  # fmt: skip
    kept: list[TimeChoice] = []
    for choice in choices:
        if dated and choice.form in _EPOCHS:
            ns = parse_as(_texts(layout, choice)[:20], choice.form)[0].ns
            years = {
                1970 + int(value) for value in ns.astype("datetime64[ns]").astype("datetime64[Y]").astype(np.int64)
            }
            if min(abs(year - other) for year in years for other in dated) > 1:
                continue
        kept.append(choice)
    return kept


def _texts(layout: Layout, choice: TimeChoice) -> list[str]:
    return [" ".join(cells) for cells in zip(*(layout.column(index) for index in choice.columns), strict=True)]


def _choices(layout: Layout, order: Order | None, events: Collection[int]) -> Iterator[TimeChoice]:
    columns = [layout.column(index) for index in range(layout.number_of_columns())]
    if layout.decimal == ",":
        columns = [[re.sub(r"^(\d+),(\d+)$", r"\1.\2", cell) for cell in column] for column in columns]
    dates, clocks = [], []
    halves = {at for at, cells in enumerate(columns) if (texts := [cell for cell in cells if cell])
              and share(_HALF, texts)}  # fmt: skip
    for index, cells in enumerate(columns):
        texts = [cell for cell in cells if cell]
        if not texts or index in events:
            continue
        year_last = names_time(layout.names[index]) and share(dateparts.YEAR_LAST, texts)
        if share(_DATE, texts) or dates_beside.in_words(texts) or year_last:
            dates.append(index)
        elif dateparts.hour_alone(layout, columns, index):
            continue
        elif share(_CLOCK, texts) or (set(words_of(layout.names[index])[:1]) & _CLOCK_NAMES
                                       and share(re.compile(r"^\d{1,6}$"), texts)):  # fmt: skip
            clocks.append(index)
        if index + 1 in halves:
            texts = _joined(columns, (index, index + 1))
        found = _whole(layout, _with_half((index,), halves), texts, order)
        if found is not None:
            yield found
    for date in dates:
        for clock in clocks:
            if clock == date or _of_other_zones(layout, date, clock, (*dates, *clocks)):
                continue
            both = _with_half((date, clock), halves)
            texts = _joined(columns, both)
            found = _whole(layout, both, texts, order) if texts else None
            if found is not None:
                yield found
    days = [] if clocks else list(_days(layout, columns, dates, order))
    yield from days
    if not dates and not clocks:
        yield from months.choices(layout, columns)
    yield from dateparts.choices(layout, columns, dates=dates, order=order)
    yield from dates_beside.choices(layout, columns, clocks, dates, order)
    if not dates:
        yield from yearless_columns.choices(layout, columns, clocks, order)
    for index in clocks:
        clock = _with_half((index,), halves)
        texts = _joined(columns, clock)
        for form in (*CLOCKS[:4], "%H.%M.%S%f", _MILLISECONDS):
            found, _ = parse_as(texts, form)
            if fits(found):
                yield time_choice(layout, clock, form, found, 1.0)
                break
    for index, cells in enumerate(columns):
        if not any(index in choice.columns for choice in days):
            counts = _counts(layout, index, [cell for cell in cells if cell])
            # Beside dates a number whose unit nothing tells is an hour, or that of the row: no seconds from a start.
            yield from (choice for choice in counts if not (choice.counts and choice.form is None and dates))


def _of_other_zones(layout: Layout, date: int, clock: int, others: Sequence[int]) -> bool:
    """Whether one of a date and a clock is said to be in a zone, as the other is not though a further column is."""
    said = {index: zone_of(layout.names[index]) for index in others}
    return said[date] != said[clock] and sum(zone is not None for zone in said.values()) > 1


def _with_half(columns: tuple[int, ...], halves: Collection[int]) -> tuple[int, ...]:
    """Columns of a time, with the one behind them that says whether it is before or after noon, if any."""
    return (*columns, columns[-1] + 1) if columns[-1] + 1 in halves else columns


def _joined(columns: Sequence[Sequence[str]], chosen: tuple[int, ...]) -> list[str]:
    rows = zip(*(columns[at] for at in chosen), strict=True)
    return [" ".join(cells) for cells in rows if all(cells)]


def _whole(layout: Layout, columns: tuple[int, ...], texts: list[str], order: Order | None) -> TimeChoice | None:
    """Date and time in `texts`."""
    if not texts:
        return None
    if share(_BLANKS, texts):
        return _blank_divided(layout, columns, texts, order)
    rare = rare_stamps.choice(layout, columns, texts, lambda usual: _whole(layout, columns, usual, order))
    if rare is not None:
        return rare
    if not any(_STAMPLIKE.search(text) or month_names.DATE.match(text) for text in texts[:5]):
        return None
    # 2023070100 is an hour of July 2023 before it is the Unix time of a day in 2034.
    hours = ("%Y%m%d%H",) if share(_DATE_AND_HOUR, texts) else ()
    for form in (*hours, "iso", "epoch-s", "epoch-ms"):
        found, _ = parse_with_bare_dates(texts, form)
        if fits(found):
            return time_choice(layout, columns, form, found, 2.0)
    if share(_COLONS, texts):
        return next((choice for clock in CLOCKS if (choice := time_as(layout, columns, f"%Y:%m:%d {clock}"))), None)
    for form in ("epoch-us", "epoch-ns"):
        found = counted.parse(texts, form)
        if fits(found):
            return time_choice(layout, columns, form, found, 2.0)
    shape = next(re.sub(r"\d", "0", text.strip()) for text in texts if text.strip())
    zoned = "%z" if re.search(_ZONED, shape) and len(shape) > 12 else ""
    if not zoned and len(shape) > 12 and re.search(r"\d ?[A-Z]{3,4}$", shape) and not re.search(r"[AP]M$", shape):
        zoned = "%Z"  # letters that mean several zones, as CST, IST and BST do
    shape = re.sub(rf" ?(?:{'|'.join(ABBREVIATED)})$", "", shape) if zoned else shape
    for form in _compact(shape):
        found, _ = parse_with_bare_dates(texts, form + zoned)
        if fits(found):
            return time_choice(layout, columns, form + zoned, found, 2.0)
    if re.search(rf"[{month_names.LETTERS}]{{3}}", re.sub(r"(UTC|GMT|[A-Z]{3,4})$", "", shape) if zoned else shape):
        if cell_kind(texts[0]) != "stamp":
            return None
        return _with_month_names(layout, columns, texts, zoned)
    heading = " ".join(layout.names[index] for index in columns)
    order = order or order_of(heading)
    try:
        date = decide(texts, told=order, where="")
    except TimeError as error:
        if "may be" not in error.what:
            return None
        if "ymd" in error.fix:
            return TimeChoice(
                columns=columns, form=None, zone=None, zoned=False, score=2.5, doubt=error.what, fix=error.fix
            )
        found = next((f for f in _dated(texts, "%d", "%m", zoned, heading) if f is not None), None)
        if found is None:
            return None
        form, stamps = found
        swapped = form.replace("%d", "%x").replace("%m", "%d").replace("%x", "%m")
        chosen = time_choice(layout, columns, form, stamps, 2.0)
        return TimeChoice(
            columns=columns, form=None, zone=chosen.zone, zoned=chosen.zoned, score=chosen.score,
            doubt=f"dates may be {form!r} or {swapped!r}, and nothing in the first rows tells which",
            fix="say which number is the day: --date-order dmy or mdy",
        )  # fmt: skip
    for form in (
        f"{date.directives()}{gap}{clock}{zoned}" for gap in _gaps(shape) for clock in clocks_of(texts, heading=heading)
    ):
        found, _ = parse_with_bare_dates(texts, form)
        if fits(found):
            return time_choice(layout, columns, form, found, 2.0)
    return None


def _blank_divided(
    layout: Layout, columns: tuple[int, ...], texts: list[str], order: Order | None
) -> TimeChoice | None:
    """Dates whose numbers are divided by blanks, as "01 12 2026 00:10"."""
    hyphened = [re.sub(r"^(\d{1,4}) (\d{1,2}) (\d{1,4})(?= )", r"\1-\2-\3", text.strip()) for text in texts]
    found = _whole(layout, columns, hyphened, order)
    if found is None or found.form is None:
        return found
    forms = [found.form.replace("-", " ")]
    if found.form == "iso":
        forms = [f"%Y %m %d {clock}" for clock in CLOCKS[:2]]
    form = next((form for form in forms if fits(parse_with_bare_dates(texts, form)[0])), None)
    return None if form is None else replace(found, form=form)


def _days(
    layout: Layout, columns: Sequence[Sequence[str]], dates: Sequence[int], order: Order | None
) -> Iterator[TimeChoice]:
    """Dates without a time of day, one a row: means of days. A row that is written twice is one."""
    first = dict(zip(reversed(layout.rows), reversed(range(len(layout.rows))), strict=True))
    for index in dates:
        cells = zip(layout.rows, columns[index], strict=True)
        texts = [cell for at, (row, cell) in enumerate(cells) if cell and first[row] == at]
        if len(texts) < 2 or len(set(texts)) < len(texts):
            continue
        try:
            forms = date_forms(layout, index, order)
        except TimeError as error:
            doubt, fix = error.what, error.fix
            yield TimeChoice(columns=(index,), form=None, zone=None, zoned=False, score=0.9, doubt=doubt, fix=fix)
            continue
        found = (choice for form in forms if (choice := time_as(layout, (index,), form)) is not None)
        yield from (replace(choice, score=0.9) for choice in itertools.islice(found, 1))


def _gaps(shape: str) -> tuple[str, ...]:
    """What may stand between date and time."""
    found = re.match(r"0{1,4}[-/.]0{1,2}[-/.]0{1,4}([_,;.-]+ ?)0", shape)
    return (found[1],) if found else (" ",)


def _dated(
    texts: Sequence[str], first: str, second: str, zoned: str, heading: str
) -> Iterator[tuple[str, Stamps] | None]:
    parts = re.match(r"\s*\d{1,2}([-/.])\d{1,2}[-/.](\d{4}|\d{2})(?!\d)", texts[0])
    if parts is None:
        return
    year = "%Y" if len(parts[2]) == 4 else "%y"
    for clock in clocks_of(texts, heading=heading):
        form = f"{first}{parts[1]}{second}{parts[1]}{year} {clock}{zoned}"
        found, _ = parse_with_bare_dates(texts, form)
        yield (form, found) if fits(found) else None


def _compact(shape: str) -> tuple[str, ...]:
    """Formats of stamps without signs between their numbers, by the number of digits."""
    bare = re.sub(r"(Z|UTC|GMT)$", "", shape)
    forms = {
        "00000000000000": "%Y%m%d%H%M%S%f", "000000000000": "%Y%m%d%H%M", "00000000T000000": "%Y%m%d %H%M%S%f",
        "00000000 000000": "%Y%m%d %H%M%S%f", "00000000 0000": "%Y%m%d %H%M", "00000000 00:00:00": "%Y%m%d %H:%M:%S%f",
        "00000000T0000": "%Y%m%d %H%M", "00000000_000000": "%Y%m%d_%H%M%S%f", "00000000 00:00": "%Y%m%d %H:%M",
        "00000000-000000": "%Y%m%d-%H%M%S%f", "00000000 00": "%Y%m%d %H", "00000000 0": "%Y%m%d %H",
        "00000000:0000": "%Y%m%d:%H%M", "00000000-00:00:00": "%Y%m%d-%H:%M:%S%f",
        "00000000_00:00:00": "%Y%m%d_%H:%M:%S%f", "00000000-000000-000": "%Y%m%d-%H%M%S-%L",
        "00000000_000000_000": "%Y%m%d_%H%M%S_%L",
        "00000000_000000_000000": "%Y%m%d_%H%M%S_%U", "00000000-000000000": "%Y%m%d-%H%M%S%L",
        "00000000_000000000": "%Y%m%d_%H%M%S%L", "00000000000000000": "%Y%m%d%H%M%S%L",
        "00000000:000000": "%Y%m%d:%H%M%S%f", "00000000_0000": "%Y%m%d_%H%M",
    }  # fmt: skip
    if re.match(r"0{8} 00\.00\.00(?:\.|$)", bare):
        return ("%Y%m%d %H.%M.%S%f",)
    known = forms.get(bare.split(".")[0])
    return (known,) if known else ()


def _with_month_names(layout: Layout, columns: tuple[int, ...], texts: Sequence[str], zoned: str) -> TimeChoice | None:
    gaps = [gap for gap in (" ", ":", ", ") if gap == " " or any(re.search(rf"\d{gap}", text) for text in texts[:20])]
    forms = [f"{date}{gap}{clock}{zoned}" for date in month_names.FORMS for gap in gaps for clock in CLOCKS[:6]]
    if _DAY_OF_WEEK.match(texts[0]):
        clocks = ("%H:%M:%S%f", "%H:%M:%S%f%z", "%I:%M:%S%f %p", "%I:%M:%S%f %p%z", "%H:%M:%S%f%Z")
        forms = [f"%a {form}" for form in (*(f"%b %d {clock} %Y" for clock in clocks), *forms)]
    for form in forms:
        found, _ = parse_with_bare_dates(texts[:20], form)
        if fits(found):
            return time_choice(layout, columns, form, found, 2.0)
    return None


def _counts(layout: Layout, index: int, texts: list[str]) -> Iterator[TimeChoice]:
    """Serial days, days of years of two digits, and counts since a start."""
    name = layout.names[index]
    parsed = numbers(texts)
    if not texts or float((parsed.state == Cell.NUMBER).mean()) < SHARE:
        return
    value = parsed.value[parsed.state == Cell.NUMBER]
    steps = np.diff(value)
    if len(value) < 2 or float((steps >= 0).mean()) < 0.9 or not np.any(steps > 0):
        return
    words = words_of(name)
    if set(words) & _YEAR_AND_DAY and (days := time_as(layout, (index,), "%y%j")) is not None:
        yield replace(days, score=0.9)
        return
    if before_1970(texts):
        return
    heading = understand(name, layout.units[index])
    if "wind" in heading.quantity and (heading.sure or not names_time(name)):
        return  # the s of m/s is none of seconds
    if _hours_of_a_day(words, name, texts, value):
        yield time_choice(layout, (index,), "elapsed-h", counted.parse(texts, "elapsed-h"), 0.1)
        return
    serial = counted.serial_days(value)
    if serial == "decimal-years" and (set(words) & _YEARS_AND_PARTS or names_time(name)):
        yield time_choice(layout, (index,), serial, counted.parse(texts, serial), 1.5)
        return
    if set(words) & count_units.DAYS and _by_parts_of_days(value):
        yield _without_unit(layout, index, texts, value, score=0.2)
        return
    if set(words) & _PARTS_OF_DATES:
        return  # a part of a date, such as 12.75 h, counts from no start
    if names_time(name) and float(steps.max()) < 400:
        daily = float(np.median(steps[steps > 0])) > 0.5  # seconds of the day rise by one, days by fractions of one
        for form, low, high in () if daily else counted.SERIAL_DAYS:
            if bool(np.all((value > low) & (value < high))) and np.any(value % 1 != 0):
                yield time_choice(layout, (index,), form, counted.parse(texts, form), 1.5)
                return
    own = words if names_time(name) or _LETTER.search(name) else [word for word in words if len(word) > 1]
    told = (*own, *words_of(layout.units[index]), *(["minutes"] if _IN_MINUTES.search(name) else []))
    form = next((form for form, known in _COUNTERS if set(told) & known), None)
    if form is None and not (names_time(name) or words[:1] == ["t"]):
        return
    if value[0] < 0 or value[-1] * _SECONDS[form or "elapsed-ms"] > 3.2e8:
        return
    found = counted.parse(texts, form or "elapsed-s")
    choice = time_choice(layout, (index,), form or "elapsed-s", found, 0.2)
    if form is None:
        if hours_and_minutes(texts) and (bool(np.any(steps < 0)) or value[-1] >= _LAST_HOUR):
            yield time_choice(layout, (index,), "%H%M", counted.parse(texts, "%H%M"), 0.1)
            return
        yield _without_unit(layout, index, texts, value, score=choice.score - 0.1)
        return
    yield choice


def _without_unit(
    layout: Layout, index: int, texts: Sequence[str], value: NDArray[np.float64], *, score: float
) -> TimeChoice:
    """A count whose unit its heading does not state, which is to be said."""
    steps = np.diff(value)
    name, usual = layout.names[index], float(np.median(steps[steps > 0]))
    digits = max(len(text.partition(".")[2]) if "e" not in text.lower() else _DIGITS for text in texts)
    likely = count_units.likely(value, digits=digits, words=words_of(name))
    return TimeChoice(
        columns=(index,), form=None, zone=None, zoned=False, score=score, counts=True, likely=likely.form,
        doubt=f"column {name!r} counts in steps of {usual:g}, but its unit is not stated ({likely.words})",
        fix=f"say what it counts, {', '.join(counted.UNITS)} ({likely.words}), and --start TIME",
    )  # fmt: skip


def _hours_of_a_day(words: Sequence[str], name: str, texts: Sequence[str], value: NDArray[np.float64]) -> bool:
    """Whether a column without a date counts the hours of one day: its heading is the hour, or 01, 02 … stand in it."""
    if not bool(np.all((value >= 0) & (value <= 24)) and np.all(np.diff(value) == 1)):
        return False
    if not all(re.fullmatch(r"\s*\d{1,2}\s*", text) for text in texts):
        return False
    return (bool(words) and set(words) <= _HOURS) or (
        names_time(name) and any(re.match(r"\s*0\d", text) for text in texts)
    )


def _by_parts_of_days(value: NDArray[np.float64]) -> bool:
    """Whether numbers of days of a year rise from row to row by parts of a day."""
    steps = np.diff(value)
    by_parts = bool(np.all(steps > 0)) and float(np.median(steps)) < 1 and bool(np.any(value % 1 != 0))
    return by_parts and 0 <= float(value[0]) < float(value[-1]) <= _DAYS


_COUNTERS: tuple[tuple[str, frozenset[str]], ...] = (
    ("elapsed-ms", frozenset({"ms", "millis", "milliseconds", "millisecond", "msec", "msecs"})),
    ("elapsed-us", frozenset({"us", "micros", "microseconds", "usec", "µs", "μs"})),
    ("elapsed-min", frozenset({"minutes", "mins", "minute"})),
    ("elapsed-s", frozenset({"s", "sec", "secs", "second", "seconds"})),
    ("elapsed-h", frozenset({"h", "hr", "hrs", "hour", "hours"})),
)
_YEAR_AND_DAY = frozenset({"date", "yyddd", "yrdoy", "yydoy"})
"""Words above a year of two digits and the day of it in one number, as tables of crop models have them (DSSAT)."""
_PARTS_OF_DATES = frozenset({"hour", "hours", "hr", "day", "days", "doy", "jday", "julian", "year", "month"})
_YEARS_AND_PARTS = frozenset({"decimal", "decyear", "dyear", "decdate", "decimalyear", "decimaldate"})
_HOURS = frozenset({"hour", "hours", "hr", "hrs", "h"})
_LETTER = re.compile(r"(?<![^\W_])[sh](?![^\W_])", re.IGNORECASE)
"""A letter that stands by itself in a heading, as a unit does; that of "HXI3S" is a part of a code."""
_IN_MINUTES = re.compile(r"[\[(]\s*min\.?\s*[\])]", re.IGNORECASE)
"""A unit behind a time; alone it may as well be a minimum."""
_DAYS = 732.0
"""Days of a year, and of one that runs on."""
_LAST_HOUR = 2300
"""Hours and minutes in one number, from which on a day is over: a count without a unit would not end there."""
_DIGITS = 6
"""Digits behind the point of numbers that are written with an exponent."""
_SECONDS = {"elapsed-ms": 1e-3, "elapsed-us": 1e-6, "elapsed-min": 60.0, "elapsed-s": 1.0, "elapsed-h": 3600.0}
"""Seconds a count."""
