"""Exports of loggers, stations and programs, made by their makers' descriptions: units, zones,
markers, cut lines."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError, TimeError
from flagdata.ingest import WindOptions, anemometers
from flagdata.ingest.anemometer import sensor_recipe as recipes
from flagdata.record.signals import WindLog
from flagdata.timebase import iso
from tests.flagdata.ingest.anemometer.conftest import read, shows


def kinds(log: WindLog) -> dict[str, int]:
    return {finding.kind: finding.count for finding in log.findings}


def nrg(*, zone: str = "UTC-5:00", unit: str = "m/s") -> str:
    head = [
        "NRG Export Service",
        "Export version:\t3",
        "",
        "Site Properties",
        f"Time Zone:\t{zone}",
        "",
        "Sensor History",
    ]
    for channel, kind, about, height in [
        (1, "Anemometer", "NRG S1", "40.00"),
        (2, "Anemometer", "NRG 40C", "20.00"),
        (13, "Vane", "NRG 200M Vane", "38.00"),
        (15, "Analog", "NRG T60 Temp", "2.00"),
        (16, "Analog", "PV module temp", "2.00"),
    ]:
        head += [
            f"Channel:\t{channel}",
            f"Type:\t{kind}",
            f"Description:\t{about}",
            f"Height:\t{height}",
            "",
        ]
    columns = [
        "Timestamp",
        f"Ch1_Anem_40.00m_N_Avg_{unit}",
        f"Ch1_Anem_40.00m_N_SD_{unit}",
        f"Ch2_Anem_20.00m_N_Avg_{unit}",
        "Ch13_Vane_38.00m_N_Avg_Deg",
        "Ch15_Analog_2.00m_N_Avg_C",
        "Ch16_Analog_2.00m_N_Avg_C",
    ]
    rows = [
        f"2026-05-01 12:{10 * i:02d}:00\t{5 + i}.0\t0.5\t4.0\t{200 + i}.0\t15.0\t40.0"
        for i in range(5)
    ]
    return "\n".join([*head, "Data", "\t".join(columns), *rows])


def test_nrg_channels_are_identified_by_their_history() -> None:
    log = read(nrg())
    direction = np.radians(200)
    shows(
        log,
        "nrg",
        "2026-05-01T17:10:00Z",
        wind_speed=[5, 6, 7, 8, 9],
        wind_direction=direction,
        air_temperature=288.15,
    )
    assert (log.series.sensor.name, log.series.sensor.height, log.series.sensor.averaging) == (
        "NRG S1",
        40.0,
        600.0,
    )
    several = next(finding for finding in log.findings if finding.kind == "several-anemometers")
    assert "Ch2" in several.what
    assert several.fix is not None
    assert "ingest the file with --as delimited" in several.fix
    assert "--sniff" not in several.fix


def test_an_nrg_zone_that_the_user_contradicts_is_reported() -> None:
    log = read(nrg(), zone="-04:00")
    shows(log, "nrg", "2026-05-01T16:10:00Z")
    assert kinds(log)["zone-contradicts"] == 1


def test_nrg_speeds_are_in_the_unit_of_their_column_and_a_cut_row_is_left_out() -> None:
    log = read(nrg(unit="mph") + "\n2026-05-01 12:50:00\t5.0")
    shows(log, "nrg", wind_speed=5 * 0.44704)
    assert kinds(log)["cut-off"] == 1


def windographer(*, unit: str = "", calm: str = "Calm threshold = 0 m/s") -> str:
    head = [
        "Created 10-05-2026 14:36 by Windographer 5.0",
        "",
        calm,
        "",
        "Time stamps indicate the beginning of the time step.",
        "",
    ]
    names = ["Date/Time", f"Spd80mN{unit}", f"Spd80mNStd{unit}", f"Spd60mN{unit}", "Dir78mS"]
    rows = [f"2026-01-{day:02d} 12:00\t{day}.5\t0.3\t4.0\t114.2" for day in range(9, 15)]
    return "\n".join([*head, "\t".join(names), *rows])


def test_windographer_speeds_without_a_unit_are_in_that_of_the_calm_threshold() -> None:
    log = read(windographer(calm="Calm threshold = 0 mph"), zone="UTC")
    shows(log, "windographer", wind_speed=9.5 * 0.44704)
    assert {"unit-from-preamble", "several-anemometers", "stamps-at-start"} <= set(kinds(log))


def test_windographer_units_of_columns_go_before_and_without_any_nothing_is_read() -> None:
    log = read(windographer(unit=" [km/h]"), zone="UTC")
    shows(log, "windographer", wind_speed=9.5 / 3.6)
    assert "unit-from-preamble" not in kinds(log)
    with pytest.raises(InputError, match="its unit is ''"):
        read(windographer(calm=""), zone="UTC")


def zentra(rows: list[str], *, padded: bool = True) -> str:
    head = [
        "\ufeffz6-01234,Port1,,,Port7,",
        f"# Records: {len(rows)},ATMOS 22 Ultrasonic Anemometer,,,Barometer,",
        (
            "Timestamps,° Wind Direction, m/s Wind Speed, m/s Gust Speed, kPa Reference Pressure, °C "
            "Logger Temperature"
        ),
    ]
    return "\r\n".join([*head, *([",,,,,"] if padded else []), *rows, ""])


@pytest.mark.parametrize("padded", [True, False])
def test_zentra_columns_are_unit_and_name_and_its_time_is_local(padded: bool) -> None:
    rows = [f"9/30/2026 19:{5 * i:02d},307,1.1{i},1.7{i},97.78,25" for i in range(6)]
    log = read(zentra(rows, padded=padded), zone="+03:00")
    shows(log, "zentra", "2026-09-30T16:00:00Z", wind_speed=1.10, air_pressure=[97_780] * 6)
    assert "air_temperature" not in log.series.channels
    assert log.series.sensor.name == "ATMOS 22 Ultrasonic Anemometer on z6-01234"


def test_error_codes_of_zentra_are_missing_and_no_zone_is_refused() -> None:
    rows = [f"9/30/2026 19:{5 * i:02d},307,1.1{i},1.7{i},97.78,25" for i in range(6)]
    rows[2:4] = [
        "9/30/2026 19:10,#N/A,-9999,#N/A,97.78,25",
        "9/30/2026 19:15,307,-9992,1.7,97.78,25",
    ]
    shows(read(zentra(rows), zone="UTC"), "zentra", missing=[2, 3])
    with pytest.raises(TimeError, match="no time zone"):
        read(zentra(rows))


def resaved(stamps: list[str]) -> str:
    head = [
        "\ufeffTOA5,site,CR1000,E7000,CR1000.Std.22,CPU:mast.CR1,12345,mast,",
        "Timestamp,RECORD,Spd80mN,Spd80mS,Spd80mNStd,Dir78mS,T2m,RH2m,P2m",
        "TS,RN,Metres/Second,Metres/Second,Metres/Second,Deg,Celcius,%,Millibar",
        ",,Avg,Avg,Std,WVc,Smp,Avg,Avg",
    ]
    rows = [f"{stamp},{i},{8 + i}.37,7.9,1.2,114.2,0.5,98,935" for i, stamp in enumerate(stamps)]
    return "\n".join([*head, *rows, ""])


def test_a_toa5_table_saved_by_a_spreadsheet_is_read_with_its_own_order_of_dates() -> None:
    log = read(resaved([f"{day}/01/2026 12:00:00+01:00" for day in range(9, 16)]))
    shows(
        log,
        "toa5",
        "2026-01-09T11:00:00Z",
        wind_speed=8.37,
        air_temperature=273.65,
        air_pressure=93_500,
    )
    assert kinds(log)["several-anemometers"] == 1


def test_a_toa5_table_with_ambiguous_dates_is_refused_unless_the_order_is_given() -> None:
    text = resaved([f"09/01/2026 12:0{i}:00" for i in range(4)])
    with pytest.raises(TimeError, match="day/month or month/day") as caught:
        read(text, zone="UTC")
    assert "--date-order" in (caught.value.fix or "")
    shows(read(text, zone="UTC", date_order="mdy"), "toa5", "2026-09-01T12:00:00Z")


def weatherlink(
    speeds: Sequence[float], *, blanks: bool = False, wind_above_dir: bool = True
) -> str:
    upper = ["", "", "Temp", "Hi", "Wind", "Wind" if wind_above_dir else "", "Hi", "Hi"]
    lower = ["Date", "Time", "Out", "Temp", "Speed", "Dir", "Speed", "Dir"]
    rows = [
        [
            f"{25 + at // 3}/05/26",
            f"1{at % 3}:30{'ap'[at % 3 // 2]}",
            "20.1",
            "21",
            f"{speed:g}",
            "NNE",
            "9",
            "N",
        ]
        for at, speed in enumerate(speeds)
    ]
    if blanks:
        padded = ["".join(f"{cell:>9}" for cell in row) for row in (upper, lower, *rows)]
        return "\n".join([*padded[:2], "-" * 72, *padded[2:], ""])
    return "\n".join("\t".join(row) for row in (upper, lower, *rows)) + "\n"


MILES = (1, 2, 3, 5, 8, 9)
"""Speeds in the whole miles per hour that a console keeps."""


@pytest.mark.parametrize(
    "layout", [{}, {"blanks": True}, {"blanks": True, "wind_above_dir": False}]
)
@pytest.mark.parametrize(("unit", "scale"), [("mph", 1.0), ("km/h", 1.609344), ("m/s", 0.44704)])
def test_the_unit_of_weatherlinks_print_shows_in_whole_miles_and_is_to_be_confirmed(
    unit: str, scale: float, layout: dict[str, bool]
) -> None:
    log = read(weatherlink([round(speed * scale, 1) for speed in MILES], **layout), zone="UTC")
    shows(log, "weatherlink", "2026-05-25T10:30:00Z", wind_direction=[np.radians(22.5)] * 6)
    assert iso(int(log.series.time[2])) == "2026-05-25T12:30:00Z"
    assert log.series.channels["wind_speed"] == pytest.approx(np.array(MILES) * 0.44704, abs=0.05)
    assert log.drafted
    assert not log.stated
    assert f"in {unit}" in log.reasons[1]
    assert recipes.parse(log.drafted, where="the draft").channels["wind_speed"].unit == unit


def test_a_unit_that_the_user_gives_of_weatherlinks_print_needs_no_confirmation() -> None:
    given = read(weatherlink((1.6, 3.2, 4.8)), zone="UTC", unit="km/h")
    shows(given, "weatherlink", wind_speed=[1.6 / 3.6, 3.2 / 3.6, 4.8 / 3.6])
    assert not given.drafted
    with pytest.raises(InputError, match="states no unit of 'Wind Speed'") as caught:
        read(weatherlink((1.6, 3.2, 4.8)), zone="UTC")
    assert "--unit" in (caught.value.fix or "")


def test_weatherlink_com_names_its_units() -> None:
    head = (
        '"Date & Time","Temp - °C","Hum - %","Barometer - mb","Avg Wind Speed - km/h","Prevailing '
        'Wind Direction",'
        '"High Wind Speed - km/h"'
    )
    rows = [f'"5/{13 + i}/26 12:05 AM","20.1","55","1013","{18 + i}.0","SW","30"' for i in range(4)]
    rows.append('"5/17/26 12:05 AM","--","--","--","--","--","--"')
    log = read("\n".join(["Station,Somewhere", *[head], *rows, ""]), zone="UTC")
    shows(
        log,
        "davis",
        "2026-05-13T00:05:00Z",
        missing=[4],
        wind_speed=5.0,
        wind_direction=np.radians(225),
    )
    assert "air_pressure" not in log.series.channels


ECOWITT = (
    "Time,Indoor Temperature(℃),Outdoor Temperature(℃),Outdoor "
    "Humidity(%),Wind(m/s),Gust(m/s),Wind Direction(deg),"
    "ABS Pressure(hPa),REL Pressure(hPa)"
)


@pytest.mark.parametrize(
    ("unit", "scale"), [("m/s", 1.0), ("km/h", 1 / 3.6), ("mph", 0.44704), ("knots", 1852 / 3600)]
)
def test_ecowitt_names_its_units_in_brackets(unit: str, scale: float) -> None:
    rows = [
        f"2026-09-18 14:{25 + i},21.0,15.0,80,{3 + i}.5,6.0,{180 + i},1000.1,1013.0"
        for i in range(4)
    ]
    text = "\n".join(
        [
            ECOWITT.replace("m/s", unit),
            *rows,
            "2026-09-18 14:29,21.0,--.-,--,--.-,--.-,---,1000.0,1013.0",
            "2026-09",
        ]
    )
    log = read(text, zone="UTC")
    shows(
        log,
        "ecowitt",
        missing=[4],
        wind_speed=3.5 * scale,
        air_temperature=288.15,
        air_pressure=100_010,
    )
    assert kinds(log)["cut-off"] == 1


def test_ecowitt_groups_in_a_line_above_belong_to_the_names() -> None:
    groups = ["Time", "Outdoor", "", "Indoor", "", "Wind", "", "", "Pressure", ""]
    names = [
        "",
        "Temperature(℃)",
        "Humidity(%)",
        "Temperature(℃)",
        "Humidity(%)",
        "Wind Speed(m/s)",
        "Wind Gust(m/s)",
    ]
    names += ["Wind Direction(º)", "Relative(hPa)", "Absolute(hPa)"]
    head = [",".join(f'"{cell}"' for cell in cells) for cells in (groups, names)]
    rows = [
        f'"2026/9/18 9:{15 + i}","15.0","80","21.0","50","3.{i}","6.0","180","1013.0","1000.0"'
        for i in range(4)
    ]
    log = read("\n".join([*head, *rows, ""]), zone="UTC")
    air = {"air_temperature": 288.15, "air_pressure": 100_000}
    shows(log, "ecowitt", "2026-09-18T09:15:00Z", wind_speed=[3.0, 3.1, 3.2, 3.3], **air)


def test_easyweather_directions_are_points_of_the_compass() -> None:
    names = [
        "No",
        "Time",
        "Indoor Temperature(°C)",
        "Outdoor Temperature(°C)",
        "Absolute Pressure(hpa)",
        "Wind(km/h)",
    ]
    head = "\t".join([*names, "Gust(km/h)", "Direction"])
    rows = [
        f"{i}\t2026-09-18 14:{25 + i}\t21,0\t15,0\t1000,0\t{3 + i},6\t7,2\tWSW" for i in range(4)
    ]
    log = read("\n".join([head, *rows, ""]), zone="UTC")
    shows(log, "ecowitt", wind_speed=1.0, wind_direction=np.radians(247.5))


def hobo(unit: str = "m/s") -> str:
    marks = "(LGR S/N: 123, SEN S/N: 456)"
    head = (
        f'"#","Date Time, GMT-05:00","Wind Speed, {unit} {marks}","Gust Speed, {unit} {marks}",'
        f'"Wind Direction, ø {marks}","Temp, °C {marks}","RH, % {marks}",'
        f'"Host Connected (LGR S/N: 123)","End Of File (LGR S/N: 123)"'
    )
    rows = [
        f"{i},07/{15 + i}/26 12:05:00 PM,{2 + i}.5,4.0,{90 + i}.0,20.5,55.0,," for i in range(4)
    ]
    rows += [
        "5,07/19/26 12:05:00 PM,-888.88,4.0,90.0,20.5,55.0,,",
        "6,07/19/26 12:06:10 PM,,,,,,Logged,Logged",
    ]
    return "\n".join(['"Plot Title: Roof"', head, *rows, ""])


def test_hobo_states_zone_and_units_in_its_heading() -> None:
    log = read(hobo())
    shows(
        log,
        "hobo",
        "2026-07-15T17:05:00Z",
        missing=[4, 5],
        wind_speed=2.5,
        wind_direction=np.pi / 2,
    )
    shows(log, "hobo", relative_humidity=0.55)
    shows(read(hobo("mph")), "hobo", wind_speed=2.5 * 0.44704)


def test_hobo_in_an_unknown_unit_is_refused() -> None:
    with pytest.raises(InputError, match="its unit is 'Bft'"):
        read(hobo("Bft"))


def test_hobolink_writes_the_sensor_before_the_unit() -> None:
    head = (
        'Line#,Date,"Wind Speed (S-WSB 10:11-1),m/s,Roof","Wind Direction (S-WDA 10:12-1),Deg,Roof"'
    )
    rows = [f"{i},07/{15 + i}/26 12:05:00,{2 + i}.5,90" for i in range(4)]
    shows(read("\n".join([head, *rows, ""]), zone="UTC"), "hobo", wind_speed=[2.5, 3.5, 4.5, 5.5])


def test_eddypro_units_are_those_of_its_third_line() -> None:
    head = [
        "file_info,,,,air_properties,,,rotated_wind,,",
        "filename,date,time,DOY,sonic_temperature,air_temperature,air_pressure,u_rot,wind_speed,wind_dir",
        ",[yyyy-mm-dd],[HH:MM],[ddd.ddd],[K],[K],[Pa],[m+1s-1],[m+1s-1],[deg_from_north]",
    ]
    rows = [
        f"f{i}.raw,2026-05-01,{12 + i}:30,121.5,290.1,289.5,101325,2.5,2.{5 + i},200"
        for i in range(4)
    ]
    rows.append(
        "not_enough_data,2026-05-01,16:30,121.7,-9999.0,-9999.0,-9999.0,-9999.0,-9999.0,-9999.0"
    )
    log = read("\n".join([*head, *rows, ""]), zone="UTC")
    shows(
        log,
        "eddypro",
        "2026-05-01T12:30:00Z",
        missing=[4],
        wind_speed=2.5,
        wind_direction=np.radians(200),
    )
    assert log.series.sensor.averaging == 3600.0


EDDYPRO = {
    "filename": "",
    "date": "[yyyy-mm-dd]",
    "time": "[HH:MM]",
    "DOY": "[ddd.ddd]",
    "H_strg": "[W+1m-2]",
    "sonic_temperature": "[K]",
    "air_temperature": "[K]",
    "air_pressure": "[Pa]",
    "RH": "[%]",
    "u_rot": "[m+1s-1]",
    "v_rot": "[m+1s-1]",
    "w_rot": "[m+1s-1]",
    "wind_speed": "[m+1s-1]",
    "max_wind_speed": "[m+1s-1]",
    "wind_dir": "[deg_from_north]",
    "yaw": "[deg]",
    "u_spikes": "[#]",
    "v_spikes": "[#]",
    "u_var": "[m+2s-2]",
}
"""Some columns of EddyPro's full output with their units."""


