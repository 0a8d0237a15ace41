"""The unit of the wind that lines above a table's heading state."""

from __future__ import annotations

import re
from collections.abc import Sequence

from flagdata.units import spelled
from flagdata.units import unit as unit_of

_STATED = re.compile(
    r"\bunits?\s*[:=]\s*([A-Za-z/]{1,20}(?:\s?[A-Za-z/.]+){0,2}(?:-1)?)\s*(?=$|[,;)\]])", re.IGNORECASE
)
"""How lines above a heading state a unit."""
_UNIT_WORD = re.compile(
    r"(?:(?P<tenth>(?<![\d.,])0[.,]1|\b1/10|\btenths? of(?: an?)?)\s*\*?\s*)?"
    r"(?<![\w/])(?P<unit>km/d(?:ay)?|km/?h|kph|kmph|m/s(?:ec)?|m s-1|mph|kts?|kn|knots?|knoten|n[oœ]e?uds|nudos|ft/s|"
    r"(?:kilomet|met)(?:er|re)s? per (?:hour|second)|miles per hour)(?![\w/])",
    re.IGNORECASE,
)
"""Units of speed as a title names them, and tenths of them."""
_COMMENT = ("#", ";", "%", "!")
"""How lines begin that are no rows."""


def above(lines: Sequence[str], preamble: int) -> tuple[str, int, str] | None:
    """The unit that lines above a table, and comments in it, state; see `stated_unit`.

    Args:
        preamble: lines above the one that names the columns.
    """
    return stated_unit(
        [line if at < preamble or line.lstrip()[:1] in _COMMENT else "" for at, line in enumerate(lines)]
    )


def contradiction(lines: Sequence[str], preamble: int, told: str) -> tuple[str, ...]:
    """A warning where lines above a table state another unit than the user says; none where they do not."""
    stated = above(lines, preamble)
    if stated is None or stated[0] == told:
        return ()
    return (f"line {stated[1]} says {stated[2]!r}; taken as {told}, as you said",)


def stated_unit(lines: Sequence[str]) -> tuple[str, int, str] | None:
    """The one unit of speed that lines above the heading state, as "Units: mph", the line's number and the words."""
    found: dict[str, tuple[str, int, str]] = {}
    for number, line in enumerate(lines, start=1):
        for match in _STATED.finditer(line):
            name = spelled(match[1])
            if name is not None and unit_of(name).si == "m/s":
                found.setdefault(name, (name, number, match[0]))
    if not found:
        for number, line in enumerate(lines, start=1):
            for match in _UNIT_WORD.finditer(line):
                name = spelled(f"0.1 {match['unit']}" if match["tenth"] else match["unit"])
                if name is None and match["tenth"]:
                    return None  # tenths of a unit that has no name here: nothing is stated that can be taken
                if name is not None and unit_of(name).si == "m/s":
                    found.setdefault(name, (name, number, match[0]))
    return next(iter(found.values())) if len(found) == 1 else None
