"""Points of the compass in the letters and words of several languages: read right, or asked for."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata import compass
from flagdata.ingest.anemometer import WindOptions, read_log
from flagdata.signals import WindLog

Write = Callable[[str], Path]


def _log(log_file: Write, heading: str, points: list[str], **options: str) -> WindLog:
    rows = "".join(f"2026-05-01T12:00:{at:02d}Z;3.{at % 10};{points[at % len(points)]}\n" for at in range(30))
    return read_log(log_file(f"Time;Wind Speed (m/s);{heading}\n{rows}"), WindOptions(**options))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("heading", "points", "degrees"),
    [
        ("Wind Direction", ["N", "ENE", "SW"], [0, 67.5, 225]),
        ("Wind direction", ["South", "North-East", "west southwest"], [180, 45, 247.5]),
        ("Dirección del viento", ["O", "SO", "NNO"], [270, 225, 337.5]),
        ("Windrichtung", ["O", "SO", "NNO"], [90, 135, 22.5]),
        ("Wind", ["Ost", "Südwest", "Nord"], [90, 225, 0]),
        ("Wind", ["OSO", "WSW", "NO"], [112.5, 247.5, 45]),
        ("Wind", ["OSO", "E", "NE"], [247.5, 90, 45]),
        ("Wind direction", ["Noroeste", "Sur", "Estenoreste"], [315, 180, 67.5]),
        ("Direction du vent", ["Nord-Ouest", "Est", "Sud-Sud-Est"], [315, 90, 157.5]),
        ("Windrichting", ["ZW", "NO", "ZZO"], [225, 45, 157.5]),
        ("Wind direction", ["SV", "NØ", "VSV"], [225, 45, 247.5]),
        ("Wind direction", ["KKB", "D", "GB"], [337.5, 90, 225]),
        ("Wind direction", ["СЗ", "В", "ЮЮВ"], [315, 90, 157.5]),
        ("DD", [f"Ветер, дующий с {point}" for point in ("юго-юго-запада", "севера", "востоко-северо-востока")],
         [202.5, 0, 67.5]),
        ("DD", [f"Wind blowing from the {point}" for point in ("south-southwest", "north", "east-northeast")],
         [202.5, 0, 67.5]),
        ("Wind direction", ["Северо-запад", "Юг", "Восток"], [315, 180, 90]),
        ("風向", ["南西", "北", "東北東"], [225, 0, 67.5]),
    ],
)  # fmt: skip
def test_points_of_the_compass_are_read_in_the_language_that_they_are_in(
    log_file: Write, heading: str, points: list[str], degrees: list[float]
) -> None:
    log = _log(log_file, heading, points)
    np.testing.assert_allclose(np.rad2deg(log.series.channels["wind_direction"][:3]), degrees)


def test_an_o_that_may_be_east_or_west_is_left_out_and_asked_for(log_file: Write) -> None:
    log = _log(log_file, "Direction", ["O", "SO", "N"])
    assert "wind_direction" not in log.series.channels
    said = " ".join(finding.what for finding in log.findings)
    assert "east or west" in said
    line = "Time=time,Wind Speed (m/s)=wind_speed[m/s],Direction=wind_direction[points-de]"
    assert np.rad2deg(_log(log_file, "Direction", ["O"], columns=line).series.channels["wind_direction"][0]) == 90


@pytest.mark.parametrize("word", ["calm", "VRB", "cv", "Windstille", "Calm, no wind", "Штиль, безветрие"])
def test_calm_and_variable_wind_have_no_direction(log_file: Write, word: str) -> None:
    direction = _log(log_file, "Wind Direction", ["N", word, "SW"]).series.channels["wind_direction"]
    assert np.isnan(direction[1])
    assert direction[0] == 0.0


def test_an_angle_that_is_not_clockwise_from_north_is_no_direction_of_the_wind(log_file: Write) -> None:
    log = _log(log_file, "wind angle (deg ccw from east)", ["12", "48", "300"])
    assert "wind_direction" not in log.series.channels
    assert any("ccw" in finding.what for finding in log.findings)


@pytest.mark.parametrize("heading", ["wind_deg", "WindAngle", "Wind Angle", "wind angle (deg)", "WindDirection(d)"])
def test_degrees_of_the_wind_are_its_direction(log_file: Write, heading: str) -> None:
    log = _log(log_file, heading, ["12", "48", "300"])
    np.testing.assert_allclose(np.rad2deg(log.series.channels["wind_direction"][:3]), [12, 48, 300])


@pytest.mark.parametrize("unit", list(compass.BY_UNIT))
def test_every_table_of_points_has_sixteen_directions(unit: str) -> None:
    assert sorted(set(compass.BY_UNIT[unit].values())) == [22.5 * at for at in range(16)]


def test_sixteenths_are_an_eighth_of_pi_each(log_file: Write) -> None:
    rows = "".join(f"2026-05-01T12:00:{at:02d}Z,3.5,{at}\n" for at in range(16))
    path = log_file(f"time,Wind speed (m/s),Wind direction\n{rows}")
    assert any("sixteenths" in finding.what for finding in read_log(path).findings)
    line = "time,wind_speed[m/s],wind_direction[sixteenths]"
    log = read_log(path, WindOptions(columns=line))
    np.testing.assert_allclose(np.rad2deg(log.series.channels["wind_direction"]), 22.5 * np.arange(16))
    assert any("counted clockwise from north, the first of which is 0" in finding.what for finding in log.findings)


def test_numbers_up_to_16_are_no_sixteen_sectors_counted_from_0(log_file: Write) -> None:
    rows = "".join(f"2026-05-01T12:00:{at:02d}Z,3.5,{at}\n" for at in range(17))
    log = read_log(log_file(f"time,Wind speed (m/s),Wind direction\n{rows}"))
    assert "wind_direction" not in log.series.channels
    assert not any("[sixteenths]" in finding.what for finding in log.findings)


@pytest.mark.parametrize(("constant", "doubted"), [("4", True), ("30", True), ("0", False), ("270", False)])
def test_a_small_direction_that_never_changes_is_doubted(log_file: Write, constant: str, doubted: bool) -> None:
    """A vane that counts sixteenths may stand still for as long as a file lasts; 0 is the north in all units."""
    rows = "".join(f"2026-05-01T12:00:{at:02d}Z,3.5,{constant}\n" for at in range(16))
    log = read_log(log_file(f"time,Wind speed (m/s),Wind direction\n{rows}"))
    assert np.rad2deg(log.series.channels["wind_direction"][0]) == pytest.approx(float(constant))
    assert any("sixteenth of the compass" in finding.what for finding in log.findings) is doubted
