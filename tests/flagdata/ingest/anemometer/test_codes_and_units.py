"""Values that are no wind are never taken for one, and a unit in doubt is named with the line that settles it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer import WindOptions, read_log
from flagdata.ingest.anemometer.words.headings import understand
from flagdata.signals import WindLog
from flagdata.units import spelled, unit

Read = Callable[..., WindLog]
Write = Callable[[str], Path]

SPEEDS = [3.1, 4.4, 5.2, 2.8, 3.9, 4.7, 6.1, 5.5, 4.2, 3.3, 2.9, 4.8, 5.9, 3.6, 4.1, 5.0]
DEGREES = [231, 240, 252, 225, 219, 247, 261, 238, 229, 244, 255, 233, 226, 241, 249, 236]


def table(heading: str, speed: list[str], direction: list[str]) -> str:
    rows = zip(speed, direction, strict=True)
    return f"{heading}\n" + "".join(f"2026-05-01T12:{at:02d}:00Z,{s},{d}\n" for at, (s, d) in enumerate(rows))


def said(log: WindLog) -> str:
    return " ".join(finding.what for finding in log.findings)


def refusal(path: Path) -> FlagdataError:
    with pytest.raises(FlagdataError) as caught:
        read_log(path)
    return caught.value


def line_of(text: str) -> str:
    """What stands between quotes behind --columns."""
    return text.partition('--columns "')[2].partition('"')[0]


CODES = (
    "-9999", "-999", "999", "99.9", "6999", "-6999", "NaN", "Calm", "VRB", "---", "M", "65535", "-32768", "-1", "888",
    "-888", "1e20", "mq", "ERR", "255",
)  # fmt: skip


@pytest.mark.parametrize("code", CODES)
def test_codes_for_no_value_are_no_speeds_and_no_angles(read: Read, code: str) -> None:
    here = [at % 4 == 1 for at in range(len(SPEEDS))]
    speed = [code if coded else str(value) for value, coded in zip(SPEEDS, here, strict=True)]
    away = [code if coded and code != "255" else str(v) for v, coded in zip(DEGREES, here, strict=True)]
    log = read(table("time,wind speed [m/s],wind direction [deg]", speed, away))
    channels = log.series.channels
    usable = np.where(log.series.flags == 0, channels["wind_speed"], np.nan)
    expected = np.where(here, np.nan, SPEEDS)
    np.testing.assert_allclose(usable, expected)
    if code != "255":
        np.testing.assert_allclose(np.rad2deg(channels["wind_direction"]), np.where(here, np.nan, DEGREES))
    assert any(finding.count == 4 for finding in log.findings)


def test_components_below_zero_are_no_codes(log_file: Write) -> None:
    path = log_file(table("time,wind speed [m/s],wind direction [deg]", [str(v - 4) for v in SPEEDS], ["200"] * 16))
    assert "component" in refusal(path).what


def test_one_speed_of_255_among_fast_ones_is_a_speed(read: Read) -> None:
    speeds = [str(v * 40) for v in SPEEDS[:-1]] + ["255"]
    log = read(table("time,wind speed [cm/s],wind direction [deg]", speeds, [str(v) for v in DEGREES]))
    assert log.series.channels["wind_speed"][-1] == pytest.approx(2.55)


def test_few_tens_of_degrees_without_a_unit_are_left_out_with_the_line_that_reads_them(log_file: Write) -> None:
    away = ["24" if at % 2 else "25" for at in range(16)]
    path = log_file(table("time,wind speed [m/s],dd", [str(v) for v in SPEEDS], away))
    log = read_log(path)
    assert "wind_direction" not in log.series.channels
    assert "tens of degrees" in said(log)
    again = read_log(path, WindOptions(columns=line_of(said(log))))
    np.testing.assert_allclose(np.rad2deg(again.series.channels["wind_direction"][:2]), [250, 240])


def test_99_among_tens_of_degrees_does_not_make_them_degrees(read: Read) -> None:
    away = [str(v // 10) if at % 3 else "99" for at, v in enumerate(DEGREES)]
    log = read(table("time,wind speed [m/s],wind dir", [str(v) for v in SPEEDS], away))
    assert "wind_direction" not in log.series.channels
    assert "tens of degrees" in said(log)


@pytest.mark.parametrize(
    ("scale", "likely"), [(0.1, "likely tens of degrees"), (np.pi / 180, "likely radians")]
)  # fmt: skip
def test_numbers_that_speak_against_stated_degrees_are_named(read: Read, scale: float, likely: str) -> None:
    away = [f"{v * scale:.0f}" if scale == 0.1 else f"{v * scale:.3f}" for v in DEGREES]
    log = read(table("time,wind speed [m/s],wind direction [deg]", [str(v) for v in SPEEDS], away))
    assert likely in said(log)


@pytest.mark.parametrize(
    ("scale", "name"), [(6400 / 360, "mil"), (10.0, "0.1 deg"), (400 / 360, "gon"), (np.pi / 180, "rad")]
)
def test_directions_in_other_units_are_left_out_with_the_line_that_reads_them(
    log_file: Write, scale: float, name: str
) -> None:
    degrees = [(v + 110) % 360 for v in DEGREES]
    path = log_file(
        table("time,wind speed [m/s],wind dir", [str(v) for v in SPEEDS], [f"{v * scale:.3f}" for v in degrees])
    )
    log = read_log(path)
    assert "wind_direction" not in log.series.channels
    line = line_of(said(log))
    assert f"[{name}]" in line
    again = read_log(path, WindOptions(columns=line)).series.channels["wind_direction"]
    np.testing.assert_allclose(np.rad2deg(again), degrees, atol=0.1)


@pytest.mark.parametrize(
    "name", ["wind direction from bow [deg]", "relative wind direction [deg]", "wind dir rel. to vehicle [deg]"]
)
def test_a_direction_from_a_platforms_mark_is_none_from_north(log_file: Write, name: str) -> None:
    path = log_file(table(f"time,wind speed [m/s],{name}", [str(v) for v in SPEEDS], [str(v) for v in DEGREES]))
    log = read_log(path, WindOptions(platform="fixed" if "vehicle" in name else None))
    assert "wind_direction" not in log.series.channels
    assert "not from north" in said(log)
    again = read_log(path, WindOptions(columns=line_of(said(log)))).series.channels
    assert "wind_direction" not in again
    np.testing.assert_allclose(np.rad2deg(again["apparent_wind_direction"]), DEGREES)


def test_the_direction_from_north_is_preferred_and_said(read: Read) -> None:
    rows = [f"{v},{d - 100},{d}" for v, d in zip(SPEEDS, DEGREES, strict=True)]
    text = "time,wind speed [m/s],relative wind direction [deg],true wind direction [deg]\n"
    text += "".join(f"2026-05-01T12:{at:02d}:00Z,{row}\n" for at, row in enumerate(rows))
    log = read(text)
    np.testing.assert_allclose(np.rad2deg(log.series.channels["wind_direction"]), DEGREES)
    assert "relative to its platform: left out beside 'true wind direction [deg]'" in said(log)


@pytest.mark.parametrize(
    "name",
    [
        "anemometer_hz",
        "Anemometer [Hz]",
        "wind speed pulses",
        "wind ticks",
        "wind_mV",
        "windspeed [mA]",
        "counts",
        "rpm",
    ],
)
def test_counts_of_an_anemometer_are_no_speed_until_their_calibration_is_said(log_file: Write, name: str) -> None:
    path = log_file(table(f"time,{name},wind dir", [str(v / 0.5) for v in SPEEDS], [str(v) for v in DEGREES]))
    error = refusal(path)
    assert "not yet a speed" in error.what
    line = line_of(error.fix or "").replace("?", "0.5")
    channels = read_log(path, WindOptions(columns=line)).series.channels
    np.testing.assert_allclose(channels["wind_speed"], SPEEDS)
    np.testing.assert_allclose(np.rad2deg(channels["wind_direction"]), DEGREES)


def test_whole_tenths_below_a_heading_of_metres_a_second_are_named(read: Read) -> None:
    speeds = [f"{10 * v:.0f}" for v in SPEEDS]
    log = read(table("time,wind speed [m/s],wind dir", speeds, [str(v) for v in DEGREES]))
    assert "--unit '0.1 m/s'" in said(log)


@pytest.mark.parametrize(
    ("title", "name"),
    [("# all speeds in km/h", "km/h"), ("Wind in knots, direction in degrees", "kn"), ("gusts (kt)", "kn")],
)
def test_a_unit_in_the_title_is_proposed(log_file: Write, title: str, name: str) -> None:
    text = table("time,wind speed,wind dir", [str(v) for v in SPEEDS], [str(v) for v in DEGREES])
    error = refusal(log_file(f"{title}\n{text}"))
    assert error.fix is not None
    assert f"--unit {name}" in error.fix


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("Knoten", "kn"), ("nudos", "kn"), ("nœuds", "kn"), ("nodi", "kn"), ("Meter pro Sekunde", "m/s"),
        ("kilómetros por hora", "km/h"), ("mètres par seconde", "m/s"), ("metri al secondo", "m/s"), ("км/ч", "km/h"),
        ("0.1 kn", "0.1 kn"), ("0.1 m/s", "dm/s"), ("10 m/s", None), ("2 m", None), ("0.5 m/s", None), ("0.1 m", None),
    ],
)  # fmt: skip
def test_units_in_the_words_of_other_languages_and_in_tenths(text: str, name: str | None) -> None:
    assert spelled(text) == name


def test_a_user_may_say_any_factor() -> None:
    assert unit("0.765 m/s").scale == pytest.approx(0.765)
    assert unit("0.765 m/s").si == "m/s"


@pytest.mark.parametrize("name", ["wind speed (m/s x10)", "wind_speed_x10"])
def test_numbers_that_are_ten_times_a_speed_are_asked_about(log_file: Write, name: str) -> None:
    path = log_file(table(f"time,{name},wind dir", [f"{10 * v:.0f}" for v in SPEEDS], [str(v) for v in DEGREES]))
    assert "0.1 m/s" in (refusal(path).fix or "")
    assert read_log(path, WindOptions(unit="0.1 m/s")).series.channels["wind_speed"][0] == pytest.approx(3.1)


def test_what_to_do_with_a_logger_table_without_rows_begins_with_words(log_file: Write) -> None:
    head = (
        '"TOA5","station","CR1000","1","","","","table"\n"TIMESTAMP","RECORD","Batt"\n"TS","RN","Volts"\n"","","Avg"\n'
    )
    fix = refusal(log_file(head)).fix or ""
    assert fix.startswith("describe the file by a recipe")


def test_a_unit_in_a_comment_below_the_rows_is_proposed(log_file: Write) -> None:
    text = table("time,wind speed,wind dir", [str(v) for v in SPEEDS], [str(v) for v in DEGREES])
    assert "--unit kn" in (refusal(log_file(f"{text}# speeds in knots\n")).fix or "")


def test_a_vane_in_millivolts_is_offered_without_a_unit(log_file: Write) -> None:
    path = log_file(table("time,counts,vane_mV", [str(v) for v in SPEEDS], [str(9 * v) for v in DEGREES]))
    assert "wind_direction[deg]" not in (refusal(path).fix or "")


def test_a_word_for_a_variable_direction_is_a_missing_value(read: Read) -> None:
    away = ["VRB" if at % 3 == 0 else str(v) for at, v in enumerate(DEGREES)]
    log = read(table("time,wind speed [m/s],wind direction [deg]", [str(v) for v in SPEEDS], away))
    assert any(finding.kind == "missing-values" and finding.count == 6 for finding in log.findings)
    assert "'VRB'" in said(log)


@pytest.mark.parametrize("name", ["Wind speed 20Hz [m/s]", "WS_10Hz [m/s]"])
def test_the_rate_of_samples_in_a_heading_is_no_frequency_of_a_cup(read: Read, name: str) -> None:
    log = read(table(f"time,{name},wind dir", [str(v) for v in SPEEDS], [str(v) for v in DEGREES]))
    np.testing.assert_allclose(log.series.channels["wind_speed"], SPEEDS)


def test_a_speed_of_255_once_is_a_gust_in_a_small_unit(read: Read) -> None:
    speeds = [str(round(v * 20)) for v in SPEEDS[:-1]] + ["255"]
    log = read(table("time,wind speed [cm/s],wind direction [deg]", speeds, [str(v) for v in DEGREES]))
    assert log.series.channels["wind_speed"][-1] == pytest.approx(2.55)


def test_a_component_called_v_is_no_voltage(log_file: Write) -> None:
    path = log_file(table("time,wind_u,wind_v", [str(v - 4) for v in SPEEDS], [str(v - 3) for v in SPEEDS]))
    assert "not yet a speed" not in refusal(path).what
    channels = read_log(path, WindOptions(unit="m/s")).series.channels
    np.testing.assert_allclose(channels["wind_y"], np.array(SPEEDS) - 3)


def test_units_in_brackets_of_a_second_line_of_names_are_those_of_the_columns(read: Read) -> None:
    """Taiwan's weather service heads its tables in Chinese, with units, and in English, without."""
    rows = "".join(f"{at:02d},{3 + at % 5},{40 + at},{18 + at % 3}\n" for at in range(1, 25))
    headings = "觀測時間(hour),風速(m/s),風向(360degree),氣溫(℃)\nObsTime,WS,WD,Temperature\n"
    log = read(headings + rows, start=1_675_184_400_000_000_000)
    assert log.series.channels["wind_speed"].tolist() == [3 + at % 5 for at in range(1, 25)]
    np.testing.assert_allclose(log.series.channels["air_temperature"], [291.15 + at % 3 for at in range(1, 25)])
    assert np.diff(log.series.time).tolist() == [3600 * 10**9] * 23


