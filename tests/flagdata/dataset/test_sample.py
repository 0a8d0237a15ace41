"""Samples are typed and checked; a batch holds each sample unchanged."""

from __future__ import annotations

import math
from dataclasses import FrozenInstanceError, replace

import pytest
import torch

from flagdata.dataset import Sample, collate
from flagdata.errors import InputError


def sample(index, **changes):
    base = Sample(
        clip=torch.full((1, 3, 4, 5), index, dtype=torch.uint8),
        wind=5.0 + index,
        wind_sigma=0.25,
        staleness=0.5,
        coverage=1.0,
        clock_sigma=0.125,
        parameters={},
        artifact=f"clip{index}",
        recording="recording",
        session="field",
        day="2026-05-01",
        seed=None,
        start=10 * index,
        end=10 * index + 5,
    )
    return replace(base, **changes)


def test_a_batch_holds_every_sample_in_order():
    samples = [sample(0), sample(1), sample(2)]
    batch = collate(samples)
    assert len(batch) == 3
    assert batch.clip.shape == (3, 1, 3, 4, 5)
    assert batch.clip.dtype == torch.uint8
    assert torch.equal(batch.clip[2], samples[2].clip)
    assert batch.wind.tolist() == [5.0, 6.0, 7.0]
    assert batch.end.tolist() == [5, 15, 25]
    assert batch.end.dtype == torch.int64
    assert batch.artifact == ("clip0", "clip1", "clip2")


def test_real_and_simulated_clips_share_a_batch_and_only_unknown_parameters_are_nan():
    simulated = sample(1, parameters={"bending": 1e-5, "area_weight": 0.2}, seed=7, day="")
    other = sample(2, parameters={"bending": 2e-5}, seed=8, day="")
    batch = collate([sample(0), simulated, other])
    assert batch.seed == (None, 7, 8)
    assert sorted(batch.parameters) == ["area_weight", "bending"]
    bending, area_weight = (
        batch.parameters["bending"].tolist(),
        batch.parameters["area_weight"].tolist(),
    )
    assert [math.isnan(value) for value in bending] == [True, False, False]
    assert [math.isnan(value) for value in area_weight] == [True, False, True]
    assert area_weight[1] == pytest.approx(0.2, rel=1e-7)  # float32


def test_samples_and_batches_are_frozen():
    with pytest.raises(FrozenInstanceError):
        sample(0).wind = 3.0
    with pytest.raises(FrozenInstanceError):
        collate([sample(0)]).wind = torch.zeros(1)


def test_moving_a_batch_moves_all_tensors_and_keeps_identities():
    batch = collate([sample(0, parameters={"area_weight": 0.2})])
    moved = batch.to("meta")
    tensors = [
        moved.clip,
        moved.wind,
        moved.wind_sigma,
        moved.staleness,
        moved.coverage,
        moved.clock_sigma,
    ]
    tensors += [moved.start, moved.end, moved.parameters["area_weight"]]
    assert {tensor.device.type for tensor in tensors} == {"meta"}
    assert moved.artifact == batch.artifact


def test_a_clip_of_another_shape_or_type_and_a_ground_truth_that_is_not_a_number_are_refused():
    for clip in (torch.zeros(3, 4, 5, dtype=torch.uint8), torch.zeros(1, 3, 4, 5)):
        with pytest.raises(InputError, match="channel, time, height, width"):
            sample(0, clip=clip)
    for name in ("wind", "wind_sigma", "staleness", "coverage", "clock_sigma"):
        with pytest.raises(InputError, match="not finite"):
            sample(0, **{name: math.nan})


def test_clips_of_different_sizes_do_not_stack():
    with pytest.raises(InputError, match="different shapes"):
        collate([sample(0), sample(1, clip=torch.zeros(1, 3, 8, 8, dtype=torch.uint8))])
    with pytest.raises(InputError, match="no samples"):
        collate([])
