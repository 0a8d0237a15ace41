"""Simulations that cost nothing: observables that are a known function of the cloth, for laws of
the statistics."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from flagdata.core.arrays import FloatArray
from flagdata.core.rng import child_seed, stream
from measure.cloth import MEASURED, OBSERVED, Design, cloth_posterior
from measure.cloth import cloth_calibration as calibrate
from measure.observables import WINDOW

NOISE = 0.02
"""Scatter of a window's readings."""


def readings(values: dict[str, FloatArray], speed: FloatArray, *, seed: int) -> FloatArray:
    """(flag, window, observable): the first follows weight over dynamic pressure, the second the
    damping, others none of the cloth."""
    rng = stream(seed, "tests", "readings")
    out = NOISE * rng.standard_normal((len(values["area_weight"]), len(speed), len(OBSERVED)))
    ratio = values["area_weight"][:, None] / (values["gain"][:, None] * speed) ** 2
    out[..., 0] += 0.3 * np.log(ratio / 0.006)
    out[..., 1] += 0.9 + 0.1 * np.log(values["damping"] / 0.01)[:, None]
    out[..., 2] += np.cos(values["azimuth"])[:, None]
    return out


def known(design: Design, *, folder: Path, workers: int, advance: object) -> FloatArray:
    """What a design's simulations show: `readings`."""
    del folder, workers, advance
    starts = np.arange(round(design.duration / WINDOW)) * WINDOW
    return readings(
        dict(design.values()),
        design.log.mean_speed(starts, starts + WINDOW),
        seed=child_seed(design.seed, design.recording),
    )


@pytest.fixture(scope="module")
def cheap() -> Iterator[list[Design]]:
    """`simulated` replaced by `known`, and few walkers; the designs that were asked for."""
    asked: list[Design] = []

    def simulated(design: Design, *, folder: Path, workers: int, advance: object) -> FloatArray:
        asked.append(design)
        return known(design, folder=folder, workers=workers, advance=advance)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(calibrate, "simulated_values", simulated)
        patch.setattr(calibrate, "measure_correction", lambda *_, **__: MEASURED)
        patch.setattr(cloth_posterior, "WALKERS", 96)
        patch.setattr(cloth_posterior, "STEPS", 300)
        patch.setattr(cloth_posterior, "CHECK", (32, 120))
        yield asked
