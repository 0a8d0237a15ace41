"""One wind in two columns of other units is one wind, whatever unit the user says."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
MPH = np.array([3, 5, 8, 9, 12, 7, 4, 6])


def table(first: str, second: str, other: np.ndarray) -> str:
    rows = "".join(
        f"2026-05-01T12:0{at}:00Z,{m},{o:g},26{at}\n" for at, (m, o) in enumerate(zip(MPH, other, strict=True))
    )
    return f"stamp,{first},{second},winddirDegree\n{rows}"


def test_units_at_the_end_of_one_word_are_read(read: Read) -> None:
    log = read(table("windspeedMiles", "windspeedKmph", np.round(MPH * 1.609344)))
    np.testing.assert_allclose(log.series.channels["wind_speed"], MPH * 0.44704)
    np.testing.assert_allclose(np.degrees(log.series.channels["wind_direction"]), np.arange(260, 268))


def test_a_speed_that_is_another_in_other_units_is_not_read_in_the_users_unit(read: Read) -> None:
    log = read(table("wind speed A", "wind speed B", np.round(MPH * 1.609344)), unit="mph")
    np.testing.assert_allclose(log.series.channels["wind_speed"], MPH * 0.44704)
    said = " ".join(finding.what for finding in log.findings)
    assert "column 'wind speed B' is 'wind speed A' in another unit: left out" in said


@pytest.mark.parametrize("factor", [10, 100])
def test_a_speed_ten_or_a_hundred_times_another_is_the_same_wind(read: Read, factor: int) -> None:
    log = read(table("wind speed A", "wind speed B", MPH * factor), unit="mph")
    np.testing.assert_allclose(log.series.channels["wind_speed"], MPH * 0.44704)
    assert any("'wind speed B' is 'wind speed A' in another unit" in finding.what for finding in log.findings)


def test_two_anemometers_stay_two(read: Read) -> None:
    with pytest.raises(InputError, match="2 anemometers"):
        read(table("wind speed A", "wind speed B", np.array([5.0, 6, 14, 12, 21, 9, 8, 10])), unit="mph")


def test_tenths_of_a_unit_that_a_line_above_states_are_proposed_and_a_whole_one_is_contradicted(read: Read) -> None:
    lines = "FG : mean wind speed in 0.1 m/s\n\n"
    rows = "".join(f"2026-05-{day:02d}T12:00:00Z,{40 + day}\n" for day in range(1, 9))
    with pytest.raises(InputError, match=r"line 1 says '0\.1 m/s'") as refused:
        read(f"{lines}time,Wind speed\n{rows}")
    assert "--unit dm/s" in (refused.value.fix or "")
    taken = read(f"{lines}time,Wind speed\n{rows}", unit="dm/s")
    np.testing.assert_allclose(taken.series.channels["wind_speed"][0], 4.1)
    assert not any("line 1 says" in finding.what for finding in taken.findings)
    other = read(f"{lines}time,Wind speed\n{rows}", unit="m/s")
    assert any("line 1 says '0.1 m/s'; taken as m/s" in finding.what for finding in other.findings)
