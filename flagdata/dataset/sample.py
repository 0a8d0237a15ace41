"""A clip with its ground truth, one type for real and simulated clips, and how samples become a
batch."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Self, TypeAlias

import torch
from torch.utils.data import default_collate
from torch.utils.data._utils.collate import default_collate_fn_map

from flagdata.errors import InputError

_TensorMap: TypeAlias = Callable[[torch.Tensor], torch.Tensor]


@dataclass(frozen=True, kw_only=True, eq=False)
class Sample:
    """One pair: a clip, and the wind it was filmed in.

    Attributes:
        clip: (channel, time, height, width) uint8; gray clips have one channel; y down, x right.
        wind: mean speed over the window that ends with the clip [m/s].
        wind_sigma: standard uncertainty of `wind` [m/s].
        staleness: age of the newest wind sample at the clip's end [s].
        coverage: share of the window that wind samples speak for, 0 to 1.
        clock_sigma: standard uncertainty of the camera's clock on the wind's [s]; 0 for a simulated
            clip.
        parameters: simulation and render parameters by name, SI; empty for a real clip.
        artifact: catalog identity of the clip.
        recording: catalog identity of the recording it belongs to.
        session: one set-up at one place; "" where none was named.
        day: calendar day (ISO, UTC) of the clip's start; "" for a simulated clip, which has none.
        seed: root seed of a simulated clip; `None` for a real one.
        start, end: mid-exposure of the first and last frame on the common clock [UTC ns].

    Raises:
        InputError: a clip of another shape or type, or a ground truth that is not a number.
    """

    clip: torch.Tensor
    wind: float
    wind_sigma: float
    staleness: float
    coverage: float
    clock_sigma: float
    parameters: Mapping[str, float]
    artifact: str
    recording: str
    session: str
    day: str
    seed: int | None
    start: int
    end: int

    def __post_init__(self) -> None:
        if self.clip.ndim != 4 or self.clip.dtype != torch.uint8:
            raise InputError(
                f"a clip cannot have the shape {tuple(self.clip.shape)} and the type "
                f"{self.clip.dtype}",
                where=self.artifact,
                fix="give uint8 of shape (channel, time, height, width)",
            )
        numbers = (self.wind, self.wind_sigma, self.staleness, self.coverage, self.clock_sigma)
        if not all(math.isfinite(number) for number in numbers):
            raise InputError(
                f"a ground truth with numbers that are not finite: {numbers}",
                where=self.artifact,
                fix="a pair without ground truth is refused, not sampled",
            )


@dataclass(frozen=True, kw_only=True, eq=False)
class Batch:
    """Samples stacked along a first axis of length n; the attributes mean what they mean in
    `Sample`.

    Attributes:
        clip: (n, channel, time, height, width) uint8.
        wind, wind_sigma, staleness, coverage, clock_sigma: (n,) float32.
        parameters: name → (n,) float32, for every name that any sample knows; NaN where that sample
            does not (a batch of real and simulated clips, or of different simulators). The only NaN
            in a batch.
        start, end: (n,) int64.
        artifact, recording, session, day, seed: n-tuples; they stay on the host.
    """

    clip: torch.Tensor
    wind: torch.Tensor
    wind_sigma: torch.Tensor
    staleness: torch.Tensor
    coverage: torch.Tensor
    clock_sigma: torch.Tensor
    parameters: Mapping[str, torch.Tensor]
    start: torch.Tensor
    end: torch.Tensor
    artifact: tuple[str, ...]
    recording: tuple[str, ...]
    session: tuple[str, ...]
    day: tuple[str, ...]
    seed: tuple[int | None, ...]

    def __len__(self) -> int:
        return len(self.artifact)

    def to(self, device: torch.device | str) -> Self:
        """Moves the batch's tensors to `device`; copies from pinned memory overlap with
        computation."""
        return self._map_arrays(lambda tensor: tensor.to(device, non_blocking=tensor.is_pinned()))

    def pin_memory(self) -> Self:
        """Copies the batch to page-locked memory; `DataLoader(pin_memory=True)` calls it."""
        return self._map_arrays(torch.Tensor.pin_memory)

    def _map_arrays(self, function: _TensorMap) -> Self:
        return replace(
            self,
            clip=function(self.clip),
            wind=function(self.wind),
            wind_sigma=function(self.wind_sigma),
            staleness=function(self.staleness),
            coverage=function(self.coverage),
            clock_sigma=function(self.clock_sigma),
            start=function(self.start),
            end=function(self.end),
            parameters={name: function(values) for name, values in self.parameters.items()},
        )


def collate(samples: Sequence[Sample]) -> Batch:
    """Stacks samples in order.

    Raises:
        InputError: no sample, or clips of different shapes.
    """
    if not samples:
        raise InputError("the batch has no samples", fix="give at least one")
    shapes = {tuple(sample.clip.shape) for sample in samples}
    if len(shapes) > 1:
        raise InputError(
            f"clips of different shapes in one batch: {sorted(shapes)}",
            where=samples[0].artifact,
            fix="select clips of one size, e.g. by frame_count in where",
        )
    names = sorted({name for sample in samples for name in sample.parameters})
    return Batch(
        # In a worker this stacks straight into the memory it shares with the parent.
        clip=default_collate([sample.clip for sample in samples]),
        wind=_column([sample.wind for sample in samples]),
        wind_sigma=_column([sample.wind_sigma for sample in samples]),
        staleness=_column([sample.staleness for sample in samples]),
        coverage=_column([sample.coverage for sample in samples]),
        clock_sigma=_column([sample.clock_sigma for sample in samples]),
        parameters={
            name: _column([sample.parameters.get(name, math.nan) for sample in samples])
            for name in names
        },
        start=torch.tensor([sample.start for sample in samples], dtype=torch.int64),
        end=torch.tensor([sample.end for sample in samples], dtype=torch.int64),
        artifact=tuple(sample.artifact for sample in samples),
        recording=tuple(sample.recording for sample in samples),
        session=tuple(sample.session for sample in samples),
        day=tuple(sample.day for sample in samples),
        seed=tuple(sample.seed for sample in samples),
    )


def _collate_by_default(samples: Sequence[Sample], *, collate_fn_map: object = None) -> Batch:
    return collate(samples)


default_collate_fn_map[Sample] = _collate_by_default
"""A `torch.utils.data.DataLoader` of pairs batches as `collate` does: torch's table of types."""


def _column(values: list[float]) -> torch.Tensor:
    return torch.tensor(values, dtype=torch.float32)
