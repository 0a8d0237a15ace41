"""Tables of monthly means: their time is the month, never the day of an extreme."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.ingest.anemometer import WindOptions, read_log, sniff
from flagdata.ingest.anemometer.words.extremes import of_extreme

Write = Callable[..., Path]
_FIRSTS = np.array(["2012-01-01", "2012-02-01", "2012-03-01", "2012-04-01"], dtype="datetime64[ns]")
_SPEEDS = (2.6, 2.7, 3.0, 3.1)
_OF_GUST = ("2012-01-03", "2012-02-17", "2012-03-30", "2012-04-03")


def _table(months: tuple[str, ...], *, heading: str = "Month", of_gust: str = "Date of max gust") -> str:
    rows = [f"{heading},Mean wind (m/s),Max gust (m/s),{of_gust}"]
    rows += [f"{m},{v},{v + 16:g},{day}" for m, v, day in zip(months, _SPEEDS, _OF_GUST, strict=True)]
    return "\n".join([*rows, ""])


def _instants(path: Path) -> np.ndarray:
    series = read_log(path, WindOptions(zone="UTC")).series
    np.testing.assert_allclose(series.channels["wind_speed"], _SPEEDS)
    return np.asarray(series.time).astype("datetime64[ns]")


@pytest.mark.parametrize(
    "months",
    [
        ("2012-01", "2012-02", "2012-03", "2012-04"), ("01/2012", "02/2012", "03/2012", "04/2012"),
        ("Jan-12", "Feb-12", "Mar-12", "Apr-12"), ("Jan 2012", "Feb 2012", "Mar 2012", "Apr 2012"),
    ],
)  # fmt: skip
@pytest.mark.parametrize(("heading", "of_gust"), [("Month", "Date of max gust"), ("일시", "최대풍속 나타난날")])
def test_a_row_is_of_its_month_and_not_of_the_day_of_an_extreme(
    log_file: Write, months: tuple[str, ...], heading: str, of_gust: str
) -> None:
    path = log_file(_table(months, heading=heading, of_gust=of_gust))
    np.testing.assert_array_equal(_instants(path), _FIRSTS)
    assert any("each row is of a month" in note for note in sniff(path)[0].notes)


def test_what_may_be_days_without_a_year_is_no_month(log_file: Write) -> None:
    """Jan-12, Jan-17, Jan-30 are days of a month rather than its months in three years."""
    path = log_file(_table(("Jan-12", "Jan-17", "Jan-23", "Jan-30")))
    assert "no column is a time" in " ".join(sniff(path)[0].doubts)


@pytest.mark.parametrize(
    ("heading", "told"),
    [
        ("Date of max gust", True), ("Zeit der höchsten Böe", True), ("horaracha", True), ("最大風速 起時", True),
        ("최대순간풍속 나타난날", True), ("fecha racha", True), ("Date/Time", False), ("일시", False),
        ("Max wind speed", False), ("time (min)", False), ("TIMESTAMP", False),
    ],
)  # fmt: skip
def test_headings_of_the_time_of_an_extreme_are_told(heading: str, told: bool) -> None:
    assert of_extreme(heading) is told
