"""The evaluation as a page (HTML that refers to no other file), as Markdown and as a JSON document.

The report's charts as SVG that takes its colours from the page, so that they follow its light or
dark style.
"""

from __future__ import annotations

import io
import json
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from markupsafe import Markup
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator

from flagdata.answer.markdown import plain
from flagdata.answer.markdown import table as markdown_table
from flagdata.core.files.outputs import check_files, write_files
from flagdata.core.provenance import code_version
from flagdata.errors import UsageError
from flagdata.pages.render import render
from models.evaluation import paper, score_table
from models.evaluation.bootstrap import LEVEL
from models.evaluation.curves import FramesPoint, LearningPoint
from models.evaluation.evaluation import (
    CalibrationCurve,
    Evaluation,
    Expected,
    WindError,
    as_document,
)
from models.evaluation.predictive_calibration import BAND, CURVE, LEVELS, Coverage
from models.evaluation.tsne import TsneLayout

_INK, _QUIET, _RULE = "#1c2326", "#56646b", "#d5dbde"
_SERIES = (
    "#1f6f9c",
    "#b4531a",
    "#7a4a9a",
    "#2f8068",
    "#97700d",
    "#a8402d",
    "#5b6fb8",
    "#a84a7e",
    "#58702a",
    "#6b5848",
)
_MARKERS = "osD^vPX<>h"
_THEME = {_INK: "--ink", _QUIET: "--quiet", _RULE: "--rule"} | {
    colour: f"--series-{number}" for number, colour in enumerate(_SERIES)
}
_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "flagdata",
    "font.size": 9,
    "text.color": _INK,
    "axes.edgecolor": _QUIET,
    "axes.labelcolor": _INK,
    "xtick.color": _QUIET,
    "ytick.color": _QUIET,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": _RULE,
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "legend.frameon": False,
    "axes.titlesize": 9,
    "font.family": "DejaVu Sans",
    "text.parse_math": False,
}
_WIDTH = 9.2  # inches, 72 units each


def _svg(figure: Figure, name: str) -> Markup:
    """Renders the figure as an inline element whose ids start with `name`, so that several fit into
    one page."""
    target = io.StringIO()
    figure.savefig(target, format="svg", transparent=True, metadata={"Date": None})
    text = target.getvalue()
    head, tail = text[text.index("<svg") :].split(">", 1)
    text = re.sub(r' (width|height)="[^"]*"', "", head) + ">" + tail
    text = re.sub(r"(\bid=\"|url\(#|href=\"#)", rf"\g<1>{name}-", text)
    for colour, variable in _THEME.items():
        text = text.replace(colour, f"var({variable})")
    return Markup(text)


def _panels(count: int, height: float) -> tuple[Figure, list[Axes]]:
    figure = Figure(figsize=(_WIDTH, height), layout="constrained")
    return figure, list(figure.subplots(1, count, squeeze=False)[0])


def _legend(figure: Figure, axes: Axes) -> None:
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="outside lower center", ncols=min(4, len(labels)), fontsize=8
    )


@dataclass(frozen=True, kw_only=True)
class Look:
    """How a model is drawn in a chart."""

    colour: str
    marker: str


