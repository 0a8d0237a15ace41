"""From stamps as text to nanoseconds, in bulk: ISO 8601, Unix time and strptime directives.

Directives: %Y %y %m %d %j %H %I %p %M %S %b %a, and %f, which stands for an optional fraction with its mark ("" or
".5" or ",123456789"): loggers drop trailing zeros, so that 20 Hz stamps read 00.05, 00.1, 00.15. %z stands for an
optional offset from UTC ("Z", "UTC", "GMT", "+02:00", "+02", "CEST"), %Z for letters of a zone that are not read, %p
for "AM", "p.m." or a bare "a" or "p" (with %H it may be left out: 13:05 beside 1:05 PM), %a for a day of the week,
which is not read, %b for the name of a month, whole or short, in the languages of `month_names`. %Q is the hour with
its fraction, %J the day of the year with its own (1.5 is noon of 1 January); behind a clock only its day is read. %E is
the hour of the year since New Year, %G the minute and %K the second of the day, each with a fraction or none.
%s is Unix time in seconds; %L, %U and %N are the milli-, micro- and nanoseconds of a second in a number of their own
("12:00:01 50" with %L is 01.050). %D is a day numbered from a start that the user gives. Numbers between blanks may
end in ".0", as tables of floats have them. 24:00 is the midnight that ends a day (ISO 8601:2004, 4.2.3). A blank
stands for any run of blanks or a "T". Two-digit years are 1970 to 2069.
"""

# pyarrow.compute makes its functions at import, where a type checker cannot see them.
# pyright: reportAttributeAccessIssue=false
from __future__ import annotations

import functools
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
from numpy.typing import NDArray

from flagdata.errors import UsageError
from flagdata.ingest.anemometer.instants.abbreviations import ABBREVIATED
from flagdata.ingest.anemometer.instants.month_names import ENGLISH, LETTERS, NUMBERS
from flagdata.timebase import NANOSECONDS

DAY = 86_400 * NANOSECONDS
_GROUPS: dict[str, str] = {
    "Y": r"(?P<Y>\d{4})", "y": r"(?P<y>\d{2})", "m": r"(?P<m>\d{1,2})", "d": r"(?P<d>\d{1,2})", "j": r"(?P<j>\d{1,3})",
    "H": r"(?P<H>\d{1,2})", "I": r"(?P<I>\d{1,2})", "M": r"(?P<M>\d{1,2})", "S": r"(?P<S>\d{1,2})",
    "E": r"(?P<E>\d{1,4}(?:\.\d{0,9})?)", "G": r"(?P<G>\d{1,4}(?:\.\d{0,9})?)", "K": r"(?P<K>\d{1,5}(?:\.\d{0,9})?)",
    "s": r"(?P<s>\d{9,10})", "L": r"(?P<L>\d{1,3})", "U": r"(?P<U>\d{1,6})", "N": r"(?P<N>\d{1,9})",
    "D": r"(?P<D>\d{1,5})",
    "Q": r"(?P<Q>\d{1,2}(?:\.\d{1,9})?)", "J": r"(?P<J>\d{1,3}(?:\.\d{1,9})?)",
    "f": r"(?:[.,](?P<f>\d{1,9}))?", "p": r"(?P<p>[AaPp](?:\.?\s?[Mm]\.?)?)",
    "b": rf"(?P<b>[{LETTERS}]{{3,13}})\.?", "a": rf"(?:(?P<a>[{LETTERS}]{{2,13}})\.?,?)",
    "z": rf"\s*(?P<z>Z|UTC|GMT|{'|'.join(ABBREVIATED)}|[+-](?:0\d|1[0-5])(?::?[0-5]\d)?)?",
    "Z": r"\s*(?:[A-Z]{3,4})?",
}  # fmt: skip
_SAME = {"B": "b", "h": "b", "A": "a", "e": "d"}
"""Directives of C's strftime that others here read as well: a month's name may be whole or cut short."""
_CLOCK_RUN = re.compile(r"%H%M(?:%S)?")
_CLOCK_RUNS = {
    "%H%M": r"(?P<H>\d{0,2}?)(?P<M>\d{1,2})",
    "%H%M%S": r"(?P<H>\d{1,2})(?P<M>\d{2})(?P<S>\d{2})",
}
"""Clocks written as one number. Loggers leave out its zeros: 59 is 00:59, 100 is 01:00; of HHMMSS only the first."""
_NUMERIC = re.compile(r"%[YymdjHIMS]")
"""Directives of numbers; those with nothing between them have all their digits."""
_WHOLE = re.compile(r"%[YmdjHMSLUNsD](?= |$)")
"""Directives of whole numbers, where a blank or the end follows."""
_DECIMALS = (
    ("Q", 3600 * NANOSECONDS, 0.0, 24.0), ("E", 3600 * NANOSECONDS, 0.0, 8784.0),
    ("G", 60 * NANOSECONDS, 0.0, 1440.0), ("K", NANOSECONDS, 0.0, 86_400.0), ("J", DAY, 1.0, 367.0),
)  # fmt: skip
"""Directives of counts with a fraction: letter, length of one [ns], first and last. The day comes behind the clocks."""
_SUBSECONDS = {"L": 1_000_000, "U": 1_000, "N": 1}
"""Directives of parts of a second [ns]."""
_ISO = (
    r"^(?P<Y>\d{4})[-/](?P<m>\d{1,2})[-/](?P<d>\d{1,2})[T ]+(?P<H>\d{1,2}):(?P<M>\d{2})"
    r"(?::(?P<S>\d{2})(?:[.,](?P<f>\d{1,9}))?)?"
    rf"\s*(?P<z>Z|UTC|GMT|{'|'.join(ABBREVIATED)}|[+-](?:0\d|1[0-5])(?::?[0-5]\d)?)?$"
)
YEARS = (1970, 2200)
"""First and last year of a stamp that is taken for a date."""
_CENTURY = YEARS[0] % 100
"""The first year of two digits that is of the 1900s: no log is of the years to come, and some are of the 1990s."""
PLAIN_FORMS = ("iso", "%Y-%m-%d %H:%M:%S%f")
"""Forms of which 2021-05-14 00:00:00.05 is one."""
EPOCH = {"epoch-s": NANOSECONDS, "epoch-ms": 1_000_000}


