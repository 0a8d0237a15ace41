"""Logs in the forms that services, stations and radios publish: what their descriptions say is not asked for."""

from __future__ import annotations

import datetime as dt
import json
import re
from collections.abc import Callable
from functools import reduce
from operator import xor
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer import WindOptions, anemometers, read_log
from flagdata.signals import WindLog
from flagdata.timebase import iso

Read = Callable[..., WindLog]
Write = Callable[..., Path]
KNOT, MILE = 1852 / 3600, 0.44704
START = dt.datetime(2024, 5, 17, 22, 0, tzinfo=dt.UTC)
SPEEDS = [3, 4, 5, 6, 7, 6, 5, 4, 3, 2, 3, 4, 5, 6]
DEGREES = [220, 230, 240, 250, 260, 250, 240, 230, 220, 210, 200, 210, 220, 230]


def rows(step: float = 3600) -> list[tuple[dt.datetime, int, int]]:
    return [
        (START + dt.timedelta(seconds=step * at), s, d) for at, (s, d) in enumerate(zip(SPEEDS, DEGREES, strict=True))
    ]


def check(log: WindLog, factor: float, *, start: str = "2024-05-17T22:00:00", missing: int | None = None) -> None:
    speed, away = np.array(SPEEDS) * factor, np.array(DEGREES, dtype=float)
    if missing is not None:
        speed[missing] = away[missing] = np.nan
    channels = log.series.channels
    np.testing.assert_allclose(channels["wind_speed"], speed, atol=1e-6)
    np.testing.assert_allclose(np.rad2deg(channels["wind_direction"]), away, atol=1e-6)
    assert str(np.datetime64(int(log.series.time[0]), "ns"))[:19] == start


BUOY = "#YY  MM DD hh mm WDIR WSPD GST  WVHT   PRES  ATMP\n#yr  mo dy hr mn degT m/s  m/s     m    hPa  degC\n"


def test_a_buoys_table_is_utc_and_its_nines_are_none(read: Read) -> None:
    lines = [f"{t:%Y %m %d %H %M} {d:3d} {s:4.1f} {s + 2:4.1f} 99.00 1012.3 15.2" for t, s, d in rows()]
    lines[3] = f"{rows()[3][0]:%Y %m %d %H %M} 999 99.0 99.0 99.00 9999.0 999.0"
    check(read(BUOY + "\n".join(lines)), 1.0, missing=3)


def test_99_is_a_direction_of_a_buoys_wind(read: Read) -> None:
    lines = [f"{t:%Y %m %d %H %M} {s + 96:3d} {s:4.1f} {s + 2:4.1f} 99.00 1012.3 15.2" for t, s, _ in rows()]
    assert np.rad2deg(read(BUOY + "\n".join(lines)).series.channels["wind_direction"][0]) == pytest.approx(99)


def test_a_buoys_older_table_has_years_of_two_digits(read: Read) -> None:
    head = "YY MM DD hh WD   WSPD GST  WVHT  BAR    ATMP\n"
    lines = [f"94 {t:%m %d %H} {d:3d} {s:4.1f} {s + 2:4.1f} 99.00 1012.3 15.2" for t, s, d in rows()]
    check(read(head + "\n".join(lines)), 1.0, start="1994-05-17T22:00:00")


