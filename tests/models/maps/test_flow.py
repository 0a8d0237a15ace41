"""Maps of optical flow of clips whose motion is known, and what the network on them takes."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch
from scipy import ndimage

from flagdata.core.arrays import FloatArray
from flagdata.errors import InputError
from models.maps import flow
from models.maps.flow import CHANNELS, CHANNELS_OF_THREE, flow_maps, lucas_kanade
from models.maps.frontend import FrontEnd, standardise_clip
from models.networks.flow_network import FlowNetwork

SIZE, FRAMES = 112, 30
INNER = (slice(4, -4), slice(4, -4))  # of maps of 28 × 28: windows that do not see beyond the edge


def speckle(size: int, grain: float, *, seed: int = 3) -> FloatArray:
    """(size, size) of standard deviation 1, periodic."""
    noise = ndimage.gaussian_filter(
        np.random.default_rng(seed).standard_normal((size, size)), grain, mode="wrap"
    )
    return (noise - noise.mean()) / noise.std()


def warped(along_x: FloatArray, along_y: FloatArray, *, grain: float = 10.0) -> torch.Tensor:
    """(time, SIZE, SIZE): speckle; what shows at (x, y) has moved there by so many pixels, each
    (time, y, x)."""
    picture = speckle(SIZE, grain)
    y, x = np.mgrid[:SIZE, :SIZE].astype(float)
    frames = [
        ndimage.map_coordinates(picture, [y - down, x - across], order=3, mode="grid-wrap")
        for across, down in zip(along_x, along_y, strict=True)
    ]
    return standardise_clip(torch.from_numpy(np.stack(frames)))


def channel(maps: torch.Tensor, name: str) -> torch.Tensor:
    return maps[CHANNELS.index(name)][INNER]


@pytest.mark.parametrize(("across", "down"), [(0.5, 0.0), (0.0, -0.6), (-0.4, 0.3), (0.0, 0.0)])
def test_a_picture_that_moves_as_a_whole_has_that_displacement(across: float, down: float) -> None:
    picture = 5 * speckle(64, 5.0)  # steep, so that the ridge counts little
    frames = np.stack(
        [
            ndimage.shift(picture, (k * down, k * across), order=3, mode="grid-wrap")
            for k in range(5)
        ]
    )
    found, slope = lucas_kanade(torch.from_numpy(frames))
    assert found.shape == (2, 4, 64, 64)
    assert slope.shape == (4, 64, 64)
    for axis, expected in enumerate((across, down)):
        inner = found[axis][:, 4:-4, 4:-4]
        assert float(inner.median()) == pytest.approx(expected, abs=0.02)
        assert float((inner - expected).abs().quantile(0.9)) < 0.1


def test_windows_apart_are_those_of_all_windows() -> None:
    frames = torch.from_numpy(np.random.default_rng(1).standard_normal((3, 20, 24)))
    every, _ = lucas_kanade(frames)
    second, _ = lucas_kanade(frames, stride=2)
    torch.testing.assert_close(second, every[..., ::2, ::2])


def test_a_ramp_moves_along_its_slope_by_the_ridge_less() -> None:
    """I = s (x − d t): u (s² + r) = s² d, and motion along the lines of equal gray is unknown."""
    slope, step = 0.1, 0.7
    x = torch.arange(40.0, dtype=torch.float64)
    frames = torch.stack([(slope * (x - step * t)).expand(40, 40) for t in range(3)])
    (across, down), seen = lucas_kanade(frames)
    inner = (slice(None), slice(4, -4), slice(4, -4))
    expected = step * slope**2 / (slope**2 + flow.RIDGE)
    torch.testing.assert_close(across[inner], torch.full_like(across[inner], expected))
    torch.testing.assert_close(down[inner], torch.zeros_like(down[inner]), atol=1e-12, rtol=0)
    torch.testing.assert_close(seen[inner], torch.full_like(seen[inner], slope**2))


@pytest.mark.parametrize("bin_", [3, 6])
def test_a_travelling_wave_has_its_frequency_and_its_phase_gradient(bin_: int) -> None:
    """Points that move by a sin(kx − ωt) have a flow with exp(−ikx) at +ω: the phase falls along
    the way it travels, by k times the 4 px from one place to the next; what else moves, by chance,
    draws the mean over frequencies towards 0 by up to a fifth. In 29 steps ω is bin/29 turns a
    step, of a Nyquist frequency of 1/2."""
    wavenumber, turn = 2 * math.pi * 2 / SIZE, 2 * math.pi * bin_ / (FRAMES - 1)
    x, time = np.arange(SIZE), np.arange(FRAMES)[:, None]
    course = 1.5 * np.sin(wavenumber * x - turn * time)
    across = np.broadcast_to(course[:, None], (FRAMES, SIZE, SIZE))
    maps = flow_maps(warped(across, np.zeros_like(across)))
    for scale in ("fine", "coarse"):
        centre = channel(maps, f"{scale}: centre x")
        assert float(centre.median()) == pytest.approx(2 * bin_ / (FRAMES - 1), abs=0.03)
        gradient = channel(maps, f"{scale}: phase gradient along x")
        assert -4 * wavenumber - 0.02 < float(gradient.median()) < -0.8 * 4 * wavenumber
        assert float(channel(maps, f"{scale}: coherence along x").median()) > 0.9
        assert abs(float(channel(maps, f"{scale}: phase gradient along y").median())) < 0.05


def test_powers_are_those_of_the_displacement_in_each_scales_pixels() -> None:
    """A steady 1 px of the clip along y is 1/2 of the fine scale's, 1/4 of the coarse one's: log(1
    + d²/0.02²)."""
    down = np.broadcast_to(np.arange(FRAMES, dtype=float)[:, None, None], (FRAMES, SIZE, SIZE))
    maps = flow_maps(warped(np.zeros_like(down), down, grain=6.0))
    for scale, size in (("fine", 2), ("coarse", 4)):
        assert float(channel(maps, f"{scale}: mean y").median()) == pytest.approx(1 / size, rel=0.1)
        expected = math.log1p(1 / size**2 / 0.02**2)
        assert float(channel(maps, f"{scale}: log power y").median()) == pytest.approx(
            expected, abs=0.2
        )
        assert float(channel(maps, f"{scale}: log power x").median()) < expected - 3
        assert float(channel(maps, f"{scale}: log variance y").median()) < expected - 2


def test_the_two_coarser_of_three_scales_are_those_of_a_clip_of_half_the_size() -> None:
    clip = torch.from_numpy(np.random.default_rng(5).standard_normal((6, 48, 64)))
    three, two = flow_maps(clip, scales=3), flow_maps(torch.nn.functional.avg_pool2d(clip, 2))
    assert three.shape == (len(CHANNELS_OF_THREE), 6, 8)
    assert CHANNELS_OF_THREE[-len(CHANNELS) :] == CHANNELS
    torch.testing.assert_close(three[-len(CHANNELS) :], two)


def test_the_finest_scale_resolves_a_tenth_of_a_pixel_of_the_clip() -> None:
    """A steady 0.1 px of the clip is 0.05 of the finest scale's."""
    across = np.broadcast_to(0.1 * np.arange(FRAMES)[:, None, None], (FRAMES, SIZE, SIZE))
    maps = flow_maps(warped(across, np.zeros_like(across), grain=6.0), scales=3)
    mean = maps[CHANNELS_OF_THREE.index("finest: mean x")][2:-2, 2:-2]
    assert float(mean.median()) == pytest.approx(0.05, rel=0.1)
    power = maps[CHANNELS_OF_THREE.index("finest: log power x")][2:-2, 2:-2]
    assert float(power.median()) == pytest.approx(math.log1p(0.05**2 / 0.02**2), abs=0.2)


