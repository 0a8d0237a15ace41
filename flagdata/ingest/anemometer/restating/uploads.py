"""What weather stations send to servers, as servers and consoles write it down: a query of names and values a line.

    PASSKEY=…&dateutc=2024-05-17+22:00:00&winddir=231&windspeedmph=8.32&windgustmph=11.9&tempf=55.1
    192.168.1.17 - - [17/May/2024:22:00:00 +0000] "GET /update.php?dateutc=now&winddir=231&windspeedmph=8.3 HTTP/1.1"

Source: Weather Underground, "PWS Upload Protocol" (dateutc in UTC or the word now; units in the names), which Ambient's
and Ecowitt's uploads follow. A password or key is never carried on.
"""

from __future__ import annotations

import datetime as dt
import re
from collections.abc import Sequence
from contextlib import suppress
from urllib.parse import parse_qsl

from flagdata.ingest.anemometer.restating.restate import rows_of, table
from flagdata.ingest.anemometer.text.source import TableText, TextFile

_QUERY = re.compile(r"(?:^|[?\s\"'&])((?:[A-Za-z_][\w.\[\]-]*=[^&\s\"']*&){2,}[A-Za-z_][\w.\[\]-]*=[^&\s\"']*)")
_STAMP = re.compile(r"^[\s\[\"]*(\d{4}-\d\d-\d\d[T ]\d\d:\d\d(?::\d\d(?:\.\d+)?)?(?:Z|[+-]\d\d:?\d\d)?)")
_SERVED = re.compile(r"\[(\d{2}/[A-Za-z]{3}/\d{4}:\d{2}:\d{2}:\d{2} [+-]\d{4})\]")
_SECRET = re.compile(r"pass|key|^id$|token|mac$", re.IGNORECASE)
_UNITS = {
    "tempf": "tempf [degF]", "tempinf": "indoor temperature [degF]", "indoortempf": "indoor temperature [degF]",
    "humidityin": "indoor humidity [%]", "indoorhumidity": "indoor humidity [%]", "humidity": "humidity [%]",
    "baromin": "sea level pressure [inHg]", "baromrelin": "sea level pressure [inHg]",
    "baromabsin": "air pressure [inHg]", "winddir": "winddir [deg]",
}  # fmt: skip
"""Names whose unit the protocol tells and the name does not."""
_SHARE = 0.5
_MOST = 200


def matches(lines: Sequence[str]) -> bool:
    """Half of the lines hold a query that names a wind."""
    filled = [line for line in lines if line.strip()]
    found = [row for line in filled if (row := _query(line))]
    return len(found) > _SHARE * len(filled) and any("wind" in name.lower() for row in found for name in row)


def as_table(source: TextFile) -> TableText | None:
    """A column for each name but passwords; the time the station's, or where it says "now", the server's."""
    names: dict[str, None] = {}
    rows: list[dict[str, str]] = []

    def cells(line: str) -> list[str] | None:
        row = _query(line)
        if not row or not any("wind" in name.lower() for name in row):
            return None
        names.update(dict.fromkeys(row))
        rows.append(row)
        return []

    _, other = rows_of(source, cells)
    told = any(row.get("dateutc", "now") != "now" for row in rows)
    kept = [name for name in names if name != ("logged time" if told else "dateutc")]
    if len(kept) > _MOST:
        return None
    found = [[row.get(name, "") for name in kept] for row in rows]
    return table(
        source,
        [_UNITS.get(name, name) for name in kept],
        found,
        kind="uploads",
        what="uploads of a weather station",
        left_out=other,
    )


def _query(line: str) -> dict[str, str]:
    """Names and values of the query in a line, and the server's stamp before it."""
    match = _QUERY.search(line) if "=" in line and "&" in line else None
    if match is None:
        return {}
    found: dict[str, str] = {}
    before = line[: match.start(1)]
    served, stamp = _SERVED.search(before), _STAMP.match(before)
    if served is not None:
        with suppress(ValueError):
            found["logged time"] = dt.datetime.strptime(served[1], "%d/%b/%Y:%H:%M:%S %z").isoformat()
    elif stamp is not None:
        found["logged time"] = stamp[1]
    found |= {
        name: value.strip() for name, value in parse_qsl(match[1], keep_blank_values=True) if not _SECRET.search(name)
    }
    return found
