"""Tables in the styles of real loggers, made here: right without a recipe, or refused with the one thing to say."""

from __future__ import annotations

import datetime as dt
import gzip
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flagdata.errors import FlagdataError
from flagdata.findings import Severity
from flagdata.ingest.anemometer import WindOptions, anemometers, completed, read_log, sniff
from flagdata.timebase import iso
from flagdata.timebase import parse as instant

Write = Callable[..., Path]

SPEED = [4.13, 4.71, 5.38, 5.92, 6.27, 5.16, 4.44, 4.89, 5.57, 6.68, 7.31, 6.04]
"""m/s; no multiples of another unit's step."""
START = dt.datetime(2026, 5, 13, 12, 0, tzinfo=dt.UTC)


def rows(form: str, *, step: float = 1.0, start: dt.datetime = START, count: int = len(SPEED)) -> str:
    """Lines of `form`: t the stamp, v the speed in m/s (kmh, mph, kn: in those), d a direction, i the number."""
    lines: list[str] = []
    for i in range(count):
        v = SPEED[i % len(SPEED)]
        t = start + dt.timedelta(seconds=i * step)
        lines.append(
            form.format(
                t=t,
                v=v,
                kmh=v * 3.6,
                mph=v / 0.44704,
                kn=v * 3600 / 1852,
                d=200 + 7 * i,
                i=i,
                n=i + 1,
                x=-v * 0.6,
                y=v * 0.8,
                w=0.1,
                c=20.5 + i / 10,
                s=i * step,
                ms=round(1000 * i * step) + 5312,
                epoch=t.timestamp(),
            )
        )
    return "\n".join(lines) + "\n"


T = "{t:%Y-%m-%d %H:%M:%S}"


@dataclass(frozen=True, kw_only=True)
class Table:
    """A made file.

    Attributes:
        text: of the file.
        says: what the user says, with the zone.
        asks: what a refusal must tell the user to say, when only the zone is said; "" where nothing else is needed.
        speed: expected [m/s].
        first: instant of the first row.
        has: further channels, with their first value [SI].
        lacks: channels that must not be read from it.
        within: relative error of the speed, that of the digits written.
    """

    text: str
    says: Mapping[str, Any] = field(default_factory=dict)
    asks: str = ""
    speed: tuple[float, ...] = tuple(SPEED)
    first: str = "2026-05-13T12:00:00Z"
    has: Mapping[str, float] = field(default_factory=dict)
    lacks: tuple[str, ...] = ()
    within: float = 1e-9


