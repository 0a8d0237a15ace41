"""Tables whose lines end with the line break of HTML, as web services give them out, without it.

Time,WindSpeedMPH,DateUTC<br>
2026-05-01 00:00:00,6.8,2026-05-01 07:00:00,
<br>
"""

from __future__ import annotations

from collections.abc import Sequence

from flagdata.ingest.anemometer.text.source import TableText, TextFile

_BREAKS = ("<br>", "<br/>", "<br />")
_SHARE = 0.3


def matches(lines: Sequence[str]) -> bool:
    """Many lines end so, and none begins as a page does."""
    filled = [line for line in lines if line.strip()]
    if not filled or filled[0].lstrip().lower().startswith(("<!doctype", "<html", "<?xml")):
        return False
    return sum(line.rstrip().lower().endswith(_BREAKS) for line in filled) >= max(2, _SHARE * len(filled))


def as_table(source: TextFile) -> TableText | None:
    """The lines without the breaks, and without those that are nothing else."""
    bare = (_bare(line) for _, lines in source.blocks() for line in lines)
    return TableText.of(source, [line for line in bare if line.strip()])


def _bare(line: str) -> str:
    text = line.rstrip()
    ends = text.lower()
    return next((text[: -len(end)] for end in _BREAKS if ends.endswith(end)), line)
