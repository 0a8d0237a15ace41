"""What a lake must show, as a plain model: it knows nothing of how flagdata keeps it.

A lake is the list of its versions; each is a `State`: what the branches and tags are, and what was
erased. The commits of all lakes are one graph, as git has them: a commit is the rows that it shows,
each with its labels, and the commits that it was made from. A method says what an operation does,
as the documentation has it, without doing it.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

MAIN = "main"
Value = bool | int | str
Labels = Mapping[str, Value]
Rows = Mapping[str, Labels]
"""Name of an item → its labels."""


@dataclass(frozen=True, kw_only=True)
class Item:
    """An artifact that can be ingested.

    Attributes:
        data: what its object holds; `None` where it has none.
        is_folder: whether its object is a folder.
        parents: items that it is made from.
        is_slice: whether it is a clip: a slice of its parent's object.
    """

    name: str
    data: str | None = None
    is_folder: bool = False
    parents: tuple[str, ...] = ()
    is_slice: bool = False


ITEMS = {
    item.name: item
    for item in (
        Item(name="film", data="film"),
        Item(name="other", data="other"),
        Item(name="twin", data="film"),  # the same bytes, understood in another way
        Item(name="clip", data="film", parents=("film",), is_slice=True),
        Item(name="sheet", data="sheet", is_folder=True, parents=("film",)),
        Item(name="result", parents=("other",)),
    )
}


class Refused(Exception):  # noqa: N818 — an outcome
    """The operation must be refused, and change nothing."""


class Unclear(Exception):  # noqa: N818 — an outcome
    """Git would merge several bases first; which one is taken is no law."""


@dataclass(frozen=True, kw_only=True)
class Commit:
    """What was shown by a commit, and the commits that it was made from."""

    rows: Rows
    parents: tuple[int, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Shown:
    """A commit of the graph, as of a version of the lake."""

    commit: int
    version: int


@dataclass(frozen=True, kw_only=True)
class State:
    """What a version of a lake shows.

    Attributes:
        branches: name → the commits that it pointed to; its first the one that it began from.
        deleted: name → what a deleted tag of that name showed.
        erased: item → the version that erased it last.
        expired: data that went with old versions → the version that let these expire.
    """

    branches: Mapping[str, tuple[int, ...]]
    tags: Mapping[str, Shown] = field(default_factory=dict)
    deleted: Mapping[str, frozenset[str]] = field(default_factory=dict)
    erased: Mapping[str, int] = field(default_factory=dict)
    expired: Mapping[str, int] = field(default_factory=dict)

    def tip(self, branch: str) -> int:
        return self.branches[branch][-1]

    def moved(self, branch: str, commit: int) -> State:
        """The state with a further commit on a branch."""
        return replace(self, branches={**self.branches, branch: (*self.branches[branch], commit)})


class Graph:
    """All commits."""

    def __init__(self) -> None:
        self.commits = [Commit(rows={})]

    def add(self, rows: Rows, *parents: int) -> int:
        self.commits.append(Commit(rows=rows, parents=parents))
        return len(self.commits) - 1

    def rows(self, commit: int) -> Rows:
        return self.commits[commit].rows

    def ancestors(self, commit: int) -> set[int]:
        """The commit, and all that went into it."""
        found, left = set(), [commit]
        while left:
            found.add(left[-1])
            left += [parent for parent in self.commits[left.pop()].parents if parent not in found]
        return found

    def base(self, first: int, second: int) -> int:
        """The newest commit that went into both.

        Raises:
            Unclear: there are several.
        """
        common = self.ancestors(first) & self.ancestors(second)
        newest = common - {older for newer in common for older in self.ancestors(newer) - {newer}}
        if len(newest) > 1:
            raise Unclear
        return newest.pop()


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What an operation does.

    Attributes:
        state: after its commit; `None` where it makes none.
        stored: the data that are there afterwards.
    """

    state: State | None
    stored: frozenset[str]


def data_of(items: Iterable[str]) -> frozenset[str]:
    """The data of some items."""
    return frozenset(data for name in items if (data := ITEMS[name].data) is not None)


def made_from(items: Collection[str], rows: Collection[str]) -> set[str]:
    """The rows that were made from some items, directly or not; without these."""
    reached = set(items)
    while more := {name for name in rows if reached.intersection(ITEMS[name].parents)} - reached:
        reached |= more
    return reached - set(items)


def clips_of(items: Collection[str], rows: Collection[str]) -> set[str]:
    """The rows that are slices of some items."""
    return {name for name in rows if ITEMS[name].is_slice and set(ITEMS[name].parents) & set(items)}