def _look(labels: Iterable[str]) -> dict[str, Look]:
    """Assigns a colour and a marker to each label."""
    return {
        label: Look(
            colour=_SERIES[i % len(_SERIES)],
            marker=_MARKERS[(i + i // len(_SERIES)) % len(_MARKERS)],
        )
        for i, label in enumerate(dict.fromkeys(labels))
    }


def _interval_line(
    axes: Axes,
    x: Sequence[float],
    value: Sequence[float],
    ends: Sequence[tuple[float, float]],
    label: str,
    look: Look,
) -> None:
    low, high = np.array(ends, dtype=float).T
    axes.fill_between(x, low, high, color=look.colour, alpha=0.13, linewidth=0)
    axes.plot(
        x, value, label=label, markersize=3.5, linewidth=1.3, color=look.colour, marker=look.marker
    )


def error_against_wind(errors: Sequence[WindError]) -> Markup:
    """Draws RMSE and bias over the true wind, one line a model, with intervals over sequences."""
    with mpl.rc_context(_STYLE):
        figure, (rmse_panel, bias_panel) = _panels(2, 3.6)
        look = _look(model.label for model in errors)
        for model in errors:
            middle = [(b.low + b.high) / 2 for b in model.bins]
            for axes, scores in (
                (rmse_panel, [b.rmse for b in model.bins]),
                (bias_panel, [b.bias for b in model.bins]),
            ):
                ends = [(s.low, s.high) for s in scores]
                _interval_line(
                    axes, middle, [s.value for s in scores], ends, model.label, look[model.label]
                )
        rmse_panel.set(xlabel="true wind speed [m/s]", ylabel="RMSE [m/s]", ylim=(0, None))
        bias_panel.axhline(0, color=_QUIET, linewidth=0.8)
        bias_panel.set(xlabel="true wind speed [m/s]", ylabel="bias [m/s]")
        _legend(figure, rmse_panel)
        return _svg(figure, "wind")


def calibration(curves: Sequence[CalibrationCurve], expected: Sequence[Expected]) -> Markup:
    """Draws covered over nominal shares: a panel a target, and one for all targets together."""
    targets = list(dict.fromkeys(curve.target for curve in curves))
    look = _look(curve.label for curve in curves)
    with mpl.rc_context(_STYLE):
        columns = min(3, len(targets) + 1)
        lines = -(-(len(targets) + 1) // columns)
        figure = Figure(figsize=(_WIDTH, 3.1 * lines + 0.4), layout="constrained")
        panels = list(figure.subplots(lines, columns, squeeze=False).flat)
        for axes, target in zip(panels, targets, strict=False):
            for curve in curves:
                if curve.target == target:
                    _coverage(axes, curve.label, curve.curve, look[curve.label])
            axes.set(
                title=target, xlabel="nominal level of the central interval", ylabel="share covered"
            )
        joint = panels[len(targets)]
        for curve in expected:
            _coverage(joint, curve.label, curve.curve, look[curve.label])
        joint.set(
            title="all targets together (TARP)", xlabel="nominal level", ylabel="expected coverage"
        )
        for axes in panels[: len(targets) + 1]:
            axes.plot([0, 1], [0, 1], color=_QUIET, linewidth=0.9, linestyle="--")
            axes.set(xlim=(0, 1), ylim=(0, 1), aspect="equal")
        for axes in panels[len(targets) + 1 :]:
            axes.set_axis_off()
        _legend(figure, panels[0])
        return _svg(figure, "calibration")


def _coverage(axes: Axes, label: str, curve: tuple[Coverage, ...], look: Look) -> None:
    x = [point.level for point in curve]
    value = [point.share.value for point in curve]
    ends = np.array([(point.share.low, point.share.high) for point in curve])
    axes.fill_between(x, ends[:, 0], ends[:, 1], color=look.colour, alpha=0.13, linewidth=0)
    axes.plot(x, value, label=label, linewidth=1.3, color=look.colour)
    table = [i for i, level in enumerate(x) if level in LEVELS and level in CURVE]
    axes.plot(
        [x[i] for i in table],
        [value[i] for i in table],
        linestyle="none",
        markersize=3.5,
        color=look.colour,
        marker=look.marker,
    )


def ranks(curves: Sequence[CalibrationCurve]) -> Markup:
    """Draws rank histograms, a row a model, a panel a target, with the band of a calibrated
    model."""
    labels = list(dict.fromkeys(curve.label for curve in curves))
    columns = max(sum(curve.label == label for curve in curves) for label in labels)
    look = _look(labels)
    top = 1.15 * max(max(*curve.ranks.share, curve.ranks.high) for curve in curves)
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(_WIDTH, 1.8 * len(labels) + 0.3), layout="constrained")
        grid = figure.subplots(len(labels), columns, squeeze=False, sharey=True)
        for line, label in zip(grid, labels, strict=True):
            of_model = [curve for curve in curves if curve.label == label]
            for axes, curve in zip(line, of_model, strict=False):
                edges = np.linspace(0, 1, len(curve.ranks.share) + 1)
                axes.axhspan(
                    curve.ranks.low, curve.ranks.high, color=_QUIET, alpha=0.18, linewidth=0
                )
                axes.stairs(curve.ranks.share, edges, color=look[label].colour, linewidth=1.4)
                axes.set(title=f"{label}: {curve.target}", xlim=(0, 1), ylim=(0, top))
            line[0].set_ylabel("share of clips")
            for axes in line[len(of_model) :]:
                axes.set_axis_off()
        for axes in grid[-1]:
            axes.set_xlabel("rank of the truth / (draws + 1)")
        return _svg(figure, "ranks")


def learning(points: Sequence[LearningPoint]) -> Markup:
    """Draws RMSE over the number of sequences trained on, logarithmic both."""
    with mpl.rc_context(_STYLE):
        figure, (axes,) = _panels(1, 3.6)
        look = _look(point.label for point in points)
        for label in look:
            of_label = sorted(
                (point for point in points if point.label == label),
                key=lambda point: point.sequences,
            )
            ends = [point.interval for point in of_label]
            _interval_line(
                axes,
                [p.sequences for p in of_label],
                [p.rmse for p in of_label],
                ends,
                label,
                look[label],
            )
        axes.set(
            xscale="log", yscale="log", xlabel="sequences trained on", ylabel="wind RMSE [m/s]"
        )
        for axis, ticks in (
            (axes.xaxis, sorted({point.sequences for point in points})),
            (axes.yaxis, _round_ticks(points)),
        ):
            axis.set_ticks(ticks, [f"{tick:,g}" for tick in ticks])
            axis.set_minor_locator(NullLocator())
        _legend(figure, axes)
        return _svg(figure, "learning")


def _round_ticks(points: Sequence[LearningPoint]) -> list[float]:
    """Chooses ticks: 1, 2, 3 and 5 times powers of ten that span the intervals."""
    low, high = min(p.interval[0] for p in points), max(p.interval[1] for p in points)
    all_ticks = [digit * 10.0**power for power in range(-3, 2) for digit in (1, 2, 3, 5)]
    inside = [tick for tick in all_ticks if low / 1.6 <= tick <= high * 1.6]
    return [round(tick, 6) for tick in inside]


def frames(points: Sequence[FramesPoint]) -> Markup:
    """Draws triplet accuracy over the frames a model sees, beside the paper's."""
    with mpl.rc_context(_STYLE):
        figure, (axes,) = _panels(1, 3.2)
        look = _look(point.label for point in points)
        for label in look:
            of_label = sorted(
                (point for point in points if point.label == label), key=lambda point: point.frames
            )
            ends = [point.interval for point in of_label]
            _interval_line(
                axes,
                [p.frames for p in of_label],
                [p.accuracy for p in of_label],
                ends,
                label,
                look[label],
            )
        size, accuracy = zip(*paper.TRIPLETS, strict=True)
        axes.plot(
            size,
            accuracy,
            color=_QUIET,
            linestyle="--",
            linewidth=1.1,
            label="SDN, quoted from the paper",
        )
        axes.set(xlabel="frames", ylabel="triplet accuracy", ylim=(None, 1))
        _legend(figure, axes)
        return _svg(figure, "frames")


def t_sne(layout: TsneLayout) -> Markup:
    """Draws the embedding in the plane with the true wind as colour."""
    with mpl.rc_context(_STYLE):
        figure = Figure(figsize=(6.2, 5.0), layout="constrained", dpi=150)
        axes = figure.subplots()
        drawn = axes.scatter(
            *layout.places.T, c=layout.wind, s=9, cmap="viridis", linewidths=0, rasterized=True
        )
        figure.colorbar(drawn, ax=axes, label="true wind speed [m/s]").outline.set_visible(False)
        axes.set(xticks=[], yticks=[], aspect="equal")
        axes.spines[:].set_visible(False)
        return _svg(figure, "t-sne")


_COMMAND = "evaluate"


@dataclass(frozen=True, kw_only=True)
class TableLine:
    """A row of a table for people: cells as lines, the value first; `run` marks one run of the
    model above."""

    cells: tuple[tuple[str, ...], ...]
    run: bool = False


@dataclass(frozen=True, kw_only=True)
class Grid:
    """A table for people."""

    head: tuple[str, ...]
    body: tuple[TableLine, ...]


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A chart of the page."""

    title: str
    svg: Markup
    caption: str
    square: bool = False


def write(
    evaluation: Evaluation, folder: Path, *, name: str = "evaluation"
) -> tuple[Path, Path, Path]:
    """Writes NAME.html, NAME.json and NAME.md into `folder`, which is made; returns their paths.

    Raises:
        ConflictError: one of them is there and was not written by an evaluation, or was changed
            since.
    """
    document = (
        json.dumps(as_document(evaluation), indent=2, allow_nan=False, ensure_ascii=False) + "\n"
    )
    names = _names(name)
    write_files(
        folder,
        dict(zip(names, (page(evaluation), document, markdown(evaluation)), strict=True)),
        command=_COMMAND,
    )
    page_path, document_path, text_path = (folder / file for file in names)
    return page_path, document_path, text_path


def check(folder: Path, *, name: str) -> None:
    """Refuses a folder in which `write` cannot write, before anything is evaluated; raises as
    `write`.

    Raises:
        UsageError: a name that is more than the name of a file.
    """
    if name != Path(name).name:
        raise UsageError(
            f"{name!r} is not a file's name",
            where="--name",
            fix="give a name, and the folder by --out",
        )
    check_files(folder, *_names(name), command=_COMMAND)


def _names(name: str) -> tuple[str, str, str]:
    return f"{name}.html", f"{name}.json", f"{name}.md"


def page(evaluation: Evaluation) -> str:
    """Renders the page, HTML."""
    values = {
        "found": evaluation,
        "counts": _counts(evaluation),
        "legend": score_table.LEGEND,
        "warning": paper.WARNING,
        "tables": {title: make(evaluation) for title, make in _TABLES.items()},
        "figures": _pictures(evaluation),
        "version": f"flagdata {code_version()}",
    }
    return render("models.evaluation", "page.html.j2", values)


def markdown(evaluation: Evaluation) -> str:
    """Renders the tables and their warnings as Markdown, names of models and data sets as text; the
    charts are the page's."""
    parts = [f"# Models compared on {plain(evaluation.data)}", _counts(evaluation)]
    parts += [
        "**Warning:** "
        f"{plain(f'{finding.where}: {finding.what}' if finding.where else finding.what)}."
        for finding in evaluation.findings
    ]
    parts += [
        _grid(_models(evaluation)),
        score_table.LEGEND,
        "## What the paper printed",
        paper.WARNING,
        _grid(_paper(evaluation)),
    ]
    for title, grid in (
        (f"## Against {plain(evaluation.reference or '')}, pair by pair", _differences(evaluation)),
        ("## Every target", _targets(evaluation)),
        ("## Linear readout of the embedding", _linear(evaluation)),
        ("## Learning curve", _learning(evaluation)),
        ("## Triplet accuracy against frames", _frames(evaluation)),
    ):
        if grid is not None:
            parts += [title, _grid(grid)]
    parts.append(f"flagdata {code_version()}, seed {evaluation.seed}.")
    return "\n\n".join(parts) + "\n"


def _grid(grid: Grid) -> str:
    return markdown_table(grid.head, (line.cells for line in grid.body))


def _counts(evaluation: Evaluation) -> str:
    learned = (
        "that no model was trained on" if evaluation.unseen else "that models may have learned from"
    )
    return (
        f"{evaluation.clips:,} clips of {evaluation.groups:,} sequences {learned}; intervals are "
        "of "
        f"{100 * LEVEL:.0f} % over sequences."
    )


def _models(evaluation: Evaluation) -> Grid:
    return Grid(
        head=tuple(column.heading for column in score_table.COLUMNS),
        body=tuple(
            TableLine(
                cells=tuple(column.cell(row) for column in score_table.COLUMNS),
                run=row.run is not None,
            )
            for row in evaluation.rows
        ),
    )


def _paper(evaluation: Evaluation) -> Grid:
    del evaluation
    return Grid(
        head=("model, quoted", "input", "RMSE", "bound", "Acc@0.5", ""),
        body=tuple(
            TableLine(
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
    "area_weight_error": "area weight error / spread",
    "triplets": "triplet accuracy",
}
_SCORES = {
    "rmse": "RMSE (SI)",
    "relative_error": "RMSE / spread",
    "bias": "bias (SI)",
    "r_squared": "R²",
    "pearson": "Pearson r",
}


def _differences(evaluation: Evaluation) -> Grid | None:
    if not evaluation.differences:
        return None
    by_model = {
        label: {
            difference.metric: difference
            for difference in evaluation.differences
            if difference.label == label
        }
        for label in dict.fromkeys(difference.label for difference in evaluation.differences)
    }
    metrics = [name for name in _METRICS if any(name in of for of in by_model.values())]

    def cell(of: dict[str, score_table.Difference], name: str) -> tuple[str, ...]:
        if name not in of:
            return ("–",)
        lines = score_table.cell(of[name].difference, 3)
        return (*lines, "beyond the interval") if of[name].apart else lines

    return Grid(
        head=("model", *(_METRICS[name] for name in metrics)),
        body=tuple(
            TableLine(cells=((label,), *(cell(of, name) for name in metrics)))
            for label, of in by_model.items()
        ),
    )


def _targets(evaluation: Evaluation) -> Grid:
    ordered = sorted(
        evaluation.targets, key=lambda row: [r.target for r in evaluation.targets].index(row.target)
    )

    def cells(row: score_table.TargetRow) -> tuple[tuple[str, ...], ...]:
        decimals = score_table.digits(row.scores["rmse"].value)
        return tuple(
            score_table.cell(row.scores[name], decimals if name in ("rmse", "bias") else 3)
            for name in _SCORES
        )

    return Grid(
        head=("target", "model", *_SCORES.values()),
        body=tuple(TableLine(cells=((row.target,), (row.label,), *cells(row))) for row in ordered),
    )


def _linear(evaluation: Evaluation) -> Grid | None:
    if not evaluation.reads:
        return None
    return Grid(
        head=("model", "data", "components", "quantity", "Pearson r"),
        body=tuple(
            TableLine(
                cells=(
                    (of.label,),
                    (of.data,),
                    (str(of.readout.components),),
                    (target,),
                    score_table.cell(r, 3),
                )
            )
            for of in evaluation.reads
            for target, r in zip(of.readout.targets, of.readout.pearson, strict=True)
        ),
    )


def _learning(evaluation: Evaluation) -> Grid | None:
    if not evaluation.learning:
        return None
    return Grid(
        head=("model", "sequences", "wind RMSE [m/s]"),
        body=tuple(
            TableLine(cells=((p.label,), (f"{p.sequences:,}",), _ends(p.rmse, p.interval)))
            for p in evaluation.learning
        ),
    )


def _frames(evaluation: Evaluation) -> Grid | None:
    if not evaluation.frames:
        return None
    quoted = tuple(
        TableLine(cells=(("SDN, quoted from the paper",), (str(size),), (f"{accuracy:.3f}",)))
        for size, accuracy in paper.TRIPLETS
    )
    ours = tuple(
        TableLine(cells=((p.label,), (str(p.frames),), _ends(p.accuracy, p.interval)))
        for p in evaluation.frames
    )
    return Grid(head=("model", "frames", "triplet accuracy"), body=(*ours, *quoted))


def _ends(value: float, interval: tuple[float, float]) -> tuple[str, ...]:
    return (f"{value:.3f}", f"[{interval[0]:.3f}, {interval[1]:.3f}]")


_TABLES: dict[str, Callable[[Evaluation], Grid | None]] = {
    "models": _models,
    "paper": _paper,
    "differences": _differences,
    "targets": _targets,
    "linear": _linear,
}


def _pictures(evaluation: Evaluation) -> list[Picture]:
    pictures = []
    if evaluation.wind_errors:
        pictures.append(
            Picture(
                title="Error against wind",
                svg=error_against_wind(evaluation.wind_errors),
                caption="Clips by true wind in bins of 1 m/s; means over runs. Shaded: intervals "
                "over sequences, none "
                "where a bin has one sequence only.",
            )
        )
    if evaluation.calibrations:
        pictures += [
            Picture(
                title="Calibration",
                svg=calibration(evaluation.calibrations, evaluation.expected),
                caption="Share of truths inside central intervals, over their nominal level. Below "
                "the dashed line "
                "distributions are too narrow or biased, above it too wide. TARP (Lemos et al. "
                "2023) tests all targets "
                "together.",
            ),
            Picture(
                title="Ranks of the truth among the draws",
                svg=ranks(evaluation.calibrations),
                caption="Flat if calibrated (Talts et al. 2018); a hump is too wide, a trough too "
                "narrow, a slope "
                f"biased. Shaded: where at least {100 * BAND:.0f} % of the shares of a calibrated "
                "model lie, bin by "
                "bin, sequences being independent and clips of one sequence not.",
            ),
        ]
    if evaluation.learning:
        pictures.append(
            Picture(
                title="Learning curve",
                svg=learning(evaluation.learning),
                caption="Error on the same test sequences after training on more of them; both "
                "axes are logarithmic.",
            )
        )
    if evaluation.frames:
        pictures.append(
            Picture(
                title="Triplet accuracy against frames",
                svg=frames(evaluation.frames),
                caption="How often a clip lies nearer to one of its own simulation than to one of "
                "another.",
            )
        )
    if evaluation.layout is not None:
        pictures.append(
            Picture(
                title=f"t-SNE of the embedding of {evaluation.layout.label}",
                svg=t_sne(evaluation.layout),
                caption=f"{len(evaluation.layout.wind):,} of {evaluation.layout.clips:,} clips. "
                "Distances between "
                "clusters and their sizes mean nothing.",
                square=True,
            )
        )
    return pictures
