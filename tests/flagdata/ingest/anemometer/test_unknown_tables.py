"""Tables that nobody described: what is told without help, what is asked, and that nothing is silently wrong."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError, InputError, TimeError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log, sniff
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
Write = Callable[[str], Path]


def table(heading: str, cells: list[str], *, delimiter: str = ",") -> str:
    """Rows of a second each after their stamp in UTC."""
    rows = [f"2026-05-01T12:00:{at:02d}Z{delimiter}{cell}\n" for at, cell in enumerate(cells)]
    return f"Time{delimiter}{heading}\n{''.join(rows)}"


def warned(log: WindLog) -> str:
    return " ".join(finding.what for finding in log.findings)


@pytest.mark.parametrize("gap", ["----", "---", "--.-", "n/a", "NAN", "/////", "M", "***", "#N/A", "-.-"])
def test_signs_and_words_for_no_value_leave_a_column_of_numbers(read: Read, gap: str) -> None:
    log = read(table("Wind (m/s)", ["4.2", gap, gap, "5.1"]))
    assert log.series.channels["wind_speed"][[0, 3]].tolist() == [4.2, 5.1]
    assert [f.count for f in log.findings if f.kind == "missing-values"] == [2]


def test_signs_for_no_value_hold_beside_decimal_commas(read: Read) -> None:
    log = read(table("Wind (m/s)", ["4,2", "--.-", "5,1"], delimiter=";"))
    assert [f.kind for f in log.findings if f.kind.endswith("values")] == ["missing-values"]


def test_what_is_reported_of_a_draft_heeds_the_users_unit(read: Read) -> None:
    log = read(table("Wind", ["15.0", "18.1"]), unit="km/h")
    assert not any("not stated" in reason for reason in log.reasons)
    assert any("in km/h, as you said" in reason for reason in log.reasons)


def test_units_behind_numbers_are_units(read: Read) -> None:
    log = read(table("Wind,Dir", ["15.1 km/h,210°", "18.0 km/h,215°"]))
    assert log.series.channels["wind_speed"].tolist() == pytest.approx([15.1 / 3.6, 5.0])
    assert log.series.channels["wind_direction"][0] == pytest.approx(3.66519, abs=1e-4)


def test_a_number_in_another_unit_than_the_columns_is_not_read(read: Read) -> None:
    cells = ["15.1 km/h"] * 1200 + ["4.2 m/s"]
    rows = [f"2026-05-01T{12 + at // 3600:02d}:{at // 60 % 60:02d}:{at % 60:02d}Z,{c}\n" for at, c in enumerate(cells)]
    log = read(f"Time,Wind\n{''.join(rows)}")
    assert [f.count for f in log.findings if f.kind == "unreadable-values"] == [1]


def test_a_column_that_spells_the_unit_is_heeded_in_every_row(read: Read) -> None:
    cells = ["15.1,km/h"] * 1200 + ["4.2,m/s"]
    rows = [f"2026-05-01T{12 + at // 3600:02d}:{at // 60 % 60:02d}:{at % 60:02d}Z,{c}\n" for at, c in enumerate(cells)]
    log = read(f"Time,Wind,Unit\n{''.join(rows)}")
    assert log.series.channels["wind_speed"][0] == pytest.approx(15.1 / 3.6)
    assert [f.count for f in log.findings if f.kind == "sensor-fault"] == [1]


def test_rows_in_changing_units_are_refused_even_with_a_unit_given(log_file: Write) -> None:
    path = log_file(table("Wind,Unit", ["15.1,km/h", "4.2,m/s", "4.3,m/s"]))
    with pytest.raises(InputError, match="in different units: km/h, m/s"):
        read_log(path, WindOptions(unit="m/s"))


def test_a_doubt_and_what_the_stamps_lack_are_told_at_once(log_file: Write) -> None:
    path = log_file("Time,Wind\n2026-05-01 12:00:00,4.2\n2026-05-01 12:00:01,4.4\n")
    with pytest.raises(InputError) as caught:
        read_log(path, WindOptions())
    assert "--unit" in caught.value.fix
    assert "--zone" in caught.value.fix
    path = log_file("Time,Wind (m/s)\n12:00:00,4.2\n12:00:01,4.4\n")
    with pytest.raises(TimeError) as late:
        read_log(path, WindOptions())
    assert "--date" in late.value.fix
    assert "--zone" in late.value.fix


def test_the_speed_of_a_vehicle_is_never_taken_for_the_wind_unasked(log_file: Write) -> None:
    path = log_file(table("latitude,longitude,speed(mph),xSpeed(mph)", ["52.1,4.3,5,1", "52.1,4.3,6,1"]))
    assert anemometers(path) == ()
    with pytest.raises(InputError, match="may be a wind or another speed"):
        read_log(path, WindOptions())


def test_beaufort_numbers_are_refused_by_name(log_file: Write) -> None:
    path = log_file(table("Wind (Bft)", ["3", "4"]))
    for options in (WindOptions(), WindOptions(wind="Wind (Bft)", unit="m/s")):
        with pytest.raises(InputError, match="Beaufort numbers"):
            read_log(path, options)


def test_a_unit_that_contradicts_the_heading_of_a_named_column_is_told(read: Read) -> None:
    log = read(table("Airflow (km/h)", ["15", "18"]), wind="Airflow (km/h)", unit="m/s")
    assert "states km/h; taken as m/s" in warned(log)


def test_codes_for_no_value_are_none_where_components_can_be_so_large(read: Read) -> None:
    """In cm/s -99 is a metre a second; -9999 is no wind in either unit."""
    log = read(table("u (cm/s),v (cm/s)", ["-99,100", "100,-9999", "120,30"]))
    assert log.series.channels["wind_x"].tolist() == pytest.approx([-0.99, 1.0, 1.2])
    assert [f.count for f in log.findings if f.kind == "missing-values"] == [1]


def test_names_beside_values_are_anemometers(read: Read) -> None:
    rows = "".join(
        f"sensor.wind_speed,{speed},2026-05-01T12:00:{at:02d}Z\nsensor.temperature,21.5,2026-05-01T12:00:{at:02d}Z\n"
        for at, speed in enumerate((15, 18, 20))
    )
    log = read(f"entity_id,state,last_changed\n{rows}", unit="km/h")
    assert log.series.channels["wind_speed"].tolist() == pytest.approx([15 / 3.6, 5.0, 20 / 3.6])


def test_a_day_of_the_month_is_no_direction(read: Read) -> None:
    rows = "".join(f"2026,05,13,12,{minute:02d},2026,05,13,4.2,21{minute}\n" for minute in range(5))
    log = read(f"YYYY,MM,DD,HH,MI,YYYY,MM,DD,Wind speed (m/s),Wind direction (deg)\n{rows}", zone="UTC")
    assert log.series.channels["wind_direction"][0] == pytest.approx(3.66519, abs=1e-4)


def test_tenths_of_metres_a_second_are_a_unit_and_not_taken_for_kilometres_an_hour(log_file: Write) -> None:
    path = log_file(table("FF", [str(speed) for speed in (30, 40, 55, 20, 10, 30, 40, 50, 60, 70, 20)]))
    with pytest.raises(InputError, match=r"0\.1 m/s") as caught:
        read_log(path, WindOptions())
    assert "likely km/h" not in caught.value.what
    assert read_log(path, WindOptions(unit="0.1 m/s")).series.channels["wind_speed"][0] == pytest.approx(3.0)


def test_years_of_two_digits_that_may_come_first_are_asked_about(log_file: Write) -> None:
    path = log_file("Date,Time,Wind (m/s)\n26-03-14,12:00:00,4.2\n26-03-14,12:00:01,4.4\n")
    with pytest.raises(InputError, match="may be year-month-day or day-month-year"):
        read_log(path, WindOptions(zone="UTC"))
    found = read_log(path, WindOptions(zone="UTC", date_order="ymd")).series.time[0]
    assert found == 1_773_489_600_000_000_000  # 2026-03-14T12:00Z
    assert read_log(path, WindOptions(zone="UTC", date_order="dmy")).series.time[0] < found


def test_a_table_of_which_nothing_is_known_gets_a_recipe_to_complete(log_file: Write) -> None:
    guess = sniff(log_file("107,26,73,1405,4.5,197\n107,26,73,1406,3.2,224\n107,26,73,1407,3.9,210\n"))[0]
    assert guess.score == 0
    assert guess.draft is not None
    assert 'columns = ["?"]' in guess.draft


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("<?xml version='1.0'?>\n<gpx></gpx>\n", "XML"),
        ("METAR EHAM 011225Z 21012KT 9999 Q1013=\nMETAR EHAM 011255Z 21014KT 9999 Q1013=\n", "METAR"),
    ],
)
def test_text_of_another_kind_is_called_by_name_with_what_to_do(log_file: Write, text: str, says: str) -> None:
    guess = sniff(log_file(text))[0]
    assert says in guess.reasons[0]
    assert guess.fix
    with pytest.raises(FlagdataError):
        read_log(log_file(text), WindOptions())


def test_a_platform_that_moves_is_asked_about_beside_a_wind_that_does_not_say_whose(read: Read) -> None:
    text = table("Wind Speed (kn),Boat Speed (kn)", ["12,5.1", "13,5.2"])
    with pytest.raises(InputError, match="shows that the platform moves") as raised:
        read(text)
    assert "--platform moving" in (raised.value.fix or "")
    assert "wind_speed" in read(text, platform="fixed").series.channels
    moving = read(text, platform="moving")
    assert "apparent_wind_speed" in moving.series.channels
    assert "over ground" not in warned(moving)


def test_a_speed_that_nothing_calls_the_winds_is_told(read: Read) -> None:
    assert "does not say that the speed is the wind's" in warned(read(table("speed (km/h),rpm", ["15,900", "18,950"])))


def test_tabs_divide_cells_with_decimal_commas_behind_a_stamp_too(read: Read) -> None:
    rows = "".join(f"2026-05-01T12:00:{at:02d}Z\t{3 + at},5\t{200 + at}\n" for at in range(9))
    log = read(rows, columns="time,wind_speed[m/s],wind_direction[deg]")
    assert log.series.channels["wind_speed"][:2].tolist() == pytest.approx([3.5, 4.5])
    log = read("".join(row.rpartition("\t")[0] + "\n" for row in rows.splitlines()), columns="time,wind_speed[m/s]")
    assert log.series.channels["wind_speed"][:2].tolist() == pytest.approx([3.5, 4.5])


def test_a_line_of_units_of_which_few_are_of_a_wind_is_one(log_file: Write) -> None:
    """As data servers write them: CF's units of places, and quantities that are not read."""
    heads = "time,latitude,longitude,wspd,wspd_qc,wdir,chl,ph_total\n"
    units = "UTC,degrees_north,degrees_east,km h-1,,degrees_true,mg.m-3,pH_T\n"
    rows = "".join(f"2020-05-01T00:{at:02d}:00Z,51.2,2.9,{18 + at},1,{200 + at},1.2,8.01\n" for at in range(12))
    channels = read_log(log_file(heads + units + rows)).series.channels
    np.testing.assert_allclose(channels["wind_speed"], (18 + np.arange(12)) / 3.6)
    np.testing.assert_allclose(np.rad2deg(channels["wind_direction"]), 200 + np.arange(12))


def test_hours_across_of_places_without_a_day_are_named_with_what_can_be_done(log_file: Callable[[str], Path]) -> None:
    rows = [
        f"{50 + at},{-3 - at},place{at}," + ",".join(f"{(at + hour) % 7}.5" for hour in range(23)) for at in range(9)
    ]
    path = log_file("\n".join([f"lat,lon,station,{','.join(map(str, range(23)))}", *rows]) + "\n")
    with pytest.raises(FlagdataError, match="columns 4 to 26 are numbered 0 to 22") as caught:
        read_log(path, WindOptions())
    assert "each row is one reading" in (caught.value.fix or "")


def test_a_heading_without_rows_is_called_so(log_file: Callable[[str], Path]) -> None:
    with pytest.raises(FlagdataError, match="no row below it") as caught:
        read_log(log_file("Time,Wind speed,Wind direction: North(180)/South(0)\n"), WindOptions())
    assert "recorded anything" in (caught.value.fix or "")
