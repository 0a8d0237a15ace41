"""Headings over a ruler of dashes, on made files of the layouts of ships' programs and data bases."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import ZoneMissingError
from flagdata.ingest.anemometer import read_log, sniff
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
Write = Callable[[str], Path]
COUNT = 12
LEGEND = """% Cruise: Made up
% Start_Date_Time [UTC]: 25-Jun-2014 17:35:00
% End_Date_Time [UTC]: 03-Aug-2014 23:55:00
%
% Date: Acquisition date [yyyymmdd]
% Hour: Acquisition hour [HHMMSS]
% Wind dir: True wind direction [degrees N]
% Wind speed: True wind speed [Knt]
% Air temp: Air temperature [deg C]

"""
SHIP = """      Date     Hour   Wind dir Wind speed   Air temp
   -------  -------    -------    -------    -------
"""


def ship(first: str = "") -> str:
    rows = [f"2014/07/24 03:{at:02d}:00 {200 + at:>10} {3 + at:>10} {4.5:>10}\n" for at in range(COUNT)]
    return SHIP + first + "".join(rows)


def check(log: WindLog, *, scale: float = 1.0) -> None:
    assert log.series.channels["wind_speed"].tolist() == pytest.approx([scale * (3 + at) for at in range(COUNT)])
    assert np.degrees(log.series.channels["wind_direction"]).tolist() == pytest.approx(
        [200 + at for at in range(COUNT)]
    )


def test_explained_headings_over_a_ruler_ask_nothing(log_file: Write) -> None:
    text = LEGEND + ship(f"2014/07/24 02:59:00 {'NaN':>10} {'NaN':>10} {'NaN':>10}\n")
    path = log_file(text)
    (guess,) = [guess for guess in sniff(path) if guess.format == "delimited"]
    assert not guess.doubts
    log = read_log(path)
    assert log.series.time[1] == 1_406_170_800 * 10**9
    assert np.isnan(log.series.channels["wind_speed"][0])
    assert log.series.channels["wind_speed"][1:].tolist() == pytest.approx(
        [(3 + at) * 1852 / 3600 for at in range(COUNT)]
    )
    assert np.degrees(log.series.channels["wind_direction"][1:]).tolist() == pytest.approx(
        [200 + a for a in range(COUNT)]
    )
    assert {"ruled-headings", "explained-headings"} <= {finding.kind for finding in log.findings}


def test_names_that_stick_out_are_cut_by_the_ruler_alone(read: Read) -> None:
    check(read(ship(), unit="m/s", zone="UTC"))


def test_a_span_that_names_no_zone_leaves_it_open(log_file: Write) -> None:
    with pytest.raises(ZoneMissingError):
        read_log(log_file(LEGEND.replace(" [UTC]", "") + ship()))


def test_words_in_the_gaps_belong_to_the_run_that_names_end_with(read: Read) -> None:
    head = (
        "            Time Mean wind speed Mean wind direction\n            ----           -----                 ---\n"
    )
    rows = "".join(f"2014-07-24T03:{at:02d} {3 + at:>15.2f} {200 + at:>19}\n" for at in range(COUNT))
    check(read(head + rows, unit="m/s", zone="UTC"))


@pytest.mark.parametrize("sign", ["-", "="])
def test_a_stamp_of_two_words_and_empty_cells(read: Read, sign: str) -> None:
    rule = " ".join(sign * width for width in (19, 18, 8, 8)) + "\n"
    head = f"STAMP               WIND SPEED [m/s]   WIND DIR REMARK\n{rule}"
    rows = "".join(
        f"2014-07-24 03:{at:02d}:00 {3 + at:>18} {200 + at:>8} {'' if at % 2 else 'all well'}\n" for at in range(COUNT)
    )
    empty = f"2014-07-24 03:30:00 {'':>18} {250:>8}\n"
    log = read((rule if sign == "=" else "") + head + rows + empty + (rule if sign == "=" else ""), zone="UTC")
    assert len(log.series) == COUNT + 1
    assert np.isnan(log.series.channels["wind_speed"][-1])
    assert np.degrees(log.series.channels["wind_direction"][-1]) == pytest.approx(250)
    assert log.series.channels["wind_speed"][:COUNT].tolist() == pytest.approx([3 + at for at in range(COUNT)])


def test_units_between_the_names_and_the_ruler(read: Read) -> None:
    head = "#               Time Wind speed Wind dir\n#                         km/h      deg\n"
    head += "# ------------------ ---------- --------\n"
    rows = "".join(f"2014-07-24T03:{at:02d}:00Z {3 + at:>10} {200 + at:>8}\n" for at in range(COUNT))
    check(read(head + rows), scale=1 / 3.6)


def test_rows_that_stand_in_no_columns_are_cut_at_blanks(read: Read) -> None:
    head = (
        "Time                      Wind speed [m/s]  Wind dir\n------------------------- ----------------  --------\n"
    )
    rows = "".join(
        f"2014-07-24T03:{at:02d}:00Z  {'0' * (at % 5)}{3 + at}.{'0' * (at % 7)}  {200 + at}.0\n" for at in range(COUNT)
    )
    check(read(head + rows))


@pytest.mark.parametrize(
    ("head", "row"),
    [
        (" stamp | wind speed [m/s] | wind dir\n-------+------------------+---------\n", " {t} | {v} | {d}\n"),
        ("| stamp | wind speed [m/s] | wind dir |\n|---|:---:|---:|\n", "| {t} | {v} | {d} |\n"),
        ("Date       Time     Speed[m/s] Dir\n---------- -------- ---------- ---\n", "{t}   {v}   {d}\n"),
    ],
)  # fmt: skip
def test_cells_that_something_else_divides_stay(read: Read, head: str, row: str) -> None:
    rows = "".join(row.format(t=f"2014-07-24 03:{at:02d}:00", v=3 + at, d=200 + at) for at in range(COUNT))
    log = read(head + rows, zone="UTC")
    check(log)
    assert "ruled-headings" not in {finding.kind for finding in log.findings}
