"""The card of a data set that was built: what is in it, how it was made, what it looks like. One
HTML file."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from markupsafe import Markup
from PIL import Image

from flagdata.answer.answer import Answer, Figure, Head, Part, Section, Table
from flagdata.answer.charts import Axis, Bins, Chart, Panel
from flagdata.core.arrays import UInt8Array
from flagdata.core.files.outputs import check_file, rewrite, write_file
from flagdata.core.json_values import json_values
from flagdata.core.numbered import by_numbers
from flagdata.core.printable import size_text
from flagdata.core.provenance import canonical
from flagdata.core.rng import stream
from flagdata.core.schema import Kind
from flagdata.lake import Lake
from flagdata.pages.page_pictures import still
from flagdata.recipes.documents import column_json
from flagdata.record import Record
from flagdata.storage import Place
from sim.datasets.cast import casts
from sim.datasets.dataset_recipe import DatasetRecipe, Truth

_COMMAND = "build"
_SHOWN = 24  # pictures of the contact sheet
_COLUMNS = 6
_PICTURE = 160  # px
_BINS = 20
_IN_A_ROW = 5  # histograms
_ABOUT_SHEET = "The middle frames of films drawn by chance, as they are stored."
_ABOUT_THETA = "SI units; over all films, so that a sequence counts as often as it was filmed."
_TRUTHS = {
    Truth.STATED: "the simulated wind, exactly",
    Truth.MEASURED: "the mean of the anemometer's minute, with its uncertainty",
}


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


@dataclass(frozen=True, kw_only=True)
class HeldSide:
    """What a side holds in the lake.

    Attributes:
        name: of the side.
        sequences, sessions, films, clips: how many.
        wind: least, median and greatest of the clips [m/s]; None where no clip has any.
    """

    name: str
    sequences: int
    sessions: int
    films: int
    clips: int
    wind: tuple[float, float, float] | None


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
    text = card_answer(lake, recipe, branch=branch).page
    if path is not None:
        write_file(path, text, command=_COMMAND)
        return path
    target = lake.path / "cards" / f"{recipe.name}-{recipe.hash[:12]}.html"
    if isinstance(target, Path):
        rewrite(target, text)
    else:
        target.write_bytes(text.encode())
    return target


def card_answer(lake: Lake, recipe: DatasetRecipe, *, branch: str = "main") -> Answer:
    """Returns what a data set holds, how it was made and what it looks like."""
    sides, rows = _sides(lake, recipe, branch)
    parameters = [
        column_json(row["parameters"], "parameters", artifact=row["artifact"]) for row in rows
    ]
    size = sum(row["object_bytes"] for row in rows)
    clips = sum(side.clips for side in sides)
    known = "is known" if recipe.anemometer.truth == Truth.STATED else "an anemometer measured"
    sheet = _sheet(lake, recipe, rows)
    return Answer(
        question=_COMMAND,
        subject=f"{recipe.name}: {recipe.title}",
        sentence=f"{len(rows):,} simulated films with {clips:,} clips whose wind {known}",
        document=json_values({"name": recipe.name, "recipe_hash": recipe.hash, "sides": sides}),
        head=Head(
            figures=[
                Figure(
                    title="contact sheet of films",
                    content=sheet,
                    caption=_ABOUT_SHEET,
                    width=_COLUMNS * _PICTURE,
                )
            ]
            if sheet
            else [],
            facts={
                "films": f"{_frames(recipe)}, {size_text(size)} in all",
                "ground truth": _TRUTHS[recipe.anemometer.truth],
                "renderer": recipe.renderer,
                "licence": recipe.licence,
            },
        ),
        make_sections=lambda: [*_sections(recipe, sides, parameters)],
        provenance={"recipe": recipe.hash, "branch": branch},
    )


def _sections(
    recipe: DatasetRecipe, sides: Sequence[HeldSide], parameters: Sequence[dict[str, Any]]
) -> Iterator[Section]:
    together = ", whole sessions together" if recipe.sessions else ""
    yield Section(
        title="Sides",
        parts=[
            f"Split by the seed of the mesh sequence{together}; no sequence is on two sides.",
            _table_of_sides(sides),
        ],
        anchor="sides",
    )
    yield Section(
        title="How the sides are read",
        parts=[_preformatted(_reading(recipe, sides))],
        folded=True,
    )
    for title, about, rendered in (
        ("What was simulated (θ), and the instruments", _ABOUT_THETA, False),
        ("How it was filmed (ζ)", "", True),
    ):
        parts: list[Part] = [about] if about else []
        parts += _parts_of(distributions(parameters, rendered=rendered), title)
        yield Section(title=title, parts=parts, folded=True)
    names = {
        name: ", ".join(f"{value} {count}" for value, count in counts)
        for name, counts in _names(parameters)
    }
    yield Section(title="Names", parts=[Table.of_values(names)], folded=True)
    text = json.dumps(json.loads(canonical(recipe.identity())), indent=1)
    yield Section(title="Recipe", parts=[_preformatted(text)], folded=True)


def _table_of_sides(sides: Sequence[HeldSide]) -> Table:
    return Table(
        columns=(
            "side",
            "sequences",
            "sessions",
            "films",
            "clips",
            "wind of clips, least, median, greatest [m/s]",
        ),
        rows=[
            (
                side.name,
                str(side.sequences),
                str(side.sessions or "–"),
                str(side.films),
                str(side.clips),
                "–" if side.wind is None else ", ".join(f"{value:.2f}" for value in side.wind),
            )
            for side in sides
        ],
    )


def _reading(recipe: DatasetRecipe, sides: Sequence[HeldSide]) -> str:
    """Writes the lines of Python that read the sides."""
    dataset = json.dumps(recipe.name, ensure_ascii=False)
    where = "".join(
        f'    "{side.name}": {{"dataset": {dataset}, "side": "{side.name}"}},\n' for side in sides
    )
    return (
        "import flagdata\nfrom flagdata.dataset import ExplicitSplit\n\n"
        f"split = ExplicitSplit(where={{\n{where}}})\n"
        'pairs = flagdata.open("lake").pairs(split="train", split_by=split)'
    )


def _preformatted(text: str) -> Markup:
    return Markup("<pre>{}</pre>").format(text)


def _parts_of(entries: Sequence[Distribution], title: str) -> list[Part]:
    """Shows histograms, and least, median and greatest of each parameter; what is the same in all
    films in a sentence."""
    drawn = [entry for entry in entries if entry.counts is not None]
    fixed = [f"{entry.name} {entry.low:.4g}" for entry in entries if entry.counts is None]
    parts: list[Part] = []
    if drawn:
        rows = [
            (entry.name, *(f"{value:.4g}" for value in (entry.low, entry.middle, entry.high)))
            for entry in drawn
        ]
        parts = [
            Figure(title=f"Histograms: {title}", content=lambda: histograms(drawn)),
            Table(columns=("parameter", "least", "median", "greatest"), rows=rows),
        ]
    if fixed:
        parts.append(f"The same in all films: {', '.join(fixed)}.")
    return parts


def histograms(entries: Sequence[Distribution]) -> Chart:
    """Shows how often each value of each parameter is."""
    panels = [
        Panel(
            marks=[Bins(edges=np.linspace(e.low, e.high, len(e.counts) + 1), heights=e.counts)],
            title=e.name,
            x=Axis(ticks=[e.low, e.high], texts=[f"{e.low:.3g}", f"{e.high:.3g}"]),
            y=Axis(ticks=()),
        )
        for e in entries
        if e.counts is not None
    ]
    panels += [Panel(marks=(), framed=False)] * (-len(panels) % _IN_A_ROW)
    rows = [panels[i : i + _IN_A_ROW] for i in range(0, len(panels), _IN_A_ROW)]
    return Chart(rows=rows, height=1.05)


def _frames(recipe: DatasetRecipe) -> str:
    """Describes how many frames a film has, at each rate."""
    times = sorted(
        {(cast.simulation.time.rate, cast.simulation.time.frames) for cast in casts(recipe)}
    )
    return "; ".join(f"{frames} frames at {rate:g} Hz" for rate, frames in times)


def _sides(
    lake: Lake, recipe: DatasetRecipe, branch: str
) -> tuple[list[HeldSide], list[dict[str, Any]]]:
    """Counts what each side holds, and lists all recordings by name."""
    sides: list[HeldSide] = []
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
            HeldSide(
                name=side.name,
                sequences=len({row["seed"] for row in rows}),
                films=len(rows),
                sessions=len({row["session"] for row in rows} - {None}),
                clips=len(clips),
                wind=(float(clips.min()), float(np.median(clips)), float(clips.max()))
                if len(clips)
                else None,
            )
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
