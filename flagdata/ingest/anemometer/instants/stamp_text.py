"""From stamps as text to nanoseconds, in bulk: ISO 8601, counts, and strptime directives.

Directives: %Y %y %m %d %e %j %H %I %p %M %S %b %a, and %f, which stands for an optional fraction
with its mark ("" or ".5" or ",123456789"): loggers drop trailing zeros, so that 20 Hz stamps read
00.05, 00.1, 00.15. %z stands for an optional offset from UTC ("Z", "UTC", "GMT", "+02:00", "+02",
"CEST"), %Z for letters of a zone that are not read, %p for "AM", "p.m." or a bare "a" or "p", %a
for a day of the week, which is not read, %b for an English month, whole or cut short. Numbers
between blanks may end in ".0", as tables of floats have them. 24:00 is the midnight that ends a day
(ISO 8601:2004, 4.2.3). A blank stands for any run of blanks or a "T". Two-digit years are 1970 to
2069.

Names of counts:

    epoch-s, -ms, -us, -ns      Unix time
    labview-s                   seconds since 1904-01-01 in UTC (LabVIEW, timestamps)
    filetime                    tenths of a microsecond since 1601-01-01 in UTC (Windows, FILETIME)
    ticks                       tenths of a microsecond since year 1, of the wall clock (.NET,
                                DateTime.Ticks)
    excel-days                  days since 1899-12-30 (ECMA-376, part 1, 18.17.4.1), of the wall
                                clock
    excel-days-1904             days since 1904-01-01 (the same, workbooks of the 1904 date system),
                                of the wall clock
    datenum                     days since year 0, 1 January being 1 (MATLAB, datenum), of the wall
                                clock
    julian-days, -modified      days since noon of -4712-01-01, and since 1858-11-17, of the wall
                                clock
    elapsed-s, -ms, -us, -min, -h, -d   since a start that the user gives (see `dates`)
"""

# pyarrow.compute makes its functions at import, where a type checker cannot see them.
# pyright: reportAttributeAccessIssue=false
from __future__ import annotations

import functools
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from decimal import Decimal
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from flagdata.core.arrays import BoolArray, FloatArray, IntArray
from flagdata.errors import UsageError
from flagdata.timebase import NANOSECONDS

