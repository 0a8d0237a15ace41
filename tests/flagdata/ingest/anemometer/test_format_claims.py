"""Recognition by content is strict: of all formats exactly one claims the sample of each."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest import FORMATS, WindOptions, read_log, sniff
from flagdata.ingest.anemometer.sniffing import SURE

Write = Callable[..., Path]

GENERIC = {"delimited", "host-stamped"}
"""Formats of recipes: a recipe may fit a file of a maker's format too, but the maker's format comes
first."""


def stamped(*lines: str) -> str:
    return "".join(f"2026-05-01T12:00:{i:02d}Z,{line}\n" for i, line in enumerate(lines))


SAMPLES = {
    "delimited": "time,wind_speed [m/s]\n2026-05-01T12:00:00Z,3\n2026-05-01T12:00:01Z,4\n",
    "host-stamped": "laptop_time,raw_line\n" + stamped("3.1", "3.2", "3.3"),
    "nmea": "$GPRMC,120000,A,5310.8,N,00525.7,E,0.0,0.0,010526,,,A\n$WIMWV,214.8,R,0.1,K,A*28\n",
    "nmea-stamped": stamped("$WIMWV,214.8,R,0.1,K,A*28", "$WIMWV,214.8,R,0.1,K,A*28"),
    "kestrel": "Device Name,K\nDevice Model,5500\nTime,Wind Speed,Temp,Dir\nx,m/s,C,d\n2026-05-01 "
    "12:00:00,3,20,90\n",
    "toa5": '"TOA5","s","CR1000"\n"TIMESTAMP","RECORD","WS"\n"TS","RN","m/s"\n"","","Avg"\n"2026-05-01 '
    '12:00:00",1,3\n',
    "canboat": "2026-05-01T12:00:00.000Z,2,130306,36,255,8,00,f4,01,5c,3d,fa,ff,ff\n" * 3,
    "gill": stamped("\x02Q,229,002.74,M,00,\x0316", "\x02Q,229,002.74,M,00,\x0316"),
    "metek": stamped("M:x = 300 y = 0 z = 0 t = 2186", "M:x = 310 y = 0 z = 0 t = 2186"),
    "trisonica": stamped("S 00.08 S2 00.07 D 245 U 00.06 V 00.03 W 00.05 T 21.40"),
    "vaisala": stamped("0R1,Dn=236D,Dm=283D,Dx=031D,Sn=0.0M,Sm=1.0M,Sx=2.2M"),
    "young": stamped(" 2.50 100.0 0.0 346.70 25.14", " 2.60 100.0 0.0 346.70 25.14"),
    "thies": stamped("\x02002.4 213 +21.5 M 00*66\x03", "\x02002.4 213 +21.5 M 00*66\x03"),
    "ft": stamped("$WI,WVP=007.4,212,0*72", "$WI,WVP=007.4,212,0*72"),
    "nrg": "NRG Export Service\nTime "
    "Zone:\tUTC-5:00\nTimestamp\tCh1_Anem_40.00m_N_Avg_m/s\n2026-05-01 12:00:00\t5\n",
    "windographer": "Created 1-5-2026 by Windographer 5\n\nDate/Time\tSpd80m [m/s]\n2026-05-01 "
    "12:00\t5\n",
    "zentra": "z6-1,Port1,\n# Records: 2,ATMOS 22,\nTimestamps,m/s Wind Speed,° Wind "
    "Direction\n5/13/2026 12:00,3,90\n",
    "davis": '"Date & Time","Avg Wind Speed - km/h"\n"5/13/26 12:05 AM","18.0"\n',
    "weatherlink": "\t\tWind\tWind\nDate\tTime\tSpeed\tDir\n"
    + "".join(f"25/05/26\t10:3{i}a\t{speed}\tN\n" for i, speed in enumerate((1, 2, 3, 5, 8, 9))),
    "ecowitt": "Time,Outdoor Temperature(℃),Wind(m/s),Gust(m/s),Wind Direction(deg)\n2026-05-01 "
    "12:00,20,3,4,90\n",
    "hobo": '"Plot Title: x"\n"#","Date Time, GMT+00:00","Wind Speed, m/s (LGR S/N: '
    '1)"\n1,07/15/26 12:00:00 PM,3\n',
    "eddypro": "filename,date,time,wind_speed,wind_dir\n,[yyyy-mm-dd],[HH:MM],[m+1s-1],[deg_from_north]\n"
    "a,2026-05-01,12:30,3,90\n",
    "fluxnet": "TIMESTAMP_START,TIMESTAMP_END,WS,WD\n202605011200,202605011230,3,90\n",
    "icos": "#Site;SamplingHeight;Year;Month;Day;Hour;Minute;WS;WD\nLIN;40.0;2026;05;01;12;00;4.2;210\n",
    "icos-ecosystem": "TIMESTAMP,WS_1_1_1\n20260501120000,4.2\n20260501120010,4.4\n",
    "surfrad": " X\n 40.05 -88.37 230 m version 1\n"
    " 2026 121 5 1 12 0 12.0 40.0" + " 1.0 0" * 20 + "\n",
}


def test_every_format_has_a_sample() -> None:
    assert set(SAMPLES) == set(FORMATS)


@pytest.mark.parametrize("name", SAMPLES)
def test_exactly_one_format_claims_the_sample_of_each(log_file: Write, name: str) -> None:
    guesses = sniff(log_file(SAMPLES[name]))
    assert guesses[0].format == name
    claims = [guess.format for guess in guesses if guess.score >= SURE]
    assert [other for other in claims if other not in GENERIC or other == name] == [name]


@pytest.mark.parametrize("name", sorted(set(SAMPLES) - GENERIC))
def test_a_file_of_another_format_is_refused_by_a_reader_with_what_to_do(
    log_file: Write, name: str
) -> None:
    other = "gill" if name != "gill" else "young"
    with pytest.raises(FlagdataError) as caught:
        read_log(log_file(SAMPLES[other]), WindOptions(format=name))
    assert caught.value.fix


@pytest.mark.parametrize("name", sorted(set(SAMPLES) - GENERIC))
@pytest.mark.parametrize("share", [0.2, 0.5, 0.8, 0.97])
def test_a_file_cut_anywhere_is_read_or_refused_with_what_to_do(
    log_file: Write, name: str, share: float
) -> None:
    text = SAMPLES[name]
    path = log_file(text[: max(1, int(len(text) * share))])
    fix, samples = None, 0
    try:
        samples = len(read_log(path, WindOptions(format=name)).series)
    except FlagdataError as error:
        fix = error.fix
    assert samples or fix