@dataclass(frozen=True, kw_only=True)
class Stamps:
    """Parsed stamps, in the order of the rows.

    Attributes:
        ns: (n,) nanoseconds since 1970 of the wall clock, or of UTC where `utc`.
        utc: (n,) whether the stamp itself says its zone.
        valid: (n,) whether it could be read at all and is a calendar date within `YEARS`.
        distant: (n,) whether it is written as a stamp, but of a year outside `YEARS`: a clock that was never set.
        step: the resolution of the stamps as written [ns]: the last digit that is ever used.
    """

    ns: NDArray[np.int64]
    utc: NDArray[np.bool_]
    valid: NDArray[np.bool_]
    distant: NDArray[np.bool_]
    step: int


def whole_year(year: int) -> int:
    """The year of which `year` is the last two digits: 1970 to 2069."""
    return year + (2000 if year < _CENTURY else 1900)


@functools.cache
def pattern(form: str) -> str:
    """The regular expression of a format.

    Raises:
        UsageError: an unknown directive, one given twice, or no whole date in it. A date alone is its midnight.
    """
    if form == "iso":
        return _ISO
    out: list[str] = []
    used: list[str] = []
    position = 0
    while position < len(form):
        letter = form[position]
        if letter == "%":
            directive = form[position + 1 : position + 2]
            directive = _SAME.get(directive, directive)
            if directive == "p" and "%H" in form:
                used.append("p")
                out.append(rf"(?:\s*{_GROUPS['p']})?")
                position += 2
                continue
            if directive not in _GROUPS:
                raise UsageError(
                    f"unknown directive %{directive}", where=f"time format {form!r}",
                    fix=f"use {' '.join('%' + g for g in _GROUPS)}, iso, epoch-s or epoch-ms",
                )  # fmt: skip
            run = _CLOCK_RUN.match(form, position)
            if run is not None and (position == 0 or form[position - 1] == " "):
                used.extend(run[0].replace("%", ""))
                out.append(_CLOCK_RUNS[run[0]])
                position = run.end()
                continue
            used.append(directive)
            if directive == "f" and form[position - 1 : position] in ("_", "-", ":"):
                out.append(r"(?P<f>\d{1,9})")  # the sign before it stands for the point
                position += 2
                continue
            beside = _NUMERIC.match(form, position + 2) or (position > 1 and _NUMERIC.match(form, position - 2))
            fixed = bool(beside) and directive in "mdHMSI"
            out.append(f"(?P<{directive}>\\d{{2}})" if fixed else _GROUPS[directive])
            if _WHOLE.match(form, position) and (position == 0 or form[position - 1] == " "):
                out.append(r"(?:\.0*)?")
            position += 2
            continue
        if not (letter in ".," and form.startswith("%f", position + 1)):  # %f reads the sign before it
            out.append(r"[T\s]+" if letter == " " else re.escape(letter))
        position += 1
    if len(set(used)) < len(used):
        raise UsageError("a directive occurs twice", where=f"time format {form!r}", fix="name each once")
    if not _dated(frozenset(used)):
        raise UsageError(
            "no whole date in it", where=f"time format {form!r}",
            fix="name year, month and day; year and month alone are read as the month's first day",
        )  # fmt: skip
    if not {"H", "I", "Q", "E", "G", "K"} & set(used) and {"M", "S", "f", "p"} & set(used):
        raise UsageError("no hour in it", where=f"time format {form!r}", fix="name the hour, or the date alone")
    return "^" + "".join(out) + "$"


