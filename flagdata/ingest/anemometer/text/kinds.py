"""What one cell of an unknown table seems to hold: a number, with or without a unit, a stamp, or text."""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import Literal

from flagdata.ingest.anemometer.instants import month_names
from flagdata.ingest.anemometer.recipe import MISSING, MISSING_SIGNS
from flagdata.ingest.anemometer.text.cells import BELOW
from flagdata.units import UNITS, plain_powers, spelled

CellKind = Literal["number", "stamp", "missing", "text"]

_NO_VALUE = re.compile(MISSING_SIGNS)
_BELOW = re.compile(BELOW)
_NUMBER = re.compile(r"[-+]?(\d+([.,]\d*)?|[.,]\d+)([eE][-+]?\d+)?")
_STAMP = re.compile(
    r"\d{1,4}[-/.:]\d{1,2}([-/.:]\d{1,4})?([T ,_-]+\d{1,2}([:-]\d{1,2}){0,2}([.,:]\d+)?)?(\s*[AaPp]\.?[Mm]\.?)?"
    r"\s*(Z|UTC|GMT|[-+]\d{2}(:?\d{2})?|(?<=\d) [A-Z]{3,4})?"
    r"|(?:\d{1,2} \d{1,2} (?:19|20)\d\d|(?:19|20)\d\d \d{1,2} \d{1,2}) \d{1,2}(?::\d{2}(?::\d{2})?)?"
)
_DAY_OF_WEEK = r"(?:Mon|Tue|Wed|Thu|Fri|Sat|Sun)[a-z]{0,6}\.?,?\s+"
_ENGLISH = r"(?:Jan|Feb|Mar|Apr|May|Jun|Jul|Aug|Sep|Oct|Nov|Dec)[a-z]{0,6}\.?,?"
_MONTH_STAMP = re.compile(
    r"\d{1,2}[- ][A-Za-z]{3}[- ]\d{1,4}\b.*|\d{4}-[A-Za-z]{3}-\d{1,2}.*"
    rf"|(?:{_DAY_OF_WEEK})?(?:\d{{1,2}}[- ])?{_ENGLISH}[-\s]+\d{{1,4}}\b.*"
)
_CLOCK_BEHIND = re.compile(r"[\s,:T]*(?:(?:à|kl|um|at|a las)\.?\s+)?(?:\d{1,2}[:.h]\d.*)?")
"""What may follow a date in its cell: nothing, or a time of day."""
_RARE_STAMP = re.compile(
    rf"[{month_names.LETTERS}]{{2,13}}\.?,?\s+\d{{1,4}}[-/.]\d{{1,2}}[-/.]\d{{1,4}}(?:[ ,T]+\d{{1,2}}:\d{{2}}.*)?"
    r"|\d{1,2}:\d{2}(?::\d{2}(?:[.,]\d+)?)?(?: ?[AaPp]\.?[Mm]\.?)?,?\s+\d{1,4}[-/. ][^\s\d]?\w{1,9}\.?[-/. ]\d{1,4}"
)
"""A date of numbers behind a day of the week, or behind the clock."""
_QUANTITY = re.compile(rf"(?!\d{{5}})({_NUMBER.pattern})\s*(?P<unit>(?:[^\d\s.,:;+-]\s?){{1,8}}(?:-1)?)")
OF_LOGS = frozenset({"m/s", "rad", "K", "Pa", "1"})
"""SI units of quantities that tables write with their unit in every cell ("4.3 mph", "210°")."""
_MISSING = frozenset({*MISSING, "nan.", "inf", "-inf"})
_UNITS_OF_OTHERS = frozenset(
    {
        "ts", "rn", "smp", "avg", "yyyy-mm-dd", "hh:mm:ss", "hh:mm", "utc", "unitless", "w/m2", "v", "yr",
        "j/m2", "kw", "kwh", "mo", "dy", "hr", "mn", "year", "month", "day", "hour", "mi", "nmi", "-", "none",
        "degrees_north", "degrees_east", "degree_north", "degree_east", "degree_celsius", "celsius", "psu", "ph_t",
        "c_deg", "hours", "h", "j cm-2", "mj m-2", "mj/m2/d", "mj/m2",
    }
)  # fmt: skip
"""What stands in a line of units below times, counts and quantities that are not read; some are of UDUNITS."""
_ONE = r"(?:[umnkcµμ]?(?:mol|m|g|l|w|j|s|pa)|h|d|k|sr|deg|degc)"
_COMPOUND = re.compile(rf"{_ONE}(?:(?:[. ]{_ONE}\^?-[123])+|/{_ONE}[23]?)")
"""Units of two parts that are not read, as mg.m-3, umol kg-1 or mg/L."""


def cell_kind(cell: str) -> CellKind:
    """What a cell seems to hold."""
    text = cell.strip().strip('"').strip()
    if text.lower() in _MISSING or _NO_VALUE.match(text):
        return "missing"
    if _NUMBER.fullmatch(text) or unit_behind(text) or _BELOW.match(text.replace(",", ".")):
        return "number"
    if _STAMP.fullmatch(text) or _MONTH_STAMP.fullmatch(text) or _is_dated(text):
        return "stamp"
    return "text"


def _is_dated(text: str) -> bool:
    """Whether a text is a date with the name of its month, in whichever language, or one put together otherwise."""
    if _RARE_STAMP.fullmatch(text):
        return True
    found = month_names.DATE.match(text)
    return found is not None and _CLOCK_BEHIND.fullmatch(text, found.end()) is not None


def is_unit(text: str) -> bool:
    """Whether a cell of a line of units spells one; brackets are looked through."""
    bare = plain_powers(text.strip().strip("[]()<>").strip())
    known = bare.lower() in _UNITS_OF_OTHERS or spelled(bare) is not None
    return known or _COMPOUND.fullmatch(bare.lower()) is not None


def are_units(cells: Collection[str]) -> bool:
    """Whether all cells of a column spell units, at least one of them one that is read."""
    return all(map(is_unit, cells)) and any(spelled(cell) is not None for cell in cells)


def unit_behind(text: str) -> str:
    """The unit that is written behind a number, as written; "" where there is none."""
    match = _QUANTITY.fullmatch(text[:60])
    if match is None or (match["unit"].isalpha() and len(match["unit"]) == 1):
        return ""
    name = spelled(match["unit"])
    return match["unit"].strip() if name is not None and UNITS[name].si in OF_LOGS else ""
