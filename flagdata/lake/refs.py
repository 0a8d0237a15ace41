"""Tags and branches. Delta has neither: each is an entry of the log, which says what it shows and
when it was deleted.

The files in `refs/tags` and `refs/branches` repeat the log for earlier versions of flagdata, whose
refs were these files alone. What the log says counts; `flagdata doctor` writes a file anew that
says something else. A ref that only a file states, of an earlier version, is entered into the log
by the next commit.

A view is what a ref shows: for each branch of its line, that branch's rows at one version of the
table. A branch's view is its own rows at the head, and its parent's view at the version it forked
from, without rows that were withdrawn from the branch; so `main` may go on without the branch
noticing. Every row names the branch that it was committed on. A tag states its whole view and stays
what it was. Each file ends with the SHA-256 of what it states.

Instants by which a version can be named: 2026-11-26 (the end of that day, UTC), a time with its
zone, 3.days.ago.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, TypeAlias

from flagdata.core.files.durable import (
    HEAL,
    SCRATCH,
    confirming,
    disk_errors,
    flush_folder,
    make_folders,
    put_if_absent,
    unreadable,
)
from flagdata.core.files.regular_files import open_regular
from flagdata.core.provenance import recipe_hash
from flagdata.errors import (
    CorruptError,
    FlagdataError,
    NotFoundError,
    TimeError,
    UnknownNameError,
    UsageError,
)
from flagdata.lake.attempts import Looks
from flagdata.recipes.documents import from_json
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
            raise UsageError(
                f"{text!r} is before the year 1", where="--at", fix="name a later instant"
            ) from None
    if not re.match(_DAY, text):
        return None
    try:
        if _DAY.fullmatch(text):
            return parse(f"{text}T00:00:00Z") + 86_400 * NANOSECONDS - 1
        if not names_zone(text):
            raise UsageError(
                f"{text!r} names no zone", where="--at", fix=f"write {text}Z, or +02:00 behind it"
            )
        return parse(text)
    except TimeError as error:
        raise UsageError(
            error.what, where="--at", fix="write 2026-11-26, or 2026-11-26T12:00:00Z"
        ) from None


Entry: TypeAlias = Mapping[str, Any]
"""What the log states of a version, see `Catalog.history`."""
MAIN = "main"
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,99}")
_VERSION = re.compile(r"[0-9]+")
_SHOWN = 60  # characters of a name in a message
NOUNS = {"tags": "tag", "branches": "branch"}
"""Kind of a ref, which is the folder of its file → what it is called."""
ERASED = "erased"
"""Note of a branch: how many artifacts of the version that it began from it hides, since they had
been erased."""
_HASH = "sha256"
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
    """A tag (its view is fixed) or a branch (its view is what it forked from, without its own
    rows).

    Attributes:
        created: when it was made, ISO 8601.
        notes: what else its maker stated of it, by name.
    """

    name: str
    created: str
    view: View
    notes: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not (isinstance(self.name, str) and isinstance(self.created, str)):
            raise TypeError("name and time of creation are texts")


@dataclass(frozen=True, kw_only=True)
class Deletion:
    """A commit that deleted a tag or branch, at `timestamp` [UTC ms]."""

    timestamp: int

    def ends(self, ref: Ref) -> bool:
        """Checks whether a ref of that name was made before, so that it is the one that was
        deleted."""
        return datetime.fromisoformat(ref.created).timestamp() * 1000 <= self.timestamp


Key = tuple[str, str]
"""Kind ("tags" or "branches") and name of a ref."""


def check_name(name: str, *, noun: str) -> str:
    """Checks whether `name` can name a tag or branch, and returns it.

    Raises:
        UsageError: characters that are not allowed, or a name that could be taken for a version or
            commit.
    """
    if not _NAME.fullmatch(name):
        raise UsageError(
            f"{name!r} cannot name a {noun}",
            fix="use up to 100 letters, digits, dots, dashes and underscores, beginning with a "
            "letter or digit",
        )
    if name.isdecimal() or _COMMIT.fullmatch(name) or name.endswith(".json"):
        raise UsageError(
            f"{name!r} cannot name a {noun}: it looks like a version, commit or file",
            fix="add a word to it",
        )
    return name


class Refs:
    """The tags and branches of a lake; main is none of them.

    Args:
        root: the folder `refs/`, whose files repeat what the log states.
        history: gives what the log states of each version, newest first.
        looks: within an attempt the files are listed once.
    """

    def __init__(self, root: Place, history: Callable[[], Sequence[Entry]], looks: Looks) -> None:
        self.root = root
        self._history = history
        self._looks = looks
        self._lives: tuple[int, Mapping[Key, Ref | Deletion]] = (-1, {})

    def tags(self) -> dict[str, Ref]:
        """Lists all tags by name."""
        return self._all("tags")

    def branches(self) -> dict[str, Ref]:
        """Lists all branches but `main`, by name."""
        return self._all("branches")

    def older(self) -> dict[Key, Ref]:
        """Reads the refs that only a file states, by kind and name: those that an earlier version
        of flagdata made.

        Raises:
            CorruptError: a file that cannot be read, or has changed since it was written.
        """
        found = {key: self._older(key, path) for key, path in self._unstated_files().items()}
        return {key: ref for key, ref in found.items() if ref is not None}

    def enterable(self, head: int) -> dict[Key, Ref]:
        """Reads those of them that the log can take: what is damaged, or names a version after
        `head`, stays a file."""
        found: dict[Key, Ref] = {}
        for key, path in self._unstated_files().items():
            with suppress(FlagdataError):
                ref = self._older(key, path)
                if ref is not None and max(part.version for part in ref.view) <= head:
                    found[key] = ref
        return found

    def damaged(self) -> dict[Key, Place]:
        """Lists those of them that cannot be read, or have changed since they were written, by kind
        and name."""
        found: dict[Key, Place] = {}
        for key, path in self._unstated_files().items():
            try:
                self._read(path)
            except FlagdataError:
                found[key] = path
        return found

    def _unstated_files(self) -> dict[Key, Place]:
        """Lists the files of refs that the log does not state, by kind and name."""
        files = {(kind, path.stem): path for kind in NOUNS for path in self._files(kind)}
        lives = self.lives() if files else {}
        return {key: path for key, path in files.items() if not isinstance(lives.get(key), Ref)}

    def _older(self, key: Key, path: Place) -> Ref | None:
        """Reads the ref that a file states; `None` where the log says that it was deleted since."""
        ref, life = self._read(path), self.lives().get(key)
        return None if isinstance(life, Deletion) and life.ends(ref) else ref

    def lives(self) -> Mapping[Key, Ref | Deletion]:
        """Finds for each name that the log states, by kind, the ref that has it now, or the last
        deletion.

        Raises:
            CorruptError: a note of the log cannot be read.
        """
        history = self._history()
        head = int(history[0]["version"]) if history else -1
        if self._lives[0] != head:
            lives: dict[Key, Ref | Deletion] = {}
            for entry in reversed(history):
                lives |= made_by(entry)
                if (key := deleted_by(entry)) is not None:
                    lives[key] = Deletion(timestamp=int(entry["timestamp"]))
            self._lives = (head, lives)
        return self._lives[1]

    def stored(self) -> dict[Key, bytes]:
        """Returns the bytes of the file of each ref, by kind and name."""
        return {key: content_of(ref) for key, ref in self._by_key().items()}

    def cache(self, kind: str, ref: Ref) -> None:
        """Write the file of a ref that the log states, for earlier versions of flagdata. A file of
        other content goes.

        Raises:
            OSError: what the disk refused.
        """
        path = self.root / kind / f"{ref.name}.json"
        make_folders(path.parent)
        if not put_if_absent(path, content_of(ref)) and not self._states(path, ref):
            path.unlink()
            put_if_absent(path, content_of(ref))

    def stale_files(self) -> list[Place]:
        """Lists the files of refs that do not say what the log says: missing, changed, or of a ref
        that was deleted."""
        live = self._by_key()
        stale = [
            path
            for (kind, name), ref in live.items()
            if not self._states(path := self.root / kind / f"{name}.json", ref)
        ]
        stale += [
            path for kind in NOUNS for path in self._files(kind) if (kind, path.stem) not in live
        ]
        return sorted(stale)  # type: ignore[type-var]

    def strays(self) -> list[Place]:
        """Lists what lies among the files of refs and has no ref's name."""
        paths = [path for kind in NOUNS for path in (self.root / kind).glob("*")]
        strays = [
            path for path in paths if path.suffix != ".json" or not _NAME.fullmatch(path.stem)
        ]
        found = (path for path in strays if not SCRATCH.fullmatch(path.name))
        return sorted(found)  # type: ignore[type-var]

    def write_files(self) -> None:
        """Write the files of refs anew that do not say what the log says.

        Raises:
            OSError: what the disk refused.
        """
        live = self._by_key()
        for path in self.stale_files():
            ref = live.get((path.parent.name, path.stem))
            if ref is not None:
                self.cache(path.parent.name, ref)
            else:
                self._delete(path)

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
        return self._from_fork(refs[branch], head)

    def views(self, head: int) -> dict[str, View]:
        """Returns what `main` and each branch show when the table is at version `head`, by name;
        the refs are looked for once.

        Raises:
            CorruptError: see `checked`.
        """
        branches = self.branches().items()
        return {
            MAIN: self.view(MAIN, head),
            **{name: self._from_fork(ref, head) for name, ref in branches},
        }

    def _from_fork(self, branch: Ref, head: int) -> View:
        own = Slice(branch=branch.name, version=head)
        return (own, *self.checked("branches", branch, head))

    def checked(self, kind: str, ref: Ref, head: int) -> View:
        """Returns the view of a tag or branch, once it is known to name versions that there are.

        Raises:
            CorruptError: it names a later one.
        """
        newest = max(part.version for part in ref.view)
        if newest > head:
            path = self.root / kind / f"{ref.name}.json"
            message = (
                f"the {NOUNS[kind]} {ref.name!r} shows version {newest}, but the newest is {head}"
            )
            raise CorruptError(message, where=str(path), fix=HEAL)
        return ref.view

    def remove(self, kind: str, name: str) -> None:
        """Delete the file of a tag or branch; the log says whether there is one.

        Raises:
            OSError: what the disk refused.
        """
        self._delete(self.root / kind / f"{name}.json")

    def _states(self, path: Place, ref: Ref) -> bool:
        """Checks whether a file states a ref."""
        try:
            return self._read(path) == ref
        except FlagdataError:
            return False

    @staticmethod
    def _delete(path: Place) -> None:
        path.unlink(missing_ok=True)
        if isinstance(path, Path):
            with confirming(f"the deletion of {path.stem}", path):
                flush_folder(path.parent)

    def adopt(self, kind: str, name: str, stored: bytes) -> None:
        """Put the file of a ref that a lake of the same history has as a file only, unless it is
        there."""
        path = self.root / kind / f"{name}.json"
        with disk_errors(f"creating the ref {name}", path):
            put_if_absent(path, stored)

    def _all(self, kind: str) -> dict[str, Ref]:
        return {name: ref for (its_kind, name), ref in self._by_key().items() if its_kind == kind}

    def _by_key(self) -> dict[Key, Ref]:
        """Lists all refs by kind and name, sorted."""
        stated = {key: life for key, life in self.lives().items() if isinstance(life, Ref)}
        return dict(sorted({**stated, **self.older()}.items()))

    def _files(self, kind: str) -> list[Place]:
        """Lists the files of refs of a kind. What has no ref's name is none: it may be of any
        program."""
        listed = self._looks.find(kind, lambda: list((self.root / kind).glob("[!.]*.json")))
        named = (path for path in listed if _NAME.fullmatch(path.stem))
        return sorted(named)  # type: ignore[type-var]

    @staticmethod
    def _read(path: Place) -> Ref:
        try:
            with open_regular(path) as stream:
                content: dict[str, Any] = from_json(stream.read())
            noted = content.pop(_HASH, None)  # which those of older lakes lack
            if content["name"] != path.stem or (
                noted is not None and noted != recipe_hash(content)
            ):
                raise ValueError("it has changed since it was written")
            return _from_stated(content)
        except OSError as error:
            raise unreadable("the ref", path, error) from None
        except (ValueError, KeyError, TypeError, AttributeError):
            raise CorruptError(
                "the ref cannot be read, or has changed since it was written",
                where=str(path),
                fix=HEAL,
            ) from None


