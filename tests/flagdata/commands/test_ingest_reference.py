"""`flagdata ingest` on every reference recording, against what their README and their sources say of them.

Frame counts and stamps were counted apart from this project, with PyAV's demuxer; sentences and rows with grep.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flagdata.cli import main
from flagdata.ingest.store import CROP_PICTURE
from flagdata.lake import Lake
from flagdata.record import Record

pytestmark = pytest.mark.reference

START = "2024-01-01T00:00:00Z"
# name of a tunnel clip → frames in it
TUNNEL = {
    "fullVeloc_10.05": 1001, "fullVeloc_10.95": 1001, "fullVeloc_12.30": 1002, "fullVeloc_7.64": 1001,
    "fullVeloc_8.09": 1006, "fullVeloc_9.30": 1001, "rectVeloc_10.80": 302, "rectVeloc_12.30": 1024,
    "triangVeloc_10.05": 1001, "triangVeloc_12.30": 1002, "triangVeloc_7.04": 1003, "triangVeloc_8.54": 1005,
}  # fmt: skip


@pytest.fixture
def ingest(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Callable[..., tuple[dict[str, Any], Record]]:
    """Ingests one source into an empty lake; its report and its record."""
    lake = Lake.create(tmp_path / "lake")

    def ingest(*arguments: object) -> tuple[dict[str, Any], Record]:
        with pytest.raises(SystemExit) as exit_:
            main(["ingest", *map(str, arguments), "--lake", str(lake.path), "--json"])
        out = capsys.readouterr().out
        assert exit_.value.code == 0, out
        result = json.loads(out)["results"][0]
        return result["report"], Record.open(lake.object_path(result["object"]))

    return ingest


def _finding(report: Mapping[str, Any], kind: str) -> dict[str, Any]:
    found = [finding for finding in report["findings"] if finding["kind"] == kind]
    assert len(found) == 1, f"{kind}: {[f['kind'] for f in report['findings']]}"
    return found[0]


def test_dyntex_flag_is_250_frames_at_25_hz_with_square_pixels(ingest, reference_data: Path) -> None:
    report, record = ingest(reference_data / "video" / "dyntex_flag_571c110.avi", "--start", START)
    assert (report["frames"], report["rate"], report["worst_stamp_error"]) == (250, 25.0, 0.0)
    camera = report["camera"]
    assert not camera["variable_rate"]
    assert (camera["width"], camera["height"]) == (384, 288)  # 352 × 288 with pixels 12:11, PAL
    assert record.frame_count == 250


@pytest.mark.parametrize("name", TUNNEL)
def test_tunnel_clips_run_at_1000_hz_whatever_the_container_says(ingest, reference_data: Path, name: str) -> None:
    source = reference_data / "video" / "dadamo-2024" / f"{name}_60fps_rv.mp4"
    # One in 40 frames is kept at 25 Hz, which is what most users will ask for; the native rate is tested once below.
    report, _ = ingest(source, "--start", START, "--true-fps", 1000)
    camera = report["camera"]
    assert (camera["container_rate"], camera["true_rate"], camera["variable_rate"]) == (60.0, 1000.0, False)
    assert (camera["width"], camera["height"]) == (1080, 1920)
    assert camera["duration"] == pytest.approx((TUNNEL[name] - 1) / 1000, abs=1e-9)
    # A frame of the 25 Hz grid falls on every 40th source frame, from the first on.
    assert report["frames"] == (TUNNEL[name] - 1) // 40 + 1
    assert report["worst_stamp_error"] == 0.0
    assert _finding(report, "true-rate")["value"] == pytest.approx(0.06)


def test_a_tunnel_clip_at_its_native_rate_has_a_frame_every_millisecond(ingest, reference_data: Path) -> None:
    source = reference_data / "video" / "dadamo-2024" / "rectVeloc_10.80_60fps_rv.mp4"
    report, record = ingest(source, "--start", START, "--true-fps", 1000, "--rate", "native")
    assert (report["frames"], report["rate"]) == (302, 1000.0)
    assert set(np.diff(record.frame_times).tolist()) == {1_000_000}


def test_phone_clip_has_a_variable_rate_of_23_to_43_ms(ingest, reference_data: Path) -> None:
    source = reference_data / "video" / "dadamo-2024" / "phone_vfr.mp4"
    report, record = ingest(source, "--start", START)
    assert report["camera"]["variable_rate"]
    assert report["span"] == pytest.approx(6.8)
    # 6.8 s at 25 Hz, both ends; no stamp is farther from a grid instant than half the longest step of 43.3 ms.
    assert report["frames"] == 171
    assert 0.005 < report["worst_stamp_error"] <= 0.0217
    assert "23.4 to 43.3 ms" in _finding(report, "variable-rate")["what"]
    assert set(np.diff(record.frame_times).tolist()) == {40_000_000}


def test_phone_clip_keeps_its_own_stamps_at_the_native_rate(ingest, reference_data: Path) -> None:
    source = reference_data / "video" / "dadamo-2024" / "phone_vfr.mp4"
    _, record = ingest(source, "--start", START, "--rate", "native", "--archive", "h264")
    steps = np.diff(record.frame_times) / 1e6
    assert len(steps) == 204
    assert (round(steps.min(), 1), round(steps.max(), 1)) == (23.4, 43.3)


def test_crop_auto_finds_the_flag_and_shows_it(ingest, reference_data: Path) -> None:
    report, record = ingest(reference_data / "video" / "dyntex_flag_571c110.avi", "--start", START, "--crop", "auto")
    x, y, width, height = report["camera"]["crop"]
    assert width < 384 or height < 288
    assert x + width <= 384
    assert y + height <= 288
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


def test_nmea_keeps_relative_and_true_apart(ingest, reference_data: Path) -> None:
    source = reference_data / "wind" / "nmea0183_plaka.log"
    report, record = ingest(source, "--date", "2014-08-01")
    sentences = re.findall(r"\$..MWV,[\d.]*,([RT]),[\d.]*,(.),([AV])", source.read_text(errors="replace"))
    assert len(sentences) == 7250
    usable = {kind: sum(s == (kind, "N", "A") for s in sentences) for kind in "RT"}
    assert report["channels"]["apparent_wind_speed"]["values"] == usable["R"]
    assert report["channels"]["theoretical_wind_speed"]["values"] == usable["T"]
    assert "wind_speed" not in report["channels"]
    assert record.wind_1hz() is None
    _finding(report, "apparent-wind-only")


def test_nmea_without_its_date_is_refused_with_the_option_to_give(reference_data: Path, tmp_path: Path, capsys) -> None:
    lake = Lake.create(tmp_path / "lake")
    with pytest.raises(SystemExit) as exit_:
        main(["ingest", str(reference_data / "wind" / "nmea0183_plaka.log"), "--lake", str(lake.path)])
    assert exit_.value.code == 1
    assert "--date" in capsys.readouterr().err
    assert lake.rows().num_rows == 0


def test_kestrel_units_and_date_order_are_read_through_the_mojibake(ingest, reference_data: Path) -> None:
    source = reference_data / "wind" / "kestrel5400.csv"
    report, record = ingest(source, "--zone", "Europe/Athens")
    assert report["format"] == "kestrel"
    assert report["samples"] == 2476  # 2481 lines, 5 of them header
    # "10/6/2020 0:00" is midnight of 10 June in Athens, summer time (+03:00).
    assert report["start"] == "2020-06-09T21:00:00Z"
    _finding(report, "date-order")
    series = record.wind()
    assert series is not None
    first = {name: float(values[0]) for name, values in series.channels.items()}
    assert first["wind_speed"] == 0.7
    assert first["wind_direction"] == pytest.approx(np.deg2rad(327))
    assert first["air_temperature"] == pytest.approx(9.9 + 273.15)
    assert first["relative_humidity"] == pytest.approx(0.699)


def test_tunnel_anemometer_reports_its_zero_offset_and_dead_zone(ingest, reference_data: Path) -> None:
    report, record = ingest(reference_data / "wind" / "flag-camera-tunnel" / "gt_log.csv", "--zone", "UTC")
    assert report["samples"] == 12_596
    assert report["samples"] / report["span"] == pytest.approx(203, abs=0.5)
    assert _finding(report, "zero-offset")["value"] == pytest.approx(-0.35, abs=0.01)
    _finding(report, "dead-zone-jump")
    assert record.attachment("gt_log.csv")[:11] == b"laptop_time"


def test_tracked_flag_reports_lines_dropout_and_the_nyquist_limit(ingest, reference_data: Path) -> None:
    report, record = ingest(reference_data / "wind" / "flag-camera-tunnel" / "pi_log.csv", "--zone", "UTC")
    assert _finding(report, "non-data-lines")["count"] == 355
    assert "0.433 s" in _finding(report, "gaps")["what"]
    assert "14" in _finding(report, "at-nyquist")["what"]
    assert "wind_speed" not in report["channels"]
    assert "wind_speed_estimate" in report["channels"]
    series = record.wind()
    assert series is not None
    assert series.host_time is not None
