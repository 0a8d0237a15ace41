"""The commands that the pages name, as a reader types them."""

from __future__ import annotations

import re

import click
import pytest

from docs.generate_cli import commands
from tests.docs.pages import DOCS

COMMANDS = dict(commands())
PAGES = sorted(str(path.relative_to(DOCS)) for path in DOCS.rglob("*.md") if path.name != "cli.md")
SPAN = re.compile(r"^\$ (?:\w+=\$\()?(flagdata .+)$|`(flagdata [a-z][^`]+)`", re.MULTILINE)
OPTION = re.compile(r"(?<![\w-])(--[a-z][a-z-]*|-[a-z])(?=[\s=,);]|$)")


def named(page: str) -> list[str]:
    """What begins with the program's name: what is typed at a prompt, and words in back quotes."""
    text = (DOCS / page).read_text(encoding="utf-8").replace("\\\n", " ")
    return [" ".join((line or quoted).split()) for line, quoted in SPAN.findall(text)]


def called(command: str) -> click.Command | None:
    """The command of a line, or `None` where no word of it is one."""
    words = command.split()
    return COMMANDS.get(" ".join(words[:3])) or COMMANDS.get(" ".join(words[:2]))


@pytest.mark.parametrize("page", [page for page in PAGES if named(page)])
def test_every_command_and_option_that_a_page_names_exists(page: str) -> None:
    wrong = []
    for line in named(page):
        command = called(line)
        if command is None:
            wrong.append(line)
            continue
        known = {"--help"} | {word for one in command.params for word in (*one.opts, *one.secondary_opts)}
        typed = re.split(r" [|>&#;] ?| && ", re.sub(r"\"[^\"]*\"|'[^']*'", "TEXT", line))[0]
        wrong += [f"{line}: {option}" for option in OPTION.findall(typed) if option not in known]
    assert wrong == []
