"""NMEA sentences in quotes, before their stamp, or behind stamps that are written otherwise, made by the tests."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import reduce
from operator import xor

import numpy as np
import pytest

from flagdata.signals import WindLog

Read = Callable[..., WindLog]
START = np.datetime64("2026-05-01T12:00:05", "s")
EPOCH = 1777636805
ROWS = 30


def sentence(at: int) -> str:
    body = f"WIMWV,{200 + at:.1f},T,{3 + at % 4}.5,M,A"
    return f"${body}*{reduce(xor, body.encode()):02X}"


FORMS: dict[str, Callable[[str, str, int], str]] = {
    "quotes": lambda clock, said, at: f'"2026-05-01 {clock}","{said}"',
    "behind": lambda clock, said, at: f"{said},2026-05-01T{clock}Z",
    "behind-unix": lambda clock, said, at: f"{said} {EPOCH + at}",
    "numbered": lambda clock, said, at: f"{at},2026-05-01 {clock},{said}",
    "angles": lambda clock, said, at: f"<2026-05-01 {clock}> {said}",
    "date": lambda clock, said, at: f"Fri May  1 {clock} UTC 2026 {said}",
    "day-of-year": lambda clock, said, at: f"2026 121 {clock.replace(':', '')} {said}",
    "microseconds": lambda clock, said, at: f"{EPOCH + at}000000,{said}",
    "json": lambda clock, said, at: json.dumps({"time": f"2026-05-01T{clock}Z", "nmea": said}),
}


@pytest.mark.parametrize("form", sorted(FORMS))
def test_stamp_and_sentence_are_found_in_the_line(read: Read, form: str) -> None:
    lines = [FORMS[form](str(START + at)[11:], sentence(at), at) for at in range(ROWS)]
    zoned = form in ("behind", "behind-unix", "date", "microseconds", "json")
    log = read("\n".join(lines) + "\n", **({} if zoned else {"zone": "UTC"}), platform="fixed")
    expected = (START + np.arange(ROWS)).astype("datetime64[ns]").astype(np.int64)
    np.testing.assert_array_equal(log.series.time, expected)
    assert log.series.channels["wind_speed"][:3].tolist() == pytest.approx([3.5, 4.5, 5.5])


def test_a_sentence_with_a_wrong_checksum_stays_wrong(read: Read) -> None:
    lines = [FORMS["quotes"](str(START + at)[11:], sentence(at), at) for at in range(ROWS)]
    lines[4] = lines[4].replace("T,3.5", "T,9.5")
    log = read("\n".join(lines) + "\n", zone="UTC", platform="fixed")
    assert len(log.series.time) == ROWS - 1
    assert any("checksum" in found.what for found in log.findings)