@pytest.mark.parametrize(
    ("head", "form", "zone"),
    [
        ("STATIONS_ID;MESS_DATUM;QN_3;   F;   D;eor", "       1048;{t:%Y%m%d%H};   10;{s:8.1f};{d:4d};eor", None),
        ("STATIONS_ID;MESS_DATUM;  QN;FF_10;DD_10;eor", "       1048;{t:%Y%m%d%H%M};    3;{s:5.1f};{d:4d};eor", None),
        ("numer_sta;date;pmer;dd;ff;t;u;raf10", "07149;{t:%Y%m%d%H%M%S};101230;{d};{s}.0;285.4;77;{s}.9", None),
        ("NUM_POSTE;NOM_USUEL;AAAAMMJJHH;FF;QFF;DD;QDD", "75114001;X;{t:%Y%m%d%H};{s}.0;1;{d};1", "UTC"),
        ("STN,YYYYMMDD,   HH,   DD,   FF,   FX", "  260,{t:%Y%m%d},{t:%H},{d:5d},{s}0,{s}9", None),
    ],
)  # fmt: skip
def test_tables_of_services_need_no_unit(read: Read, head: str, form: str, zone: str | None) -> None:
    lines = [form.format(t=t, s=s, d=d) for t, s, d in rows()]
    check(read(f"{head}\n" + "\n".join(lines), zone=zone), 1.0)


def test_dwds_ten_minutes_before_2000_are_of_central_europe(read: Read) -> None:
    lines = [f"1048;{t.replace(year=1999):%Y%m%d%H%M};3;{s}.0;{d};eor" for t, s, d in rows()]
    log = read("STATIONS_ID;MESS_DATUM;QN;FF_10;DD_10;eor\n" + "\n".join(lines))
    check(log, 1.0, start="1999-05-17T21:00:00")


def test_knmis_hour_24_ends_the_day_and_990_is_variable(read: Read) -> None:
    about = "# FF = Mean wind speed (in 0.1 m/s)\n# DD = Mean wind direction (0=calm 990=variable)\n"
    lines = [f"  260,20240517,{at + 11:5d},{d},{s}0" for at, (_, s, d) in enumerate(rows())]
    lines[0] = lines[0].replace(",220,", ",990,")
    log = read(f"{about}# STN,YYYYMMDD,   HH,   DD,   FF\n\n" + "\n".join(lines))
    assert str(np.datetime64(int(log.series.time[-1]), "ns"))[:19] == "2024-05-18T00:00:00"
    np.testing.assert_allclose(log.series.channels["wind_speed"], SPEEDS)
    assert np.isnan(log.series.channels["wind_direction"][0])


def test_words_for_missing_of_a_service_are_none(read: Read) -> None:
    lines = [f"07149;{t:%Y%m%d%H%M%S};{d};{s}.0" for t, s, d in rows()]
    lines[3] = f"07149;{rows()[3][0]:%Y%m%d%H%M%S};mq;mq"
    check(read("numer_sta;date;dd;ff\n" + "\n".join(lines)), 1.0, missing=3)


@pytest.mark.parametrize(("number", "factor"), [(1, MILE), (16, 1 / 3.6), (17, 1.0)])
def test_a_station_archives_own_column_tells_its_units(read: Read, number: int, factor: float) -> None:
    lines = [f"{int(t.timestamp())},{number},5,29.9,{s},{d}" for t, s, d in rows()]
    check(read("dateTime,usUnits,interval,barometer,windSpeed,windDir\n" + "\n".join(lines)), factor)


def test_an_archive_in_two_units_is_not_read_in_one(log_file: Write) -> None:
    lines = [f"{1715983200 + 300 * at},{1 if at < 7 else 16},{s},{d}" for at, (_, s, d) in enumerate(rows())]
    with pytest.raises(FlagdataError):
        read_log(log_file("dateTime,usUnits,windSpeed,windDir\n" + "\n".join(lines)))


def test_isd_lite_is_in_tenths_and_utc(read: Read) -> None:
    lines = [f"{t:%Y %m %d %H}   123    81 10123 {d:5d} {10 * s:5d} -9999 -9999 -9999" for t, s, d in rows()]
    lines[3] = f"{rows()[3][0]:%Y %m %d %H}   123    81 10123 -9999 -9999 -9999 -9999 -9999"
    check(read("\n".join(lines)), 1.0, missing=3)