def eddypro(units: Sequence[str]) -> str:
    def row(at: int) -> str:
        own = {
            "filename": f"f{at}.raw",
            "date": "2026-05-01",
            "time": f"{12 + at // 2}:{30 * (at % 2):02d}",
        }
        own |= {
            "wind_speed": f"2.{at}",
            "wind_dir": f"{200 + at}",
            "air_temperature": "289.5",
            "RH": "60.5",
        }
        return ",".join(own.get(name, f"{at % 3}") for name in EDDYPRO)

    head = ["file_info" + "," * (len(EDDYPRO) - 1), ",".join(EDDYPRO), ",".join(units)]
    return "\n".join([*head, *map(row, range(10)), ""])


@pytest.mark.parametrize("lost", ["filename", "date", "DOY", "H_strg", "air_temperature"])
def test_eddypro_units_that_lack_a_cell_are_refused_with_the_line_that_reads_them(
    lost: str,
) -> None:
    text = eddypro([unit for name, unit in EDDYPRO.items() if name != lost])
    with pytest.raises(
        InputError, match="1 fewer of them, do not stand below their names"
    ) as caught:
        read(text, zone="UTC")
    (line,) = re.findall(r"--columns '([^']*)'", caught.value.fix or "")
    found = read(text, zone="UTC", columns=line)
    winds = {
        "wind_speed": [2 + at / 10 for at in range(10)],
        "wind_direction": np.radians(range(200, 210)).tolist(),
    }
    shows(found, "delimited", "2026-05-01T12:00:00Z", air_temperature=[289.5] * 10, **winds)


