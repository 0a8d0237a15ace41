"""What the Delta library cannot read or write of the catalog's log, as errors that say what is to
blame."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TypeVar

from deltalake import DeltaTable
from deltalake.exceptions import DeltaError

from flagdata.core.files.durable import HEAL, disk_errors
from flagdata.core.schema import FORMAT_VERSION
from flagdata.errors import ConflictError, CorruptError, FlagdataError
from flagdata.lake.delta_log import CHECKPOINT, Log, names_in
from flagdata.storage import Place, RemotePath
from flagdata.storage.connection import delta_options, plain
from flagdata.storage.refusals import refusal

T = TypeVar("T")
HINT = "_last_checkpoint"
DELETE_HINTS = f"delete {HINT} and *{CHECKPOINT} there: they save time, the .json files hold all"
_KERNEL = "Kernel error: "
_SYSTEM_ERROR = "(os error "  # as the Delta library writes it
_UNLISTED = re.compile(
    "[\x00-\x1f\x7f\ud800-\udfff]"
)  # in names of files; the latter stand for what is no UTF-8
_NO_ANSWER = re.compile(r"Generic S3 error|Error performing [A-Z]+ ")
"""What it writes where a store refused a request or did not answer; all else concerns what the
store gave."""
_BROKEN = 4
"""How often it is asked again after an answer that broke off."""


@dataclass(frozen=True, kw_only=True)
class LogErrors:
    """The Delta table under `path`, its log and the log's entries."""

    path: Place
    log: Place
    entries: Log

    @property
    def options(self) -> dict[str, str] | None:
        """What the Delta library needs to reach the table; nothing on a disk."""
        return delta_options() if isinstance(self.path, RemotePath) else None

    @contextmanager
    def of_version(self, version: int) -> Iterator[None]:
        """Turns what the Delta library cannot read of the log into an error that names the entry to
        blame."""
        try:
            yield
        except (DeltaError, OSError) as error:
            if isinstance(self.log, RemotePath):
                if _NO_ANSWER.search(str(error)):
                    raise self._unreachable(error, self.log) from None
            elif _SYSTEM_ERROR in str(error):
                with disk_errors("reading the catalog", self.log):
                    raise OSError(str(error).splitlines()[0]) from error
            self.entries.files()  # raises, where an entry is to blame
            if (odd := next(filter(_UNLISTED.search, names_in(self.log)), None)) is not None:
                raise CorruptError(
                    "the catalog's log cannot be listed: the Delta library takes no such name",
                    where=str(self.log / odd),
                    fix="move it away: it is no part of the lake",
                ) from None
            first = (
                str(error).splitlines()[0].removeprefix(_KERNEL)
            )  # without the Delta library's stack
            first = plain(first) if isinstance(self.log, RemotePath) else first
            blamed = self._first_unreadable(version)
            saving = blamed.name.endswith(CHECKPOINT)
            raise CorruptError(
                f"{'a checkpoint' if saving else 'an entry'} of the catalog's log cannot be read: "
                f"{first}",
                where=str(blamed),
                fix=f"{DELETE_HINTS}; if that does not help, {HEAL}" if saving else HEAL,
            ) from None

    def _first_unreadable(self, version: int) -> Place:
        """Finds the entry, or checkpoint, with which the first version begins that the Delta
        library cannot open."""
        low, high = 0, version
        while low < high:
            middle = (low + high) // 2
            try:
                DeltaTable(self.path.as_uri(), version=middle, storage_options=self.options)
                low = middle + 1
            except (DeltaError, OSError):
                high = middle
        if low in self.entries.checkpoints():
            return self.log / f"{low:020d}{CHECKPOINT}"
        return self.entries.path(low)

    def repeat_reading(self, reading: Callable[[], T]) -> T:
        """Repeats what the Delta library reads, which does not ask again where an answer of a store
        breaks off."""
        for _ in range(_BROKEN):
            try:
                return reading()
            except (DeltaError, OSError) as error:
                location = self.path
                if not isinstance(location, RemotePath) or not _NO_ANSWER.search(str(error)):
                    raise
                if not refusal(error, bucket=location.bucket, where=str(location)).passing:
                    raise
        return reading()

    def refusal_of(self, error: DeltaError) -> OSError:
        """Turns what the Delta library could not write into an error of the system."""
        if isinstance(self.path, RemotePath):
            return refusal(error, bucket=self.path.bucket, where=str(self.path))
        return OSError(str(error))

    def _unreachable(self, error: Exception, log: RemotePath) -> FlagdataError:
        """Returns the error for a log in a bucket that the Delta library cannot read, without
        credentials."""
        self.entries.files()  # raises, where an entry is to blame
        refused = refusal(error, bucket=log.bucket, where=str(log))
        return FlagdataError(
            f"the catalog's log cannot be read: {refused.strerror}", where=str(log), fix=refused.fix
        )


def newer(why: str, where: Place) -> ConflictError:
    """Returns the error for a lake of a later format."""
    return ConflictError(
        "the lake was written by a newer flagdata than this one, which reads formats up to "
        f"{FORMAT_VERSION}: {why}",
        where=str(where),
        fix="install the newer flagdata",
    )
