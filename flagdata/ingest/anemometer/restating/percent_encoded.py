"""Headings that a web service wrote in the encoding of URLs (RFC 3986, section 2.1): "Wind Speed%2C avg (m%2Fs)".

Each cell of the heading is decoded, and references to characters that were encoded with it ("&#176;") as well.
"""

from __future__ import annotations

import csv
import html
import io
import re
from collections.abc import Sequence
from urllib.parse import unquote

from flagdata.ingest.anemometer.text.layout import cut
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_ENCODED = re.compile(r"(?<=[^\s,;\t\"])%(?:[2357][0-9A-F]|C2%B[0-9])(?=[^\s,;\t\"])")
"""What stands for a sign within a word; "RH% 20" and a mere "%" do not."""
_FIRST = 10
"""Lines in which a heading is looked for."""


def matches(lines: Sequence[str]) -> bool:
    """Whether one of the first lines holds encoded signs."""
    return _heading(lines) is not None


def as_table(source: TextFile) -> TableText | None:
    """The file with its heading decoded."""
    at = _heading(source.head())
    if at is None:
        return None
    lines = list(source.each_line())
    sign = max(",;\t", key=lines[at].count)
    out = io.StringIO()
    csv.writer(out, delimiter=sign, lineterminator="").writerow(
        html.unescape(unquote(cell)) for cell in cut(lines[at], sign)
    )
    return TableText.of(source, [*lines[:at], out.getvalue(), *lines[at + 1 :]])


def _heading(lines: Sequence[str]) -> int | None:
    return next((at for at, line in enumerate(lines[:_FIRST]) if len(_ENCODED.findall(line)) > 1), None)
