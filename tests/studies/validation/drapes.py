"""Measured drapes of five fabrics: bending by its own simulation, specimens left out predicted,
faces compared.

The criteria are in docs/decisions/074-drapes.md. The drapes are in the reference data; without them
only the verdicts on simulated drapes are made. `shapes` reads a fabric: the published flat
coordinates are shifted by one vertex, and the last one is missing, which lies at the gap of the
rim.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import ttest_1samp

from flagdata.core.files.caches import user_cache
from measure.drape import (
    BENDING_LENGTH,
    CURVATURE,
    DrapeBatch,
    Face,
    Fit,
    Model,
    Surface,
    fit_drapes,
    ratio,
    rim_of,
    shape_of,
    simulated_drapes,
    together,
)
from sim.cloth.mesh import Mesh
from sim.cloth.scene import GRAVITY
from tests.evidence import ABSENT, REFERENCE
from tests.studies.validation.drapes_picture import bank, cantilevers, draw

FABRICS = ("cotton_white", "cotton_blue", "viscose_white", "cotton_pink", "wool_red")
THIRDS = ((1, 2, 3), (4, 5, 6), (7, 8, 9))
LEVEL = 0.9
SIMULATIONS = 256
TRUTHS = (0.0, 12.0, -12.0)
"""Rest curvature of simulated drapes that are judged as the measured ones are [1/m]."""
SIGNIFICANCE = 0.01 / len(FABRICS)


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Fits, predicts and compares all fabrics."""
    folder = REFERENCE / "drapes"
    if not folder.is_dir():
        return dict(ABSENT)
    surface = Surface.fit(*simulated_drapes(SIMULATIONS, seed=0, folder=user_cache() / "drapes"))
    results = {}
    for number, name in enumerate(FABRICS, start=1):
        weight, faces = shapes(folder / f"fabric{number}_{name}.npz")
        results[name] = fabric(surface, weight, faces, seed=seed)
    truths = {
        f"{curvature:g} 1/m": fabric(surface, 0.2, made(curvature), seed=seed)
        for curvature in TRUTHS
    }
    passed = [name for name, result in results.items() if result["drape_coefficient_passed"]]
    result = {
        "simulations": SIMULATIONS,
        "residual": {
            "drape_coefficient": float(surface.residual[0]),
            "lobe": float(surface.residual[1]),
        },
        "passed": passed,
        "fabrics": results,
        "simulated": truths,
        "catalog": bank(),
        "cantilevers": np.quantile(cantilevers()[:, 1], [0.05, 0.25, 0.5, 0.75, 0.95]).tolist(),
    }
    draw(result, surface, out / "validate-drapes.png")
    return result


def shapes(path: Path) -> tuple[float, list[Face]]:
    """Reads a fabric's area weight [kg/m²] and its drapes, with either face up."""
    with np.load(path) as content:
        position = content["q"].astype(np.float64) * 1e-5
        rest = np.roll(content["flat"].astype(np.float64), -1, axis=0)
        faces = content["faces"].astype(np.int64)
        specimen, capture = content["sample_capture"].T
        weight = float(content["area_weight"])
    radius = np.hypot(rest[:-1, 0], rest[:-1, 1])
    angle = np.sort(np.arctan2(rest[:-1, 1], rest[:-1, 0])[radius > radius.max() - 1e-4])
    gaps = np.diff(np.append(angle, angle[0] + 2 * np.pi))
    missing = angle[gaps.argmax()] + gaps.max() / 2
    rest[-1] = radius.max() * np.cos(missing), radius.max() * np.sin(missing)
    flat = Mesh(rest=rest, faces=faces)
    rim = rim_of(flat)
    figures = np.stack([shape_of(flat, frame, rim=rim).numbers() for frame in position])
    return weight, [
        Face(shapes=figures[up], specimen=specimen[up]) for up in (capture <= 2, capture > 2)
    ]


def made(curvature: float) -> list[Face]:
    """Simulates nine specimens of a cloth, draped twice on either face, on another mesh than the
    fit's."""
    faces = []
    for sign in (1, -1):
        values = {
            "bending_length": np.full(18, 0.0195),
            "anisotropy": np.full(18, 0.4),
            "shear": np.full(18, 500.0),
            "rest_curvature": np.full(18, sign * curvature),
        }
        seeds = tuple(5000 + sign * 100 + number for number in range(18))
        shapes_made = DrapeBatch(values=values, seeds=seeds, rows=7).read()
        faces.append(Face(shapes=shapes_made, specimen=np.repeat(np.arange(1, 10), 2)))
    return faces


