"""Times in several columns: year, month, day, hour and so on each in one of its own, or a date beside an hour."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from flagdata.errors import TimeError
from flagdata.ingest.anemometer.instants import counted, month_names
from flagdata.ingest.anemometer.instants.dates import Order, decide
from flagdata.ingest.anemometer.instants.midnight import parse_as
from flagdata.ingest.anemometer.text.cells import numbers
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.times import unnamed_columns
from flagdata.ingest.anemometer.times.timechoice import (
    TWO_DIGITS,
    YEAR,
    TimeChoice,
    fits,
    hours_and_minutes,
    share,
    time_choice,
    whole_numbers,
)
from flagdata.ingest.anemometer.words.headings import words_of

YEAR_HEADINGS = r"year|yyyy|yr|jahr|ann[ée]e|año|ano|anno|vuosi|jaar|år|rok|год"
"""Headings of years, whatever stands beside them."""
_WORDS = {
    "year": rf"{YEAR_HEADINGS}|yy|y|year month day .* yyyy",
    "month": r"month|monat|mois|mes|m[êe]s|mese|kuukausi|maand|måned|miesi[ąa]c|месяц|mon|mo",
    "day": r"day|dom|dy|tag|jour|d[ií]a|giorno|päivä|dag|dzie[ńn]|день",
    "doy": r"doy|jday|julian|day of year|julian day|julian date|yday|jd|j day|dayofyear|year ?day"
    r"|(?:decimal|dec) (?:day|doy)|day of year decimal|decimal day of year",
    "hour": r"hour|hours|hr|hrs|hh( 24)?|stunde|heure|hora|ora|tunti|uur|time|godzina|час|hour of day|hhmm|hour minute"
    r"|(?:hours? (?:and )?minutes?|time)(?: (?:as|in))? hhmm|hours? (?:and )?minutes?|[ecmp]st|utc|gmt|lst"
    r"|obs ?time|time obs|observation (?:time|hour)|obs ?hour|synoptic (?:time|hour)|(?:time|hour) of observation",
    "minute": r"minute|minutes|min|mins|minuto|минута|mm",
    "second": r"seconds?|sec|secs|ss|sekunde|seconde|segundo",
}
"""Headings of the parts of a time in columns of their own, wherever these stand."""
_SAYS_MINUTES = re.compile(r"hhmm|hours? (?:and )?minutes?")
"""Headings of hours and minutes in one number, though it may be small just after midnight."""
_BEHIND: dict[str, tuple[str, frozenset[str]]] = {
    "month": (r"mm?", frozenset({"year", "day"})), "day": (r"da|dd|d", frozenset({"month"})),
    "hour": (r"h", frozenset({"day", "doy"})), "minute": (r"mi|mn|m|mi format.*", frozenset({"hour"})),
    "second": (r"s", frozenset({"minute"})),
}  # fmt: skip
"""Headings that are of a part of a time only behind another part: they are short, or mean other things as well."""
_ZONES = (
    r"( (?:d[aeo] |de la |del |della )?(?:medi[cç][aã]o|medici[oó]n|observa[cç][aã]o|observaci[oó]n|leitura|lectura|"
    r"misura|osservazione|mesure|observation))?( utc| gmt| local| lst| hoa)?"
)
"""What may stand behind the heading of a part of a time: that it is the measurement's, and in which zone."""
_LIMITS = {
    "year": (0, 2100), "month": (1, 12), "day": (1, 31), "doy": (1, 367), "hour": (0, 24), "minute": (0, 59),
    "second": (0, 60),
}  # fmt: skip
_ROUNDED = 0.3
"""Hours by which a fraction of the day in two digits may be off."""
_ZONE_ALONE = re.compile(r"[ecmp]st|utc|gmt|lst|time")
"""Headings of a time of day that say neither hours nor minutes."""
_OR_LEAST = frozenset({"min", "mins", "mm"})
"""Headings of minutes that may as well be of minima or millimetres."""
_HOURS_OF_YEAR = re.compile(r"(?:hour|hr|hours) of (?:the )?year|hoy|hour of yr|year ?hour")
_OF_DAY = {
    "%G": (re.compile(r"(?:minute|minutes|min) (?:of|in) (?:the )?day|mod"), 1440),
    "%K": (re.compile(r"(?:second|seconds|sec|secs) (?:of|in) (?:the )?day|sod"), 86_400),
}
"""Headings of a time of day in one count, and the largest one."""
_ENDS = (
    "the hours run from 1 to 24: each is taken as the end of its hour, 24 as midnight; if they are numbers "
    "of hours that begin then, the times are an hour late"
)
_OF_YEAR = (
    "the days are taken as those of the year, since no column holds a month; if they are days of a month, the times "
    "are wrong: add a column of the month"
)
YEAR_LAST = re.compile(r"(0[1-9]|[12]\d|3[01])(0[1-9]|[12]\d|3[01])((?:19|20)\d\d)")
"""A date of eight digits whose year comes last."""
_SIX = re.compile(r"^\s*\d{6}(\d\d)?\s*$")
_TWO_BEHIND = re.compile(r"\d[T ,;_](\d{1,2})\s*$")
_DECIMAL = re.compile(r"^\s*\d{1,3}\.\d+\s*$")
_CLOCK = re.compile(r"^\s*\d{1,2}:\d{2}(:\d{2}([.,]\d+)?)?\s*([AaPp]\.?\s?[Mm]\.?)?\s*$")
CLOCKS = (
    "%H:%M:%S%f", "%H:%M", "%I:%M:%S %p", "%I:%M %p", "%I:%M:%S%p", "%I:%M%p", "%I:%M:%S%f %p", "%I:%M:%S%f%p",
    "%H%M%S", "%H%M", "%H.%M.%S%f", "%Hh%M", "%H h %M", "%H.%M", "%H", "%H:%M:%S%f%p", "%H:%M%p", "%H-%M-%S%f", "%H-%M",
    "%H:%M:%S:%L",
)  # fmt: skip
"""How a time of day may be written."""


