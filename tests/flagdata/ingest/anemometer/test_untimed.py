"""Logs whose rows carry no time, on the clock that the user gives: a start and a rate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import fields
from functools import reduce
from operator import xor
from pathlib import Path

import numpy as np
import pytest

from flagdata.core.json_values import json_values
from flagdata.errors import FlagdataError, UsageError
from flagdata.ingest import WindOptions, read_log
from flagdata.record.signals import WindLog
from tests.flagdata.ingest.anemometer.conftest import read

Write = Callable[[str], Path]
_START = 1_777_636_800 * 10**9
"""2026-05-01T12:00:00Z."""


def since_start(log: WindLog) -> list[float]:
    return ((log.series.time - _START) / 1e9).tolist()


def sentence(text: str) -> str:
    return f"${text}*{reduce(xor, text.encode(), 0):02X}\n"


@pytest.mark.parametrize("decimal", [".", ","])
def test_rows_of_a_table_are_counted_from_the_start_at_the_rate(decimal: str) -> None:
    rows = "".join(f"{7.2 + at};{180 + at}\n".replace(".", decimal) for at in range(8))
    log = read(f"Wind speed (km/h);Direction\n{rows}", start=_START, rate=4.0)
    assert since_start(log) == [at / 4 for at in range(8)]
    assert log.series.channels["wind_speed"].tolist() == pytest.approx(
        [(7.2 + at) / 3.6 for at in range(8)]
    )
    assert np.degrees(log.series.channels["wind_direction"]).tolist() == pytest.approx(
        [180.0 + at for at in range(8)]
    )
    assert [finding.kind for finding in log.findings if "as given" in finding.what] == [
        "rate-given"
    ]


def test_sentences_of_the_most_frequent_wind_tick_and_the_others_come_with_them() -> None:
    rows = "".join(
        sentence(f"WIMWV,{100 + at}.0,R,{4 + at}.0,N,A") + sentence("YXXDR,C,16.0,C,T")
        for at in range(6)
    )
    log = read(rows, start=_START, rate=2.0, platform="fixed", azimuth=0.0)
    assert since_start(log) == [at / 2 for at in range(6)]
    assert log.series.channels["wind_speed"].tolist() == pytest.approx(
        [(4 + at) * 1852 / 3600 for at in range(6)]
    )


def test_a_rate_needs_a_start(log_file: Write) -> None:
    with pytest.raises(UsageError) as caught:
        read_log(log_file("wind speed [m/s],x\n3,1\n4,1\n"), WindOptions(rate=1.0))
    assert "--start" in caught.value.fix


@pytest.mark.parametrize("rate", [0.0, -1.0, float("nan"), float("inf")])
def test_a_rate_that_is_none_is_refused(rate: float) -> None:
    with pytest.raises(UsageError):
        WindOptions(rate=rate)


def test_a_rate_is_refused_for_what_is_no_log(log_file: Write) -> None:
    with pytest.raises(UsageError, match="neither a table nor sentences"):
        read_log(
            log_file("Dear reader\nthis is\nno log\nat all\n"), WindOptions(rate=1.0, start=_START)
        )


def test_a_stream_without_a_time_says_what_is_needed(log_file: Write) -> None:
    path = log_file("".join(sentence(f"WIMWV,{at}.0,R,4.0,N,A") for at in range(10, 20)))
    with pytest.raises(FlagdataError) as caught:
        read_log(path, WindOptions())
    assert "--start TIME --rate HZ" in caught.value.fix


def test_options_without_a_rate_keep_their_hash() -> None:
    assert "rate" not in json_values(WindOptions())
    assert json_values(WindOptions(rate=2.0, start=_START))["rate"] == 2.0


def test_all_options_but_limits_shape_the_hash() -> None:
    assert {*WindOptions.JSON_NAMES, "limits"} == {one.name for one in fields(WindOptions)}


def test_generated_stamps_give_no_finding() -> None:
    kinds = [
        f"$IIVWR,{80 + at},L,5.{at},N,,,,\n$IIVWT,{70 + at},L,4.{at},N,,,,\n" for at in range(6)
    ]
    log = read("".join(kinds), start=_START, rate=1.0)
    assert since_start(log) == [at / 2 for at in range(12)]
    assert "they are on the clock that was given" in log.reasons[0]
    assert "computer's stamp" not in " ".join(log.reasons)
    said = {finding.kind: finding for finding in log.findings}
    assert {"rate-given", "counted-together"} <= set(said)
    assert {"coarse-stamps", "held-stamps", "equal-stamps", "uneven-stamps"}.isdisjoint(said)
    assert said["counted-together"].count == 6


def test_lines_of_an_instrument_are_on_the_clock_that_was_given() -> None:
    log = read("".join(f"Q,{at:03d},00{at}.10,M,00,\n" for at in range(6)), start=_START, rate=1.0)
    assert "they carry no time of their own: they are on the clock that was given" in log.reasons
