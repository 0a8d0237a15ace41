"""Remedies that the product's source holds: the texts given as `fix` that name a command or an
option."""

from __future__ import annotations

import ast
import re
import shlex
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from flagdata.cli import VERBS
from tests.contract.imports import ROOT, modules, tree

PRODUCT = ("flagdata", "sim", "models", "measure")
HOLE = "\N{REPLACEMENT CHARACTER}"
"""Stands for what an expression puts into a text."""
COMMAND = re.compile(r"\bflagdata ([a-z]+(?:-[a-z]+)*)")
OPTION = re.compile(r"(?<![\w-])--([a-z][a-z-]*)")


@dataclass(frozen=True, order=True)
class Remedy:
    """A text of a module's source that is given as `fix`, a `HOLE` for each expression in it."""

    module: str
    text: str

    def is_in(self, said: str) -> bool:
        """Whether a fix that was printed has this text."""
        return self._pattern.search(said) is not None

    def printed(self, output: str) -> str | None:
        """The line of an output that has this text, where no other remedy has it."""
        if sum(one.text == self.text for one in remedies()) > 1:
            return None
        return next((line for line in output.splitlines() if self.is_in(line)), None)

    @property
    def _pattern(self) -> re.Pattern[str]:
        return re.compile(".*".join(re.escape(part) for part in self.text.split(HOLE)), re.DOTALL)

    def __str__(self) -> str:
        return f"{self.module}: {self.text.replace(HOLE, '…')}"


@cache
def remedies() -> tuple[Remedy, ...]:
    """All texts given as `fix` that name a command or an option, and all others that name a
    command."""
    named = {remedy for remedy in texts() if OPTION.search(remedy.text)}
    named |= {remedy for remedy in (*texts(), *others()) if verbs(remedy.text)}
    return tuple(sorted(named))


def verbs(text: str) -> set[str]:
    """The commands that a text names."""
    return {match[1] for match in COMMAND.finditer(text) if match[1] in VERBS}


def texts() -> Iterator[Remedy]:
    """All texts given as `fix`, also through names of the same module."""
    for path in modules(*PRODUCT):
        for text in _texts(tree(path)):
            yield Remedy(str(path.relative_to(ROOT)), text)


def others() -> Iterator[Remedy]:
    """All texts but docstrings, headings and what describes an option."""
    for path in modules(*PRODUCT):
        source = tree(path)
        aside = {id(part) for node in ast.walk(source) for part in _aside(node)}
        for node in ast.walk(source):
            if id(node) not in aside and (
                isinstance(node, ast.Constant | ast.JoinedStr) or is_command_line(node)
            ):
                for text in list(strings(node))[:1]:
                    yield Remedy(str(path.relative_to(ROOT)), text)


def _aside(node: ast.AST) -> Iterator[ast.AST]:
    if isinstance(node, ast.Expr):
        yield node.value
    elif isinstance(node, ast.JoinedStr):
        yield from node.values
        yield from (part.value for part in node.values if isinstance(part, ast.FormattedValue))
    elif isinstance(node, ast.keyword) and node.arg == "help":
        yield from ast.walk(node.value)
    elif (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id in ("option", "argument")
    ):
        yield from ast.walk(node.args[0])


def _texts(source: ast.Module) -> Iterator[str]:
    given = list(_given(source))
    names = {
        node.id for value in given for node in _beside_words(value) if isinstance(node, ast.Name)
    } | {"fix"}
    names |= {name for name in _assigned(source) if name.endswith("FIX")}
    for name, values in _assigned(source).items():
        if name in names:
            given += values
    for value in given:
        yield from strings(value)


def _beside_words(value: ast.AST) -> Iterator[ast.AST]:
    """All nodes of an expression, but for the words of command lines."""
    yield value
    if not is_command_line(value):
        for child in ast.iter_child_nodes(value):
            yield from _beside_words(child)


def _given(source: ast.Module) -> Iterator[ast.expr]:
    for node in ast.walk(source):
        if isinstance(node, ast.keyword) and node.arg == "fix":
            yield node.value
        if isinstance(node, ast.Dict):
            for key, value in zip(node.keys, node.values, strict=True):
                if isinstance(key, ast.Constant) and key.value == "fix":
                    yield value


@cache
def _assigned(source: ast.Module) -> dict[str, list[ast.expr]]:
    """What names stand for, wherever in the module they are assigned; of tuples of names each."""
    values: dict[str, list[ast.expr]] = {}
    for node in ast.walk(source):
        if isinstance(node, ast.Assign):
            for target in node.targets:
                pairs = [(target, node.value)]
                if isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple):
                    pairs = list(zip(target.elts, node.value.elts, strict=True))
                for name, value in pairs:
                    if isinstance(name, ast.Name):
                        values.setdefault(name.id, []).append(value)
        elif (
            isinstance(node, ast.AnnAssign)
            and isinstance(node.target, ast.Name)
            and node.value is not None
        ):
            values.setdefault(node.target.id, []).append(node.value)
    return values


def is_command_line(node: ast.AST) -> bool:
    """Whether an expression writes words as a shell takes them."""
    return (
        isinstance(node, ast.Call)
        and isinstance(node.func, ast.Name)
        and node.func.id == "command_line"
    )


def template(node: ast.AST) -> str:
    """The text of an expression, a `HOLE` for what is put into it, and the words of a command line
    as they stand."""
    if isinstance(node, ast.Constant):
        return str(node.value)
    if isinstance(node, ast.JoinedStr):
        return "".join(map(template, node.values))
    if isinstance(node, ast.FormattedValue):
        return template(node.value) if is_command_line(node.value) else HOLE
    if is_command_line(node):
        words = node.args if isinstance(node, ast.Call) else []
        return "".join(map(_word, words)).removeprefix(" ")
    return HOLE


def _word(node: ast.AST) -> str:
    """A word of a command line, with the blank before it; of several words, of which there may be
    none, a `HOLE`."""
    if isinstance(node, ast.Starred):
        return HOLE
    if isinstance(node, ast.Constant):
        return f" {shlex.quote(str(node.value))}"
    word = template(node)
    return f" {HOLE if ' ' in word else word}"  # quoted as a whole


def strings(value: ast.AST) -> Iterator[str]:
    """The texts of an expression: whole literals, holes for what is put into them, and the literals
    of these."""
    if isinstance(value, ast.Constant):
        if isinstance(value.value, str) and value.value.strip():
            yield value.value
    elif is_command_line(value):
        yield template(value)
    elif isinstance(value, ast.JoinedStr):
        yield template(value)
        for part in value.values:
            if isinstance(part, ast.FormattedValue) and not is_command_line(part.value):
                yield from strings(part.value)
    else:
        for child in ast.iter_child_nodes(value):
            yield from strings(child)


def relative(path: str) -> str | None:
    """A file's place in the repository, `None` where it is not of the product."""
    place = Path(path)
    return (
        str(place.relative_to(ROOT))
        if any(place.is_relative_to(ROOT / folder) for folder in PRODUCT)
        else None
    )
