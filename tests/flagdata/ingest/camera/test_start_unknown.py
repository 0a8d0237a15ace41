"""A film of which nobody knows when it began is stamped from a known instant on, and says so."""

from __future__ import annotations

from flagdata.commands.ingest_options import camera_options
from flagdata.findings import quality_flags
from flagdata.ingest.camera.start import find_start
from flagdata.timebase import iso


def test_an_unknown_start_is_flagged_and_goes_before_the_files_own() -> None:
    options = camera_options(
        start="unknown", zone_name=None, true_fps=None, sequence_fps=None, rate="25", crop="whole", exposure=None,
        archive="jpeg",
    )  # fmt: skip
    found = find_start(
        options.camera.start, {"creation_time": "2024-05-01T12:00:00Z"}, recorded=None, place=None, duration=10.0,
        where="film.mp4",
    )  # fmt: skip
    assert (iso(found.instant), found.source, found.sigma) == ("2000-01-01T00:00:00Z", "unknown", None)
    assert quality_flags(found.findings) == ["start-unknown"]
