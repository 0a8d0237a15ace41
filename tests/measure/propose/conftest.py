"""A small flag, its null recordings seen along a few terms, and recordings with a force the library
does not have."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
import pytest
import torch
from torch import Tensor

from flagdata.core.rng import stream
from measure.forecasting import THETA, Calibration, Column, EffectColumn, fields
from measure.inference import Nulls
from measure.nulls import NullBank, NullBatch, evaluate
from measure.propose import Term, columns_of
from measure.trajectories import Experiment, Specimen
from sim.cloth import Cloth
from sim.effects import Effect, ForceEffect, Value, strength

RATE, DURATION, NOISE, SPEEDS = 25.0, 4.64, 5e-4, (3.5, 4.3, 5.1, 6.0)
KINDS, CLOTHS, RECORDINGS = 6, 2, 6
# m/s²; nearly a flag's weight, so that the term nearest to it is chosen whatever rounding does to
# the runs
PUSH = 8.0


@dataclass(frozen=True, kw_only=True)
class SidePush(ForceEffect):
    """A steady push along +y below the middle of the cloth, of another shape than any term has.

    Attributes:
        acceleration: well below the middle.
    """

    acceleration: Annotated[
        Value, strength(unit="m/s²", prior=(0.0, 8.0), source="made up for a test")
    ] = 0.0

    def force(
        self, cloth: Cloth, time: float, position: Tensor, velocity: Tensor, wind: Tensor
    ) -> Tensor:
        push = torch.zeros_like(position)
        push[:, 1] = cloth.mass * below(cloth.mesh.rest)[:, None] * self.acceleration
        return push


def below(rest: np.ndarray) -> Tensor:
    """(vertex,) share of the push."""
    return torch.sigmoid(torch.as_tensor((0.25 - rest[:, 1]) / 0.06))


@pytest.fixture(scope="session")
def columns() -> tuple[EffectColumn, ...]:
    terms = (
        ("upward", "lower"),
        ("downwind", "fly"),
        ("leftward", "everywhere"),
        ("leftward", "lower"),
        ("toward_pole", "lower_fly"),
        ("against_motion", "everywhere"),
    )
    return columns_of([Term(field=field, shape=shape) for field, shape in terms])


@pytest.fixture(scope="session")
def directions() -> tuple[Column, ...]:
    """What terms are seen along: the smooth fields, of which the small bank can hold the null
    distribution."""
    return fields()


def simulated(
    specimen: Specimen,
    calibrations: Sequence[Calibration],
    speeds: Sequence[float],
    effects: tuple[Effect, ...],
    seed: int,
) -> NullBatch:
    return NullBatch(
        specimen=specimen,
        markers=specimen.mesh.rest,
        rate=RATE,
        duration=DURATION,
        noise=NOISE,
        seed=seed,
        calibrations=tuple(calibrations),
        speeds=tuple(speeds),
        effects=effects,
    )


@pytest.fixture(scope="session")
def nulls(
    specimen: Specimen, columns: tuple[EffectColumn, ...], directions: tuple[Column, ...]
) -> tuple[Nulls, float]:
    """36 recordings of six meshes and methods, projected on directions, then on terms; duration of
    a segment [s]."""
    parts: list[Nulls] = []
    duration = 0.0
    for seed in range(KINDS):
        rng = stream(seed, "test", "nulls")
        # Damping beyond 1 ms: the implicit method, which is the cheaper one here.
        cloths = [
            Calibration(
                area_weight=float(rng.uniform(0.8, 1.25)),
                bending=float(rng.uniform(0.4, 2.5)),
                damping=float(rng.uniform(1.1e-3, 4e-3)),
            )
            for _ in range(CLOTHS)
        ]
        calibrations = [cloth for cloth in cloths for _ in range(RECORDINGS // CLOTHS)]
        speeds = [float(u) for u in rng.uniform(3.2, 6.5, RECORDINGS)]
        made, duration = evaluate(
            simulated(specimen, calibrations, speeds, (), seed), seed, (*directions, *columns)
        )
        shifted = replace(made.statistics, recording=made.statistics.recording + seed * RECORDINGS)
        parts.append(replace(made, statistics=shifted))
    whole = Nulls.joined(parts)
    return whole, duration


@pytest.fixture(scope="session")
def bank(nulls: tuple[Nulls, float], directions: tuple[Column, ...]) -> NullBank:
    """The same, projected on the directions alone: the bank that a proposal uses."""
    whole, duration = nulls
    count = len(THETA) + len(directions)
    own = whole.statistics
    cut = replace(own, r=own.r[:, :count], response=own.response[:, :count, :count])
    names = (*(name for name, _, _ in THETA), *(column.name for column in directions))
    return NullBank(
        nulls=replace(whole, statistics=cut), columns=names, duration=duration, words="of the tests"
    )


@pytest.fixture(scope="session")
def pushed(specimen: Specimen) -> Experiment:
    """Four winds with a push of 8 m/s²; fitted to nulls of this size, one across the wind scatters
    by 0.2 m/s²."""
    calibrations = (Calibration(area_weight=1.1, bending=0.7, damping=2e-3),) * len(SPEEDS)
    batch = simulated(specimen, calibrations, SPEEDS, (SidePush(acceleration=PUSH),), 97)
    return Experiment(specimen=specimen, recordings=tuple(batch.simulate()))
