"""Sensor effects against the responses that instruments of their kind have."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from flagdata.errors import InputError, UsageError
from sim.effects import SENSOR_EFFECTS, AnemometerLag, Sampling

AnemometerDeadZone = SENSOR_EFFECTS["anemometer-dead-zone"]
AnemometerGain = SENSOR_EFFECTS["anemometer-gain"]
AnemometerOffset = SENSOR_EFFECTS["anemometer-offset"]
ClockDrift = SENSOR_EFFECTS["clock-drift"]
ClockOffset = SENSOR_EFFECTS["clock-offset"]
ExposureBlur = SENSOR_EFFECTS["exposure-blur"]
FrameJitter = SENSOR_EFFECTS["frame-jitter"]
FrameRateError = SENSOR_EFFECTS["frame-rate-error"]
Overspeeding = SENSOR_EFFECTS["overspeeding"]
RollingShutter = SENSOR_EFFECTS["rolling-shutter"]
SensorDistance = SENSOR_EFFECTS["sensor-distance"]
SensorHeight = SENSOR_EFFECTS["sensor-height"]


def column(values) -> torch.Tensor:
    return torch.tensor(np.asarray(values, dtype=np.float64))[:, None]


def test_a_step_is_followed_exponentially_in_the_run_of_wind() -> None:
    """From 4 to 6 m/s at t = 10 s, mean 5 m/s by symmetry: 6 − 2 e^(−5 (t − 10)/ℓ)."""
    time = np.concatenate([np.arange(0, 10.0001, 0.1), 10.0002 + np.arange(0, 10.0, 0.1)])
    speed = np.where(time < 10.0001, 4.0, 6.0)
    read = AnemometerLag(distance=3.0).read(torch.tensor(time), column(speed))[:, 0].numpy()
    after = time > 10.0001
    # The step takes 0.2 ms, and the mean is 5.01: both far below 0.5 % of the step.
    np.testing.assert_allclose(
        read[after], 6 - 2 * np.exp(-5 * (time[after] - 10) / 3), rtol=0, atol=0.01
    )
    assert (read[~after] == 4.0).all()


@pytest.mark.parametrize("frequency", [0.1, 0.5, 2.0])
def test_a_sinusoid_is_damped_and_late_as_a_first_order_response_says(frequency) -> None:
    """Gain 1/√(1 + (ω τ)²), phase −atan(ω τ), τ = ℓ/U = 0.5 s. Irregular samples of 60 or more a
    cycle: linear between them, they lose (ω h)²/12 of the amplitude."""
    period = 1 / frequency
    steps = np.tile([0.7, 1.3], 30 * 40) * period / 60
    time = np.concatenate([[0.0], np.cumsum(steps)])
    speed = 6 + 0.5 * np.sin(2 * np.pi * frequency * time)
    read = AnemometerLag(distance=3.0).read(torch.tensor(time), column(speed))[:, 0].numpy()
    settled = time > 20 * period
    wave = np.exp(-2j * np.pi * frequency * time[settled])
    weight = np.gradient(time[settled])
    response = (read[settled] - 6) @ (weight * wave) / ((speed[settled] - 6) @ (weight * wave))
    expected = 1 / (1 + 2j * np.pi * frequency * 0.5)
    assert abs(response - expected) < 0.005


def test_overspeeding_is_the_squared_intensity() -> None:
    """A sinusoid of amplitude a U has I² = a²/2."""
    time = np.arange(0.0, 600.0, 0.25)
    speed = 5 * (1 + 0.4 * np.sin(2 * np.pi * 0.5 * time))
    read = (
        Overspeeding(coefficient=1.0, window=30.0)
        .read(torch.tensor(time), column(speed))[:, 0]
        .numpy()
    )
    middle = (time > 200) & (time < 400)
    # A window of 30 s averages over some 30 cycles: 1 % of the bias is left to the phase.
    np.testing.assert_allclose(read[middle] / speed[middle], 1.08, rtol=0, atol=1e-3)


def test_gain_offset_and_dead_zone_do_what_they_say_in_the_order_they_are_given() -> None:
    time, speed = torch.arange(4.0, dtype=torch.float64), column([0.2, 0.5, 3.0, -0.3])
    gain, offset, dead = (
        AnemometerGain(gain=1.1),
        AnemometerOffset(offset=-0.35),
        AnemometerDeadZone(threshold=0.5),
    )
    read = offset.read(time, gain.read(time, dead.read(time, speed)))
    np.testing.assert_allclose(read[:, 0], [-0.35, 0.2, 2.95, -0.35], rtol=0, atol=1e-12)


def test_a_sensor_at_half_the_height_reads_less_by_the_power_law() -> None:
    read = SensorHeight(ratio=0.5, exponent=0.2).read(torch.arange(2.0), column([4.0, 8.0]))
    np.testing.assert_allclose(read[:, 0], [4 * 0.5**0.2, 8 * 0.5**0.2], rtol=1e-12)


def test_a_sensor_10_m_downstream_in_5_m_per_s_is_2_s_late() -> None:
    time = np.arange(0.0, 40.0, 0.5)
    speed = 5 + np.sin(2 * np.pi * time / 20)
    read = SensorDistance(distance=10.0).read(torch.tensor(time), column(speed))[:, 0].numpy()
    # Two whole periods: the mean is 5 m/s, the delay four samples, and the first two seconds hold
    # the first speed.
    np.testing.assert_allclose(read[4:], speed[:-4], rtol=0, atol=1e-9)
    np.testing.assert_allclose(read[:4], 5.0, rtol=0, atol=1e-9)


def test_a_clock_that_gains_20_ppm_is_1_728_s_ahead_after_a_day() -> None:
    stamps = ClockOffset(offset=-0.5).stamps(ClockDrift(rate=2e-5).stamps(column([0.0, 86_400.0])))
    np.testing.assert_allclose(stamps[:, 0], [-0.5, 86_401.228], rtol=0, atol=1e-9)


def moving(
    frequency: float = 1.0, rows: int = 1, *, end: float = 4.0
) -> tuple[torch.Tensor, torch.Tensor]:
    """Points that swing along x as e^(i ω t), cosine along x and sine along y, at 2,000 samples a
    second."""
    time = torch.arange(-1.0, end + 1, 5e-4, dtype=torch.float64)
    angle = 2 * np.pi * frequency * time
    point = torch.stack([angle.cos(), angle.sin(), 0 * angle], dim=1)
    return time, point[:, None, :, None].repeat(1, rows, 1, 1)


def seen(sampling: Sampling, frequency: float = 1.0) -> np.ndarray:
    """What is seen of such points, as complex numbers (frame, row)."""
    image = sampling.observe(*moving(frequency, len(sampling.rows), end=float(sampling.stamps[-1])))
    return image[:, :, 0, 0].numpy() + 1j * image[:, :, 1, 0].numpy()


def frames(rows: list[float], *, count: int = 50) -> Sampling:
    return Sampling.ideal(
        torch.arange(count, dtype=torch.float64) * 0.04, torch.tensor(rows, dtype=torch.float64)
    )


# Points are linear between 2,000 samples a second: (ω h)²/8 of the amplitude, 2e-5 at 4 Hz.
LINEAR = 5e-5


@pytest.mark.parametrize(("frequency", "exposure"), [(1.0, 0.04), (4.0, 0.04), (10.0, 0.03)])
def test_an_exposure_keeps_the_sinc_of_a_motion_and_no_phase(frequency, exposure) -> None:
    ideal = frames([0.5])
    ratio = seen(ExposureBlur(exposure=exposure).change_instants(ideal), frequency) / seen(
        ideal, frequency
    )
    np.testing.assert_allclose(ratio, np.sinc(frequency * exposure), rtol=0, atol=8 * LINEAR)


def test_rows_are_seen_one_after_the_other() -> None:
    """Over T = 20 ms from top to bottom, at 2 Hz: phases of ω T (r − ½)."""
    ideal = frames([0.0, 0.5, 1.0])
    phase = np.angle(
        seen(RollingShutter(readout=0.02).change_instants(ideal), 2.0) / seen(ideal, 2.0)
    )
    np.testing.assert_allclose(
        phase, np.tile(2 * np.pi * 2 * 0.02 * np.array([-0.5, 0, 0.5]), (50, 1)), rtol=0, atol=1e-5
    )


def test_a_camera_4_percent_fast_shows_a_motion_slow_by_as_much() -> None:
    sampling = FrameRateError(error=0.04).change_instants(frames([0.5]))
    phase = np.unwrap(np.angle(seen(sampling, 3.0)[:, 0]))
    frequency = np.polyfit(sampling.stamps.numpy(), phase, 1)[0] / (2 * np.pi)
    assert frequency == pytest.approx(3.0 / 1.04, rel=1e-5)


def test_jitter_of_sigma_moves_what_is_seen_by_the_speed_times_sigma() -> None:
    ideal = frames([0.5], count=2000)
    draws = torch.from_numpy(np.random.Generator(np.random.PCG64(1)).standard_normal((2000, 1)))
    sampling = FrameJitter(deviation=1e-3, draws=draws).change_instants(ideal)
    phase = np.angle(seen(sampling) / seen(ideal))[:, 0]
    # 2,000 draws: the deviation is known to 1.6 %; 3 σ allowed.
    assert phase.std() == pytest.approx(2 * np.pi * 1e-3, rel=0.05)


def test_camera_effects_compose() -> None:
    """Blur and shutter: the sinc of one, the phase of the other, in either order."""
    ideal = frames([0.0, 1.0])
    blur, shutter = ExposureBlur(exposure=0.02), RollingShutter(readout=0.01)
    one, two = (
        seen(blur.change_instants(shutter.change_instants(ideal)), 3.0),
        seen(shutter.change_instants(blur.change_instants(ideal)), 3.0),
    )
    np.testing.assert_allclose(one, two, rtol=0, atol=1e-12)
    expected = np.sinc(0.06) * np.exp(2j * np.pi * 3 * 0.01 * np.array([-0.5, 0.5]))
    np.testing.assert_allclose(
        one / seen(ideal, 3.0), np.tile(expected, (50, 1)), rtol=0, atol=4 * LINEAR
    )


def test_a_camera_sees_nothing_outside_the_trajectory() -> None:
    ideal = frames([0.5])
    time, trajectory = moving(end=0.5)
    with pytest.raises(UsageError, match="trajectory is known from"):
        ideal.observe(time, trajectory)
    with pytest.raises(InputError, match="the trajectory has the shape"):
        ideal.observe(time, trajectory.repeat(1, 2, 1, 1))
    with pytest.raises(UsageError, match="there are 1 draws for 50 frames"):
        replace(FrameJitter(deviation=1e-3)).change_instants(ideal)
