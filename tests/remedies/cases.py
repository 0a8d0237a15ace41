"""Remedies as tables: what a user types, what is printed after "fix:", and what is typed then."""

from __future__ import annotations

import shlex
from dataclasses import dataclass, field

from tests.remedies.user import User, done, named

OR = "or"
"""Between two ways to go on."""


@dataclass(frozen=True)
class Case:
    """One remedy.

    Attributes:
        module: whose message it is.
        words: of the remedy, enough to distinguish it from others of the module.
        command: what is typed first, after "flagdata".
        then: what is typed next, in this order; all of it succeeds. `OR` is between ways to go on,
            each from the begin.
        files: written before, by name.
        before: commands that are typed before, and succeed.
        shows: what the first command of each way prints, an expression.
        code: how the first command of each way ends.
        untried: what the remedy names beside what is typed here, where other cases type it.
    """

    module: str
    words: str
    command: str
    then: tuple[str, ...] = ()
    files: dict[str, str] = field(default_factory=dict)
    before: tuple[str, ...] = ()
    shows: str = ""
    code: int = 0
    untried: str = ""

    def __str__(self) -> str:
        return f"{self.module}: {self.words[:40]}"


def heal(user: User, case: Case) -> None:
    """Meet the trouble of a case and do what its remedy says, in each way; what was refused is then
    done."""
    ways: list[list[str]] = [[]]
    for command in case.then:
        if command == OR:
            ways.append([])
        else:
            ways[-1].append(command)
    for way in ways:
        assert way
        user.begins()
        _heal(user, case, way)


def meet(user: User, case: Case) -> str:
    """Meet the trouble of a case; what was printed after "fix:"."""
    return user.meets(case.module, case.words, *shlex.split(case.command))


def _heal(user: User, case: Case, way: list[str]) -> None:
    for name, text in case.files.items():
        place = user.folder / name
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text(text)
    for command in case.before:
        user.succeeds(*shlex.split(command))
    before = shlex.split(case.command)
    fix = user.meets(case.module, case.words, *before)
    user.leaves(case.untried.split())
    for number, command in enumerate(way):
        words = shlex.split(command)
        shows, code = (case.shows, case.code) if number == 0 else ("", 0)
        if done(words, tuple(before)) & named(fix):
            user.follows(*words, code=code, shows=shows)
        else:
            user.succeeds(*words, shows=shows)
