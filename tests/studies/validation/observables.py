"""What the observables of films are off by: pixels against geometry on ArcSim's runs filmed by VTK.

Each film of the list of `vtk_films.designs` that shows one whole flag is read in windows of 2.5 s,
and the same windows are taken from the motion that was filmed, projected by the film's own camera.
Pixels less geometry gives each observable's bias and sigma. The hoist's known height is the only
size that pixels get. FLAGDATA_FILMS names the folder of the films, FLAGDATA_FILMS_ONLY gives
patterns of their names. Films that were read are kept in `out`, so that a run that was stopped goes
on.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.core.arrays import FloatArray
from flagdata.errors import FlagdataError
from measure.film import FilmReading, FlagSize, subjects
from measure.observables import OBSERVABLES, ClothWindow, Observable, edges_of, watch_film
from tests.evidence import ABSENT, REFERENCE
from tests.studies.validation.films import chosen
from tests.studies.validation.vtk_films.designs import Design, designs, scene_of
from tests.studies.validation.vtk_films.making import FOLDER, path_of
from tests.studies.validation.vtk_films.runs import HEIGHT, LENGTH, Motion, read

_LEAST_FILMS = 3
_LONGEST = 5.1
"""Of a film that is read [s]: two windows."""


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Bias and deviation of each observable, and the films."""
    del seed
    if not (REFERENCE / "arcsim").is_dir():
        return dict(ABSENT)
    wanted = [one for one in chosen(designs()) if one.part in ("coverage", "other air") and one.yaw]
    missing = [one.name for one in wanted if not path_of(one, FOLDER).exists()]
    if missing:
        return {
            "left_out": f"{len(missing)} films are missing: run `python -m tests.studies films` "
            "first"
        }
    kept = out / "observables-films"
    kept.mkdir(exist_ok=True)
    rows = [_once(one, kept / f"{one.name}.json") for one in wanted]
    sheet = {"summary": summary(rows), "films": rows}
    (out / "validate-observables.md").write_text(page(sheet), encoding="utf-8")
    return sheet


def _once(design: Design, path: Path) -> dict[str, Any]:
    if not path.exists():
        path.write_text(json.dumps(compared(design)), encoding="utf-8")
    return json.loads(path.read_text(encoding="utf-8"))


def compared(design: Design) -> dict[str, Any]:
    """Pixels and geometry of the windows of a film; NaN as None."""
    motion = read(REFERENCE, design.run)
    (subject,) = subjects(
        str(path_of(design, FOLDER)), query=None, lake=None, at=None, reading=FilmReading()
    )
    row: dict[str, Any] = {
        "name": design.name,
        "wind": motion.wind,
        "background": design.background,
        "texture": design.texture,
        "windows": [],
    }
    try:
        found = watch_film(subject.film, FlagSize(length=LENGTH, height=HEIGHT), last=_LONGEST)
    except FlagdataError as error:
        return {**row, "refused": error.what}
    for start, window in zip(found.starts.tolist(), found.windows, strict=True):
        if window is None:
            row["windows"].append(None)
            continue
        cloth = seen(design, motion, window.times)
        values = {}
        for name in OBSERVABLES:
            observable: Observable = OBSERVABLES[name]
            pixels, geometry = observable.of_film(window), observable.of_cloth(cloth)
            values[name] = {
                "pixels": _plain(pixels.value + observable.bias),
                "geometry": _plain(geometry.value),
                "reason": pixels.reason,
            }
        row["windows"].append({"start": start, "values": values})
    return row


