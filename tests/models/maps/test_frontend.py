"""The front end against its plain definition: SciPy's filters, torch's pooling, the periodogram
layer, closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch
from scipy import ndimage
from torch.nn import functional

from flagdata.errors import InputError
from models.maps.frontend import (
    WAVE_CHANNELS,
    FrontEnd,
    gaussian,
    pooled_derivatives,
    smoothing_matrix,
    standardise_clip,
)
from models.maps.spectral_layer import SpectralDecomposition, periodogram
from tests.refusals import unrefused

SIZE, FRAMES, RATE = 48, 30, 25.0


def noise(
    seed: int = 0, *, frames: int = FRAMES, height: int = SIZE, width: int = SIZE
) -> torch.Tensor:
    generator = torch.Generator().manual_seed(seed)
    return torch.randn((frames, height, width), generator=generator)


def wave(frequency: float, across: float, down: float) -> torch.Tensor:
    """(1, 1, time, height, width): cos(across x + down y − 2π f t), x and y in pixels."""
    t = torch.arange(FRAMES)[:, None, None] / RATE
    y, x = torch.meshgrid(torch.arange(SIZE), torch.arange(SIZE), indexing="ij")
    return torch.cos(across * x + down * y - 2 * math.pi * frequency * t)[None, None]


def plain(frames: torch.Tensor) -> torch.Tensor:
    """(1, 2, time, height/2, width/2): the paper's filters and pooling by SciPy and torch."""
    video = ndimage.gaussian_filter1d(frames.double().numpy(), 1.0, axis=0, mode="nearest")
    slopes = []
    for along, across in ((2, 1), (1, 2)):
        slope = ndimage.gaussian_filter1d(video, 2.0, axis=along, order=1, mode="nearest")
        slopes.append(ndimage.gaussian_filter1d(slope, 2.0, axis=across, mode="nearest"))
    return functional.max_pool2d(torch.from_numpy(np.stack(slopes)), 2)[None]


@pytest.mark.parametrize(("frames", "height", "width"), [(5, 48, 48), (7, 34, 70), (1, 20, 224)])
def test_pooled_derivatives_are_scipys(frames: int, height: int, width: int) -> None:
    video = noise(frames=frames, height=height, width=width)
    for found, (along, across) in zip(
        pooled_derivatives(video, sigma=2.0), ((2, 1), (1, 2)), strict=True
    ):
        slope = ndimage.gaussian_filter1d(
            video.double().numpy(), 2.0, axis=along, order=1, mode="nearest"
        )
        slope = ndimage.gaussian_filter1d(slope, 2.0, axis=across, mode="nearest")
        expected = functional.max_pool2d(torch.from_numpy(slope), 2)
        np.testing.assert_allclose(found.numpy(), expected, atol=1e-6)


def test_a_ramp_has_its_slope_but_for_the_tails_that_are_cut_off() -> None:
    ramp = 3.0 * torch.arange(64, dtype=torch.float64).repeat(2, 40, 1)
    along_x, along_y = pooled_derivatives(ramp, sigma=2.0)
    assert (
        along_x[:, :, 10:20].sub(3.0).abs().max() < 3.0 * 2e-3
    )  # ∫ beyond 4σ of i² g(i)/σ² is 1.1e-3
    assert along_y.abs().max() < 1e-12


def test_gradients_of_the_filters_are_right() -> None:
    frames = noise(frames=2, height=10, width=12).double().requires_grad_()
    assert torch.autograd.gradcheck(lambda x: pooled_derivatives(x, sigma=1.0), (frames,))


def test_frames_that_cannot_be_pooled_are_refused() -> None:
    cases = [(30, 33, 48), (30, 48, 33), (1, 30, 48, 48)]
    assert (
        unrefused(
            lambda shape: pooled_derivatives(torch.zeros(shape), sigma=2.0),
            zip(cases),
            InputError,
            "even height and width",
        )
        == []
    )


def test_smoothing_in_time_is_scipys() -> None:
    signal = noise(frames=30, height=1, width=4)[:, 0].double()
    expected = ndimage.gaussian_filter1d(signal.numpy(), 1.0, axis=0, mode="nearest")
    np.testing.assert_allclose(smoothing_matrix(30, 1.0) @ signal, expected, atol=1e-12)


def test_spectral_maps_are_the_plain_definition() -> None:
    clip = noise(1)
    found = FrontEnd(maps="spectral-maps", size=SIZE, rate=RATE)(clip[None, None])[0]
    expected = SpectralDecomposition(rate=RATE)(plain(standardise_clip(clip)))[0].float()
    torch.testing.assert_close(found[:2], expected[:2], rtol=1e-4, atol=1e-6)
    same = (found[2:] - expected[2:]).abs() < 1e-4
    assert same.float().mean() > 0.999  # two bins may tie to rounding