DEG = np.pi / 180
MS = {"unit": "m/s"}
TABLES: dict[str, Table] = {
    "plain": Table(text="time,wind_speed (m/s)\n" + rows(T + ",{v}")),
    "zone-in-stamps": Table(text="timestamp,ws_ms\n" + rows("{t:%Y-%m-%dT%H:%M:%S}+00:00,{v}")),
    "german-semicolons": Table(
        text="Station 7\n\nDatum;Uhrzeit;Windgeschwindigkeit [km/h];Windrichtung [°]\n"
        + rows("{t:%d.%m.%Y;%H:%M:%S};{kmh:.6f};{d}")
        .replace(".05.", "#")
        .replace(".2026", "~")
        .replace(".", ",")
        .replace("#", ".05.")
        .replace("~", ".2026"),
        within=1e-6,
        has={"wind_direction": 200 * DEG},
    ),
    "american": Table(
        text="Date Time,Gust (mph),Wind Speed (mph),Temp (F)\n"
        + rows("{t:%m/%d/%Y %I:%M:%S %p},{mph:.6f},{mph:.6f},68.0"),
        within=1e-6,
        has={"air_temperature": 293.15},
    ),
    "unix-tabs": Table(text="ts\tspeed_ms\n" + rows("{epoch:.0f}\t{v}")),
    "unix-ms": Table(text="timestamp_ms,wind_kts\n" + rows("{epoch:.0f}000,{kn:.6f}"), within=1e-6),
    "unix-ns-influx": Table(text="time,wind_speed_mps\n" + rows("{epoch:.0f}000000000,{v}")),
    "epoch-fraction": Table(text="t_unix,windSpeedMps\n" + rows("{epoch:.3f},{v}")),
    "unit-row": Table(
        text="TIMESTAMP,WS,WD,RH\nUTC,m/s,deg,%\n" + rows(T + ",{v},{d},55"), has={"relative_humidity": 0.55}
    ),
    "units-below-with-blanks": Table(
        text="Date/Time\tWind Speed\tWind Direction\n\tMetres/Second\tDeg\n\n" + rows(T + "\t{v}\t{d}")
    ),
    "blanks": Table(text="# date time ws[m/s] wd[deg]\n" + rows("{t:%Y-%m-%d %H:%M:%S}  {v}   {d}")),
    "blanks-padded": Table(
        text="      Date     Time   Speed(m/s)   Dir\n" + rows("{t:%Y-%m-%d %H:%M:%S}     {v:>8}   {d:>5}"),
        has={"wind_direction": 200 * DEG},
    ),
    "padded-title-rows": Table(
        text="Site A,Logger 12,,,\nExported 2026,,,,\n\nTime,Battery (V),Wind Speed (m/s),Wind Dir (deg),Note\n"
        + rows(T + ",12.6,{v},{d},"),
    ),
    "trailing-tabs": Table(text="Time\tWindspeed [m/s]\t\t\n" + rows(T + "\t{v}\t\t")),
    "trailing-tabs-of-rows": Table(text="Time\tWindspeed [m/s]\n" + rows(T + "\t{v}\t\t")),
    "unnamed-columns-at-the-end": Table(
        text="Time,Windspeed [m/s],Temp [°C],Battery [V],Power [W],,,\n" + rows(T + ",{v},20,12.6,1,,,{v}")
    ),
    "pandas-index": Table(text=",time,wind_mps\n" + rows("{i}," + T + ",{v}")),
    "r-row-names": Table(text='"time" "ws_ms" "wd"\n' + rows('"{n}" "{t:%Y-%m-%dT%H:%M:%S}" {v} {d}')),
    "r-mangled": Table(text="Date.Time,Wind.Speed..m.s.,Temp...C.\n" + rows(T + ",{v},20")),
    "duplicate-headings": Table(
        text="time,status,ws [m/s],status\n" + rows(T + ",0,{v},0"),
    ),
    "named-T": Table(text="T,wind_mps\n" + rows(T + ",{v}")),
    "T-is-the-air": Table(text="time,T [°C],ws [m/s]\n" + rows(T + ",{c},{v}"), has={"air_temperature": 293.65}),
    "T-of-a-sonic": Table(
        text="time,u [m/s],v [m/s],w [m/s],T [°C]\n" + rows(T + ",{x:.6f},{y:.6f},{w},{c}"),
        within=1e-6,
        has={"sonic_temperature": 293.65, "wind_z": 0.1},
        lacks=("air_temperature",),
    ),
    "uvw-without-unit": Table(
        text="TIMESTAMP,U_[R350],V_[R350],W_[R350],T_SONIC_[R350]\n" + rows(T + ",{x:.6f},{y:.6f},{w},293.5"),
        says=MS,
        asks="--unit",
        within=1e-6,
        lacks=("air_temperature",),
        has={"sonic_temperature": 293.5},
    ),
    "ux-uy-uz": Table(text="Time,Ux(m/s),Uy(m/s),Uz(m/s),Ts(C)\n" + rows(T + ",{x:.6f},{y:.6f},{w},{c}"), within=1e-6),
    "icos-name": Table(
        text="TIMESTAMP_END,WS_CUP_T1_2_1_Avg [m s-1],WD_VANE_T1_2_1_Avg [deg],TS_1_1_1 [degC]\n"
        + rows("{t:%Y%m%d%H%M},{v},{d},11", step=60),
        lacks=("sonic_temperature", "air_temperature"),
    ),
    "compact-stamps-without-unit": Table(
        text="TIMESTAMP,WS,WD\n" + rows("{t:%Y%m%d%H%M},{v},{d}", step=60), says=MS, asks="--unit"
    ),
    "no-unit": Table(text="time,wind_speed,wind_direction\n" + rows(T + ",{v},{d}"), says=MS, asks="--unit"),
    "no-unit-in-kmh": Table(
        text="time,wind\n" + rows(T + ",{kmh:.6f}"), says={"unit": "km/h"}, asks="--unit", within=1e-6
    ),
    "gust-is-no-wind": Table(
        text="time,wind_gust_ms,gust_dir_deg,wind_speed_ms,temp_f\n" + rows(T + ",19.1,10,{v},68"),
        lacks=("wind_direction",),
        has={"air_temperature": 293.15},
    ),
    "other-temperatures": Table(
        text="time,Dew Point (°C),Wind Chill (°C),Wind Speed (m/s),Logger Temp (°C),Anemometer Temp (°C)\n"
        + rows(T + ",5,6,{v},30,31"),
        lacks=("air_temperature",),
    ),
    "hobo": Table(
        text='"Plot Title: mast"\n"#","Date Time, GMT+00:00","Wind Speed, m/s (LGR S/N: 1, SEN S/N: 2)",'
        '"Gust Speed, m/s (LGR S/N: 1, SEN S/N: 2)","Wind Direction, ø (LGR S/N: 1, SEN S/N: 3)"\n'
        + rows("{n},{t:%m/%d/%y %I:%M:%S %p},{v},9.9,{d}"),
        has={"wind_direction": 200 * DEG},
        says={"zone": None},
    ),
    "zentra-units-first": Table(
        text="Timestamps,° Wind Direction,m/s Wind Speed,m/s Gust Speed,kPa Reference Pressure\n"
        + rows("{t:%m/%d/%Y %H:%M},{d},{v},9.9,97.8", step=60),
        has={"air_pressure": 97_800.0},
    ),
    "ambient": Table(
        text="Date,Simple Date,Outdoor Temperature (°F),Wind Speed (mph),Wind Gust (mph),Humidity (%)\n"
        + rows("{t:%Y-%m-%dT%H:%M:%S}+00:00," + T + ",68,{mph:.6f},30,55"),
        within=1e-6,
    ),
    "open-meteo": Table(
        text="latitude,longitude\n52.5,13.4\n\ntime,wind_speed_10m (km/h),wind_direction_10m (°),temperature_2m (°C)\n"
        + rows("{t:%Y-%m-%dT%H:%M},{kmh:.6f},{d},20", step=3600),
        within=1e-6,
    ),
    "split-date": Table(
        text="Year,Month,Day,Hour,Minute,Second,WS(m/s),WD(deg)\n" + rows("{t:%Y,%m,%d,%H,%M,%S},{v},{d}"),
    ),
    "buoy-blanks": Table(
        text="#YY  MM DD hh mm WDIR WSPD\n#yr  mo dy hr mn degT m/s\n" + rows("{t:%Y %m %d %H %M} {d} {v}", step=600),
        has={"wind_direction": 200 * DEG},
    ),
    "day-of-year": Table(text="year,doy,hour,min,wspd_ms\n" + rows("{t:%Y,%j,%H,%M},{v}", step=60)),
    "month-names": Table(text="Time,Speed m/s\n" + rows("{t:%d-%b-%Y %H:%M:%S},{v}")),
    "date-and-time-apart": Table(
        text="No;Date;Battery;Time;Wind (km/h)\n" + rows("{n};{t:%Y-%m-%d};12;{t:%H:%M:%S};{kmh:.6f}"), within=1e-6
    ),
    "order-not-told": Table(
        text="Date,Wind Speed (m/s)\n"
        + rows("{t:%d/%m/%Y %H:%M:%S},{v}", start=dt.datetime(2026, 5, 4, 12, tzinfo=dt.UTC)),
        says={"date_order": "dmy"},
        asks="--date-order",
        first="2026-05-04T12:00:00Z",
    ),
    "midnight-is-bare": Table(
        text="time,ws [m/s]\n"
        + rows(T + ",{v}", step=600, start=dt.datetime(2026, 5, 13, 23, 0, tzinfo=dt.UTC)).replace(" 00:00:00", ""),
        first="2026-05-13T23:00:00Z",
    ),
    "millis": Table(
        text="millis,wind (m/s)\n" + rows("{ms},{v}"), says={"start": instant("2026-05-13T12:00:00Z")}, asks="--start"
    ),
    "seconds-since-start": Table(
        text="Time (s),Anemometer velocity (m/s)\n" + rows("{s:.2f},{v}", step=0.05),
        says={"start": instant("2026-05-13T12:00:00Z")},
        asks="--start",
    ),
    "time-of-day": Table(
        text="Time;Wind m/s\n" + rows("{t:%H:%M:%S};{v}"), says={"date": dt.date(2026, 5, 13)}, asks="--date"
    ),
    "excel-serial-days": Table(
        text="Date,Wind speed [m/s]\n" + "".join(f"{46155.5 + i / 1440:.9f},{v}\n" for i, v in enumerate(SPEED)),
    ),
    "missing-codes": Table(
        text="time,ws (m/s)\n" + rows(T + ",{v}").replace(",5.38\n", ",-9999\n").replace(",6.27\n", ",NA\n"),
        speed=tuple(np.nan if v in (5.38, 6.27) else v for v in SPEED),
    ),
    "no-heading": Table(text=rows(T + ",{v}"), says={"wind": "2", **MS}, asks="--wind"),
    "words-of-no-wind": Table(
        text="time,Channel 3,Channel 4\n" + rows(T + ",{v},1"), says={"wind": "Channel 3", **MS}, asks="--wind"
    ),
    "lone-speed-of-a-boat": Table(
        text="time,lat,lon,speed (m/s)\n" + rows(T + ",52.1,4.2,{v}"),
        says={"wind": "speed (m/s)"},
        asks="--wind",
    ),
    "sectors": Table(
        text="time,wind_speed (km/h),wind_direction\n" + rows(T + ",{kmh:.6f},{i}"),
        within=1e-6,
        lacks=("wind_direction",),
    ),
    "spanish": Table(
        text="Fecha y hora;Velocidad del viento (m/s);Dirección del viento (°)\n"
        + rows("{t:%d/%m/%Y %H:%M};{v};{d}", step=60),
        has={"wind_direction": 200 * DEG},
    ),
    "french": Table(text="Date;Heure;Vitesse du vent (km/h)\n" + rows("{t:%d/%m/%Y;%H:%M:%S};{kmh:.6f}"), within=1e-6),
    "same-in-two-units": Table(
        text="time,wind speed (m/s),wind speed (kts)\n" + rows(T + ",{v},{kn:.3f}"),
    ),
    "instant-and-mean": Table(text="time,WindSpeed_Inst_ms,WindSpeed_Avg_ms\n" + rows(T + ",{v},5.5")),
    "utc-heading": Table(text="datetime_utc,wind_speed_m_s\n" + rows(T + ",{v}"), says={"zone": None}),
    "compact-iso": Table(text="time,ws_mps\n" + rows("{t:%Y%m%dT%H%M%S}Z,{v}"), says={"zone": None}),
    "underscore-stamp": Table(text="stamp,ws_mps\n" + rows("{t:%Y-%m-%d_%H:%M:%S},{v}")),
    "quoted": Table(text='"Timestamp","Wind Speed (m/s)","Note"\n' + rows('"{t:%Y-%m-%d %H:%M:%S}","{v}","a, b"')),
    "newest-first": Table(
        text="time,ws (m/s)\n" + "\n".join(reversed(rows(T + ",{v}").splitlines())) + "\n",
    ),
}


