"""How errors are weighed: by what is usual of each marker in the recording, and of each smooth shape in nulls.

Errors that numerics leave are smooth: a few shapes of the cloth hold most of them, and along these an effect is hard to
see. Errors are scaled by each marker's root mean square, beyond what its noise explains, and fitted by
cos(π i u/W) cos(π j v/H) along each axis of the world; with C the covariance of the amplitudes and v the variance of
what is left across the shapes, both of nulls, the inner product of two fields x, y of amplitudes a, b is, a frame,

    ⟨x, y⟩ = aᵀ C⁻¹ b + (x − Φ a)·(y − Φ b)/v:

generalised least squares (Aitken, Proc. R. Soc. Edinburgh 55:42, 1936) with a covariance in space. It is not that of
the recording's own errors: among these is what an effect does, which would be weighed down by itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from flagdata.errors import InputError
from measure.loop.columns import cosine
from measure.loop.forecast import Segments

Floats = NDArray[np.float64]

_CLIP = 4.0
"""Errors beyond so many times a marker's root mean square count as that much (Huber): folds snap in ways no effect
explains."""
_NOISE = 6.0
"""Variance of e by markers of variance 1: each frame's weighs 1, the one before 2, the one before that 1, in amplitude,
as for a point that moves evenly."""
_MARKERS = 1.8
"""Markers for each shape."""
_LEAST = 1e-3
"""Least variance along any shape, and across all, as a share of the mean: few nulls do not know it to be less."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Usual:
    """What errors of nulls are like in space, scaled as all are.

    Attributes:
        shapes: how many along both sides of the cloth.
        covariance: (shape · axis, shape · axis) C of the amplitudes, the shape the slower.
        rest: v, the variance of what is left, at least a thousandth of all.
    """

    shapes: tuple[int, int]
    covariance: Floats
    rest: float

    @classmethod
    def of(cls, errors: Tensor, segments: Segments, cloth: Floats) -> Usual:
        """By errors of nulls (frame, marker, 3, segment) [m], of a cloth at rest (vertex, 2) [m]."""
        shapes = _numbers(len(segments.markers), cloth)
        scale = _scale(errors, segments.recording, segments.noise)
        made = fields(shapes, segments.markers, cloth)
        scaled = torch.stack([clipped(errors[..., k], scale[:, k]) for k in range(len(segments))], dim=-1).to(made)
        amplitudes = torch.einsum("km,fmxs->fskx", torch.linalg.pinv(made), scaled)
        left = scaled - torch.einsum("mk,fskx->fmxs", made, amplitudes)
        values = amplitudes.flatten(0, 1).flatten(1)
        free = scaled.numel() * max(1 - made.shape[1] / len(made), 1 / len(made))
        return cls(
            shapes=shapes, covariance=(values.T @ values / len(values)).cpu().numpy(),
            rest=max(float((left**2).sum()) / free, _LEAST * float((scaled**2).mean())),
        )  # fmt: skip

    @classmethod
    def pooled(cls, parts: Sequence[Usual]) -> Usual:
        """The mean of some.

        Raises:
            InputError: of different numbers of markers.
        """
        if len({part.shapes for part in parts}) > 1:
            raise InputError(
                "nulls of different numbers of markers",
                where="null bank",
                fix="build one bank for one number of markers",
            )
        return cls(
            shapes=parts[0].shapes, covariance=np.mean([part.covariance for part in parts], axis=0),
            rest=float(np.mean([part.rest for part in parts])),
        )  # fmt: skip

    @property
    def inverse(self) -> Floats:
        """C⁻¹."""
        least = _LEAST * float(np.trace(self.covariance)) / len(self.covariance)
        return np.linalg.inv(self.covariance + least * np.eye(len(self.covariance)))


