"""A command in a text for people is written by `flagdata.core.shell`, which quotes its words. The
test reads the source."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

import pytest

from flagdata.cli import VERBS
from tests.contract.imports import ROOT, modules, tree

PRODUCT = ("flagdata", "sim", "models", "measure")
PROGRAMS = (
    r"apt-get|bash|cat|cd|chmod|cp|curl|ffmpeg|git|gunzip|gzip|kill|ln|ls|mkdir|mv|python3?|rm|rmdir|rsync|sed|sh|"
    r"sha256sum|ssh|sudo|tail|tar|touch|unzip|xz|zcat|zip|zstd"
)
VERBED = r"mcap [a-z]+|pip install|head -[a-z]"
"""Programs whose names are words of sentences as well, with what a command has after them."""
HOLE = "\N{REPLACEMENT CHARACTER}"
_PROGRAM = rf"(?<![\w./-])(?:flagdata (?:{'|'.join(sorted(VERBS))})|{VERBED}|(?:{PROGRAMS}) )"
_VALUE = rf"[^;,:()]*{HOLE}"
COMMAND = re.compile(rf"{_PROGRAM}{_VALUE}|(?<![\w-])--[a-z][a-z-]*[ =]\S*{HOLE}")


def is_quoted(value: ast.expr) -> bool:
    """Whether an expression is quoted by `command_line`, or a constant of a module."""
    names = [node.id for node in ast.walk(value) if isinstance(node, ast.Name)]
    return "command_line" in names or (isinstance(value, ast.Name) and value.id.isupper())


def text(node: ast.AST) -> str:
    """What an expression writes: constants as they are, a `HOLE` for each value that is not
    quoted."""
    if isinstance(node, ast.Constant):
        return str(node.value)
    if isinstance(node, ast.JoinedStr):
        return "".join(map(text, node.values))
    if isinstance(node, ast.FormattedValue):
        return text(node.value)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Add):
        return text(node.left) + text(node.right)
    if (
        isinstance(node, ast.BinOp)
        and isinstance(node.op, ast.Mod)
        and isinstance(node.left, ast.Constant)
    ):
        return re.sub(r"%[^%\s]*[a-z]", HOLE, str(node.left.value))
    if (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and node.func.attr == "format"
    ):
        return re.sub(r"\{[^{}]*\}", HOLE, text(node.func.value))
    if isinstance(node, ast.IfExp):
        return text(node.body) + text(node.orelse)
    return "" if isinstance(node, ast.expr) and is_quoted(node) else HOLE


def unquoted(source: ast.AST) -> Iterator[tuple[int, str]]:
    """Texts of a module with a command one of whose words is a value, with the line of each."""
    for node in ast.walk(source):
        whole = isinstance(node, ast.JoinedStr) or (
            isinstance(node, ast.BinOp | ast.Call) and _has_text(node)
        )
        if whole and (match := COMMAND.search(text(node))) is not None:
            yield node.lineno, match[0].replace(HOLE, "…")


def _has_text(node: ast.AST) -> bool:
    if isinstance(node, ast.BinOp):
        return any(
            isinstance(side, ast.JoinedStr | ast.Constant) or _has_text(side)
            for side in (node.left, node.right)
        )
    return (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and node.func.attr == "format"
    )


def test_no_text_puts_a_value_into_a_command_unquoted() -> None:
    found = [
        f"{path.relative_to(ROOT)}:{line}: {words}"
        for path in modules(*PRODUCT)
        for line, words in unquoted(tree(path))
    ]
    assert found == []


@pytest.mark.parametrize(
    "source",
    [
        'f"unpack it: gunzip -k {name}; then"',
        'f"flagdata pull a clone of {path}"',
        'f"run flagdata gc{lake}"',
        'f"--lake {path}"',
        'f"rm -r {folder}/refs"',
        'f"or give --zone={zone}"',
        '"flagdata pull " + str(path)',
        '"flagdata ingest {}".format(path)',
        '"flagdata ingest %s" % path',
    ],
)
def test_a_value_in_a_command_is_found(source: str) -> None:
    assert list(unquoted(ast.parse(source)))


@pytest.mark.parametrize(
    "source",
    [
        "f\"unpack it: {command_line('gunzip', '-k', name)}; then\"",
        'f"{count} rows; flagdata gc takes it, {later}"',
        'f"run flagdata verify: {count} objects are damaged"',
        "f\"give --stream {' or '.join(map(command_line, streams))}\"",
        'f"sha256sum * > {SUMS}"',
        'f"made by flagdata {version}"',
    ],
)
def test_quoted_words_and_sentences_are_no_such_values(source: str) -> None:
    assert not list(unquoted(ast.parse(source)))
