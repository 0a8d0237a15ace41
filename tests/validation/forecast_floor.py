"""What is the error of a forecast made of, where the model is right and only the numerics differ?

Nulls of several numerics are predicted one horizon ahead with their own calibration, by the mesh and steps of the fit,
by finer ones, and by the mesh and steps that they were simulated with. What is left with the latter is the state of the
cloth between the markers, which nobody saw.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.rng import child_seed
from measure.challenge.folder import MODEL_COLUMNS, MODEL_ROWS
from measure.forecasting.calibration import Calibration
from measure.forecasting.observer import Forecaster
from measure.forecasting.segments import Segments
from measure.nulls.simulation import NullBatch
from measure.observe.trajectory import Specimen
from sim import handles
from sim.integrate.implicit import BackwardEuler
from sim.integrate.split import SplitEuler
from sim.material import named
from sim.mesh import Mesh, grid

WIDTH, HEIGHT = 1.5, 1.0  # m
WINDS = (4.0, 6.0, 8.0)  # m/s
RATE, DURATION = 25.0, 6.0  # Hz, s
DRAWS = 4
MARKERS = (16, 10)
"""Cells of the markers' grid: 17 × 11, as the challenges have them."""
DAMPED = Calibration(damping=2e-3)
FITS = (
    ("mesh of the fit, 5 ms", 1, 5e-3), ("mesh of the fit, 1 ms", 1, 1e-3), ("mesh × 1.5, 5 ms", 1.5, 5e-3),
    ("mesh × 2, 5 ms", 2, 5e-3), ("mesh × 2, 1 ms", 2, 1e-3), ("mesh × 3, 1 ms", 3, 1e-3),
)  # fmt: skip
"""Name, how many times as fine along each side, step [s]."""
OWN = "mesh and step of the null"


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Root mean square errors of markers [mm] by fit and wind, over draws of numerics."""
    del out
    specimen = _specimen(grid(width=WIDTH, height=HEIGHT, columns=MODEL_COLUMNS, rows=MODEL_ROWS))
    markers = grid(width=WIDTH, height=HEIGHT, columns=MARKERS[0], rows=MARKERS[1]).rest
    squared: dict[str, list[list[float]]] = {}
    vertices: dict[str, list[int]] = {}
    for draw in range(DRAWS):
        batch = NullBatch(
            specimen=specimen, markers=markers, rate=RATE, duration=DURATION, noise=0.0,
            calibrations=(DAMPED,) * len(WINDS), speeds=WINDS, seed=child_seed(seed, "floor", draw),
        )  # fmt: skip
        segments = Segments.of(batch.simulate())
        for name, model, step in [*_finer(specimen), (OWN, *_of_null(batch))]:
            vertices.setdefault(name, []).append(model.mesh.vertex_count)
            squared.setdefault(name, []).append(_errors(model, markers, segments, step))
    return {
        "winds": WINDS, "draws": DRAWS, "rate": RATE, "material": specimen.material.name,
        "fits": [
            {
                "fit": name, "vertices": sorted(set(vertices[name])),
                "by_wind_mm": [round(1e3 * value**0.5, 1) for value in np.mean(each, axis=0)],
                "all_mm": round(1e3 * float(np.mean(each)) ** 0.5, 1),
                "between_draws_mm": round(1e3 * float(np.std(np.mean(each, axis=1) ** 0.5, ddof=1)), 1),
            }
            for name, each in squared.items()
        ],
    }  # fmt: skip


def _specimen(mesh: Mesh) -> Specimen:
    held = handles.corners(mesh.rest)
    anchors = np.array([(0.0, 0.0, mesh.rest[vertex, 1]) for vertex in held])
    return Specimen(
        mesh=mesh, material=named("camel-ponte-roma"), held=held, anchors=anchors, stiffness=handles.ARCSIM_STIFFNESS
    )


def _finer(specimen: Specimen) -> list[tuple[str, Specimen, float]]:
    """Names, specimens and steps [s] of the fits."""
    made = {
        finer: specimen if finer == 1 else _specimen(
            grid(width=WIDTH, height=HEIGHT, columns=round(finer * MODEL_COLUMNS), rows=round(finer * MODEL_ROWS))
        )
        for _, finer, _ in FITS
    }  # fmt: skip
    return [(name, made[finer], step) for name, finer, step in FITS]


def _of_null(batch: NullBatch) -> tuple[Specimen, float]:
    """The cloth on the null's own mesh, and its step [s]."""
    mesh, held = batch._mesh()  # pyright: ignore[reportPrivateUsage]
    method, _ = batch._method()  # pyright: ignore[reportPrivateUsage]
    if not isinstance(method, BackwardEuler):
        raise TypeError(f"nulls of this damping are made by {type(method).__name__}")
    return replace(batch.specimen, mesh=mesh, held=held), method.step


def _errors(specimen: Specimen, markers: np.ndarray, segments: Segments, step: float) -> list[float]:
    """Mean squared distances of the markers, one a wind [m²]."""
    forecaster = Forecaster(
        specimen=specimen, markers=markers, integrator=SplitEuler(base=BackwardEuler(step=step, tolerance=1e-5))
    )
    errors = forecaster.errors(*forecaster.system(segments, [DAMPED] * len(segments)), segments).double().numpy()
    squared = (errors**2).sum(axis=2).mean(axis=(0, 1))
    return [float(squared[segments.recording == wind].mean()) for wind in range(_count(segments.recording))]


def _count(recording: Sequence[int]) -> int:
    return int(np.max(recording)) + 1
