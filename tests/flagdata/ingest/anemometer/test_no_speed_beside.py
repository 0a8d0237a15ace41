"""Timers, settings and extremes below headings that hold the word of a wind are no speeds, and are named."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from flagdata.errors import InputError
from flagdata.signals import WindLog

Read = Callable[..., WindLog]


def table(names: str, cells: str) -> str:
    rows = "".join(f"2026-05-01 12:{10 * at:02d},{cells.format(at=at)}\n" for at in range(5))
    return f"stamp,{names}\n{rows}"


def test_a_timer_of_the_wind_is_no_speed(read: Read) -> None:
    text = table("Wind Speed OK Timer,Wind Speed (m/s),Max Wind Speed (m/s)", "600,{at}.5,9.{at}")
    log = read(text, zone="UTC")
    assert log.series.channels["wind_speed"] == pytest.approx([0.5, 1.5, 2.5, 3.5, 4.5])


def test_where_the_mean_holds_words_the_refusal_says_so_and_names_the_extreme(read: Read) -> None:
    text = table("Wind Speed OK Timer,Wind Speed (m/s),Max Wind Speed (m/s)", "600,OP,9.{at}")
    with pytest.raises(InputError) as refused:
        read(text, zone="UTC")
    assert "column 'Wind Speed (m/s)' holds no numbers" in refused.value.what
    assert "column 'Max Wind Speed (m/s)' holds gusts, extremes" in refused.value.what
    assert "km/day" not in str(refused.value)
    log = read(text, zone="UTC", wind="Max Wind Speed (m/s)")
    assert log.series.channels["wind_speed"] == pytest.approx([9.0, 9.1, 9.2, 9.3, 9.4])
    told = [finding.what for finding in log.findings if finding.kind == "heading-doubtful"]
    assert any("holds gusts or extremes by its heading" in what for what in told)


def test_a_number_that_never_changes_is_not_offered_a_unit(read: Read) -> None:
    with pytest.raises(InputError, match="holds nothing but 600") as refused:
        read(table("wind speed,temp", "600,1{at}"), zone="UTC")
    assert "--wind COLUMN" in (refused.value.fix or "")
    with pytest.raises(InputError) as changing:
        read(table("wind speed,temp", "6{at},1{at}"), zone="UTC")
    assert "nothing but" not in str(changing.value)