def clocks_of(texts: Sequence[str], *, heading: str = "") -> tuple[str, ...]:
    """How the times of day behind dates may be written: one or two digits that are hours throughout are no minutes.

    Args:
        texts: stamps with their dates.
        heading: of their columns; one that says HHMM settles it.
    """
    behind = [_TWO_BEHIND.search(text) for text in texts if text.strip()]
    if not behind or _SAYS_MINUTES.search(" ".join(words_of(heading))):
        return CLOCKS
    if any(found is None or int(found[1]) > 24 for found in behind):
        return CLOCKS
    return ("%H",)


def choices(
    layout: Layout, columns: Sequence[Sequence[str]], *, dates: Sequence[int], order: Order | None
) -> Iterator[TimeChoice]:
    """Times in several columns.

    Args:
        columns: the cells of each, with decimal points.
        dates: columns that hold whole dates.
        order: of dates written with numbers only, as the user says.
    """
    columns = [_whole(cells) for cells in columns]
    for choice in _choices(layout, columns, dates, order):
        directives = (choice.form or "").split(" ")
        column = dict(zip(directives, choice.columns, strict=True)) if len(directives) == len(choice.columns) else {}
        if "%H" in column and _ends_of_hours([cell for cell in columns[column["%H"]] if cell]):
            yield replace(choice, remark=_ENDS)
        elif "%j" in column and _may_be_of_month(layout.names[column["%j"]], columns[column["%j"]]):
            yield replace(choice, remark=_OF_YEAR)
        else:
            yield choice


def _may_be_of_month(heading: str, cells: Sequence[str]) -> bool:
    """Whether days of the year stand below a mere "day" and may as well be those of a month that is not told."""
    return _fits("day", " ".join(words_of(heading)), "") and whole_numbers([c for c in cells if c], *_LIMITS["day"])


def _ends_of_hours(cells: Sequence[str]) -> bool:
    """Whether hours run from 1 to 24."""
    hours = numbers(cells).value
    return bool(np.any(hours == 24)) and not np.any(hours == 0)


def _choices(
    layout: Layout, columns: Sequence[Sequence[str]], dates: Sequence[int], order: Order | None
) -> Iterator[TimeChoice]:
    found = unnamed_columns.choice(layout, columns)
    if found is not None:
        yield found
    named = _named(layout, columns)
    yield from _counted(layout, columns, named, dates, order)
    yield from _of_parts(layout, columns, named, dates)
    yield from _by_heading(layout, columns)
    yield from _month_by_name(layout, columns)
    yield from _beside_dates(layout, columns, named, dates, order)


