"""What a heading says in words that are not known is told, since it may be another statistic than the mean."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from flagdata.ingest.anemometer.words.unknown_words import unknown
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
_ROWS = "".join(f"2026-05-01 12:{minute:02d},{3 + minute % 4}.5,{200 + minute}\n" for minute in range(20))


def told(log: WindLog) -> list[str]:
    return [found.what for found in log.findings if found.kind == "words-not-known"]


@pytest.mark.parametrize(
    "heading",
    ["wind_speed", "Wind Speed [m/s]", "WS_Avg", "wind 10m (km/h)", "Wind speed A", "Windgeschwindigkeit Mast"],
)  # fmt: skip
def test_headings_of_known_words_hold_none(heading: str) -> None:
    assert not unknown(heading)


def test_a_word_that_is_not_known_is_told_with_what_it_may_mean(read: Read) -> None:
    log = read(f"time,Suurimmainen wind speed [m/s],wind direction [deg]\n{_ROWS}", zone="UTC")
    (what,) = told(log)
    assert "'suurimmainen'" in what
    assert "extreme" in what


def test_a_heading_of_known_words_is_not_remarked_on(read: Read) -> None:
    assert not told(read(f"time,wind speed [m/s],wind direction [deg]\n{_ROWS}", zone="UTC"))


def test_a_column_that_the_user_named_is_not_remarked_on(read: Read) -> None:
    log = read(f"time,Suurimmainen wind speed [m/s],wind direction [deg]\n{_ROWS}", zone="UTC",
               wind="Suurimmainen wind speed [m/s]")  # fmt: skip
    assert not told(log)
