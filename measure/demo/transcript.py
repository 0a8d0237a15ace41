"""Commands of the command line as a person types them, and what they print."""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from flagdata.core.console import echo_lines, say
from flagdata.errors import FlagdataError, RefusedError
from measure.demo.demo_cards import Card


@dataclass(kw_only=True)
class Transcript:
    """Runs verbs of the command line in a folder and keeps what was typed and printed."""

    folder: Path
    aside: bool = False
    """Whether what commands print goes to stderr: stdout is for a document."""
    entries: list[tuple[str, str]] = field(default_factory=list)
    cards: list[Card] = field(default_factory=list)

    def run(self, *arguments: str) -> str:
        """Run `flagdata ARGUMENTS` in the folder; its stdout. What it says on stderr passes
        through.

        Raises:
            FlagdataError: when it does not exit with 0.
        """
        printed, code = self._type_command(arguments)
        if code:
            raise FlagdataError(
                f"`{self.entries[-1][0]}` ended with {code}",
                where="the demonstration",
                fix="see its message above",
            )
        return printed

    def attempt(self, *arguments: str) -> str | None:
        """Runs `show`; returns None where the command refuses because the data fail a quality
        check.

        Raises:
            FlagdataError: when it ends with anything but 0 and 3.
        """
        printed, code = self._type_command(arguments)
        echo_lines(printed, aside=self.aside)
        if code not in (0, RefusedError.exit_code):
            raise FlagdataError(
                f"`{self.entries[-1][0]}` ended with {code}",
                where="the demonstration",
                fix="see its message above",
            )
        return None if code else printed

    def _type_command(self, arguments: tuple[str, ...]) -> tuple[str, int]:
        """Runs `flagdata ARGUMENTS` and returns its stdout and exit code."""
        typed = " ".join(map(_word, ("flagdata", *arguments)))
        say("")
        say(f"$ {typed}")
        done = subprocess.run(
            [sys.executable, "-m", "flagdata.cli", *arguments],
            cwd=self.folder,
            stdout=subprocess.PIPE,
            text=True,
            check=False,
        )
        # The folder is named when it is whole.
        self.entries.append((typed, done.stdout.replace(f"{self.folder.absolute()}{os.sep}", "")))
        return self.entries[-1][1], done.returncode

    def show(self, *arguments: str) -> str:
        """Runs a command and prints its stdout for the person who watches."""
        printed = self.run(*arguments)
        echo_lines(printed, aside=self.aside)
        return printed

    def read(self, *arguments: str) -> dict[str, Any]:
        """Runs a command with --json and decodes it; left out of the transcript, which is for
        people."""
        printed = json.loads(self.run(*arguments, "--json"))
        self.entries.pop()
        return printed


def _word(argument: str) -> str:
    """Quotes an argument as a person types it for a shell: in double quotes where it holds single
    ones, as SQL does."""
    if "'" in argument and not set(argument) & set('"$`\\!'):
        return f'"{argument}"'
    return shlex.quote(argument)