HOUR = 3600 * NANOSECONDS
DAY = 24 * HOUR
NEXT_DAY = 2 * HOUR
"""A time of day that falls by more is of the next day: clocks are set back by less, and a logger
may rest by night."""
_MINUTE = 60 * NANOSECONDS
ABBREVIATED = {
    "WEST": 1,
    "CET": 1,
    "CEST": 2,
    "MEZ": 1,
    "MESZ": 2,
    "EET": 2,
    "EEST": 3,
    "MSK": 3,
    "JST": 9,
    "KST": 9,
    "AEST": 10,
    "AEDT": 11,
    "AWST": 8,
    "NZST": 12,
    "NZDT": 13,
    "SAST": 2,
    "HKT": 8,
    "EST": -5,
    "EDT": -4,
    "CDT": -5,
    "MDT": -6,
    "PST": -8,
    "PDT": -7,
    "AKST": -9,
    "AKDT": -8,
    "HST": -10,
    "BRT": -3,
}
"""Hours east of UTC of the abbreviations that mean one offset (tz database)."""
ENGLISH = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_ENDS = ("uary", "ruary", "ch", "il", "", "e", "y", "ust", "tember", "ober", "ember", "ember")
_MONTHS = {
    short + end[:letters]: 1 + at
    for at, (short, end) in enumerate(zip(ENGLISH, _ENDS, strict=True))
    for letters in range(len(end) + 1)
}
"""The month of each name, whole or cut short."""
_OFFSET = rf"\s*(?P<z>Z|UTC|GMT|{'|'.join(ABBREVIATED)}|[+-](?:0\d|1[0-5])(?::?[0-5]\d)?)?"
_LETTERS = "A-Za-zÀ-ɏА-яё"
_GROUPS: dict[str, str] = {
    "Y": r"(?P<Y>\d{4})",
    "y": r"(?P<y>\d{2})",
    "m": r"(?P<m>\d{1,2})",
    "d": r"(?P<d>\d{1,2})",
    "j": r"(?P<j>\d{1,3})",
    "H": r"(?P<H>\d{1,2})",
    "I": r"(?P<I>\d{1,2})",
    "M": r"(?P<M>\d{1,2})",
    "S": r"(?P<S>\d{1,2})",
    "f": r"(?:[.,](?P<f>\d{1,9}))?",
    "p": r"(?P<p>[AaPp](?:\.?\s?[Mm]\.?)?)",
    "b": r"(?P<b>[A-Za-z]{3,9})\.?",
    "a": rf"(?:(?P<a>[{_LETTERS}]{{2,13}})\.?,?)",
    "z": _OFFSET,
    "Z": r"\s*(?:[A-Z]{3,4})?",
}
_SAME = {"B": "b", "h": "b", "A": "a", "e": "d"}
"""Directives of C's strftime that others here read as well: a month's name may be whole or cut
short."""
_TOKEN = re.compile(
    r"(?P<run>(?<![^ ])%H%M(?:%S)?)|%(?P<directive>.?)|[.,](?=%f)|(?P<sign>.)", re.DOTALL
)
_CLOCK_RUNS = {
    "%H%M": r"(?P<H>\d{0,2}?)(?P<M>\d{1,2})",
    "%H%M%S": r"(?P<H>\d{1,2})(?P<M>\d{2})(?P<S>\d{2})",
}
"""Clocks written as one number. Loggers leave out its zeros: 59 is 00:59, 100 is 01:00; of HHMMSS
only the first."""
_NUMERIC = re.compile(r"%[YymdjHIMS]")
"""Directives of numbers; those with nothing between them have all their digits."""
_ALONE = re.compile(r"(?<![^ ])%[YmdjHMS](?= |$)")
"""Directives of whole numbers between blanks."""
_ISO = (
    r"^(?P<Y>\d{4})[-/](?P<m>\d{1,2})[-/](?P<d>\d{1,2})[T ]+(?P<H>\d{1,2}):(?P<M>\d{2})"
    rf"(?::(?P<S>\d{{2}})(?:[.,](?P<f>\d{{1,9}}))?)?{_OFFSET}$"
)
YEARS = (1970, 2200)
"""First and last year of a stamp that is taken for a date."""
_CENTURY = YEARS[0] % 100
"""The first year of two digits that is of the 1900s: no log is of the years to come, and some are
of the 1990s."""
PLAIN_FORMS = ("iso", "%Y-%m-%d %H:%M:%S%f")
"""Forms of which 2021-05-14 00:00:00.05 is one."""
EPOCH = {
    "epoch-s": NANOSECONDS,
    "epoch-ms": 1_000_000,
    "epoch-us": 1_000,
    "epoch-ns": 1,
    "labview-s": NANOSECONDS,
    "filetime": 100,
    "ticks": 100,
}
"""Counts of seconds or their parts since an origin: the nanoseconds of one unit."""
_SINCE_1970 = {
    "labview-s": 2_082_844_800,
    "filetime": 116_444_736_000_000_000,
    "ticks": 621_355_968_000_000_000,
}
"""What a count of another origin than 1970 says of it, in its unit."""
_SINCE, _UNTIL = 631_152_000, 4_102_444_800
"""1990 and 2100 in Unix time: what lies beyond is a counter or another unit."""
SERIAL = {
    "excel-days": 25_569,
    "excel-days-1904": 24_107,
    "datenum": 719_529,
    "julian-days": 2_440_587.5,
    "julian-days-modified": 40_587,
}
"""Number of the day 1970-01-01."""
ELAPSED = {
    "elapsed-s": NANOSECONDS,
    "elapsed-ms": 1_000_000,
    "elapsed-us": 1_000,
    "elapsed-min": _MINUTE,
    "elapsed-h": HOUR,
    "elapsed-d": DAY,
}
EXPONENT = r"^\d(?:[.,]\d{1,20})?[eE]\+?\d{1,2}$"
"""A number that is written with an exponent."""
NAMED = (*EPOCH, *SERIAL, *ELAPSED)
"""Forms that are names of counts."""


