"""When a recording began."""

from __future__ import annotations

import pytest

from flagdata.api.recording_verbs import FromCamera
from flagdata.commands.ingest_options import camera_options
from flagdata.core.findings import quality_flags
from flagdata.errors import TimeError
from flagdata.ingest.camera.recording_start import Start, find_start
from flagdata.ingest.camera.video_file import recording_time
from flagdata.timebase import iso, parse

TEN = parse("2026-05-01T10:00:00Z")


def find(
    metadata: dict[str, str],
    *,
    option: int | None = None,
    recorded: str | None = None,
    place: str | None = None,
) -> Start:
    return find_start(
        option, metadata, recorded=recorded, zone_name=place, duration=60.0, where="a.mp4"
    )


def test_the_option_wins_over_everything() -> None:
    start = find({"creation_time": "2020-01-01T00:00:00Z"}, option=TEN)
    assert (start.instant, start.source, start.sigma, start.findings) == (TEN, "option", None, ())


def test_apples_creation_date_names_its_zone_and_wins_over_creation_time() -> None:
    metadata = {
        "com.apple.quicktime.creationdate": "2026-05-01T12:00:00+0200",
        "creation_time": "2026-05-01T10:00:09.000000Z",
    }
    start = find(metadata)
    assert start.instant == TEN
    # A time cut to whole seconds is uniform over one: σ = 1/√12 s.
    assert start.sigma == pytest.approx(0.2887, abs=1e-4)
    assert start.findings == ()


def test_creation_time_is_utc_and_its_uncertainty_spans_the_recording() -> None:
    start = find({"creation_time": "2026-05-01T10:00:00.000000Z"})
    assert start.instant == TEN
    # Uniform between "is the start" and "is the end" of 60 s: 60/√12 = 17.3 s.
    assert start.sigma == pytest.approx(17.32, abs=0.01)
    assert start.findings[0].kind == "start-unsure"


def test_a_zone_is_for_times_that_name_none_and_moves_no_other() -> None:
    assert find({"creation_time": "2026-05-01T12:00:00"}, place="Europe/Amsterdam").instant == TEN
    assert (
        find({"creation_time": "2026-05-01T10:00:00.000000Z"}, place="Europe/Amsterdam").instant
        == TEN
    )
    with pytest.raises(TimeError, match="no zone"):
        find({"creation_time": "2026-05-01T12:00:00"})


def test_the_streams_own_wall_clock_is_read_in_the_given_zone() -> None:
    start = find({}, recorded="2026-05-01T12:00:00", place="Europe/Amsterdam")
    assert (start.instant, start.source) == (TEN, "metadata: recording time in the video")


def test_an_unusable_time_is_passed_over_and_mentioned() -> None:
    start = find(
        {"com.apple.quicktime.creationdate": "soon", "creation_time": "2026-05-01T10:00:00Z"}
    )
    assert start.instant == TEN
    assert [f.kind for f in start.findings] == ["start-passed-over", "start-unsure"]


@pytest.mark.parametrize(
    "metadata",
    [
        {},
        {"creation_time": "1904-01-01T00:00:00.000000Z"},
        {"creation_time": "1970-01-01T00:00:00.000000Z"},
        {"creation_time": "1970-01-09T11:00:00.000000Z"},
        {"creation_time": "yesterday"},
        {"creation_time": ""},
        {"com.apple.quicktime.creationdate": "2026-05-01T12:00:00"},
        {"date": "2026-05-01"},
    ],
)
def test_without_a_usable_time_the_way_out_is_named(metadata: dict[str, str]) -> None:
    with pytest.raises(TimeError) as raised:
        find(metadata)
    assert "--start" in raised.value.fix


def test_a_wall_clock_in_the_repeated_hour_is_refused() -> None:
    with pytest.raises(TimeError, match="occurs twice"):
        find({}, recorded="2026-10-25T02:30:00", place="Europe/Amsterdam")


def test_the_avchd_message_is_read_as_binary_coded_decimals() -> None:
    head = bytes.fromhex("17ee8c60f84d11d98cd60800200c9a66") + b"MDPM"
    entries = bytes(
        [3, 0x70, 1, 2, 3, 4, 0x18, 0x85, 0x20, 0x23, 0x12, 0x19, 0x31, 0x23, 0x59, 0x58]
    )
    assert recording_time(head + entries) == "2023-12-31T23:59:58"
    assert recording_time(head + entries[:-1]) is None
    assert (
        recording_time(head + bytes([2, 0x18, 0, 0x20, 0x23, 0x1F, 0x19, 0x31, 0x23, 0x59, 0x58]))
        is None
    )
    assert recording_time(b"\x00" * 40) is None


def test_an_unknown_start_is_flagged_and_goes_before_the_files_own() -> None:
    options = camera_options(FromCamera(sources=(), start="unknown"))
    found = find_start(
        options.camera.start,
        {"creation_time": "2024-05-01T12:00:00Z"},
        recorded=None,
        zone_name=None,
        duration=10.0,
        where="film.mp4",
    )
    assert (iso(found.instant), found.source, found.sigma) == (
        "2000-01-01T00:00:00Z",
        "unknown",
        None,
    )
    assert quality_flags(found.findings) == ["start-unknown"]
