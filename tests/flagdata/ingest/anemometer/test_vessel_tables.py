"""Tables of boats: apparent and true wind in two words, angles to the bow, and columns by their user's word."""

from __future__ import annotations

import re
from collections.abc import Callable

import numpy as np
import pytest

from flagdata.errors import InputError
from flagdata.ingest.anemometer.words.headings import understand
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
HEADING = "Date\tTime\tAW_angle\tAW_speed\tHeading\tTW_angle\tTW_speed\tTW_Dir\tExt_SOG\tExt_COG\n"
ROWS = "".join(
    f"23/06/19\t09:15:{at:02d}\t{(340 + 3 * at) % 360}\t{8 + at / 10:.2f}\t{120 + at}\t{-20 + 4 * at}"
    f"\t{5 + at / 10:.2f}\t{101 + at}\t4.20\t{125 + at}\n"
    for at in range(12)
)


def told(log: WindLog, kind: str) -> str:
    return "; ".join(finding.what for finding in log.findings if finding.kind == kind)


@pytest.mark.parametrize(
    ("heading", "channel"),
    [
        ("AW_angle", "apparent_wind_direction"), ("AW speed", "apparent_wind_speed"),
        ("AWSpeed", "apparent_wind_speed"), ("AWspeed [kn]", "apparent_wind_speed"),
        ("TW_angle", "theoretical_wind_direction"), ("TW_Speed", "theoretical_wind_speed"), ("TW_Dir", ""),
    ],
)  # fmt: skip
def test_the_wind_of_a_vessel_in_two_words_is_what_its_abbreviation_is(heading: str, channel: str) -> None:
    assert understand(heading).channel == channel


def test_apparent_and_true_wind_are_read_as_such(read: Read) -> None:
    found = read(HEADING + ROWS, unit="kn", zone="UTC")
    assert set(found.series.channels) == {
        "apparent_wind_speed", "apparent_wind_direction", "theoretical_wind_speed", "theoretical_wind_direction",
    }  # fmt: skip
    assert np.degrees(found.series.channels["apparent_wind_direction"][:2]) == pytest.approx([340, 343])
    assert "8=wind_direction[deg]" in told(found, "columns-not-read")


def test_the_refusal_names_no_angle_to_the_bow_a_direction_from_north(read: Read) -> None:
    with pytest.raises(InputError) as caught:
        read(HEADING + ROWS, zone="UTC")
    assert not re.search(r"(?<!_)wind_direction", caught.value.fix or "")


def test_an_angle_beside_the_heading_of_the_platform_is_offered_as_one_to_the_bow(read: Read) -> None:
    rows = "".join(f"2026-05-01T12:00:{at:02d}Z,{40 + at},{3 + at % 3}.5,{200 + at}\n" for at in range(12))
    with pytest.raises(InputError) as caught:
        read(f"Time,Angle,Value,Heading\n{rows}")
    assert "apparent_wind_direction[deg]" in (caught.value.fix or "")
    found = read(f"Time,wind_angle,wind_speed (m/s),hdg\n{rows}")
    assert "wind_direction" not in found.series.channels
    assert "from its platform's bow" in told(found, "columns-not-read")


def test_a_wind_by_its_users_word_keeps_the_warning_of_a_moving_platform(read: Read) -> None:
    found = read(HEADING + ROWS, zone="UTC", columns="1=date,2=time,3=wind_direction[deg],7=wind_speed[kn]")
    doubts = told(found, "heading-doubtful")
    assert "'Ext_SOG' shows that the platform moves" in doubts
    assert "'AW_angle' is an angle to the bow by its heading" in doubts
    named = read(HEADING + ROWS, zone="UTC", wind="TW_speed", unit="kn")
    assert "'Ext_SOG' shows that the platform moves" in told(named, "heading-doubtful")
    right = read(HEADING + ROWS, zone="UTC", columns="1=date,2=time,4=apparent_wind_speed[kn]")
    assert not told(right, "heading-doubtful")


SAIL = "time,sog,hdg,awa,aws,tack,speed,twa,tws\n" + "".join(
    f"2026-05-01T12:00:{at:02d}Z,5.{at % 9},120,{40 + at},{11 + at % 3}.5,{1 if at < 9 else -1}.0,6.{at % 9},{60 + at},"
    f"9.{at % 9}\n"
    for at in range(18)
)


def test_a_speed_of_nothing_that_is_named_beside_apparent_wind_is_the_boats(read: Read) -> None:
    log = read(SAIL, unit="kn")
    assert "wind_speed" not in log.series.channels
    assert {"apparent_wind_speed", "theoretical_wind_speed"} <= set(log.series.channels)
    assert "column 'speed' is likely the platform's own speed" in told(log, "columns-not-read")


def test_angles_of_half_a_turn_beside_the_side_they_are_on_are_no_directions(read: Read) -> None:
    log = read(SAIL, unit="kn")
    assert not any(name.endswith("direction") for name in log.series.channels)
    assert "'tack' tells the side of the bow on which 'awa' is" in told(log, "heading-doubtful")
    whole = read(SAIL.replace(",40,", ",-40,"), unit="kn")
    assert "apparent_wind_direction" in whole.series.channels
