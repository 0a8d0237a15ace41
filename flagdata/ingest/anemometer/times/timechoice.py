"""A column of a table, or several, taken as its time: in what format, in which zone, and what is in doubt."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flagdata.ingest.anemometer.instants.stamps import Stamps
from flagdata.ingest.anemometer.text.cells import numbers
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.words.headings import names_time, words_of, zone_of

YEAR = re.compile(r"^\s*(19|20)\d\d\s*$")
TWO_DIGITS = re.compile(r"^\s*\d{1,2}\s*$")
DIGITS = re.compile(r"^\s*\d{1,4}\s*$")
SHARE = 0.9
"""Share of rows that must fit for a column to be what it seems."""


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
        likely: the format that a count is likely written in; "" where nothing tells.
        remark: what was taken for granted, and may be otherwise; `None` where nothing was.
        unnamed: whether it is told by its numbers alone, since no line names the columns.
        others: indices of the columns of other stamps of the same rows, which are not read.
        zone_advice: what other columns tell of its zone, as a sentence for the user who is to name it; "" for nothing.
    """

    columns: tuple[int, ...]
    form: str | None
    zone: str | None
    zoned: bool
    score: float
    doubt: str | None = None
    fix: str | None = None
    counts: bool = False
    likely: str = ""
    unnamed: bool = False
    zone_advice: str = ""
    remark: str | None = None
    others: tuple[int, ...] = ()


def share(shape: re.Pattern[str], texts: Sequence[str]) -> bool:
    """Whether nine cells of ten begin as `shape` says."""
    return sum(1 for text in texts if shape.match(text)) >= SHARE * len(texts)


def fits(found: Stamps) -> bool:
    """Whether nine stamps of ten could be read."""
    return bool(len(found.valid)) and float(found.valid.mean()) >= SHARE


_OF_OTHERS = frozenset({"gust", "max", "min", "created", "updated", "start"})
"""Words of instants that may be none of the reading's own."""
_OF_READINGS = frozenset({"obs", "observation", "observed", "measurement", "measured", "sampled"})
"""Words of when a reading was made, beside which other stamps are of what was done with it."""
_LATER = frozenset(
    {
        "requested", "receipt", "received", "retrieved", "fetched", "downloaded", "scraped", "processed", "inserted",
        "modified", "ingested", "uploaded",
    }
)  # fmt: skip
"""Words of what was done with a reading after it was made."""


def time_choice(layout: Layout, columns: tuple[int, ...], form: str, found: Stamps, score: float) -> TimeChoice:
    """The time that `columns` are, of stamps that were read as `form`; headings that speak for it raise its score."""
    names = [layout.names[index] for index in columns]
    zones = [zone for name in (*names, *(layout.units[index] for index in columns)) if (zone := zone_of(name))]
    zoned = bool(found.utc[found.valid].all())
    ns = found.ns[found.valid]
    varied = len(np.unique(ns)) / len(ns) if len(ns) > 1 else 1.0
    words = {word for name in names for word in words_of(name)}
    score += (0.8 if zoned else 0.3 if zones else 0.0) + 0.5 * any(map(names_time, names)) + varied
    score += (
        0.1 * bool(words & {"end"})
        + 0.9 * bool(words & _OF_READINGS)
        - 0.4 * bool(words & _OF_OTHERS)
        - bool(words & _LATER)
    )
    return TimeChoice(
        columns=columns, form=form, zone=None if zoned or not zones else zones[0], zoned=zoned, score=score
    )


def whole_numbers(cells: Sequence[str], low: int, high: int) -> bool:
    """Whether a column holds numbers from `low` to `high`, nine cells of ten filled."""
    value = numbers(cells).value
    known = value[np.isfinite(value)]
    return len(known) >= SHARE * len(cells) > 0 and bool(np.all((known >= low) & (known <= high)))


def hours_and_minutes(cells: Sequence[str], *, said: bool = False) -> bool:
    """Whether numbers are hours and minutes in one, 0 to 2400, without leading zeros or with them.

    Args:
        said: whether a heading says so; else one must be larger than the hours of a day are.
    """
    if not share(DIGITS, cells) or not whole_numbers(cells, 0, 2400):
        return False
    if not said and not any(len(cell) > 2 for cell in cells):
        return False
    return all(int(cell) % 100 < 60 for cell in cells if cell.isdigit())
