"""Tags and branches: small JSON files, put only if absent. Delta has neither.

A view is what a ref shows: for each branch of its line, that branch's rows at one version of the table. A branch's
view is its own rows at the head, and its parent's view at the version it forked from, without rows that were withdrawn
from the branch; so `main` may go on without the branch noticing. Every row names the branch that it was committed on. A
tag stores its whole view and stays what it was. Each file ends with the SHA-256 of what it states.

Instants by which a version can be named: 2026-11-26 (the end of that day, UTC), a time with its zone, 3.days.ago.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

from flagdata.documents import from_json
from flagdata.durable import confirming, disk_errors, flush_folder, put_if_absent, unreadable
from flagdata.errors import ConflictError, CorruptError, NotFoundError, TimeError, UnknownNameError, UsageError
from flagdata.files import open_regular
from flagdata.provenance import recipe_hash
from flagdata.storage import Place
from flagdata.timebase import NANOSECONDS, from_datetime, names_zone, parse

_DAY = re.compile(r"\d{4}-\d{2}-\d{2}")
_AGO = re.compile(r"(\d{1,6})\.(second|minute|hour|day|week)s?\.ago")
_SECONDS = {"second": 1, "minute": 60, "hour": 3600, "day": 86_400, "week": 7 * 86_400}


def moment(text: str, *, now: datetime | None = None) -> int | None:
    """Reads the instant that a text names [UTC ns]; `None` for what names none.

    Args:
        now: from which "ago" counts; the system's clock if `None`.

    Raises:
        UsageError: a day that the calendar does not have, or a time without its zone.
    """
    ago = _AGO.fullmatch(text)
    if ago is not None:
        passed = timedelta(seconds=int(ago[1]) * _SECONDS[ago[2]])
        try:
            return from_datetime((now or datetime.now(UTC)) - passed)
        except OverflowError:
            raise UsageError(f"{text!r} is before the year 1", where="--at", fix="name a later instant") from None
    if not re.match(_DAY, text):
        return None
    try:
        if _DAY.fullmatch(text):
            return parse(f"{text}T00:00:00Z") + 86_400 * NANOSECONDS - 1
        if not names_zone(text):
            raise UsageError(f"{text!r} names no zone", where="--at", fix=f"write {text}Z, or +02:00 behind it")
        return parse(text)
    except TimeError as error:
        raise UsageError(error.what, where="--at", fix="write 2026-11-26, or 2026-11-26T12:00:00Z") from None


MAIN = "main"
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,99}")
_VERSION = re.compile(r"[0-9]+")
_SHOWN = 60  # characters of a name in a message
_NOUNS = {"tags": "tag", "branches": "branch"}
_HASH = "sha256"
_PULL = "delete the file and flagdata pull a clone of this lake, or restore it from a copy"
_COMMIT = re.compile(r"c[0-9a-f]{16}")


@dataclass(frozen=True, kw_only=True)
class Slice:
    """The rows of one branch at one version.

    Raises:
        ValueError: what is no branch's name or no version, as a damaged ref may state.
    """

    branch: str
    version: int

    def __post_init__(self) -> None:
        if not isinstance(self.branch, str) or not _NAME.fullmatch(self.branch):
            raise ValueError(f"{self.branch!r} names no branch")
        if type(self.version) is not int or self.version < 0:
            raise ValueError(f"{self.version!r} is no version")


View = tuple[Slice, ...]


def as_json(view: View) -> list[dict[str, Any]]:
    """Returns the form in which a view is stored."""
    return [{"branch": part.branch, "version": part.version} for part in view]


def view_from(stored: Iterable[Mapping[str, Any]]) -> View:
    """Reads the view that `as_json` stored.

    Raises:
        ValueError, KeyError, TypeError: it is no view.
    """
    view = tuple(Slice(branch=part["branch"], version=part["version"]) for part in stored)
    if not view:
        raise ValueError("the view is empty")
    return view


@dataclass(frozen=True, kw_only=True)
class Ref:
    """A tag (its view is fixed) or a branch (its view is what it forked from, without its own rows)."""

    name: str
    created: str
    view: View

    def __post_init__(self) -> None:
        if not (isinstance(self.name, str) and isinstance(self.created, str)):
            raise TypeError("name and time of creation are texts")


def check_name(name: str, *, noun: str) -> str:
    """Checks whether `name` can name a tag or branch, and returns it.

    Raises:
        UsageError: characters that are not allowed, or a name that could be taken for a version or commit.
    """
    if not _NAME.fullmatch(name):
        raise UsageError(
            f"{name!r} cannot name a {noun}",
            fix="use up to 100 letters, digits, dots, dashes and underscores, beginning with a letter or digit",
        )
    if name.isdecimal() or _COMMIT.fullmatch(name) or name.endswith(".json"):
        raise UsageError(
            f"{name!r} cannot name a {noun}: it looks like a version, commit or file", fix="add a word to it"
        )
    return name


class Refs:
    """The folder `refs/` of a lake."""

    def __init__(self, root: Place) -> None:
        self.root = root

    def make_folders(self) -> None:
        for kind in ("tags", "branches", "history"):
            (self.root / kind).mkdir(parents=True)

    def tags(self) -> dict[str, Ref]:
        """Reads all tags by name."""
        return self._all("tags")

    def branches(self) -> dict[str, Ref]:
        """Reads all branches but `main`, by name."""
        return self._all("branches")

    def put(self, kind: str, name: str, view: View) -> Ref:
        """Create a tag or branch, and return it.

        Args:
            kind: "tags" or "branches".

        Raises:
            ConflictError: the name is taken, by a tag or by a branch.
        """
        check_name(name, noun=_NOUNS[kind])
        other_kind = "branches" if kind == "tags" else "tags"
        ref = Ref(name=name, created=datetime.now(UTC).isoformat(timespec="seconds"), view=view)
        content = {
            "schema": "flagdata.ref/1",
            "name": ref.name,
            "created": ref.created,
            "view": as_json(view),
        }
        content[_HASH] = recipe_hash(content)
        path = self.root / kind / f"{name}.json"
        with disk_errors(f"creating the ref {name}", path):
            # In a bucket a put of the same bytes counts as one that was sent twice, so that it would not say so.
            taken = name == MAIN or any((self.root / folder / f"{name}.json").exists() for folder in (other_kind, kind))
            if taken or not put_if_absent(path, (json.dumps(content, indent=2) + "\n").encode()):
                raise ConflictError(
                    f"there is a tag or branch {name!r} already",
                    where=str(path),
                    fix="choose another name; a tag never moves" if kind == "tags" else "choose another name",
                )
        return ref

    def stored(self) -> dict[tuple[str, str], bytes]:
        """Reads the bytes of each ref by its kind ("tags" or "branches") and name."""
        contents: dict[tuple[str, str], bytes] = {}
        for kind, refs in (("tags", self.tags()), ("branches", self.branches())):
            for name in refs:
                with open_regular(self.root / kind / f"{name}.json") as stream:
                    contents[kind, name] = stream.read()
        return contents

    def adopt(self, kind: str, name: str, stored: bytes) -> None:
        """Put a ref of another lake of the same history, unless it is there."""
        path = self.root / kind / f"{name}.json"
        with disk_errors(f"creating the ref {name}", path):
            put_if_absent(path, stored)

    def view(self, branch: str, head: int) -> View:
        """Returns what a branch shows when the table is at version `head`.

        Raises:
            NotFoundError: no such branch, with the nearest name.
        """
        if branch == MAIN:
            return (Slice(branch=MAIN, version=head),)
        refs = self.branches()
        if branch not in refs:
            raise _not_there("branch", branch, [MAIN, *refs])
        return (Slice(branch=branch, version=head), *self.checked("branches", refs[branch], head))

    def checked(self, kind: str, ref: Ref, head: int) -> View:
        """Returns the view of a tag or branch, once it is known to name versions that there are.

        Raises:
            CorruptError: it names a later one.
        """
        newest = max(part.version for part in ref.view)
        if newest > head:
            path = self.root / kind / f"{ref.name}.json"
            message = f"the {_NOUNS[kind]} {ref.name!r} shows version {newest}, but the newest is {head}"
            raise CorruptError(message, where=str(path), fix=_PULL)
        return ref.view

    def remove(self, kind: str, name: str) -> None:
        """Take a tag or branch away; what is noted of it is the log's.

        Raises:
            OSError: what the disk refused.
        """
        path = self.root / kind / f"{name}.json"
        path.unlink()
        if isinstance(path, Path):
            with confirming(f"the deletion of {name}", path):
                flush_folder(path.parent)

    def _all(self, kind: str) -> dict[str, Ref]:
        return {path.stem: self._read(path) for path in sorted((self.root / kind).glob("[!.]*.json"))}  # type: ignore[type-var]

    @staticmethod
    def _read(path: Place) -> Ref:
        try:
            with open_regular(path) as stream:
                content: dict[str, Any] = from_json(stream.read())
            noted = content.pop(_HASH, None)  # which those of older lakes lack
            if content["name"] != path.stem or (noted is not None and noted != recipe_hash(content)):
                raise ValueError("it has changed since it was written")
            return Ref(name=content["name"], created=content["created"], view=view_from(content["view"]))
        except OSError as error:
            raise unreadable("the ref", path, error) from None
        except (ValueError, KeyError, TypeError, AttributeError):
            raise CorruptError(
                "the ref cannot be read, or has changed since it was written",
                where=str(path),
                fix=_PULL,
            ) from None


def resolve(
    refs: Refs,
    at: str | None,
    *,
    head: int,
    commits: Callable[[], Mapping[str, View]],
    history: Callable[[], Iterable[Mapping[str, Any]]],
) -> View:
    """Finds the view of a tag, branch, version number, commit id, or of main at an instant; `None` is the head of main.

    Args:
        commits: gives commit id → what it shows; called only when `at` has the form of a commit id.
        history: gives version and timestamp [UTC ms] of each version; called only when `at` names an instant.

    Raises:
        NotFoundError: none of these, with the nearest name; or a version beyond the newest, or before the first.
        UsageError: an instant that is none, see `moments.moment`.
    """
    if at is None:
        return refs.view(MAIN, head)
    if _VERSION.fullmatch(at):
        number = at.lstrip("0") or "0"
        if len(number) > len(str(head)) or int(number) > head:  # Python reads no number of thousands of digits
            raise NotFoundError(f"there is no version {_quoted(at)}", fix=f"the newest is {head}")
        return (Slice(branch=MAIN, version=int(number)),)
    if _COMMIT.fullmatch(at):
        views = commits()
        if at not in views:
            raise _not_there("commit", at, views)
        return views[at]
    tags = refs.tags()
    if at in tags:
        return refs.checked("tags", tags[at], head)
    branches = refs.branches()
    if at == MAIN or at in branches:
        return refs.view(at, head)
    instant = moment(at)
    if instant is not None:
        before = [entry["version"] for entry in history() if entry["timestamp"] * 1_000_000 <= instant]
        if not before:
            raise NotFoundError(f"the lake has no version of {at} or before", fix="flagdata log lists its versions")
        return (Slice(branch=MAIN, version=max(before)),)
    raise _not_there("tag, branch or commit", at, [MAIN, *tags, *branches])


def _not_there(noun: str, at: str, names: Iterable[str]) -> NotFoundError:
    at = _quoted(at)  # also since names that are alike are sought in time with the square of the length
    return NotFoundError(f"there is no {noun} {at!r}", fix=UnknownNameError.of(noun, at, names).fix)


def _quoted(name: str) -> str:
    return name if len(name) <= _SHOWN else f"{name[:_SHOWN]}…"
