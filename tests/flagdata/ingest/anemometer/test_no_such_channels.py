"""Columns that are called after a wind or the weather and are something else; companions and units that tell which."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from flagdata.errors import InputError
from flagdata.ingest.anemometer.text.kinds import is_unit
from flagdata.ingest.anemometer.words.headings import understand
from flagdata.signals import WindLog
from flagdata.units import canonical

Read = Callable[..., WindLog]


def table(heading: str, row: Callable[[int], str], rows: int = 20) -> str:
    return f"{heading}\n" + "".join(f"2026-05-01T12:{at:02d}:00Z,{row(at)}\n" for at in range(rows))


@pytest.mark.parametrize("heading", ["WSpeed_height", "wind_hgt", "Wind speed height", "Vessel speed [Knt]",
                                     "ship_speed (kn)", "Vessel course", "ship heading (deg)"])  # fmt: skip
def test_heights_of_masts_and_speeds_of_ships_are_no_wind(heading: str) -> None:
    assert understand(heading).channel == ""


@pytest.mark.parametrize(
    "heading", ["Wind speed at 10 m height (m/s)", "Ship wind speed (kn)", "height wind speed m/s"]
)
def test_a_wind_at_a_height_or_on_a_ship_is_one(heading: str) -> None:
    assert understand(heading).channel == "wind_speed"


def test_a_height_of_the_mast_is_not_read_before_the_speed(read: Read) -> None:
    log = read(table("time,WSpeed_height,WSpeed", lambda at: f"2,{3 + at % 4}.5"), unit="m/s")
    assert log.series.channels["wind_speed"][:2].tolist() == pytest.approx([3.5, 4.5])


def test_a_table_of_a_ships_way_has_no_wind_that_is_offered(read: Read) -> None:
    text = table(
        "time,Vessel heading [deg],Vessel track [deg],Vessel speed [Knt]", lambda at: f"{190 + at},127.{at},0.8"
    )
    with pytest.raises(InputError, match="no column is surely a wind") as caught:
        read(text)
    assert "wind_direction" not in (caught.value.fix or "")
    assert "wind_speed" not in (caught.value.fix or "")


@pytest.mark.parametrize(
    "unit", ["W/m²", "W/m^2", "W/m**2", "W m⁻²", "mmol/m³", "m·s⁻¹", "m s**-1", "kW", "g·m⁻³", "µmol m⁻² s⁻¹"]
)
def test_powers_are_understood_as_they_are_set(unit: str) -> None:
    assert is_unit(unit)


@pytest.mark.parametrize("unit", ["m·s⁻¹", "m s**-1", "m⋅s^-1", "m s⁻¹"])
def test_a_speed_with_its_power_in_any_spelling_is_in_metres_a_second(unit: str) -> None:
    assert canonical(unit) == "m/s"


def test_a_row_of_units_with_powers_states_the_winds(read: Read) -> None:
    rows = "".join(f"2026-05-01T12:{at:02d}:00Z,0.02,-3.{at},7{at % 9},{at},{at},{3 + at % 4}.0\n" for at in range(20))
    text = f'Timestamp,Factor,Power,Temp,Sun2,Sun,WindSpeed\n"","","kW","°F","W/m²","W/m²","mph"\n{rows}'
    assert read(text).series.channels["wind_speed"][0] == pytest.approx(3 * 0.44704)


@pytest.mark.parametrize(
    ("heading", "unit"),
    [
        ("BP_Change", "Pa"), ("BP_Tendency", ""), ("Pressure tendency 3h", "hPa"), ("Baro trend", "hPa"),
        ("BP_Elevation", ""), ("Temp_H", "m"), ("Temp_H", ""), ("Temp_hr24", ""), ("soiltemp_10", "degC"),
        ("GroundTemp", "degC"), ("grasstemp", "degC"), ("Temp change", "degC"),
    ],
)  # fmt: skip
def test_changes_heights_hours_and_the_ground_are_no_weather(heading: str, unit: str) -> None:
    assert understand(heading, unit).channel == ""


@pytest.mark.parametrize(
    ("heading", "channel"),
    [
        ("BP (Pa)", "air_pressure"), ("Temp 2m height (degC)", "air_temperature"), ("RH_H2 (%)", "relative_humidity"),
        ("Temperature 1 hour mean (degC)", "air_temperature"), ("Temp 2m above ground (degC)", "air_temperature"),
    ],
)  # fmt: skip
def test_the_weather_beside_is_still_read(heading: str, channel: str) -> None:
    assert understand(heading).channel == channel


def test_the_pressure_is_not_taken_from_its_change(read: Read) -> None:
    text = table("time,wind speed (m/s),BP_Change (Pa),BP (Pa)", lambda at: f"{3 + at % 4}.5,{160 + at},{93_280 + at}")
    assert read(text).series.channels["air_pressure"][0] == pytest.approx(93_280)


def test_direct_radiation_beside_diffuse_is_no_vane(read: Read) -> None:
    text = table("time,Ws (m/s),SWdir,SWdif,SW", lambda at: f"{3 + at % 4}.5,{20 * at},{at},{21 * at}")
    log = read(text)
    assert "wind_direction" not in log.series.channels
    assert not any("converter" in f"{found.what} {found.fix}" for found in log.findings)
    beside_nothing = table("time,SWspd (m/s),SWdir", lambda at: f"{3 + at % 4}.5,{10 + 17 * at}")
    assert "wind_direction" in read(beside_nothing).series.channels


def test_a_direction_and_a_deviation_under_its_name_say_that_u_is_the_speed(read: Read) -> None:
    row: Callable[[int], str] = lambda at: f"{3 + at % 4}.5,0.{at % 9 + 1},{10 + 17 * at},{20 + at}"  # noqa: E731
    log = read(table("time,U (m/s),Ustd,Udir,Udir_std", row))
    assert log.series.channels["wind_speed"][0] == pytest.approx(3.5)
    assert "wind_direction" in log.series.channels
    with pytest.raises(InputError, match="may be a wind or another speed"):
        read(table("time,U (m/s),P,Q,R", row))


@pytest.mark.parametrize(
    "heading",
    [
        "Vap_Press_Avg (kPa)",
        "Pod Humidity (%)",
        "saturation vapour pressure (hPa)",
        "PTemp_C_Avg (degC)",
        "PanelT (degC)",
    ],
)
def test_other_pressures_and_humidities_are_not_those_of_the_air(heading: str) -> None:
    assert understand(heading).quantity == ""


@pytest.mark.parametrize(("heading", "value", "read_as"), [
    ("humidity", "6.1", False), ("humidity", "61.5", True), ("RH", "6.1", True),
    ("Relative Humidity (mA)", "56.3", False),
])  # fmt: skip
def test_a_humidity_without_a_unit_is_in_percent_where_it_can_be_nothing_else(
    read: Callable[..., WindLog], heading: str, value: str, read_as: bool
) -> None:
    rows = [f"2026-05-01T12:{at:02d}:00Z,{3 + at % 4}.5,{value}" for at in range(20)]
    log = read("\n".join([f"Time,Wind speed (m/s),{heading}", *rows]) + "\n")
    assert ("relative_humidity" in log.series.channels) == read_as
