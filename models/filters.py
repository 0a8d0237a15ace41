"""Gaussian filters and their first derivatives along the axes of a video, as products with banded matrices.

A filter of 17 taps along an axis of 224 samples is a banded 224 × 224 matrix. Cut into blocks of 32 outputs, each of
which sees 48 inputs, it becomes a batch of small dense products: 0.3 billion multiply-adds a clip of 30 × 224 × 224 for
both derivatives, at the speed of the matrix product, with no copies of the clip shifted by a sample. A few frames are
taken at a time, so that what lies between the products stays in the processor's cache.
"""

from __future__ import annotations

import functools

import torch
from torch import Tensor
from torch.nn import functional

from flagdata.errors import InputError

_BLOCK = 32
_FRAMES = 5  # at a time: 1 MB of 224 × 224 px each, of which a core's cache holds two
_TRUNCATE = 4.0  # standard deviations, as scipy.ndimage.gaussian_filter1d does


def gaussian(sigma: float, *, order: int = 0) -> Tensor:
    """Taps (2r + 1,) of a Gaussian, r = round(4σ), or of its first derivative, for correlation: Σ h[i] x[n + i − r].

    The Gaussian's taps sum to 1. The derivative's are those of the same, normalised Gaussian: i/σ² times its taps, so
    that a ramp of slope 1 gives Σ i² g(i)/σ², 1 but for what is cut off.

    Args:
        sigma: standard deviation [samples].
        order: 0 or 1.

    Raises:
        InputError: σ that is not above 0, or another order.
    """
    if not sigma > 0 or order not in (0, 1):
        raise InputError(f"a Gaussian of σ = {sigma:g} and order {order}", fix="give σ above 0 and order 0 or 1")
    radius = int(_TRUNCATE * sigma + 0.5)
    place = torch.arange(-radius, radius + 1, dtype=torch.float64)
    taps = torch.exp(-(place**2) / (2 * sigma**2))
    taps = taps / taps.sum()
    return taps if order == 0 else taps * place / sigma**2


def smoothing_matrix(count: int, sigma: float) -> Tensor:
    """(count, count) float64: the Gaussian along an axis of `count` samples, its ends repeated outwards."""
    taps = gaussian(sigma)
    radius = len(taps) // 2
    matrix = torch.zeros((count, count), dtype=torch.float64)
    for row in range(count):
        places = (torch.arange(row - radius, row + radius + 1)).clamp(0, count - 1)
        matrix[row].index_add_(0, places, taps)
    return matrix


def pooled_derivatives(frames: Tensor, *, sigma: float) -> Tensor:
    """First derivatives of a Gaussian along x (the last axis) and along y, each pooled: (2, time, height/2, width/2).

    Each derivative is smoothed by the Gaussian along the other axis. Beyond the edges the outermost samples are
    repeated. Of each two by two samples of the derivative the largest is taken.

    Args:
        frames: (time, height, width), floating; an even height and width.
        sigma: standard deviation [samples].

    Raises:
        InputError: another shape or type.
    """
    if frames.ndim != 3 or not frames.is_floating_point() or frames.shape[1] % 2 or frames.shape[2] % 2:
        raise InputError(
            f"frames of shape {tuple(frames.shape)} and type {frames.dtype}",
            fix="give floating (time, height, width) with an even height and width",
        )
    smooth, slope = (_band(sigma, order).to(device=frames.device, dtype=frames.dtype) for order in (0, 1))
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
    """(block + taps − 1, block): the part of the filter's matrix that one block of outputs sees."""
    taps = gaussian(sigma, order=order)
    band = torch.zeros((_BLOCK + len(taps) - 1, _BLOCK), dtype=torch.float64)
    for column in range(_BLOCK):
        band[column : column + len(taps), column] = taps
    return band


def _along_height(frames: Tensor, *bands: Tensor) -> Tensor:
    """(bands, time, blocks · 32, padded width): filters along the second axis of (time, height, width).

    The outermost samples are repeated on all sides, as often as the filters see beyond the edge and as the last block
    has rows and columns too many.
    """
    reach = len(bands[0])
    radius = (reach - _BLOCK) // 2
    below, right = (-size % _BLOCK for size in frames.shape[1:])
    padded = functional.pad(frames, (radius, radius + right, radius, radius + below), mode="replicate")
    rows = torch.cat(bands, dim=1).T  # (bands · 32, reach): one product for all filters
    found = padded.new_empty((len(bands), len(frames), frames.shape[1] + below, padded.shape[2]))
    for first in range(0, found.shape[2], _BLOCK):
        product = torch.matmul(rows, padded[:, first : first + reach]).unflatten(1, (len(bands), _BLOCK))
        found[:, :, first : first + _BLOCK] = product.transpose(0, 1)
    return found


def _pooled_along_width(padded: Tensor, band: Tensor) -> Tensor:
    """(time, height/2, blocks · 16): the largest of each two by two of the filter along the last axis of contiguous
    (time, height, blocks · 32 + taps − 1)."""
    time, height, width = padded.shape
    blocks = (width - len(band)) // _BLOCK + 1
    view = padded.as_strided((blocks, time * height, len(band)), (_BLOCK, width, 1))
    found = torch.bmm(view, band.expand(blocks, -1, -1)).view(blocks, time, height // 2, 2, _BLOCK)
    rows = torch.maximum(found[:, :, :, 0], found[:, :, :, 1])
    return torch.maximum(rows[..., 0::2], rows[..., 1::2]).permute(1, 2, 0, 3).flatten(2)