def test_meteostats_lines_are_in_kilometres_an_hour_and_utc(read: Read) -> None:
    lines = [f"{t:%Y-%m-%d},{t.hour},12.3,8.1,77,0.0,,{d},{3.6 * s:.1f},,1012.3,,3" for t, s, d in rows()]
    lines[3] = f"{rows()[3][0]:%Y-%m-%d},{rows()[3][0].hour},12.3,8.1,77,0.0,,,,,1012.3,,3"
    check(read("\n".join(lines)), 1.0, missing=3)


def test_asos_of_one_minute_takes_its_utc_clock_past_midnight(read: Read) -> None:
    form = (
        "94846KORD ORD{l:%Y%m%d%H%M}{t:%H%M}   0.113 D                  {d:3d}   {s:3d}   {d:3d}   {g:3d}   28    60+"
    )
    lines = [form.format(l=t - dt.timedelta(hours=6), t=t, s=s, g=s + 2, d=d) for t, s, d in rows()]
    check(read("\n".join(lines)), KNOT)


def test_asos_of_five_minutes_is_a_report_of_the_next_day_in_utc(read: Read) -> None:
    form = "94846KORD ORD{l:%Y%m%d%H%M}082{l:%m/%d/%y %H:%M:%S}  5-MIN "
    form += "KORD {t:%d%H%M}Z AUTO {d:03d}{s:02d}KT 10SM CLR 12/08"
    lines = [form.format(l=t - dt.timedelta(hours=6), t=t, s=s, d=d) for t, s, d in rows()]
    check(read("\n".join(lines)), KNOT)


@pytest.mark.parametrize(("name", "factor"), [("km/h", 1 / 3.6), ("mph", MILE), ("kts", KNOT), ("m/s", 1.0)])
def test_cumulus_realtime_names_its_unit_in_each_line(read: Read, name: str, factor: float) -> None:
    form = "{t:%d/%m/%y %H:%M:%S} 14.1 71 8.9 {s}.0 {s}.9 {d} 0.0 0.2 1013.4 SW 3 {u} C hPa mm 88.1 -0.2 30.4 211.7 2.3"
    check(read("\n".join(form.format(t=t, s=s, d=d, u=name) for t, s, d in rows()), zone="UTC"), factor)


@pytest.mark.parametrize(("bearing", "point"), [(0, "---"), (360, "N")])
def test_cumulus_realtime_has_no_direction_in_calm_air(read: Read, bearing: int, point: str) -> None:
    form = "23/02/26 09:{minute}:30 9.3 81 6.2 0.0 0.4 {d} 0.0 0.2 1009.8 {p} 0 m/s C hPa mm 40.1 -0.1 12.4 80.9 1.1\n"
    text = form.format(minute=15, d=bearing, p=point) + form.format(minute=16, d=205, p="SSW")
    log = read(text, zone="UTC")
    towards = log.series.channels["wind_direction"]
    assert np.isnan(towards[0]) == (point == "---")
    assert np.degrees(towards[1]) == pytest.approx(205)


@pytest.mark.parametrize("sign", ["/", "-", "."])
def test_cumulus_realtime_writes_the_day_first(read: Read, sign: str) -> None:
    rest = "09:15:30 9.3 81 6.2 4.0 5.9 205 0.0 0.2 1009.8 SSW 2 m/s C hPa mm 40.1 -0.1 12.4 80.9 1.1\n"
    line = f"03{sign}02{sign}26 {rest}"
    assert iso(int(read(line, zone="UTC").series.time[0])) == "2026-02-03T09:15:30Z"
    assert iso(int(read(line, zone="UTC", date_order="mdy").series.time[0])) == "2026-03-02T09:15:30Z"
    shown = f"02{sign}23{sign}26 {rest}"
    assert iso(int(read(shown, zone="UTC").series.time[0])) == "2026-02-23T09:15:30Z"


