"""What the anemometers of a table that mixes sites are called: by their site, or as SITE:COLUMN.

The column stands there where each site has several winds, and where only the user's word makes the column a wind.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace

from flagdata.ingest.anemometer.winds.found import Wind


def label_of(site: str, part: str) -> str:
    """What the user calls an anemometer of a site by; `part` is that of the row, "" where a row holds one."""
    return f"{site}:{part}" if part else site


def site_of(text: str, parts: Collection[str]) -> tuple[str, str]:
    """The site and the part of the row that a label names; `parts` are those that there are."""
    for part in sorted(parts, key=len, reverse=True):
        if part and text.endswith(f":{part}"):
            return text.removesuffix(f":{part}"), part
    return text, ""


def of_column(labels: Sequence[str], column: str) -> tuple[str, ...]:
    """The labels of the sites' anemometers in a column; none where it is itself a label, or no column of sites."""
    return () if column in labels else tuple(label for label in labels if label.endswith(f":{column}"))


def columns(winds: Sequence[Wind], *, named: bool) -> tuple[str, ...]:
    """What stands behind the site in the labels of these winds.

    Args:
        named: whether one of them is a wind by the user's word alone.
    """
    return ("",) if len(winds) == 1 and not named else tuple(one.label for one in winds)


def of_sites(winds: Sequence[Wind], site: int, sites: Sequence[str], *, named: bool) -> tuple[Wind, ...]:
    """The anemometers of each site, where column number `site` (from 0) tells sites apart."""
    behind = columns(winds, named=named)
    return tuple(
        replace(one, site=(site, name), label=label_of(name, column))
        for one, column in zip(winds, behind, strict=True) for name in sites
    )  # fmt: skip


def parts(wind: str, sites: Sequence[str]) -> Iterator[str]:
    """The parts of a user's word that may name a column: what is behind a site, the word itself, ends behind a ":"."""
    if wind in sites:
        return
    known = next((site for site in sites if wind.startswith(f"{site}:")), None)
    if known is not None:
        yield wind[len(known) + 1 :]
        return
    if not wind.isdigit() or not any(site.isdigit() for site in sites):
        yield wind
    ends = (wind[at + 1 :] for at, letter in enumerate(wind) if letter == ":" and sites)
    yield from (end for end in ends if not end.isdigit())  # a number may be the end of an address
