"""The commands that pages, notebooks and help name, read by the command line as if they were typed.

A line at a prompt, of a notebook's shell or of a help's example is typed as it is. Words in back
quotes may leave out what is not spoken of, and write a value in capitals."""

from __future__ import annotations

import contextlib
import inspect
import io
import json
import re
import shlex
from collections.abc import Iterator
from itertools import takewhile
from typing import NamedTuple

import click
import pytest

import flagdata
from docs.generate_cli import commands
from tests.contract.imports import ROOT, modules
from tests.docs.pages import DOCS, DOOR
from tests.studies.__main__ import studies

RECORDS = ("docs/decisions/", "docs/results/")
"""Pages that say what was typed at their time: `flagdata challenge` was a command until it became a
study, and options had other names."""
PRODUCT = ("flagdata", "sim", "models", "measure")


def of_studies(start: str) -> dict[str, click.Command]:
    """The studies and what is below them, by what is typed after `start`."""
    found: dict[str, click.Command] = {}
    for name in studies.verbs:
        command = studies.get_command(click.Context(studies), name)
        assert command is not None
        found[f"{start} {name}"] = command
        below = command.commands if isinstance(command, click.Group) else {}
        found |= {f"{start} {name} {verb}": one for verb, one in below.items()}
    return found


COMMANDS = {**dict(commands()), **of_studies(DOOR)}
BEFORE = {name: command for name, command in of_studies("flagdata").items() if "challenge" in name}
PROGRAM = rf"(?:flagdata|{re.escape(DOOR)})"
PROMPT = re.compile(rf"^ *\$ (?:\w+=\$\()?({PROGRAM} .+)$", re.MULTILINE)
SHELL = re.compile(rf"^ *!({PROGRAM} .+)$", re.MULTILINE)
QUOTED = re.compile(rf"`({PROGRAM}\s+[a-z][^`]+)`")
FENCED = re.compile(r"^( *)```.*?^\1```$", re.DOTALL | re.MULTILINE)
ENDS = {"|", ">", ">>", "2>", "&", "&&", ";"}
"""Where a shell's command ends."""
WITHIN = re.compile(r"(?:\$\(|-m )flagdata(?:\.cli)?( [^)]+)")
"""A command of flagdata within one of another program."""


class Line(NamedTuple):
    """A command as it stands somewhere.

    Attributes:
        typed: whether a reader types it as it is.
    """

    text: str
    typed: bool


def one_line(text: str) -> str:
    """A text without the ends of its lines."""
    return " ".join(text.replace("\\\n", " ").split())


def lines_of_page(text: str) -> Iterator[Line]:
    """The commands of Markdown: at prompts, in notebooks' shells, in back quotes."""
    joined = text.replace("\\\n", " ")
    for pattern in (PROMPT, SHELL):
        yield from (Line(one_line(found), typed=True) for found in pattern.findall(joined))
    for found in QUOTED.findall(FENCED.sub("", joined)):
        yield Line(one_line(found), typed=False)


def lines_of_help(text: str) -> Iterator[Line]:
    """The examples of a help, the paragraphs that are kept as they are, and its back quotes."""
    for paragraph in text.split("\n\n"):
        if paragraph.startswith("\b"):
            first, _, rest = paragraph.partition("\n")
            assert first == "\b", f"the example begins on the line of \\b: {first}"
            joined = rest.replace("\\\n", " ")
            for line in map(one_line, joined.splitlines()):
                within = WITHIN.search(line)
                yield Line(f"flagdata{within[1]}" if within else line, typed=True)
        else:
            yield from (Line(one_line(found), typed=False) for found in QUOTED.findall(paragraph))


def notebook(path: str) -> str:
    """The words and the code of a notebook."""
    cells = json.loads((ROOT / path).read_text(encoding="utf-8"))["cells"]
    return "\n\n".join("".join(cell["source"]) for cell in cells)