@dataclass(frozen=True, kw_only=True, eq=False)
class Weights:
    """Of the errors of some segments.

    Attributes:
        scale: (marker, segment) root mean square errors of a marker in the recording, beyond what its noise explains
            [m].
        usual: of nulls; None to count all shapes alike.
        shapes, solver, inverse: (marker, shape) Φ, (shape, marker) Φ⁺ and C⁻¹; of no shapes without `usual`.
    """

    scale: Tensor
    usual: Usual | None
    shapes: Tensor
    solver: Tensor
    inverse: Tensor

    @classmethod
    def of(cls, errors: Tensor, segments: Segments, cloth: Floats, usual: Usual | None = None) -> Weights:
        """By errors (frame, marker, 3, segment) [m], of a cloth at rest (vertex, 2) [m].

        Raises:
            InputError: fewer markers than shapes.
        """
        shapes = fields((0, 0) if usual is None else usual.shapes, segments.markers, cloth)
        if shapes.shape[1] > len(segments.markers):
            raise InputError(
                f"{len(segments.markers)} markers for {shapes.shape[1]} shapes of nulls' errors", where="null bank",
                fix="leave the bank out: nulls are then simulated for these markers",
            )  # fmt: skip
        scale = _scale(errors, segments.recording, segments.noise)
        inverse = torch.as_tensor(np.zeros((0, 0)) if usual is None else usual.inverse)
        return cls(
            scale=scale, usual=usual, shapes=shapes.to(errors.device),
            solver=torch.linalg.pinv(shapes).to(errors.device), inverse=inverse.to(errors.device),
        )  # fmt: skip

    @classmethod
    def joined(cls, parts: Sequence[Weights]) -> Weights:
        """Of the segments of some, of the same markers and nulls, one after another."""
        return replace(parts[0], scale=torch.cat([part.scale for part in parts], dim=1))

    def errors(self, errors: Tensor, place: int) -> Tensor:
        """(frame · marker · 3,) errors (frame, marker, 3) of one segment over their scale, long ones clipped."""
        return clipped(errors, self.scale[:, place]).reshape(-1)

    def scaled(self, changes: Tensor, place: int) -> Tensor:
        """(change, frame · marker · 3) of one segment, over the errors' scale; from (change, frame, marker, 3) [m]."""
        return (changes / self.scale[:, place, None]).flatten(1)

    def weighed(self, scaled: Tensor) -> Tensor:
        """What the inner products of scaled fields (field, frame · marker · 3) with others are dot products of."""
        if self.usual is None:
            return scaled
        found = scaled.reshape(len(scaled), -1, len(self.scale), 3).to(self.shapes)
        amplitudes = torch.einsum("km,nfmx->nfkx", self.solver, found)
        left = found - torch.einsum("mk,nfkx->nfmx", self.shapes, amplitudes)
        turned = (amplitudes.flatten(2) @ self.inverse).reshape(amplitudes.shape)
        found = left / self.usual.rest + torch.einsum("km,nfkx->nfmx", self.solver, turned)
        return found.flatten(1).to(scaled.dtype)


def fields(shapes: tuple[int, int], markers: Floats, cloth: Floats) -> Tensor:
    """(marker, shape) cosines along both sides of a cloth (vertex, 2) at markers (marker, 2) [m], of mean square 1
    about."""
    made = [cosine((i, j), markers, cloth) for i in range(shapes[0]) for j in range(shapes[1])]
    return torch.as_tensor(np.stack(made, axis=1) if made else np.zeros((len(markers), 0)))


def clipped(errors: Tensor, scale: Tensor) -> Tensor:
    """Errors (frame, marker, 3) over their scale (marker,), long ones clipped."""
    errors = errors / scale[None, :, None]
    size = errors.norm(dim=2, keepdim=True) / 3**0.5
    return errors * (_CLIP / size.clamp(min=_CLIP))


def _numbers(markers: int, cloth: Floats) -> tuple[int, int]:
    width, height = np.ptp(cloth, axis=0)
    along, across = (math.sqrt(markers / _MARKERS * ratio) for ratio in (width / height, height / width))
    return max(1, math.floor(along)), max(1, math.floor(across))


def _scale(errors: Tensor, recording: NDArray[np.int64], noise: Floats) -> Tensor:
    mean = (errors**2).mean((0, 2))
    scale = torch.empty_like(mean)
    for index in np.unique(recording):
        own = torch.as_tensor(np.flatnonzero(recording == index), device=errors.device)
        squared = mean[:, own].mean(1)
        noisy = _NOISE * float(noise[recording == index][0]) ** 2
        scale[:, own] = torch.maximum(squared - noisy, squared / 4).sqrt()[:, None]
    return scale
