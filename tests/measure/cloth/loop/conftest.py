"""Simulations that cost nothing: observables that are a known function of cloth, view and
effects."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import stream
from flagdata.core.stated import Stated
from measure.cloth import (
    OBSERVED,
    CalibrationOptions,
    Design,
    FilmLoopOptions,
    Flag,
    FlagBatch,
    Log,
    Normal,
    Observed,
    Uncertain,
    design,
    simulations,
    weighable,
)
from measure.observables import WINDOW

NOISE = 0.02
"""Scatter of a window's readings."""
WINDOWS = 20
EFFECTS = ("lift.coefficient", "shear.exponent", "tangential-linear-drag.coefficient")
ALIKE = ("air-density.change", "power-law-drag.exponent")
"""Two that act alike here."""
AZIMUTH = Uncertain(
    name="azimuth",
    unit="rad",
    prior=Normal(mean=math.radians(70), sigma=math.radians(7)),
    source="stated",
)


def readings(batch: FlagBatch, *, foreign: float = 0.0) -> FloatArray:
    """(flag, window, observable): droop follows weight over dynamic pressure, extension the
    damping, the third the azimuth, the fourth bending; each effect moves others by a share of its
    strongest strength.

    Args:
        foreign: what something outside the library does.
    """
    values, seeds = batch.values, batch.seeds
    starts = np.arange(batch.windows) * WINDOW
    speed = batch.log.mean_speed(starts, starts + WINDOW)
    out = np.empty((len(seeds), batch.windows, len(OBSERVED)))
    for place, seed in enumerate(seeds):
        out[place] = NOISE * stream(seed, "tests", f"{speed.mean():.3f}").standard_normal(
            out[place].shape
        )
    ratio = values["area_weight"][:, None] / (values["gain"][:, None] * speed) ** 2
    out[..., 0] += 0.3 * np.log(ratio / 0.006)
    out[..., 1] += 0.9 + 0.1 * np.log(values["damping"] / 0.01)[:, None]
    out[..., 2] += np.cos(batch.places[:, 0, 0])[:, None]
    out[..., 3] += 0.1 * np.log(values["bending"] / 1e-4)[:, None]
    patterns = {
        "lift.coefficient": (4, 0.2),
        "shear.exponent": (5, 0.3),
        "tangential-linear-drag.coefficient": (6, 0.2),
        "hem-mass.line_density": (3, 0.0),
        "air-density.change": (7, 0.4),
        "power-law-drag.exponent": (7, 0.4),
        "fan.acceleration": (7, 0.4),
    }
    most = {
        "lift.coefficient": 8.0,
        "tangential-linear-drag.coefficient": 1.5,
        "fan.acceleration": 10.0,
    }
    for column, strength in batch.effects:
        which, size = patterns[column.name]
        out[..., which] += size * (strength / most.get(column.name, 0.8))[:, None]
    out[..., 4] += foreign
    out[..., 5] -= foreign
    return out


@pytest.fixture
def cheap(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Simulations that cost nothing, see `simulate_cheaply`."""
    return simulate_cheaply(monkeypatch)


def simulate_cheaply(patch: pytest.MonkeyPatch) -> list[int]:
    """Batches of two, simulated as `readings`; how many flags were asked for, each time."""
    asked: list[int] = []

    def read(
        batches: Sequence[FlagBatch], *, folder: Path, workers: int, advance: object
    ) -> FloatArray:
        asked.append(sum(len(batch.seeds) for batch in batches))
        return np.concatenate([readings(batch) for batch in batches])[:, None]

    patch.setattr(simulations, "readings_of", read)
    for module in (design, simulations):
        patch.setattr(module, "TOGETHER", 2)
    return asked


def recording(
    *,
    mean: float,
    seed: int,
    foreign: float = 0.0,
    effects: Mapping[str, float] | None = None,
    swing: float = 0.15,
) -> Observed:
    """One recording of a cloth that no simulation has, with effects of strengths beyond null.

    Args:
        swing: of the wind, as a share of its mean.
    """
    times = np.arange(-30.0, WINDOWS * WINDOW + 1)
    log = Log(times=times, speed=mean * (1 + swing * np.sin(times / 6.0)), distance=3.0)
    made = Design(
        flag=options().calibration.flag,
        log=log,
        duration=WINDOWS * WINDOW,
        azimuth=AZIMUTH,
        seed=seed,
    )
    first = made.batches()[3]
    known = {one.name: one.column for one in weighable(made.flag)}
    one = FlagBatch(
        flag=made.flag,
        log=log,
        duration=made.duration,
        values={k: v[:1] for k, v in first.values.items()},
        places=first.places[:1],
        seeds=(seed,),
        effects=tuple(
            (known[name], np.array([strength])) for name, strength in (effects or {}).items()
        ),
    )
    return Observed(
        name=f"{mean:g} m/s", source="", readings=readings(one, foreign=foreign)[0], log=log
    )


def options(
    *,
    kinds: int = 40,
    only: tuple[str, ...] = EFFECTS,
    area_weight: str | None = None,
) -> FilmLoopOptions:
    """Of a flag seen from a stated azimuth."""
    calibration = CalibrationOptions(
        flag=Flag(length=1.5, height=1.0), azimuth=AZIMUTH, simulations=128
    )
    weight = None if area_weight is None else Stated.of(area_weight)
    return FilmLoopOptions(calibration=calibration, kinds=kinds, only=only, area_weight=weight)
