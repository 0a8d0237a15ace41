"""The main job on real input: a film of a flag and a sonic's log become pairs with the sonic's own
mean wind."""

from __future__ import annotations

from datetime import UTC, datetime

import numpy as np
import pytest

import flagdata
from flagdata.align import ClockOptions, Method, Pair, make_recording
from flagdata.align.methods import declared_clock
from flagdata.dataset import Tolerance
from flagdata.errors import RefusedError
from flagdata.ingest import (
    CameraIngest,
    CameraOptions,
    Labels,
    WindIngest,
    WindOptions,
    ingest_camera,
    ingest_wind,
)
from flagdata.lake import Lake
from flagdata.timebase import parse

NS = 1_000_000_000
PERIOD = NS // 25


def raw_means(path, ends, window):
    """Mean horizontal speed over (end - window, end] and its naive scatter, from the text of the
    file alone."""
    time, speed = [], []
    for line in path.read_text().splitlines()[4:]:
        stamp, _, x, y = line.split(",")[:4]
        text = stamp.strip('"')
        moment = datetime.strptime(text[:19], "%Y-%m-%d %H:%M:%S").replace(tzinfo=UTC)
        fraction = text[20:].ljust(9, "0") if len(text) > 19 else "0"
        time.append(int(moment.timestamp()) * NS + int(fraction))
        speed.append(np.hypot(float(x), float(y)))
    time, speed = np.array(time), np.array(speed)
    return [float(speed[(time > end - window * NS) & (time <= end)].mean()) for end in ends]


@pytest.mark.reference
def test_a_real_film_and_a_real_sonic_become_pairs_with_the_sonics_mean(reference_data, tmp_path):
    film = reference_data / "video" / "dyntex_flag_571c110.avi"
    log = reference_data / "wind" / "toa5_csat3_20hz.dat"
    start = parse("2012-06-07T12:50:00.02Z")  # the two were never together: the start is made up
    lake = Lake.create(tmp_path / "lake")
    labels = Labels(session="field")
    camera = ingest_camera(
        lake, film, CameraIngest(camera=CameraOptions(start=start)), labels=labels
    )
    wind = ingest_wind(lake, log, WindIngest(wind=WindOptions(zone="UTC")), labels=labels)
    options = ClockOptions(by=Method.GIVEN, offset=2.5, offset_sigma=0.4)
    pair = Pair.of(lake, camera.artifact.id, wind.artifact.id)
    make_recording(lake, pair, declared_clock(pair, options, recipe=options.recipe()).alignment)

    for window in (60.0, 20.0):
        pairs = flagdata.open(lake.path).pairs(window=window)
        assert len(pairs) == 8  # 250 frames hold 8 clips of 30
        assert pairs.refused == ()
        samples = list(pairs)
        ends = [start + round(2.5 * NS) + (30 * k + 29) * PERIOD for k in range(8)]
        # The film's own stamps and the record's are exact to a microsecond or so.
        assert [sample.end for sample in samples] == pytest.approx(ends, abs=2000)
        expected = raw_means(log, [sample.end for sample in samples], window)
        # Every sample of a 20 Hz log weighs the same, so the mean is the plain one.
        assert [sample.wind for sample in samples] == pytest.approx(expected, rel=1e-9)
        assert all(sample.clock_sigma == pytest.approx(0.4, rel=0.05) for sample in samples)
        assert all(0 < sample.wind_sigma < 1 for sample in samples)
        # All but what has passed since the last sample, at most one period of 0.05 s.
        assert all(1 - 0.0501 / window <= sample.coverage <= 1 for sample in samples)
        assert all(sample.clip.shape == (1, 30, 300, 300) for sample in samples)
        # The cloth moves: consecutive frames of a clip differ.
        assert all(
            float((sample.clip[0, 1:] != sample.clip[0, :-1]).float().mean()) > 0.01
            for sample in samples
        )

    source = flagdata.open(lake.path)
    with pytest.raises(RefusedError, match=r"known to ±0\.4 s, above 0\.1 s"):
        source.pairs(tolerance=Tolerance(clock_sigma=0.1))