def seen(design: Design, motion: Motion, times: FloatArray) -> ClothWindow:
    """The cloth of a window of a film as the film's camera projects it."""
    view = scene_of(design, motion).view
    outward, right = view.outward, view.right
    up = np.cross(right, -outward)
    relative = motion.at(design.start + times) - np.array(view.target)
    focal = 1 / math.tan(math.radians(view.view_angle) / 2)
    depth = view.distance - relative @ outward
    points = focal * np.stack([relative @ right, relative @ up], axis=-1) / depth[..., None]
    hoist, free = edges_of(motion.rest)
    height = float((points[:, hoist[0], 1] - points[:, hoist[-1], 1]).mean())
    return ClothWindow(
        times=times,
        points=points * HEIGHT / height,
        faces=motion.faces,
        hoist=hoist,
        free=free,
        length=LENGTH,
        height=HEIGHT,
    )


def summary(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """By observable: the mean of pixels less geometry, its standard error by films, and the
    deviation of a window."""
    found: dict[str, Any] = {}
    for name in OBSERVABLES:
        films, apart, unseen = [], [], 0
        for row in rows:
            own = [
                one["values"][name]
                for one in row["windows"]
                if one is not None and name in one["values"]
            ]
            unseen += len(row["windows"]) - len(own)
            both = [
                one["pixels"] - one["geometry"]
                for one in own
                if None not in (one["pixels"], one["geometry"])
            ]
            unseen += sum(one["pixels"] is None for one in own)
            apart += both
            if both:
                films.append(float(np.mean(both)))
        if len(films) < _LEAST_FILMS:
            found[name] = {"films": len(films), "windows": len(apart), "unseen": unseen}
            continue
        middle = float(np.median(apart))
        found[name] = {
            "films": len(films),
            "windows": len(apart),
            "unseen": unseen,
            "bias": float(np.mean(apart)),
            "error": float(np.std(films, ddof=1) / math.sqrt(len(films))),
            "sigma": float(np.std(apart, ddof=1)),
            "median": middle,
            "robust_sigma": float(1.4826 * np.median(np.abs(np.array(apart) - middle))),
        }
    return found


def page(sheet: Mapping[str, Any]) -> str:
    """The sheet in Markdown."""
    lines = [
        "# Observables: pixels against geometry",
        "",
        (
            f"ArcSim's runs filmed by VTK, {len(sheet['films'])} films, windows of 2.5 s; pixels "
            "less geometry, before "
            "the bias that `flagdata observe` takes off. The error is the bias's, by films "
            "(`python -m tests.studies observables`)."
        ),
        "",
        (
            "| observable | unit | films | windows | not shown | bias | error | sigma | median | "
            "robust sigma |"
        ),
        "|---|---|---|---|---|---|---|---|---|---|",
    ]
    for name, own in sheet["summary"].items():
        unit, head = (
            OBSERVABLES[name].unit,
            f"| {own['films']} | {own['windows']} | {own['unseen']} |",
        )
        if "bias" not in own:
            lines.append(f"| {name} | {unit} {head} | | | | |")
            continue
        lines.append(
            f"| {name} | {unit} {head} {own['bias']:+.3f} | {own['error']:.3f} | "
            f"{own['sigma']:.3f} | "
            f"{own['median']:+.3f} | {own['robust_sigma']:.3f} |"
        )
    lines += [
        "",
        "| film | wind [m/s] | cloth | behind it | droop, pixels and geometry [rad] | extension |",
    ]
    lines += ["|---|---|---|---|---|---|"]
    for row in sheet["films"]:
        cells = [_cell(row, name) for name in ("droop", "extension")]
        lines.append(
            f"| {row['name']} | {row['wind']:g} | {row['texture']} | {row['background']} | "
            f"{cells[0]} | {cells[1]} |"
        )
    return "\n".join(lines) + "\n"


def _cell(row: Mapping[str, Any], name: str) -> str:
    if "refused" in row:
        return f"refused: {row['refused']}"
    own = [
        one["values"][name] for one in row["windows"] if one is not None and name in one["values"]
    ]
    shown = [
        f"{one['pixels']:.3f} ({one['geometry']:.3f})" for one in own if one["pixels"] is not None
    ]
    return ", ".join(shown) or "not shown"


def _plain(value: float) -> float | None:
    return None if math.isnan(value) else value