@dataclass(frozen=True, kw_only=True)
class Stamps:
    """Parsed stamps, in the order of the rows.

    Attributes:
        ns: (n,) nanoseconds since 1970 of the wall clock, or of UTC where `utc`; since the start of
            what is elapsed.
        utc: (n,) whether the stamp itself says its zone.
        valid: (n,) whether it could be read at all and is a calendar date within `YEARS`.
        distant: (n,) whether it is written as a stamp, but of a year outside `YEARS`: a clock that
            was never set.
        step: the resolution of the stamps as written [ns]: the last digit that is ever used.
    """

    ns: IntArray
    utc: BoolArray
    valid: BoolArray
    distant: BoolArray
    step: int


def whole_year(year: int) -> int:
    """Returns the year of which `year` is the last two digits: 1970 to 2069."""
    return year + (2000 if year < _CENTURY else 1900)


@functools.cache
def pattern(form: str) -> str:
    """Builds the regular expression of a format.

    Raises:
        UsageError: an unknown directive, one given twice, hours of 1 to 12 without their half of
            the day, or no whole date in it. A date alone is its midnight.
    """
    if form == "iso":
        return _ISO
    where = f"time format {form!r}"
    out: list[str] = []
    used: list[str] = []
    for token in _TOKEN.finditer(form):
        if token["run"]:
            used.extend(token["run"].replace("%", ""))
            out.append(_CLOCK_RUNS[token["run"]])
        elif token["directive"] is not None:
            directive = _SAME.get(token["directive"], token["directive"])
            if directive not in _GROUPS:
                directives = " ".join("%" + directive for directive in _GROUPS)
                fix = f"use {directives}, iso, or one of {', '.join(NAMED)}"
                raise UsageError(f"the directive %{directive} is unknown", where=where, fix=fix)
            used.append(directive)
            out.append(_group(form, directive, token.start()))
        elif token["sign"]:
            out.append(r"[T\s]+" if token["sign"] == " " else re.escape(token["sign"]))
    letters = set(used)
    if len(letters) < len(used):
        raise UsageError("a directive occurs twice", where=where, fix="name each once")
    if not (letters & {"Y", "y"} and ("j" in letters or (letters & {"m", "b"} and "d" in letters))):
        raise UsageError(
            "the format has no whole date", where=where, fix="name year, month and day"
        )
    if not {"H", "I"} & letters and {"M", "S", "f", "p"} & letters:
        raise UsageError(
            "the format has no hour", where=where, fix="name the hour, or the date alone"
        )
    if ("I" in letters) != ("p" in letters):
        fix = (
            "name the hours of a clock of 12 by %I with %p, those of 24 by %H; export the log so "
            "where it has neither"
        )
        raise UsageError("the half of the day goes with hours of 12", where=where, fix=fix)
    return "^" + "".join(out) + "$"


def _group(form: str, directive: str, at: int) -> str:
    """Builds the regular expression of the directive at a place of a form."""
    if directive == "f" and form[at - 1 : at] in ("_", "-", ":"):
        return r"(?P<f>\d{1,9})"  # the sign before it stands for the point
    adjoining = _NUMERIC.match(form, at + 2) or (at > 1 and _NUMERIC.match(form, at - 2))
    expression = (
        f"(?P<{directive}>\\d{{2}})" if adjoining and directive in "mdHMSI" else _GROUPS[directive]
    )
    return expression + (r"(?:\.0*)?" if _ALONE.match(form, at) else "")


def is_date_alone(form: str) -> bool:
    """Checks whether a format has directives of a date, but none of the time of day."""
    return "%" in form and not any(f"%{letter}" in form for letter in "HIMSf")


def array(texts: Sequence[str] | pa.StringArray) -> pa.StringArray:
    """Texts as Arrow has them."""
    return texts if isinstance(texts, pa.StringArray) else pa.array(texts, pa.string())