def test_lines_of_clientraw_are_in_knots(read: Read) -> None:
    lines = []
    for t, s, d in rows():
        cells = ["0.0"] * 160
        cells[:7] = ["12345", f"{s}.0", f"{s}.9", str(d), "12.3", "77", "1012.4"]
        cells[29:32], cells[35], cells[36], cells[141] = (
            [f"{t:%H}", f"{t:%M}", f"{t:%S}"],
            str(t.day),
            str(t.month),
            "2024",
        )
        lines.append(" ".join(cells))
    check(read("\n".join(lines), zone="UTC"), KNOT)


APRS = "g{g:03d}t058r000p000P000h71b10123"


@pytest.mark.parametrize(
    ("form", "options"),
    [
        ("{t:%Y-%m-%d %H:%M:%S} UTC: FW0001>APRS,TCPIP*:@{t:%d%H%M}z5112.34N/00456.78E_{d:03d}/{s:03d}", {}),
        ("{t:%Y-%m-%d %H:%M:%S}: c{d:03d}s{s:03d}", {"zone": "UTC"}),
        ("@{t:%d%H%M}z5112.34N/00456.78E_{d:03d}/{s:03d}", {"date": dt.date(2024, 5, 17)}),
        ("_{t:%m%d%H%M}c{d:03d}s{s:03d}", {"date": dt.date(2024, 5, 17)}),
    ],
)
def test_weather_reports_of_amateur_radio_are_read(read: Read, form: str, options: dict[str, object]) -> None:
    lines = [(form + APRS).format(t=t, s=s, d=d, g=s + 3) for t, s, d in rows()]
    check(read("\n".join(lines), **options), MILE)


def test_the_day_of_radio_reports_without_a_year_is_asked_for(log_file: Write) -> None:
    path = log_file("\n".join(("@{t:%d%H%M}z5112.34N/00456.78E_220/004" + APRS).format(t=t, g=6) for t, _, _ in rows()))
    with pytest.raises(FlagdataError) as caught:
        read_log(path)
    assert "--date" in (caught.value.fix or "")


def sentence(body: str) -> str:
    return f"${body}*{reduce(xor, body.encode(), 0):02X}"


def test_sentences_of_an_acoustic_sensor_are_in_metres_a_second(read: Read) -> None:
    lines = [f"{t:%Y-%m-%d %H:%M:%S},{sentence(f'WI,WVP={s:05.1f},{d:03d},0')}" for t, s, d in rows()]
    lines[3] = f"{rows()[3][0]:%Y-%m-%d %H:%M:%S},{sentence('WI,WVP=000.0,000,1')}"
    check(read("\n".join(lines), zone="UTC"), 1.0, missing=3)


@pytest.mark.parametrize(
    "form",
    [
        "PASSKEY=0123&dateutc={t:%Y-%m-%d+%H:%M:%S}&tempf=55.1&winddir={d}&windspeedmph={s}.0&windgustmph={s}.9",
        (
            '10.0.0.7 - - [{t:%d/%b/%Y:%H:%M:%S} +0000] "GET /up.php?ID=K1&PASSWORD=x&dateutc=now&winddir={d}'
            '&windspeedmph={s}.0 HTTP/1.1" 200 7'
        ),
        "{t:%Y-%m-%dT%H:%M:%SZ} ID=K1&dateutc=now&winddir={d}&windspeedmph={s}.0",
    ],
)
def test_uploads_of_stations_are_read_without_their_passwords(read: Read, form: str) -> None:
    log = read("\n".join(form.format(t=t, s=s, d=d) for t, s, d in rows()))
    check(log, MILE)
    assert "PASS" not in log.drafted


def test_a_list_of_observations_deep_in_an_object_is_a_table(log_file: Write) -> None:
    data = [
        {"wmo": 94768, "aifstime_utc": f"{t:%Y%m%d%H%M%S}", "wind_spd_kmh": 3.6 * s, "wind_dir_deg": d}
        for t, s, d in rows()
    ]
    path = log_file(json.dumps({"observations": {"notice": [{"c": 1}], "header": [{"name": "X"}], "data": data}}))
    assert not anemometers(path)
    check(read_log(path, WindOptions()), 1.0)


