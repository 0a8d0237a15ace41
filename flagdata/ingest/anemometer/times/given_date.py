"""What a table says against the date that its user gives: a column of years whose first is another."""

from __future__ import annotations

import datetime as dt
import re

from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.times.dateparts import YEAR_HEADINGS
from flagdata.ingest.anemometer.times.timechoice import whole_numbers
from flagdata.ingest.anemometer.words.headings import words_of

_FIRST, _LAST = 1900, 2100


def contradiction(layout: Layout, date: dt.date) -> str:
    """What is said where a column of years does not begin with the year of a date; "" where none does."""
    for index, name in enumerate(layout.names):
        cells = [cell for cell in layout.column(index) if cell]
        if (
            not re.fullmatch(YEAR_HEADINGS, " ".join(words_of(name)))
            or not cells
            or not whole_numbers(cells, _FIRST, _LAST)
        ):
            continue
        year = round(float(cells[0]))
        if year != date.year:
            return f"column {name!r} begins with {year}, and the date that was given is of {date.year}: taken as given"
    return ""
