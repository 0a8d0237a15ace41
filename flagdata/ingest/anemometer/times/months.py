"""Times that are months, such as 2012-01 or Jan-12, each of which stands for a row of means."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from flagdata.ingest.anemometer.instants import stamps
from flagdata.ingest.anemometer.text.layout import Layout
from flagdata.ingest.anemometer.times.timechoice import SHARE, TimeChoice, share, time_choice

_YEAR = r"(?:19|20)\d\d"
_MONTH = re.compile(rf"^\s*(?:{_YEAR}[-/]\d{{1,2}}|\d{{1,2}}/{_YEAR}|[A-Za-z]{{3}}[- /](?:{_YEAR}|\d\d))\s*$")
"""A month with its year and no day. 2012.1 is left out: it may be a number."""
_FORMS = ("%Y-%m", "%Y/%m", "%m/%Y", "%b-%y", "%b %y", "%b/%y", "%b-%Y", "%b %Y", "%b/%Y")
_SCORE = 0.8
"""Below that of days alone, which tell more."""
_REMARK = "each row is of a month, and its stamp is the month's first day, though what it tells is of the whole month"


def choices(layout: Layout, columns: Sequence[Sequence[str]]) -> Iterator[TimeChoice]:
    """Columns of months that follow one another.

    Where they do not, "Jan-12" may be a day without a year, and nothing is chosen.
    """
    for index, cells in enumerate(columns):
        texts = [cell for cell in cells if cell]
        if len(texts) < 2 or not share(_MONTH, texts):
            continue
        for form in _FORMS:
            found = stamps.parse(texts, form)
            if found.valid.mean() < SHARE:
                continue
            month = np.unique(found.ns[found.valid].astype("datetime64[ns]").astype("datetime64[M]").astype(np.int64))
            if len(month) > 1 and np.mean(np.diff(month) == 1) >= SHARE:
                yield replace(time_choice(layout, (index,), form, found, _SCORE), remark=_REMARK)
            break
