"""What `flagdata close-loop` leaves: files, artifacts of a lake, and words for the terminal.

A joint answer's report is one page, which links to the report of each kind beside it.
"""

from __future__ import annotations

import json
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest
from pathlib import Path
from typing import Any

from flagdata.core.console import document, echo_lines, in_steps, say
from flagdata.core.files.outputs import write_files
from flagdata.lake import Lake
from flagdata.recipes.documents import to_toml
from measure.closing.answer_by_both import KINDS, joint_answer
from measure.closing.joint_verdict import Joint
from measure.closing.verdict_artifacts import ClosedLoop, keep
from measure.report.document import plain

FILES = ("report.html", "verdict.json", "base.toml", "model.toml")
"""What is written; the last one only where an effect was found."""


JOINT = ("report.html", "verdict.json")
"""What is written of a joint answer, beside a folder a kind."""


@dataclass(frozen=True, kw_only=True)
class Delivery:
    """Where an answer goes, and how it is printed.

    Attributes:
        out: folder of its files.
        lake: that keeps it; None for none.
        branch: of the lake.
        as_json: whether it is printed as JSON.
        verbose: whether all that was weighed is printed, and not the conclusion alone.
    """

    out: Path
    lake: Lake | None
    branch: str
    as_json: bool
    verbose: bool


def conclusion(words: str) -> str:
    """Cuts the conclusion, its first paragraph, out of what a verdict says."""
    return words.partition("\n\n")[0]


def deliver(closed: ClosedLoop, delivery: Delivery) -> None:
    """Writes an answer's files, keeps it in the lake, and prints it.

    Raises:
        FlagdataError: a file or the lake that cannot be written.
    """
    written = _written(closed, delivery)
    if delivery.as_json:
        written.pop("schema")
        document("verdict", written)
    else:
        words = closed.answer.words
        echo_lines(words if delivery.verbose else conclusion(words))


def deliver_joint(joint: Joint, loops: Sequence[ClosedLoop], delivery: Delivery) -> None:
    """Delivers an answer by markers and films, each of which has its folder and its artifacts.

    Args:
        loops: closed by markers and by films.

    Raises:
        FlagdataError: a file or the lake that cannot be written.
    """
    documents = {
        kind: _written(closed, replace(delivery, out=delivery.out / kind))
        for kind, closed in zip(KINDS, loops, strict=True)
    }
    answer = joint_answer(joint, *(closed.answer for closed in loops))
    content = {**plain(joint), **documents}
    text = json.dumps(
        {"schema": "flagdata.joint-verdict/1", **content},
        indent=1,
        allow_nan=False,
        ensure_ascii=False,
    )
    write_files(
        delivery.out,
        dict(zip(JOINT, (answer.page, text + "\n"), strict=True)),
        command="close-loop",
    )
    say(f"wrote {', '.join(str(delivery.out / file) for file in JOINT)}")
    if delivery.as_json:
        document("joint-verdict", content)
    else:
        echo_lines(textwrap.fill(answer.words, 100))
        for kind, closed in zip(KINDS, loops, strict=True) if delivery.verbose else ():
            echo_lines(f"\nBy {kind}:\n{closed.answer.words}")


def _written(closed: ClosedLoop, delivery: Delivery) -> dict[str, Any]:
    """Writes and keeps an answer, and returns its document."""
    out, lake = delivery.out, delivery.lake
    as_written = dict(closed.answer.document)
    content = json.dumps(as_written, indent=1, allow_nan=False)
    texts = [
        closed.answer.page,
        content + "\n",
        *(to_toml(model.content) for model in closed.models),
    ]
    write_files(out, dict(zip_longest(FILES, texts)), command="close-loop")
    with in_steps(lambda: f"the report and the models in {out}"):
        published = None if lake is None else keep(lake, closed, branch=delivery.branch)
    if published is not None:
        as_written["artifacts"] = {
            "measurement": published.measurement,
            "models": list(published.models),
            "existing": not published.place.new,
            "version": published.place.version,
        }
        say(f"measurement {published.measurement}, {published.place.sentence}")
    if published is not None and published.place.new:
        for model, identity in zip(closed.models, published.models, strict=True):
            say(f"model {identity} {model.name}")
    say(f"wrote {', '.join(str(out / file) for file in FILES[: 2 + len(closed.models)])}")
    return as_written