def said(table: Table) -> dict[str, Any]:
    return {"zone": "UTC", **table.says}


def check(table: Table, log: Any) -> None:
    channels = log.series.channels
    assert channels["wind_speed"] == pytest.approx(table.speed, rel=table.within, nan_ok=True)
    assert iso(int(log.series.time[0])) == table.first
    for name, value in table.has.items():
        assert channels[name][0] == pytest.approx(value, rel=1e-6), name
    assert not set(table.lacks) & set(channels)


@pytest.mark.parametrize("name", [name for name, table in TABLES.items() if not table.asks])
def test_a_table_that_leaves_nothing_in_doubt_is_read_without_a_recipe(log_file: Write, name: str) -> None:
    table = TABLES[name]
    path = log_file(table.text)
    assert sniff(path)[0].doubts == ()
    log = read_log(path, WindOptions(**said(table)))
    check(table, log)
    assert [f.what for f in log.findings if f.severity is Severity.ERROR] == []


@pytest.mark.parametrize("name", [name for name, table in TABLES.items() if table.asks])
def test_a_table_in_doubt_is_refused_with_the_one_thing_to_say(log_file: Write, name: str) -> None:
    table = TABLES[name]
    path = log_file(table.text)
    with pytest.raises(FlagdataError) as caught:
        read_log(path, WindOptions(zone="UTC"))
    assert table.asks in caught.value.fix
    check(table, read_log(path, WindOptions(**said(table))))


