"""The evaluation as a page (HTML that refers to no other file), as Markdown and as a JSON document."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from markupsafe import Markup

from flagdata.errors import UsageError
from flagdata.markdown import plain
from flagdata.markdown import table as markdown_table
from flagdata.outputs import check_files, write_files
from flagdata.pages.render import render
from flagdata.provenance import code_version
from models.evaluation import figures, paper, table
from models.evaluation.bootstrap import LEVEL
from models.evaluation.calibration import BAND
from models.evaluation.evaluation import Evaluation, as_document

_COMMAND = "evaluate"


@dataclass(frozen=True, kw_only=True)
class Line:
    """A row of a table for people: cells as lines, the value first; `run` marks one run of the model above."""

    cells: tuple[tuple[str, ...], ...]
    run: bool = False


@dataclass(frozen=True, kw_only=True)
class Grid:
    """A table for people."""

    head: tuple[str, ...]
    body: tuple[Line, ...]


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A chart of the page."""

    title: str
    svg: Markup
    caption: str
    square: bool = False


def write(found: Evaluation, folder: Path, *, name: str = "evaluation") -> tuple[Path, Path, Path]:
    """Write NAME.html, NAME.json and NAME.md into `folder`, which is made; returns their paths.

    Raises:
        ConflictError: one of them is there and was not written by an evaluation, or was changed since.
    """
    document = json.dumps(as_document(found), indent=2, allow_nan=False, ensure_ascii=False) + "\n"
    names = _names(name)
    write_files(folder, dict(zip(names, (page(found), document, markdown(found)), strict=True)), command=_COMMAND)
    page_path, document_path, text_path = (folder / each for each in names)
    return page_path, document_path, text_path


def check(folder: Path, *, name: str) -> None:
    """Refuse a folder in which `write` cannot write, before anything is evaluated; raises as `write`.

    Raises:
        UsageError: a name that is more than the name of a file.
    """
    if name != Path(name).name:
        raise UsageError(f"{name!r} is not a file's name", where="--name", fix="give a name, and the folder by --out")
    check_files(folder, *_names(name), command=_COMMAND)


def _names(name: str) -> tuple[str, str, str]:
    return f"{name}.html", f"{name}.json", f"{name}.md"


def page(found: Evaluation) -> str:
    """The page, HTML."""
    values = {
        "found": found,
        "counts": _counts(found),
        "legend": table.LEGEND,
        "warning": paper.WARNING,
        "tables": {title: make(found) for title, make in _TABLES.items()},
        "figures": _pictures(found),
        "version": f"flagdata {code_version()}",
    }
    return render("models.evaluation", "page.html.j2", values)


def markdown(found: Evaluation) -> str:
    """The tables and their warnings as Markdown, names of models and data sets as text; the charts are the page's."""
    parts = [f"# Models compared on {plain(found.data)}", _counts(found)]
    parts += [
        f"**Warning:** {plain(f'{finding.where}: {finding.what}' if finding.where else finding.what)}."
        for finding in found.findings
    ]
    parts += [_grid(_models(found)), table.LEGEND, "## What the paper printed", paper.WARNING, _grid(_paper(found))]
    for title, made in (
        (f"## Against {plain(found.reference or '')}, pair by pair", _differences(found)),
        ("## Every target", _targets(found)),
        ("## Linear readout of the embedding", _linear(found)),
        ("## Learning curve", _learning(found)),
        ("## Triplet accuracy against frames", _frames(found)),
    ):
        if made is not None:
            parts += [title, _grid(made)]
    parts.append(f"flagdata {code_version()}, seed {found.seed}.")
    return "\n\n".join(parts) + "\n"


def _grid(made: Grid) -> str:
    return markdown_table(made.head, (line.cells for line in made.body))


def _counts(found: Evaluation) -> str:
    return (
        f"{found.clips:,} clips of {found.groups:,} sequences that no model was trained on; intervals are of "
        f"{100 * LEVEL:.0f} % over sequences."
    )


def _models(found: Evaluation) -> Grid:
    return Grid(
        head=tuple(column.heading for column in table.COLUMNS),
        body=tuple(
            Line(cells=tuple(column.cell(row) for column in table.COLUMNS), run=row.run is not None)
            for row in found.rows
        ),
    )


def _paper(found: Evaluation) -> Grid:
    del found
    return Grid(
        head=("model, quoted", "input", "RMSE", "bound", "Acc@0.5", ""),
        body=tuple(
            Line(
                cells=(
                    (row.model,),
                    (row.input_size,),
                    (f"{row.rmse:.3f}",),
                    (f"≥ {row.bound:.3f}",),
                    (f"{row.accuracy:.3f}",),
                    ("breaks the bound" if row.breaks_bound else "",),
                )
            )
            for row in paper.FLAGSIM
        ),
    )


_METRICS = {
    "rmse": "wind RMSE [m/s]",
    "accuracy": "Acc@0.5",
    "density_error": "area weight error / spread",
    "triplets": "triplet accuracy",
}
_SCORES = {
    "rmse": "RMSE (SI)",
    "relative_error": "RMSE / spread",
    "bias": "bias (SI)",
    "r_squared": "R²",
    "pearson": "Pearson r",
}