def _read_statement(ref: Ref) -> dict[str, Any]:
    """Returns what the log and a file state of a ref."""
    stated = {"name": ref.name, "created": ref.created, "view": as_json(ref.view)}
    return {**stated, **({"notes": dict(ref.notes)} if ref.notes else {})}


def _from_stated(stated: Mapping[str, Any]) -> Ref:
    """Reads what `_read_statement` returned.

    Raises:
        ValueError, KeyError, TypeError, AttributeError: it states no ref.
    """
    notes = {key: value for key, value in stated.get("notes", {}).items() if isinstance(value, str)}
    return Ref(
        name=stated["name"], created=stated["created"], view=view_from(stated["view"]), notes=notes
    )


def content_of(ref: Ref) -> bytes:
    """Writes what the file of a ref holds."""
    content = {"schema": "flagdata.ref/1", **_read_statement(ref)}
    content[_HASH] = recipe_hash(content)
    return (json.dumps(content, indent=2) + "\n").encode()


MADE = "made"
"""Note of a commit that makes refs: a list of what each states, with its kind."""
DELETED = "deleted"
"""Note of a commit that deletes a ref: "tag v1"."""


def note_made(refs: Mapping[Key, Ref]) -> dict[str, str]:
    """Writes the note of a commit that makes some refs; none where there are none."""
    made = [{"kind": kind, **_read_statement(ref)} for (kind, _), ref in refs.items()]
    return {MADE: json.dumps(made, ensure_ascii=False)} if made else {}


