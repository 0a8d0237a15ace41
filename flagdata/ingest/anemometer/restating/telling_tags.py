"""Tags of series or points that tell sites apart: as few as do it, and of these the ones by which sites are called."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from flagdata.ingest.anemometer.words.headings import words_of

_CALLED = frozenset({"station", "site", "sensor", "device", "location", "node", "mast", "buoy", "anemometer"})
"""Words of tags by which sites are called rather than by others that tell them apart as well."""


def telling(rows: Iterable[Mapping[str, str]], tags: Sequence[str], *, first: str | None = None) -> list[str]:
    """The tags that tell sites apart: one that does it alone, else as few as do it together; none where all are alike.

    Args:
        rows: the tags of each series or point with their values; one that is absent is a value of its own.
        tags: those that may tell.
        first: the one that is taken before all others where it tells as much.
    """
    ordered = sorted(tags, key=lambda tag: tag != first and _CALLED.isdisjoint(words_of(tag)))
    kinds = {tuple(row.get(tag, "") for tag in ordered) for row in rows}
    columns = {tag: [one[at] for one in kinds] for at, tag in enumerate(ordered)}
    alone = next((tag for tag in ordered if len(kinds) > 1 and len(set(columns[tag])) == len(kinds)), None)
    if alone is not None:
        return [alone]
    chosen: list[str] = []
    count = 1
    for tag in ordered:
        now = len(set(zip(*(columns[one] for one in (*chosen, tag)), strict=True)))
        if now > count:
            chosen, count = [*chosen, tag], now
    return chosen
