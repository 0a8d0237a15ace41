"""Clips never overlap nor span a gap, and carry the ground truth of the minute before their end."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flagdata.core.clock_model import ClockModel
from flagdata.core.schema import Kind
from flagdata.dataset import clip_rows
from flagdata.dataset.clips import runs
from flagdata.errors import InputError, UsageError
from flagdata.lake import Artifact
from flagdata.record import Record, RecordWriter
from flagdata.record.signals import Sensor, WindSeries
from tests.flagdata.dataset.conftest import write_record

NS = 1_000_000_000
PERIOD = NS // 25
NOON = 1_777_636_800 * NS


def recording(**changes):
    return Artifact(
        kind=Kind.RECORDING, name="flag", object="mcap/" + "0" * 64, session="field", **changes
    )


def times(*steps):
    return NOON + np.concatenate([[0], np.cumsum(steps)]).astype(np.int64)


def test_clips_follow_each_other_and_the_rest_is_left_out():
    assert list(runs(times(*[PERIOD] * 94), 30)) == [0, 30, 60]
    assert list(runs(times(*[PERIOD] * 28), 30)) == []
    assert list(runs(times(*[PERIOD] * 29), 30)) == [0]
    assert list(runs(np.empty(0, dtype=np.int64), 30)) == []


def test_a_clip_begins_anew_after_a_gap():
    steps = (
        [PERIOD] * 40 + [2 * PERIOD] + [PERIOD] * 40
    )  # a frame is missing between frames 40 and 41
    assert list(runs(times(*steps), 30)) == [0, 41]


def test_a_step_of_less_than_one_and_a_half_periods_is_jitter():
    steps = [PERIOD] * 10 + [int(1.4 * PERIOD)] + [PERIOD] * 18
    assert list(runs(times(*steps), 30)) == [0]


def test_time_that_does_not_increase_is_refused():
    with pytest.raises(InputError, match="frame 3"):
        list(runs(times(PERIOD, PERIOD, 0, PERIOD), 2))
    with pytest.raises(UsageError):
        list(runs(times(PERIOD), 0))


@given(
    st.lists(st.sampled_from([PERIOD, PERIOD + 1000, 2 * PERIOD, 50 * PERIOD]), max_size=200),
    st.integers(1, 12),
)
def test_clips_never_overlap_nor_span_a_gap(steps, frames):
    instants = times(*steps)
    gap = 1.5 * np.median(steps) if steps else 0
    end = 0
    for first in runs(instants, frames):
        assert first >= end
        end = first + frames
        assert end <= len(instants)
        assert np.all(np.diff(instants[first:end]) <= gap)


def test_ground_truth_of_a_clip_is_the_mean_of_the_minute_before_its_end(tmp_path, made):
    record = write_record(tmp_path / "a.mcap", made(number=1, mean=6.0))
    clock = ClockModel.identity(
        "camera", "wind", start=NOON - 10 * NS, end=NOON + 10 * NS, sigma=0.1
    )
    rows = clip_rows(record, recording(clock_model=clock.to_json()))
    assert [(r.frame_first, r.frame_count) for r in rows] == [(0, 30), (30, 30), (60, 30)]
    assert [r.start for r in rows] == [NOON + k * 30 * PERIOD for k in range(3)]
    assert [r.end for r in rows] == [NOON + (k * 30 + 29) * PERIOD for k in range(3)]
    for row in rows:
        # The wind is sampled on whole seconds from 90 s before: 6 + 0.5 sin(2π k / 12), whose sum
        # over 60 is zero.
        assert row.wind == pytest.approx(6.0, abs=1e-12)
        assert row.wind_sigma >= 0.2  # the sensor's accuracy is its floor
        assert row.wind_coverage == pytest.approx(1 - row.wind_staleness / 60, abs=1e-12)
        assert row.wind_staleness == pytest.approx((row.end % NS) / NS, abs=1e-12)
        assert row.clock_sigma == 0.1
        assert (row.session, row.day, row.kind) == ("field", "2026-05-01", Kind.CLIP)
        assert row.parents == (recording(clock_model=clock.to_json()).id,)
    assert len({r.id for r in rows}) == 3


def test_a_clip_with_a_thin_minute_stays_as_a_row_that_says_so(tmp_path, made):
    record = write_record(tmp_path / "a.mcap", made(number=1, missing=(30, 90)))
    rows = clip_rows(record, recording(clock_sigma=0.1))
    # All of the minute before the first frame is missing; the log resumes at the first frame.
    assert rows[0].wind_coverage == pytest.approx(1 / 60, abs=0.02)
    assert rows[0].wind_staleness == pytest.approx(0.16, abs=1e-9)
    assert "wind-coverage-low" in rows[0].quality


def test_a_record_without_wind_gives_clips_without_ground_truth(tmp_path, made):
    record = write_record(tmp_path / "a.mcap", made(number=1, truth={"bending": 1e-5}))
    row = clip_rows(record, recording(clock_sigma=0.1))[0]
    assert (row.wind, row.wind_sigma, row.wind_coverage, row.wind_staleness) == (
        None,
        None,
        0.0,
        None,
    )
    assert "wind-missing" in row.quality


def test_an_unknown_clock_uncertainty_makes_the_ground_truths_unknown(tmp_path, made):
    row = clip_rows(write_record(tmp_path / "a.mcap", made(number=1)), recording())[0]
    assert row.wind is not None
    assert row.wind_sigma is None
    assert row.clock_sigma is None
    assert "clock-sigma-unknown" in row.quality


def test_a_simulated_record_states_its_wind_exactly_and_has_no_day(tmp_path, made):
    truth = {"wind_speed": 4.5, "bending": 1e-5}
    record = write_record(tmp_path / "a.mcap", made(number=1, frames=60, truth=truth))
    rows = clip_rows(record, recording(seed=7, clock_sigma=0.0))
    assert len(rows) == 2
    assert all(
        (r.wind, r.wind_sigma, r.wind_coverage, r.wind_staleness) == (4.5, 0.0, 1.0, 0.0)
        for r in rows
    )
    assert all((r.seed, r.day) == (7, None) for r in rows)
    assert json.loads(rows[0].parameters) == truth


def test_the_wind_of_a_moving_platform_is_no_ground_truth(tmp_path):
    path = tmp_path / "boat.mcap"
    with RecordWriter(path, metadata={}) as writer:
        for index in range(30):
            time = NOON + index * PERIOD
            writer.frame(
                log_time=time,
                publish_time=time,
                timestamp=time,
                image=np.zeros((8, 8), dtype=np.uint8),
            )
        writer.wind(
            WindSeries(
                time=NOON - 60 * NS + np.arange(62) * NS,
                channels={"apparent_wind_speed": np.full(62, 7.0)},
                flags=np.zeros(62, dtype=np.uint16),
                sensor=Sensor(name="masthead"),
            )
        )
    row = clip_rows(Record.open(path), recording(clock_sigma=0.1))[0]
    assert row.wind is None
    assert "wind-missing" in row.quality
