"""Daily summaries of NOAA: AWND is the mean wind, whose unit is asked for; the fastest are told with their lines."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.ingest.anemometer import WindOptions, read_log

Write = Callable[[str], Path]


def _summary() -> str:
    rows = "".join(
        f'"USW00000001","MADE UP FIELD, XX US","2026-05-{at:02d}","{8 + at % 5}.25",,"0.00",'
        f'"  {10 * at}","  {10 * at + 100}","{16 + at % 5}.1","{20 + at % 5}.4"\n'
        for at in range(1, 24)
    )
    return f'"STATION","NAME","DATE","AWND","PGTM","PRCP","WDF2","WDF5","WSF2","WSF5"\n{rows}'


def test_the_unit_of_the_mean_wind_is_asked_for(log_file: Write) -> None:
    with pytest.raises(InputError, match="the unit of 'AWND' is not stated") as caught:
        read_log(log_file(_summary()), WindOptions(zone="UTC"))
    assert "--unit mph or --unit m/s" in caught.value.fix


def test_the_fastest_winds_are_told_with_the_lines_that_read_them(log_file: Write) -> None:
    path = log_file(_summary())
    log = read_log(path, WindOptions(zone="UTC", unit="mph"))
    assert log.series.channels["wind_speed"][0] == pytest.approx(9.25 * 0.44704)
    assert "wind_direction" not in log.series.channels
    note = next(finding.what for finding in log.findings if finding.kind == "columns-not-read")
    assert all(repr(name) in note for name in ("WSF2", "WDF2", "WSF5", "WDF5"))
    lines = re.findall(r'--columns "([^"]+)"', note)
    assert [line.split(",")[-1] for line in lines] == ["9=wind_speed[mph]", "10=wind_speed[mph]"]
    fastest = read_log(path, WindOptions(zone="UTC", columns=lines[1])).series.channels
    assert np.rad2deg(fastest["wind_direction"][0]) == pytest.approx(110)
