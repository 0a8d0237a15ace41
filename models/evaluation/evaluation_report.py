"""The evaluation as an answer, whose page refers to no other file, as Markdown and as a JSON
document."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

from flagdata.answer.answer import Answer, Figure, Head, Section, Table, Tone
from flagdata.answer.markdown import plain
from flagdata.answer.markdown import table as markdown_table
from flagdata.answer.quantity import Quantity
from flagdata.core.files.outputs import check_files, write_files
from flagdata.core.findings import Finding
from flagdata.core.provenance import code_version
from flagdata.errors import UsageError
from models.evaluation import evaluation_charts as charts
from models.evaluation import evaluation_tables as tables
from models.evaluation import score_table
from models.evaluation.bootstrap import LEVEL
from models.evaluation.evaluation import Evaluation, as_document
from models.evaluation.evaluation_arrays import arrays_of
from models.evaluation.predictive_calibration import BAND

_COMMAND = "evaluate"


def write(evaluation: Evaluation, folder: Path, *, name: str = "evaluation") -> Answer:
    """Writes NAME.html, NAME.json and NAME.md into `folder`, which is made; returns the answer.

    Raises:
        ConflictError: one of them is there and was not written by an evaluation, or was changed
            since.
    """
    answer = answer_of(evaluation)
    write_answer(answer, markdown(evaluation), folder, name=name)
    return answer


def write_answer(answer: Answer, words: str, folder: Path, *, name: str) -> None:
    """Writes an answer's page and document, and its words in Markdown; raises as `write`."""
    document = json.dumps(answer.document, indent=2, allow_nan=False, ensure_ascii=False) + "\n"
    contents = (answer.page, document, words)
    write_files(folder, dict(zip(names(name), contents, strict=True)), command=_COMMAND)


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
    check_files(folder, *names(name), command=_COMMAND)


def names(name: str) -> tuple[str, str, str]:
    """Returns the names of the page, the document and the words."""
    return f"{name}.html", f"{name}.json", f"{name}.md"


def answer_of(evaluation: Evaluation) -> Answer:
    """Returns which model reads the wind best, with all scores of all models."""
    best = evaluation.reference
    row = next((row for row in evaluation.rows if row.run is None and row.label == best), None)
    quantities = {} if row is None else {name: s.quantity for name, s in row.scores.items()}
    return Answer(
        question=_COMMAND,
        subject=f"Models compared on {evaluation.data}",
        sentence=_sentence(evaluation, quantities.get("rmse")),
        tone=Tone.SETTLED if _is_settled(evaluation) else Tone.OPEN,
        quantities=quantities,
        arrays=arrays_of(evaluation),
        findings=evaluation.findings,
        document=as_document(evaluation),
        head=Head(
            figures=[*_wind_figures(evaluation)],
            facts={"data": evaluation.data, "tested on": _counts(evaluation)},
            limits=[_said(finding) for finding in evaluation.findings],
        ),
        make_sections=lambda: [*_sections(evaluation)],
        provenance={"seed of all that is drawn": str(evaluation.seed)},
    )


def _sentence(evaluation: Evaluation, rmse: Quantity | None) -> str:
    """Says in one sentence which model reads the wind best."""
    labels = {row.label for row in evaluation.rows}
    if rmse is None or rmse.value is None:
        noun = "model was" if len(labels) == 1 else "models were"
        return f"{len(labels)} {noun} compared; none estimates the wind"
    error = f"by {rmse.value:.3g} m/s in the root mean square"
    if len(labels) == 1:
        return f"{evaluation.reference} misses the wind {error}"
    how = "" if _is_settled(evaluation) else ", which chance may explain"
    return f"Of {len(labels)} models {evaluation.reference} misses the wind least, {error}{how}"


def _is_settled(evaluation: Evaluation) -> bool:
    """Returns whether each other model misses the wind by more, beyond what the choice of sequences
    explains."""
    errors = [one for one in evaluation.differences if one.metric == "rmse"]
    return bool(evaluation.wind_errors) and all(
        one.apart and one.difference.value > 0 for one in errors
    )


