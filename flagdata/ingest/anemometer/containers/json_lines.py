"""JSON lines of flat objects: one reading a line, whose names become the heading of a table."""

from __future__ import annotations

import csv
import io
import json

from flagdata.core.findings import Finding, Severity
from flagdata.errors import InputError
from flagdata.ingest.anemometer.text.text_file import TableText, TextFile

_NAMES = 2000


def as_table(source: TextFile) -> TableText:
    """Converts JSON objects to rows of a table; the first object names the columns, other lines are
    left out.

    Raises:
        InputError: objects that hold others, or no row.
    """
    names: list[str] = []
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    left_out = 0
    for line in source.each_line():
        if not line.strip():
            continue
        try:
            value = json.loads(line)
        except (ValueError, RecursionError):
            value = None
        if not isinstance(value, dict):
            left_out += 1
            continue
        if any(isinstance(item, (dict, list)) for item in value.values()) or len(value) > _NAMES:
            fix = "write one flat object a line: its time and its wind, or a CSV"
            raise InputError("the objects hold objects or lists", where=str(source.path), fix=fix)
        if not names:
            names = list(value)
            writer.writerow(names)
        writer.writerow([_text(value.get(name)) for name in names])
    lines = out.getvalue().splitlines()
    if len(lines) < 2:
        raise InputError(
            "there is no row in the JSON lines",
            where=str(source.path),
            fix="check that the logger recorded anything",
        )
    findings = [Finding.of("json-lines", "line numbers count the heading as line 1")]
    if left_out:
        message = f"{left_out} lines are no JSON object; left out"
        findings.append(
            Finding(kind="malformed-lines", severity=Severity.WARNING, count=left_out, what=message)
        )
    return TableText.of(source, lines, findings)


def _text(value: object) -> str:
    return "" if value is None else " ".join(str(value).split())
