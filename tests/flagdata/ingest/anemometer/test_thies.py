"""Telegrams of Thies' ultrasonic anemometers, as their manual describes them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import reduce
from operator import xor

import numpy as np
import pytest

from flagdata.errors import UsageError
from tests.flagdata.ingest.anemometer.conftest import read

SPEEDS = [2.0 + at % 7 / 10 for at in range(30)]
FORMS = {
    "VD": "{speed:04.1f} {away:03d}",
    "VDT": "{speed:04.1f} {away:03d} +21.5 00",
    "V4DT": "{speed:05.1f} {away:03d} +21.5 K 00",
    "deviations": "{speed:04.1f} 00.3 {away:03d} 007 +21.5 +00.1 00",
}


def framed(body: str) -> str:
    return f"\x02{body}*{reduce(xor, body.encode()):02X}\r\x03"


def log(bodies: Sequence[str], stamped: bool = True, frame: Callable[[str], str] = framed) -> str:
    stamps = [f"2026-05-01 12:00:{at:02d} " if stamped else "" for at in range(len(bodies))]
    return "".join(f"{stamp}{frame(body)}\n" for stamp, body in zip(stamps, bodies, strict=True))


def bodies(form: str) -> list[str]:
    return [FORMS[form].format(speed=speed, away=200 + at) for at, speed in enumerate(SPEEDS)]


@pytest.mark.parametrize("form", FORMS)
def test_each_fixed_telegram_is_read_behind_a_stamp(form: str) -> None:
    parsed = read(log(bodies(form)), zone="UTC", unit=None if form == "V4DT" else "m/s")
    assert "malformed-lines" not in {finding.kind for finding in parsed.findings}
    found = parsed.series.channels
    scale = 3.6 if form == "V4DT" else 1
    np.testing.assert_allclose(found["wind_speed"] * scale, SPEEDS)
    np.testing.assert_allclose(np.rad2deg(found["wind_direction"]), 200 + np.arange(30))
    if form != "VD":
        np.testing.assert_allclose(found["sonic_temperature"], 294.65)


def test_frames_that_were_lost_or_written_out_are_not_needed() -> None:
    for frame in (lambda body: framed(body)[1:-2], lambda body: f"<STX>{framed(body)[1:-2]}<ETX>"):
        found = read(log(bodies("VDT"), frame=frame), zone="UTC", unit="m/s").series.channels
        np.testing.assert_allclose(found["wind_speed"], SPEEDS)


def test_a_wrong_checksum_is_left_out_and_no_value_is_none() -> None:
    telegrams = [*bodies("VDT")[:9], "FF.F FFF +FF.F 01", *bodies("VDT")[10:]]
    found = read(log(telegrams).replace(" 204 ", " 304 "), zone="UTC", unit="m/s")
    assert len(found.series) == 29
    assert np.flatnonzero(np.isnan(found.series.channels["wind_speed"])).tolist() == [8]
    assert {"checksum-errors", "missing-values"} <= {finding.kind for finding in found.findings}


def test_a_unit_is_asked_for_where_the_telegrams_state_none_and_refused_where_they_do() -> None:
    with pytest.raises(UsageError, match="state no unit") as caught:
        read(log(bodies("VDT")), zone="UTC")
    assert "--unit" in (caught.value.fix or "")
    with pytest.raises(UsageError, match="state the unit"):
        read(log(bodies("V4DT")), zone="UTC", unit="m/s")


def test_without_stamps_the_rate_and_the_start_are_asked_for_and_taken() -> None:
    found = read(
        log(bodies("VD"), stamped=False), unit="m/s", rate=1.0, start=1_777_636_800_000_000_000
    )
    assert np.diff(found.series.time).tolist() == [10**9] * 29