def _said(finding: Finding) -> str:
    return f"{finding.where}: {finding.what}" if finding.where else finding.what


def _counts(evaluation: Evaluation) -> str:
    learned = (
        "that no model was trained on" if evaluation.unseen else "that models may have learned from"
    )
    return (
        f"{evaluation.clips:,} clips of {evaluation.groups:,} sequences {learned}; intervals are "
        "of "
        f"{100 * LEVEL:.0f} % over sequences."
    )


def _wind_figures(evaluation: Evaluation) -> Iterator[Figure]:
    if evaluation.wind_errors:
        yield Figure(
            title="Error against wind",
            content=charts.error_against_wind(evaluation.wind_errors),
            caption="Clips by true wind in bins of 1 m/s; means over runs. Shaded: intervals "
            "over sequences, none where a bin has one sequence only.",
        )


def _sections(evaluation: Evaluation) -> Iterator[Section]:
    yield Section(title="The models", parts=[tables.models(evaluation)], anchor="models")
    if (made := tables.differences(evaluation)) is not None:
        about = (
            f"The model's score less that of {evaluation.reference} on the same clips and the same "
            "draws of sequences. An interval without zero is a difference beyond what the choice "
            "of "
            "test sequences explains."
        )
        title = f"Against {evaluation.reference}, pair by pair"
        yield Section(title=title, parts=[about, made], anchor="differences", folded=True)
    yield Section(
        title="Every target", parts=[tables.targets(evaluation)], anchor="targets", folded=True
    )
    yield from _figure_sections(evaluation)


def _figure_sections(evaluation: Evaluation) -> Iterator[Section]:
    if evaluation.calibrations:
        yield _folded(
            Figure(
                title="Calibration",
                content=charts.calibration(evaluation.calibrations, evaluation.expected),
                caption="Share of truths inside central intervals, over their nominal level. Below "
                "the dashed line distributions are too narrow or biased, above it too wide. TARP "
                "(Lemos et al. 2023) tests all targets together.",
            )
        )
        yield _folded(
            Figure(
                title="Ranks of the truth among the draws",
                content=charts.ranks(evaluation.calibrations),
                caption="Flat if calibrated (Talts et al. 2018); a hump is too wide, a trough too "
                f"narrow, a slope biased. Shaded: where at least {100 * BAND:.0f} % of the shares "
                "of a calibrated model lie, bin by bin, sequences being independent and clips of "
                "one sequence not.",
            )
        )
    if evaluation.learning:
        yield _folded(
            Figure(
                title="Learning curve",
                content=charts.learning(evaluation.learning),
                caption="Error on the same test sequences after training on more of them; both "
                "axes are logarithmic.",
            )
        )


def _folded(figure: Figure) -> Section:
    return Section(title=figure.title, parts=[figure], folded=True)


def markdown(evaluation: Evaluation) -> str:
    """Renders the tables and their warnings as Markdown, names of models and data sets as text; the
    charts are the page's."""
    parts = [f"# Models compared on {plain(evaluation.data)}", _counts(evaluation)]
    parts += [f"**Warning:** {plain(_said(finding))}." for finding in evaluation.findings]
    parts += [
        _text(tables.models(evaluation)),
        score_table.LEGEND,
    ]
    for title, made in (
        (
            f"## Against {plain(evaluation.reference or '')}, pair by pair",
            tables.differences(evaluation),
        ),
        ("## Every target", tables.targets(evaluation)),
        ("## Learning curve", tables.learning(evaluation)),
    ):
        if made is not None:
            parts += [title, _text(made)]
    parts.append(f"flagdata {code_version()}, seed {evaluation.seed}.")
    return "\n\n".join(parts) + "\n"


def _text(table: Table) -> str:
    return markdown_table(table.columns, table.rows)