def test_skies_observed_by_a_hub_are_winds(read: Read) -> None:
    lines = [
        json.dumps({"type": "obs_sky", "obs": [[int(t.timestamp()), 9000, 10, 0.0, 1.0, s, 9, d, 3.1]]})
        for t, s, d in rows()
    ]
    check(read("\n".join(lines)), 1.0)


def test_twelve_whole_numbers_after_a_date_need_not_be_isd_lite(log_file: Write) -> None:
    lines = [f"{t:%Y %m %d %H} 12 8 3 {d} {s} 4 5 6" for t, s, d in rows()]
    with pytest.raises(FlagdataError) as caught:
        read_log(log_file("\n".join(lines)))
    assert "--columns" in (caught.value.fix or "")


@pytest.mark.parametrize(("date", "delimiter", "comma"), [("%d-%m-%y", ";", True), ("%d/%m/%y", ",", False)])
def test_cumulus_monthly_log_is_told_by_its_fields_and_its_day_comes_first(
    read: Read, date: str, delimiter: str, comma: bool
) -> None:
    lines = []
    for t, s, d in rows():
        cells = ["7.9", "87", "5.9", f"{s:.1f}", f"{s + 2:.1f}", f"{d}", "0.0", "0.0", "1028.0", "210.3", "21.5", "52",
                 f"{s + 1:.1f}", "7.9", "7.9"]  # fmt: skip
        text = delimiter.join([t.strftime(date), t.strftime("%H:%M"), *cells])
        lines.append(text.replace(".", ",") if comma else text)
    log = read("\n".join(lines) + "\n", zone="UTC", unit="km/h")
    check(log, 1 / 3.6)
    np.testing.assert_allclose(log.series.channels["relative_humidity"], 0.87)


@pytest.mark.parametrize("fields", [15, 27])
def test_cumulus_momentary_readings_are_named_beside_its_averages(read: Read, fields: int) -> None:
    lines = []
    for at, (t, s, d) in enumerate(rows()):
        cells = ["7.9", "87", "5.9", f"{s:.1f}", f"{s + 2:.1f}", f"{d}", "0.0", "0.0", "1028.0", "210.3", "21.5", "52",
                 f"{s + 1:.1f}", "7.9", "7.9", *"0000500", f"{(d + 90 + at) % 360}", "0", "0"]  # fmt: skip
        lines.append(",".join([t.strftime("%d/%m/%y"), t.strftime("%H:%M"), *cells[: fields - 2]]))
    text = "\n".join(lines) + "\n"
    log = read(text, zone="UTC", unit="km/h")
    check(log, 1 / 3.6)
    (told,) = [one.what for one in log.findings if one.kind == "columns-not-read"]
    names = ["gust", "wind speed of latest samples", "wind direction of latest samples [deg]"]
    assert [name in told for name in names] == [True, True, fields == 27]
    columns = "time=time,wind speed of latest samples=wind_speed[km/h]"
    latest = read(text, zone="UTC", columns=columns).series
    np.testing.assert_allclose(latest.channels["wind_speed"], [(s + 1) / 3.6 for _, s, _ in rows()])
    line, *more = re.findall(r'--columns "([^"]*)"', told)
    assert len(more) == (fields == 27)
    for own in more:  # the speed of the latest samples has a direction that is called after it
        both = read(text, zone="UTC", columns=own).series.channels
        np.testing.assert_allclose(both["wind_speed"], latest.channels["wind_speed"])
        turned = [(d + 90 + at) % 360 for at, (_, _, d) in enumerate(rows())]
        np.testing.assert_allclose(np.rad2deg(both["wind_direction"]), turned)
    gust = read(text, zone="UTC", columns=line.replace("[?]", "[km/h]")).series
    np.testing.assert_allclose(gust.channels["wind_speed"], [(s + 2) / 3.6 for _, s, _ in rows()])