def _dated(used: frozenset[str]) -> bool:
    """Whether directives make a date: a day of a month or of the year, a count, or a month that stands by itself."""
    if "s" in used or ("Y" in used and used & {"j", "J", "E", "D"}) or {"y", "j"} <= used:
        return True
    month = bool(used & {"Y", "y"} and used & {"m", "b"})
    return month and ("d" in used or len(used) == 2)


def is_date_alone(form: str) -> bool:
    """Whether a format has directives of a date, but none of the time of day."""
    return "%" in form and not any(f"%{letter}" in form for letter in "HIMSfQJEGKs")


def parse(texts: Sequence[str] | pa.StringArray, form: str) -> Stamps:
    """Read stamps written as `form`.

    Raises:
        UsageError: see `pattern`.
    """
    text = pc.utf8_trim_whitespace(texts if isinstance(texts, pa.StringArray) else pa.array(texts, pa.string()))
    if form in EPOCH:
        return _epoch(text, EPOCH[form])
    if form in PLAIN_FORMS and (plain := _plain(text)) is not None:
        return plain
    found = pc.extract_regex(text, pattern(form))
    written = found.is_valid().to_numpy(zero_copy_only=False).astype(bool)
    valid = written.copy()
    part = functools.partial(_part, found)
    year = part("Y") if part("Y") is not None else _whole_year(part("y"))
    hour, ok = _hour(found, part)
    valid &= ok
    minute, second = part("M"), part("S")
    zero = np.zeros(len(text), dtype=np.int64)
    minute, second = zero if minute is None else minute, zero if second is None else second
    valid &= ((hour < 24) | ((hour == 24) & (minute == 0) & (second == 0))) & (minute < 60) & (second < 60)
    year = np.full_like(zero, 1970 if "%s" in form else 0) if year is None else year
    distant = written & ((year < YEARS[0]) | (year > YEARS[1]))
    days, ok = _days(found, part, year)
    valid &= ok
    fraction, digits = _fraction(found)
    ns = days * DAY + ((hour * 60 + minute) * 60 + second) * NANOSECONDS + fraction
    decimal_step = 0
    for name, length, first, last in _DECIMALS:
        decimal = _decimal(found, name, length)
        if decimal is None:
            continue
        count, rounded, last_digit = decimal
        if name == "J" and any(_field(found, clock) is not None for clock in "HIQGK"):
            # The clock says what the fraction of the day does, which may be rounded up to the next day.
            rounded = np.round(count - (ns - days * DAY) / DAY).astype(np.int64) * length
        else:
            decimal_step = last_digit
        ns = ns + rounded - round(first) * length
        valid &= (count >= first) & (count <= last)
    offset, utc = _offset(found, len(text))
    if (unix := part("s")) is not None:
        ns, utc, distant = ns + unix * NANOSECONDS, np.ones_like(valid), np.zeros_like(valid)
    for name, length in _SUBSECONDS.items():
        if (parts := part(name)) is not None:
            ns, digits = ns + parts * length, {"L": 3, "U": 6, "N": 9}[name]
    step = NANOSECONDS if np.any(second[valid]) else DAY if is_date_alone(form) else 60 * NANOSECONDS
    step = 10 ** (9 - digits) if digits else step
    step = decimal_step or step
    return Stamps(ns=np.where(valid, ns - offset, 0), utc=utc & valid, valid=valid, distant=distant, step=step)


