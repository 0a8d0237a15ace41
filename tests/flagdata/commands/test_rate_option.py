"""`flagdata ingest --rate`: a number of Hz, or the time from one reading to the next."""

from __future__ import annotations

import pytest

from flagdata.commands.ingest_options import marker_options
from flagdata.errors import UsageError


@pytest.mark.parametrize(
    ("written", "rate"),
    [
        ("20", 20.0), ("20Hz", 20.0), ("12.5 hz", 12.5), ("40ms", 25.0), ("10min", 1 / 600), ("1 h", 1 / 3600),
        (".5s", 2.0),
    ],
)  # fmt: skip
def test_a_rate_is_hertz_or_the_time_between_two(written: str, rate: float) -> None:
    assert marker_options(rate=written, length="m").rate == rate


@pytest.mark.parametrize("written", ["often", "0s", "10 minutes", "Hz", ""])
def test_what_is_no_rate_says_how_to_write_one(written: str) -> None:
    with pytest.raises(UsageError) as caught:
        marker_options(rate=written, length="m")
    assert "40ms" in str(caught.value.fix)
