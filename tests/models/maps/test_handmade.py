"""Hand-made features against motions whose frequency, speed and place are known."""

from __future__ import annotations

import math

import pytest
import torch

from flagdata.errors import InputError
from models.maps.handmade import BAND_EDGES, FEATURES, features

RATE = 25.0
T, SIDE = 30, 112


def grid() -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    return torch.meshgrid(
        torch.arange(T, dtype=torch.float32),
        torch.arange(SIDE, dtype=torch.float32),
        torch.arange(SIDE, dtype=torch.float32),
        indexing="ij",
    )


def measured(clip: torch.Tensor) -> dict[str, float]:
    row = features(clip[None, None], rate=RATE)[0]
    assert row.shape == (len(FEATURES),)
    return dict(zip(FEATURES, row.tolist(), strict=True))


def wave(*, cycles: int, wavelength: float, along: str = "x") -> torch.Tensor:
    t, y, x = grid()
    position = x if along == "x" else y
    return torch.sin(2 * math.pi * (position / wavelength - cycles * t / T))


def speckle(seed: int, *shape: int) -> torch.Tensor:
    return torch.randn(*shape, generator=torch.Generator().manual_seed(seed))


def test_names_are_unique_and_fit_a_page() -> None:
    assert 40 <= len(FEATURES) == len(set(FEATURES)) <= 60


@pytest.mark.parametrize("cycles", [2, 6, 11])
@pytest.mark.parametrize("along", ["x", "y"])
def test_a_travelling_wave_has_its_own_frequency_wavenumber_and_speed(
    cycles: int, along: str
) -> None:
    """f = c/λ. A wave travels coherently: neighbours differ by the phase 2π/λ, and ∂I/∂t = c ∂I/∂x everywhere.

    Differences over Δ multiply a wave by sinc(…): of the change over one frame by sin(πf/r)/(πf/r),
    of the slope over two pixels by sin(2π/λ)/(2π/λ); the ratio's error is what these two leave.
    """
    wavelength = 16.0
    found = measured(wave(cycles=cycles, wavelength=wavelength, along=along))
    frequency = cycles * RATE / T
    assert found["dominant_frequency_change"] == pytest.approx(frequency, rel=1e-6)
    assert found[f"dominant_frequency_slope_{along}"] == pytest.approx(frequency, rel=1e-6)
    assert found["local_frequency_mean"] == pytest.approx(frequency, rel=1e-3)
    assert found[f"coherence_{along}"] == pytest.approx(1, abs=1e-3)
    assert found[f"wavenumber_{along}"] == pytest.approx(2 * math.pi / wavelength, rel=1e-3)
    bias = math.sin(math.pi * frequency / RATE) / (math.pi * frequency / RATE)
    bias /= math.sin(2 * math.pi / wavelength) / (2 * math.pi / wavelength)
    speed = frequency * wavelength / SIDE * bias
    assert found["log_normal_flow_rms"] == pytest.approx(math.log10(speed), abs=0.01)


def test_a_standing_wave_has_no_wavenumber() -> None:
    t, _, x = grid()
    found = measured(torch.sin(2 * math.pi * x / 28) * torch.sin(2 * math.pi * 5 * t / T))
    assert found["wavenumber_x"] < 1e-3


def test_the_image_moved_as_a_whole_has_the_flow_of_its_translation() -> None:
    """A smooth texture moved by 0.5 px a frame to the right: 12.5 px/s, over the side of 112; none
    downward."""
    t, y, x = grid()
    moved = x - 0.5 * t
    clip = torch.sin(2 * math.pi * moved / 40) + torch.cos(2 * math.pi * (y / 37 + moved / 53))
    found = measured(clip)
    assert 10 ** found["log_flow_x"] == pytest.approx(12.5 / SIDE, rel=0.03)
    assert 10 ** found["log_flow_y"] < 0.03 * 12.5 / SIDE
    assert found["flow_unsteadiness"] < 0.05


def test_band_powers_add_up_to_the_variance_of_the_slope() -> None:
    """Parseval: of a stationary slope, all frequencies but the mean. Waves: the bands hold all of
    a²/2."""
    clip = wave(cycles=4, wavelength=16.0)
    found = measured(clip)
    total = sum(10 ** found[name] for name in FEATURES if name.startswith("log_power_slope_x"))
    slope = 2 * 0.5 * math.sin(2 * math.pi / 16) ** 2
    assert total == pytest.approx(slope, rel=0.01)


