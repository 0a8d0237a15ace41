"""Effects on the wind against their definitions, theory of wakes, and the statistics of gusts."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from flagdata.core.rng import stream
from flagdata.core.schema import SampleFlag
from flagdata.errors import InputError, UsageError
from flagdata.record.signals import Sensor, WindSeries
from sim.effects import EFFECTS, Gusts, Shear, VerticalWind
from tests.refusals import unrefused

DirectionChange = EFFECTS["direction-change"]
LoggedGusts = EFFECTS["logged-gusts"]
PoleWake = EFFECTS["pole-wake"]

WIND = torch.tensor([3.0, 4.0, 0.5], dtype=torch.float64)[:, None]


def test_gusts_have_the_stated_intensities_and_no_mean() -> None:
    """400 members of 120 s: with integral times of 12 s along and 6 s across, the mean of all is
    known to σ √(2·12/120/400) = 2 % of σ, the deviation to about as much; 4 σ allowed. What lies
    above the samples' Nyquist
    frequency of 2 Hz is left out: 1.3 % of σ along, 2 % across."""
    gusts = Gusts(intensity=0.2, lateral=0.8, vertical=0.5)
    gusts = gusts.with_series(stream(1, "gusts"), batch=400, speed=5.0, duration=120.0, rate=4.0)
    along, up = torch.tensor([0.6, 0.8, 0.0]), torch.tensor([0.0, 0.0, 1.0])
    left = torch.linalg.cross(up, along)
    seen = torch.stack(
        [gusts.velocity(float(t), WIND.expand(-1, 400)) - WIND for t in range(0, 120, 2)]
    )
    for direction, share in ((along, 1.0), (left, 0.8), (up, 0.5)):
        part = torch.einsum("i,tib->tb", direction.double(), seen) / (5.0 * 0.2 * share)
        assert float(part.mean()) == pytest.approx(0.0, abs=0.08)
        assert float(part.std()) == pytest.approx(0.985, abs=0.08)


def test_members_have_gusts_of_their_own_and_the_same_stream_gives_the_same() -> None:
    one, two = (Gusts(intensity=0.2).with_series(stream(2), batch=3, speed=5.0) for _ in range(2))
    assert torch.equal(one.samples, two.samples)
    correlation = np.corrcoef(one.samples[:, 0].T.numpy())
    assert np.abs(correlation - np.eye(3)).max() < 0.95


def test_a_run_longer_than_its_gusts_is_refused() -> None:
    gusts = Gusts(intensity=0.2).with_series(stream(3), batch=1, speed=5.0, duration=20.0)
    gusts.velocity(20.0, WIND)
    with pytest.raises(UsageError, match=r"known from 0 to 20 s"):
        gusts.velocity(20.5, WIND)


def test_followed_in_full_a_log_is_the_wind_itself() -> None:
    """A base wind equal to the log's vector mean becomes the logged velocity at every sample, and
    halfway linear."""
    time = np.arange(0.0, 10.0, 0.5)
    speed, direction = 4 + np.sin(time), 1.0 + 0.4 * np.cos(0.7 * time)
    # Blowing from θ clockwise from north (+y): the air goes to (−sin θ, −cos θ).
    velocity = -speed * np.stack([np.sin(direction), np.cos(direction)])
    mean = torch.tensor([*velocity.mean(axis=1), 0.0])[:, None]
    gusts = LoggedGusts.of(time, speed, direction=direction)
    seen = np.stack([gusts.velocity(float(t), mean)[:, 0].numpy() for t in time], axis=1)
    np.testing.assert_allclose(seen, [*velocity, 0 * time], rtol=0, atol=1e-12)
    half = LoggedGusts.of(time, speed, direction=direction, share=0.5).velocity(2.0, mean)[:2, 0]
    np.testing.assert_allclose(
        half, (velocity[:, 4] + velocity.mean(axis=1)) / 2, rtol=0, atol=1e-12
    )


def test_a_log_is_read_with_its_flags_and_from_its_start() -> None:
    time = 1_700_000_000_000_000_000 + np.arange(5, dtype=np.int64) * 1_000_000_000
    flags = np.array([0, 0, SampleFlag.STALE, 0, 0], dtype=np.int32)
    series = WindSeries(
        time=time,
        channels={"wind_speed": np.array([4.0, 6.0, 9.0, 4.0, 6.0])},
        flags=flags,
        host_time=None,
        sensor=Sensor(name="cup"),
    )
    gusts = LoggedGusts.from_log(series, start=int(time[1]))
    assert gusts.times == (-1.0, 0.0, 2.0, 3.0)
    # The mean of what is there is 5 m/s, so that a wind of 5 m/s is followed as logged.
    np.testing.assert_allclose(gusts.velocity(0.0, WIND)[:2, 0], [3.6, 4.8], rtol=1e-12)


def test_a_log_that_cannot_be_followed_is_refused() -> None:
    cases = [
        ([0.0, 1.0, 9.0], [4.0, 4.0, 4.0], "gap of 8.0 s"),
        ([0.0, 1.0], [0.0, 0.0], "mean wind is zero"),
        ([0.0], [1.0], "n > 1"),
    ]
    assert not unrefused(lambda time, speed: LoggedGusts.of(time, speed), cases, InputError)


def test_a_turning_wind_keeps_its_speed_and_arrives_at_its_angle() -> None:
    change = DirectionChange(angle=0.6, start=2.0, duration=4.0)
    angles = []
    for time in (0.0, 2.0, 4.0, 6.0, 9.0):
        turned = change.velocity(time, WIND)[:, 0]
        assert float(turned.norm()) == pytest.approx(math.sqrt(25.25), rel=1e-12)
        assert float(turned[2]) == 0.5
        angles.append(math.atan2(float(turned[1]), float(turned[0])) - math.atan2(4, 3))
    # Half-way in time is half-way in angle, by the ramp's symmetry.
    np.testing.assert_allclose(angles, [0, 0, 0.3, 0.6, 0.6], rtol=0, atol=1e-12)


def test_an_inclined_wind_keeps_its_speed() -> None:
    level = torch.tensor([3.0, 4.0, 0.0], dtype=torch.float64)[:, None]
    inclined = VerticalWind(inclination=0.2).velocity(0.0, level)[:, 0]
    np.testing.assert_allclose(
        inclined, [3 * math.cos(0.2), 4 * math.cos(0.2), 5 * math.sin(0.2)], rtol=1e-12
    )


def test_shear_is_a_power_of_height() -> None:
    shear = Shear(exponent=0.25, height=4.0)
    offset = torch.tensor(
        [[0.0, 0.0, 0.0], [1.0, 2.0, 60.0], [0.0, 0.0, -3.75]], dtype=torch.float64
    )[..., None]
    seen = shear.field(0.0, offset, WIND)
    # Heights 4, 64 and 0.25 m: (z/4)^¼ = 1, 2 and ½.
    np.testing.assert_allclose(
        seen[..., 0], np.array([[1.0], [2.0], [0.5]]) * WIND[:, 0].numpy(), rtol=1e-12
    )


@pytest.mark.parametrize("downstream", [2.0, 4.0])
def test_far_behind_the_pole_the_loss_integrates_to_the_momentum_thickness(downstream) -> None:
    """∫ (1 − u/U) dy = θ = C_D D/2 in a self-preserving wake. The constants 1.58 and 0.252 give
    0.998 θ, and forming within a diameter takes x/(x + D): 1.5 % at 4 m behind a pole of 60 mm."""
    wake = PoleWake(share=1.0, diameter=0.06, drag=1.1)
    wind = torch.tensor([5.0, 0.0, 0.0], dtype=torch.float64)[:, None]
    across = np.linspace(-3, 3, 6001)
    offset = torch.tensor(np.stack([0 * across + downstream, across, 0 * across], axis=1))[
        ..., None
    ]
    loss = 1 - wake.field(0.0, offset, wind)[:, 0, 0].numpy() / 5
    expected = 1.1 * 0.06 / 2 * downstream / (downstream + 0.06)
    assert loss.sum() * 1e-3 == pytest.approx(expected, rel=5e-3)


def test_the_wake_is_behind_the_pole_whichever_way_the_wind_blows() -> None:
    wake = PoleWake(share=1.0)
    wind = torch.tensor([0.0, -5.0, 1.0], dtype=torch.float64)[:, None]
    places = torch.tensor(
        [[0.0, -1.0, 2.0], [0.0, 1.0, 2.0], [2.0, -1.0, 0.0]], dtype=torch.float64
    )[..., None]
    seen = wake.field(0.0, places, wind)[..., 0]
    assert -5 < float(seen[0, 1]) < -3.5
    torch.testing.assert_close(seen[1:], wind[:, 0].expand(2, 3))
    assert (seen[:, 2] == 1.0).all()