def test_eddypro_units_that_end_early_but_stand_below_their_names_are_taken() -> None:
    found = read(eddypro(list(EDDYPRO.values())[:-2]), zone="UTC")
    assert (found.format, len(found.series)) == ("eddypro", 10)


def test_eddypro_directions_in_the_unit_of_another_column_are_refused_with_a_step() -> None:
    with pytest.raises(InputError, match=r"wind_dir in \[K\+1\]") as caught:
        read(
            eddypro([unit if name != "wind_dir" else "[K+1]" for name, unit in EDDYPRO.items()]),
            zone="UTC",
        )
    assert "--columns" in (caught.value.fix or "")


def test_statistics_of_components_are_no_wind_of_a_table_read_without_its_format(
    log_file: Callable[[str], Path],
) -> None:
    path = log_file(eddypro(list(EDDYPRO.values())))
    labels = anemometers(path, WindOptions(format="delimited", zone="UTC"))
    assert labels == ()  # one: components that were turned into the mean wind are none of their own


def test_flux_networks_have_fixed_units_and_stamp_the_end() -> None:
    head = "TIMESTAMP_START,TIMESTAMP_END,WS_F,WS_1_1_1,WD_1_1_1,TA_1_1_1,PA_1_1_1,RH_1_1_1"
    rows = [
        f"2026050112{30 * (i % 2):02d},2026050112{30 + i},9.9,2.{5 + i},200,15.0,101.3,60"
        for i in range(4)
    ]
    rows.append("202605011300,202605011330,9.9,-9999,-9999,-9999,-9999,-9999")
    log = read("\n".join([head, *rows, ""]), zone="-05:00")
    shows(log, "fluxnet", "2026-05-01T17:30:00Z", missing=[4], wind_speed=2.5, air_pressure=101_300)
    filled = head.replace(",WS_1_1_1", ",WS_F_QC")
    with pytest.raises(InputError, match="no column of wind speed"):
        read("\n".join([filled, *rows, ""]), zone="-05:00")