_SPELLED = {"y": "%y", "yyyy": "%Y", "yy": "%y", "mm": "%m", "dd": "%d", "hh": "%H", "ss": "%S"}


def _by_heading(layout: Layout, columns: Sequence[Sequence[str]]) -> Iterator[TimeChoice]:
    """Dates in digits whose heading spells their order, as YYMMDD, with the clock HHMMSS or HHMM in another column."""
    compact = ["".join(words_of(name)) for name in layout.names]
    clocks = [at for at, name in enumerate(compact) if re.fullmatch(r"hhmm(ss)?|time|hms", name)]
    for index, name in enumerate(compact):
        found = re.fullmatch(r"(?:date)?(yyyy|yy|mm|dd)(yyyy|yy|mm|dd)(yyyy|yy|mm|dd)", name)
        cells = [cell for cell in columns[index] if cell]
        if found is None or len({part[0] for part in found.groups()}) < 3 or not cells or not share(_SIX, cells):
            continue
        date = "".join(_SPELLED[part] for part in found.groups())
        for clock in clocks:
            yield from read(layout, columns, [index, clock], [f"{date} {form}" for form in CLOCKS], score=2.3)


def _month_by_name(layout: Layout, columns: Sequence[Sequence[str]]) -> Iterator[TimeChoice]:
    """A month's name with day, year and clock in the columns around it, as ctime and date write them."""
    for index, cells in enumerate(columns):
        filled = [cell for cell in cells if cell]
        if not filled or not share(month_names.ALONE, filled):
            continue
        for first, parts in ((index, ("%b", "%d", "clock", "%Y")), (index, ("%b", "%d", "%Y", "clock")),
                             (index - 1, ("%d", "%b", "%Y", "clock"))):  # fmt: skip
            taken = list(range(first, first + 4))
            if first < 0 or taken[-1] >= len(columns) or not share(YEAR, columns[first + parts.index("%Y")]):
                continue
            forms = [" ".join(form if part == "clock" else part for part in parts) for form in CLOCKS[:4]]
            yield from read(layout, columns, taken, forms, score=2.2)


def _whole(cells: Sequence[str]) -> Sequence[str]:
    """Whole numbers written as floats, such as 2026.0, without their ".0"."""
    filled = [cell for cell in cells if cell]
    if not filled or not all(re.fullmatch(r"\d+\.0?", cell) for cell in filled):
        return cells
    return [cell.partition(".")[0] for cell in cells]


def hour_alone(layout: Layout, columns: Sequence[Sequence[str]], index: int) -> bool:
    """Whether a column is the hour of a day and nothing more: its numbers are no minutes, nor hours and minutes."""
    if not _fits("hour", " ".join(words_of(layout.names[index])), ""):
        return False
    cells = [cell for cell in columns[index] if cell]
    return share(TWO_DIGITS, cells) and whole_numbers(cells, 0, 24) and not any(re.match(r"0\d\d", c) for c in cells)


def _fits(part: str, name: str, before: str) -> bool:
    """Whether a heading is of a part of a time; `before` is the part that the column before it is of, "" for none."""
    if re.fullmatch(rf"(?:{_WORDS[part]}){_ZONES}", name):
        return name not in _OR_LEAST or before == "hour"
    if part == "hour" and re.fullmatch(
        r"(?:hour|hours|hr|hrs) (?:ending|end|ended|beginning|begin|starting|start)", name
    ):
        return True
    short, parts = _BEHIND.get(part, ("", frozenset()))
    return before in parts and bool(re.fullmatch(rf"(?:{short}){_ZONES}", name))


