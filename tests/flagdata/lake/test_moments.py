"""A version named by an instant is the newest of main that was there then."""

from __future__ import annotations

from datetime import UTC, datetime

import pytest

from flagdata.errors import NotFoundError, UsageError
from flagdata.lake import Lake
from flagdata.lake import refs as references
from flagdata.lake.refs import moment
from tests.flagdata.lake.conftest import put_text

NOON = datetime(2026, 11, 26, 12, tzinfo=UTC)


def test_a_day_ends_at_midnight_a_time_names_its_zone_and_ago_counts_from_now() -> None:
    assert moment("2026-11-26") == 1_795_737_600_000_000_000 - 1  # 2026-11-27T00:00:00Z
    assert moment("2026-11-26T12:00:00+02:00") == 1_795_687_200_000_000_000
    assert moment("3.days.ago", now=NOON) == 1_795_694_400_000_000_000 - 3 * 86_400 * 10**9
    assert moment("1.hour.ago", now=NOON) == 1_795_694_400_000_000_000 - 3_600 * 10**9
    assert moment("v1") is None
    for wrong in ("2026-11-31", "2026-11-26T12:00:00", "999999.weeks.ago"):
        with pytest.raises(UsageError):
            moment(wrong)


def test_the_newest_version_up_to_an_instant_is_shown(lake: Lake) -> None:
    put_text(lake, "one")
    assert lake.resolve("0.seconds.ago") == lake.catalog.head()
    hours = [
        {"version": n, "timestamp": (1_795_694_400 + 3600 * n) * 1000} for n in range(4)
    ]  # from noon on

    def at(text: str) -> int:
        return references.resolve(
            lake.refs, text, head=3, commits=dict, history=lambda: reversed(hours)
        )[0].version

    assert at("2026-11-26T13:59:59Z") == 1
    assert at("2026-11-26T14:00:00Z") == 2
    assert at("2026-11-26") == 3
    with pytest.raises(NotFoundError, match="2026-11-25 or before"):
        at("2026-11-25")
    lake.tag("2026-11-26")  # a tag of that name goes first
    assert at("2026-11-26") == lake.resolve("2026-11-26")
