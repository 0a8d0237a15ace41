"""Instants and wall clocks. Expected values from the calendar and the IANA rules, written out by
hand."""

from __future__ import annotations

import re
from datetime import datetime, timedelta, timezone

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flagdata import timebase
from flagdata.errors import FlagdataError, TimeError, UnknownNameError


def test_iso_text_is_the_instant_it_names() -> None:
    cases = [
        ("1970-01-01T00:00:00Z", 0), ("1970-01-02", 86_400 * 10**9), ("2000-01-01T00:00:00Z", 946_684_800 * 10**9),
        ("2000-01-01T01:00:00+01:00", 946_684_800 * 10**9),
        ("2000-01-01 00:00:00.000000001Z", 946_684_800 * 10**9 + 1),
        ("2000-01-01T00:00:00,5Z", 946_684_800 * 10**9 + 500_000_000), ("1969-12-31T23:59:59.25Z", -750_000_000),
    ]  # fmt: skip
    assert [timebase.parse(text, default=timebase.zone("UTC")) for text, _ in cases] == [
        expected for _, expected in cases
    ]


@given(st.integers(min_value=-(2**61), max_value=2**61))
def test_iso_round_trip_is_exact_to_the_nanosecond(instant: int) -> None:
    assert timebase.parse(timebase.iso(instant)) == instant


def test_a_time_without_zone_is_refused_unless_one_is_named() -> None:
    with pytest.raises(TimeError, match="no zone"):
        timebase.parse("2026-05-01T12:00:00")


@pytest.mark.parametrize(
    "text", ["", "noon", "2026-13-01T00:00:00Z", "2026-02-30T00:00:00Z", "2026-05-01T25:00:00Z"]
)
def test_what_is_not_a_time_is_an_error_with_a_fix(text: str) -> None:
    with pytest.raises(FlagdataError) as caught:
        timebase.parse(text)
    assert caught.value.fix


def test_the_hour_that_occurs_twice_needs_a_choice() -> None:
    """Amsterdam, 2025-10-26: at 03:00 summer time the clocks go back to 02:00."""
    wall, place = datetime(2025, 10, 26, 2, 30), timebase.zone("Europe/Amsterdam")  # noqa: DTZ001
    assert timebase.wall_status(wall, place) == "ambiguous"
    with pytest.raises(TimeError, match="occurs twice"):
        timebase.from_wall(wall, place)
    first = timebase.parse("2025-10-26T00:30:00Z")
    assert timebase.from_wall(wall, place, fold=0) == first
    assert timebase.from_wall(wall, place, fold=1) == first + 3600 * 10**9


def test_the_hour_that_never_occurs_is_refused() -> None:
    """Amsterdam, 2025-03-30: at 02:00 the clocks go forward to 03:00."""
    wall, place = datetime(2025, 3, 30, 2, 30), timebase.zone("Europe/Amsterdam")  # noqa: DTZ001
    assert timebase.wall_status(wall, place) == "nonexistent"
    with pytest.raises(TimeError, match="does not exist"):
        timebase.from_wall(wall, place)


def test_fixed_offsets_and_misspelt_zones() -> None:
    assert timebase.zone("+02:00") == timezone(timedelta(hours=2))
    assert timebase.zone("UTC-3") == timezone(timedelta(hours=-3))
    with pytest.raises(UnknownNameError, match="Europe/Amsterdam"):
        timebase.zone("Europe/Amsterdm")
    with pytest.raises(TimeError, match="14:00"):
        timebase.zone("+15:00")
    for typed in ("+01:75", "0260"):
        with pytest.raises(UnknownNameError):
            timebase.zone(typed)
    with pytest.raises(TimeError):
        timebase.parse("2026-05-01T12:00:00+02:75")


ABBREVIATIONS = {
    "CEST": ("+02:00", "Europe/Amsterdam"),
    "CET": ("+01:00", "Europe/Amsterdam"),
    "MESZ": ("+02:00", "Europe/Berlin"),
    "BST": ("+01:00", "Europe/London"),
    "WEST": ("+01:00", "Europe/Lisbon"),
    "EEST": ("+03:00", "Europe/Athens"),
    "EDT": ("-04:00", "America/New_York"),
    "EST": ("-05:00", "America/New_York"),
    "MST": ("-07:00", "America/Denver"),
    "PST": ("-08:00", "America/Los_Angeles"),
    "IST": ("+05:30", "Asia/Kolkata"),
    "JST": ("+09:00", "Asia/Tokyo"),
    "AEDT": ("+11:00", "Australia/Sydney"),
    "NZST": ("+12:00", "Pacific/Auckland"),
    "BRT": ("-03:00", "Sao_Paulo"),
    "SGT": ("+08:00", "Asia/Singapore"),
    "PT": ("-07:00", "America/Los_Angeles"),
    "cest": ("+02:00", "Amsterdam"),
}


@pytest.mark.parametrize("name", ABBREVIATIONS)
def test_an_abbreviation_is_refused_with_the_offsets_and_places_that_it_may_mean(name: str) -> None:
    with pytest.raises(UnknownNameError) as refused:
        timebase.zone(name)
    offset, place = ABBREVIATIONS[name]
    for said in (refused.value.what, str(refused.value.fix)):
        assert [one for one in (offset, place) if one not in said] == []


@pytest.mark.parametrize(
    ("name", "offsets"), [("IST", ("+05:30", "+01:00", "+02:00")), ("CST", ("-06:00", "+08:00"))]
)
def test_an_abbreviation_of_several_clocks_names_each(name: str, offsets: tuple[str, ...]) -> None:
    with pytest.raises(UnknownNameError) as refused:
        timebase.zone(name)
    assert all(one in refused.value.what for one in offsets)


def test_no_zone_is_advised_by_the_abbreviation_of_another() -> None:
    for name in ("XEST", "CESTX", "CESST", "Utrecht", "GMTX"):
        with pytest.raises(UnknownNameError) as refused:
            timebase.zone(name)
        advised = re.findall(r"'([^']+)'", str(refused.value.fix))
        assert all("/" in one for one in advised), refused.value.fix
