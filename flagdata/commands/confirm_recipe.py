"""How a drafted reading is completed and confirmed on the command line: by its hash, or by answers
at a terminal."""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

from flagdata.core.console import ask, say
from flagdata.core.shell import command_line
from flagdata.errors import FlagdataError, RefusedError, ZoneMissingError

if TYPE_CHECKING:
    from flagdata.ingest.anemometer.draft.questions import Open
    from flagdata.ingest.anemometer.log_confirmation import Answers, Drafted

T = TypeVar("T")


@dataclass(frozen=True)
class OnCommandLine:
    """Shows drafted readings; at a terminal it asks whether they are right, else it takes the hash
    that was given.

    Attributes:
        accept: the value of --accept.
        asks: whether somebody sits at a terminal.
        quiet: whether the preview is left to the error's document.
    """

    accept: str | None
    asks: bool
    quiet: bool = False

    def answered(self, read: Callable[[Answers], T]) -> T:
        """See `Confirm.answered`: questions are asked at a terminal."""
        return with_answers(read, asks=self.asks)

    def __call__(self, drafted: Drafted) -> str:
        from flagdata.ingest.anemometer.log_confirmation import Accepting, UnconfirmedError

        if self.accept == drafted.accept:
            return Accepting(self.accept)(drafted)
        if not self.quiet:
            say(drafted.preview())
        if self.accept is not None:
            say(
                f"{command_line('--accept', self.accept)} was given for another file, another "
                "draft or other answers"
            )
        if not self.asks or self.accept is not None:
            raise UnconfirmedError.of(drafted)
        for sentence in drafted.sentences():
            if _choice(f'"{sentence}" Is that right? (yes/no)', ("yes", "no")) != "yes":
                raise UnconfirmedError.of(drafted)
        return "at a terminal"


def on_command_line(accept: str | None, *, as_json: bool) -> OnCommandLine:
    """What confirms the drafts of a command that was given `accept`, and prints JSON or not."""
    return OnCommandLine(accept=accept, asks=not as_json and at_terminal(), quiet=as_json)


def at_terminal() -> bool:
    """Whether somebody can be asked."""
    return sys.stdin.isatty() and sys.stderr.isatty()


def with_answers(read: Callable[[Answers], T], *, asks: bool) -> T:
    """What `read` gives; the questions that it lacks answers to are asked at a terminal, until none
    is left.

    Args:
        read: called with the answers so far.
        asks: whether somebody sits at a terminal.

    Raises:
        ZoneMissingError, OpenFactsError: there is nobody to ask.
        RefusedError: an answer that only a recipe can give.
    """
    from flagdata.ingest.anemometer.draft.questions import ZONE, OpenFactsError

    answers: dict[str, object] = {}
    while True:
        try:
            return read(answers)
        except ZoneMissingError:
            if not asks:
                raise
            questions: tuple[Open, ...] = (ZONE,)
        except OpenFactsError as error:
            if not asks:
                raise
            questions = error.questions
        for question in questions:
            name, answer = _answer(question)
            before = answers.get(name)
            answers[name] = (
                (*before, answer)
                if isinstance(before, tuple)
                else (answer,)
                if name in _LISTS
                else answer
            )


_DOUBT = "(yes; no; or a number that means no value)"
_LISTS = frozenset({"missing", "expect"})


def _answer(question: Open) -> tuple[str, object]:
    """The option that a typed answer is of, and its value."""
    from flagdata import timebase
    from flagdata.core.units import canonical

    if question.key == "sensor":
        raise RefusedError(question.question, fix=question.fix())
    checks: dict[str, Callable[[str], object]] = {
        "zone": lambda text: timebase.zone(text, where="zone") and text,
        "unit": lambda text: canonical(text, where="unit"),
        "start": lambda text: timebase.parse(text, where="start"),
        "date": _date,
        "date_order": lambda text: (
            text if text in ("dmy", "mdy", "ymd") else _wrong(text, "dmy, mdy or ymd")
        ),
        "platform": lambda text: (
            text if text in ("fixed", "moving", "corrected") else _wrong(text, "one of the three")
        ),
    }
    asked = f"{question.question} {_DOUBT}" if question.key == "expect" else question.question
    while True:
        text: str = ask(asked)
        try:
            if question.key == "expect":
                return _answers_to_check(question, text)
            return question.key, checks.get(question.key, str)(text)
        except RefusedError:
            raise
        except FlagdataError as error:
            say(f"{error.what}; {error.fix}")


def _answers_to_check(question: Open, text: str) -> tuple[str, object]:
    """The answers to a check: "yes" where the numbers are right, a number that means no value, or a
    recipe."""
    if text.lower() == "yes":
        return "expect", question.example
    if text.replace(",", ".").lstrip("+-").replace(".", "", 1).isdigit():
        return "missing", text.replace(",", ".")
    raise RefusedError(
        f"{text!r} is no answer to: {question.question}",
        fix="describe the file by a recipe, and name it by --sensor FILE.toml",
    )


def _date(text: str) -> object:
    import datetime as dt

    try:
        return dt.date.fromisoformat(text)
    except ValueError:
        return _wrong(text, "a date as 2026-05-01")


def _wrong(text: str, wanted: str) -> object:
    raise FlagdataError(f"{text!r} is no answer", fix=f"type {wanted}")


def _choice(question: str, words: tuple[str, ...]) -> str:
    while True:
        text: str = ask(question).lower()
        if text in words:
            return text
        say(f"type {' or '.join(words)}")