def made_by(entry: Entry) -> dict[Key, Ref]:
    """Reads the refs that a commit made, by kind and name.

    Raises:
        CorruptError: the note cannot be read.
    """
    if MADE not in entry:
        return {}
    try:
        made = {
            (str(stated["kind"]), str(stated["name"])): _from_stated(stated)
            for stated in from_json(entry[MADE])
        }
        if not all(kind in NOUNS and _NAME.fullmatch(name) for kind, name in made):
            raise ValueError("what is made is neither a tag nor a branch, or has no name")
    except (ValueError, KeyError, TypeError, AttributeError):
        raise CorruptError(
            f"what version {entry['version']} notes of tags and branches cannot be read",
            where="the catalog's log",
            fix=f"run flagdata verify; {HEAL}",
        ) from None
    return made


def deleted_by(entry: Entry) -> Key | None:
    """Returns kind and name of the ref that a commit deleted, if it deleted one."""
    noun, _, name = str(entry.get(DELETED, "")).partition(" ")
    return next(((kind, name) for kind, its_noun in NOUNS.items() if its_noun == noun), None)


def resolve(
    refs: Refs,
    at: str | None,
    *,
    head: int,
    commits: Callable[[], Mapping[str, View]],
    history: Callable[[], Iterable[Mapping[str, Any]]],
) -> View:
    """Finds the view of a tag, branch, version number, commit id, or of main at an instant; `None`
    is the head of main.

    Args:
        commits: gives commit id → what it shows; called only when `at` has the form of a commit id.
        history: gives version and timestamp [UTC ms] of each version; called only when `at` names
            an instant.

    Raises:
        NotFoundError: none of these, with the nearest name; or a version beyond the newest, or
            before the first.
        UsageError: an instant that is none, see `moments.moment`.
    """
    if at is None:
        return refs.view(MAIN, head)
    if _VERSION.fullmatch(at):
        number = at.lstrip("0") or "0"
        if (
            len(number) > len(str(head)) or int(number) > head
        ):  # Python reads no number of thousands of digits
            raise NotFoundError(
                f"there is no version {_quote_name(at)}", fix=f"the newest is {head}"
            )
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
        before = [
            entry["version"] for entry in history() if entry["timestamp"] * 1_000_000 <= instant
        ]
        if not before:
            raise NotFoundError(
                f"the lake has no version of {at} or before", fix="flagdata log lists its versions"
            )
        return (Slice(branch=MAIN, version=max(before)),)
    raise _not_there("tag, branch or commit", at, [MAIN, *tags, *branches])


def _not_there(noun: str, at: str, names: Iterable[str]) -> NotFoundError:
    at = _quote_name(
        at
    )  # also since names that are alike are sought in time with the square of the length
    return NotFoundError(f"there is no {noun} {at!r}", fix=UnknownNameError.of(noun, at, names).fix)


def _quote_name(name: str) -> str:
    return name if len(name) <= _SHOWN else f"{name[:_SHOWN]}…"