def _decimal(
    found: pa.StructArray, name: str, length: int
) -> tuple[NDArray[np.float64], NDArray[np.int64], int] | None:
    """Hours or days with their fraction, in nanoseconds, and the resolution of the last digit; `None` where absent.

    What is within half a digit of a whole minute or second is that: 10.1667 h is 10:10.
    """
    column = _field(found, name)
    if column is None:
        return None
    text = pc.coalesce(column, "0")
    count = pc.cast(text, pa.float64()).to_numpy(zero_copy_only=False)
    digits = int(pc.max(pc.binary_length(pc.replace_substring_regex(text, r"^[^.]*\.?", ""))).as_py() or 0)
    step = max(1_000, round(length / 10**digits))
    ns = np.round(count * length).astype(np.int64)
    for whole in (NANOSECONDS, 60 * NANOSECONDS):
        near = np.round(ns / whole).astype(np.int64) * whole
        ns = np.where(2 * np.abs(ns - near) <= step, near, ns)
    return count, ns, step


def _plain(text: pa.StringArray) -> Stamps | None:
    """What `parse` gives for stamps that are all 2021-05-14 00:00:00 with a fraction or none, by Arrow's own parser.

    `None` where one of them is not.
    """
    length = pc.binary_length(text)
    shortest, longest = (pc.min(length).as_py() or 0), (pc.max(length).as_py() or 0)
    if shortest < len("2021-05-14 00:00:00") or longest > len("2021-05-14 00:00:00.123456789"):
        return None
    try:
        ns = pc.cast(pc.cast(text, pa.timestamp("ns")), pa.int64()).to_numpy(zero_copy_only=False)
    except pa.ArrowInvalid:
        return None
    low, high = (int(np.datetime64(f"{year}-01-01", "ns").astype(np.int64)) for year in (YEARS[0], YEARS[1] + 1))
    if int(ns.min()) < low or int(ns.max()) >= high:
        return None
    step = 60 * NANOSECONDS if longest < 20 and not np.any(ns % (60 * NANOSECONDS)) else NANOSECONDS
    step = 10 ** (20 + 9 - longest) if longest > 20 else step
    valid, no = np.ones(len(ns), dtype=bool), np.zeros(len(ns), dtype=bool)
    return Stamps(ns=ns, utc=no, valid=valid, distant=no.copy(), step=step)