def parse(texts: Sequence[str] | pa.StringArray, form: str) -> Stamps:
    """Read stamps written as `form`.

    Raises:
        UsageError: see `pattern`.
    """
    text = pc.utf8_trim_whitespace(array(texts))
    if form in EPOCH:
        return _epoch(text, EPOCH[form], _SINCE_1970.get(form, 0), utc=form != "ticks")
    if form in SERIAL:
        return _serial(text, SERIAL[form])
    if form in ELAPSED:
        return _elapsed_counts(text, form)
    if form in PLAIN_FORMS and (plain := _plain(text)) is not None:
        return plain
    fields = pc.extract_regex(text, pattern(form))
    written = fields.is_valid().to_numpy(zero_copy_only=False).astype(bool)
    year, month, day, of_year, hour, twelve, minute, second = (
        _part(fields, name) for name in "YmdjHIMS"
    )
    zero = np.zeros(len(text), dtype=np.int64)
    if year is None:
        short = _part(fields, "y")
        year = zero if short is None else np.where(short < _CENTURY, 2000, 1900) + short
    valid = written & (year >= YEARS[0]) & (year <= YEARS[1])
    distant = written & ~valid
    if twelve is not None:
        valid &= (twelve >= 1) & (twelve <= 12)
        half = pc.starts_with(pc.utf8_lower(pc.coalesce(_field(fields, "p"), "")), "p").to_numpy(
            zero_copy_only=False
        )
        hour = twelve % 12 + 12 * half.astype(np.int64)
    hour, minute, second = (zero if part is None else part for part in (hour, minute, second))
    valid &= (
        ((hour < 24) | ((hour == 24) & (minute == 0) & (second == 0)))
        & (minute < 60)
        & (second < 60)
    )
    if of_year is None:
        month = _month(fields) if month is None else month
        days, dated = _days(year, month, zero + 1 if day is None else day)
    else:
        first = _midnight(year, zero + 1)
        days, dated = (
            first + of_year - 1,
            (of_year >= 1) & (of_year <= _midnight(year + 1, zero + 1) - first),
        )
    valid &= dated
    fraction, digits = _fraction(fields)
    offset, utc = _offset(fields, len(text))
    ns = days * DAY + ((hour * 60 + minute) * 60 + second) * NANOSECONDS + fraction - offset
    step = NANOSECONDS if np.any(second[valid]) else DAY if is_date_alone(form) else _MINUTE
    step = 10 ** (9 - digits) if digits else step
    return Stamps(
        ns=np.where(valid, ns, 0), utc=utc & valid, valid=valid, distant=distant, step=step
    )


