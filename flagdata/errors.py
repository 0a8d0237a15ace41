"""Errors that say what, where and the fix, each with a stable kind.

Every error a user can cause is a `FlagdataError`. The command line prints it as three lines and
exits with `exit_code`; `--json` prints its `JSON_NAMES`. Programs match on `kind`, an `ErrorKind`
that never changes once released, not on the wording.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from enum import StrEnum
from typing import ClassVar


def suggest(name: str, choices: Iterable[str]) -> str:
    """Asks whether the nearest of `choices` was meant, "did you mean 'drag'?"; empty where none is
    near."""
    near = difflib.get_close_matches(name, choices, n=1)
    return f"did you mean {near[0]!r}?" if near else ""


class ErrorKind(StrEnum):
    """Names every kind of error, one for each class below `FlagdataError`; the texts are those of
    `--json`."""

    FAILED = "failed"
    BAD_INPUT = "bad-input"
    LIMIT = "limit"
    TIME = "time"
    NOTHING_MEASURED = "nothing-measured"
    ZONE_MISSING = "zone-missing"
    NOT_FOUND = "not-found"
    CONFLICT = "conflict"
    CORRUPT = "corrupt"
    REFUSED = "refused"
    MISSING_EXTRA = "missing-extra"
    UNFORESEEN = "unforeseen"
    USAGE = "usage"
    UNKNOWN_NAME = "unknown-name"
    LOG_GAP = "log-gap"
    LINK = "link"
    UNCONFIRMED = "unconfirmed"
    OPEN_FACTS = "open-facts"
    PLUG_IN = "plug-in"
    RENDER_FAILED = "render-failed"
    BLENDER_UNUSABLE = "blender-unusable"
    INAPPLICABLE = "inapplicable"
    WORKERS_LOST = "workers-lost"
    TRAINING_DIVERGED = "training-diverged"
    DIVERGED = "diverged"
    CLOTH_DIVERGED = "cloth-diverged"
    FREE_RUN_DIVERGED = "free-run-diverged"


class FlagdataError(Exception):
    """Base of all errors raised on purpose.

    Args:
        what: what is wrong, one sentence without a final stop.
        where: the file, line, row, artifact or option it is about.
        fix: what the user can do about it.
    """

    kind: ClassVar[ErrorKind] = ErrorKind.FAILED
    exit_code: ClassVar[int] = 1
    JSON_NAMES: ClassVar[tuple[str, ...]] = ("kind", "what", "where", "fix")

    def __init__(self, what: str, *, where: str | None = None, fix: str) -> None:
        self.what = what
        self.where = where
        self.fix = fix
        super().__init__(f"{where}: {what}; {fix}" if where else f"{what}; {fix}")

    def __reduce__(self) -> tuple[object, ...]:
        return (_rebuild, (type(self), self.what, self.where, self.fix))


def _rebuild(cls: type[FlagdataError], what: str, where: str | None, fix: str) -> FlagdataError:
    return cls(what, where=where, fix=fix)


class InputError(FlagdataError):
    """A file or value from outside does not hold what it should."""

    kind = ErrorKind.BAD_INPUT


class LimitError(FlagdataError):
    """Input beyond a stated limit (size, frame count, expansion ratio), refused before it is read
    whole."""

    kind = ErrorKind.LIMIT


class TimeError(FlagdataError):
    """A time, zone or clock that is missing, ambiguous or impossible."""

    kind = ErrorKind.TIME


class NothingMeasuredError(InputError):
    """A log, or one anemometer of a log, none of whose values can be used."""

    kind = ErrorKind.NOTHING_MEASURED


class ZoneMissingError(TimeError):
    """Stamps of a wall clock whose zone nobody named: a question to the user, with the exit code of
    a refusal."""

    kind = ErrorKind.ZONE_MISSING
    exit_code = 3


class NotFoundError(FlagdataError):
    """An artifact, ref, file or row that is not there."""

    kind = ErrorKind.NOT_FOUND


class ConflictError(FlagdataError):
    """Something of that name or identity exists already, or changed meanwhile."""

    kind = ErrorKind.CONFLICT


class CorruptError(FlagdataError):
    """Bytes in the lake are not what their hash or format says."""

    kind = ErrorKind.CORRUPT


class RefusedError(FlagdataError):
    """The data fail a quality check: an alignment that is not certain, a pair outside tolerance."""

    kind = ErrorKind.REFUSED
    exit_code = 3


class MissingExtraError(FlagdataError):
    """What was asked for needs a package that a plain installation leaves out."""

    kind = ErrorKind.MISSING_EXTRA


class UnforeseenError(FlagdataError):
    """A defect of flagdata: an exception that nothing turned into one of these."""

    kind = ErrorKind.UNFORESEEN


class UsageError(FlagdataError):
    """Options or arguments that do not fit together."""

    kind = ErrorKind.USAGE
    exit_code = 2


class UnknownNameError(UsageError):
    """A name that is not in a table, with the nearest ones that are."""

    kind = ErrorKind.UNKNOWN_NAME

    @classmethod
    def of(
        cls, noun: str, name: str, choices: Iterable[str], *, where: str | None = None
    ) -> UnknownNameError:
        """Build the error for `name`, suggesting the closest of `choices`."""
        names = sorted(choices)
        fix = suggest(name, names) or f"known: {', '.join(names) or 'none'}"
        return cls(f"unknown {noun} {name!r}", where=where, fix=fix)