def _named(layout: Layout, columns: Sequence[Sequence[str]]) -> Mapping[str, int]:
    """The first column of each part of a time by its heading, where its numbers are such."""
    found: dict[str, int] = {}
    before = ""
    maxima = any("max" in words_of(heading) for heading in layout.names)
    for index, heading in enumerate(layout.names):
        name = " ".join(words_of(heading))
        cells = [cell for cell in columns[index] if cell]
        of = ""
        for part in _WORDS:
            if not _fits(part, name, before) or (part == "minute" and name in _OR_LEAST and maxima):
                continue
            month = part == "month" and share(month_names.ALONE, cells)
            clock = part == "hour" and hours_and_minutes(cells)
            said = part == "hour" and _SAYS_MINUTES.search(name) is not None and hours_and_minutes(cells, said=True)
            if part not in found and (month or clock or said or whole_numbers(cells, *_LIMITS[part])):
                of = part
                found[part] = index
                found |= {"hour and minute": index} if said else {}
                break
        before = of
    if "year" in found and not {"month", "doy"} & set(found):
        # A day beside a year and no month is one of the year.
        found.pop("day", None)
        for index, heading in enumerate(layout.names):
            cells = [cell for cell in columns[index] if cell]
            if _fits("day", " ".join(words_of(heading)), "") and whole_numbers(cells, *_LIMITS["doy"]):
                return {**found, "doy": index}
    return found


def _counted(
    layout: Layout,
    columns: Sequence[Sequence[str]],
    named: Mapping[str, int],
    dates: Sequence[int],
    order: Order | None,
) -> Iterator[TimeChoice]:
    """The hour of the year beside a year, and the minute or second of the day beside a date."""
    for index, heading in enumerate(layout.names):
        name = " ".join(words_of(heading))
        cells = [cell for cell in columns[index] if cell]
        if "year" in named and _HOURS_OF_YEAR.fullmatch(name) and whole_numbers(cells, 0, 8784):
            yield from read(layout, columns, [named["year"], index], ["%Y %E"], score=2.2)
        for form, (words, most) in _OF_DAY.items():
            if not words.fullmatch(name) or not whole_numbers(cells, 0, most):
                continue
            if {"year", "doy"} <= set(named):
                yield from read(layout, columns, [named["year"], named["doy"], index], [f"%Y %j {form}"], score=2.2)
            if {"year", "month", "day"} <= set(named):
                taken = [named["year"], named["month"], named["day"], index]
                yield from read(layout, columns, taken, [f"%Y %m %d {form}"], score=2.2)
            for date in dates:
                try:
                    forms = [f"{date_form} {form}" for date_form in date_forms(layout, date, order)]
                except TimeError as error:
                    yield TimeChoice(
                        columns=(date, index), form=None, zone=None, zoned=False, score=2.5, doubt=error.what,
                        fix=error.fix,
                    )  # fmt: skip
                    continue
                yield from read(layout, columns, [date, index], forms, score=2.2)


def _of_parts(
    layout: Layout, columns: Sequence[Sequence[str]], named: Mapping[str, int], dates: Sequence[int]
) -> Iterator[TimeChoice]:
    """A year with its month and day or day of the year, in any order, and the time of day beside; or that alone."""
    if "year" not in named and not dates:
        yield from _without_year(layout, columns, named)
    year = "%Y" if "year" in named and any(len(cell) == 4 for cell in columns[named["year"]]) else "%y"
    dated = {"year", "month", "day"} <= set(named)
    ordinal = {"year", "doy"} <= set(named) and year == "%Y"
    if dated and not (ordinal and named["doy"] < min(named["month"], named["day"]) and "hour" not in named):
        month = "%b" if share(month_names.ALONE, columns[named["month"]]) else "%m"
        date, of_date = f"{year} {month} %d", [named[part] for part in ("year", "month", "day")]
    elif ordinal:
        whole = not share(_DECIMAL, columns[named["doy"]])
        date, of_date = f"%Y {'%j' if whole else '%J'}", [named["year"], named["doy"]]
        if not whole:
            if _says_the_fraction(columns, named):
                yield from read(layout, columns, [*of_date, named["hour"]], [f"{date} %H"], score=2.2)
            yield from read(layout, columns, of_date, [date], score=2.1)
            return
    elif {"hour", "minute"} <= set(named) and not {"year", "month", "doy"} & set(named):
        clock, of_clock = _clock(columns, named)
        yield from read(layout, columns, of_clock, [clock], score=1.0)
        return
    else:
        return
    clock, of_clock = _clock(columns, named)
    if clock == "%H" and _hours_or_minutes(layout, columns, of_date, named["hour"]):
        name = layout.names[named["hour"]]
        yield TimeChoice(
            columns=(*of_date, *of_clock), form=None, zone=None, zoned=False, score=2.2,
            doubt=f"the numbers of column {name!r} may be hours, or hours and minutes in one number",
            fix="say which by --columns: hour for hours, time[%H%M] for both in one number, beside year and day",
        )  # fmt: skip
        return
    if clock:
        yield from read(layout, columns, [*of_date, *of_clock], [f"{date} {clock}"], score=2.2)
        return
    for index, cells in enumerate(columns):
        filled = [cell for cell in cells if cell]
        if filled and index not in of_date and share(_CLOCK, filled):
            forms = [f"{date} {form}" for form in CLOCKS]
            yield from read(layout, columns, [*of_date, index], forms, score=2.1)
    yield from read(layout, columns, of_date, [date], score=0.9)


