"""Real logs: what was counted in the files by hand and with awk is what the reader reports."""

from __future__ import annotations

import csv
import datetime as dt
from pathlib import Path

import numpy as np
import pytest

from flagdata.core.findings import Finding
from flagdata.core.schema import UNUSABLE, SampleFlag
from flagdata.errors import InputError, TimeError
from flagdata.ingest import WindOptions, read_log, sniff
from flagdata.ingest.anemometer import average
from flagdata.record.signals import WindLog
from flagdata.timebase import iso

pytestmark = pytest.mark.reference
S = 1_000_000_000


def finding(log: WindLog, kind: str) -> Finding:
    return next(f for f in log.findings if f.kind == kind)


def kinds(log: WindLog) -> set[str]:
    return {f.kind for f in log.findings}


@pytest.fixture(scope="module")
def wind(reference_data: Path) -> Path:
    return reference_data / "wind"


@pytest.fixture(scope="module")
def toa5(wind: Path) -> WindLog:
    return read_log(wind / "toa5_csat3_20hz.dat", WindOptions(zone="-05:00"))


@pytest.fixture(scope="module")
def nmea(wind: Path) -> WindLog:
    return read_log(wind / "nmea0183_plaka.log", WindOptions(date=dt.date(2014, 8, 15)))


@pytest.fixture(scope="module")
def kestrel(wind: Path) -> WindLog:
    return read_log(wind / "kestrel5400.csv", WindOptions(zone="Europe/Athens"))


@pytest.fixture(scope="module")
def tunnel(wind: Path) -> WindLog:
    return read_log(wind / "flag-camera-tunnel" / "gt_log.csv", WindOptions(zone="UTC"))


@pytest.fixture(scope="module")
def tracked(wind: Path) -> WindLog:
    return read_log(wind / "flag-camera-tunnel" / "pi_log.csv", WindOptions(zone="UTC"))


