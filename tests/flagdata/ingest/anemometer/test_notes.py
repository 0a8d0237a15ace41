"""Notes of how a log was read, one row a kind: each is reported where it applies, and states what
was done."""

from __future__ import annotations

import datetime as dt
from collections.abc import Mapping
from functools import reduce
from operator import xor

from tests.flagdata.ingest.anemometer.conftest import read


def gill(at: int) -> str:
    """A line of a Gill WindSonic, with its checksum."""
    body = f"Q,{200 + at % 9:03d},{4 + at % 7 / 10:06.2f},M,00,"
    return f"\x02{body}\x03{reduce(xor, body.encode(), 0):02X}"


S = range(20)
TABLE = "time,wind_speed\n" + "".join(f"2026-05-01T12:00:{s:02d}Z,{4 + s % 5}\n" for s in S)
LINES = "".join(f"2026-05-01T12:00:{s:02d}Z {gill(s)}\n" for s in S)
KINDS: Mapping[str, tuple[str, Mapping[str, object], str]] = {
    "bare-dates": (
        "time,wind_speed\n"
        + "".join(f"2026-05-01 23:59:{40 + s},{4 + s % 5}\n" for s in S)
        + "2026-05-02,6\n",
        {"zone": "UTC", "recipe": "generic-csv"},
        "1 stamps are dates without a time",
    ),
    "clock-not-set": (
        TABLE,
        {"recipe": "generic-csv", "clock": "first"},
        "--clock first is not used",
    ),
    "zone-not-needed": (TABLE, {"recipe": "generic-csv", "zone": "+02:00"}, "+02:00 is not used"),
    "other-messages": (
        "".join(
            f"2026-05-01T12:00:{k:02d}Z "
            f"0R1,Dm=2{k % 10}0D,Sm={4 + k % 5}.1M\n2026-05-01T12:00:{k:02d}Z 0R2,Ta=23.6C\n"
            for k in S
        ),
        {},
        "20 other messages",
    ),
    "date-given": (
        "".join(f"12:00:{s:02d},{4 + s % 5}\n" for s in S),
        {"zone": "UTC", "date": dt.date(2026, 5, 1), "columns": "time[%H:%M:%S],wind_speed[m/s]"},
        "2026-05-01",
    ),
    "elapsed-time": (
        "".join(f"{s},{4 + s % 5}\n" for s in S),
        {"start": 1_777_636_800 * 10**9, "columns": "time[s],wind_speed[m/s]"},
        "2026-05-01T12:00:00Z, as given",
    ),
    "json-lines": (
        "".join(
            f'{{"time": "2026-05-01T12:00:{s:02d}Z", "wind_speed (m/s)": {4 + s % 5}}}\n' for s in S
        ),
        {},
        "line numbers count the heading as line 1",
    ),
    "north-mark": (LINES, {}, "north"),
    "no-stamp": (LINES + gill(1) + "\n", {}, "1 readings without a stamp; left out"),
}


def test_each_note_is_reported_where_it_applies() -> None:
    found = {kind: read(text, **options).findings for kind, (text, options, _) in KINDS.items()}
    said = {
        kind: [one.what for one in findings if one.kind == kind] for kind, findings in found.items()
    }
    lacking = {
        kind: said[kind] for kind, (*_, words) in KINDS.items() if words not in " ".join(said[kind])
    }
    assert lacking == {}
