"""Mixed arrays of older Campbell loggers: rows of several lengths, told by their first cell."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.ingest.anemometer import WindOptions, read_log
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
HOURS = 30
COLUMNS = "1=site,2=year,3=day_of_year,4=time[%H%M],6=wind_speed[m/s],7=wind_direction[deg]"


def arrays(midnight: int = 0) -> str:
    """An array 30 every half an hour from noon of day 61, and an array 60 every hour; midnight is 0, or 2400 of the day
    before."""
    lines: list[str] = []
    for half in range(2 * HOURS):
        day, minute = divmod(12 * 60 + 30 * half, 24 * 60)
        day, stamp = (day - 1, 2400) if midnight and not minute else (day, 100 * (minute // 60) + minute % 60)
        lines.append(f"30,1999,{61 + day},{stamp},{5 + half / 100:.2f},-6999")
        if half % 2 == 0:
            lines.append(f"60,1999,{61 + day},{stamp},12.6,{3 + half % 7 / 10:.1f},{200 + half},.04")
    return "\n".join([*lines, ""])


@pytest.mark.parametrize("midnight", [0, 2400])
def test_the_array_that_holds_the_named_columns_is_read(read: Read, midnight: int) -> None:
    log = read(arrays(midnight), columns=COLUMNS, zone="UTC", wind="array 60")
    np.testing.assert_allclose(log.series.channels["wind_speed"], [3 + 2 * hour % 7 / 10 for hour in range(HOURS)])
    np.testing.assert_allclose(np.rad2deg(log.series.channels["wind_direction"]), 200 + 2 * np.arange(HOURS))
    start = np.datetime64("1999-03-02T12:00")
    assert np.array_equal(log.series.time.astype("datetime64[ns]"), start + np.arange(HOURS).astype("timedelta64[h]"))
    assert "campbell-arrays" in {finding.kind for finding in log.findings}


def test_the_refusal_offers_the_arrays_as_sites(log_file: Callable[[str], Path]) -> None:
    with pytest.raises(InputError) as caught:
        read_log(log_file(arrays()), WindOptions(zone="UTC"))
    assert '--columns "site,year,day_of_year,time[%H%M],?,' in caught.value.fix


def test_a_row_of_another_kind_is_counted_and_left_out(read: Read) -> None:
    text = arrays().replace("60,1999,61,1400,12.6,", "60,1999,61,1400,1x.6,")
    log = read(text, columns=COLUMNS, zone="UTC", wind="array 60")
    assert len(log.series) == HOURS - 1
    (left_out,) = [finding for finding in log.findings if finding.kind == "malformed-lines"]
    assert left_out.count == 1
