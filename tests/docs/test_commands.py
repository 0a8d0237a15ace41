"""The commands that the pages name, as a reader types them."""

from __future__ import annotations

import re

import click
import pytest

from docs.generate_cli import commands
from tests.docs.pages import DOCS, DOOR
from tests.studies.__main__ import studies

RECORDS = ("decisions/", "results/")
"""Pages that say what was typed at their time: `flagdata challenge` was a command until it became a
study."""


def of_studies(start: str) -> dict[str, click.Command]:
    """The studies and what is below them, by what is typed after `start`."""
    found: dict[str, click.Command] = {}
    for name in studies.verbs:
        command = found[f"{start} {name}"] = studies.get_command(click.Context(studies), name)
        below = command.commands if isinstance(command, click.Group) else {}
        found |= {f"{start} {name} {verb}": one for verb, one in below.items()}
    return found


COMMANDS = {**dict(commands()), **of_studies(DOOR)}
BEFORE = {name: command for name, command in of_studies("flagdata").items() if "challenge" in name}
PAGES = sorted(str(path.relative_to(DOCS)) for path in DOCS.rglob("*.md") if path.name != "cli.md")
PROGRAM = rf"(?:flagdata|{re.escape(DOOR)})"
SPAN = re.compile(rf"^\$ (?:\w+=\$\()?({PROGRAM} .+)$|`({PROGRAM} [a-z][^`]+)`", re.MULTILINE)
OPTION = re.compile(r"(?<![\w-])(--[a-z][a-z-]*|-[a-z])(?=[\s=,);]|$)")


def named(page: str) -> list[str]:
    """What begins with the program's name: what is typed at a prompt, and words in back quotes."""
    text = (DOCS / page).read_text(encoding="utf-8").replace("\\\n", " ")
    return [" ".join((line or quoted).split()) for line, quoted in SPAN.findall(text)]


def called(command: str, page: str) -> click.Command | None:
    """The command of a line, or `None` where no word of it is one."""
    known, words = {**COMMANDS, **(BEFORE if page.startswith(RECORDS) else {})}, command.split()
    return next(
        (known[start] for n in (5, 4, 3, 2) if (start := " ".join(words[:n])) in known), None
    )


@pytest.mark.parametrize("page", [page for page in PAGES if named(page)])
def test_every_command_and_option_that_a_page_names_exists(page: str) -> None:
    wrong = []
    for line in named(page):
        command = called(line, page)
        if command is None:
            wrong.append(line)
            continue
        if command.context_settings.get("ignore_unknown_options"):
            continue  # its words are those of another module's command line
        known = {"--help"} | {
            word for one in command.params for word in (*one.opts, *one.secondary_opts)
        }
        typed = re.split(r" [|>&#;] ?| && ", re.sub(r"\"[^\"]*\"|'[^']*'", "TEXT", line))[0]
        wrong += [
            f"{line}: {option}"
            for option in OPTION.findall(typed.removeprefix(DOOR))
            if option not in known
        ]
    assert wrong == []
