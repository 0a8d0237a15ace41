"""The reference of the command line, docs/cli.md and a page a question beside it, from the commands
themselves: `python -m docs.generate_cli`."""

from __future__ import annotations

import inspect
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click

from flagdata.cli import GROUPS, VERBS, root
from flagdata.verbs.verb_options import LongCommand

PAGE = Path(__file__).with_name("cli.md")
FOLDER = Path(__file__).with_name("cli")
PAGES = {
    "ingest": ("bringing recordings in", ("ingest", "recover")),
    "clocks": ("film and wind on one clock", ("align", "realign")),
    "declare": ("what somebody knows of a film", ("declare", "declare-cloths")),
    "look": (
        "what a lake holds",
        ("ls", "show", "lineage", "view", "query", "log", "diff", "du", "catalog"),
    ),
    "measure": ("what a film shows", ("measure", "observe")),
    "calibrate": ("what a cloth weighs", ("calibrate",)),
    "close-loop": ("what the cloth model lacks", ("close-loop", "propose")),
    "simulate": ("simulation", ("simulate",)),
    "learn": ("data sets and networks", ("build", "train", "evaluate")),
    "versions": (
        "versions of a lake",
        ("init", "tag", "branch", "merge", "label", "withdraw", "expire"),
    ),
    "copies": ("exports and copies", ("export", "push", "pull", "clone")),
    "upkeep": ("keeping a lake whole", ("verify", "doctor", "heal", "gc")),
    "project": ("this installation", ("demo", "blender-setup", "completion", "help")),
}
"""Page → what it is about, and its verbs."""
_HEAD = """\
# Commands

These pages are generated from the commands; `flagdata help VERB` prints the same. `flagdata catalog` lists the names of
scenes, effects, materials, sensors, data sets and models that commands and recipes take.

Results go to stdout and everything else to stderr. With `--json`, before or after the command's name, the
result is one JSON document. The exit code is 0 when the command is done, 1 when it failed, 2 when it was called
wrongly, and 3 when the data fail a quality check: an alignment that is not certain, a lake that does not verify. The
environment variable `FLAGDATA_LAKE` names the lake where `--lake` is not given.
"""


def commands() -> Iterator[tuple[str, click.Command]]:
    """Every command with its full name, groups before what they hold."""
    for verb in VERBS:
        command = root.get_command(click.Context(root), verb)
        if command is None:
            raise LookupError(verb)
        yield f"flagdata {verb}", command
        for name, below in getattr(command, "commands", {}).items():
            yield f"flagdata {verb} {name}", below


def pages() -> dict[Path, str]:
    """The pages with their text: the list of all commands, and one page a question."""
    page_of = {verb: page for page, (_, verbs) in PAGES.items() for verb in verbs}
    listed = [_HEAD, "| | command | what it does |\n|---|---|---|"]
    for group, (title, verbs) in GROUPS.items():
        rows = [
            f"[`{verb}`](cli/{page_of[verb]}.md#flagdata-{verb}) | {about} |"
            for verb, (_, about) in verbs.items()
        ]
        starts = (f"**{group}**: {title}", *[""] * (len(rows) - 1))
        listed[-1] += "".join(
            f"\n| {start} | {row}" for start, row in zip(starts, rows, strict=True)
        )
    sections: dict[str, list[str]] = {}
    for name, command in commands():
        sections.setdefault(page_of[name.split(" ")[1]], []).append(_section(name, command))
    found = {PAGE: "\n".join(listed) + "\n"}
    for page, (title, _) in PAGES.items():
        head = f"# Commands: {title}\n\n[All commands](../cli.md), and what they have in common.\n"
        found[FOLDER / f"{page}.md"] = "\n".join([head, *sections[page]])
    return found


def _section(name: str, command: click.Command) -> str:
    context = click.Context(command, info_name=name)
    level = "##" if name.count(" ") == 1 else "###"
    usage = " ".join([name, *command.collect_usage_pieces(context)])
    lines = [f"{level} {name}", "", f"`{usage}`", "", _prose(inspect.cleandoc(command.help or ""))]
    sections = {"option": [entry for entry in command.params if isinstance(entry, click.Option)]}
    if isinstance(command, LongCommand) and len(command.sections()) > 1:
        sections = command.sections()
    for title, part in sections.items():
        if shown := [option for option in part if not option.hidden]:
            lines += [
                f"| {title} | meaning |",
                "|---|---|",
                *(_row(option, context) for option in shown),
                "",
            ]
    return "\n".join(lines)


def _prose(text: str) -> str:
    """The help text as Markdown: paragraphs that click keeps as they are (after \\b) become
    code."""
    paragraphs: list[str] = []
    for paragraph in text.split("\n\n"):
        if paragraph.startswith("\b"):
            lines = paragraph.splitlines()[1:]
            paragraphs.append("```text\n" + inspect.cleandoc("\n".join(lines)) + "\n```")
        else:
            paragraphs.append(" ".join(paragraph.split()))
    return "\n\n".join(paragraphs) + "\n"


def _row(option: click.Option, context: click.Context) -> str:
    names = ", ".join(f"`{name}`" for name in (*option.opts, *option.secondary_opts))
    value = "" if option.is_flag else f" `{_cell(option.make_metavar(context))}`"
    about = [_cell(option.help or "")]
    if option.required:
        about.append("Required.")
    if option.multiple:
        about.append("May be repeated.")
    written = (
        option.show_default
        if isinstance(option.show_default, str)
        else option.to_info_dict()["default"]
    )
    default = _default(written) if option.show_default else ""
    if default:
        about.append(f"Default: `{default}`.")
    return f"| {names}{value} | {' '.join(about)} |"


def _default(value: Any) -> str:
    return "" if value is None or callable(value) else str(value)


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    for path, text in pages().items():
        path.write_text(text, encoding="utf-8")