def test_dropped_zeros_leave_18000_rows_at_20_hz(toa5: WindLog) -> None:
    assert toa5.format == "toa5"
    assert len(toa5.series) == 18_000
    assert set(np.diff(toa5.series.time)) == {S // 20}
    assert iso(int(toa5.series.time[0])) == "2012-06-07T17:45:00.050Z"
    assert iso(int(toa5.series.time[-1])) == "2012-06-07T18:00:00Z"


def test_a_sonic_without_faults_is_reported_clean(toa5: WindLog) -> None:
    assert not toa5.series.flags.any()
    assert kinds(toa5) == {"columns-not-read", "speed-from-components"}
    assert finding(toa5, "columns-not-read").count == 2  # co2 and h2o


def test_sonic_components_are_the_cells_of_the_file(toa5: WindLog, wind: Path) -> None:
    with (wind / "toa5_csat3_20hz.dat").open(newline="") as stream:
        rows = list(csv.reader(stream))[4:]
    assert toa5.series.channels["wind_x"].tolist() == [float(row[2]) for row in rows]
    assert toa5.series.channels["wind_z"].tolist() == [float(row[4]) for row in rows]
    assert toa5.series.channels["air_pressure"][0] == pytest.approx(100_219.8)  # 100.2198 kPa
    assert toa5.series.channels["sonic_temperature"][0] == pytest.approx(300.80771)  # 27.65771 °C


def test_900_seconds_of_20_hz_make_900_means_of_20(toa5: WindLog) -> None:
    means = average(toa5.series)
    assert len(means.time) == 900
    assert set(means.count) == {20}
    speed = np.hypot(toa5.series.channels["wind_x"], toa5.series.channels["wind_y"])
    assert means.speed == pytest.approx(speed.reshape(900, 20).mean(axis=1))


def test_relative_and_theoretical_wind_of_7250_sentences_stay_apart(
    nmea: WindLog, wind: Path
) -> None:
    lines = (wind / "nmea0183_plaka.log").read_text().split()
    valid = [
        line.split(",")
        for line in lines
        if line.startswith("$IIMWV") and line.split(",")[5][0] == "A"
    ]
    relative = [float(f[3]) for f in valid if f[2] == "R"]
    theoretical = [float(f[3]) for f in valid if f[2] == "T"]
    assert len(nmea.series) == sum(1 for line in lines if line.startswith("$IIMWV")) == 7250
    channels = nmea.series.channels
    knots = {
        name: channels[name][np.isfinite(channels[name])] * 3600 / 1852
        for name in channels
        if "speed" in name
    }
    assert knots["apparent_wind_speed"] == pytest.approx(relative)
    assert knots["theoretical_wind_speed"] == pytest.approx(theoretical)
    assert not np.any(
        np.isfinite(channels["apparent_wind_speed"])
        & np.isfinite(channels["theoretical_wind_speed"])
    )


def test_every_checksum_of_the_stream_is_right(nmea: WindLog) -> None:
    assert not {"checksum-errors", "no-checksum", "malformed-lines"} & kinds(nmea)


def test_sentences_marked_void_are_faults(nmea: WindLog, wind: Path) -> None:
    void = sum(
        1
        for line in (wind / "nmea0183_plaka.log").read_text().split()
        if line.startswith("$IIMWV") and ",V*" in line
    )
    assert finding(nmea, "sensor-fault").count == void == 15
    assert int(((nmea.series.flags & SampleFlag.SENSOR_FAULT) != 0).sum()) == void


def test_a_boats_wind_is_no_ground_truth(nmea: WindLog) -> None:
    assert finding(nmea, "apparent-wind-only").value == pytest.approx(
        5.9, abs=0.1
    )  # kn over ground, by VTG
    with pytest.raises(InputError, match="no channel wind_speed"):
        average(nmea.series)


def test_times_are_interpolated_between_time_sentences_and_marked(nmea: WindLog) -> None:
    assert bool(np.all(nmea.series.flags & SampleFlag.TIME_UNSURE))
    # the log runs from 09:55:59 to 14:03:24 (ZDA), one MWV five lines before each ZDA of a 16-line
    # cycle of 2 s
    assert iso(int(nmea.series.time[0])).startswith("2014-08-15T09:55:58")
    assert iso(int(nmea.series.time[-1])).startswith("2014-08-15T14:0")


def test_a_stream_without_a_date_asks_for_it(wind: Path) -> None:
    with pytest.raises(TimeError, match="--date"):
        read_log(wind / "nmea0183_plaka.log")


def test_kestrel_dates_are_day_first_whatever_the_header_says(kestrel: WindLog) -> None:
    assert len(kestrel.series) == 2476
    assert set(np.diff(kestrel.series.time)) == {20 * 60 * S}
    assert iso(int(kestrel.series.time[0])) == "2020-06-09T21:00:00Z"  # 10 June 00:00 in Athens
    assert iso(int(kestrel.series.time[-1])) == "2020-07-14T06:00:00Z"  # 14 July 09:00
    assert "dmy" in finding(kestrel, "date-order").what


def test_kestrel_units_survive_two_encodings(kestrel: WindLog) -> None:
    channels = kestrel.series.channels
    assert channels["air_temperature"][0] == pytest.approx(283.05)  # 9.9 °C
    assert channels["wind_speed"][0] == pytest.approx(0.7)
    assert np.degrees(channels["wind_direction"][0]) == pytest.approx(327)
    assert channels["air_pressure"][0] == pytest.approx(102_100)  # 1021 mb
    assert channels["relative_humidity"][0] == pytest.approx(0.699)
    assert finding(kestrel, "units-repaired").count == 2


def test_kestrel_calms_are_in_the_dead_zone(kestrel: WindLog, wind: Path) -> None:
    with (wind / "kestrel5400.csv").open(encoding="utf-8-sig") as stream:
        speeds = [float(line.split(";")[2]) for line in stream.readlines()[5:]]
    assert finding(kestrel, "dead-zone").count == sum(1 for v in speeds if v < 0.6)


def test_the_tunnels_zero_offset_is_reported_and_not_applied(tunnel: WindLog) -> None:
    assert len(tunnel.series) == 12_596
    assert finding(tunnel, "zero-offset").value == pytest.approx(-0.35, abs=0.005)
    negative = int((tunnel.series.channels["wind_speed"] < 0).sum())
    assert finding(tunnel, "negative-speed").count == negative == 9888
    assert bool(np.all(tunnel.series.flags[tunnel.series.channels["wind_speed"] < 0] & UNUSABLE))


def test_the_tunnels_dead_zone_is_left_in_a_jump(tunnel: WindLog) -> None:
    # the last idle reading is -0.35, the first other one 0.03 (line 9890)
    jump = finding(tunnel, "dead-zone-jump")
    assert jump.value == pytest.approx(0.38, abs=0.01)
    assert jump.where == "line 9890"
    assert jump.count == 1


def test_the_tunnels_zero_offset_is_subtracted_when_asked(wind: Path, tunnel: WindLog) -> None:
    log = read_log(
        wind / "flag-camera-tunnel" / "gt_log.csv", WindOptions(zone="UTC", zero_offset="estimate")
    )
    shift = log.series.channels["wind_speed"] - tunnel.series.channels["wind_speed"]
    assert shift == pytest.approx(0.35, abs=0.005)
    assert "negative-speed" not in kinds(log)
    calm = (log.series.flags & SampleFlag.DEAD_ZONE) != 0
    assert int(calm.sum()) == 9888


def test_the_tunnels_anemometer_comes_at_203_hz(tunnel: WindLog) -> None:
    time = tunnel.series.time
    assert (len(time) - 1) / ((time[-1] - time[0]) / S) == pytest.approx(203, abs=0.5)


def test_counters_among_the_cameras_lines_are_no_data(tracked: WindLog) -> None:
    assert len(tracked.series) == 643
    other = finding(tracked, "non-data-lines")
    assert (other.count, other.where) == (355, "line 2")


def test_the_cameras_dropout_is_found_to_the_millisecond(tracked: WindLog) -> None:
    gap = finding(tracked, "gaps")
    assert gap.value == pytest.approx(0.433, abs=1e-6)
    assert gap.where == "line 528"


def test_the_camera_keeps_both_clocks(tracked: WindLog) -> None:
    assert tracked.series.host_time is not None
    assert iso(int(tracked.series.time[0])) == "2025-12-09T16:15:45.951Z"  # 1765296945.951
    assert iso(int(tracked.series.host_time[0])) == "2025-12-09T16:15:45.889737Z"


def test_flutter_at_the_nyquist_limit_is_flagged(tracked: WindLog) -> None:
    found = finding(tracked, "at-nyquist")
    assert found.value == pytest.approx(14.0)
    frequency = tracked.series.channels["flutter_frequency"]
    aliased = (tracked.series.flags & SampleFlag.ALIASED) != 0
    assert bool(np.all(frequency[aliased] >= 13.7))
    assert bool(np.all(frequency[~aliased] < 14.0))
    # 29.0 frames a second: 14 Hz may be 29 - 14 = 15 Hz or 29 + 14 = 43 Hz
    assert "14.50 Hz of 29.0" in found.what
    assert "15.0 or 43.0 Hz" in found.what


def test_an_estimated_wind_is_no_reading(tracked: WindLog) -> None:
    assert "wind_speed" not in tracked.series.channels
    assert "wind_speed_estimate" in tracked.series.channels


@pytest.mark.parametrize(
    ("name", "format_name", "kind"),
    [
        ("wind/toa5_csat3_20hz.dat", "toa5", "anemometer"),
        ("wind/nmea0183_plaka.log", "nmea", "anemometer"),
        ("wind/kestrel5400.csv", "kestrel", "anemometer"),
        ("wind/flag-camera-tunnel/gt_log.csv", "host-stamped", "anemometer"),
        ("wind/flag-camera-tunnel/pi_log.csv", "host-stamped", "anemometer"),
        ("video/dyntex_flag_571c110.avi", "video", "camera"),
        ("video/dadamo-2024/phone_vfr.mp4", "video", "camera"),
        ("arcsim/raw_fixed_mesh", "mesh folder", "meshes"),
        ("arcsim/raw_fixed_mesh/0000_00.obj", "mesh", "meshes"),
        ("arcsim/flag_w4_dt5.npz", "a zip archive or an Excel workbook", "other"),
        ("fabric/drapetester_fabrics.csv", "unknown", "other"),
    ],
)
def test_a_real_file_is_identified_correctly(
    reference_data: Path, name: str, format_name: str, kind: str
) -> None:
    best = sniff(reference_data / name)[0]
    assert (best.format, best.kind) == (format_name, kind)
    assert best.reasons