def test_the_speeds_of_the_iowa_mesonet_are_miles_an_hour(read: Read) -> None:
    lines = [f"EDXW,{t:%Y-%m-%d %H:%M},{'M' if at == 3 else s},{'M' if at == 3 else d}" for at, (t, s, d) in
             enumerate(rows())]  # fmt: skip
    check(read("station,valid,sped,drct\n" + "\n".join(lines), zone="UTC"), MILE, missing=3)


def test_the_latest_observations_of_buoys_are_a_wind_of_each_station(log_file: Write) -> None:
    head = "#STN     LAT      LON  YYYY MM DD hh mm WDIR WSPD   GST   PRES  ATMP\n"
    head += "#text    deg      deg   yr mo day hr mn degT  m/s   m/s    hPa  degC\n"
    names = ("44005", "44014", "52ST1", "PVGF1")
    lines = [
        f"{name:5s}  31.760  -74.840 2024 05 17 {20 + at % 2} {50 - 10 * at:02d} {d:3d}  {s}.0    MM 1012.3    MM"
        for at, (name, s, d) in enumerate(zip(names, SPEEDS, DEGREES, strict=False))
    ]
    logs = anemometers(log_file(head + "\n".join(lines)), WindOptions())
    assert sorted(logs) == sorted(names)
    for at, name in enumerate(names):
        series = read_log(log_file(head + "\n".join(lines)), WindOptions(wind=name)).series
        assert series.channels["wind_speed"] == pytest.approx([SPEEDS[at]])
        assert np.rad2deg(series.channels["wind_direction"]) == pytest.approx([DEGREES[at]])
        assert iso(int(series.time[0])) == f"2024-05-17T{20 + at % 2}:{50 - 10 * at:02d}:00Z"


DRIFT = "#YY  MM DD hhmm     LAT      LON WDIR WSPD GST   PRES PTDY ATMP WTMP\n"
DRIFT += "#yr  mo dy hrmn     deg      deg degT m/s  m/s    hPa  hPa degC degC\n"


def test_a_drifting_buoys_table_is_utc_and_its_gust_is_no_zone(read: Read) -> None:
    lines = [f"{t:%Y %m %d %H%M}   37.24   126.02 {d:3d}  {s}.0   MM 1004.2   MM 24.9 22.1" for t, s, d in rows()]
    log = read(DRIFT + "\n".join(lines))
    check(log, 1.0)
    assert all("GST" not in finding.what for finding in log.findings)


def test_the_supplemental_wind_of_a_buoy_is_said_to_be_the_highest(read: Read) -> None:
    head = "#YY  MM DD hh mm   PRES PTIME  WSPD  WDIR WTIME\n#yr  mo dy hr mn    hPa  hhmm   m/s  degT  hhmm\n"
    lines = [f"{t:%Y %m %d %H %M} 1019.3  1454     {s}   {d}  {t:%H%M}" for t, s, d in rows()]
    log = read(head + "\n".join(lines))
    check(log, 1.0)
    (said,) = [finding for finding in log.findings if finding.kind == "highest-wind"]
    assert said.severity.value == "warning"
    assert "WTIME" in said.what


def test_knmis_daily_values_are_read_without_their_station_and_with_hyphens(read: Read) -> None:
    rows = [f"1996-01-{1 + at:02d},-6,8,2,31,72,{51 + at},11,10026,100,{117 + at}" for at in range(20)]
    log = read("\n".join(["YYYYMMDD,TN,TX,TG,FHN,FHX,FG,RH,PG,UG,DDVEC", *rows]) + "\n")
    assert log.series.channels["wind_speed"][:2].tolist() == pytest.approx([5.1, 5.2])
    assert np.degrees(log.series.channels["wind_direction"][:2]).tolist() == pytest.approx([117, 118])
    assert "relative_humidity" not in log.series.channels
