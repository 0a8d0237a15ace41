"""Tables that list sites one below the other, or one value a row, with headings that are unknown or not there."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log

Write = Callable[[str], Path]
HOURS = [f"2026-05-01 {hour:02d}:00:00" for hour in range(6)]
MPS = WindOptions(unit="m/s", zone="UTC")


def stacked(heading: str, kinds: tuple[str, ...]) -> str:
    rows = [f"{kind},{hour},{number + at / 10}" for number, kind in enumerate(kinds) for at, hour in enumerate(HOURS)]
    return f"{heading},Zeitpunkt,Wind\n" + "\n".join(rows) + "\n"


@pytest.mark.parametrize("heading", ["Stadt", "ciudad", "Estação", "город", "城市", "Bezeichnung", "xyz"])
def test_places_one_below_the_other_are_each_an_anemometer(log_file: Write, heading: str) -> None:
    path = log_file(stacked(heading, ("Oslo", "Rome", "New York")))
    assert anemometers(path, MPS) == ("New York", "Oslo", "Rome")
    with pytest.raises(InputError, match="3 anemometers"):
        read_log(path, MPS)
    log = read_log(path, WindOptions(unit="m/s", zone="UTC", wind="Rome"))
    assert log.series.channels["wind_speed"] == pytest.approx([1.0, 1.1, 1.2, 1.3, 1.4, 1.5])
    assert not [finding for finding in log.findings if finding.kind == "clock-set-back"]


def test_words_that_do_not_come_once_a_stamp_tell_no_sites(log_file: Write) -> None:
    rows = [f"{'wet' if at % 3 else 'dry'},{HOURS[at // 2]},{at / 10}" for at in range(12)]
    path = log_file("weather,time,Wind\n" + "\n".join(rows) + "\n")
    assert anemometers(path, MPS) == ()


def test_points_of_the_compass_are_no_sites(log_file: Write) -> None:
    rows = [f"{HOURS[at // 2]},{at / 10},{'N' if at % 2 else 'SW'}" for at in range(12)]
    path = log_file("time,Wind,xyz\n" + "\n".join(rows) + "\n")
    assert anemometers(path, MPS) == ()


def long_table(speed: str = "WS_ms_Avg") -> str:
    rows = []
    for at in range(8):
        measured = 1_777_593_600_000 + 300_000 * at
        told = (("Hum", 50 + at), (speed, at / 10), ("Temp_C", 20 + at / 5))
        rows += [f"{measured + 900_000 + k * 3},{measured},{name},{value},Pier,37.7,-0.8,0"
                 for k, (name, value) in enumerate(told)]  # fmt: skip
    return "\n".join(rows) + "\n"


def test_one_value_a_row_without_a_heading_is_read_by_the_names_beside_the_values(log_file: Write) -> None:
    log = read_log(log_file(long_table()))
    assert log.series.channels["wind_speed"] == pytest.approx([at / 10 for at in range(8)])
    # The stamp that the readings of one moment share is theirs; the other is that of the message.
    assert np.diff(log.series.time).tolist() == [300 * 10**9] * 7
    assert int(log.series.time[0]) == 1_777_593_600 * 10**9
    assert "names-and-values" in {finding.kind for finding in log.findings}


def test_a_speed_upwards_is_no_speed_of_wind(log_file: Write) -> None:
    rows = [f"{hour},{3 + at / 10},{-at / 100},{200 + 10 * at}" for at, hour in enumerate(HOURS)]
    heading = "time,40m Wind Speed [m/s],40m Wind Vert [m/s],40m Wind Direction [deg]"
    log = read_log(log_file(f"{heading}\n" + "\n".join(rows) + "\n"), WindOptions(zone="UTC"))
    assert log.series.channels["wind_speed"] == pytest.approx([3 + at / 10 for at in range(6)])
    assert set(log.series.channels) == {"wind_speed", "wind_direction"}
