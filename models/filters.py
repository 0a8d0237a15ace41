"""Gaussian filters and their first derivatives along the axes of a video, as products with banded matrices.

A filter of 17 taps along an axis of 224 samples is a banded 224 × 224 matrix. Cut into blocks of 32 outputs, each of
which sees 48 inputs, it becomes a batch of small dense products: 0.3 billion multiply-adds a clip of 30 × 224 × 224 for
both derivatives, at the speed of the matrix product, with no copies of the clip shifted by a sample.
"""

from __future__ import annotations

import functools
import math

import torch
from torch import Tensor
from torch.nn import functional

from flagdata.errors import InputError

_BLOCK = 32
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


def derivatives(frames: Tensor, *, sigma: float) -> tuple[Tensor, Tensor]:
    """First derivatives of a Gaussian along x (the last axis) and along y: two of (time, height, width).

    Each is smoothed by the Gaussian along the other axis. Beyond the edges the outermost samples are repeated.

    Args:
        frames: (time, height, width), floating.
        sigma: standard deviation [samples].

    Raises:
        InputError: another shape or type.
    """
    if frames.ndim != 3 or not frames.is_floating_point():
        raise InputError(
            f"frames of shape {tuple(frames.shape)} and type {frames.dtype}", fix="give floating (time, height, width)"
        )
    count, height, width = frames.shape
    taps = len(gaussian(sigma))
    radius = taps // 2
    rows, columns = math.ceil(height / _BLOCK), math.ceil(width / _BLOCK)
    below, right = rows * _BLOCK - height, columns * _BLOCK - width
    padded = functional.pad(frames, (radius, radius + right, radius, radius + below), mode="replicate")
    smooth, slope = (
        _band(sigma, order).to(device=frames.device, dtype=frames.dtype) for order in (0, 1)
    )  # each (block + taps − 1, block)
    along_x = _along_width(_along_height(padded, smooth, rows), slope, columns)
    along_y = _along_width(_along_height(padded, slope, rows), smooth, columns)
    shape = (count, rows * _BLOCK, columns * _BLOCK)
    return along_x.reshape(shape)[:, :height, :width], along_y.reshape(shape)[:, :height, :width]


@functools.cache
def _band(sigma: float, order: int) -> Tensor:
    """(block + taps − 1, block): the part of the filter's matrix that one block of outputs sees."""
    taps = gaussian(sigma, order=order)
    band = torch.zeros((_BLOCK + len(taps) - 1, _BLOCK), dtype=torch.float64)
    for column in range(_BLOCK):
        band[column : column + len(taps), column] = taps
    return band


def _along_height(padded: Tensor, band: Tensor, blocks: int) -> Tensor:
    """(time, blocks · 32, width): the filter along the second axis of contiguous (time, blocks · 32 + taps − 1,
    width)."""
    time, _, width = padded.shape
    step = padded.stride()
    view = padded.as_strided((time, blocks, len(band), width), (step[0], _BLOCK * step[1], step[1], step[2]))
    return torch.matmul(band.T, view).reshape(time, blocks * _BLOCK, width)


def _along_width(padded: Tensor, band: Tensor, blocks: int) -> Tensor:
    """(time, height, blocks · 32): the filter along the last axis of contiguous (time, height, blocks · 32 + taps −
    1)."""
    time, height, width = padded.shape
    view = padded.as_strided((blocks, time * height, len(band)), (_BLOCK, width, 1))
    return torch.bmm(view, band.expand(blocks, -1, -1)).permute(1, 0, 2).reshape(time, height, blocks * _BLOCK)
