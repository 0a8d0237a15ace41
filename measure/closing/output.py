"""What `flagdata close-loop` leaves: files, artifacts of a lake, and words for the terminal."""

from __future__ import annotations

import json
from itertools import zip_longest
from pathlib import Path

import click

from flagdata.console import document, in_steps, say
from flagdata.lake import Lake
from flagdata.outputs import write_files
from measure.closing import toml
from measure.closing.artifacts import Answer, keep
from measure.report.document import as_document

FILES = ("report.html", "verdict.json", "base.toml", "model.toml")
"""What is written; the last one only where an effect was found."""


def deliver(answer: Answer, words: str, *, out: Path, lake: Lake | None, branch: str, as_json: bool) -> None:
    """Write an answer's files, keep it in the lake, and print it.

    Args:
        words: of the verdict, for a terminal.

    Raises:
        FlagdataError: a file or the lake that cannot be written.
    """
    as_written = as_document(answer.verdict)
    content = json.dumps(as_written, indent=1, allow_nan=False)
    texts = [answer.page, content + "\n", *(toml.dumps(model.content) for model in answer.models)]
    write_files(out, dict(zip_longest(FILES, texts)), command="close-loop")
    with in_steps(lambda: f"the report and the models in {out}"):
        kept = None if lake is None else keep(lake, answer, branch=branch)
    if as_json:
        as_written.pop("schema")
        if kept is not None:
            as_written["artifacts"] = {
                "measurement": kept.measurement, "models": list(kept.models), "existing": kept.existing
            }  # fmt: skip
        document("verdict", as_written)
    else:
        click.echo(words)
    if kept is not None and kept.existing:
        say(f"the lake has this measurement already: {kept.measurement}")
    elif kept is not None:
        say(f"measurement {kept.measurement}")
        for model, identity in zip(answer.models, kept.models, strict=True):
            say(f"model {identity} {model.name}")
    say(f"wrote {', '.join(str(out / file) for file in FILES[: 2 + len(answer.models)])}")
