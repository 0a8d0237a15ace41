"""Libraries whose threads do not survive a fork: a child of a process that used one is refused,
since it would hang."""

from __future__ import annotations

import os

from flagdata.errors import FlagdataError


class OneProcess:
    """Who uses a library first is the only process that may.

    Args:
        what: that was used, at the beginning of a sentence.
        fix: what to do instead of forking.
    """

    def __init__(self, text: str, *, fix: str) -> None:
        self._what, self._fix = text, fix
        self._user: int | None = None

    def check(self) -> None:
        """Notes the process that uses it.

        Raises:
            FlagdataError: it was used before this process was forked.
        """
        process = os.getpid()
        if self._user is None:
            self._user = process
        elif self._user != process:
            raise FlagdataError(
                f"{self._what} was used before this process was forked, and cannot be used in the "
                "child",
                where=f"process {process}",
                fix=self._fix,
            )