def _says_the_fraction(columns: Sequence[Sequence[str]], named: Mapping[str, int]) -> bool:
    """Whether a column of whole hours says what the fraction of the day of the year does, which is rounded more."""
    if "hour" not in named or not whole_numbers([cell for cell in columns[named["hour"]] if cell], 0, 24):
        return False
    day, hour = (numbers(columns[named[part]]).value for part in ("doy", "hour"))
    off = np.abs(day % 1 * 24 - hour % 24)
    off = off[np.isfinite(off)]
    return len(off) > 0 and bool(np.all(off <= _ROUNDED))


def _hours_or_minutes(
    layout: Layout, columns: Sequence[Sequence[str]], of_date: Sequence[int], hour: int
) -> bool:  # fmt: skip
    """Whether the numbers below a zone's name rise by one within one day, so that they may be its first minutes too."""
    if _ZONE_ALONE.fullmatch(" ".join(words_of(layout.names[hour]))) is None:
        return False
    cells = [cell for cell in columns[hour] if cell]
    days = {tuple(columns[at][row] for at in of_date) for row in range(len(columns[hour]))}
    return len(days) == 1 and len(cells) > 1 and bool(np.all(np.diff(numbers(cells).value) == 1))


def _without_year(layout: Layout, columns: Sequence[Sequence[str]], named: Mapping[str, int]) -> Iterator[TimeChoice]:
    """A month and day, or a day of the year, with the time of day beside and no year."""
    clock, of_clock = _clock(columns, named)
    if not clock:
        clocks = (
            at for at, cells in enumerate(columns) if (filled := [c for c in cells if c]) and share(_CLOCK, filled)
        )
        of_clock = list(itertools.islice(clocks, 1))
        texts = [cell for at in of_clock for cell in columns[at] if cell]
        clock = next((form for form in CLOCKS if texts and fits(counted.parse(texts, form))), "")
    if "doy" in named and share(_DECIMAL, [cell for cell in columns[named["doy"]] if cell]):
        yield from read(layout, columns, [named["doy"]], ["%J"], score=1.9)
    elif "doy" in named and clock:
        yield from read(layout, columns, [named["doy"], *of_clock], [f"%j {clock}"], score=1.9)
    elif {"month", "day"} <= set(named) and clock:
        month = "%b" if share(month_names.ALONE, columns[named["month"]]) else "%m"
        taken = [named["month"], named["day"], *of_clock]
        yield from read(layout, columns, taken, [f"{month} %d {clock}"], score=1.9)
    elif {"month", "day"} <= set(named) and "hour" not in named:
        month = "%b" if share(month_names.ALONE, columns[named["month"]]) else "%m"
        yield from read(layout, columns, [named["month"], named["day"]], [f"{month} %d"], score=0.85)


def _beside_dates(
    layout: Layout,
    columns: Sequence[Sequence[str]],
    named: Mapping[str, int],
    dates: Sequence[int],
    order: Order | None,
) -> Iterator[TimeChoice]:
    """A whole date in one column, and the hour, with minute and second or with its fraction, in others."""
    clock, of_clock = _clock(columns, named)
    if not of_clock:
        return
    for index in dates:
        if not clock:
            cell = next(filter(None, columns[of_clock[0]]))
            yield TimeChoice(
                columns=(index, *of_clock), form=None, zone=None, zoned=False, score=2.2,
                doubt=f"hours as {cell!r} may be hours and minutes, or hours with a fraction",
                fix='say which by --columns: "date,hour[%H.%M],wind_speed[m/s]" for minutes, hour[%Q] for a fraction',
            )  # fmt: skip
            continue
        try:
            forms = date_forms(layout, index, order)
        except TimeError as error:
            yield TimeChoice(
                columns=(index, *of_clock), form=None, zone=None, zoned=False, score=2.5, doubt=error.what,
                fix=error.fix,
            )  # fmt: skip
            continue
        yield from read(layout, columns, [index, *of_clock], [f"{form} {clock}" for form in forms], score=2.2)


