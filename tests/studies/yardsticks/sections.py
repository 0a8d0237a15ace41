"""What yardsticks show beside an evaluation: sections of its page, entries of its document."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from flagdata.answer import Answer, Figure, Section, Table
from flagdata.answer.charts import Axis, Chart, Cloud, Colour, Line, Panel
from flagdata.answer.markdown import table as markdown_table
from flagdata.core.json_values import json_values
from models.evaluation import score_table
from models.evaluation.evaluation import Evaluation
from models.evaluation.evaluation_charts import curves
from models.evaluation.evaluation_report import answer_of, markdown
from tests.studies.yardsticks import paper
from tests.studies.yardsticks.readouts import FramesPoint, Read
from tests.studies.yardsticks.tsne import TsneLayout


@dataclass(frozen=True, kw_only=True)
class Yardsticks:
    """What stands beside an evaluation.

    Attributes:
        frames: triplet accuracies of clips of other lengths.
        reads: what a linear model reads from embeddings.
        layout: an embedding in the plane.
    """

    frames: Sequence[FramesPoint] = ()
    reads: Sequence[Read] = ()
    layout: TsneLayout | None = None


def answer_beside(evaluation: Evaluation, yardsticks: Yardsticks) -> tuple[Answer, str]:
    """Returns the answer of an evaluation with what stands beside it, and its words in Markdown."""
    warned = [
        replace(finding, where=f"{read.label} on {read.data}")
        for read in yardsticks.reads
        for finding in read.readout.findings
    ]
    evaluation = replace(evaluation, findings=(*evaluation.findings, *warned))
    answer, sections = answer_of(evaluation), [*_sections(yardsticks)]
    answer = replace(
        answer,
        document={**answer.document, **_document(yardsticks)},
        make_sections=lambda of=answer.make_sections: [*of(), *sections],
    )
    return answer, "\n\n".join([markdown(evaluation).rstrip(), *_words(sections)]) + "\n"


def _document(yardsticks: Yardsticks) -> dict[str, Any]:
    return {
        "frames": json_values(yardsticks.frames),
        "linear": json_values(yardsticks.reads),
        "t_sne": json_values(yardsticks.layout),
        "paper": {
            "warning": paper.WARNING,
            "flagsim": json_values(paper.FLAGSIM),
            "triplets": [
                {"frames": frames, "accuracy": accuracy} for frames, accuracy in paper.TRIPLETS
            ],
        },
    }


def _words(sections: Sequence[Section]) -> Iterator[str]:
    for section in sections:
        yield f"## {section.title}"
        for part in section.parts:
            if isinstance(part, str):
                yield part
            elif isinstance(part, Table):
                yield markdown_table(part.columns, part.rows)


def _sections(yardsticks: Yardsticks) -> Iterator[Section]:
    if yardsticks.frames:
        title = "Triplet accuracy against frames"
        figure = Figure(
            title=title,
            content=draw_frames(yardsticks.frames),
            caption="How often a clip lies nearer to one of its own simulation than to one of "
            "another.",
        )
        parts = [figure, _frames(yardsticks.frames)]
        yield Section(title=title, parts=parts, anchor="frames", folded=True)
    if (layout := yardsticks.layout) is not None:
        figure = Figure(
            title=f"t-SNE of the embedding of {layout.label}",
            content=draw_tsne(layout),
            caption=f"{len(layout.wind):,} of {layout.clips:,} clips. "
            "Distances between clusters and their sizes mean nothing.",
        )
        yield Section(title=figure.title, parts=[figure], anchor="t-sne", folded=True)
    if yardsticks.reads:
        about = (
            "Principal components, then linear regression, each group left out of both; Pearson's "
            "r of the logarithm (Bouman et al. 2013)."
        )
        title = "Linear readout of the embedding"
        parts = [about, _linear(yardsticks.reads)]
        yield Section(title=title, parts=parts, anchor="linear", folded=True)
    yield Section(
        title="What the paper printed",
        parts=[paper.WARNING, _quoted()],
        anchor="paper",
        folded=True,
    )


def draw_frames(points: Sequence[FramesPoint]) -> Chart:
    """Shows triplet accuracy over the frames a model sees, beside the paper's."""
    size, accuracy = zip(*paper.TRIPLETS, strict=True)
    quoted = Line(
        x=size,
        y=accuracy,
        colour=Colour.QUIET,
        dashed=True,
        width=1.1,
        label="SDN, quoted from the paper",
    )
    marks = curves([(p.label, p.frames, p.score.quantity) for p in points])
    return Chart(
        rows=[
            [
                Panel(
                    marks=[*marks, quoted],
                    x=Axis(label="frames"),
                    y=Axis(label="triplet accuracy", limits=(None, 1)),
                )
            ]
        ],
        height=3.2,
    )


def draw_tsne(layout: TsneLayout) -> Chart:
    """Shows the embedding in the plane with the true wind as colour."""
    x, y = layout.places.T
    cloud = Cloud(x=x, y=y, values=layout.wind, label="true wind speed [m/s]")
    return Chart(rows=[[Panel(marks=[cloud], equal=True, framed=False)]], height=5.0, width=6.2)


def _quoted() -> Table:
    """Lists what the paper printed of its models."""
    return Table(
        columns=("model, quoted", "input", "RMSE", "bound", "Acc@0.5", ""),
        rows=[
            (
                row.model,
                row.input_size,
                f"{row.rmse:.3f}",
                f"≥ {row.bound:.3f}",
                f"{row.accuracy:.3f}",
                "breaks the bound" if row.breaks_bound else "",
            )
            for row in paper.FLAGSIM
        ],
    )


def _linear(reads: Sequence[Read]) -> Table:
    """Lists what a linear model reads out of the embeddings."""
    return Table(
        columns=("model", "data", "components", "quantity", "Pearson r"),
        rows=[
            (read.label, read.data, str(read.readout.components), target, score_table.cell(r, 3))
            for read in reads
            for target, r in read.pearson.items()
        ],
    )


def _frames(points: Sequence[FramesPoint]) -> Table:
    """Lists the triplet accuracy by the frames that a model sees, and the paper's."""
    ours = [(p.label, str(p.frames), score_table.cell(p.score, 3)) for p in points]
    quotes = [
        ("SDN, quoted from the paper", str(size), f"{accuracy:.3f}")
        for size, accuracy in paper.TRIPLETS
    ]
    return Table(columns=("model", "frames", "triplet accuracy"), rows=[*ours, *quotes])