def test_wave_maps_are_made_of_the_plain_definitions_periodogram() -> None:
    clip = noise(2)
    maps = FrontEnd(maps="wave-maps", size=SIZE, rate=RATE)(clip[None, None])[0]
    power, frequency = periodogram(plain(standardise_clip(clip)), rate=RATE)
    power = functional.avg_pool3d(power[0].float(), (1, 2, 2))  # (2, bin, h, w)
    total = power.sum(dim=1)
    share = (frequency / (RATE / 2)).float()[:, None, None]
    centre = (power * share).sum(dim=1) / total
    for place, axis in enumerate("xy"):
        own = maps[
            [
                WAVE_CHANNELS.index(f"d/d{axis}: {name}")
                for name in ("log power", "centre", "peak 1 frequency")
            ]
        ]
        torch.testing.assert_close(own[0], (total[place] / 1e-3).log1p(), rtol=1e-3, atol=1e-4)
        torch.testing.assert_close(own[1], centre[place], rtol=1e-3, atol=1e-4)
        expected = share.flatten()[power[place].argmax(dim=0)]
        assert (own[2] == expected).float().mean() > 0.999


@pytest.mark.parametrize(
    ("across", "down", "bin_"), [(0.3, 0.0, 3), (-0.2, 0.1, 6), (0.0, -0.25, 4)]
)
def test_a_travelling_wave_has_its_frequency_and_its_phase_gradient(
    across: float, down: float, bin_: int
) -> None:
    """cos(k·x − ωt) has exp(−i k·x)/2 at +ω, so the phase falls along the way it travels: −2k a
    pooled pixel."""
    maps = FrontEnd(maps="wave-maps", size=SIZE, rate=RATE)(
        wave(bin_ * RATE / FRAMES, across, down)
    )[0]
    inner = (
        slice(3, -3),
        slice(3, -3),
    )  # the filters see the picture's edge within 8 px, 2 of the maps'
    for axis, other in (("x", across), ("y", down)):
        if other == 0:
            continue
        prefix = f"d/d{axis}: "
        peak = maps[WAVE_CHANNELS.index(prefix + "peak 1 frequency")][inner]
        assert torch.allclose(peak, torch.tensor(bin_ / (FRAMES / 2)))
        for name, slope in (("phase gradient x", across), ("phase gradient y", down)):
            found = maps[WAVE_CHANNELS.index(prefix + name)][inner]
            assert torch.allclose(found, torch.tensor(-2 * slope / math.pi), atol=0.01), name
        assert maps[WAVE_CHANNELS.index(prefix + "coherence x")][inner].min() > 0.99


def test_brightness_and_contrast_change_nothing() -> None:
    clip = noise(3)[None, None]
    for maps in ("spectral-maps", "wave-maps", "flow-maps", "flow-maps-3"):
        front_end = FrontEnd(maps=maps, size=SIZE)
        torch.testing.assert_close(
            front_end(40.0 + 7.0 * clip), front_end(clip), rtol=1e-3, atol=1e-4
        )


def test_a_clip_without_contrast_is_still_finite() -> None:
    flat = torch.full((1, 1, FRAMES, SIZE, SIZE), 128, dtype=torch.uint8)
    for maps in ("frames", "spectral-maps", "wave-maps", "flow-maps", "flow-maps-3"):
        assert FrontEnd(maps=maps, size=SIZE)(flat).isfinite().all()


def test_front_ends_are_distinguished_by_all_that_shapes_them() -> None:
    ends = [
        FrontEnd(maps="wave-maps"),
        FrontEnd(maps="spectral-maps"),
        FrontEnd(maps="wave-maps", size=112),
        FrontEnd(maps="wave-maps", rate=30.0),
        FrontEnd(maps="wave-maps", temporal_sigma=1.5),
    ]
    assert len({end.hash for end in ends}) == len(ends)
    assert FrontEnd(maps="wave-maps").hash == ends[0].hash


@pytest.mark.parametrize(
    "values", [{"frames": 3}, {"size": 50}, {"rate": 0.0}, {"spatial_sigma": -1.0}]
)
def test_front_ends_that_cannot_be_are_refused(values: dict[str, float]) -> None:
    with pytest.raises(InputError):
        FrontEnd(maps="wave-maps", **values)  # pyright: ignore[reportArgumentType]


def test_clips_of_another_size_are_refused_with_the_size_that_is_wanted() -> None:
    with pytest.raises(InputError, match=r"\(1, 20, 48, 48\)"):
        FrontEnd(maps="wave-maps", size=SIZE)(noise(frames=20)[None, None])


def test_a_gaussian_that_has_no_width_is_refused() -> None:
    with pytest.raises(InputError):
        gaussian(0.0)
