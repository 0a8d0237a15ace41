"""What `flagdata close-loop` leaves: files, artifacts of a lake, and words for the terminal.

The report of a joint answer as one page, which links to the report of each kind beside it.

The contents of a recipe as TOML text: numbers, texts, truth values, lists and tables of them.
"""

from __future__ import annotations

import json
import math
import textwrap
from collections.abc import Mapping, Sequence
from itertools import zip_longest
from pathlib import Path
from typing import Any

from flagdata.console import document, echo_lines, in_steps, say
from flagdata.errors import InputError
from flagdata.lake import Lake
from flagdata.outputs import write_files
from flagdata.pages.render import render
from measure.closing.artifacts import VerdictAnswer, keep
from measure.closing.joint import Joint
from measure.report.document import as_document, plain
from measure.report.report_page import FILTERS, TONES
from measure.report.sentences import after_label


def dumps(content: Mapping[str, Any]) -> str:
    """Writes TOML 1.0 of a mapping; plain values come before tables, as the format wants it.

    Raises:
        InputError: a value that TOML has no form for.
    """
    return "\n".join(_lines(content, ())) + "\n"


def _lines(content: Mapping[str, Any], path: tuple[str, ...]) -> list[str]:
    lines = [f"{_key(key)} = {_value(v)}" for key, v in content.items() if not isinstance(v, Mapping)]
    for key, value in content.items():
        if isinstance(value, Mapping):
            inner = (*path, key)
            lines += ["", f"[{'.'.join(_key(part) for part in inner)}]", *_lines(value, inner)]
    return lines


def _key(key: str) -> str:
    bare = key.isascii() and key.replace("-", "").replace("_", "").isalnum()
    return key if bare else _value(key)


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        if math.isnan(value) or math.isinf(value):
            return "nan" if math.isnan(value) else ("inf" if value > 0 else "-inf")
        return repr(value)
    if isinstance(value, str):
        # JSON escapes what TOML does, but for DEL.
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007F")
    if isinstance(value, Sequence):
        return f"[{', '.join(_value(item) for item in value)}]"
    raise InputError(f"{value!r} has no form in TOML", where="recipe", fix="give numbers, texts, lists or tables")


def joint_page(joint: Joint) -> str:
    """Renders the page, HTML; it lies beside the folders `markers` and `films`."""
    kinds = [
        {"name": name, "verdict": verdict, "after_label": after_label(verdict) if verdict.named else ""}
        for name, verdict in (("markers", joint.markers), ("films", joint.films))
    ]
    values = {"joint": joint, "tone": TONES[joint.conclusion], "kinds": kinds}
    return render("measure.report", "joint.html.j2", values, filters=FILTERS)


FILES = ("report.html", "verdict.json", "base.toml", "model.toml")
"""What is written; the last one only where an effect was found."""


JOINT = ("report.html", "verdict.json")
"""What is written of a joint answer, beside a folder a kind."""
KINDS = ("markers", "films")


def deliver(answer: VerdictAnswer, *, out: Path, lake: Lake | None, branch: str, as_json: bool) -> None:
    """Writes an answer's files, keeps it in the lake, and prints it.

    Raises:
        FlagdataError: a file or the lake that cannot be written.
    """
    written = _written(answer, out=out, lake=lake, branch=branch)
    if as_json:
        written.pop("schema")
        document("verdict", written)
    else:
        echo_lines(answer.words)


def deliver_joint(
    joint: Joint, answers: Sequence[VerdictAnswer], *, out: Path, lake: Lake | None, branch: str, as_json: bool
) -> None:
    """Delivers an answer by markers and films, each of which has its folder and its artifacts.

    Args:
        answers: by markers and by films.

    Raises:
        FlagdataError: a file or the lake that cannot be written.
    """
    documents = {
        kind: _written(answer, out=out / kind, lake=lake, branch=branch)
        for kind, answer in zip(KINDS, answers, strict=True)
    }
    content = {**plain(joint.as_dict()), **documents}
    text = json.dumps({"schema": "flagdata.joint-verdict/1", **content}, indent=1, allow_nan=False, ensure_ascii=False)
    write_files(out, dict(zip(JOINT, (joint_page(joint), text + "\n"), strict=True)), command="close-loop")
    say(f"wrote {', '.join(str(out / file) for file in JOINT)}")
    if as_json:
        document("joint-verdict", content)
    else:
        echo_lines(textwrap.fill(joint.words, 100))
        for kind, answer in zip(KINDS, answers, strict=True):
            echo_lines(f"\nBy {kind}:\n{answer.words}")


def _written(answer: VerdictAnswer, *, out: Path, lake: Lake | None, branch: str) -> dict[str, Any]:
    """Writes and keeps an answer, and returns its document."""
    as_written = as_document(answer.verdict)
    content = json.dumps(as_written, indent=1, allow_nan=False)
    texts = [answer.page, content + "\n", *(dumps(model.content) for model in answer.models)]
    write_files(out, dict(zip_longest(FILES, texts)), command="close-loop")
    with in_steps(lambda: f"the report and the models in {out}"):
        published = None if lake is None else keep(lake, answer, branch=branch)
    if published is not None:
        as_written["artifacts"] = {
            "measurement": published.measurement,
            "models": list(published.models),
            "existing": not published.place.new,
            "version": published.place.version,
        }
        say(f"measurement {published.measurement}, {published.place.sentence}")
    if published is not None and published.place.new:
        for model, identity in zip(answer.models, published.models, strict=True):
            say(f"model {identity} {model.name}")
    say(f"wrote {', '.join(str(out / file) for file in FILES[: 2 + len(answer.models)])}")
    return as_written
