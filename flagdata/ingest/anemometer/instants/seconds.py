"""Stamps with seconds among others without, as where a program writes the end of a day as 24:00:00 beside 13:00."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pyarrow as pa

from flagdata.ingest.anemometer.instants.stamps import Stamps

_TO_THE_MINUTE = re.compile(r"(%[HI])([:.])%M(?!\W?%S)")
_TO_THE_SECOND = re.compile(r"%H:%M:%S")
_BARE_END = re.compile(r"(?<![\d:.])24:00(?![:\d])")
"""The end of a day without seconds."""

Parse = Callable[[Sequence[str] | pa.StringArray, str], Stamps]


def with_mixed(texts: Sequence[str] | pa.StringArray, form: str, parse: Parse) -> Stamps:
    """Stamps written as `form`; where most are, those that have seconds beside it, or a 24:00 that lacks them, as well.

    Args:
        parse: reads stamps of one format.

    Raises:
        UsageError: see `stamps.pattern`.
    """
    found = parse(texts, form)
    known = int(found.valid.sum())
    if bool(found.valid.all()) or 2 * known <= len(texts):
        return found
    finer = _TO_THE_MINUTE.sub(r"\1\2%M\2%S", form)
    if finer == form and not _TO_THE_SECOND.search(form):
        return found
    at = np.flatnonzero(~found.valid)
    text: Any = texts if isinstance(texts, pa.StringArray) else pa.array(texts, pa.string())
    others = [other or "" for other in text.take(pa.array(at)).to_pylist()]
    others = others if finer != form else [_BARE_END.sub("24:00:00", other) for other in others]
    tried = parse(others, finer)
    if not tried.valid.any():
        return found
    good = at[tried.valid]
    ns, utc, valid = found.ns.copy(), found.utc.copy(), found.valid.copy()
    ns[good], utc[good], valid[good] = tried.ns[tried.valid], tried.utc[tried.valid], True
    return replace(found, ns=ns, utc=utc, valid=valid, step=min(found.step, tried.step))