def surfrad_row(minute: int, speed: float, flag: int) -> str:
    pairs = [[100.0 + column, 0.0] for column in range(20)]
    pairs[15:20] = [[20.0, 0], [55.0, 0], [speed, flag], [200.0, 0], [1000.0, 0]]
    cells = " ".join(f"{value:8.1f} {int(quality)}" for value, quality in pairs)
    return f" 2026 121  5  1 12 {minute:2d} 12.000  40.00 {cells}"


def test_surfrad_is_in_utc_and_its_quality_flag_is_heeded() -> None:
    rows = [surfrad_row(i, 3.5 + i, 0) for i in range(4)] + [
        surfrad_row(4, -9999.9, 1),
        surfrad_row(5, 4.0, 2),
    ]
    log = read("\n".join([" Somewhere", "   40.05  -88.37  230 m version 1", *rows, rows[0][:60]]))
    shows(log, "surfrad", "2026-05-01T12:00:00Z", faults=[4, 5], air_pressure=100_000)
    assert log.series.channels["wind_speed"][:4].tolist() == [3.5, 4.5, 5.5, 6.5]
    assert log.series.sensor.height == 10.0
    assert kinds(log)["cut-off"] == 1


def test_icos_atmosphere_is_in_utc_and_its_flag_is_heeded() -> None:
    heading = "#Site;SamplingHeight;Year;Month;Day;Hour;Minute;DecimalDate;AT;WS;WS-Flag;WD"
    rows = "LIN;40.0;2026;05;01;12;00;2026.33;12.1;4.2;O;210\nLIN;40.0;2026;05;01;13;00;2026.33;12.2;9.9;K;215\n"
    log = read(f"# TITLE: meteorology\n{heading}\n{rows}")
    shows(log, "icos", "2026-05-01T12:00:00Z")
    assert log.series.sensor.height == 40.0
    assert kinds(log)["sensor-fault"] == 1


def test_icos_ecosystem_raw_files_have_one_stamp_and_fixed_units() -> None:
    log = read(
        "TIMESTAMP,TA_1_1_1,WS_1_1_1\n20260501120000,12.1,4.2\n20260501120010,12.1,4.4\n",
        zone="UTC",
    )
    shows(log, "icos-ecosystem", wind_speed=[4.2, 4.4])
    assert log.series.sensor.averaging is None
    minutes = read(
        "TIMESTAMP,WS_1_1_1\n" + "".join(f"2026050112{at:02d},{at}.5\n" for at in range(5)),
        zone="UTC",
    )
    assert np.diff(minutes.series.time).tolist() == [60_000_000_000] * 4
