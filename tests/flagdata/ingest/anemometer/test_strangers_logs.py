"""Tables as public services and makers write them: none is wrong in silence, most are right with what is asked for."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable
from functools import reduce
from operator import xor
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log, sniff
from flagdata.ingest.anemometer.instants.stamps import parse
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
Write = Callable[[str], Path]


def first_instant(log: WindLog) -> str:
    return str(np.datetime64(int(log.series.time[0]), "ns"))[:19]


def refusal(path: Path, options: WindOptions | None = None) -> FlagdataError:
    with pytest.raises(FlagdataError) as caught:
        read_log(path, options or WindOptions())
    return caught.value


def test_ten_digits_that_are_a_date_and_an_hour_are_no_unix_time(read: Read) -> None:
    rows = "".join(f"2667;20230701{hour:02d};1;{4 + hour / 10:.1f};{130 + hour};eor\n" for hour in range(12))
    log = read(f"STATIONS_ID;MESS_DATUM;QN_3;FF;DD;eor\n{rows}", unit="m/s", zone="UTC")
    assert first_instant(log) == "2023-07-01T00:00:00"
    assert np.diff(log.series.time).tolist() == [3600 * 10**9] * 11


def test_ten_digits_that_are_no_date_are_unix_time(read: Read) -> None:
    rows = "".join(f"{1688169600 + at},{4 + at / 10:.1f}\n" for at in range(12))
    assert first_instant(read(f"time,wind speed (m/s)\n{rows}")) == "2023-07-01T00:00:00"


def test_seconds_of_another_year_than_the_dates_beside_them_are_not_unix_time(read: Read) -> None:
    heading = "Time and Date,Timestamp (seconds),Horizontal Wind Speed (m/s) at 38m,Wind Direction (deg) at 38m"
    rows = "".join(f"2023-07-13 00:00:{at:02d},{771_000_000 + at},{4 + at / 10:.1f},{130 + at}\n" for at in range(12))
    assert first_instant(read(f"{heading}\n{rows}", zone="UTC")) == "2023-07-13T00:00:00"


def test_unix_time_that_agrees_with_the_dates_beside_it_is_taken_since_it_needs_no_zone(read: Read) -> None:
    rows = "".join(f"2023-07-01 02:00:{at:02d},{1688169600 + at},{4 + at / 10:.1f}\n" for at in range(12))
    assert first_instant(read(f"local time,timestamp,wind speed (m/s)\n{rows}")) == "2023-07-01T00:00:00"


def test_directions_in_tens_of_degrees_are_scaled(read: Read) -> None:
    rows = "".join(f'"2023-07-01 {hour:02d}:00","{20 + hour}","13"\n' for hour in range(12))
    log = read(f'"Date/Time (LST)","Wind Dir (10s deg)","Wind Spd (km/h)"\n{rows}', zone="-05:00")
    assert np.degrees(log.series.channels["wind_direction"][:2]).tolist() == pytest.approx([200.0, 210.0])


def test_whole_directions_up_to_36_without_a_unit_are_left_out(read: Read) -> None:
    rows = "".join(f"2023-07-01T{hour:02d}:00:00Z,{18 + hour},4.{hour}\n" for hour in range(12))
    log = read(f"time,wind dir,wind speed (m/s)\n{rows}")
    assert "wind_direction" not in log.series.channels
    assert "tens of degrees" in " ".join(finding.what for finding in log.findings)


@pytest.mark.parametrize("order", ["MM/DD/YYYY", "DD/MM/YYYY"])
def test_the_order_of_dates_that_the_heading_spells_is_heeded(read: Read, order: str) -> None:
    rows = "".join(f"07/01/2023,12:00:{at:02d},{4 + at / 10:.1f}\n" for at in range(12))
    log = read(f"DATE ({order}),UTC,Avg Wind Speed @ 2m [m/s]\n{rows}")
    assert first_instant(log) == ("2023-07-01T12:00:00" if order.startswith("MM") else "2023-01-07T12:00:00")


@pytest.mark.parametrize("other", ["Dispersion", "Shear", "Ratio", "Setpoint"])
def test_statistics_of_a_wind_are_no_anemometer_of_their_own(log_file: Write, other: str) -> None:
    rows = "".join(f"2023-07-01T00:00:{at:02d}Z,4.{at},0.{at}\n" for at in range(9))
    path = log_file(f"time,40m Wind Speed (m/s),40m Wind Speed {other} (m/s)\n{rows}")
    assert anemometers(path) == ()
    assert read_log(path).series.channels["wind_speed"][1] == pytest.approx(4.1)


def test_a_component_along_one_axis_of_the_earth_is_no_speed(log_file: Write) -> None:
    rows = "".join(f"2023-07-01T00:00:{at:02d}Z,-4.{at}\n" for at in range(9))
    assert "no column is surely a wind" in refusal(log_file(f"time,windspeed_north (m/s)\n{rows}")).what


@pytest.mark.parametrize(
    "names", ["windspeed_north (m/s),windspeed_east (m/s)", "northward wind m/s,eastward wind m/s"]
)
def test_components_towards_north_and_east_give_speed_and_direction(log_file: Write, names: str) -> None:
    # Towards the south-east (north -3, east +3): the wind comes from the north-west.
    rows = "".join(f"2023-07-01T00:00:{at:02d}Z,-3.0,3.0\n" for at in range(9))
    channels = read_log(log_file(f"time,{names}\n{rows}")).series.channels
    np.testing.assert_allclose(channels["wind_speed"], 3 * np.sqrt(2))
    np.testing.assert_allclose(np.rad2deg(channels["wind_direction"]), 315)


def test_speeds_at_the_sides_of_a_mast_are_no_components(log_file: Write) -> None:
    rows = "".join(f"2023-07-01T00:00:{at:02d}Z,3.0,3.1,3.2\n" for at in range(9))
    assert "no column is surely" in refusal(log_file(f"time,speed north,speed east,speed south\n{rows}")).what


def test_a_lone_u_may_be_the_speed_and_is_asked_about(log_file: Write) -> None:
    rows = "".join(f"2023-07-01T00:00:{at:02d}Z,4.{at}\n" for at in range(9))
    path = log_file(f"time,U (m/s)\n{rows}")
    assert "--wind 'U (m/s)'" in refusal(path).fix
    assert "wind_speed" in read_log(path, WindOptions(wind="U (m/s)")).series.channels


def test_a_fast_count_may_be_of_microseconds(log_file: Write) -> None:
    rows = "".join(f"{12_000_000 + 100_000 * at},{4 + at / 10:.1f}\n" for at in range(12))
    error = refusal(log_file(f"timestamp,wind speed (m/s)\n{rows}"))
    assert "ms of a slow logger, or us of a fast one" in error.what
    assert "elapsed-us" in error.fix


def test_directions_written_as_points_of_the_compass_are_read(read: Read) -> None:
    points = ["N", "ENE", "S", "NNW", "calm", "W", "W", "W", "W", "W", "W", "W"]
    rows = "".join(f"2023-07-01T00:00:{at:02d}Z,{point},4.{at}\n" for at, point in enumerate(points))
    log = read(f"time,wind_dir,wind speed (m/s)\n{rows}")
    told = np.degrees(log.series.channels["wind_direction"])
    assert told[:4].tolist() == pytest.approx([0.0, 67.5, 180.0, 337.5])
    assert np.isnan(told[4])
    assert any("points of the compass" in reason for reason in log.reasons)


EXPEDITION = """!Boat,Utc,BSP,AWA,AWS,TWA,TWS,TWD,Lat,Lon
!boat,0,1,2,3,4,5,6,48,49
!v12.5.1
0,45658.5,48,43.1,49,5.6
0,45658.5,1,6.81,2,-31.5,3,10.0,4,-40.0,5,8.0
0,45658.500011574074,2,30.0,3,20.0,48,43.1001
0,45658.500023148148,48,43.1002
"""


def test_expeditions_pairs_of_channel_and_value_are_rows_of_wind(read: Read) -> None:
    """45658.5 days after 1899-12-30 is noon of 2025-01-01, as in any spreadsheet."""
    log = read(EXPEDITION, unit="kn")
    assert first_instant(log) == "2025-01-01T12:00:00"
    assert log.series.channels["apparent_wind_speed"].tolist() == pytest.approx([10 * 1852 / 3600, 20 * 1852 / 3600])
    assert np.degrees(log.series.channels["apparent_wind_direction"]).tolist() == pytest.approx([328.5, 30.0])
    assert "wind_speed" not in log.series.channels


def test_expeditions_steps_since_1601_are_utc(read: Read) -> None:
    """116444736000000000 steps of 100 ns after 1601 is 1970-01-01; the rows are two seconds apart."""
    first = 116_444_736_000_000_000 + 1_735_732_800 * 10_000_000
    text = EXPEDITION.replace("45658.500011574074", str(first + 20_000_000)).replace("45658.500023148148", str(first))
    log = read(text.replace("45658.5,", f"{first},"), unit="kn")
    assert first_instant(log) == "2025-01-01T12:00:00"
    assert np.diff(log.series.time).tolist() == [2 * 10**9]


def test_the_unit_of_expeditions_speeds_is_asked_for(log_file: Write) -> None:
    assert "--unit" in refusal(log_file(EXPEDITION)).fix


METARS = """202307010025 METAR EHAM 010025Z 23008KT 9999 FEW020 18/12 Q1013 NOSIG=
202307010055 METAR EHAM 010055Z VRB02KT CAVOK 18/12 Q1013=
202307010125 METAR EHAM 010125Z AUTO 00000KT CAVOK 18/12 Q1013=
202307010155 METAR EHAM 010155Z 24012G25KT 9999 18/12 Q1013=
"""


def test_metar_reports_after_their_stamp_are_a_log(read: Read) -> None:
    log = read(METARS)
    assert first_instant(log) == "2023-07-01T00:25:00"
    assert log.series.channels["wind_speed"].tolist() == pytest.approx([n * 1852 / 3600 for n in (8, 2, 0, 12)])
    told = np.degrees(log.series.channels["wind_direction"])
    assert told[[0, 3]].tolist() == pytest.approx([230.0, 240.0])
    assert np.isnan(told[1:3]).all()  # a variable wind and a calm one have no direction


def test_metar_reports_whose_month_nothing_tells_are_refused(log_file: Write) -> None:
    bare = "".join(line[13:] + "\n" for line in METARS.splitlines())
    assert refusal(log_file(bare)).fix


def test_noaas_cells_of_several_values_are_taken_apart(read: Read) -> None:
    cells = ["230,5,N,0046,5", "999,9,V,0015,5", "240,5,N,9999,9", "250,3,N,0061,7", "999,9,C,0000,5"]
    rows = "".join(f'"725030","2023-07-01T0{at}:51:00","7","{cell}","+0111,5"\n' for at, cell in enumerate(cells))
    log = read(f'"STATION","DATE","SOURCE","WND","TMP"\n{rows}')
    assert first_instant(log) == "2023-07-01T00:51:00"
    speed, away = log.series.channels["wind_speed"], np.degrees(log.series.channels["wind_direction"])
    assert speed[[0, 1, 4]].tolist() == pytest.approx([4.6, 1.5, 0.0])
    assert np.isnan(speed[2:4]).all()
    assert away[[0, 2]].tolist() == pytest.approx([230.0, 240.0])
    assert np.isnan(away[[1, 3, 4]]).all()
    assert log.series.channels["air_temperature"][0] == pytest.approx(284.25)


def test_lines_that_name_each_number_are_a_table(read: Read) -> None:
    rows = "".join(
        f"2023-07-01 12:00:{at:02d}.250 -> Wind Speed: {4 + at / 10:.2f} m/s, Direction: {230 + at}\r\n"
        for at in range(12)
    )
    log = read(rows, zone="UTC")
    assert first_instant(log) == "2023-07-01T12:00:00"
    assert log.series.channels["wind_speed"][:2].tolist() == pytest.approx([4.0, 4.1])
    assert np.degrees(log.series.channels["wind_direction"][:2]).tolist() == pytest.approx([230.0, 231.0])


def test_labelled_components_are_a_sonics_and_their_unit_is_asked_for(log_file: Write) -> None:
    rows = "".join(
        f" 23:11:13:17:39:{at:02d}.316 SN150 SN151 U -00.9{at % 10} V 00.21 T  19.78 Battery% 100\n" for at in range(12)
    )
    path = log_file(rows)
    assert "--unit" in refusal(path).fix
    log = read_log(path, WindOptions(unit="m/s", zone="UTC", date_order="ymd"))
    assert first_instant(log) == "2023-11-13T17:39:00"
    assert log.series.channels["wind_x"][:2].tolist() == pytest.approx([-0.90, -0.91])
    assert log.series.channels["wind_y"][0] == pytest.approx(0.21)


def test_labelled_lines_without_a_wind_are_not_taken(log_file: Write) -> None:
    rows = "".join(f"2023-07-01 12:00:{at:02d} Temperature: {20 + at} C, Battery: 12\n" for at in range(12))
    with pytest.raises(FlagdataError):
        read_log(log_file(rows), WindOptions(zone="UTC"))


def frames(form: str) -> str:
    """PGN 130306 (01FD02 in the identifier) of device 35: 4.00 m/s and more from 1.0 rad to the right of the bow."""
    lines = []
    for at in range(12):
        data = bytes([at, *(400 + at).to_bytes(2, "little"), *(10_000).to_bytes(2, "little"), 2, 255, 255])
        lines.append(form.format(at=at, plain=data.hex().upper(), spaced=data.hex(" ").upper()))
    return "".join(lines)


@pytest.mark.parametrize(
    ("form", "options"),
    [
        ("(1688212800.{at:06d}) can0 09FD0223#{plain}\n", {}),
        ("12:00:00.{at:03d} R 09FD0223 {spaced}\r\n", {"date": dt.date(2023, 7, 1)}),
    ],
    ids=["candump", "gateway"],
)
def test_frames_of_nmea_2000_are_read(read: Read, form: str, options: dict[str, object]) -> None:
    log = read(frames(form), platform="fixed", **options)
    assert first_instant(log) == "2023-07-01T12:00:00"
    assert log.series.channels["wind_speed"][:2].tolist() == pytest.approx([4.00, 4.01])
    assert log.series.channels["apparent_wind_direction"][0] == pytest.approx(1.0)


def test_a_gateways_frames_pass_midnight(read: Read) -> None:
    text = frames("23:59:59.{at:03d} R 09FD0223 {spaced}\n") + frames("00:00:01.{at:03d} R 09FD0223 {spaced}\n")
    log = read(text, platform="fixed", date=dt.date(2023, 7, 1))
    assert first_instant(log) == "2023-07-01T23:59:59"
    assert int(log.series.time[-1] - log.series.time[0]) == 2_011_000_000


def test_the_day_of_a_gateways_frames_is_asked_for(log_file: Write) -> None:
    assert "--date" in refusal(log_file(frames("12:00:00.{at:03d} R 09FD0223 {spaced}\n"))).fix


@pytest.mark.parametrize("between", [";", ";nmea0183;", ";A;", ",NMEA0183,,"])
def test_names_between_a_stamp_and_a_sentence_are_passed_over(read: Read, between: str) -> None:
    sentences = ["$WIMWV,065.0,R,004.2,M,A*25", "$WIMWV,066.0,R,004.3,M,A*27"]
    text = "".join(f"{1688212800000 + at}{between}{sentence}\n" for at, sentence in enumerate(sentences))
    log = read(text, platform="fixed")
    assert first_instant(log) == "2023-07-01T12:00:00"
    assert log.series.channels["wind_speed"].tolist() == pytest.approx([4.2, 4.3])


def with_checksum(sentence: str) -> str:
    return f"${sentence}*{reduce(xor, sentence.encode()):02X}\n"


def stream(*sentences: str) -> str:
    clock = [f"GPZDA,1200{at:02d},01,07,2023,00,00" for at in range(12)]
    return "".join(with_checksum(text) for mark in clock for text in (mark, *sentences))


def test_relative_wind_of_older_instruments_is_read(read: Read) -> None:
    """45° to port of the bow at 12.6 kn is 6.48 m/s from 315°."""
    log = read(stream("IIVWR,045.0,L,12.6,N,,M,,K"))
    assert log.series.channels["apparent_wind_speed"][0] == pytest.approx(12.6 * 1852 / 3600)
    assert np.degrees(log.series.channels["apparent_wind_direction"][0]) == pytest.approx(315.0)
    assert "wind_speed" not in log.series.channels


def test_the_composite_of_a_weather_station_is_wind_over_ground(read: Read) -> None:
    log = read(stream("WIMDA,29.9,I,1.01,B,21.1,C,,C,55.1,,12.1,C,231.0,T,229.0,M,8.2,N,4.2,M"))
    assert log.series.channels["wind_speed"][0] == pytest.approx(8.2 * 1852 / 3600)
    assert np.degrees(log.series.channels["wind_direction"][0]) == pytest.approx(231.0)


def test_older_sentences_beside_newer_ones_of_the_same_wind_are_not_read_again(read: Read) -> None:
    log = read(stream("IIMWV,315.0,R,6.5,M,A", "IIVWR,045.0,L,12.6,N,6.5,M,23.3,K"))
    assert len(log.series.time) == 12


@pytest.mark.parametrize(
    ("heading", "codec"),
    [
        ("时间,风速(m/s),风向(°),最大风速(m/s)", "gb18030"),
        ("日時,風速(m/s),風向(°),最大瞬間風速(m/s)", "cp932"),
        ("일시,풍속(m/s),풍향(deg),최대풍속(m/s)", "cp949"),
        ("Время,Скорость ветра м/с,Направление ветра град,Порыв м/с", "cp1251"),
        ("Godzina,Prędkość wiatru [m/s],Kierunek wiatru [°],Poryw [m/s]", "utf-8"),
    ],
)
def test_headings_in_other_languages_and_their_encodings_are_understood(
    log_file: Callable[[bytes], Path], heading: str, codec: str
) -> None:
    rows = "".join(f"2023/07/01 12:00:{at:02d},{4 + at / 10:.1f},{230 + at},{6 + at / 10:.1f}\n" for at in range(12))
    log = read_log(log_file(f"{heading}\n{rows}".encode(codec)), WindOptions(zone="UTC"))
    assert first_instant(log) == "2023-07-01T12:00:00"
    assert log.series.channels["wind_speed"][:2].tolist() == pytest.approx([4.0, 4.1])
    assert np.degrees(log.series.channels["wind_direction"][0]) == pytest.approx(230.0)


def test_marks_of_quality_under_a_repeated_heading_are_no_wind(log_file: Write) -> None:
    rows = "".join(f"2023-07-01T00:00:{at:02d}Z,4.{at},8,8\n" for at in range(9))
    path = log_file(f"time,wind speed (m/s),wind speed (m/s),wind speed (m/s)\n{rows}")
    assert anemometers(path) == ()
    assert read_log(path).series.channels["wind_speed"][1] == pytest.approx(4.1)


def test_year_month_and_day_in_columns_beside_a_clock_are_one_stamp(read: Read) -> None:
    rows = "".join(f"Kaisaniemi,2023,6,30,23:{50 + at},4.{at},{230 + at}\n" for at in range(10))
    rows += "Kaisaniemi,2023,7,3,00:00,5.0,231\n"
    log = read(f"Station,Year,Month,Day,Time [UTC],Average wind speed [m/s],Wind direction [°]\n{rows}")
    assert first_instant(log) == "2023-06-30T23:50:00"
    assert str(np.datetime64(int(log.series.time[-1]), "ns"))[:16] == "2023-07-03T00:00"


def test_clocks_of_four_digits_and_a_zone_are_read(read: Read) -> None:
    rows = "".join(f"2023/07/13;{at:02d}00 UTC;{230 + at};4,{at % 10}\n" for at in range(12))
    log = read(f"Data;Hora UTC;VENTO, DIREÇÃO HORARIA (gr) (° (gr));VENTO, VELOCIDADE HORARIA (m/s)\n{rows}")
    assert first_instant(log) == "2023-07-13T00:00:00"
    assert log.series.channels["wind_speed"][1] == pytest.approx(4.1)


def test_degrees_go_before_points_of_the_compass_beside_them(read: Read) -> None:
    rows = "".join(f"2023-07-01T00:00:{at:02d}Z,4.{at},{231 + at},SW\n" for at in range(9))
    log = read(f"time,Speed (m/s),Dir,Dir\n{rows}")
    assert np.degrees(log.series.channels["wind_direction"][0]) == pytest.approx(231.0)


def timed(heading: str, cells: list[str]) -> str:
    return f"time,{heading}\n" + "".join(
        f"2023-07-13T{at // 3600:02d}:{at // 60 % 60:02d}:{at % 60:02d}Z,{cell}\n" for at, cell in enumerate(cells)
    )


@pytest.mark.parametrize(
    "name",
    ["wind_to_direction (deg)", "Wind direction towards (deg)", "Wind dir (deg) blowing to", "Wind direction to"],
)
def test_a_direction_to_which_the_wind_blows_is_turned(read: Read, name: str) -> None:
    log = read(timed(f"wind speed (m/s),{name}", [f"4.{at},{50 + at}" for at in range(10)]))
    assert np.degrees(log.series.channels["wind_direction"][0]) == pytest.approx(230.0)


@pytest.mark.parametrize("name", ["Wind direction (0 to 360 deg)", "Wind direction 0 to 360 (deg)"])
def test_the_word_to_alone_turns_no_direction(read: Read, name: str) -> None:
    log = read(timed(f"wind speed (m/s),{name}", [f"4.{at},{50 + at}" for at in range(10)]))
    assert np.degrees(log.series.channels["wind_direction"][0]) == pytest.approx(50.0)


def test_directions_in_gon_are_scaled_and_those_in_unknown_units_left_out(read: Read) -> None:
    cells = [f"4.{at},{200 + at}" for at in range(10)]
    log = read(timed("wind speed (m/s),wind direction (gon)", cells))
    assert np.degrees(log.series.channels["wind_direction"][0]) == pytest.approx(180.0)
    log = read(timed("wind speed (m/s),wind direction (cnt)", cells))
    assert "wind_direction" not in log.series.channels
    assert "'cnt'" in " ".join(finding.what for finding in log.findings)


def test_what_a_model_predicts_is_no_anemometer(log_file: Write) -> None:
    path = log_file(timed("wind speed (m/s),wind speed predicted (m/s)", [f"4.{at},5.{at}" for at in range(10)]))
    assert anemometers(path) == ()


@pytest.mark.parametrize("clock", ["59", "0059"])
def test_a_clock_written_as_a_number_may_lack_its_zeros(read: Read, clock: str) -> None:
    text = "Year,DOY,HHMM,WS (m/s)\n"
    text += "".join(f"2023,194,{at},4.{at % 10}\n" for at in range(50, 59))
    text += f"2023,194,{clock},5.0\n2023,194,100,5.1\n2023,194,1230,5.2\n"
    log = read(text, zone="UTC")
    told = [str(np.datetime64(int(ns), "ns"))[11:16] for ns in log.series.time[-3:]]
    assert told == ["00:59", "01:00", "12:30"]


def test_parts_of_a_date_count_from_no_start(log_file: Write) -> None:
    rows = "".join(f"2023-07-13,{12 + at / 60:.4f},4.{at % 10}\n" for at in range(20))
    assert "elapsed" not in refusal(log_file(f"date,hour,WS (m/s)\n{rows}")).fix


def test_nines_far_above_all_other_speeds_are_a_code_even_late_in_a_log(read: Read) -> None:
    cells = [f"{3 + at % 7}.{at % 10}" for at in range(2000)]
    cells[1500] = "99.0"
    log = read(timed("wind speed (m/s)", cells))
    assert np.isnan(log.series.channels["wind_speed"][1500])
    assert [finding.count for finding in log.findings if finding.kind == "code-for-missing"] == [1]


def test_nines_among_speeds_like_them_are_speeds(read: Read) -> None:
    log = read(timed("wind speed (km/h)", [f"{90 + at}.0" for at in range(20)]))
    assert np.isfinite(log.series.channels["wind_speed"]).all()


LABELLED = "".join(
    f"2023-07-13T12:00:{at:02d}Z Wind Speed: {4 + at / 10:.1f} m/s Direction: {230 + at}\n" for at in range(12)
)


def test_a_recipe_that_describes_labelled_lines_as_they_are_holds(log_file: Write, tmp_path: Path) -> None:
    recipe = tmp_path / "own.toml"
    recipe.write_text(
        'name = "own"\nabout = "own"\nsource = "own"\n'
        '[file]\ndelimiter = "space"\nheader = 0\n[time]\ncolumns = [1]\nformat = "iso"\n'
        '[channels.wind_speed]\ncolumn = 4\nunit = "m/s"\n[sensor]\nname = "own"\n'
    )
    log = read_log(log_file(LABELLED), WindOptions(recipe=str(recipe)))
    assert log.series.channels["wind_speed"][:2].tolist() == pytest.approx([4.0, 4.1])


def test_the_recipe_that_is_drafted_of_labelled_lines_reads_them(log_file: Write, tmp_path: Path) -> None:
    path, recipe = log_file(LABELLED), tmp_path / "drafted.toml"
    recipe.write_text(sniff(path)[0].draft or "")
    log = read_log(path, WindOptions(recipe=str(recipe)))
    assert log.series.channels["wind_speed"][:2].tolist() == pytest.approx([4.0, 4.1])
    assert np.degrees(log.series.channels["wind_direction"][0]) == pytest.approx(230.0)


@pytest.mark.parametrize("names", [("DAL", "AUS"), ("3002", "3003")])
def test_sites_that_take_turns_with_stamps_of_their_own_are_told_apart(log_file: Write, names: tuple[str, str]) -> None:
    rows = "".join(
        f"{name},2026-09-20 00:{at:02d}:{second:02d}Z,{180 + at},{first + at % 3}.5\n"
        for at in range(20) for name, second, first in zip(names, (3, 8), (4, 9), strict=True)
    )  # fmt: skip
    path = log_file(f"station,valid,drct,ws (m/s)\n{rows}")
    assert set(anemometers(path)) == set(names)
    speed = read_log(path, WindOptions(wind=names[1])).series.channels["wind_speed"]
    assert speed.tolist() == pytest.approx([9.5 + at % 3 for at in range(20)])


def test_a_site_that_appears_late_in_a_table_of_another_is_flagged(read: Read) -> None:
    rows = "".join(f"DAL,2026-09-20T{at // 60:02d}:{at % 60:02d}:00Z,{4 + at % 3}.{at % 10}\n" for at in range(1440))
    rows += "".join(f"AUS,2026-09-21T00:0{at}:00Z,9.{at}\n" for at in range(5))
    log = read(f"station,valid,ws (m/s)\n{rows}")
    told = [finding for finding in log.findings if finding.kind == "sensor-fault"]
    assert [finding.count for finding in told] == [5]
    assert "site" in told[0].what


def test_degrees_called_otherwise_go_before_points_of_the_compass(read: Read) -> None:
    log = read(
        timed("winddirectiondegrees,winddirection,wind speed (m/s)", [f"{190 + at},S,4.{at}" for at in range(9)])
    )
    assert np.degrees(log.series.channels["wind_direction"][0]) == pytest.approx(190.0)


def test_the_angle_of_the_true_wind_is_no_direction_from_north(log_file: Write) -> None:
    rows = "".join(f"2026-05-01T12:00:{at:02d}Z,5.1,10.0,40,{200 + at}\n" for at in range(12))
    log = read_log(
        log_file(f"Time,BoatSpeed,TrueWindSpeed,TrueWindAngle,TrueWindDirection\n{rows}"),
        WindOptions(unit="kn", platform="corrected"),
    )
    np.testing.assert_allclose(np.rad2deg(log.series.channels["wind_direction"][:2]), [200, 201])


def test_numbers_of_columns_above_their_names_are_no_row(log_file: Write) -> None:
    rows = "".join(f"01.05.2026;12:{at:02d};11,2;3,{at};2{at:02d}\n" for at in range(12))
    path = log_file(f";;1;34;35\n;;Temperatur;Windgeschwindigkeit;Windrichtung\n{rows}")
    channels = read_log(path, WindOptions(zone="UTC", unit="m/s")).series.channels
    assert channels["wind_speed"][1] == pytest.approx(3.1)
    assert np.rad2deg(channels["wind_direction"][1]) == pytest.approx(201)


@pytest.mark.parametrize(("text", "form"), [("202603141000", "%Y%m%d%H%M%S"), ("2026314", "%Y%m%d")])
def test_digits_with_nothing_between_are_not_cut_elsewhere(text: str, form: str) -> None:
    assert not parse([text], form).valid[0]