def fabric(surface: Surface, weight: float, faces: list[Face], *, seed: int) -> dict[str, Any]:
    """Judges one fabric by the criteria of decision 074."""
    whole = fit_drapes(surface, [together(faces)], model=Model.BASE, seed=seed)
    thirds = [third(surface, faces, out, seed=seed) for out in THIRDS]
    first, second = (face.means(0.0)[:, 0] for face in faces)
    difference = second - first
    test = ttest_1samp(difference, 0.0)
    scatter = together(faces).scatter
    repeats = float(np.sqrt(np.mean([face.scatter**2 for face in faces])))
    models = {model.value: fit_drapes(surface, faces, model=model, seed=seed) for model in Model}
    errors = {
        model.value: float(np.sqrt(np.mean([t["squares"][model.value] for t in thirds])))
        for model in Model
    }
    curled = models[Model.CURLED.value]
    found = bool(test.pvalue < SIGNIFICANCE and abs(difference.mean()) > repeats / 3)
    half, rival = errors["base"] / 2, models[Model.SIDED.value]
    return {
        "area_weight": weight,
        "measured": {
            "drape_coefficient": float(together(faces).shapes[:, 0].mean()),
            "of_faces": [float(first.mean()), float(second.mean())],
            "folds": float(together(faces).shapes[:, 4].mean()),
            "folding": float(together(faces).shapes[:, 3].mean()),
            "height": float(together(faces).shapes[:, 5].mean()),
            "area": float(together(faces).shapes[:, 6].mean()),
            "scatter_of_a_specimen": scatter,
            "scatter_of_a_face": repeats,
        },
        "fit": answer(whole, weight),
        "thirds": [{key: value for key, value in t.items() if key != "squares"} for t in thirds],
        "drape_coefficient_passed": all(t["passed"] for t in thirds),
        "faces": {
            "difference": float(difference.mean()),
            "standard_error": float(difference.std(ddof=1) / np.sqrt(len(difference))),
            "p": float(test.pvalue),
            "same_sign": int((np.sign(difference) == np.sign(difference.mean())).sum()),
            "found": found,
            "named": found
            and errors[curled.model.value] < half
            and curled.evidence >= rival.evidence,
            "control": errors[Model.WET.value] / errors["base"],
            "errors": errors,
            "evidence": {
                name: fit.evidence - models["base"].evidence for name, fit in models.items()
            },
            "rest_curvature": interval(curled.cloth[CURVATURE.name]),
            "lobe_difference": lobes(faces, curled.direction),
            "lobe_difference_of_rest_curvature": interval(
                curled.predicted[:, 1, 1] - curled.predicted[:, 0, 1]
            ),
            "difference_of_rest_curvature": interval(
                curled.predicted[:, 1, 0] - curled.predicted[:, 0, 0]
            ),
            "sidedness": interval(models[Model.SIDED.value].cloth["sidedness"]),
        },
    }


def third(
    surface: Surface, faces: list[Face], out: tuple[int, ...], *, seed: int
) -> dict[str, Any]:
    """Predicts three specimens from the other six."""
    chosen = [n for n in range(1, 10) if n not in out]
    trained, left = [face.of(chosen) for face in faces], [face.of(out) for face in faces]
    base = fit_drapes(surface, [together(trained)], model=Model.BASE, seed=seed)
    predicted = float(base.predicted[:, 0, 0].mean())
    measured = float(together(left).shapes[:, 0].mean())
    tolerance = together(trained).scatter
    squares = {}
    for model in Model:
        several = (
            fit_drapes(surface, trained, model=model, seed=seed).predicted[..., 0].mean(axis=0)
        )
        squares[model.value] = float(
            np.mean(
                [
                    np.square(face.means(0.0)[:, 0] - several[n]).mean()
                    for n, face in enumerate(left)
                ]
            )
        )
    return {
        "left_out": list(out),
        "predicted": predicted,
        "interval": interval(base.predicted[:, 0, 0]),
        "measured": measured,
        "tolerance": tolerance,
        "passed": abs(predicted - measured) <= tolerance,
        "squares": squares,
    }


def answer(fit: Fit, weight: float) -> Mapping[str, Any]:
    """Returns bending length [mm], bending [µN·m] and the ratio of the threads, with intervals."""
    length = fit.cloth[BENDING_LENGTH.name]
    return {
        "bending_length_mm": interval(length * 1e3),
        "bending_uN_m": interval(length**3 * weight * -GRAVITY[2] * 1e6),
        "ratio": interval(np.array([ratio(float(a)) for a in fit.cloth["anisotropy"][::20]])),
        "direction_deg": float(np.degrees(fit.direction)),
        "tail": fit.tail,
    }


def lobes(faces: list[Face], direction: float) -> list[float]:
    """Computes the difference of the faces' lobes and its standard error."""
    first, second = (face.means(direction)[:, 1] for face in faces)
    difference = second - first
    return [float(difference.mean()), float(difference.std(ddof=1) / np.sqrt(len(difference)))]


def interval(draws: np.ndarray) -> list[float]:
    """Returns median and ends of the interval."""
    return np.quantile(draws, [0.5, (1 - LEVEL) / 2, (1 + LEVEL) / 2]).tolist()