def _differences(found: Evaluation) -> Grid | None:
    if not found.differences:
        return None
    by_model = {
        label: {one.metric: one for one in found.differences if one.label == label}
        for label in dict.fromkeys(one.label for one in found.differences)
    }
    metrics = [name for name in _METRICS if any(name in of for of in by_model.values())]

    def cell(of: dict[str, table.Difference], name: str) -> tuple[str, ...]:
        if name not in of:
            return ("–",)
        lines = table.cell(of[name].difference, 3)
        return (*lines, "beyond the interval") if of[name].apart else lines

    return Grid(
        head=("model", *(_METRICS[name] for name in metrics)),
        body=tuple(Line(cells=((label,), *(cell(of, name) for name in metrics))) for label, of in by_model.items()),
    )


def _targets(found: Evaluation) -> Grid:
    ordered = sorted(found.targets, key=lambda row: [r.target for r in found.targets].index(row.target))

    def cells(row: table.TargetRow) -> tuple[tuple[str, ...], ...]:
        own = table.digits(row.scores["rmse"].value)
        return tuple(table.cell(row.scores[name], own if name in ("rmse", "bias") else 3) for name in _SCORES)

    return Grid(
        head=("target", "model", *_SCORES.values()),
        body=tuple(Line(cells=((row.target,), (row.label,), *cells(row))) for row in ordered),
    )


def _linear(found: Evaluation) -> Grid | None:
    if not found.reads:
        return None
    return Grid(
        head=("model", "data", "components", "quantity", "Pearson r"),
        body=tuple(
            Line(cells=((of.label,), (of.data,), (str(of.readout.components),), (target,), table.cell(r, 3)))
            for of in found.reads
            for target, r in zip(of.readout.targets, of.readout.pearson, strict=True)
        ),
    )


def _learning(found: Evaluation) -> Grid | None:
    if not found.learning:
        return None
    return Grid(
        head=("model", "sequences", "wind RMSE [m/s]"),
        body=tuple(Line(cells=((p.label,), (f"{p.sequences:,}",), _ends(p.rmse, p.interval))) for p in found.learning),
    )


def _frames(found: Evaluation) -> Grid | None:
    if not found.frames:
        return None
    quoted = tuple(
        Line(cells=(("SDN, quoted from the paper",), (str(size),), (f"{accuracy:.3f}",)))
        for size, accuracy in paper.TRIPLETS
    )
    own = tuple(Line(cells=((p.label,), (str(p.frames),), _ends(p.accuracy, p.interval))) for p in found.frames)
    return Grid(head=("model", "frames", "triplet accuracy"), body=(*own, *quoted))


def _ends(value: float, interval: tuple[float, float]) -> tuple[str, ...]:
    return (f"{value:.3f}", f"[{interval[0]:.3f}, {interval[1]:.3f}]")


_TABLES: dict[str, Callable[[Evaluation], Grid | None]] = {
    "models": _models,
    "paper": _paper,
    "differences": _differences,
    "targets": _targets,
    "linear": _linear,
}


def _pictures(found: Evaluation) -> list[Picture]:
    made = []
    if found.wind_errors:
        made.append(
            Picture(
                title="Error against wind",
                svg=figures.error_against_wind(found.wind_errors),
                caption="Clips by true wind in bins of 1 m/s; means over runs. Shaded: intervals over sequences, none "
                "where a bin has one sequence only.",
            )
        )
    if found.calibrations:
        made += [
            Picture(
                title="Calibration",
                svg=figures.calibration(found.calibrations, found.expected),
                caption="Share of truths inside central intervals, over their nominal level. Below the dashed line "
                "distributions are too narrow or biased, above it too wide. TARP (Lemos et al. 2023) tests all targets "
                "together.",
            ),
            Picture(
                title="Ranks of the truth among the draws",
                svg=figures.ranks(found.calibrations),
                caption="Flat if calibrated (Talts et al. 2018); a hump is too wide, a trough too narrow, a slope "
                f"biased. Shaded: where at least {100 * BAND:.0f} % of the shares of a calibrated model lie, bin by "
                "bin, sequences being independent and clips of one sequence not.",
            ),
        ]
    if found.learning:
        made.append(
            Picture(
                title="Learning curve",
                svg=figures.learning(found.learning),
                caption="Error on the same test sequences after training on more of them; both axes are logarithmic.",
            )
        )
    if found.frames:
        made.append(
            Picture(
                title="Triplet accuracy against frames",
                svg=figures.frames(found.frames),
                caption="How often a clip lies nearer to one of its own simulation than to one of another.",
            )
        )
    if found.layout is not None:
        made.append(
            Picture(
                title=f"t-SNE of the embedding of {found.layout.label}",
                svg=figures.t_sne(found.layout),
                caption=f"{len(found.layout.wind):,} of {found.layout.clips:,} clips. Distances between clusters and "
                "their sizes mean nothing.",
                square=True,
            )
        )
    return made
