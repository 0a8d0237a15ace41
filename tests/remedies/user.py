"""Somebody who types commands, meets what they print, and does what is printed after "fix:"."""

from __future__ import annotations

import os
import re
import shutil
import sys
import uuid
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from flagdata.core.findings import Finding
from flagdata.errors import FlagdataError
from tests.program import Ended, invoke
from tests.remedies.templates import OPTION, Remedy, relative, remedies, verbs


@dataclass(frozen=True)
class Made:
    """An error or finding that a command made: its kind, its fix, and the modules that had a part
    in it."""

    kind: str
    fix: str
    modules: frozenset[str]


def found(module: str, words: str) -> Remedy:
    """The one remedy of a module that has these words."""
    fitting = [one for one in remedies() if one.module.endswith(module) and words in one.text]
    exact = [one for one in fitting if one.text == words]
    assert len(exact or fitting) == 1, f"{module}: {words!r} is of {[str(one) for one in fitting]}"
    return (exact or fitting)[0]


@dataclass
class User:
    """Types commands in a folder whose `lake` is the lake, unless they name another.

    Attributes:
        origin: what `folder` is a copy of.
        folder: where files and the lake are.
    """

    origin: Path
    folder: Path
    met: dict[Remedy, set[str]] = field(default_factory=dict)
    """Remedies that were printed, each with the commands and options it names that are still to be
    typed."""
    _made: list[Made] = field(default_factory=list)
    _last: tuple[Remedy, str] | None = None
    _command: tuple[str, ...] = ()

    def begins(self) -> None:
        """Go to a folder that is as it was before the first command. The one before stays, since
        the process that answers queries may work in it."""
        if self.folder.exists():
            self.folder.rename(self.folder.with_name(f"{self.folder.name}-{uuid.uuid4().hex}"))
        shutil.copytree(self.origin, self.folder, symlinks=True)
        os.chdir(self.folder)

    def types(self, *words: object) -> Ended:
        """Run a command as it is typed, whatever comes of it."""
        self._made.clear()
        return invoke(*(str(word) for word in words))

    def succeeds(self, *words: object, shows: str = "") -> Ended:
        """Run a command that ends with exit code 0 and prints what the expression `shows` finds."""
        ended = self.types(*words)
        said = f"{ended.out}\n{ended.err}"
        assert ended.code == 0, f"{' '.join(map(str, words))}: exit {ended.code}\n{said}"
        assert re.search(shows, said), f"{shows!r} is not in:\n{said}"
        return ended

    def meets(self, module: str, words: str, *command: object) -> str:
        """Run a command that prints the remedy of `module` that has `words`; what was printed after
        "fix:"."""
        remedy = found(module, words)
        ended = self.types(*command)
        printed = f"{ended.out}\n{ended.err}"
        words_printed = " ".join(printed.split())  # lines of a fix are indented
        there = (made.fix for made in self._made if self._is(made, remedy))
        fix = next((fix for fix in there if fix and " ".join(fix.split()) in words_printed), None)
        if fix is None and (said := remedy.printed(printed)) is not None:
            fix = said
        assert fix is not None, (
            f"no fix of {remedy} in\n{printed}\nmade: {[(m.kind, m.fix) for m in self._made]}"
        )
        self._last, self._command = (remedy, fix), tuple(str(word) for word in command)
        self.met.setdefault(remedy, named(remedy.text))
        return fix

    def follows(self, *command: object, code: int = 0, shows: str = "") -> Ended:
        """Type what the last remedy says; it ends with `code` and prints what the expression
        `shows` finds.

        At least one command or option that the remedy names is in it, or is left out of it.
        """
        assert self._last is not None
        remedy, fix = self._last
        words = [str(word) for word in command]
        typed = done(words, self._command) & named(fix)
        assert typed, f"{' '.join(words)} is not what is said: {fix}"
        self.met[remedy] -= typed
        ended = self.types(*words)
        said = f"{ended.out}\n{ended.err}"
        assert ended.code == code, f"{' '.join(words)}: exit {ended.code}\n{said}"
        assert re.search(shows, said), f"{shows!r} is not in:\n{said}"
        assert fix not in said or code or "--sniff" in words, (
            f"after {' '.join(words)} it still says: {fix}"
        )
        return ended

    def leaves(self, words: list[str]) -> None:
        """Leave out something that the last remedy names."""
        assert self._last is not None
        assert set(words) <= named(self._last[0].text)
        self.met[self._last[0]] -= set(words)

    def again(
        self, *more: object, without: str = "", value: bool = True, code: int = 0, shows: str = ""
    ) -> Ended:
        """Follow the last remedy by typing the command again: with more options, or without one
        (and its value)."""
        command = list(self._command)
        if without:
            at = command.index(without)
            del command[at : at + 1 + value]
        return self.follows(*command, *more, code=code, shows=shows)

    @staticmethod
    def _is(made: Made, remedy: Remedy) -> bool:
        if not remedy.is_in(made.fix):
            return False
        alike = [one for one in remedies() if one.text == remedy.text]
        return len(alike) == 1 or remedy.module in made.modules

    def unfollowed(self) -> list[str]:
        """Remedies that were printed, with what of them was not typed."""
        return [f"{remedy}: {' '.join(sorted(left))}" for remedy, left in self.met.items() if left]

    @classmethod
    def at(cls, origin: Path, folder: Path, patch: pytest.MonkeyPatch) -> User:
        """A user in `folder`, whose errors and findings are noted as they are made."""
        user = cls(origin, folder)
        patch.chdir(folder.parent)  # notes where the tests were, before `begins` leaves
        user.begins()
        for made in (FlagdataError, Finding):
            patch.setattr(made, "__init__", _noting(made, user._made))
        patch.setenv("FLAGDATA_LAKE", "lake")
        return user


def _noting(made: type, notes: list[Made]) -> object:
    begin = made.__init__

    def noting(self: object, *arguments: object, **options: object) -> None:
        begin(self, *arguments, **options)
        if isinstance(fix := getattr(self, "fix", None), str):
            notes.append(Made(getattr(self, "kind", ""), fix, frozenset(_callers())))

    return noting


def _callers() -> Iterator[str]:
    frame = sys._getframe(2)
    while frame is not None:
        if (module := relative(frame.f_code.co_filename)) is not None:
            yield module
        frame = frame.f_back


def named(text: str) -> set[str]:
    """Commands and options that a text names."""
    return verbs(text) | {f"--{name}" for name in OPTION.findall(text)}


def done(words: list[str], before: tuple[str, ...]) -> set[str]:
    """What a command does of what may be named: its verb, its options, and those that it leaves
    out."""
    options = {word.partition("=")[0] for word in words if word.startswith("--")}
    left = {word.partition("=")[0] for word in before if word.startswith("--")} - options
    return {words[0]} | options | left