def _epoch(text: pa.StringArray, scale: int) -> Stamps:
    """Unix time, exact in integers: a double holds today's seconds to 0.2 µs only."""
    found = pc.extract_regex(text, r"^(?P<whole>\d{1,13})(?:[.,](?P<f>\d{1,9})\d*)?$")
    valid = found.is_valid().to_numpy(zero_copy_only=False).astype(bool)
    whole = _part(found, "whole")
    fraction, digits = _fraction(found)
    whole = np.zeros(len(text), dtype=np.int64) if whole is None else whole
    # years 1990 to 2100: anything else is a counter or another unit
    valid &= (whole * (scale / NANOSECONDS) > 631_152_000) & (whole * (scale / NANOSECONDS) < 4_102_444_800)
    ns = np.where(valid, whole, 0) * scale + fraction // (NANOSECONDS // scale)
    step = max(1, scale // 10**digits)
    distant = np.zeros(len(text), dtype=bool)
    return Stamps(ns=np.where(valid, ns, 0), utc=valid.copy(), valid=valid, distant=distant, step=step)


def _field(found: pa.StructArray, name: str) -> Any:
    index = found.type.get_field_index(name)
    return None if index < 0 else pc.struct_field(found, [index])


def _part(found: pa.StructArray, name: str) -> NDArray[np.int64] | None:
    """One named group as integers, 0 where absent; `None` when the format has no such group."""
    column = _field(found, name)
    if column is None:
        return None
    filled = pc.if_else(pc.equal(pc.coalesce(column, ""), ""), "0", column)
    return pc.cast(filled, pa.int64()).to_numpy(zero_copy_only=False)


def _whole_year(values: NDArray[np.int64] | None) -> NDArray[np.int64] | None:
    return None if values is None else np.where(values < _CENTURY, 2000, 1900) + values


def _hour(found: pa.StructArray, part: Any) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    hour = part("H")
    half = _field(found, "p")
    if hour is not None and half is not None:
        # 13:05 beside 1:05 PM, and 13:05 PM: what says its half of the day is of 12 hours where it can be.
        after = pc.starts_with(pc.utf8_lower(pc.coalesce(half, "")), "p").to_numpy(zero_copy_only=False)
        stated = pc.not_equal(pc.coalesce(half, ""), "").to_numpy(zero_copy_only=False).astype(bool)
        twelve = stated & (hour >= 1) & (hour <= 12)
        return np.where(twelve, hour % 12 + 12 * after.astype(np.int64), hour), np.ones(len(hour), dtype=bool)
    if hour is not None:
        return hour, np.ones(len(hour), dtype=bool)
    twelve = part("I")
    if twelve is None:
        return np.zeros(len(found), dtype=np.int64), np.ones(len(found), dtype=bool)
    ok = (twelve >= 1) & (twelve <= 12)
    if half is None:
        return twelve, ok
    after = pc.starts_with(pc.utf8_lower(pc.coalesce(half, "")), "p").to_numpy(zero_copy_only=False)
    return twelve % 12 + 12 * after.astype(np.int64), ok


def _days(found: pa.StructArray, part: Any, year: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Days since 1970 and whether the date exists (Hinnant, "chrono-compatible low-level date algorithms")."""
    of_year = part("j")
    if any(_field(found, name) is not None for name in ("J", "E", "s")):
        of_year = np.ones_like(year)  # the days are counted with their fraction
    if (numbered := part("D")) is not None:
        return _civil(year, np.ones_like(year), np.ones_like(year)) + numbered, np.ones(len(year), dtype=bool)
    if of_year is not None:
        first = _civil(year, np.ones_like(year), np.ones_like(year))
        leap = (year % 4 == 0) & ((year % 100 != 0) | (year % 400 == 0))
        return first + of_year - 1, (of_year >= 1) & (of_year <= 365 + leap) & (year >= YEARS[0]) & (year <= YEARS[1])
    month = part("m") if part("m") is not None else _month(found)
    day = part("d") if part("d") is not None else np.ones_like(year)
    leap = (year % 4 == 0) & ((year % 100 != 0) | (year % 400 == 0))
    lengths = np.array([0, 31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31])
    known = (month >= 1) & (month <= 12)
    length = lengths[np.where(known, month, 0)] + (leap & (month == 2))
    ok = known & (day >= 1) & (day <= length) & (year >= YEARS[0]) & (year <= YEARS[1])
    return _civil(np.where(ok, year, 1970), np.where(ok, month, 1), np.where(ok, day, 1)), ok


def _month(found: pa.StructArray) -> NDArray[np.int64]:
    """The month of each name, 0 for none: of another language, else of English by its first three letters."""
    names = pc.utf8_lower(pc.coalesce(_field(found, "b"), ""))
    other = pc.fill_null(pc.index_in(names, pa.array(list(NUMBERS))), -1).to_numpy(zero_copy_only=False)
    short = pc.utf8_slice_codeunits(names, 0, 3)
    english = pc.fill_null(pc.index_in(short, pa.array(ENGLISH)), -1).to_numpy(zero_copy_only=False)
    return np.where(other >= 0, np.array([*NUMBERS.values(), 0])[other], english + 1).astype(np.int64)


def _civil(year: NDArray[np.int64], month: NDArray[np.int64], day: NDArray[np.int64]) -> NDArray[np.int64]:
    shifted = year - (month <= 2)
    era = shifted // 400
    of_era = shifted - era * 400
    of_year = (153 * (month + np.where(month > 2, -3, 9)) + 2) // 5 + day - 1
    return era * 146_097 + of_era * 365 + of_era // 4 - of_era // 100 + of_year - 719_468


def _fraction(found: pa.StructArray) -> tuple[NDArray[np.int64], int]:
    """Nanoseconds of the fraction, and the most digits it ever has."""
    column = _field(found, "f")
    if column is None:
        return np.zeros(len(found), dtype=np.int64), 0
    text = pc.coalesce(column, "")
    digits = int(pc.max(pc.binary_length(text)).as_py() or 0)
    padded = pc.utf8_rpad(text, 9, "0")
    return pc.cast(padded, pa.int64()).to_numpy(zero_copy_only=False), digits


def _offset(found: pa.StructArray, n: int) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """Nanoseconds east of UTC that each stamp states, and whether it states any."""
    column = _field(found, "z")
    if column is None:
        return np.zeros(n, dtype=np.int64), np.zeros(n, dtype=bool)
    offset = np.zeros(n, dtype=np.int64)
    text = pc.coalesce(column, "")
    stated = pc.not_equal(text, "").to_numpy(zero_copy_only=False).astype(bool)
    for value in pc.unique(text).to_pylist():
        if value in ("", "Z", "UTC", "GMT"):
            continue
        rows = pc.equal(text, value).to_numpy(zero_copy_only=False).astype(bool)
        if value in ABBREVIATED:
            offset[rows] = ABBREVIATED[value] * 3600 * NANOSECONDS
            continue
        sign = -1 if value[0] == "-" else 1
        minutes = int(value[1:3]) * 60 + int(value[3:].lstrip(":") or 0)
        offset[rows] = sign * minutes * 60 * NANOSECONDS
    return offset, stated
