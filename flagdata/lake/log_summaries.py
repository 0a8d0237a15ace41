"""What the log says of its versions, in few files: a fresh process reads these instead of an entry
a version.

A summary covers consecutive versions. It names the SHA-256 of the entry before its first and of its
last one, so that summaries form a chain as entries do, and the end of the chain is compared with
the log itself: what was written of another course of the log, as one that was restored from a copy
and went on, is not believed. Its own SHA-256 is in its name.
Summaries save time only; the entries hold all. A summary also notes the SHA-256 of the checkpoints
that the Delta library wrote of its versions.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import count
from typing import Any

from flagdata.core.files.durable import make_folders, put_if_absent
from flagdata.core.files.regular_files import open_regular
from flagdata.core.numbered import read_bounded
from flagdata.core.provenance import digest
from flagdata.errors import CorruptError
from flagdata.lake.delta_log import NEWEST_NUMBER, Log, is_stated, names_in
from flagdata.recipes.documents import from_json
from flagdata.storage import Place

_SCHEMA = "flagdata.history/1"
_MANY = 16  # summaries at the end of the chain, of which one is made
_LARGE = 1024  # versions of a summary that is left as it is


@dataclass(frozen=True, kw_only=True)
class Summary:
    """Consecutive versions.

    Attributes:
        name: of its file.
        before, end: SHA-256 of the log entry before the first version, "" where that is 0, and of
            the last one.
        checkpoints: version → SHA-256 of the file.
        versions: what the log states of each, oldest first.
    """

    name: str
    before: str
    end: str
    checkpoints: Mapping[int, str]
    versions: Sequence[Mapping[str, Any]]


class Summaries:
    """The summaries of a log in a folder.

    Attributes:
        checkpoints: version → SHA-256 of its checkpoint, as the summaries that were read last note
            it.
        covered: how many versions these cover.
    """

    def __init__(self, folder: Place, log: Log) -> None:
        self._folder = folder
        self._log = log
        self.checkpoints: dict[int, str] = {}
        self.covered = 0

    def read(self, head: int) -> list[Mapping[str, Any]]:
        """Reads what is summarised of the versions from 0 on, oldest first, up to `head` at most.

        Raises:
            CorruptError: a summary that cannot be read, or has changed.
        """
        return [version for summary in self._chain(head) for version in summary.versions]

    def extend(self, history: Sequence[Mapping[str, Any]], *, checkpoint: str) -> None:
        """Summarises what is not yet.

        Args:
            history: all versions, oldest first.
            checkpoint: SHA-256 of that of the last version.

        Raises:
            CorruptError: as `read`.
            OSError: what the disk refused.
        """
        chain = self._chain(len(history) - 1)
        covered = sum(len(summary.versions) for summary in chain)
        small = 0
        while small < len(chain) and len(chain[-1 - small].versions) < _LARGE:
            small += 1
        merged = chain[len(chain) - small :] if small >= _MANY else []
        first = covered - sum(len(summary.versions) for summary in merged)
        if first < len(history):
            noted = {
                number: checkpoint_hash
                for summary in merged
                for number, checkpoint_hash in summary.checkpoints.items()
            }
            self._put(history, first, {**noted, len(history) - 1: checkpoint})
        for summary in merged:
            (self._folder / summary.name).unlink(missing_ok=True)

    def _put(
        self, history: Sequence[Mapping[str, Any]], first: int, checkpoints: Mapping[int, str]
    ) -> None:
        last = len(history) - 1
        content = {
            "schema": _SCHEMA,
            "before": self._log.hash(first - 1) if first else "",
            "end": self._log.hash(last),
            "checkpoints": checkpoints,
            "versions": list(history[first:]),
        }
        text = json.dumps(content, ensure_ascii=False, separators=(",", ":"))
        make_folders(self._folder)
        put_if_absent(self._folder / f"{first:020d}-{last:020d}-{digest(text)}.json", text.encode())

    def _chain(self, head: int) -> list[Summary]:
        """Reads summaries of versions from 0 on, each of which goes on from the one before it, the
        last as the log does."""
        names: dict[int, list[tuple[int, str]]] = {}
        for name in names_in(self._folder):
            covered = _covered_versions(name, head)
            if covered is not None:
                names.setdefault(covered[0], []).append((covered[1], name))
        chain: list[Summary] = []
        following, before = 0, ""
        while following in names:
            read = (self._read(name) for _, name in sorted(names[following], reverse=True))
            summary_found = next(
                (summary for summary in read if summary is not None and summary.before == before),
                None,
            )
            if summary_found is None:
                break
            chain.append(summary_found)
            following, before = following + len(summary_found.versions), summary_found.end
        while chain and self._log.hash(following - 1) != chain[-1].end:
            following -= len(chain.pop().versions)
        self.covered = following
        self.checkpoints = {
            number: noted for summary in chain for number, noted in summary.checkpoints.items()
        }
        return chain

    def _read(self, name: str) -> Summary | None:
        path = self._folder / name
        try:
            with open_regular(path) as stream:
                text = stream.read().decode(errors="replace")
            if digest(text) != name.removesuffix(".json").rpartition("-")[2]:
                raise ValueError("its checksum is wrong")
            content = from_json(text)
            versions = content["versions"]
            covered = _covered_versions(name, NEWEST_NUMBER)
            if covered is None or len(versions) != covered[1] + 1 - covered[0]:
                raise ValueError("it states other versions than its name")
            if not all(map(is_stated, versions, count(covered[0]))):
                raise ValueError("it states other versions than its name, or none")
            noted = content.get("checkpoints", {})
            numbers = [
                version
                for number in noted
                if (version := read_bounded(number, most=NEWEST_NUMBER)) is not None
            ]
            checkpoints = dict(zip(numbers, map(str, noted.values()), strict=True))
            return Summary(
                name=name,
                before=content["before"],
                end=content["end"],
                checkpoints=checkpoints,
                versions=versions,
            )
        except FileNotFoundError:  # another process has just made one of several
            return None
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
            raise CorruptError(
                f"a summary of the catalog's log cannot be read: {error}",
                where=str(path),
                fix="delete it: it saves time, the entries of the log hold all",
            ) from None


def summaries_in(folder: Place) -> list[str]:
    """Names of the summaries in a folder; what else is there is no part of the lake."""
    return [name for name in names_in(folder) if _covered_versions(name, NEWEST_NUMBER) is not None]


def _covered_versions(name: str, head: int) -> tuple[int, int] | None:
    """Reads the first and the last version of a summary of its file's name; None of others, and of
    later than `head`."""
    first, last = (read_bounded(number, most=head) for number in f"{name}-".split("-")[:2])
    return None if first is None or last is None else (first, last)
