"""Which columns of an unknown table are its time, in what format, and in which zone."""

from __future__ import annotations

import itertools
import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from flagdata.errors import TimeError
from flagdata.ingest.anemometer import counted
from flagdata.ingest.anemometer.cells import Cell, numbers
from flagdata.ingest.anemometer.dates import Order, decide
from flagdata.ingest.anemometer.headings import names_time, understand, words_of, zone_of
from flagdata.ingest.anemometer.layout import Layout, cell_kind
from flagdata.ingest.anemometer.midnight import parse_with_bare_dates
from flagdata.ingest.anemometer.stamps import Stamps

_SHARE = 0.9
"""Share of rows that must fit for a column to be what it seems."""
CLOCKS = (
    "%H:%M:%S%f",
    "%H:%M",
    "%I:%M:%S %p",
    "%I:%M %p",
    "%I:%M:%S%p",
    "%I:%M%p",
    "%I:%M:%S%f %p",
    "%I:%M:%S%f%p",
    "%H%M%S",
    "%H%M",
    "%H.%M.%S",
    "%H",
)
"""How a time of day may be written."""
_MONTHS = ("%d{s}%b{s}%Y", "%d{s}%b{s}%y", "%Y{s}%b{s}%d")
_CLOCK_NAMES = frozenset({"time", "hhmm", "hhmmss", "hour", "hh", "hr", "uur"})
_DATE = re.compile(
    r"^\s*\d{1,4}[-/.]\d{1,2}[-/.]\d{1,4}\s*$|^\s*\d{1,2}[- /][A-Za-z]{3}[- /]\d{2,4}\s*$|^\s*(19|20)\d{6}\s*$"
)
_CLOCK = re.compile(
    r"^\s*\d{1,2}:\d{2}(:\d{2}([.,]\d+)?)?\s*([AaPp]\.?[Mm]\.?)?\s*$|^\s*\d{4} UTC\s*$|^\s*\d{1,2}\.\d{2}\.\d{2}\s*$"
)
_HALF = re.compile(r"^\s*[AaPp]\.?[Mm]\.?\s*$")
"""Before or after noon, in a column of its own."""
_DATE_AND_HOUR = re.compile(r"^\s*(19|20)\d{2}(0[1-9]|1[0-2])(0[1-9]|[12]\d|3[01])([01]\d|2[0-4])\s*$")
_STAMPLIKE = re.compile(
    r"\d[-/.:]\d{1,2}[-/.:]|\d[- /][A-Za-z]{3}[- /,]|[A-Za-z]{3}\s+\d|^\d{9}|^\d{8}[ T_-]|\d\s+\d{1,2}:"
)
"""What a cell must have in it to be a date and a time."""
_DAY_OF_WEEK = re.compile(r"\s*(Mon|Tue|Wed|Thu|Fri|Sat|Sun)", re.IGNORECASE)
_YEAR = re.compile(r"^\s*(19|20)\d\d\s*$")
_TWO_DIGITS = re.compile(r"^\s*\d{1,2}\s*$")
_SECONDS_OF_MINUTE = re.compile(r"^\s*\d{1,2}(\.\d*)?\s*$")
_DIGITS = re.compile(r"^\s*\d{1,4}\s*$")
_EPOCHS = ("epoch-s", "epoch-ms", "epoch-us", "epoch-ns")
_PARTS: tuple[tuple[str, str, int, int], ...] = (
    ("%m", r"mo|mm|month|monat", 1, 12), ("%d", r"d|da|dd|day|dom|tag", 1, 31),
    ("%H", r"h|hh( 24)?|hr|hour|stunde", 0, 23),
    ("%M", r"mi|min|mm|minute|m|mi format.*", 0, 59), ("%S%f", r"s|ss|sec|second|sekunde", 0, 60),
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class TimeChoice:
    """The time of a table.

    Attributes:
        columns: their indices; they are joined with a blank.
        form: as in a recipe's [time] format; `None` where two are possible.
        zone: that the heading states; `None` where it states none.
        zoned: whether the stamps state their zone themselves.
        doubt: what the rows do not tell; `None` where nothing is in doubt.
        fix: what the user can say.
        score: how well it fits, for the choice among several.
        counts: whether it counts from a start, by a unit that may not be known.
        unnamed: whether it is told by its numbers alone, since no line names the columns.
    """

    columns: tuple[int, ...]
    form: str | None
    zone: str | None
    zoned: bool
    score: float
    doubt: str | None = None
    fix: str | None = None
    counts: bool = False
    unnamed: bool = False


def find_time(layout: Layout, *, order: Order | None = None) -> TimeChoice | None:
    """The columns that are the time; `None` where there are none.

    Args:
        order: of dates written with numbers only, as the user says.
    """
    best: TimeChoice | None = None
    choices = list(_choices(layout, order))
    for choice in _without_false_epochs(layout, choices):
        if best is None or choice.score > best.score + 1e-9:
            best = choice
    return best


def time_as(layout: Layout, columns: tuple[int, ...], form: str) -> TimeChoice | None:
    """These columns as a time written as `form`; `None` where nine rows of ten are not.

    Raises:
        UsageError: see `stamps.pattern`.
    """
    texts = [" ".join(cells) for cells in zip(*(layout.column(index) for index in columns), strict=True)]
    texts = [text for text in texts if text.strip()]
    found = counted.parse(texts, form) if counted.is_time_of_day(form) else _parsed(texts, form)
    return _choice(layout, columns, form, found, 2.0) if _fits(found) else None


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
            ns = _parsed(_texts(layout, choice)[:20], choice.form).ns
            years = {
                1970 + int(value) for value in ns.astype("datetime64[ns]").astype("datetime64[Y]").astype(np.int64)
            }
            if min(abs(year - other) for year in years for other in dated) > 1:
                continue
        kept.append(choice)
    return kept


def _texts(layout: Layout, choice: TimeChoice) -> list[str]:
    return [" ".join(cells) for cells in zip(*(layout.column(index) for index in choice.columns), strict=True)]


def _parsed(texts: Sequence[str], form: str) -> Stamps:
    return counted.parse(texts, form) if form in counted.FORMS else parse_with_bare_dates(texts, form)[0]


def _choices(layout: Layout, order: Order | None) -> Iterator[TimeChoice]:
    columns = [layout.column(index) for index in range(layout.number_of_columns())]
    if layout.decimal == ",":
        columns = [[re.sub(r"^(\d+),(\d+)$", r"\1.\2", cell) for cell in column] for column in columns]
    dates, clocks = [], []
    halves = {at for at, cells in enumerate(columns) if (texts := [cell for cell in cells if cell])
              and _share(_HALF, texts)}  # fmt: skip
    for index, cells in enumerate(columns):
        texts = [cell for cell in cells if cell]
        if not texts:
            continue
        if _share(_DATE, texts):
            dates.append(index)
        elif _share(_CLOCK, texts) or (set(words_of(layout.names[index])[:1]) & _CLOCK_NAMES
                                       and _share(re.compile(r"^\d{1,6}$"), texts)):  # fmt: skip
            clocks.append(index)
        if index + 1 in halves:
            texts = _joined(columns, (index, index + 1))
        found = _whole(layout, _with_half((index,), halves), texts, order)
        if found is not None:
            yield found
    for date in dates:
        for clock in clocks:
            if clock == date:
                continue
            both = _with_half((date, clock), halves)
            texts = _joined(columns, both)
            found = _whole(layout, both, texts, order) if texts else None
            if found is not None:
                yield found
    days = [] if clocks else list(_days(layout, columns, dates, order))
    yield from days
    parts = _parts(layout, columns) or _unnamed_parts(layout, columns)
    if parts is not None:
        yield parts
    for index in clocks:
        clock = _with_half((index,), halves)
        texts = _joined(columns, clock)
        for form in CLOCKS[:4]:
            if _fits(counted.parse(texts, form)):
                yield _choice(layout, clock, form, counted.parse(texts, form), 1.0)
                break
    for index, cells in enumerate(columns):
        if not any(index in choice.columns for choice in days):
            yield from _counts(layout, index, [cell for cell in cells if cell])


def _with_half(columns: tuple[int, ...], halves: Collection[int]) -> tuple[int, ...]:
    """Columns of a time, with the one behind them that says whether it is before or after noon, if any."""
    return (*columns, columns[-1] + 1) if columns[-1] + 1 in halves else columns


def _joined(columns: Sequence[Sequence[str]], chosen: tuple[int, ...]) -> list[str]:
    rows = zip(*(columns[at] for at in chosen), strict=True)
    return [" ".join(cells) for cells in rows if all(cells)]


def _share(shape: re.Pattern[str], texts: Sequence[str]) -> bool:
    return sum(1 for text in texts if shape.match(text)) >= _SHARE * len(texts)


def _fits(found: Stamps) -> bool:
    return bool(len(found.valid)) and float(found.valid.mean()) >= _SHARE


def _choice(layout: Layout, columns: tuple[int, ...], form: str, found: Stamps, score: float) -> TimeChoice:
    names = [layout.names[index] for index in columns]
    zones = [zone for name in (*names, *(layout.units[index] for index in columns)) if (zone := zone_of(name))]
    zoned = bool(found.utc[found.valid].all())
    ns = found.ns[found.valid]
    varied = len(np.unique(ns)) / len(ns) if len(ns) > 1 else 1.0
    words = {word for name in names for word in words_of(name)}
    score += (0.6 if zoned else 0.3 if zones else 0.0) + 0.5 * any(map(names_time, names)) + varied
    score += 0.1 * bool(words & {"end"}) - 0.4 * bool(words & {"gust", "max", "min", "created", "updated", "start"})
    return TimeChoice(
        columns=columns, form=form, zone=None if zoned or not zones else zones[0], zoned=zoned, score=score
    )


def _whole(layout: Layout, columns: tuple[int, ...], texts: list[str], order: Order | None) -> TimeChoice | None:
    """Date and time in `texts`."""
    if not any(_STAMPLIKE.search(text) for text in texts[:5]):
        return None
    # 2023070100 is an hour of July 2023 before it is the Unix time of a day in 2034.
    hours = ("%Y%m%d%H",) if _share(_DATE_AND_HOUR, texts) else ()
    for form in (*hours, "iso", "epoch-s", "epoch-ms"):
        found, _ = parse_with_bare_dates(texts, form)
        if _fits(found):
            return _choice(layout, columns, form, found, 2.0)
    for form in ("epoch-us", "epoch-ns"):
        found = counted.parse(texts, form)
        if _fits(found):
            return _choice(layout, columns, form, found, 2.0)
    shape = next(re.sub(r"\d", "0", text.strip()) for text in texts if text.strip())
    zoned = "%z" if re.search(r"(Z|UTC|GMT|[+-]00(:?00)?)$", shape) and len(shape) > 12 else ""
    for form in _compact(shape):
        found, _ = parse_with_bare_dates(texts, form + zoned)
        if _fits(found):
            return _choice(layout, columns, form + zoned, found, 2.0)
    if re.search("[A-Za-z]{3}", re.sub(r"(UTC|GMT)$", "", shape)):
        if cell_kind(texts[0]) != "stamp":
            return None
        return _with_month_names(layout, columns, texts, zoned)
    order = order or _order_of(" ".join(layout.names[index] for index in columns))
    try:
        date = decide(texts, told=order, where="")
    except TimeError as error:
        if "may be" not in error.what:
            return None
        if "ymd" in error.fix:
            return TimeChoice(
                columns=columns, form=None, zone=None, zoned=False, score=2.5, doubt=error.what, fix=error.fix
            )
        found = next((f for f in _dated(texts, "%d", "%m", zoned) if f is not None), None)
        if found is None:
            return None
        form, stamps = found
        swapped = form.replace("%d", "%x").replace("%m", "%d").replace("%x", "%m")
        chosen = _choice(layout, columns, form, stamps, 2.0)
        return TimeChoice(
            columns=columns, form=None, zone=chosen.zone, zoned=chosen.zoned, score=chosen.score,
            doubt=f"dates may be {form!r} or {swapped!r}, and nothing in the first rows tells which",
            fix="say which number is the day: --date-order dmy or mdy",
        )  # fmt: skip
    for form in (f"{date.directives()}{gap}{clock}{zoned}" for gap in _gaps(shape) for clock in CLOCKS):
        found, _ = parse_with_bare_dates(texts, form)
        if _fits(found):
            return _choice(layout, columns, form, found, 2.0)
    return None


def _days(
    layout: Layout, columns: Sequence[Sequence[str]], dates: Sequence[int], order: Order | None
) -> Iterator[TimeChoice]:
    """Dates without a time of day, one a row: means of days."""
    for index in dates:
        texts = [cell for cell in columns[index] if cell]
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


def date_forms(layout: Layout, index: int, order: Order | None) -> tuple[str, ...]:
    """The formats in which the dates of a column may be written.

    Raises:
        TimeError: their numbers may be day and month, or month and day.
    """
    named = ("%Y%m%d", *(date.format(s=sign) for sign in "- /" for date in _MONTHS))
    try:
        numbered = decide(layout.column(index), told=order or _order_of(layout.names[index]), where="").directives()
    except TimeError as error:
        if "may be" in error.what:
            raise
        return named
    return (*named, numbered)


def _order_of(heading: str) -> Order | None:
    """The order of a date that its heading spells, as "DATE (MM/DD/YYYY)"."""
    found = re.search(r"\b(?P<first>dd?|mm?|yyyy)[-/. ](?P<second>mm?|dd?)[-/. ](?:y|dd?\b)", heading.lower())
    if found is None:
        return None
    known: dict[str, Order] = {"dm": "dmy", "md": "mdy", "ym": "ymd"}
    return known.get(found["first"][0] + found["second"][0])


def _gaps(shape: str) -> tuple[str, ...]:
    """What may stand between date and time."""
    found = re.match(r"0{1,4}[-/.]0{1,2}[-/.]0{1,4}([_,;-])0", shape)
    return (found[1],) if found else (" ",)


def _dated(texts: Sequence[str], first: str, second: str, zoned: str) -> Iterator[tuple[str, Stamps] | None]:
    parts = re.match(r"\s*\d{1,2}([-/.])\d{1,2}[-/.](\d{4}|\d{2})(?!\d)", texts[0])
    if parts is None:
        return
    year = "%Y" if len(parts[2]) == 4 else "%y"
    for clock in CLOCKS:
        form = f"{first}{parts[1]}{second}{parts[1]}{year} {clock}{zoned}"
        found, _ = parse_with_bare_dates(texts, form)
        yield (form, found) if _fits(found) else None


def _compact(shape: str) -> tuple[str, ...]:
    """Formats of stamps without signs between their numbers, by the number of digits."""
    bare = re.sub(r"(Z|UTC|GMT)$", "", shape)
    forms = {
        "00000000000000": "%Y%m%d%H%M%S%f", "000000000000": "%Y%m%d%H%M", "00000000T000000": "%Y%m%d %H%M%S%f",
        "00000000 000000": "%Y%m%d %H%M%S", "00000000 0000": "%Y%m%d %H%M", "00000000 00:00:00": "%Y%m%d %H:%M:%S%f",
        "00000000T0000": "%Y%m%d %H%M", "00000000_000000": "%Y%m%d_%H%M%S", "00000000 00:00": "%Y%m%d %H:%M",
        "00000000-000000": "%Y%m%d-%H%M%S", "00000000 00": "%Y%m%d %H", "00000000 0": "%Y%m%d %H",
    }  # fmt: skip
    known = forms.get(bare.split(".")[0])
    return (known,) if known else ()


def _with_month_names(layout: Layout, columns: tuple[int, ...], texts: Sequence[str], zoned: str) -> TimeChoice | None:
    dates = [form.format(s=sign) for sign in "- /" for form in _MONTHS] + ["%b %d %Y", "%b %d, %Y", "%d. %b %Y"]
    forms = [f"{date}{gap}{clock}{zoned}" for date in dates for gap in (" ", ":") for clock in CLOCKS[:6]]
    if _DAY_OF_WEEK.match(texts[0]):
        forms = [f"%a {form}" for form in ("%b %d %H:%M:%S%f %Y", *forms)]
    for form in forms:
        found, _ = parse_with_bare_dates(texts[:20], form)
        if _fits(found):
            return _choice(layout, columns, form, found, 2.0)
    return None


def _parts(layout: Layout, columns: Sequence[Sequence[str]]) -> TimeChoice | None:
    """Year, month, day, hour and so on in columns of their own, in this order; or year and day of the year."""
    names = [" ".join(words_of(name)) for name in layout.names]
    for index, name in enumerate(names):
        if not re.fullmatch(r"(y|yy|yyyy|yr|year|jahr|year month day .* yyyy)( utc)?", name) or not _whole_numbers(
            columns[index], 1990, 2100
        ):
            continue
        chosen, form = [index], "%Y"
        at = index + 1
        if at < len(names) and re.fullmatch(r"doy|jday|julian|jd|day of year|j day|julian day|yday", names[at]):
            if _part_at(names, columns, at + 1, _PARTS[0]) and _part_at(names, columns, at + 2, _PARTS[1]):
                at += 1
            else:
                chosen, form, at = [index, at], "%Y %j", at + 1
        for part in _PARTS if form == "%Y" else _PARTS[2:]:
            if not _part_at(names, columns, at, part):
                break
            chosen, form, at = [*chosen, at], f"{form} {part[0]}", at + 1
        clock = [cell for cell in columns[at] if cell] if at < len(names) else []
        beside = names[at] if at < len(names) else ""
        if "%H" not in form and re.fullmatch(r"(hhmm|time|hour minute)( utc)?", beside) and _share(_DIGITS, clock):
            chosen, form = [*chosen, at], f"{form} %H%M"
        elif form == "%Y %m %d" and clock and _share(_CLOCK, clock):
            known = next((found for found in CLOCKS if _fits(counted.parse(clock, found))), None)
            chosen, form = [*chosen, at], f"{form} {known}" if known else form
        if "%H" not in form and "%I" not in form:
            continue
        texts = [" ".join(cells) for cells in zip(*(columns[i] for i in chosen), strict=True)]
        found, _ = parse_with_bare_dates(texts, form)
        if _fits(found):
            return _choice(layout, tuple(chosen), form, found, 2.2)
    return None


def _unnamed_parts(layout: Layout, columns: Sequence[Sequence[str]]) -> TimeChoice | None:
    """Year, month, day, hour, minute and second side by side where no line names the columns.

    Whole numbers that are a year, a month, a day, an hour and a minute and rise from row to row are nothing else; what
    follows is a second only where it is written or moves as one, since a speed looks much the same.
    """
    if any(layout.names):
        return None
    for index, cells in enumerate(columns):
        if not _share(_YEAR, cells):
            continue
        chosen, form = [index], "%Y"
        for (directive, _, low, high), at in zip(_PARTS[:4], range(index + 1, len(columns)), strict=False):
            if not _share(_TWO_DIGITS, columns[at]) or not _whole_numbers(columns[at], low, high):
                break
            chosen, form = [*chosen, at], f"{form} {directive}"
        if "%M" not in form:
            continue
        after = chosen[-1] + 1
        if after < len(columns) - 1 and _seconds(columns[after], [columns[at] for at in chosen]):
            chosen, form = [*chosen, after], f"{form} %S%f"
        texts = [" ".join(row) for row in zip(*(columns[i] for i in chosen), strict=True)]
        found, _ = parse_with_bare_dates(texts, form)
        if _fits(found) and bool(np.all(np.diff(found.ns[found.valid]) >= 0)):
            return replace(_choice(layout, tuple(chosen), form, found, 2.2), unnamed=True)
    return None


def _seconds(cells: Sequence[str], before: Sequence[Sequence[str]]) -> bool:
    """Whether a column behind that of the minutes, which nothing names, is of the seconds."""
    if not _share(_SECONDS_OF_MINUTE, cells) or not _whole_numbers([cell.split(".")[0] for cell in cells], 0, 59):
        return False
    padded = any(len(cell) > 1 and cell[0] == "0" for column in before for cell in column)
    if padded and any(len(cell.split(".")[0]) < 2 for cell in cells):
        return False  # all of the date is written in two digits, this is not
    if any(re.match(r"0\d", cell) for cell in cells):
        return True
    stamps = list(zip(*before, strict=True))
    same = np.array([one == other for one, other in itertools.pairwise(stamps)], dtype=bool)
    steps = np.diff(numbers(cells).value)
    if same.any():
        return bool(np.all(steps[same] > 0))
    # Rows minutes apart: the second of a steady clock stays or drifts, a speed does not.
    return padded and len(steps) > 2 and bool(np.all(np.abs(steps) <= 2))


def _part_at(names: Sequence[str], columns: Sequence[Sequence[str]], at: int, part: tuple[str, str, int, int]) -> bool:
    if at >= len(names):
        return False
    return bool(re.fullmatch(rf"({part[1]})( utc)?", names[at])) and _whole_numbers(columns[at], part[2], part[3])


def _whole_numbers(cells: Sequence[str], low: int, high: int) -> bool:
    value = numbers(cells).value
    known = value[np.isfinite(value)]
    return len(known) >= _SHARE * len(cells) > 0 and bool(np.all((known >= low) & (known <= high)))


def _counts(layout: Layout, index: int, texts: list[str]) -> Iterator[TimeChoice]:
    """Serial days, and counts since a start."""
    name = layout.names[index]
    parsed = numbers(texts)
    if not texts or float((parsed.state == Cell.NUMBER).mean()) < _SHARE:
        return
    value = parsed.value[parsed.state == Cell.NUMBER]
    steps = np.diff(value)
    if len(value) < 2 or float((steps >= 0).mean()) < 0.9 or not np.any(steps > 0):
        return
    words = words_of(name)
    heading = understand(name, layout.units[index])
    if "wind" in heading.quantity and (heading.sure or not names_time(name)):
        return  # the s of m/s is none of seconds
    if set(words) & _PARTS_OF_DATES:
        return  # a part of a date, such as 12.75 h, counts from no start
    if names_time(name) and float(steps.max()) < 400:
        daily = float(np.median(steps[steps > 0])) > 0.5  # seconds of the day rise by one, days by fractions of one
        for form, low, high in () if daily else (("excel-days", 32_874.0, 73_050.0), ("datenum", 726_834.0, 767_010.0)):
            if bool(np.all((value > low) & (value < high))) and np.any(value % 1 != 0):
                yield _choice(layout, (index,), form, counted.parse(texts, form), 1.5)
                return
    told = (*words, *words_of(layout.units[index]))
    form = next((form for form, known in _COUNTERS if set(told) & known), None)
    if form is None and not (names_time(name) or words[:1] == ["t"]):
        return
    if value[0] < 0 or value[-1] * _SECONDS[form or "elapsed-ms"] > 3.2e8:
        return
    found = counted.parse(texts, form or "elapsed-s")
    choice = _choice(layout, (index,), form or "elapsed-s", found, 0.2)
    if form is None:
        usual = float(np.median(steps[steps > 0]))
        unit = "ms" if usual >= 5 and bool(np.all(value % 1 == 0)) else "s"
        likely = f"likely {unit}" if usual < _SLOW else "ms of a slow logger, or us of a fast one"
        yield TimeChoice(
            columns=(index,), form=None, zone=None, zoned=False, score=choice.score - 0.1, counts=True,
            doubt=f"column {name!r} counts in steps of {usual:g}, but its unit is not stated ({likely})",
            fix=f"say what it counts, elapsed-s, elapsed-ms or elapsed-us ({likely}), and --start TIME",
        )  # fmt: skip
        return
    yield choice


_COUNTERS: tuple[tuple[str, frozenset[str]], ...] = (
    ("elapsed-ms", frozenset({"ms", "millis", "milliseconds", "millisecond", "msec", "msecs"})),
    ("elapsed-us", frozenset({"us", "micros", "microseconds", "usec", "µs", "μs"})),
    ("elapsed-min", frozenset({"minutes", "mins", "minute"})),
    ("elapsed-s", frozenset({"s", "sec", "secs", "second", "seconds"})),
)
_PARTS_OF_DATES = frozenset({"hour", "hours", "hr", "day", "days", "doy", "jday", "julian", "year", "month"})
_SLOW = 5000.0
"""Steps of a count from which it is as likely of microseconds as of milliseconds."""
_SECONDS = {"elapsed-ms": 1e-3, "elapsed-us": 1e-6, "elapsed-min": 60.0, "elapsed-s": 1.0}
"""Seconds a count."""