def test_the_front_end_gives_three_scales_of_clips_that_can_be_halved_thrice() -> None:
    front_end = FrontEnd(maps="flow-maps-3", size=SIZE)
    assert front_end.shape == (len(CHANNELS_OF_THREE), SIZE // 8, SIZE // 8)
    assert front_end(torch.rand(1, 1, FRAMES, SIZE, SIZE)).shape == (1, *front_end.shape)
    assert front_end.hash != FrontEnd(maps="flow-maps", size=SIZE).hash
    with pytest.raises(InputError, match="100 px") as refused:
        FrontEnd(maps="flow-maps-3", size=100)
    assert "multiple of 8" in str(refused.value.fix)
    assert FrontEnd(maps="flow-maps", size=100).shape[1:] == (25, 25)


def test_the_front_end_gives_them_and_contrast_changes_nothing() -> None:
    front_end = FrontEnd(maps="flow-maps", size=SIZE)
    clip = torch.from_numpy(
        np.random.default_rng(2).integers(0, 255, (1, 1, FRAMES, SIZE, SIZE), dtype=np.uint8)
    )
    found = front_end(clip)
    assert found.shape == (1, *front_end.shape) == (1, len(CHANNELS), SIZE // 4, SIZE // 4)
    torch.testing.assert_close(front_end(40.0 + 7.0 * clip.float()), found, rtol=1e-3, atol=1e-3)
    flat = front_end(torch.full((1, 1, FRAMES, SIZE, SIZE), 128, dtype=torch.uint8))
    assert not flat.any()


def test_channels_that_are_not_known_are_refused_and_known_ones_are_chosen() -> None:
    with pytest.raises(InputError, match="vorticity"):
        FlowNetwork(channels=("vorticity",))
    with pytest.raises(InputError, match="strides"):
        FlowNetwork(widths=(4, 4))
    network = FlowNetwork(dimension=3, widths=(4, 6, 6), channels=CHANNELS[:2]).eval()
    maps = torch.randn(2, len(CHANNELS), 12, 12)
    first = network(maps)
    assert first.shape == (2, 3)
    maps[:, 2:] = 7.0  # what was not chosen is not seen
    assert torch.equal(network(maps), first)
