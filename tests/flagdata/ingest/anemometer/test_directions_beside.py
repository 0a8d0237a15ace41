"""Directions that are called after the speed beside them are read with it, or named with the line that reads them."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.ingest.anemometer import WindOptions, read_log
from flagdata.signals import WindLog

Write = Callable[[str], Path]
_LISTED = (
    "# Table of the mast 1.0\n# [FIELDS]\n# fields = timestamp,TA1,TA2,RH1,VW1,VW1_max,DW1,V\n"
    "# units = time,Degrees C,Degrees C,%,m/s,m/s,Degrees,V\n# [DATA]\n"
)


def _rows(row: str, count: int = 24) -> str:
    return "".join(row.format(at=at, speed=3 + at % 4, turned=200 + 3 * at) + "\n" for at in range(count))


def _notes(log: WindLog) -> str:
    return "; ".join(finding.what for finding in log.findings if finding.kind == "columns-not-read")


@pytest.mark.parametrize(
    ("heading", "wind", "name"),
    [
        ("U;Ustd;Udir;Udir_std", "U", "Udir"), ("S3;S3_std;S3_dir;S3_dir_std", "S3", "S3_dir"),
        ("VW;VW_std;DW;DW_std", "VW", "DW"), ("WSF2;x;WDF2;y", "WSF2", "WDF2"),
    ],
)  # fmt: skip
def test_a_direction_called_after_a_named_speed_is_read_with_it(
    log_file: Write, heading: str, wind: str, name: str
) -> None:
    rows = _rows("2026-05-01 {at:02d}:00;{speed}.25;0.5;{turned}.5;12.5")
    log = read_log(log_file(f"Date;{heading}\n{rows}"), WindOptions(wind=wind, unit="m/s", zone="UTC"))
    assert any(f"wind_direction from column '{name}'," in reason for reason in log.reasons)
    assert np.rad2deg(log.series.channels["wind_direction"][1]) == pytest.approx(203.5)


def test_a_direction_of_another_name_is_told_with_its_line(log_file: Write) -> None:
    rows = _rows("2026-05-01 {at:02d}:00;{speed}.25;{turned}.5;0.5")
    path = log_file(f"Date;Q7;Topdir;x\n{rows}")
    log = read_log(path, WindOptions(wind="Q7", unit="m/s", zone="UTC"))
    assert "wind_direction" not in log.series.channels
    assert "'Topdir' may be the wind's direction" in _notes(log)
    line = re.search(r'--columns "([^"]+)"', _notes(log))
    assert line is not None
    assert "wind_direction" in read_log(path, WindOptions(columns=line[1], zone="UTC")).series.channels


def test_fields_listed_in_a_comment_keep_their_names_and_every_step_reads_the_same(log_file: Write) -> None:
    path = log_file(
        _LISTED + _rows("2026-05-01 {at:02d}:00:00+00:00,-3.5,-3.25,81.5,{speed}.25,{speed}.75,{turned}.5,")
    )
    with pytest.raises(InputError, match="'VW1' may be a wind") as caught:
        read_log(path, WindOptions())
    line = re.search(r'--columns "([^"]+)"', caught.value.fix)
    assert line is not None
    by_line = read_log(path, WindOptions(columns=line[1]))
    named = read_log(path, WindOptions(wind="VW1"))
    assert set(by_line.series.channels) == set(named.series.channels) >= {"wind_speed", "wind_direction"}
    assert any("column 'timestamp' is the time" in reason for reason in named.reasons)
    assert '6=wind_speed[m/s],7=wind_direction[deg]"' in _notes(named)


def test_an_extreme_read_for_itself_is_told_the_direction_of_its_mean(log_file: Write) -> None:
    path = log_file(
        _LISTED + _rows("2026-05-01 {at:02d}:00:00+00:00,-3.5,-3.25,81.5,{speed}.25,{speed}.75,{turned}.5,")
    )
    assert "the direction 'DW1' is that of 'VW1'" in _notes(read_log(path, WindOptions(wind="VW1_max")))


@pytest.mark.parametrize(
    ("speed", "direction", "its"),
    [
        ("MSNB_N Wind speed (m/s)", "MSNB_S Wind from direction (deg)", False),
        ("MSNB_N Wind speed (m/s)", "MSNB_N Wind from direction (deg)", True),
        ("mast 1 wind speed (m/s)", "mast 2 wind direction (deg)", False),
        ("met_wind speed (m/s)", "met_wind direction (deg)", True),
    ],
)
def test_a_direction_of_another_place_is_not_that_of_a_speed(
    log_file: Write, speed: str, direction: str, its: bool
) -> None:
    path = log_file(f"time,{speed},{direction}\n" + _rows("2026-05-01T{at:02d}:00:00Z,{speed}.5,{turned}"))
    log = read_log(path, WindOptions(wind=None))
    assert ("wind_direction" in log.series.channels) is its
    assert its or direction in _notes(log)