def _plain(text: pa.StringArray) -> Stamps | None:
    """Parses stamps that are all 2021-05-14 00:00:00 with a fraction or none, by Arrow's own
    parser; `None` for others.

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
    low, high = (
        int(np.datetime64(f"{year}-01-01", "ns").astype(np.int64))
        for year in (YEARS[0], YEARS[1] + 1)
    )
    if int(ns.min()) < low or int(ns.max()) >= high:
        return None
    step = _MINUTE if longest < 20 and not np.any(ns % _MINUTE) else NANOSECONDS
    step = 10 ** (20 + 9 - longest) if longest > 20 else step
    return _counts(ns, np.ones(len(ns), dtype=bool), step)


def _counts(ns: IntArray, valid: BoolArray, step: int, *, utc: bool = False) -> Stamps:
    """Stamps of one kind, all with their zone or all without."""
    none = np.zeros(len(ns), dtype=bool)
    return Stamps(
        ns=np.where(valid, ns, 0),
        utc=valid.copy() if utc else none,
        valid=valid,
        distant=none,
        step=step,
    )


def _epoch(text: pa.StringArray, scale: int, zero: int, *, utc: bool) -> Stamps:
    """Reads a count of units of `scale` ns that is `zero` in 1970, exact in integers: a double
    holds today's seconds to 0.2 µs only."""
    text = _without_exponents(text, scale)
    fields = pc.extract_regex(text, r"^(?P<whole>\d{1,18}|[1-8]\d{18})(?:[.,](?P<f>\d{1,9})\d*)?$")
    units = _part(fields, "whole")
    fraction, digits = _fraction(fields)
    units = (np.zeros(len(text), dtype=np.int64) if units is None else units) - zero
    seconds = units * (scale / NANOSECONDS)
    valid = (
        fields.is_valid().to_numpy(zero_copy_only=False) & (seconds > _SINCE) & (seconds < _UNTIL)
    )
    ns = np.where(valid, units, 0) * scale + fraction * scale // NANOSECONDS
    return _counts(ns, valid, max(1, scale // 10**digits), utc=utc)


def _without_exponents(text: pa.StringArray, scale: int) -> pa.StringArray:
    """Numbers such as 1.777636801e9 with all their digits; of a column that was rounded to more
    than a second none."""
    written = pc.fill_null(pc.match_substring_regex(text, EXPONENT), False)
    if not pc.any(written).as_py():
        return text
    numbers = [Decimal(number.replace(",", ".")) for number in text.filter(written).to_pylist()]
    last = min(int(number.as_tuple().exponent) for number in numbers)
    texts = [f"{number:f}" if 10.0**last * scale <= NANOSECONDS else "" for number in numbers]
    return pc.replace_with_mask(text, written, pa.array(texts, pa.string()))


def _numbers(text: pa.StringArray) -> tuple[FloatArray, BoolArray, int]:
    """Numbers, which cells are any, and the most digits behind the point."""
    pointed = pc.replace_substring(text, ",", ".")
    number = pc.match_substring_regex(pointed, r"^\d{1,15}(\.\d*)?([eE][-+]?\d{1,2})?$")
    value = pc.cast(pc.if_else(number, pointed, "0"), pa.float64()).to_numpy(zero_copy_only=False)
    fraction = pc.replace_substring_regex(pointed, r"^[^.]*\.?|[eE].*$", "")
    digits = int(pc.max(pc.binary_length(fraction)).as_py() or 0)
    return value, number.to_numpy(zero_copy_only=False).astype(bool), digits


def _serial(text: pa.StringArray, base: float) -> Stamps:
    """Reads serial days. A double holds a day's number to a microsecond or so, and days have no
    round seconds: noise of the last digits below a millisecond is rounding, and so is what is
    within the last digit of whole minutes."""
    value, valid, digits = _numbers(text)
    days = value - base
    valid = valid & (days > _SINCE / 86_400) & (days < _UNTIL / 86_400)
    ns = np.round(np.where(valid, days, 0.0) * 86_400e6).astype(np.int64) * 1_000
    ns = snap_to_grid(ns, 1_000_000, 100_000)
    step = max(1_000, round(DAY / 10**digits))
    minute = snap_to_grid(ns, _MINUTE, step)
    ns = minute if step > 1_000_000 and not np.any(minute % _MINUTE) else ns
    return _counts(ns, valid, step)


def _elapsed_counts(text: pa.StringArray, form: str) -> Stamps:
    """Counts since a start, up to ten years. Thirds and sixths of an hour are no decimal fractions:
    what is within the last digit of a whole second is one."""
    value, valid, digits = _numbers(text)
    scale = ELAPSED[form]
    valid = valid & (value * (scale / NANOSECONDS) < 3.2e8)
    ns = np.round(np.where(valid, value, 0.0) * scale).astype(np.int64)
    step = max(1, scale // 10 ** min(digits, 9))
    ns = snap_to_grid(ns, NANOSECONDS, step) if scale > NANOSECONDS and step < NANOSECONDS else ns
    return _counts(ns, valid, step)


def snap_to_grid(ns: IntArray, grid: int, within: int) -> IntArray:
    """Instants, those within so much of a multiple of `grid` on it."""
    nearest = np.round(ns / grid).astype(np.int64) * grid
    return np.where(np.abs(ns - nearest) <= within, nearest, ns)


def _field(fields: pa.StructArray, name: str) -> Any:
    index = fields.type.get_field_index(name)
    return None if index < 0 else pc.struct_field(fields, [index])


def _part(fields: pa.StructArray, name: str) -> IntArray | None:
    """Reads one named group as integers, 0 where absent; `None` when the format has no such
    group."""
    column = _field(fields, name)
    if column is None:
        return None
    filled = pc.if_else(pc.equal(pc.coalesce(column, ""), ""), "0", column)
    return pc.cast(filled, pa.int64()).to_numpy(zero_copy_only=False)


def _midnight(year: IntArray, month: IntArray) -> IntArray:
    """Days since 1970 of the first day of a month."""
    months = (12 * (year - 1970) + month - 1).astype("datetime64[M]")
    return months.astype("datetime64[D]").astype(np.int64)


def _days(year: IntArray, month: IntArray, day: IntArray) -> tuple[IntArray, BoolArray]:
    """Days since 1970 and whether the date exists."""
    first = _midnight(year, month)
    exists = (month >= 1) & (month <= 12) & (day >= 1) & (day <= _midnight(year, month + 1) - first)
    return first + day - 1, exists


def _month(fields: pa.StructArray) -> IntArray:
    """Returns the month of each name, 0 for none."""
    names = pc.utf8_lower(pc.coalesce(_field(fields, "b"), ""))
    indices = pc.fill_null(pc.index_in(names, pa.array(list(_MONTHS))), -1).to_numpy(
        zero_copy_only=False
    )
    return np.array([*_MONTHS.values(), 0], dtype=np.int64)[indices]


def _fraction(fields: pa.StructArray) -> tuple[IntArray, int]:
    """Nanoseconds of the fraction, and the most digits it ever has."""
    column = _field(fields, "f")
    if column is None:
        return np.zeros(len(fields), dtype=np.int64), 0
    text = pc.coalesce(column, "")
    digits = int(pc.max(pc.binary_length(text)).as_py() or 0)
    padded = pc.utf8_rpad(text, 9, "0")
    return pc.cast(padded, pa.int64()).to_numpy(zero_copy_only=False), digits


def _offset(fields: pa.StructArray, n: int) -> tuple[IntArray, BoolArray]:
    """Nanoseconds east of UTC that each stamp states, and whether it states any."""
    offset = np.zeros(n, dtype=np.int64)
    column = _field(fields, "z")
    if column is None:
        return offset, np.zeros(n, dtype=bool)
    text = pc.coalesce(column, "")
    states_zone = pc.not_equal(text, "").to_numpy(zero_copy_only=False).astype(bool)
    for value in set(pc.unique(text).to_pylist()) - {"", "Z", "UTC", "GMT"}:
        rows = pc.equal(text, value).to_numpy(zero_copy_only=False).astype(bool)
        hours, minutes = value[1:3], value[3:].lstrip(":") or "0"
        seconds = (
            ABBREVIATED[value] * 3600
            if value in ABBREVIATED
            else int(hours) * 3600 + int(minutes) * 60
        )
        offset[rows] = (-seconds if value[0] == "-" else seconds) * NANOSECONDS
    return offset, states_zone


_BARE_END = re.compile(r"(?<![\d:.])24:00(?![:\d])")
_TO_THE_MINUTE = re.compile(r"(%[HI])([:.])%M(?!\W?%S)")
_CLOCK = {"%f": "", "%I": "12", "%p": "AM", "%H": "00", "%M": "00", "%S": "00"}


def parse_mixed(
    texts: Sequence[str] | pa.StringArray, form: str, *, before: str = ""
) -> tuple[Stamps, int]:
    """Stamps written as `form`; where most are, also those with seconds beside it, a 24:00 without
    them, and dates alone, which are midnight as R and spreadsheets write it; and how many dates
    alone there are.

    Args:
        before: date that the texts lack, as `form` has it.

    Raises:
        UsageError: see `pattern`.
    """
    text = pc.binary_join_element_wise(before, array(texts), " ") if before else array(texts)
    stamps_read = parse(text, form)
    if (
        form in NAMED
        or bool(stamps_read.valid.all())
        or 2 * int(stamps_read.valid.sum()) <= len(text)
    ):
        return stamps_read, 0
    at = np.flatnonzero(~stamps_read.valid)
    rest = [cell or "" for cell in text.take(pa.array(at)).to_pylist()]
    clock = (
        "00:00:00"
        if form == "iso"
        else re.sub(
            r"%[fIpHMS]", lambda further_form: _CLOCK[further_form[0]], form.partition(" ")[2]
        )
    )
    ends = [_BARE_END.sub("24:00:00", cell) for cell in rest]
    dates = ["" if before else f"{cell} {clock}" for cell in rest]
    ns, utc, valid, step, bare = (
        stamps_read.ns.copy(),
        stamps_read.utc.copy(),
        stamps_read.valid.copy(),
        stamps_read.step,
        0,
    )
    for cells, further_form in ((ends, _TO_THE_MINUTE.sub(r"\1\2%M\2%S", form)), (dates, form)):
        read = parse(cells, further_form)
        good = read.valid & ~valid[at]
        ns[at[good]], utc[at[good]], valid[at[good]] = read.ns[good], read.utc[good], True
        step, bare = min(step, read.step) if good.any() else step, int(good.sum())
    return replace(stamps_read, ns=ns, utc=utc, valid=valid, step=step), bare
