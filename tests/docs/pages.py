"""Pages as their reader sees them: the files they show, the commands they give, and a runner of
these commands.

Commands run in this process, because importing the package anew for each would take most of the
time. The runner knows
what the pages use of a shell: variables, `export`, `cd`, and the last line of a command's output as
a variable. Other programs that they name are started.
"""

from __future__ import annotations

import contextlib
import io
import re
import shlex
import subprocess
from dataclasses import dataclass, field
from pathlib import Path
from string import Template

import click
import pytest

from flagdata.cli import main, root
from tests.studies.__main__ import studies

DOCS = Path(__file__).resolve().parents[2] / "docs"
DOOR = "python -m tests.studies"
_ASSIGNED = re.compile(r"(\w+)=\$\((.+) \| tail -1\)")


def blocks(page: str, language: str) -> list[str]:
    """The fenced blocks of that language, without those that have a title."""
    text = (DOCS / page).read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```", text, flags=re.DOTALL | re.MULTILINE)


def files(page: str) -> dict[str, str]:
    """Name → text of the blocks whose title is a file's name."""
    text = (DOCS / page).read_text(encoding="utf-8")
    return dict(
        re.findall(r"^```\w+ title=\"([^\"]+)\"\n(.*?)^```", text, flags=re.DOTALL | re.MULTILINE)
    )


def commands(page: str) -> list[str]:
    """The lines that begin with a prompt."""
    return [
        line[2:]
        for block in blocks(page, "console")
        for line in block.splitlines()
        if line.startswith("$ ")
    ]


@dataclass(kw_only=True)
class Shell:
    """Runs commands in the current folder.

    Attributes:
        patch: undoes what `cd` and `export` change.
        variables: set by earlier commands.
    """

    patch: pytest.MonkeyPatch
    variables: dict[str, str] = field(default_factory=dict)

    def run(self, command: str) -> str:
        """What a command printed to stdout.

        Raises:
            AssertionError: it did not exit with 0.
        """
        assigned = _ASSIGNED.fullmatch(command)
        if assigned:
            self.variables[assigned[1]] = self.run(assigned[2]).splitlines()[-1]
            return ""
        verb, *arguments = shlex.split(Template(command).substitute(self.variables))
        if verb == "cd":
            self.patch.chdir(*arguments)
        elif verb == "export":
            self.patch.setenv(*arguments[0].split("=", 1))
        elif verb == "flagdata":
            return self._program(command, arguments, root)
        elif [verb, *arguments[:2]] == DOOR.split():
            return self._program(command, arguments[2:], studies)
        else:
            subprocess.run([verb, *arguments], check=True)
        return ""

    def _program(self, command: str, arguments: list[str], group: click.Group) -> str:
        out, err = io.StringIO(), io.StringIO()
        with (
            pytest.raises(SystemExit) as ended,
            contextlib.redirect_stdout(out),
            contextlib.redirect_stderr(err),
        ):
            main(arguments, command=group)
        assert ended.value.code == 0, (
            f"{command}\nended with {ended.value.code}\n{out.getvalue()}{err.getvalue()}"
        )
        return out.getvalue()
