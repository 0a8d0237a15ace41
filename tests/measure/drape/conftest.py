"""Drapes that are a known function of the cloth, in place of simulated ones, and scans of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest

from flagdata.core.arrays import FloatArray
from flagdata.ingest import Obj, write_obj
from measure.cloth import draws
from measure.drape import CLOTH, drape_answer
from sim.run.cusick_drape import DISC, PEDESTAL, disc

COUNT = 128
NOISE = 0.005


def shapes(values: Mapping[str, FloatArray], rng: np.random.Generator) -> FloatArray:
    """(drape, 7) figures: a coefficient that grows with the bending length, lobes with anisotropy
    and curvature."""
    length, curvature = values["bending_length"], values["rest_curvature"]
    count = len(length)
    coefficient = (
        0.7
        + 0.55 * np.log(length / 0.02)
        + 0.03 * np.log(values["shear"] / 400)
        + 0.0007 * curvature
    )
    lobe = 0.025 * values["anisotropy"] + 0.0014 * curvature
    figures = np.zeros((count, 7))
    figures[:, 0] = coefficient + NOISE * rng.standard_normal(count)
    figures[:, 1] = lobe + NOISE * rng.standard_normal(count)
    figures[:, 2] = NOISE * rng.standard_normal(count)
    figures[:, 3:] = 0.05, 7.0, -0.04, 1.0
    return figures


def simulated(count: int, *, seed: int, **_: object) -> tuple[Mapping[str, FloatArray], FloatArray]:
    values = draws(CLOTH, count, seed=seed, name="drapes")
    return values, shapes(values, np.random.default_rng(seed))


def scan(coefficient: float, *, lobe: float = 0.0) -> Obj:
    """A drape with folds of the seventh order and this drape coefficient, z upwards, on a table 0.3
    m above zero."""
    mesh = disc(np.random.default_rng(0), rows=5)
    radius = np.hypot(mesh.rest[:, 0], mesh.rest[:, 1])
    angle = np.arctan2(mesh.rest[:, 1], mesh.rest[:, 0])
    outside = np.clip(radius - PEDESTAL, 0.0, None)
    rim = np.sqrt((PEDESTAL**2 + coefficient * (DISC**2 - PEDESTAL**2)) - (0.004 * DISC) ** 2 / 2)
    reach = (rim - PEDESTAL) / (DISC - PEDESTAL)
    fold = DISC * (0.004 * np.cos(7 * angle) + lobe * np.cos(2 * angle)) / (DISC - PEDESTAL)
    across = np.minimum(radius, PEDESTAL) + outside * (reach + fold)
    position = np.stack(
        [across * np.cos(angle), across * np.sin(angle), 0.3 - outside * np.sqrt(1 - reach**2)], 1
    )
    return Obj(
        positions=position + np.array([1.0, 2.0, 0.0]), faces=mesh.faces, rest=10 * mesh.rest + 5.0
    )


@pytest.fixture
def cheap(monkeypatch: pytest.MonkeyPatch) -> None:
    """Simulations by the known function."""
    monkeypatch.setattr(drape_answer, "simulated_drapes", simulated)


@pytest.fixture
def scanned(tmp_path: Path) -> Callable[..., Path]:
    """Writes a folder of scans of these drape coefficients."""

    def write(name: str, coefficients: FloatArray, *, lobe: float = 0.02) -> Path:
        (tmp_path / name).mkdir()
        for number, coefficient in enumerate(coefficients.tolist()):
            write_obj(tmp_path / name / f"piece-{number}.obj", scan(coefficient, lobe=lobe))
        return tmp_path / name

    return write
