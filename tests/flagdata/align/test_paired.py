"""Two clocks that stamped the same samples: the lower envelope, its drift, its jumps."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from flagdata.align import host_clock, pair_clocks
from flagdata.core.rng import stream
from flagdata.errors import InputError
from flagdata.record.signals import Sensor, WindSeries
from tests.refusals import unrefused

SECOND = 1_000_000_000
START = 1_780_000_000 * SECOND


def clocks(
    seed: int,
    *,
    offset: float = 12.5,
    drift: float = 4e-5,
    seconds: float = 600.0,
    rate: float = 20.0,
    steps: tuple[tuple[float, float], ...] = (),
) -> tuple[np.ndarray, np.ndarray]:
    """Device and host stamps with delays in bursts: exponential of 4 ms, and for two seconds in
    twenty, 80 ms more."""
    rng = stream(seed, "clocks")
    time = np.arange(round(seconds * rate)) / rate
    delay = rng.exponential(0.004, len(time)) + np.where(
        time % 20 < 2, rng.exponential(0.08, len(time)), 0.0
    )
    late = offset + drift * (time - seconds / 2) + delay
    for at, size in steps:
        late = late + np.where(time >= at, size, 0.0)
    device = START + np.round(time * SECOND).astype(np.int64)
    return device, device + np.round(late * SECOND).astype(np.int64)


def nominal_times(host_time: np.ndarray) -> np.ndarray:
    """Instants that a device of steady rate without a clock would have stamped: its samples
    counted, (n,) [UTC ns].

    The period is the line through host stamps against the count of samples, robustly. Given to
    `pair_clocks` with the host's stamps, every lost sample or gap of the device shows as a step, so
    that segments hold runs without loss.
    """
    count = np.arange(len(host_time), dtype=np.float64)
    seconds = (host_time - host_time[0]) / SECOND
    # Slopes over a tenth of the log, so that jitter averages out; their median, so that gaps do not
    # count.
    reach = max(1, len(host_time) // 10)
    period = float(np.median(seconds[reach:] - seconds[:-reach])) / reach
    return host_time[0] + np.round(count * period * SECOND).astype(np.int64)


def test_offset_and_drift_are_those_of_the_lower_envelope() -> None:
    device, host = clocks(1)
    paired = pair_clocks(device, host)
    (segment,) = paired.model.segments
    middle = np.array([(device[0] + device[-1]) // 2])
    # The least of 20 exponential delays of 4 ms is 0.2 ms on average.
    assert (paired.model.to_common(middle) - middle)[0] / SECOND == pytest.approx(12.5, abs=0.001)
    assert segment.drift == pytest.approx(4e-5, abs=1e-6)
    assert paired.delay == pytest.approx(0.004, abs=0.002)
    assert paired.worst_delay > 0.2


def test_two_sigma_hold_offset_and_drift_in_nineteen_of_twenty_logs() -> None:
    good = 0
    for seed in range(60):
        device, host = clocks(seed, seconds=120)
        model = pair_clocks(device, host).model
        at = np.array([device[0] + 60 * SECOND])
        good += bool(abs((model.to_common(at) - at)[0] / SECOND - 12.5) < 2 * model.sigma(at)[0])
        good += bool(abs(model.segments[0].drift - 4e-5) < 2 * model.segments[0].sigma_drift)
    assert (
        good >= 0.9 * 120
    )  # the median delay, a systematic allowance, makes the offsets' σ generous


@pytest.mark.parametrize("size", [-0.7, 0.25, 3600.0])
def test_a_clock_that_was_set_gets_another_segment_at_the_sample(size: float) -> None:
    device, host = clocks(2, steps=((271.35, size),))
    paired = pair_clocks(device, host)
    first, second = paired.model.segments
    # A jump down is seen at once; one up is seen by the first sample that is not merely late.
    assert (second.start - START) / SECOND == pytest.approx(271.35, abs=1.0)
    assert second.offset - first.offset == pytest.approx(size + 4e-5 * 300, abs=0.005)
    jump = [finding for finding in paired.findings if finding.kind == "clock-jump"]
    assert len(jump) == 1
    assert jump[0].value == pytest.approx(size, abs=0.005)


def test_two_jumps_make_three_segments() -> None:
    device, host = clocks(3, steps=((150.0, 1.0), (400.0, -0.5)))
    assert len(pair_clocks(device, host).model.segments) == 3


def test_one_wrong_stamp_is_no_jump() -> None:
    device, host = clocks(4)
    host = host.copy()
    host[5000] -= 3 * SECOND
    paired = pair_clocks(device, host)
    assert len(paired.model.segments) == 1
    assert paired.model.segments[0].offset == pytest.approx(12.5, abs=0.01)


def test_a_few_seconds_leave_the_drift_to_its_prior() -> None:
    device, host = clocks(5, seconds=4)
    (segment,) = pair_clocks(device, host).model.segments
    assert segment.drift == 0.0
    assert segment.sigma_drift == 1e-4


def test_the_delay_of_the_fastest_sample_is_taken_off_and_its_uncertainty_added() -> None:
    device, host = clocks(6)
    bare = pair_clocks(device, host, least_delay_sigma=0.0)
    delayed = pair_clocks(device, host, least_delay=0.03, least_delay_sigma=0.01)
    (a,), (b,) = bare.model.segments, delayed.model.segments
    assert b.offset == pytest.approx(a.offset - 0.03, abs=1e-12)
    assert b.sigma_offset == pytest.approx(np.hypot(a.sigma_offset, 0.01))


def test_an_unset_device_clock_decades_off_keeps_nanoseconds() -> None:
    device, host = clocks(7, drift=0.0)
    paired = pair_clocks(device - START, host)
    at = np.array([300 * SECOND])
    # An offset in float64 seconds, 1.8e9 of them, resolves 0.24 µs.
    assert (paired.model.to_common(at) - at - START)[0] / SECOND == pytest.approx(12.5, abs=0.001)


def test_a_counted_clock_shows_lost_samples_as_steps() -> None:
    rng = stream(8, "count")
    time = np.arange(6000) * 0.005
    time[2500:] += 0.433
    host = START + np.round((time + rng.exponential(0.002, len(time))) * SECOND).astype(np.int64)
    device = nominal_times(host)
    assert np.median(np.diff(device)) / SECOND == pytest.approx(0.005, rel=1e-3)
    _, second = pair_clocks(device, host).model.segments
    assert np.searchsorted(device, second.start) == pytest.approx(2500, abs=5)


def test_stamps_that_make_no_clock_are_refused() -> None:
    cases = [
        ([0], [0], "one sample"),
        ([0, 1], [0], "two stamps"),
        ([1, 1], [0, 1], "do not increase"),
    ]
    assert (
        unrefused(
            lambda device, host: pair_clocks(
                np.array(device, dtype=np.int64), np.array(host, dtype=np.int64)
            ),
            cases,
            InputError,
        )
        == []
    )


def test_a_log_with_one_kind_of_stamp_has_no_host_clock() -> None:
    series = WindSeries(
        time=np.arange(3, dtype=np.int64),
        channels={"wind_speed": np.ones(3)},
        flags=np.zeros(3, dtype=np.uint16),
        sensor=Sensor(name="cup"),
    )
    assert host_clock(series) is None


@pytest.mark.reference
def test_the_tunnels_camera_clock_runs_sixty_milliseconds_ahead_of_the_laptop(tunnel: Any) -> None:
    """The least of laptop − device in the file is near −64 ms; the device writes whole
    milliseconds."""
    paired = pair_clocks(tunnel.device, tunnel.host)
    (segment,) = paired.model.segments
    assert segment.offset == pytest.approx(
        float(np.min(tunnel.host - tunnel.device)) / SECOND, abs=0.002
    )
    assert 0.0003 < segment.sigma_offset < 0.01
    assert abs(segment.drift) < 1e-4
    assert paired.worst_delay < 0.05


@pytest.mark.reference
def test_the_tunnels_anemometer_keeps_a_steady_203_hertz_without_loss(tunnel: Any) -> None:
    """12,596 readings in 62 s, by the file's own stamps; bursts of up to 20 ms are delays, not
    steps."""
    device = nominal_times(tunnel.wind.time)
    paired = pair_clocks(device, tunnel.wind.time)
    assert SECOND / np.median(np.diff(device)) == pytest.approx(203.2, abs=0.2)
    assert len(paired.model.segments) == 1
    assert 0.005 < paired.worst_delay < 0.03
