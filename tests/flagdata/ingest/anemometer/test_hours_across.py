"""A row a day with a column an hour: read as a row an hour, by the file's own word on what is valid."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from flagdata.errors import FlagdataError
from flagdata.ingest.anemometer import WindOptions, read_log
from flagdata.signals import WindLog
from flagdata.timebase import NANOSECONDS

Read = Callable[..., WindLog]
DAYS = 4
MIDNIGHT = 1_777_593_600  # s, 2026-05-01T00:00:00Z


def value(hour: int) -> float:
    return round(2 + hour % 11 / 10, 1)


def table(names: Sequence[str], delimiter: str = ",") -> str:
    rows = [
        delimiter.join([f"2026-05-{day + 1:02d}", *(f"{value(24 * day + hour):.1f}" for hour in range(24))])
        for day in range(DAYS)
    ]
    return "\n".join([delimiter.join(["date", *names]), *rows, ""])


BEGIN_AT_MIDNIGHT = {
    "numbers": [str(hour) for hour in range(24)],
    "clocks": [f"{hour:02d}:00" for hour in range(24)],
    "hours": [f"{hour}h" for hour in range(24)],
}
END_AT_MIDNIGHT = {
    "letters": [f"H{hour:02d}" for hour in range(1, 25)],
    "words": [f"hora {hour}" for hour in range(1, 25)],
}


@pytest.mark.parametrize("names", [*BEGIN_AT_MIDNIGHT, *END_AT_MIDNIGHT])
@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_each_hour_becomes_a_row(read: Read, names: str, delimiter: str) -> None:
    late = names in END_AT_MIDNIGHT
    heading = END_AT_MIDNIGHT[names] if late else BEGIN_AT_MIDNIGHT[names]
    log = read(table(heading, delimiter), wind="value", unit="m/s", zone="UTC")
    hours = np.arange(24 * DAYS) + late
    np.testing.assert_array_equal(log.series.time, (MIDNIGHT + 3600 * hours) * NANOSECONDS)
    np.testing.assert_allclose(log.series.channels["wind_speed"], [value(hour) for hour in range(24 * DAYS)])
    said = {finding.kind for finding in log.findings}
    assert "hours-across" in said
    assert ("heading-doubtful" in said) == late


def test_nothing_is_read_before_the_user_names_what_it_is(log_file: Callable[[str], Path]) -> None:
    with pytest.raises(FlagdataError) as refused:
        read_log(log_file(table(END_AT_MIDNIGHT["letters"])), WindOptions(zone="UTC"))
    assert "--wind" in f"{refused.value.fix}"


def test_an_hour_that_the_file_says_is_not_valid_is_missing(read: Read) -> None:
    names = [name for hour in range(1, 25) for name in (f"H{hour:02d}", f"V{hour:02d}")]
    rows = []
    for day in range(DAYS):
        cells = [text for hour in range(24) for text in (f"{value(24 * day + hour):.1f}", "N" if hour == 5 else "V")]
        rows.append(";".join(["2026", "05", f"{day + 1:02d}", *cells]))
    log = read("\n".join([";".join(["ANO", "MES", "DIA", *names]), *rows, ""]), wind="value", unit="m/s", zone="UTC")
    speed = log.series.channels["wind_speed"]
    assert np.flatnonzero(np.isnan(speed)).tolist() == [24 * day + 5 for day in range(DAYS)]
    assert [finding.count for finding in log.findings if finding.kind == "invalid-by-file"] == [DAYS]


def test_two_quantities_in_one_table_are_not_mixed(read: Read) -> None:
    names = [f"H{hour:02d}" for hour in range(1, 25)]
    rows = [
        ";".join(
            ["28079102", code, f"2026-05-{day + 1:02d}", *(f"{value(24 * day + h) * scale:.1f}" for h in range(24))]
        )
        for day in range(DAYS)
        for code, scale in (("81", 1), ("82", 40))
    ]
    text = "\n".join([";".join(["station", "quantity", "date", *names]), *rows, ""])
    with pytest.raises(FlagdataError) as refused:
        read(text, wind="value", unit="m/s", zone="UTC")
    assert "quantity" in refused.value.what
    line = '"?,site,date,hour,wind_speed[m/s]"'.replace("?", "")
    log = read(text, columns=line.strip('"'), zone="UTC", wind="81")
    np.testing.assert_allclose(log.series.channels["wind_speed"], [value(hour) for hour in range(24 * DAYS)])
