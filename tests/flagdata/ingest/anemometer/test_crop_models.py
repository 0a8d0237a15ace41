"""Weather of crop models (DSSAT): a line that begins with @ names the columns, and the wind is in km a day."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError, NothingMeasuredError
from flagdata.ingest.anemometer import WindOptions, read_log
from flagdata.signals import WindLog
from flagdata.units import canonical, unit

Write = Callable[[str], Path]
_ABOVE = (
    "$WEATHER DATA: Made Field\n!\n! written for a test\n!            deg     deg        m       C       C\n"
    "@  INSI      LAT     LONG    ELEV     TAV     AMP   REFHT   WNDHT\n"
    "   MADE   12.000  -34.000      56    20.0    10.0    1.50    2.00\n!\n"
)
_UNITS = "! yyyyddd MJ/m2/d     C       C      mm       C  km/day     kPa\n"
_NAMES = "@  DATE    SRAD    TMAX    TMIN    RAIN    DEWP    WIND     AVP\n"


def _rows(year: str, count: int = 24, wind: float = 86.4) -> str:
    row = "{year}{day:03d}  1{of}.25  2{of}.5  1{of}.0  0  -1.{of}5  {wind:.1f}  0.4{of}1\n"
    return "".join(row.format(year=year, day=at + 1, of=at % 7, wind=wind * (1 + at % 4)) for at in range(count))


def _warnings(log: WindLog) -> str:
    return "; ".join(f"{finding.kind}: {finding.what}" for finding in log.findings)


def test_a_line_with_an_at_sign_names_the_columns_and_the_comment_above_their_units(log_file: Write) -> None:
    log = read_log(log_file(_ABOVE + _UNITS + _NAMES + _rows("2026")), WindOptions(zone="UTC"))
    assert any("from column 'WIND', in km/day by its heading" in reason for reason in log.reasons)
    assert log.series.channels["wind_speed"][:4] == pytest.approx([1.0, 2.0, 3.0, 4.0])


@pytest.mark.parametrize("spelling", ["km/day", "km/d", "km d-1", "km day-1", "km/Day"])
def test_a_kilometre_a_day_is_known(spelling: str) -> None:
    assert canonical(spelling) == "km/day"
    assert unit(spelling).to_si(86.4) == pytest.approx(1.0)


def test_a_unit_other_than_that_above_the_names_is_warned_of(log_file: Write) -> None:
    path = log_file(_ABOVE + _UNITS + _NAMES + _rows("2026", wind=30.0))
    told = _warnings(read_log(path, WindOptions(zone="UTC", unit="m/s")))
    assert "the heading of 'WIND' states km/day; taken as m/s, as you said" in told
    assert "unit-doubtful: wind_speed is stated in m/s" in told
    assert "as you said" not in _warnings(read_log(path, WindOptions(zone="UTC", unit="km/d")))


def test_a_unit_other_than_that_of_a_line_above_is_warned_of(log_file: Write) -> None:
    rows = "".join(f"2026-05-01T12:00:{at:02d}Z,{3 + at % 3}.{at % 10}\n" for at in range(12))
    path = log_file(f"# wind in mph\ntime,wind_speed\n{rows}")
    assert "line 1 says 'mph'; taken as m/s, as you said" in _warnings(read_log(path, WindOptions(unit="m/s")))
    assert "as you said" not in _warnings(read_log(path, WindOptions(unit="mph")))


def test_days_of_years_of_two_digits_are_dates_and_their_wind_is_no_speed_in_metres(log_file: Write) -> None:
    short = _NAMES.replace("@  DATE", "@DATE").replace("     AVP", "")
    rows = "".join(line.rsplit("  ", 1)[0] + "\n" for line in _rows("26", wind=90.3).splitlines())
    path = log_file(_ABOVE + short + rows)
    with pytest.raises(InputError, match="the unit of column 'WIND' is not stated") as caught:
        read_log(path, WindOptions(zone="UTC"))
    assert "--unit km/day" in caught.value.fix
    log = read_log(path, WindOptions(zone="UTC", unit="km/day"))
    assert log.series.time.astype("datetime64[ns]")[-1] == np.datetime64("2026-01-24")


def test_a_wind_that_no_air_has_is_refused_with_the_unit_it_may_be_in(log_file: Write) -> None:
    path = log_file(_ABOVE + _UNITS + _NAMES + _rows("2026", wind=200.0))
    with pytest.raises(NothingMeasuredError, match="looks like km/day") as caught:
        read_log(path, WindOptions(zone="UTC", unit="m/s"))
    assert "--unit km/day" in caught.value.fix
