"""Which columns of a table are its time, and in which of some forty forms: all that fit, never the
likelier one."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from flagdata.ingest.anemometer.draft.heading_words import Meaning, words_of
from flagdata.ingest.anemometer.draft.table_shape import TableShape, is_number
from flagdata.ingest.anemometer.instants import stamp_text
from flagdata.ingest.anemometer.instants.dates import is_time_of_day, parse
from flagdata.ingest.anemometer.instants.stamp_text import Stamps
from flagdata.timebase import iso

_CLOCKS = ("%H:%M:%S%f", "%H:%M", "%I:%M:%S%f %p", "%I:%M %p", "%H%M%S", "%H%M", "%H")
_DATES = (
    "%Y-%m-%d",
    "%Y/%m/%d",
    "%Y.%m.%d",
    "%Y%m%d",
    "%d.%m.%Y",
    "%d/%m/%Y",
    "%m/%d/%Y",
    "%d-%m-%Y",
    "%m-%d-%Y",
    "%d.%m.%y",
    "%d/%m/%y",
    "%m/%d/%y",
    "%d %b %Y",
    "%d-%b-%Y",
    "%b %d %Y",
    "%Y %j",
)
_WHOLE = ("iso", "%Y%m%d%H%M%S", "%Y%m%d%H%M", "%Y%m%dT%H%M%S%z")
_UNITS_OF_A_COUNT = re.compile(r"\d{9,19}([.,]\d+)?|\d([.,]\d+)?[eE]\+?\d{1,2}")
_OTHER_ORIGINS = words_of(
    "gps gpst tow tai labview 1900 1904 1980 2000 j2000 ntp filetime ticks datenum matlab excel "
    "julian jd mjd"
)
"""Words of a heading that speak of a count from another instant than the beginning of 1970."""
_FITS = 0.95
"""Share of the stamps that a form must read."""
_ORDER = {"%d": "d", "%m": "m", "%Y": "y", "%y": "y"}
_LOOK = 3
"""Stamps that a form is tried on first."""
_CLOCK = re.compile(r"\d:\d\d")


@dataclass(frozen=True, kw_only=True)
class TimeFields:
    """The time of a table.

    Attributes:
        columns: their indices; they are joined with a blank.
        forms: all that fit; one where nothing is open, none where the columns are no time that is
            known.
        zoned: whether the stamps state their zone.
        utc: whether a heading says that they are of UTC.
        evidence: what shows the form.
    """

    columns: tuple[int, ...]
    forms: tuple[str, ...]
    zoned: bool = False
    utc: bool = False
    evidence: str = ""

    @property
    def form(self) -> str | None:
        return self.forms[0] if len(self.forms) == 1 else None


def find_time(
    shape: TableShape, meanings: Sequence[Meaning], order: str | None
) -> TimeFields | None:
    """Finds the time of a table, by its headings and its cells; `None` where no column reads as
    one.

    A time of day is none beside a date that does not read: its days would be lost.

    Args:
        order: of dates of numbers alone, as the user gives it.
    """
    dates = [i for i, meaning in enumerate(meanings) if meaning.kind == "date"]
    times = [i for i, meaning in enumerate(meanings) if meaning.kind == "time"]
    unnamed = [
        i for i, meaning in enumerate(meanings) if meaning.kind == "other" and not shape.names[i]
    ][:2]
    choices = [(d, t) for d in dates for t in times] + [(i,) for i in (*times, *dates, *unnamed)]
    choices += [(i, i + 1) for i in unnamed if i + 1 in unnamed]
    for columns in choices:
        time = of_columns(shape, columns, order)
        dated = not dates or any(i in dates for i in columns)
        if time is not None and (dated or not any(map(is_time_of_day, time.forms))):
            utc = any(meanings[i].utc for i in columns)
            return TimeFields(
                columns=columns, forms=time.forms, zoned=time.zoned, utc=utc, evidence=time.evidence
            )
    return None


def of_columns(
    shape: TableShape, columns: tuple[int, ...], order: str | None, form: str | None = None
) -> TimeFields | None:
    """Reads these columns as a time, in `form` or in all forms that fit; `None` where none does."""
    texts = [" ".join(row[i] for i in columns) for row in shape.rows]
    texts = [text for text in texts if text.strip()]
    forms = [form] if form is not None else _candidates(texts, columns)
    forms = [
        candidate for candidate in forms if form is not None or _reads_any(texts[:_LOOK], candidate)
    ]
    fitting = [
        candidate
        for candidate in forms
        if _reads(texts, candidate) and _has_order(candidate, order)
    ]
    if not fitting:
        return None
    distinct = _distinct(fitting, texts)
    read = parse(texts, distinct[0])[0]
    evidence = f"the first is {texts[0]!r}"
    swapped = [
        candidate
        for candidate in forms
        if _same_but_order(candidate, distinct[0]) and candidate not in fitting
    ]
    if len(distinct) == 1 and order is not None:
        evidence = f"the order {order} was given"
    elif len(distinct) == 1 and swapped:
        bad = next(text for text in texts if not _reads([text], swapped[0]))
        evidence = f"{bad!r} is a date in this order alone"
    return TimeFields(
        columns=columns, forms=distinct, zoned=bool(read.utc[read.valid].all()), evidence=evidence
    )


def of_another_origin(time: TimeFields, meanings: Sequence[Meaning]) -> bool:
    """Checks whether a count of Unix time stands below a heading that speaks of another origin."""
    words = {word for i in time.columns for word in meanings[i].plain.split()}
    return time.form in stamp_text.EPOCH and time.form not in words and bool(words & _OTHER_ORIGINS)


def counts_of(text: str) -> str:
    """Writes the date that a number is by each count since an origin that reads it; "" where none
    does."""
    read = {form: parse([text], form)[0] for form in (*stamp_text.EPOCH, *stamp_text.SERIAL)}
    dates = [
        f"{iso(int(stamps.ns[0])).removesuffix('Z')} as {form}"
        for form, stamps in read.items()
        if stamps.valid[0]
    ]
    return " or ".join(dates)


def unread_count(shape: TableShape, meanings: Sequence[Meaning]) -> str:
    """Describes what the first number may be that stands below the heading of a time and that no
    form reads."""
    for index, meaning in enumerate(meanings):
        cell = shape.rows[0][index]
        if meaning.kind not in ("time", "date") or not is_number(cell):
            continue
        if re.fullmatch(stamp_text.EXPONENT, cell):
            return (
                f"; {shape.shown(index)} begins with {cell!r}, which was rounded: export it with "
                "all its digits"
            )
        if dates := counts_of(cell):
            return f"; {shape.shown(index)} begins with {cell!r}, which would be {dates}"
    return ""


def _candidates(texts: Sequence[str], columns: tuple[int, ...]) -> list[str]:
    first = texts[0] if texts else ""
    if _UNITS_OF_A_COUNT.fullmatch(first):
        return [*stamp_text.EPOCH, *(form for form in _WHOLE if form != "iso")]
    dated = [f"{date} {clock}" for date in _DATES for clock in _CLOCKS]
    dated += _CLOCKS if len(columns) == 1 else ()
    return (
        [*_WHOLE, *dated]
        if len(columns) > 1 or _CLOCK.search(first)
        else [*_WHOLE, *dated, *_DATES]
    )


def _reads_any(texts: Sequence[str], form: str) -> bool:
    """Checks whether a form fits one of the first stamps by its letters, so that all are worth a
    look."""
    if "%" not in form:
        return bool(parse(list(texts), form)[0].valid.any())
    day = "%Y-%m-%d " if is_time_of_day(form) else ""
    expression = re.compile(stamp_text.pattern(f"{day}{form}"))
    return any(
        expression.fullmatch(f"{'1970-01-01 ' if day else ''}{text.strip()}") for text in texts
    )


def _reads(texts: Sequence[str], form: str) -> bool:
    stamps = parse(list(texts), form)[0]
    return bool(len(texts)) and float(stamps.valid.mean()) >= _FITS


def _letters(form: str) -> str:
    return "".join(_ORDER[part] for part in re.findall(r"%[dmYy]", form))


def _has_order(form: str, order: str | None) -> bool:
    """Checks whether a form has the order that the user gave; one without numbers of day and month
    has any."""
    letters = _letters(form)
    return order is None or len(letters) < 3 or letters == order


def _same_but_order(form: str, other_form: str) -> bool:
    return (
        form != other_form
        and sorted(_letters(form)) == sorted(_letters(other_form))
        and _letters(form) != _letters(other_form)
        and (re.sub(r"%[dmYy]", "", form) == re.sub(r"%[dmYy]", "", other_form))
    )


def _distinct(forms: Sequence[str], texts: Sequence[str]) -> tuple[str, ...]:
    """Drops the forms that read the same instants as one before, where both read any."""
    distinct: dict[str, Stamps] = {}
    for form in forms:
        read = parse(list(texts), form)[0]
        if not any(_same_instants(read, earlier) for earlier in distinct.values()):
            distinct[form] = read
    return tuple(distinct)


def _same_instants(first: Stamps, second: Stamps) -> bool:
    valid = first.valid & second.valid
    return bool(valid.any()) and bool((first.ns[valid] == second.ns[valid]).all())