@pytest.mark.parametrize("name", TABLES)
def test_a_drafted_recipe_reads_the_file_it_was_made_from(tmp_path: Path, log_file: Write, name: str) -> None:
    table = TABLES[name]
    path = log_file(table.text)
    options = WindOptions(**said(table))
    guess = completed(path, options)
    assert guess is not None
    assert guess.draft is not None
    assert guess.doubts == ()
    recipe = tmp_path / "drafted.toml"
    recipe.write_text(guess.draft, encoding="utf-8")
    check(table, read_log(path, replace(options, unit=None, wind=None, date_order=None, recipe=str(recipe))))


def test_a_log_compressed_by_gzip_is_read_as_what_is_in_it(log_file: Write) -> None:
    table = TABLES["plain"]
    check(table, read_log(log_file(gzip.compress(table.text.encode()), "a.csv.gz"), WindOptions(zone="UTC")))


def test_a_damaged_gzip_file_is_refused(log_file: Write) -> None:
    packed = gzip.compress((TABLES["plain"].text * 50).encode())
    with pytest.raises(FlagdataError, match="damaged"):
        read_log(log_file(packed[: len(packed) // 2], "a.csv.gz"), WindOptions(zone="UTC"))


HEIGHTS = "Time,Spd80mN (m/s),Spd80mNStd (m/s),Spd40mN (m/s),Dir78m,Dir38m\n" + rows(
    T + ",{v},0.4,{x:.3f},{d},10"
).replace(",-", ",")


def test_each_height_of_a_table_is_an_anemometer_with_its_own_direction(log_file: Write) -> None:
    path = log_file(HEIGHTS)
    options = WindOptions(zone="UTC")
    assert anemometers(path, options) == ("Spd80mN (m/s)", "Spd40mN (m/s)")
    upper, lower = (read_log(path, replace(options, wind=label)) for label in anemometers(path, options))
    assert upper.series.channels["wind_speed"] == pytest.approx(SPEED)
    assert lower.series.channels["wind_speed"] == pytest.approx([0.6 * v for v in SPEED], abs=6e-4)
    assert (upper.series.sensor.height, lower.series.sensor.height) == (80.0, 40.0)
    assert upper.series.channels["wind_direction"][0] == pytest.approx(200 * DEG)
    assert lower.series.channels["wind_direction"][0] == pytest.approx(10 * DEG)


def test_of_several_anemometers_one_must_be_named(log_file: Write) -> None:
    with pytest.raises(FlagdataError, match="2 anemometers") as caught:
        read_log(log_file(HEIGHTS), WindOptions(zone="UTC"))
    assert "--wind" in caught.value.fix
    with pytest.raises(FlagdataError, match="no anemometer 'Spd20m'"):
        read_log(log_file(HEIGHTS), WindOptions(zone="UTC", wind="Spd20m"))


def test_each_site_of_a_table_is_read_by_itself(log_file: Write) -> None:
    both = zip(
        rows("A,{t:%Y-%m-%d %H:%M:%S},{v}").splitlines(), rows("B,{t:%Y-%m-%d %H:%M:%S},1.5").splitlines(), strict=True
    )
    path = log_file("station,time,wind_speed_ms\n" + "\n".join(line for pair in both for line in pair) + "\n")
    options = WindOptions(zone="UTC")
    assert anemometers(path, options) == ("A", "B")
    for site, speed in (("A", SPEED), ("B", [1.5] * len(SPEED))):
        assert read_log(path, replace(options, wind=site)).series.channels["wind_speed"] == pytest.approx(speed)


def test_a_counter_of_32_bits_that_runs_over_goes_on(log_file: Write) -> None:
    lines = "".join(f"{(2**32 - 3000 + i * 1000) % 2**32},{v}\n" for i, v in enumerate(SPEED))
    log = read_log(log_file("millis,ws (m/s)\n" + lines), WindOptions(start=instant("2026-05-13T12:00:00Z")))
    assert log.series.time.tolist() == [instant("2026-05-13T12:00:00Z") + i * 1_000_000_000 for i in range(len(SPEED))]
    assert "counter-overflow" in {f.kind for f in log.findings}


def test_a_time_of_day_goes_on_past_midnight(log_file: Write) -> None:
    text = "Time;Wind m/s\n" + rows("{t:%H:%M:%S};{v}", start=dt.datetime(2026, 5, 13, 23, 59, 55, tzinfo=dt.UTC))
    log = read_log(log_file(text), WindOptions(zone="UTC", date=dt.date(2026, 5, 13)))
    assert iso(int(log.series.time[-1])) == "2026-05-14T00:00:06Z"


def test_a_start_for_stamps_with_a_date_is_refused(log_file: Write) -> None:
    with pytest.raises(FlagdataError, match="--start is not used"):
        read_log(log_file(TABLES["plain"].text), WindOptions(zone="UTC", start=instant("2026-05-13T12:00:00Z")))


def test_a_unit_of_the_user_goes_before_the_headings_with_a_warning(log_file: Write) -> None:
    log = read_log(log_file(TABLES["plain"].text), WindOptions(zone="UTC", unit="km/h"))
    assert log.series.channels["wind_speed"] == pytest.approx([v / 3.6 for v in SPEED])
    assert any(f.kind == "heading-doubtful" and "m/s" in f.what for f in log.findings)