def _clock(columns: Sequence[Sequence[str]], named: Mapping[str, int]) -> tuple[str, list[int]]:
    """The format of the time of day in columns of its parts, and these; "" where there is no hour."""
    if "hour" not in named:
        return "", []
    hours = columns[named["hour"]]
    if share(_DECIMAL, [cell for cell in hours if cell]):
        return _pointed(hours), [named["hour"]]
    if "hour and minute" in named or hours_and_minutes([cell for cell in hours if cell]):
        return "%H%M", [named["hour"]]
    if not share(TWO_DIGITS, [cell for cell in hours if cell]):
        return "", []
    form, taken = "%H", [named["hour"]]
    for part, directive in (("minute", "%M"), ("second", "%S%f")):
        if part not in named:
            break
        form, taken = f"{form} {directive}", [*taken, named[part]]
    return form, taken


def _pointed(cells: Sequence[str]) -> str:
    """Whether hours with a point are hours and minutes (9.30 is half past nine) or with a fraction (9.50 is).

    Where all could be minutes, it is what makes the rows more even; "" where that does not tell either.
    """
    parts = [cell.split(".") for cell in cells if cell]
    if any(len(part) != 2 or len(part[1]) != 2 or int(part[1]) > 59 for part in parts):
        return "%Q"
    minutes = {int(hour) * 60 + int(rest) for hour, rest in parts}
    decimals = {round(float(f"{hour}.{rest}") * 60) for hour, rest in parts}
    uneven = [len(set(np.diff(sorted(kind)).tolist())) for kind in (minutes, decimals)]
    return "" if uneven[0] == uneven[1] else "%H.%M" if uneven[0] < uneven[1] else "%Q"


def read(
    layout: Layout, columns: Sequence[Sequence[str]], taken: Sequence[int], forms: Sequence[str], *, score: float
) -> Iterator[TimeChoice]:
    """The time in these columns by the first of the formats that reads it."""
    texts = [" ".join(cells) for cells in zip(*(columns[index] for index in taken), strict=True) if all(cells)]
    for form in forms:
        found, _ = parse_as(texts, form)
        if fits(found):
            yield time_choice(layout, tuple(taken), form, found, score)
            return


def date_forms(layout: Layout, index: int, order: Order | None) -> tuple[str, ...]:
    """The formats in which the dates of a column may be written.

    Raises:
        TimeError: their numbers may be day and month, or month and day.
    """
    cells = layout.column(index)
    if any(month_names.DATE.match(cell) for cell in cells):
        return tuple(f"{day}{form}" for form in month_names.FORMS for day in ("", "%a "))
    named = ("%Y%m%d", "%Y%j", "%Y-%j", "%Y:%m:%d")
    together = _together(cells)
    try:
        decision = decide(together or cells, told=order or order_of(layout.names[index]), where="")
        numbered = decision.directives().replace("/", "") if together else decision.directives()
    except TimeError as error:
        if "may be" in error.what:
            raise
        return named
    return (*named, numbered)


def _together(cells: Sequence[str]) -> list[str]:
    """Dates of eight digits whose year comes last, 25082026, with signs between; none where the year comes first."""
    filled = [cell.strip() for cell in cells if cell.strip()]
    matches = [YEAR_LAST.fullmatch(cell) for cell in filled]
    if not filled or not all(matches) or fits(parse_as(filled, "%Y%m%d")[0]):
        return []
    return [YEAR_LAST.sub(r"\1/\2/\3", cell) for cell in filled]


def order_of(heading: str) -> Order | None:
    """The order of a date that its heading spells, as "DATE (MM/DD/YYYY)"."""
    found = re.search(r"\b(?P<first>dd?|mm?|yyyy)[-/. ](?P<second>mm?|dd?)[-/. ](?:y|dd?\b)", heading.lower())
    if found is None:
        return None
    known: dict[str, Order] = {"dm": "dmy", "md": "mdy", "ym": "ymd"}
    return known.get(found["first"][0] + found["second"][0])
