"""Codes of two letters in the meteorological records of research vessels, whose wind stands twice in each row.

WS and WD are what the instrument reads on the vessel, from the bow; TW and TI are the speed and direction over ground
that the vessel's computer makes of them, by the list of codes of the Scripps Institution of Oceanography. A second
instrument has -2 behind each. SP is the vessel's own speed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from flagdata.ingest.anemometer.words.headings import Heading

_CHANNELS = {
    "TW": "wind_speed", "TI": "wind_direction", "WS": "apparent_wind_speed", "WD": "apparent_wind_direction", "SP": "",
}  # fmt: skip


def as_coded(headings: Sequence[Heading]) -> list[Heading]:
    """The headings, of which those of the four codes are what they stand for where a table has all four."""
    names = [heading.name.strip() for heading in headings]
    if not {"TW", "TI", "WS", "WD"} <= set(names):
        return list(headings)
    found: list[Heading] = []
    for heading, name in zip(headings, names, strict=True):
        code, _, number = name.partition("-")
        channel = _CHANNELS.get(code)
        if channel is None or not (number == "" or number.isdigit()):
            found.append(heading)
            continue
        label = (number,) if number else ()
        found.append(replace(heading, channel=channel, quantity=channel, sure=True, spread=False, label=label))
    return found
