"""The card of a data set that was built: what is in it, how it was made, what it looks like. One
HTML file."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from flagdata.core.arrays import UInt8Array
from flagdata.core.files.outputs import check_file, rewrite, write_file
from flagdata.core.numbered import by_numbers
from flagdata.core.provenance import canonical, code_version
from flagdata.core.rng import stream
from flagdata.core.schema import Kind
from flagdata.lake import Lake
from flagdata.pages.page_pictures import still
from flagdata.pages.render import render
from flagdata.recipes.documents import column_json
from flagdata.record import Record
from flagdata.storage import Place
from sim.datasets.cast import casts
from sim.datasets.dataset_recipe import DatasetRecipe

_COMMAND = "build"
_SHOWN = 24  # pictures of the contact sheet
_COLUMNS = 6
_PICTURE = 160  # px
_BINS = 20
_BAR = (120, 24)  # px of a histogram


@dataclass(frozen=True, kw_only=True)
class Distribution:
    """A parameter over all films.

    Attributes:
        name: in the catalog.
        low, middle, high: least value, median, greatest.
        counts: of equal bins between them; None where all are equal.
    """

    name: str
    low: float
    middle: float
    high: float
    counts: list[int] | None


def check(path: Path | None) -> None:
    """Refuse a path to which `write_card` cannot write, before anything is simulated; raises as
    `write_card`."""
    if path is not None:
        check_file(path, command=_COMMAND)


def write_card(
    lake: Lake, recipe: DatasetRecipe, *, branch: str = "main", path: Path | None = None
) -> Place:
    """Write the card of a data set, read off the lake.

    Args:
        path: the file; None for `cards/NAME-HASH.html` in the lake's folder, which is replaced.

    Returns:
        Where it is.

    Raises:
        ConflictError: `path` is there and is no card, or was changed since.
        InputError: its folder is not there or cannot be written.
    """
    sides, rows = _sides(lake, recipe, branch)
    parameters = [
        column_json(row["parameters"], "parameters", artifact=row["artifact"]) for row in rows
    ]
    values = {
        "recipe": recipe,
        "sides": sides,
        "version": code_version(),
        "branch": branch,
        "sheet": _sheet(lake, recipe, rows),
        "size": sum(row["object_bytes"] for row in rows),
        "frames": _frames(recipe),
        "bar": _BAR,
        "theta": distributions(parameters, rendered=False),
        "zeta": distributions(parameters, rendered=True),
        "names": _names(parameters),
        "recipe_text": json.dumps(json.loads(canonical(recipe.identity())), indent=1),
        "dataset": json.dumps(recipe.name, ensure_ascii=False),
    }
    text = render("sim.datasets", "card.html.j2", values)
    if path is not None:
        write_file(path, text, command=_COMMAND)
        return path
    target = lake.path / "cards" / f"{recipe.name}-{recipe.hash[:12]}.html"
    if isinstance(target, Path):
        rewrite(target, text)
    else:
        target.write_bytes(text.encode())
    return target


def _frames(recipe: DatasetRecipe) -> str:
    """Describes how many frames a film has, at each rate."""
    times = sorted(
        {(cast.simulation.time.rate, cast.simulation.time.frames) for cast in casts(recipe)}
    )
    return "; ".join(f"{frames} frames at {rate:g} Hz" for rate, frames in times)


def _sides(
    lake: Lake, recipe: DatasetRecipe, branch: str
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Counts what each side holds, and lists all recordings by name."""
    sides: list[dict[str, Any]] = []
    recordings: list[dict[str, Any]] = []
    columns = ["artifact", "name", "seed", "session", "parameters", "object", "object_bytes"]
    for side in recipe.sides:
        of_side = {"dataset": recipe.name, "side": side.name}
        rows = lake.rows(
            {**of_side, "kind": Kind.RECORDING}, at=branch, columns=columns
        ).to_pylist()
        clips = (
            lake.rows({**of_side, "kind": Kind.CLIP}, at=branch, columns=["wind"])["wind"]
            .drop_null()
            .to_numpy()
        )
        sides.append(
            {
                "name": side.name,
                "sequences": len({row["seed"] for row in rows}),
                "films": len(rows),
                "sessions": len({row["session"] for row in rows} - {None}),
                "clips": len(clips),
                "seeds": (min(row["seed"] for row in rows), max(row["seed"] for row in rows))
                if rows
                else None,
                "wind": (float(clips.min()), float(np.median(clips)), float(clips.max()))
                if len(clips)
                else None,
            }
        )
        recordings += sorted(rows, key=lambda row: row["name"])
    return sides, recordings


def distributions(parameters: Sequence[dict[str, Any]], *, rendered: bool) -> list[Distribution]:
    """Returns distributions of all numbers of ζ, or of θ and the instruments, by name.

    Args:
        parameters: of each film.
    """
    names = dict.fromkeys(
        name
        for values in parameters
        for name, value in values.items()
        if not isinstance(value, str)
    )
    histograms: list[Distribution] = []
    for name in names:
        if name.startswith("render.") != rendered:
            continue
        values = np.array([entry[name] for entry in parameters if name in entry], dtype=np.float64)
        low, high = float(values.min()), float(values.max())
        counts = (
            None
            if math.isclose(low, high)
            else np.histogram(values, bins=_BINS, range=(low, high))[0].tolist()
        )
        histograms.append(
            Distribution(
                name=name.removeprefix("render."),
                low=low,
                middle=float(np.median(values)),
                high=high,
                counts=counts,
            )
        )
    return sorted(histograms, key=lambda distribution: by_numbers(distribution.name))


def _names(parameters: Sequence[dict[str, Any]]) -> list[tuple[str, list[tuple[str, int]]]]:
    """Counts the films of each material, texture and kind of background."""
    counts_by_name: dict[str, dict[str, int]] = {}
    for values in parameters:
        for name, value in values.items():
            if isinstance(value, str):
                label = value.partition("/")[0] if name == "render.background" else value
                counts = counts_by_name.setdefault(name.removeprefix("render."), {})
                counts[label] = counts.get(label, 0) + 1
    return [(name, sorted(counts.items())) for name, counts in sorted(counts_by_name.items())]


def _sheet(lake: Lake, recipe: DatasetRecipe, rows: Sequence[dict[str, Any]]) -> str:
    """Frames of a few films drawn by chance, as a data URL."""
    order = stream(recipe.seed, "card").permutation(len(rows))[:_SHOWN].tolist()
    pictures: list[UInt8Array] = []
    for number in order:
        record = Record.open(lake.record_place(rows[number]["object"]))
        frame = record.frames(record.frame_count // 2, 1)[0]
        shape = Image.fromarray(frame)
        shape.thumbnail((_PICTURE, _PICTURE))
        cell = np.full((_PICTURE, _PICTURE), 255, dtype=np.uint8)
        cell[: shape.height, : shape.width] = np.asarray(shape)
        pictures.append(cell)
    if not pictures:
        return ""
    blank = np.full((_PICTURE, _PICTURE), 255, dtype=np.uint8)
    pictures += [blank] * (-len(pictures) % _COLUMNS)
    lines = [
        np.concatenate(pictures[i : i + _COLUMNS], axis=1)
        for i in range(0, len(pictures), _COLUMNS)
    ]
    return still(np.concatenate(lines))
