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

import click

from flagdata.console import say
from flagdata.errors import FlagdataError
from measure.demo.cards import Card


@dataclass(kw_only=True)
class Transcript:
    """Runs verbs of the command line in a folder and keeps what was typed and printed."""

    folder: Path
    entries: list[tuple[str, str]] = field(default_factory=list)
    cards: list[Card] = field(default_factory=list)

    def run(self, *arguments: str) -> str:
        """Run `flagdata ARGUMENTS` in the folder; its stdout. What it says on stderr passes through.

        Raises:
            FlagdataError: when it does not exit with 0.
        """
        typed = shlex.join(("flagdata", *arguments))
        say(f"\n$ {typed}")
        done = subprocess.run(
            [sys.executable, "-m", "flagdata.cli", *arguments],
            cwd=self.folder,
            stdout=subprocess.PIPE,
            text=True,
            check=False,
        )
        if done.returncode:
            raise FlagdataError(
                f"`{typed}` ended with {done.returncode}", where="the demonstration", fix="see its message above"
            )
        printed = done.stdout.replace(
            f"{self.folder.absolute()}{os.sep}", ""
        )  # a folder that is named when it is whole
        self.entries.append((typed, printed))
        return printed

    def show(self, *arguments: str) -> str:
        """`run`, and its stdout printed for the person who watches."""
        printed = self.run(*arguments)
        click.echo(printed, nl=False)
        return printed

    def read(self, *arguments: str) -> dict[str, Any]:
        """`run` with --json, decoded; left out of the transcript, which is for people."""
        printed = json.loads(self.run(*arguments, "--json"))
        self.entries.pop()
        return printed
