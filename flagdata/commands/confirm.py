"""How a drafted reading is confirmed on the command line: by its hash, or by answers at a terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

import click

from flagdata.console import say
from flagdata.errors import FlagdataError, ZoneMissingError

if TYPE_CHECKING:
    from flagdata.ingest.anemometer.confirm import Drafted

T = TypeVar("T")


@dataclass(frozen=True)
class OnCommandLine:
    """Shows drafted readings; at a terminal it asks whether they are right, else it takes the hash that was given.

    Attributes:
        accept: the value of --accept.
        asks: whether somebody sits at a terminal.
        quiet: whether the preview is left to the error's document.
    """

    accept: str | None
    asks: bool
    quiet: bool = False

    def __call__(self, drafted: Drafted) -> str:
        from flagdata.ingest.anemometer.confirm import Accepting, UnconfirmedError

        if self.accept == drafted.accept:
            return Accepting(self.accept)(drafted)
        if not self.quiet:
            say(drafted.preview())
        if self.accept is not None:
            say(f"--accept {self.accept} was given for another file, another draft or other answers")
        if not self.asks or self.accept is not None:
            raise UnconfirmedError.of(drafted)
        for sentence in drafted.sentences():
            if not _answer(f'"{sentence}" Is that right? (yes/no)', ("yes", "no")) == "yes":
                raise UnconfirmedError.of(drafted)
        return "at a terminal"


def on_command_line(accept: str | None, *, as_json: bool) -> OnCommandLine:
    """What confirms the drafts of a command that was given `accept`, and prints JSON or not."""
    return OnCommandLine(accept=accept, asks=not as_json and at_terminal(), quiet=as_json)


def at_terminal() -> bool:
    """Whether somebody can be asked."""
    return sys.stdin.isatty() and sys.stderr.isatty()


def with_zone(read: Callable[[str | None], T], *, asks: bool) -> T:
    """What `read` gives; where it lacks the zone of a clock, with the one that is typed at a terminal.

    Args:
        read: called with the zone that was typed, `None` at first.
        asks: whether somebody sits at a terminal.

    Raises:
        ZoneMissingError: there is nobody to ask.
    """
    try:
        return read(None)
    except ZoneMissingError as error:
        if not asks:
            raise
        say(f"{error.where}: {error.what}" if error.where else error.what)
    return read(_typed_zone())


def _typed_zone() -> str:
    from flagdata.timebase import zone

    while True:
        question = "zone of the logger's clock (Europe/Amsterdam, +02:00, UTC)"
        text: str = click.prompt(question, err=True, prompt_suffix="> ")
        try:
            zone(text, where="zone")
        except FlagdataError as error:
            say(f"{error.what}; {error.fix}")
            continue
        return text


def _answer(question: str, words: tuple[str, ...]) -> str:
    while True:
        text: str = click.prompt(question, err=True, prompt_suffix="> ").strip().lower()
        if text in words:
            return text
        say(f"type {' or '.join(words)}")
