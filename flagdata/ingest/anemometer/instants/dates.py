"""Which number of a date is the day: decided by evidence in the log, or not at all."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from flagdata.errors import TimeError
from flagdata.ingest.anemometer.instants.stamps import DAY, parse

Order = Literal["ymd", "dmy", "mdy"]
_ISO = re.compile(r"^\s*\d{4}[-/.]")
_PARTS = re.compile(r"^\s*(\d{1,2})([-/.])(\d{1,2})\2(\d{4}|\d{2})(?!\d)")


_TWELVE = re.compile(r"\d\s*[AaPp]\.?[Mm]\b")
"""A clock of twelve hours, which no such locale has: program settings were mixed."""


@dataclass(frozen=True, kw_only=True)
class Decision:
    """The order of the numbers of a date.

    Attributes:
        order: "ymd", "dmy" or "mdy".
        separator: between them.
        long_year: whether the year has four digits.
        reason: the evidence.
    """

    order: Order
    separator: str
    long_year: bool
    reason: str

    def directives(self) -> str:
        """The date as strptime directives."""
        year = "%Y" if self.long_year else "%y"
        return self.separator.join({"y": year, "m": "%m", "d": "%d"}[letter] for letter in self.order)


def decide(texts: Sequence[str], *, given: Order | None, where: str) -> Decision:
    """The order in which dates at the start of `texts` are written.

    Evidence: a number above 12 is a day; where there is none, points between the numbers (every locale of the Unicode
    CLDR that writes them so puts the day first; not beside AM and PM), or the order in which the log moves on by less
    than two days between rows while the other jumps. Years of two digits may also stand first, between hyphens
    ("26-03-14").

    Args:
        given: the user's word; refused when a date contradicts it.

    Raises:
        TimeError: no date, contradictory dates, or no evidence.
    """
    dated = [text for text in texts if text.strip()]
    year_first = [text.strip() for text in dated if _ISO.match(text)]
    if len(year_first) * 2 > len(dated):
        first = year_first[0]
        if given not in (None, "ymd"):
            raise TimeError(f"dates are not {given}, but {first[:10]}", where=where, fix="leave out --date-order")
        return Decision(order="ymd", separator=first[4], long_year=True, reason=f"dates are written as {first[:10]}")
    parts = [match for text in dated if (match := _PARTS.match(text))]
    if len(parts) * 2 <= len(dated) or not parts:
        raise TimeError("the rows do not begin with a date", where=where, fix="describe the file by a recipe")
    separator, long_year = parts[0][2], len(parts[0][4]) == 4
    first = np.array([int(match[1]) for match in parts])
    second = np.array([int(match[3]) for match in parts])
    if not long_year and (given == "ymd" or (given is None and separator == "-")):
        third = np.array([int(match[4]) for match in parts])
        found = _short_year_first(first, second, third, given=given, separator=separator, text=dated[0], where=where)
        if found is not None:
            return found
    days_first, days_second = int((first > 12).sum()), int((second > 12).sum())
    if days_first and days_second:
        raise TimeError(
            f"{days_first} dates have a first number above 12 and {days_second} a second one", where=where,
            fix="the file mixes two orders: split it",
        )  # fmt: skip
    if days_first or days_second:
        order: Order = "dmy" if days_first else "mdy"
        number = "first" if days_first else "second"
        reason = f"{days_first or days_second} of the first {len(parts)} dates have a {number} number above 12"
        if given is not None and given != order:
            raise TimeError(
                f"dates are not {given}: {reason}", where=where, fix=f"leave out --date-order, it is {order}"
            )
        return Decision(order=order, separator=separator, long_year=long_year, reason=reason)
    if given == "ymd":
        raise TimeError("years of four digits do not come first here", where=where, fix="give --date-order dmy or mdy")
    if given is not None:
        return Decision(
            order=given, separator=separator, long_year=long_year, reason=f"the date order {given} was given"
        )
    if separator == "." and not any(map(_TWELVE.search, dated)):
        reason = "dates whose numbers are divided by points are written with the day first"
        return Decision(order="dmy", separator=separator, long_year=long_year, reason=reason)
    candidates: tuple[Literal["dmy", "mdy"], ...] = ("dmy", "mdy")
    smooth: list[Literal["dmy", "mdy"]] = [
        order for order in candidates if _moves_on(dated, order, separator, long_year)
    ]
    if len(smooth) == 1:
        reason = "no number above 12, but only in this order the log moves on from day to day"
        return Decision(order=smooth[0], separator=separator, long_year=long_year, reason=reason)
    raise TimeError(
        f"{dated[0].strip()[:10]} may be day/month or month/day, and nothing in the log decides it", where=where,
        fix="give --date-order dmy or mdy",
    )  # fmt: skip


def _short_year_first(
    first: NDArray[np.int64],
    second: NDArray[np.int64],
    third: NDArray[np.int64],
    *,
    given: Order | None,
    separator: str,
    text: str,
    where: str,
) -> Decision | None:
    """That dates are year, month, day with years of two digits; `None` where they are not.

    Raises:
        TimeError: they may be, and as well day, month, year.
    """
    possible = bool(np.all((second >= 1) & (second <= 12) & (third >= 1) & (third <= 31)))
    if given == "ymd" or (possible and bool((first > 31).any() or (first < 1).any())):
        reason = "the date order ymd was given" if given else "first numbers are no days"
        return Decision(order="ymd", separator=separator, long_year=False, reason=reason)
    if not possible or len(set(first.tolist())) > len(set(third.tolist())):
        return None
    if len(set(third.tolist())) > len(set(first.tolist())):
        reason = "the last number of the dates changes more often than the first"
        return Decision(order="ymd", separator=separator, long_year=False, reason=reason)
    raise TimeError(
        f"{text.strip()[:8]} may be year-month-day or day-month-year, and nothing in the log decides it", where=where,
        fix="give --date-order ymd or dmy",
    )  # fmt: skip


def _moves_on(texts: Sequence[str], order: Literal["dmy", "mdy"], separator: str, long_year: bool) -> bool:
    decision = Decision(order=order, separator=separator, long_year=long_year, reason="")
    dates = [text.split()[0] + " 0" for text in texts]
    stamps = parse(dates, decision.directives() + " %H")
    steps = np.diff(np.unique(stamps.ns[stamps.valid]))
    return bool(stamps.valid.all()) and len(steps) > 0 and int(steps.max()) <= 2 * DAY