@pytest.mark.parametrize(
    ("heading", "channel", "unit"),
    [
        ("Wind SpeedKm/h", "wind_speed", "km/h"),
        ("Wind.SpeedKm.h", "wind_speed", "km/h"),
        ("WindSpeedm/s", "wind_speed", "m/s"),
        ("Szélirány [fok]", "wind_direction", "deg"),
        ("מהירות רוח (מ/ש)", "wind_speed", "m/s"),
        ("سرعة الرياح (م/ث)", "wind_speed", "m/s"),
        ("Vindhraði (m/s)", "wind_speed", "m/s"),
        ("Vindátt", "wind_direction", None),
        ("vent_moyen", "wind_speed", None),
        ("Viento promedio (km/h)", "wind_speed", "km/h"),
        ("Velocitat mitjana del vent (m/s)", "wind_speed", "m/s"),
        ("ความเร็วลม (เมตร/วินาที)", "wind_speed", "m/s"),
        ("SOS (m/s)", "", "m/s"),
        ("90m 径向风速(m/s)", "", "m/s"),
        ("radial wind speed [m/s]", "", "m/s"),
    ],
)
def test_headings_of_further_languages_and_glued_units_are_understood(
    heading: str, channel: str, unit: str | None
) -> None:
    found = understand(heading)
    assert (found.channel, found.unit) == (channel, unit)
    assert found.sure or not channel


