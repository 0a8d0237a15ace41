"""Draws messages and help texts of the program at random, for someone to read who does not know the
project.

`python -m tests.studies messages SEED COUNT` prints them, each with its place: what errors and
findings report with the fix beside, and the help of options. Half of each.
docs/results/messages-read.md has what reading sixty came to.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

_ROOT = Path(__file__).resolve().parents[3]
_PACKAGES = ("flagdata", "sim", "models", "measure")


def messages() -> list[str]:
    """What errors and findings report, with their fix, by place."""
    return [f"{place}: {text}" for place, call in _calls() if (text := _message(call))]


def helps() -> list[str]:
    """The help of options, by place."""
    return [
        f"{place}: {_text(word.value)}"
        for place, call in _calls()
        if isinstance(call.func, ast.Attribute) and call.func.attr == "option"
        for word in call.keywords
        if word.arg == "help"
    ]


def _calls() -> Iterator[tuple[str, ast.Call]]:
    for path in sorted(path for package in _PACKAGES for path in (_ROOT / package).rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call):
                yield f"{path.relative_to(_ROOT)}:{node.lineno}", node


def _message(call: ast.Call) -> str:
    name = call.func.id if isinstance(call.func, ast.Name) else ""
    words = {word.arg: _text(word.value) for word in call.keywords if word.arg is not None}
    if name == "Finding":
        return words.get("what", "")
    if name.endswith("Error") and call.args and "fix" in words:
        return f"{_text(call.args[0])} | fix: {words['fix']}"
    return ""


def _text(node: ast.expr) -> str:
    """A text with … where values are put in; empty where it is made elsewhere."""
    if isinstance(node, ast.Constant):
        return node.value if isinstance(node.value, str) else ""
    if isinstance(node, ast.JoinedStr):
        return "".join(
            _text(part) if isinstance(part, ast.Constant) else "…" for part in node.values
        )
    return ""


def main() -> None:
    """Print the sample."""
    seed, count = int(sys.argv[1]), int(sys.argv[2])
    rng = np.random.default_rng(seed)
    for every in (messages(), helps()):
        readable = [one for one in every if len(one.partition(": ")[2].strip(" |…").split()) > 2]
        for place in sorted(rng.choice(len(readable), count // 2, replace=False).tolist()):
            print(readable[place])  # noqa: T201


if __name__ == "__main__":
    main()
