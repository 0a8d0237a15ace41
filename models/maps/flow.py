"""Maps of optical flow: how fast and in which rhythm the picture moves at each place, whatever it
shows.

The power of a derivative's spectrum (`models.maps.frontend`) mixes how a flag moves with what is
printed on it. Optical flow
is the motion alone: from each frame to the next, the displacement that explains a small window's
change best in the least-squares sense (Lucas and Kanade 1981, equation 9), on two scales or three,
since a window of a fine picture does not follow fast motion and one of a coarse picture blurs slow
motion. Of the displacements' course in time each place keeps its statistics.
"""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn import functional

from models.maps.pixel_course import (
    at_rest,
    band_powers,
    centre_and_width,
    fourier_rows,
    log_power,
    shares_of_nyquist,
)

BANDS = ((0.0, 0.1), (0.1, 0.2), (0.2, 0.32), (0.32, 0.52), (0.52, 1.0))
"""Parts of the flow's spectrum up to the Nyquist frequency, each of which takes the bins in (low,
high]."""
_OF_SCALE = (
    "mean x",
    "mean y",
    "log power x",
    "log power y",
    "log variance x",
    "log variance y",
    "log power of change x",
    "log power of change y",
    "correlation of x and y",
    "centre x",
    "centre y",
    "width x",
    "width y",
    *(f"band {low:g}-{high:g} log power {axis}" for low, high in BANDS for axis in "xy"),
    "phase gradient along x",
    "coherence along x",
    "phase gradient along y",
    "coherence along y",
    "log slope",
)
_SCALES = ("finest", "fine", "coarse")


def channels(scales: int) -> tuple[str, ...]:
    """Names the maps on so many scales, in order.

    Flow is in pixels of its scale a frame: the first scale is half the clip's size, the next half
    of that. Powers P are log(1 + P/0.02²), centres and widths of spectra shares of the Nyquist
    frequency, phase gradients radians a place.

    Args:
        scales: 2 or 3.
    """
    names = tuple(f"{scale}: {name}" for scale in _SCALES[-scales:] for name in _OF_SCALE)
    return (*names, "mean picture", "log of its slope", "log standard deviation in time")


CHANNELS = channels(2)
"""Of clips of 112 px."""
CHANNELS_OF_THREE = channels(3)
"""Of clips of 224 px, on whose two coarser scales the maps are those of `CHANNELS`."""
WINDOW = 5
"""Height and width [px] of the windows whose motion is estimated; they overlap."""
RIDGE = 1e-3
"""Square slope [(standard deviations of the clip / px)²] that is added to each direction's: where
less is to be seen than that, the flow falls to 0 instead of following the camera's noise."""
FASTEST = 8.0
"""Largest displacement [px a frame] that is estimated; a window of 5 px does not follow half of
it."""
_FLOOR = 0.02**2  # square flow [px²] up to which the scale of powers is linear
_SHARE = 1e-4  # that keeps quotients of nothing by nothing finite
_TINY = 1e-6


def pool(scales: int) -> int:
    """Returns by what the maps are smaller than the clip, in height and in width."""
    return 2**scales


def flow_maps(frames: Tensor, *, scales: int = 2) -> Tensor:
    """Computes the maps `channels(scales)` of a clip: (59 or 87, height/pool, width/pool) float32,
    pool as `pool(scales)`.

    Args:
        frames: (time, height, width) floating, standardised: of mean 0 and standard deviation 1;
            time at least 4, height and width multiples of the pool and at least three times as
            large.
        scales: 2 or 3.
    """
    maps: list[Tensor] = []
    for remaining in reversed(range(scales)):
        frames = functional.avg_pool2d(frames, 2)
        maps.append(_statistics(*lucas_kanade(frames, stride=2**remaining)))
    return torch.cat([*maps, at_rest(frames)])


