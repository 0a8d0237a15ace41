"""A direction and a speed in one cell are two quantities, with the unit that stands there."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer import WindOptions, read_log

Write = Callable[[str], Path]


@pytest.mark.parametrize(
    ("heading", "cell", "options", "speed", "direction"),
    [
        ("Wind", "WSW 3.6 km/h", {}, 1.0, 247.5), ("Wind", "SW at 3.6 km/h", {}, 1.0, 225.0),
        ("Wind", "240@12", {"unit": "kn"}, 12 * 1852 / 3600, 240.0),
        ("dir/spd", "240/12", {"unit": "m/s"}, 12.0, 240.0),
        ("Viento", "36 km/h NE", {}, 10.0, 45.0), ("Wind", "240° 10 m/s", {}, 10.0, 240.0),
    ],
)  # fmt: skip
def test_direction_and_speed_in_one_cell_are_both_read(
    log_file: Write, heading: str, cell: str, options: dict[str, str], speed: float, direction: float
) -> None:
    rows = "".join(f"2026-05-01T12:00:{at:02d}Z,{cell},{at}\n" for at in range(12))
    channels = read_log(log_file(f"time,{heading},battery\n{rows}"), WindOptions(**options)).series.channels  # type: ignore[arg-type]
    np.testing.assert_allclose(channels["wind_speed"], speed)
    np.testing.assert_allclose(np.rad2deg(channels["wind_direction"]), direction)


@pytest.mark.parametrize(
    ("heading", "cells", "degrees"),
    [
        ("Wiatr", ["zach.pn.-zach. 36 km/h", "pd. 36 km/h", "pn.-wsch. 36 km/h"], [292.5, 180.0, 45.0]),
        ("viento", ["SO 36 km/h", "SSO 36 km/h", "E 36 km/h"], [225.0, 202.5, 90.0]),
        ("Wind", ["Nordwest 36 km/h", "SÜD 36 km/h", "Ost 36 km/h"], [315.0, 180.0, 90.0]),
        ("Vent", ["36 km/h nord", "36 km/h sud-ouest", "36 km/h est"], [0.0, 225.0, 90.0]),
    ],
)  # fmt: skip
def test_points_in_words_of_other_languages_stand_beside_their_speed(
    log_file: Write, heading: str, cells: list[str], degrees: list[float]
) -> None:
    rows = "".join(f"2026-05-01T12:{at:02d}:00Z,{cells[at % 3]},{at}\n" for at in range(12))
    channels = read_log(log_file(f"time,{heading},battery\n{rows}")).series.channels
    np.testing.assert_allclose(channels["wind_speed"], 10.0)
    np.testing.assert_allclose(np.rad2deg(channels["wind_direction"]), degrees * 4, atol=1e-9)


def test_points_that_may_be_east_or_west_are_not_split_from_their_speed(log_file: Write) -> None:
    rows = "".join(f"2026-05-01T12:{at:02d}:00Z,{'O' if at % 2 else 'N'} 36 km/h\n" for at in range(12))
    with pytest.raises(FlagdataError):
        read_log(log_file(f"time,Wind\n{rows}"))


def test_a_column_of_points_beside_its_speed_is_left_as_it_is(log_file: Write) -> None:
    rows = "".join(f"2026-05-01T12:00:{at:02d}Z,WSW,3.5\n" for at in range(12))
    channels = read_log(log_file(f"time,Wind,Wind speed (m/s)\n{rows}")).series.channels
    np.testing.assert_allclose(np.rad2deg(channels["wind_direction"]), 247.5)


def _pairs(heading: str, cells: list[str], separator: str = ";") -> str:
    rows = "".join(f"2026-05-01 12:{at:02d}{separator}{cells[at % len(cells)]}\n" for at in range(12))
    return f"{heading}\n{rows}"


@pytest.mark.parametrize(
    ("heading", "cells", "first"),
    [
        ("time;velocità/direzione", ["2.5/40", "3.5/30"], (2.5, 40.0)), ("time;speed/dir", ["12/40"], (12.0, 40.0)),
        ("time;Richtung/Geschwindigkeit", ["40/12"], (12.0, 40.0)), ("time;wind", ["2.5/40", "3.5/340"], (2.5, 40.0)),
        ("time;wind", ["40/2.5", "340/3.5"], (2.5, 40.0)), ("time;wind", ["1,5/40", "2,5/50"], (1.5, 40.0)),
        ("time;wind speed and direction", ["2.5/40"], (2.5, 40.0)), ("time;wind", ["40/12"], (12.0, 40.0)),
    ],
)  # fmt: skip
def test_two_numbers_are_told_apart_by_the_headings_order_or_their_values(
    log_file: Write, heading: str, cells: list[str], first: tuple[float, float]
) -> None:
    channels = read_log(log_file(_pairs(heading, cells)), WindOptions(unit="m/s", zone="UTC")).series.channels
    assert channels["wind_speed"][0] == first[0]
    assert np.rad2deg(channels["wind_direction"][0]) == pytest.approx(first[1])


@pytest.mark.parametrize("stamp", ["yyyy-mm-dd hh:mm", "AAAA-MM-GG HH:MM", "JJJJ-MM-TT hh:mm"])
def test_a_heading_that_is_the_format_of_the_stamps_is_no_direction(log_file: Write, stamp: str) -> None:
    text = _pairs(f"{stamp};value", ["1.5/50", "0.7/279", "2.0/310"])
    log = read_log(log_file(text), WindOptions(unit="m/s", zone="UTC"))
    np.testing.assert_allclose(np.rad2deg(log.series.channels["wind_direction"]), [50, 279, 310] * 4)
    np.testing.assert_allclose(log.series.channels["wind_speed"], [1.5, 0.7, 2.0] * 4)
    assert any("'value' is a wind" in finding.what for finding in log.findings if finding.kind == "heading-doubtful")


def test_fractions_below_a_heading_that_says_nothing_are_no_wind(log_file: Write) -> None:
    text = _pairs("time;done;wind speed (m/s)", ["1.5/340;4.0", "2.5/360;5.0"])
    assert "wind_direction" not in read_log(log_file(text), WindOptions(zone="UTC")).series.channels