def check_columns(rows: Rows) -> None:
    """Labels are columns of SQL: one spelling and one type each.

    Raises:
        Refused: they are not.
    """
    spellings: dict[str, str] = {}
    types: dict[str, type] = {}
    for labels in rows.values():
        for name, value in labels.items():
            if spellings.setdefault(name.lower(), name) != name or types.setdefault(
                name, type(value)
            ) is not type(value):
                raise Refused(f"the label {name}")


def _without_orphans(rows: Rows) -> Rows:
    """Some rows.

    Raises:
        Refused: one lacks what it was made from.
    """
    for name in rows:
        if not set(ITEMS[name].parents) <= rows.keys():
            raise Refused(f"{name} would lack what it was made from")
    return rows


class LakeModel:
    """A lake.

    Attributes:
        versions: its state at each; versions of two lakes are one where these are one object.
        commits: id of a commit that was acknowledged → what it shows.
        stored: the data that are in it.
    """

    def __init__(self, graph: Graph) -> None:
        self.graph = graph
        self.versions = [State(branches={MAIN: (0,)})]
        self.commits: dict[str, Shown] = {}
        self.stored: frozenset[str] = frozenset()

    @property
    def head(self) -> State:
        return self.versions[-1]

    def copied(self, upto: int) -> LakeModel:
        """The lake as it was at a version, with all data."""
        other = LakeModel(self.graph)
        other.versions = self.versions[: upto + 1]
        other.commits = {
            commit: shown for commit, shown in self.commits.items() if shown.version <= upto
        }
        other.stored = self.stored
        return other

    def shown(self, at: str) -> Shown:
        """What a branch, tag, version or commit shows."""
        if at in self.head.branches:
            return Shown(commit=self.head.tip(at), version=len(self.versions) - 1)
        if at in self.head.tags:
            return self.head.tags[at]
        if at in self.commits:
            return self.commits[at]
        return Shown(commit=self.versions[int(at)].tip(MAIN), version=int(at))

    def rows(self, at: str) -> Rows:
        return self.graph.rows(self.shown(at).commit)

    def refs(self) -> dict[str, Rows]:
        """What each branch and tag shows."""
        return {ref: self.rows(ref) for ref in (*self.head.branches, *self.head.tags)}

    def needed(self) -> frozenset[str]:
        """The data that a branch shows, or a tag that is not older than their erasure."""
        return data_of(
            name
            for ref, rows in self.refs().items()
            for name in self.unerased(rows, self.shown(ref))
        )

    def unerased(self, rows: Iterable[str], shown: Shown) -> set[str]:
        """Those of some rows that were not erased after a version that showed them."""
        return {name for name in rows if self.head.erased.get(name, -1) <= shown.version}

    def unfinished(self) -> frozenset[str]:
        """Data that are there though they were given up: all items of them were erased, or they
        expired, and no version showed them since."""
        given_up = data_of(self.head.erased) | self.head.expired.keys()
        return (self.stored & given_up) - self._wanted()

    def _wanted(self) -> frozenset[str]:
        """The data of rows that a version showed since they were given up, if ever they were."""
        head = self.head
        given_up = dict(head.expired)
        for name, version in head.erased.items():
            for data in data_of([name]):
                given_up[data] = max(version, given_up.get(data, 0))
        shown = {
            data
            for version, state in enumerate(self.versions)
            for branch in state.branches
            for data in data_of(
                self.unerased(self.graph.rows(state.tip(branch)), Shown(commit=0, version=version))
            )
            if version >= given_up.get(data, 0)
        }
        return self.needed() | shown

    def _committed(
        self, branch: str, rows: Rows, *merged: int, stored: Collection[str] = ()
    ) -> Outcome:
        commit = self.graph.add(_without_orphans(rows), self.head.tip(branch), *merged)
        return Outcome(
            state=self.head.moved(branch, commit), stored=self.stored | frozenset(stored)
        )

    def ingest(self, branch: str, items: Sequence[str]) -> Outcome:
        """Those that the branch has are left as they are; what is new has no label."""
        rows = self.rows(branch)
        stored = data_of(items)
        if rows.keys() >= set(items):
            return Outcome(state=None, stored=self.stored | stored)
        return self._committed(branch, {**{name: {} for name in items}, **rows}, stored=stored)

    def label(
        self, branch: str, items: Collection[str], labels: Mapping[str, Value | None]
    ) -> Outcome:
        """Clips are labelled with what they are slices of."""
        rows = self.rows(branch)
        if not rows.keys() >= set(items):
            raise Refused("not there")
        labelled = {
            name: {
                key: value for key, value in {**rows[name], **labels}.items() if value is not None
            }
            for name in {*items, *clips_of(items, rows)}
        }
        check_columns({**rows, **labelled})
        return self._committed(branch, {**rows, **labelled})

    def withdraw(self, branch: str, items: Collection[str], *, with_descendants: bool) -> Outcome:
        rows = self.rows(branch)
        if not rows.keys() >= set(items):
            raise Refused("not there")
        going = {
            *items,
            *clips_of(items, rows),
            *(made_from(items, rows) if with_descendants else ()),
        }
        return self._committed(
            branch, {name: labels for name, labels in rows.items() if name not in going}
        )

    def erase(self, items: Collection[str], *, with_descendants: bool) -> Outcome:
        """Off all branches at once; tags go on to list the rows, without data. What was erased
        before, and did not come again, is erased again only as far as its data are still there, and
        what was erased with it.
        """
        refs = self.refs()
        going = set(items)
        for rows in refs.values():
            going |= clips_of(items, rows)
            going |= made_from(items, rows) if with_descendants else set()
        unseen = set(items) - {name for rows in refs.values() for name in rows}
        if not unseen <= self.head.erased.keys() or data_of(unseen) & self._wanted():
            raise Refused("no ref shows it")
        together = {self.head.erased[name] for name in {*items} & self.head.erased.keys()}
        rest = self.unfinished() & data_of(
            name for name, version in self.head.erased.items() if version in together
        )
        for rows in refs.values():
            if made_from(going & rows.keys(), rows) - going:
                raise Refused("something that was made from it would stay")
        state = self.head
        going = {name for name in going if any(name in rows for rows in refs.values())}
        for branch in state.branches:
            rows = self.rows(branch)
            if going & rows.keys():
                staying = {name: labels for name, labels in rows.items() if name not in going}
                state = state.moved(branch, self.graph.add(staying, state.tip(branch)))
        erased = {**state.erased, **dict.fromkeys(going, len(self.versions))}
        after = self.copied(len(self.versions) - 1)
        after.versions.append(replace(state, erased=erased))
        wanted = self._wanted()
        erased_before = {name for name in self.head.erased if not data_of([name]) & wanted}
        is_new = state is not self.head or not going <= erased_before
        going_data = (data_of(going) - after.needed()) | rest
        return Outcome(state=after.head if is_new else None, stored=self.stored - going_data)

    def _check_new(self, name: str, shown: Shown) -> None:
        if name in self.head.branches or name in self.head.tags:
            raise Refused("the name is taken")
        if not data_of(self.unerased(self.graph.rows(shown.commit), shown)) <= self.stored:
            raise Refused("its data are gone")

    def tag(self, name: str, at: str) -> Outcome:
        shown = self.shown(at)
        self._check_new(name, shown)
        if (
            self.head.deleted.get(name, self.graph.rows(shown.commit).keys())
            != self.graph.rows(shown.commit).keys()
        ):
            raise Refused("it showed something else")
        state = replace(self.head, tags={**self.head.tags, name: shown})
        return Outcome(state=state, stored=self.stored)

    def branch(self, name: str, at: str) -> Outcome:
        """What was erased since, and is on no branch, is not on the new one."""
        shown = self.shown(at)
        self._check_new(name, shown)
        rows = self.graph.rows(shown.commit)
        alive = {item for branch in self.head.branches for item in self.rows(branch)}
        staying = {
            item: labels
            for item, labels in rows.items()
            if item in self.unerased(rows, shown) | alive
        }
        if made_from(rows.keys() - staying.keys(), rows) & staying.keys():
            raise Refused("something that was made from what was erased would stay")
        hiding = () if len(staying) == len(rows) else (self.graph.add(staying, shown.commit),)
        state = replace(self.head, branches={**self.head.branches, name: (shown.commit, *hiding)})
        return Outcome(state=state, stored=self.stored)

    def delete(self, name: str, *, discard: bool) -> Outcome:
        """A tag's name shows nothing else ever; a branch's may be used again."""
        head = self.head
        if name == MAIN or (name not in head.branches and name not in head.tags):
            raise Refused("not there")
        elsewhere = {row for ref, rows in self.refs().items() if ref != name for row in rows}
        if not discard and not self.rows(name).keys() <= elsewhere:
            raise Refused("it alone shows something")
        tags = {tag: shown for tag, shown in head.tags.items() if tag != name}
        branches = {branch: line for branch, line in head.branches.items() if branch != name}
        deleted = {
            **head.deleted,
            **({name: frozenset(self.rows(name))} if name in head.tags else {}),
        }
        return Outcome(
            state=replace(head, tags=tags, branches=branches, deleted=deleted), stored=self.stored
        )

    def mergeable(self) -> list[tuple[str, str]]:
        """The pairs of branches that each have commits which the other does not know."""
        tips = {branch: self.head.tip(branch) for branch in sorted(self.head.branches)}
        known = {branch: self.graph.ancestors(tip) for branch, tip in tips.items()}
        pairs = itertools.permutations(tips, 2)
        return [
            (one, other)
            for one, other in pairs
            if tips[one] not in known[other] and tips[other] not in known[one]
        ]

    def merge(self, into: str, branch: str) -> Outcome:
        """Three ways, for rows and for the labels of each.

        Raises:
            Refused: both changed a label, a row would lack a parent, or the labels would be no
                columns.
            Unclear: which commit they had in common last is no law.
        """
        if not {into, branch} <= self.head.branches.keys() or into == branch:
            raise Refused("no such branch")
        ours, theirs = self.head.tip(into), self.head.tip(branch)
        if theirs in self.graph.ancestors(ours):
            return Outcome(state=None, stored=self.stored)
        base = self.graph.base(ours, theirs)
        here, there, before = (self.graph.rows(commit) for commit in (ours, theirs, base))
        new = {
            name
            for name in there.keys() - before.keys() - here.keys()
            if not self._stays_withdrawn(name, into, branch, base)
        }
        rows = {name: here[name] for name in here if name not in before.keys() - there.keys()}
        rows |= {name: there[name] for name in new}
        for name in rows.keys() & here.keys() & there.keys():
            rows[name] = _merged(before.get(name, {}), here[name], there[name])
        check_columns(rows)
        if not data_of(new) <= self.stored:
            raise Refused("the data of a new row are gone")
        return self._committed(into, rows, theirs)

    def _stays_withdrawn(self, name: str, into: str, branch: str, base: int) -> bool:
        """Whether the last commit since the base that took a row off `into` is later than the
        branch's own row."""
        line = self.head.branches[into]
        taken = [
            after
            for before, after in itertools.pairwise(line)
            if after > base
            and name in self.graph.rows(before).keys() - self.graph.rows(after).keys()
        ]
        if not taken:
            return False
        there = self.head.branches[branch]
        then = [commit for commit in there[1:] if commit <= taken[-1]]
        return name in self.graph.rows(then[-1] if then else there[0])

    def collect(self) -> Outcome:
        return Outcome(state=None, stored=self.stored & self.needed())

    def has_old_data(self) -> bool:
        """Whether any data go when all versions but the newest expire."""
        return self.expire(len(self.versions) - 2).stored != self.stored

    def expire(self, up_to: int) -> Outcome:
        """The data go that only versions up to one show, and no branch or tag."""
        kept = set(self.needed())
        for version in range(up_to + 1, len(self.versions)):
            state = self.versions[version]
            for branch in state.branches:
                rows = self.graph.rows(state.tip(branch))
                kept |= data_of(self.unerased(rows, Shown(commit=0, version=version)))
        committed = {
            name
            for state in self.versions
            for branch in state.branches
            for name in self.graph.rows(state.tip(branch))
        }
        going = self.stored & (data_of(committed) - kept)
        expired = {**self.head.expired, **dict.fromkeys(going, len(self.versions))}
        return Outcome(state=replace(self.head, expired=expired), stored=self.stored - going)

    def transfer(self, source: LakeModel) -> LakeModel:
        """This lake, brought to the newest version of another one.

        Raises:
            Refused: it has versions that the source lacks.
        """
        if (
            len(source.versions) < len(self.versions)
            or source.versions[len(self.versions) - 1] is not self.head
        ):
            raise Refused("it has versions that the source lacks")
        after = source.copied(len(source.versions) - 1)
        after.stored = self.stored | source.needed()
        return after


def _merged(before: Labels, here: Labels, there: Labels) -> Labels:
    """The labels of a row that both show.

    Raises:
        Refused: both changed one, to other values.
    """
    merged: dict[str, Value] = {}
    for name in {**before, **here, **there}:
        was, ours, theirs = before.get(name), here.get(name), there.get(name)
        if not same(ours, theirs) and not same(ours, was) and not same(theirs, was):
            raise Refused(f"both changed the label {name}")
        value = theirs if same(ours, was) else ours
        if value is not None:
            merged[name] = value
    return merged


def same(one: Value | None, other: Value | None) -> bool:
    """Whether two values are one: 1 is not true."""
    return type(one) is type(other) and one == other
