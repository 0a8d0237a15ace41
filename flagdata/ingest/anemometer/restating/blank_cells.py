"""Weather files of crop models (DSSAT) in which cells are blank: cut at the ends of the headings above them.

@DATE  SRAD  TMAX  TMIN  RAIN  DEWP  WIND
96001  21.8  32.4  22.1   0.0         1.7

Source: DSSAT v4.5, volume 2, "Input and output files": the names of a section stand in a line that begins with @, and
its cells below are aligned with the ends of these.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from flagdata.ingest.anemometer.restating.restate import table
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_HEADING = re.compile(r"@\s?(?:DATE|YRDAY|YYDDD)\s", re.IGNORECASE)
_WORD = re.compile(r"\S+")
_REMARK = ("!", "*", "$")


def matches(lines: Sequence[str]) -> bool:
    """Whether rows below such a line leave cells blank."""
    at = _heading(lines)
    if at is None:
        return False
    count = len(_WORD.findall(lines[at].replace("@", " ", 1)))
    return any(0 < len(line.split()) < count for line in lines[at + 1 :] if not line.startswith(_REMARK))


def as_table(source: TextFile) -> TableText | None:
    """The rows with their blank cells; `None` where a cell ends where no heading does."""
    lines = list(source.each_line())
    at = _heading(lines)
    if at is None:
        return None
    heading = lines[at].replace("@", " ", 1)
    names, ends = heading.split(), [word.end() for word in _WORD.finditer(heading)]
    rows: list[list[str]] = []
    for line in lines[at + 1 :]:
        if not line.strip("\x1a \t") or line.startswith(_REMARK):
            continue
        words = {word.end(): word[0] for word in _WORD.finditer(line.rstrip("\x1a"))}
        if not set(words) <= set(ends):
            return None
        rows.append([words.get(end, "") for end in ends])
    what = f"cells are blank below line {at + 1}: cut at the ends of its {len(names)} names"
    return table(source, names, rows, kind="blank-cells", what=what)


def _heading(lines: Sequence[str]) -> int | None:
    return next((at for at, line in enumerate(lines) if _HEADING.match(line)), None)