@pytest.mark.parametrize(("heading", "unit"), [("Wind speed (m/s) x10", "0.1 m/s"), ("Wind speed x100", "0.01 m/s")])
def test_a_heading_of_multiples_asks_for_what_one_is(log_file: Write, heading: str, unit: str) -> None:
    path = log_file(f"Time,{heading}\n" + "".join(f"2021-05-01T{hour:02d}:00:00Z,{30 + hour}\n" for hour in range(8)))
    with pytest.raises(FlagdataError, match=f"--unit '{unit}'"):
        read_log(path, WindOptions())
    factor = 1 / float(unit.split()[0])
    found = read_log(path, WindOptions(unit=unit)).series.channels["wind_speed"]
    np.testing.assert_allclose(found, np.arange(30, 38) / factor)


def test_numbers_up_to_eight_may_be_eighths_of_a_turn(log_file: Write) -> None:
    rows = "".join(f"01.05.2021 {hour:02d}:00,{3 + hour},{hour % 8}\n" for hour in range(20))
    path = log_file("Datum,Wind [m/s],Richtung\n" + rows)
    log = read_log(path, WindOptions(zone="UTC"))
    assert "wind_direction" not in log.series.channels
    assert any("[45 deg]" in finding.what for finding in log.findings)
    line = "time,wind_speed[m/s],wind_direction[45 deg]"
    found = read_log(path, WindOptions(zone="UTC", columns=line)).series.channels["wind_direction"]
    np.testing.assert_allclose(np.rad2deg(found), 45 * (np.arange(20) % 8))
