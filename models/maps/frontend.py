"""From a clip's pixels to maps of what moves: Gaussian in time, derivatives in space, half the
size, a spectrum a pixel.

Runia et al. 2020, section 4.3: a Gaussian of σ = 1 frame, first Gaussian derivatives of σ = 2 px
along x and y, maximum pooling by two, the spectral decomposition layer. All but the pooling is
linear, so that the filters are products with banded matrices (below) and the spectrum is one
product with a matrix of (mean removal, Hann window, discrete Fourier transform).
`models.maps.spectral_layer.periodogram` is the definition that tests hold this to.

From the same spectra come two kinds of maps, and a third of the clip's optical flow:

- *spectral maps* (4, H/2, W/2), what the paper's network takes: the largest power of each
  derivative, then its frequency;
- *wave maps* (`WAVE_CHANNELS`, H/4, W/4), what `models.networks.wave` takes: two peaks, power by
  band, the spectrum's centre and width, the gradient of the phase at the strongest frequency with
  its coherence (a travelling wave's wave number), and what the clip looks like at rest;
- *flow maps* (`models.maps.flow.channels`; on two scales H/4, W/4, on three H/8, W/8), what
  `models.networks.flow_network` takes.

Gaussian filters and their first derivatives along the axes of a video, as products with banded
matrices.

A filter of 17 taps along an axis of 224 samples is a banded 224 × 224 matrix. Cut into blocks of 32
outputs, each of which sees 48 inputs, it becomes a batch of small dense products: 0.3 billion
multiply-adds a clip of 30 × 224 × 224 for both derivatives, at the speed of the matrix product,
with no copies of the clip shifted by a sample. A few frames are taken at a time, so that what lies
between the products stays in the processor's cache.
"""

from __future__ import annotations

import functools
import math
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Literal, TypeAlias

import torch
from torch import Tensor
from torch.nn import functional

from flagdata.core.provenance import canonical, digest
from flagdata.errors import InputError, LimitError
from models.maps import flow
from models.maps.handmade import FEATURES, features
from models.maps.pixel_course import (
    at_rest,
    band_powers,
    centre_and_width,
    fourier_rows,
    log_power,
    shares_of_nyquist,
)

_BLOCK = 32
_FRAMES = 5  # at a time: 1 MB of 224 × 224 px each, of which a core's cache holds two
_TRUNCATE = 4.0  # standard deviations, as scipy.ndimage.gaussian_filter1d does


def gaussian(sigma: float, *, order: int = 0) -> Tensor:
    """Computes taps (2r + 1,) of a Gaussian, r = round(4σ), or of its first derivative, for
    correlation: Σ h[i] x[n + i − r].

    The Gaussian's taps sum to 1. The derivative's are those of the same, normalised Gaussian: i/σ²
    times its taps, so that a ramp of slope 1 gives Σ i² g(i)/σ², 1 but for what is cut off.

    Args:
        sigma: standard deviation [samples].
        order: 0 or 1.

    Raises:
        InputError: σ that is not above 0, or another order.
    """
    if not sigma > 0 or order not in (0, 1):
        raise InputError(
            f"the Gaussian has σ = {sigma:g} and order {order}",
            fix="give σ above 0 and order 0 or 1",
        )
    radius = int(_TRUNCATE * sigma + 0.5)
    offset = torch.arange(-radius, radius + 1, dtype=torch.float64)
    taps = torch.exp(-(offset**2) / (2 * sigma**2))
    taps = taps / taps.sum()
    return taps if order == 0 else taps * offset / sigma**2


def smoothing_matrix(count: int, sigma: float) -> Tensor:
    """Builds the matrix (count, count) float64 of the Gaussian along an axis of `count` samples,
    its ends repeated outwards. the Gaussian along an axis of `count` samples, its ends repeated
    outwards."""
    taps = gaussian(sigma)
    radius = len(taps) // 2
    matrix = torch.zeros((count, count), dtype=torch.float64)
    for row in range(count):
        places = (torch.arange(row - radius, row + radius + 1)).clamp(0, count - 1)
        matrix[row].index_add_(0, places, taps)
    return matrix


