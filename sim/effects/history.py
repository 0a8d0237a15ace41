"""Winds that vary in time as samples say."""

from __future__ import annotations

from bisect import bisect_right
from itertools import pairwise

import torch
from torch import Tensor

from flagdata.errors import InputError, UsageError
from sim.effects.geometry import horizontal, left_of, norm


def check(times: tuple[float, ...], samples: Tensor, *, where: str) -> None:
    """Refuse times that do not increase and samples that do not fit them.

    Args:
        times: (n,) [s].
        samples: (3, n, batch or 1).

    Raises:
        InputError: as said.
    """
    if len(times) < 2 or any(b <= a for a, b in pairwise(times)):
        raise InputError("times do not increase, or fewer than two", where=where, fix="give two or more, in order")
    if samples.ndim != 3 or samples.shape[:2] != (3, len(times)):
        raise InputError(
            f"samples of shape {tuple(samples.shape)} for {len(times)} times", where=where, fix="give (3, time, batch)"
        )
    if not bool(torch.isfinite(samples).all()):
        raise InputError("a sample is not finite", where=where, fix="leave gaps out; what is between is interpolated")


def at(times: tuple[float, ...], samples: Tensor, time: float, *, where: str) -> Tensor:
    """Samples (3, n, batch), linear in time: (3, batch).

    Raises:
        UsageError: a time they do not cover.
    """
    if not times[0] <= time <= times[-1]:
        raise UsageError(
            f"wind asked for at {time:g} s, known from {times[0]:g} to {times[-1]:g} s",
            where=where,
            fix="give a series as long as the run, settling included",
        )
    index = min(bisect_right(times, time), len(times) - 1) - 1
    share = (time - times[index]) / (times[index + 1] - times[index])
    return torch.lerp(samples[:, index], samples[:, index + 1], share)


def disturbed(wind: Tensor, relative: Tensor) -> Tensor:
    """The wind (3, batch) with disturbances relative to its horizontal speed.

    Args:
        wind: (3, batch) [m/s].
        relative: (3, batch) along the wind's horizontal part, to its left, and up.
    """
    level = horizontal(wind, axis=0)
    up = torch.zeros_like(wind).index_fill(0, torch.tensor(2, device=wind.device), 1.0)
    return wind + relative[0] * level + relative[1] * left_of(wind, axis=0) + relative[2] * norm(level, axis=0) * up