def sources() -> dict[str, list[Line]]:
    """Where commands stand → the commands there."""
    pages = [*DOCS.rglob("*.md"), *(ROOT / f"{name}.md" for name in ("README", "CONTRIBUTING"))]
    found = {
        str(path.relative_to(ROOT)): list(lines_of_page(path.read_text(encoding="utf-8")))
        for path in pages
        if "cli" not in (path.stem, path.parent.name)  # made of the help
    }
    for path in sorted(DOCS.rglob("*.ipynb")):
        name = str(path.relative_to(ROOT))
        found[name] = list(lines_of_page(notebook(name)))
    for name, command in COMMANDS.items():
        found[f"help of {name}"] = list(lines_of_help(inspect.cleandoc(command.help or "")))
    for name in flagdata.__all__:
        found[f"flagdata.{name}"] = [
            Line(one_line(text), typed=False)
            for text in QUOTED.findall(inspect.getdoc(getattr(flagdata, name)) or "")
        ]
    for path in modules(*PRODUCT):
        found[str(path.relative_to(ROOT))] = [
            Line(one_line(text), typed=False)
            for text in re.findall(
                rf"(?<!`)`({PROGRAM}\s+[a-z][^`{{]+)`", path.read_text(encoding="utf-8")
            )
        ]
    return {name: lines for name, lines in found.items() if lines}


SOURCES = sources()


def called(words: list[str], where: str) -> tuple[str, click.Command] | None:
    """The command of a line with its full name, or `None` where no word of it is one."""
    known = {**COMMANDS, **(BEFORE if where.startswith(RECORDS) else {})}
    starts = (" ".join(words[:count]) for count in (5, 4, 3, 2))
    return next(((start, known[start]) for start in starts if start in known), None)


def is_left_open(error: click.UsageError) -> bool:
    """Whether words in back quotes may do what is wrong: an option without its value, no SOURCE, a
    value in capitals."""
    if isinstance(error, click.NoSuchOption):
        return False
    if isinstance(error, click.BadParameter):
        return isinstance(error, click.MissingParameter) or bool(
            re.search(r"'(?:[^']*[A-Z…][A-Z…,.]*)'", error.message)
        )
    return "requires an argument" in error.message or "Missing" in error.message


def fault(line: Line, where: str) -> str | None:
    """What the command line says of a line that it cannot read; it is not run."""
    text = re.sub(r"\$\{?\w+\}?", "NAME", line.text)
    words = list(takewhile(lambda word: word not in ENDS, shlex.split(text, comments=True)))
    if "|" in words[1]:  # verbs beside each other
        each = [
            Line(" ".join([words[0], verb, *words[2:]]), typed=False)
            for verb in words[1].split("|")
        ]
        return next(filter(None, (fault(one, where) for one in each)), None)
    found = called(words, where)
    if found is None:
        return f"{text}: no such command"
    name, command = found
    if command.context_settings.get("ignore_unknown_options") or "--help" in words:
        return None  # its words are those of another program
    warnings = io.StringIO()
    try:
        with contextlib.redirect_stderr(warnings):
            command.make_context(name, words[len(name.split()) :])
    except click.UsageError as error:
        if "does not exist" in error.message or (not line.typed and is_left_open(error)):
            return None
        return f"{text}: {error.format_message()}"
    return f"{text}: {warnings.getvalue().strip()}" if warnings.getvalue() else None


@pytest.mark.parametrize("where", SOURCES)
def test_every_command_that_is_named_is_read_by_the_command_line(where: str) -> None:
    found = [fault(line, where) for line in SOURCES[where]]
    assert [one for one in found if one] == []


def test_commands_are_found_where_they_stand() -> None:
    typed = {where for where, lines in SOURCES.items() if any(line.typed for line in lines)}
    assert {"README.md", "docs/start.md", "help of flagdata measure"} <= typed
    assert "docs/notebooks/close-the-loop.ipynb" in SOURCES
    assert "flagdata.measure" in SOURCES


@pytest.mark.parametrize(
    "text",
    [
        "flagdata measure film.mp4 --no-such-option",
        "flagdata demo --part loop",
        "flagdata measure film.mp4 --level two",
        "flagdata measure film.mp4 --flag-size",
        "flagdata observe film.mp4",
        "flagdata no-such-verb",
    ],
)
def test_a_line_that_cannot_be_typed_is_found(text: str) -> None:
    assert fault(Line(text, typed=True), "a page")


def test_words_in_back_quotes_may_leave_out_what_they_do_not_speak_of() -> None:
    (line,) = lines_of_page("Give\n`flagdata\nmeasure --flag-size` it.")
    assert line == Line("flagdata measure --flag-size", typed=False)
    assert fault(line, "a page") is None
    assert fault(Line("flagdata align --clock-offset S", typed=False), "a page") is None
    assert fault(Line("flagdata align --no-such S", typed=False), "a page")
