"""Midnight written as a bare date, as R and spreadsheets do: "2026-05-02" after "2026-05-01 23:50:00"."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pyarrow as pa

from flagdata.ingest.anemometer.instants import counted
from flagdata.ingest.anemometer.instants.seconds import with_mixed
from flagdata.ingest.anemometer.instants.stamps import EPOCH, Stamps, parse

_TIME = re.compile(r"%[HIMSpfT]")


def parse_as(texts: Sequence[str] | pa.StringArray, form: str) -> tuple[Stamps, int]:
    """Stamps of any format, counts and those without a date or a year included (`counted`), and how many bare dates
    were read as midnight.

    Raises:
        UsageError: see `stamps.pattern`.
    """
    if form in counted.FORMS or counted.needs_date(form):
        return with_mixed(texts, form, counted.parse), 0
    return parse_with_bare_dates(texts, form)


def parse_with_bare_dates(texts: Sequence[str] | pa.StringArray, form: str) -> tuple[Stamps, int]:
    """Stamps written as `form`, and how many bare dates were read as midnight.

    A date alone is midnight where most other rows are whole stamps; in a list of dates it stays unreadable.

    Raises:
        UsageError: see `stamps.pattern`.
    """
    found = with_mixed(texts, form, parse)
    end = "00:00:00" if form == "iso" else _midnight(form)
    if form in EPOCH or end is None or bool(found.valid.all()) or 2 * int(found.valid.sum()) <= len(texts):
        return found, 0
    at = np.flatnonzero(~found.valid)
    text: Any = texts if isinstance(texts, pa.StringArray) else pa.array(texts, pa.string())
    others = zip(at.tolist(), text.take(pa.array(at)).to_pylist(), strict=True)
    dates = {index: other.strip() for index, other in others if other.strip() and ":" not in other}
    if not dates:
        return found, 0
    tried = parse([f"{text} {end}" for text in dates.values()], form)
    good = np.array(list(dates))[tried.valid]
    ns, utc, valid = found.ns.copy(), found.utc.copy(), found.valid.copy()
    ns[good], utc[good], valid[good] = tried.ns[tried.valid], tried.utc[tried.valid], True
    return replace(found, ns=ns, utc=utc, valid=valid), len(good)


def _midnight(form: str) -> str | None:
    """The time of day of midnight as `form` writes it, where the date comes first; `None` where it does not."""
    date, _, time = form.partition(" ")
    if not time or _TIME.search(date) or not _TIME.search(time):
        return None
    text = re.sub(r"%f", "", time).replace("%I", "12").replace("%p", "AM")
    text = re.sub(r"%[HMS]", "00", text)
    return None if "%" in text else text
