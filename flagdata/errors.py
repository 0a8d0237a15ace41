"""Errors that say what, where and the fix, each with a stable kind.

Every error a user can cause is a `FlagdataError`. The command line prints it as three lines and exits with `exit_code`;
`--json` prints `as_dict()`. Programs match on `kind`, which never changes once released, not on the wording.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import ClassVar


class FlagdataError(Exception):
    """Base of all errors raised on purpose.

    Args:
        what: what is wrong, one sentence without a final stop.
        where: the file, line, row, artifact or option it is about.
        fix: what the user can do about it.
    """

    kind: ClassVar[str] = "failed"
    exit_code: ClassVar[int] = 1

    def __init__(self, what: str, *, where: str | None = None, fix: str) -> None:
        self.what = what
        self.where = where
        self.fix = fix
        super().__init__(f"{where}: {what}; {fix}" if where else f"{what}; {fix}")

    def __reduce__(self) -> tuple[object, ...]:
        return (_rebuild, (type(self), self.what, self.where, self.fix))

    def as_dict(self) -> dict[str, str | None]:
        return {"kind": self.kind, "what": self.what, "where": self.where, "fix": self.fix}


def _rebuild(cls: type[FlagdataError], what: str, where: str | None, fix: str) -> FlagdataError:
    return cls(what, where=where, fix=fix)


class InputError(FlagdataError):
    """A file or value from outside does not hold what it should."""

    kind = "bad-input"


class LimitError(FlagdataError):
    """Input beyond a stated limit (size, frame count, expansion ratio), refused before it is read whole."""

    kind = "limit"


class TimeError(FlagdataError):
    """A time, zone or clock that is missing, ambiguous or impossible."""

    kind = "time"


class NothingMeasuredError(InputError):
    """A log, or one anemometer of a log, none of whose values can be used."""

    kind = "nothing-measured"


class ZoneMissingError(TimeError):
    """Stamps of a wall clock whose zone nobody named: a question to the user, with the exit code of a refusal."""

    kind = "zone-missing"
    exit_code = 3


class NotFoundError(FlagdataError):
    """An artifact, ref, file or row that is not there."""

    kind = "not-found"


class ConflictError(FlagdataError):
    """Something of that name or identity exists already, or changed meanwhile."""

    kind = "conflict"


class CorruptError(FlagdataError):
    """Bytes in the lake are not what their hash or format says."""

    kind = "corrupt"


class RefusedError(FlagdataError):
    """The data fail a quality check: an alignment that is not certain, a pair outside tolerance."""

    kind = "refused"
    exit_code = 3


class MissingExtraError(FlagdataError):
    """What was asked for needs a package that a plain installation leaves out."""

    kind = "missing-extra"


class UnforeseenError(FlagdataError):
    """A defect of flagdata: an exception that nothing turned into one of these."""

    kind = "unforeseen"


class UsageError(FlagdataError):
    """Options or arguments that do not fit together."""

    kind = "usage"
    exit_code = 2


class UnknownNameError(UsageError):
    """A name that is not in a table, with the nearest ones that are."""

    kind = "unknown-name"

    @classmethod
    def of(cls, noun: str, name: str, known: Iterable[str], *, where: str | None = None) -> UnknownNameError:
        """Build the error for `name`, suggesting the closest of `known`."""
        names = sorted(known)
        close = difflib.get_close_matches(name, names, n=1)
        fix = f"did you mean {close[0]!r}?" if close else f"known: {', '.join(names) or 'none'}"
        return cls(f"unknown {noun} {name!r}", where=where, fix=fix)