def lucas_kanade(frames: Tensor, *, stride: int = 1) -> tuple[Tensor, Tensor]:
    """Estimates the displacement [px] of each window from each frame to the next, (2, time − 1, h,
    w) along x and y, and the mean square slope in it, (time − 1, h, w).

    The displacement (u, v) is the least-squares solution of u ∂I/∂x + v ∂I/∂y = −∂I/∂t over a
    window of 5 × 5 pixels, with the ridge `RIDGE`. Slopes are central differences of the mean of
    both frames.

    Args:
        frames: (time, height, width), floating; the windows' centres are `stride` pixels apart.
    """
    middle, change = (frames[:-1] + frames[1:]) / 2, frames[1:] - frames[:-1]
    padded = functional.pad(middle, (1, 1, 1, 1), mode="replicate")
    across = (padded[:, 1:-1, 2:] - padded[:, 1:-1, :-2]) / 2
    down = (padded[:, 2:, 1:-1] - padded[:, :-2, 1:-1]) / 2
    products = torch.stack(
        [across * across, down * down, across * down, across * change, down * change]
    )
    xx, yy, xy, xt, yt = functional.avg_pool2d(
        products, WINDOW, stride=stride, padding=WINDOW // 2, count_include_pad=False
    )
    slope = xx + yy
    xx, yy = xx + RIDGE, yy + RIDGE
    determinant = xx * yy - xy.square()
    flow = torch.stack([xy * yt - yy * xt, xy * xt - xx * yt]) / determinant
    return flow.clamp(-FASTEST, FASTEST), slope


def _statistics(flow: Tensor, slope: Tensor) -> Tensor:
    """Computes (28, h, w) statistics, as `_OF_SCALE` names them, of the course in time of a flow
    (2, time, h, w)."""
    mean, power = flow.mean(dim=1), flow.square().mean(dim=1)
    variance = (power - mean.square()).clamp(min=0)
    change = (flow[:, 1:] - flow[:, :-1]).square().mean(dim=1)
    product = (flow[0] * flow[1]).mean(dim=0) - mean[0] * mean[1]
    correlation = product / (variance.prod(dim=0).sqrt() + _SHARE)
    rows = fourier_rows(flow.shape[1]).to(flow)
    spectrum = torch.stack([(part @ flow.flatten(2)).unflatten(2, flow.shape[2:]) for part in rows])
    logs = [log_power(moment, floor=_FLOOR) for moment in (power, variance, change)]
    maps = [mean, *logs, correlation[None]]
    maps += [_shape(spectrum, steps=flow.shape[1]), _phases(spectrum)]
    return torch.cat([*maps, (slope.mean(dim=0, keepdim=True) / RIDGE).log1p()])


def _shape(spectrum: Tensor, *, steps: int) -> Tensor:
    """Computes (14, h, w): centre and width of both components' spectra of so many steps, then the
    log power of each band."""
    power = spectrum.square().sum(dim=0)  # (2, bin, h, w)
    share = shares_of_nyquist(power, steps=steps)
    bands = (log_power(band, floor=_FLOOR) for band in band_powers(power, share, BANDS))
    return torch.cat([*centre_and_width(power, share, floor=_TINY), *bands])


def _phases(spectrum: Tensor) -> Tensor:
    """Computes (4, h, w): phase gradient [rad a place] along x, averaged over frequencies by their
    cross power, and coherence; then along y. The last column, or row, has no neighbour and is 0."""
    maps = []
    for axis, pad in ((-1, (0, 1)), (-2, (0, 0, 0, 1))):
        length = spectrum.shape[axis] - 1
        ahead, behind = spectrum.narrow(axis, 1, length), spectrum.narrow(axis, 0, length)
        real = (ahead * behind).sum(dim=(0, 1))  # (bin, h, w), both components together
        imaginary = (ahead[1] * behind[0] - ahead[0] * behind[1]).sum(dim=0)
        cross = (real.square() + imaginary.square()).sqrt()
        total = cross.sum(dim=0)
        gradient = (torch.atan2(imaginary, real) * cross).sum(dim=0) / (total + _TINY)
        power = ahead.square().sum(dim=(0, 1, 2)) * behind.square().sum(dim=(0, 1, 2))
        maps.append(functional.pad(torch.stack([gradient, total / (power.sqrt() + _TINY)]), pad))
    return torch.cat(maps)