def pooled_derivatives(frames: Tensor, *, sigma: float) -> Tensor:
    """Filters by first derivatives of a Gaussian along x (the last axis) and along y, each pooled:
    (2, time, height/2, width/2).

    Each derivative is smoothed by the Gaussian along the other axis. Beyond the edges the outermost
    samples are repeated. Of each two by two samples of the derivative the largest is taken.

    Args:
        frames: (time, height, width), floating; an even height and width.
        sigma: standard deviation [samples].

    Raises:
        InputError: another shape or type.
    """
    if (
        frames.ndim != 3
        or not frames.is_floating_point()
        or frames.shape[1] % 2
        or frames.shape[2] % 2
    ):
        raise InputError(
            f"the frames have the shape {tuple(frames.shape)} and the type {frames.dtype}",
            fix="give floating (time, height, width) with an even height and width",
        )
    smooth, slope = (
        _band(sigma, order).to(device=frames.device, dtype=frames.dtype) for order in (0, 1)
    )
    count, height, width = frames.shape
    pooled = frames.new_empty((2, count, height // 2, width // 2))
    for first in range(0, count, _FRAMES):
        part = slice(first, first + _FRAMES)
        smoothed, sloped = _along_height(frames[part], smooth, slope)
        pooled[0, part] = _pooled_along_width(smoothed, slope)[:, : height // 2, : width // 2]
        pooled[1, part] = _pooled_along_width(sloped, smooth)[:, : height // 2, : width // 2]
    return pooled


@functools.cache
def _band(sigma: float, order: int) -> Tensor:
    """Builds the part of the filter's matrix that one block of outputs sees, (block + taps − 1,
    block). the part of the filter's matrix that one block of outputs sees."""
    taps = gaussian(sigma, order=order)
    band = torch.zeros((_BLOCK + len(taps) - 1, _BLOCK), dtype=torch.float64)
    for column in range(_BLOCK):
        band[column : column + len(taps), column] = taps
    return band


def _along_height(frames: Tensor, *bands: Tensor) -> Tensor:
    """Filters along the second axis of (time, height, width): (bands, time, blocks · 32, padded
    width).

    The outermost samples are repeated on all sides, as often as the filters see beyond the edge and
    as the last block has rows and columns too many.
    """
    reach = len(bands[0])
    radius = (reach - _BLOCK) // 2
    below, right = (-size % _BLOCK for size in frames.shape[1:])
    padded = functional.pad(
        frames, (radius, radius + right, radius, radius + below), mode="replicate"
    )
    rows = torch.cat(bands, dim=1).T  # (bands · 32, reach): one product for all filters
    filtered = padded.new_empty((len(bands), len(frames), frames.shape[1] + below, padded.shape[2]))
    for first in range(0, filtered.shape[2], _BLOCK):
        product = torch.matmul(rows, padded[:, first : first + reach]).unflatten(
            1, (len(bands), _BLOCK)
        )
        filtered[:, :, first : first + _BLOCK] = product.transpose(0, 1)
    return filtered


def _pooled_along_width(padded: Tensor, band: Tensor) -> Tensor:
    """Filters along the last axis of contiguous (time, height, blocks · 32 + taps − 1) and takes
    the largest of each
    two by two: (time, height/2, blocks · 16)."""
    time, height, width = padded.shape
    blocks = (width - len(band)) // _BLOCK + 1
    view = padded.as_strided((blocks, time * height, len(band)), (_BLOCK, width, 1))
    filtered = torch.bmm(view, band.expand(blocks, -1, -1)).view(
        blocks, time, height // 2, 2, _BLOCK
    )
    rows = torch.maximum(filtered[:, :, :, 0], filtered[:, :, :, 1])
    return torch.maximum(rows[..., 0::2], rows[..., 1::2]).permute(1, 2, 0, 3).flatten(2)


Maps: TypeAlias = Literal[
    "frames", "spectral-maps", "wave-maps", "flow-maps", "flow-maps-3", "handmade"
]
"""What a front end gives: standardised frames, one of the kinds of maps, or the page of hand-made
features."""
_FLOW_SCALES = {"flow-maps": 2, "flow-maps-3": 3}

BANDS = ((0.0, 0.08), (0.08, 0.16), (0.16, 0.32), (0.32, 0.52), (0.52, 1.0))
"""Parts of the spectrum up to the Nyquist frequency whose power is a wave map; each takes the bins
in (low, high]."""
_OF_EACH = (
    "peak 1 log power",
    "peak 2 log power",
    "peak 1 frequency",
    "peak 2 frequency",
    "log power",
    "centre",
    "width",
    *(f"band {low:g}-{high:g} log power" for low, high in BANDS),
    "phase gradient x",
    "phase gradient y",
    "coherence x",
    "coherence y",
)
WAVE_CHANNELS = (
    *(f"d/d{axis}: {name}" for axis in "xy" for name in _OF_EACH),
    "mean picture",
    "log of its slope",
    "log standard deviation in time",
)
"""Names of the wave maps, in order. Frequencies are shares of the Nyquist frequency, phase
gradients shares of π a pixel of the pooled picture; powers are log(1 + I/10⁻³), I as in
`periodogram`
of standardised frames: logarithmic where something moves, near 0 where there is but noise."""
FRAMES_LIMIT = 4096
"""Most frames of a clip."""
PIXELS_LIMIT = 1 << 26
"""Most pixels of a clip, all frames together: 256 MiB in float32."""
RATE_LIMIT = 1e6
"""Highest frame rate [Hz]."""
_TINY = 1e-12
# power below which the scale is linear; edges that move have 10⁻² to 10, camera noise 10⁻⁴
_FLOOR = 1e-3
_VERSION = 1
"""Raised whenever the same clip gives other maps."""


@dataclass(frozen=True, kw_only=True)
class FrontEnd:
    """The filters and what is taken from the spectra.

    Attributes:
        maps: what it gives.
        size: height and width of the clips it takes [px]; a whole multiple of 4, of 8 for flow on
            three scales.
        frames: their length.
        rate: their frames a second [Hz].
        temporal_sigma: of the Gaussian in time [frames].
        spatial_sigma: of the derivatives [px].

    Raises:
        InputError: fewer than four frames, a size that is no multiple of 4, a rate or width that is
            not above 0, or a Gaussian wider than what it smooths.
        LimitError: clips larger than `FRAMES_LIMIT` and `PIXELS_LIMIT`.
    """

    maps: Maps
    size: int = 224
    frames: int = 30
    rate: float = 25.0
    temporal_sigma: float = 1.0
    spatial_sigma: float = 2.0

    def __post_init__(self) -> None:
        least = flow.pool(_FLOW_SCALES.get(self.maps, 2))
        if self.frames < 4 or self.size < least or self.size % least:
            raise InputError(
                f"the front end takes {self.frames} frames of {self.size} px",
                fix=f"give 4 frames or more, and a multiple of {least} px",
            )
        if self.frames > FRAMES_LIMIT or self.frames * self.size**2 > PIXELS_LIMIT:
            raise LimitError(
                f"the front end takes clips of {self.frames:.3g} frames of {self.size:.3g} px",
                fix=f"give at most {FRAMES_LIMIT} frames, and {PIXELS_LIMIT} px in all of them "
                "together",
            )
        within = (
            self.rate <= RATE_LIMIT,
            self.temporal_sigma <= self.frames,
            self.spatial_sigma <= self.size,
        )
        if not (min(self.rate, self.temporal_sigma, self.spatial_sigma) > 0 and all(within)):
            raise InputError(
                f"the rate is {self.rate:g} Hz, σ is {self.temporal_sigma:g} frames and "
                f"{self.spatial_sigma:g} px",
                fix=f"give values above 0: at most {RATE_LIMIT:g} Hz, {self.frames} frames and "
                f"{self.size} px",
            )

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of what is given for one clip."""
        if self.maps == "frames":
            return (1, self.frames, self.size, self.size)
        if self.maps == "spectral-maps":
            return (4, self.size // 2, self.size // 2)
        if self.maps == "handmade":
            return (len(FEATURES),)
        scales = _FLOW_SCALES.get(self.maps)
        if scales is None:
            return (len(WAVE_CHANNELS), self.size // 4, self.size // 4)
        return (
            len(flow.channels(scales)),
            self.size // flow.pool(scales),
            self.size // flow.pool(scales),
        )

    @property
    def hash(self) -> str:
        """Names the front end; two with the same hash give the same maps."""
        return digest(canonical({"version": _VERSION, **asdict(self)}))[:16]

    def __call__(self, clips: Tensor) -> Tensor:
        """Maps of clips, float32: (batch, *shape).

        Each clip is standardised first: less its mean, over its standard deviation.

        Args:
            clips: (batch, 1, time, height, width), uint8 or floating.

        Raises:
            InputError: clips of another shape.
        """
        expected = (1, self.frames, self.size, self.size)
        if clips.ndim != 5 or tuple(clips.shape[1:]) != expected:
            raise InputError(
                f"the clips have the shape {tuple(clips.shape[1:])}",
                fix=f"give (channel, time, height, width) = {expected}",
            )
        return torch.stack([self._maps_of(clip[0]) for clip in clips])

    def _maps_of(self, clip: Tensor) -> Tensor:
        frames = standardise_clip(clip)
        if self.maps == "frames":
            return frames.unsqueeze(0)
        if self.maps == "handmade":
            return features(frames[None, None], rate=self.rate)[0]
        if self.maps in _FLOW_SCALES:
            return flow.flow_maps(frames, scales=_FLOW_SCALES[self.maps])
        smooth = self._temporal.to(frames)
        pooled = pooled_derivatives(
            (smooth @ frames.flatten(1)).view_as(frames), sigma=self.spatial_sigma
        )
        real, imaginary = fourier_rows(self.frames).to(frames)
        flat, picture = pooled.flatten(2), pooled.shape[2:]
        spectra = (real @ flat).unflatten(2, picture), (imaginary @ flat).unflatten(2, picture)
        if self.maps == "spectral-maps":
            return self._peaks(spectra)
        return torch.cat([self._waves(spectra), at_rest(functional.avg_pool2d(frames, 4))])

    @cached_property
    def _temporal(self) -> Tensor:
        """(time, time)."""
        return smoothing_matrix(self.frames, self.temporal_sigma).float()

    def _peaks(self, spectra: tuple[Tensor, Tensor]) -> Tensor:
        real, imaginary = spectra
        power, index = (real.square() + imaginary.square()).max(dim=1)
        frequency = (index + 1).to(power.dtype) * (self.rate / self.frames)
        return torch.cat([power, frequency])

    def _waves(self, spectra: tuple[Tensor, Tensor]) -> Tensor:
        real, imaginary = spectra  # (2, bin, h, w)
        power = _sum_of_four(real.square() + imaginary.square()) / 4
        share = shares_of_nyquist(power, steps=self.frames)
        centre, width = centre_and_width(power, share, floor=_TINY)
        peaks, places = power.topk(min(2, power.shape[1]), dim=1)
        banded = [_logarithm(band) for band in band_powers(power, share, BANDS)]
        maps = [
            _logarithm(peaks),
            share[places],
            torch.stack([_logarithm(power.sum(dim=1)), centre, width], dim=1),
        ]
        maps += [torch.stack(banded, dim=1), _phases(real, imaginary, places[:, :1])]
        return torch.cat(maps, dim=1).flatten(0, 1)


def standardise_clip(clip: Tensor) -> Tensor:
    """Standardises a clip: less its mean, over its standard deviation, float32; one without
    contrast is 0 everywhere."""
    frames = clip.float()
    frames = frames - frames.mean()
    flat = frames.flatten()
    return frames / (flat.dot(flat) / len(flat)).sqrt().clamp(
        min=1e-6
    )  # a fifth of the time of torch.std_mean


def _logarithm(power: Tensor) -> Tensor:
    return log_power(power, floor=_FLOOR)


def _sum_of_four(values: Tensor) -> Tensor:
    rows = values[..., 0::2, :] + values[..., 1::2, :]
    return rows[..., 0::2] + rows[..., 1::2]


def _phases(real: Tensor, imaginary: Tensor, frequency: Tensor) -> Tensor:
    """Computes the phase gradient along x and y [π a pixel] at bin `frequency` (2, 1, h/2, w/2),
    and their coherence: (2, 4, h/2, w/2).

    Along x it is the angle of C = Σ F(x + 1, y) F*(x, y) over the two pairs of neighbours in each
    two by two pixels, and the coherence is |C|/√(Σ|F(x + 1)|² Σ|F(x)|²), 1 for a plane wave.
    """
    corners = [
        (part[..., row::2, column::2].gather(1, frequency).squeeze(1))
        for part in (real, imaginary)
        for row in (0, 1)
        for column in (0, 1)
    ]  # real at (0,0), (0,1), (1,0), (1,1), imaginary likewise
    (a, b, c, d), (e, f, g, h) = corners[:4], corners[4:]
    power = [re.square() + im.square() for re, im in ((a, e), (b, f), (c, g), (d, h))]

    def cross_spectrum(
        ahead: tuple[Tensor, Tensor], behind: tuple[Tensor, Tensor]
    ) -> tuple[Tensor, Tensor]:
        return ahead[0] * behind[0] + ahead[1] * behind[1], ahead[1] * behind[0] - ahead[
            0
        ] * behind[1]

    def along(
        pairs: list[tuple[tuple[Tensor, Tensor], tuple[Tensor, Tensor]]], norm: Tensor
    ) -> tuple[Tensor, Tensor]:
        crosses = [cross_spectrum(later, earlier) for later, earlier in pairs]
        re, im = crosses[0][0] + crosses[1][0], crosses[0][1] + crosses[1][1]
        return torch.atan2(im, re) / math.pi, (re.square() + im.square()).sqrt() / (
            norm.sqrt() + _TINY
        )

    x = along([((b, f), (a, e)), ((d, h), (c, g))], (power[1] + power[3]) * (power[0] + power[2]))
    y = along([((c, g), (a, e)), ((d, h), (b, f))], (power[2] + power[3]) * (power[0] + power[1]))
    return torch.stack([x[0], y[0], x[1], y[1]], dim=1)
