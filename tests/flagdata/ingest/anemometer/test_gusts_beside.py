"""A gust whose heading does not say so is told by the columns beside it, and has the direction of no other gust."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from flagdata.ingest.anemometer import WindOptions, anemometers, read_log
from flagdata.rng import stream
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
Write = Callable[[str], Path]
ROWS = 40


def table(heading: str, *, factor: float) -> str:
    """Rows of a direction, a mean speed and one that is `factor` times as fast, or as often slower as faster for 1."""
    generator = stream(0, "gusts-beside")
    mean = generator.gamma(4.0, 1.0, ROWS) + 0.5
    other = mean * factor + (generator.uniform(0.1, 1.0, ROWS) if factor > 1 else generator.normal(0, 0.5, ROWS))
    rows = (
        f"2026-05-13 {at // 4:02d}:{15 * (at % 4):02d},{(at * 37) % 360},{mean[at]:.2f},{abs(other[at]):.2f}"
        for at in range(ROWS)
    )
    return "\n".join([heading, *rows]) + "\n"


def test_the_peak_gust_of_agrimet_is_no_anemometer(log_file: Write, read: Read) -> None:
    text = table("time,CHAW WD,CHAW WS,CHAW WG", factor=1.5)
    assert anemometers(log_file(text), WindOptions(unit="mph", zone="UTC")) == ()
    log = read(text, unit="mph", zone="UTC")
    assert any("'CHAW WG'" in finding.what for finding in log.findings if finding.kind == "columns-not-read")


def test_wg_alone_is_the_german_speed(read: Read) -> None:
    text = "\n".join(",".join(row.split(",")[:3]) for row in table("time,WR,WG,x", factor=1.5).splitlines())
    assert len(read(text + "\n", unit="m/s", zone="UTC").series.channels["wind_speed"]) == ROWS


def doubts(log: WindLog) -> list[str]:
    return [f.what for f in log.findings if f.kind == "heading-doubtful" and "may be its gust" in f.what]


@pytest.mark.parametrize("wind", ["wind speed A", "wind speed B"])
def test_a_wind_that_is_always_above_another_is_doubted(read: Read, wind: str) -> None:
    text = table("time,wind direction,wind speed A,wind speed B", factor=1.5)
    log = read(text, unit="m/s", zone="UTC", wind=wind)
    assert [told.split(" is above ")[0] for told in doubts(log)] == ["'wind speed B'"]


def test_two_winds_that_take_turns_are_not(read: Read) -> None:
    text = table("time,wind direction,wind speed A,wind speed B", factor=1.0)
    assert doubts(read(text, unit="m/s", zone="UTC", wind="wind speed B")) == []


def test_the_upper_wind_of_a_mast_is_not(read: Read) -> None:
    text = table("time,wind direction,wind speed 10m,wind speed 80m", factor=1.5)
    assert doubts(read(text, unit="m/s", zone="UTC", wind="wind speed 80m")) == []


def test_the_greatest_gust_of_a_day_has_a_direction_of_its_own(log_file: Write) -> None:
    rows = "".join(
        f"2026-05-13 {at // 4:02d}:{15 * (at % 4):02d},{3 + at % 5}.5,{5 + at % 6}.5,9.5,{(at * 37) % 360},{180 + at}\n"
        for at in range(ROWS)
    )
    path = log_file(
        f"time,wind speed (m/s),gust (m/s),maximum gust (m/s),wind dir (deg),maximum gust dir (deg)\n{rows}"
    )
    told = "; ".join(f.what for f in read_log(path, WindOptions(zone="UTC")).findings)
    offered = dict(re.findall(r"read '([^']+)' as a wind of its own, ingest the file once more with (\S+ \S+)", told))
    assert "6=wind_direction" not in offered["gust (m/s)"]
