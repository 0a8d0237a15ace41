"""`flagdata ingest` on reference recordings; what is in each is tested beside its reader.

Frame counts and stamps were counted apart from this project, with PyAV's demuxer; rows with grep.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flagdata.ingest.source_artifacts import CROP_PICTURE
from flagdata.lake import Lake
from flagdata.record import Record
from tests.program import invoke

pytestmark = pytest.mark.reference

START = "2024-01-01T00:00:00Z"


@pytest.fixture
def ingest(tmp_path: Path) -> Callable[..., tuple[dict[str, Any], Record]]:
    """Ingests one source into an empty lake; its report and its record."""
    lake = Lake.create(tmp_path / "lake")

    def ingest(*arguments: object) -> tuple[dict[str, Any], Record]:
        ended = invoke("ingest", *arguments, "--lake", lake.path, "--json")
        assert ended.code == 0, ended
        result = ended.document["results"][0]
        return result["report"], Record.open(lake.object_path(result["object"]))

    return ingest


def test_a_tunnel_clip_at_its_native_rate_has_a_frame_every_millisecond(
    ingest, reference_data: Path
) -> None:
    source = reference_data / "video" / "dadamo-2024" / "rectVeloc_10.80_60fps_rv.mp4"
    report, record = ingest(source, "--start", START, "--true-fps", 1000, "--rate", "native")
    assert (report["frames"], report["rate"]) == (302, 1000.0)
    assert report["worst_stamp_error"] == 0.0
    assert [f["value"] for f in report["findings"] if f["kind"] == "true-rate"] == [
        pytest.approx(0.06)
    ]
    assert set(np.diff(record.frame_times).tolist()) == {1_000_000}


def test_phone_clip_keeps_its_own_stamps_at_the_native_rate(ingest, reference_data: Path) -> None:
    source = reference_data / "video" / "dadamo-2024" / "phone_vfr.mp4"
    _, record = ingest(source, "--start", START, "--rate", "native", "--archive", "h264")
    steps = np.diff(record.frame_times) / 1e6
    assert len(steps) == 204
    assert (round(steps.min(), 1), round(steps.max(), 1)) == (23.4, 43.3)


def test_crop_auto_finds_the_flag_and_shows_it(ingest, reference_data: Path) -> None:
    report, record = ingest(
        reference_data / "video" / "dyntex_flag_571c110.avi", "--start", START, "--crop", "auto"
    )
    assert report["frames"] == record.frame_count == 250
    assert record.attachment(CROP_PICTURE).startswith(b"\x89PNG")


def test_toa5_has_18000_rows_at_20_hz_despite_dropped_zeros(ingest, reference_data: Path) -> None:
    report, record = ingest(reference_data / "wind" / "toa5_csat3_20hz.dat", "--zone", "-06:00")
    assert report["format"] == "toa5"
    assert (report["samples"], report["rate"]) == (18_000, 20.0)
    assert report["span"] == pytest.approx(17_999 / 20)
    assert (report["start"], report["end"]) == ("2012-06-07T18:45:00.050Z", "2012-06-07T19:00:00Z")
    series = record.wind()
    assert series is not None
    assert set(np.diff(series.time).tolist()) == {50_000_000}
    means = record.wind_1hz()
    assert means is not None
    assert set(means.count.tolist()) == {20}
    assert len(means.time) == 900