@pytest.mark.parametrize(("low", "high", "cycles"), [(1.25, 2.1, 2), (5.0, 7.5, 8)])
def test_power_lies_in_the_band_of_its_frequency(low: float, high: float, cycles: int) -> None:
    """A Hann window spreads a line over three bins, of which the middle one has 2/3 of the
    power."""
    found = measured(wave(cycles=cycles, wavelength=16.0))
    bands = {
        name: 10**value for name, value in found.items() if name.startswith("log_power_slope_x")
    }
    assert max(bands, key=lambda name: bands[name]) == f"log_power_slope_x_{low:g}_{high:g}hz"
    assert low < cycles * RATE / T < high


def test_coverage_and_place_are_those_of_what_flickers() -> None:
    """A fifth of the width, from 0.7 to 0.9, flickers: coverage 0.2, centre 0.3 right of the
    middle."""
    t, y, x = grid()
    texture = speckle(1, SIDE, SIDE)
    where = (x >= 0.7 * SIDE) & (x < 0.9 * SIDE)
    found = measured(torch.where(where, 3 * torch.sin(2 * math.pi * 5 * t / T + y), texture))
    assert found["coverage_0.3"] == pytest.approx(0.2, abs=0.02)
    assert found["motion_x"] == pytest.approx(0.3, abs=0.01)
    assert found["motion_y"] == pytest.approx(0, abs=0.01)
    assert found["motion_width"] == pytest.approx(0.2 / 12**0.5, abs=0.01)
    assert found["motion_height"] == pytest.approx(1 / 12**0.5, abs=0.01)
    assert found["motion_concentration"] == pytest.approx(0.2, abs=0.02)


def test_a_mirrored_clip_has_the_same_features() -> None:
    """Tolerance: sums in another order, in float32."""
    clip = speckle(2, T, SIDE, SIDE) + 2 * wave(cycles=5, wavelength=20.0)
    clip[:, :, :40] *= 0.3
    torch.testing.assert_close(
        features(clip[None, None], rate=RATE),
        features(clip.flip(2)[None, None], rate=RATE),
        rtol=1e-3,
        atol=1e-4,
    )


def test_brightness_and_contrast_change_nothing() -> None:
    clip = speckle(3, 1, 1, T, 32, 40)
    torch.testing.assert_close(
        features(clip, rate=RATE), features(40 * clip + 120, rate=RATE), rtol=1e-3, atol=1e-3
    )


def test_a_clip_does_not_depend_on_its_batch() -> None:
    clips = speckle(4, 3, 1, T, 32, 32)
    assert torch.equal(features(clips, rate=RATE)[1:2], features(clips[1:2], rate=RATE))


def test_a_clip_of_twice_the_size_has_nearly_the_features_of_its_average() -> None:
    """Each pixel doubled: the average over blocks gives the small clip back, so all features are
    equal."""
    clip = speckle(5, 1, 1, T, SIDE, SIDE)
    large = clip.repeat_interleave(2, dim=3).repeat_interleave(2, dim=4)
    torch.testing.assert_close(
        features(large, rate=RATE), features(clip, rate=RATE), rtol=1e-4, atol=1e-5
    )


def test_still_clips_have_finite_features_and_no_motion() -> None:
    found = measured(speckle(6, SIDE, SIDE).expand(T, -1, -1))
    assert all(math.isfinite(value) for value in found.values())
    assert found["coverage_0.1"] == 0
    assert found["log_share_moving"] == pytest.approx(-6, abs=1e-3)


@pytest.mark.parametrize("frames", [10, 21, 50])
def test_clips_of_other_lengths_have_finite_features(frames: int) -> None:
    assert bool(torch.isfinite(features(speckle(7, 2, 1, frames, 48, 64), rate=RATE)).all())


def test_unfit_clips_are_errors() -> None:
    clip = speckle(8, 1, 1, T, 32, 32)
    with pytest.raises(InputError, match="at least 8 frames"):
        features(clip[:, :, :7], rate=RATE)
    with pytest.raises(InputError, match=f"do not resolve {BAND_EDGES[-1]:g} Hz"):
        features(clip, rate=24.0)
    with pytest.raises(InputError, match="need contrast"):
        features(torch.full((1, 1, T, 32, 32), 7.0), rate=RATE)
    clip[0, 0, 3, 4, 5] = torch.nan
    with pytest.raises(InputError, match="finite numbers"):
        features(clip, rate=RATE)
