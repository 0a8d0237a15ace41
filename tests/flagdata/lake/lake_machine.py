"""Any operations on two lakes, each of which may be killed before any of its steps, show what a
plain model shows.

Every acknowledged view stays readable and whole, every acknowledged erasure stays, and nothing is
left half done that `doctor` does not report and the same command, or `gc`, does not finish.
"""

from __future__ import annotations

import itertools
import re
import shutil
import tempfile
import uuid
import warnings
from collections import Counter
from collections.abc import Callable, Collection, Sequence
from contextlib import suppress
from datetime import timedelta
from pathlib import Path
from typing import Any, ClassVar

import pytest
from hypothesis import HealthCheck, Phase, seed, settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    precondition,
    rule,
    run_state_machine_as_test,
)

from flagdata.core.findings import Severity
from flagdata.core.schema import Kind
from flagdata.errors import FlagdataError
from flagdata.lake import (
    Artifact,
    Lake,
    Objects,
    catalog,
    clone,
    collect,
    difference,
    doctor,
    expire,
    heal,
    is_healthy,
    labels_of,
    object_names,
    transfer,
    verify,
    verify_catalog,
)
from flagdata.storage import Place
from tests.flagdata.lake.conftest import overwrite
from tests.flagdata.lake.crashes import Killed, dying
from tests.flagdata.lake.lake_model import (
    ITEMS,
    MAIN,
    Graph,
    LakeModel,
    Outcome,
    Refused,
    Rows,
    State,
    Unclear,
    data_of,
    same,
)
from tests.flagdata.lake.test_transfer import no_bar

HERE, THERE = "here", "there"
BRANCHES = ("one", "two")
TAGS = ("v1", "v2", "one")
TIDY_EVERY = 6
"""Versions after which the catalog is tidied, so that short histories are, too."""
NOW = timedelta(0)
PICK = st.integers(0, 11)
SOME = st.lists(st.sampled_from(sorted(ITEMS)), min_size=1, max_size=2, unique=True)
LAKE = st.runner().flatmap(lambda machine: st.sampled_from(machine.written))
KILL = st.one_of(st.none(), st.integers(0, 14), st.integers(0, 24))
"""The step before which the process is killed, if it takes so many."""
NAMES = ("note", "Note")
_TIDYING = re.compile(r"merge \d+ files of the catalog")

Predict = Callable[[LakeModel], Outcome]


def stage(item: str, folder: Path) -> Path | None:
    """Write the object of an item."""
    of = ITEMS[item]
    if of.data is None:
        return None
    path = folder / f"{uuid.uuid4().hex}{'.zarr' if of.is_folder else '.mcap'}"
    if of.is_folder:
        path.mkdir()
        for part in "ab":
            (path / part).write_text(f"{of.data} {part}")
    else:
        path.write_text(of.data)
    return path


class Items:
    """The artifacts of the items, and the names of their objects, which are the same in every
    lake."""

    def __init__(self, lake: Lake) -> None:
        self.artifacts: dict[str, Artifact] = {}
        self.objects: dict[str, str] = {}  # name → the data
        with tempfile.TemporaryDirectory() as folder:
            for name, of in ITEMS.items():
                path = stage(name, Path(folder))
                stored = None if path is None else lake.objects.name_of(path)
                if stored is not None and of.data is not None:
                    self.objects[stored] = of.data
                kind = Kind.CLIP if of.is_slice else Kind.MESHES if of.is_folder else Kind.WIND
                parents = tuple(self.artifacts[parent].id for parent in of.parents)
                self.artifacts[name] = Artifact(
                    kind=kind, name=name, object=stored, recipe={"of": name}, parents=parents
                )

    def ids(self, names: Sequence[str]) -> list[str]:
        return [self.artifacts[name].id for name in names]

    def ingest(
        self, lake: Lake, branch: str, names: Sequence[str], *, gives_up: bool = False
    ) -> None:
        """Commit some items, in this order, or give up before that."""
        with suppress(KeyboardInterrupt), lake.transaction("ingest", branch=branch) as transaction:
            for name in names:
                path = stage(name, transaction.staging("").parent)
                if path is not None:
                    transaction.put(path)
                transaction.add(self.artifacts[name])
            if gives_up:
                raise KeyboardInterrupt


class LakeMachine(RuleBasedStateMachine):
    """Two lakes of one history."""

    written: ClassVar[Sequence[str]] = (HERE, HERE, HERE, THERE)
    """The lakes that are written to."""
    in_bucket: ClassVar[str | None] = None
    """The address of a folder in a bucket, for lakes in it."""
    tally: ClassVar[Counter[str]] = Counter()
    """How often each operation was done, refused and killed: what the machine has tried."""

    @initialize()
    def begin(self) -> None:
        self.is_sound = False
        self.patches = pytest.MonkeyPatch()
        self.patches.setattr(catalog, "_TIDY_EVERY", TIDY_EVERY)
        self.folder = Path(tempfile.mkdtemp())
        self.places = {HERE: self.place()}
        self.lakes = {HERE: Lake.create(self.places[HERE])}
        self.items = Items(self.lakes[HERE])
        graph = Graph()
        self.models = {HERE: LakeModel(graph)}
        self.has_leftovers = {HERE: False}
        self.ingest(HERE, 0, ["clip", "other"], False, None)
        self.branch(HERE, 0, 0, 2, None)
        self.ingest(HERE, 1, ["twin"], False, None)
        self.clone()

    def place(self) -> Place | str:
        return (
            self.folder / uuid.uuid4().hex
            if self.in_bucket is None
            else f"{self.in_bucket}/{uuid.uuid4().hex}"
        )

    def teardown(self) -> None:
        try:
            if self.is_sound:
                for which in self.lakes:
                    self.check_all(which)
        finally:
            self.patches.undo()
            shutil.rmtree(self.folder, ignore_errors=True)

    # What is done, and what it must do

    def perform(
        self,
        name: str,
        which: str,
        run: Callable[[Lake], object],
        predict: Predict,
        kill: int | None = None,
    ) -> None:
        """Do something on a lake, perhaps killed before a step of it, and compare what it did with
        the model."""
        self.is_sound = False
        before = self.models[which].copied(len(self.models[which].versions) - 1)
        try:
            predict(before)
        except Unclear:
            self.is_sound = True
            return
        except Refused:
            pass
        was_killed, refusal = self.run(which, run, kill)
        model = self.models[which]
        committed = self.enter(which)
        ends = {
            "was killed": was_killed,
            "was refused": refusal,
            "committed": committed,
            "changed nothing": True,
        }
        did = next(end for end, happened in ends.items() if happened)
        self.tally[f"{name} {did}{' after its commit' if was_killed and committed else ''}"] += 1
        try:
            outcome = predict(model)
        except Refused:
            assert was_killed or refusal is not None, "it was not refused"
            outcome = Outcome(state=None, stored=model.stored)
        else:
            assert refusal is None, f"it was refused: {refusal}"
        self.settle(which, outcome, committed, was_killed=was_killed)
        self.check(which)
        if was_killed or name in ("erase", "expire", "delete"):
            self.check_findings(which)
        if was_killed and kill is not None:
            self.go_on(name, which, run, predict, how=kill % 3)
        self.is_sound = True

    def run(
        self, which: str, run: Callable[[Lake], object], kill: int | None
    ) -> tuple[bool, FlagdataError | None]:
        """Returns whether it was killed, and the error that refused it."""
        refusal = None
        with dying(kill) as steps:
            try:
                run(self.lakes[which])
            except Killed:
                pass
            except FlagdataError as error:
                refusal = error
        if steps.dead:
            self.lakes[which] = Lake.open(self.places[which])
            self.has_leftovers[which] = True
            return True, None
        assert not steps.unflushed, f"not flushed after a deletion: {steps.unflushed}"
        return False, refusal

    def enter(self, which: str) -> list[dict[str, Any]]:
        """Enter new versions that tidied the catalog into the model, which change nothing; the
        other new entries."""
        lake, model = self.lakes[which], self.models[which]
        fresh = lake.catalog.history(lake.catalog.head() + 1 - len(model.versions))[::-1]
        fresh = fresh if lake.catalog.head() >= len(model.versions) else []
        tidying = [entry for entry in fresh if _TIDYING.match(entry.get("message", ""))]
        others = [entry for entry in fresh if entry not in tidying]
        for entry in tidying:
            assert all(entry["version"] < other["version"] for other in others), (
                "tidied after a commit"
            )
            model.versions.append(State(**vars(model.head)))
        return others

    def settle(
        self, which: str, outcome: Outcome, committed: Sequence[dict[str, Any]], *, was_killed: bool
    ) -> None:
        """Enter what was committed into the model, if it is what was predicted."""
        model = self.models[which]
        before = model.stored
        expected = 0 if outcome.state is None else 1
        assert len(committed) == expected or (was_killed and not committed), (
            f"{len(committed)} commits: {committed}"
        )
        for entry in committed:
            assert outcome.state is not None
            model.versions.append(State(**vars(outcome.state)))
            if "commit" in entry:
                model.commits[entry["commit"]] = model.shown(entry["branch"])
        there = self.stored(which)
        if not was_killed:
            assert there == outcome.stored
        elif committed or outcome.state is None:
            assert there >= before & outcome.stored
        else:
            assert there >= before
        model.stored = there

    def go_on(
        self, name: str, which: str, run: Callable[[Lake], object], predict: Predict, *, how: int
    ) -> None:
        """After a kill: give the command again, or run `gc`, or leave it."""
        if how == 0:
            self.perform(name, which, run, predict)
        elif how == 1:
            self.collect(which)

    # What is compared

    def stored(self, which: str) -> frozenset[str]:
        """The data that are in a lake."""
        return frozenset(self.items.objects[stored.name] for stored in self.lakes[which].objects)

    def check(self, which: str) -> None:
        """Compare what a lake shows with the model."""
        lake, model = self.lakes[which], self.models[which]
        assert lake.refs.branches().keys() == model.head.branches.keys() - {MAIN}
        assert lake.refs.tags().keys() == model.head.tags.keys()
        for ref, rows in model.refs().items():
            self.check_rows(lake, ref, rows)
        assert model.stored >= model.needed()

    def check_findings(self, which: str) -> None:
        """`doctor` reports what is unfinished, and nothing else but what a killed process left."""
        found = [
            finding
            for finding in doctor(self.lakes[which])
            if finding.severity is not Severity.NOTE
        ]
        assert all(finding.fix for finding in found)
        if self.models[which].unfinished():
            kinds = {finding.kind for finding in found}
            assert kinds & {"erasure-unfinished", "expiry-unfinished"}, (
                "something is unfinished, and nothing is said"
            )
        elif not self.has_leftovers[which]:
            assert found == []

    def check_rows(self, lake: Lake, at: str, rows: Rows) -> None:
        table = lake.rows(at=at)
        names = table["name"].to_pylist()
        assert sorted(names) == sorted(rows), at
        assert table["artifact"].to_pylist() == self.items.ids(names)
        labels = labels_of(table)
        for name, expected in rows.items():
            shown = labels.get(self.items.artifacts[name].id, {})
            assert shown.keys() == expected.keys(), (at, name)
            assert all(same(shown[key], value) for key, value in expected.items()), (
                at,
                name,
                shown,
            )

    def check_queries(self, lake: Lake, at: str, rows: Rows) -> None:
        """Labels are columns of SQL."""
        for label in sorted({label for labels in rows.values() for label in labels}):
            found = lake.rows(f"label_{label} is not null", at=at)["name"].to_pylist()
            assert sorted(found) == sorted(name for name, labels in rows.items() if label in labels)

    def check_all(self, which: str) -> None:
        """What a new process finds: all that was ever acknowledged, and every byte that is
        needed."""
        self.lakes[which] = lake = Lake.open(self.places[which])
        model = self.models[which]
        self.check(which)
        self.check_findings(which)
        for ref, rows in model.refs().items():
            self.check_queries(lake, ref, rows)
        for version in range(len(model.versions)):
            self.check_rows(lake, str(version), model.rows(str(version)))
        for commit in model.commits:
            self.check_rows(lake, commit, model.rows(commit))
        for name in lake.objects:
            assert lake.objects.is_whole(name.name)
        self.collect(which)
        assert (*verify(lake, object_names(lake)), *verify_catalog(lake)) == ()
        self.check_tidiness(lake)

    def check_tidiness(self, lake: Lake) -> None:
        """A new process opens few files, however many versions there are."""
        entries, checkpoints = lake.catalog.head(), lake.catalog._entries.checkpoints()
        assert entries - max(checkpoints, default=0) <= TIDY_EVERY + 1
        assert len(lake.catalog._names(entries)) <= TIDY_EVERY + 1

    # The operations

    def some_of(self, rows: Collection[str], items: Sequence[str]) -> list[str]:
        """Those of some items that a ref shows; one that it shows where there are none."""
        shown = [name for name in items if name in rows]
        return shown or sorted(rows)[len(items) % 2 :][:1]

    def refs(self, which: str) -> list[str]:
        model = self.models[which]
        return [*model.head.branches, *sorted(model.head.tags)]

    def branch_of(self, which: str, pick: int) -> str:
        branches = sorted(self.models[which].head.branches)
        return branches[pick % len(branches)]

    def name(self, which: str, names: Sequence[str], pick: int) -> str:
        """A name that is free, once in a while one that is taken."""
        free = [name for name in names if name not in self.refs(which)]
        some = free or names if pick else names
        return some[pick % len(some)]

    def at(self, which: str, pick: int, back: int) -> str:
        """A branch or tag, or a commit or version."""
        refs, commits = self.refs(which), [*self.models[which].commits]
        if back == 0 and commits:
            return commits[pick % len(commits)]
        if back == 1:
            return str(pick % len(self.models[which].versions))
        return refs[pick % len(refs)]

    @rule(
        which=LAKE, pick=PICK, items=SOME, gives_up=st.sampled_from([False] * 5 + [True]), kill=KILL
    )
    def ingest(
        self, which: str, pick: int, items: list[str], gives_up: bool, kill: int | None
    ) -> None:
        """Some items with what they are made from; or the data are put, and the user gives up."""
        branch = self.branch_of(which, pick)
        order = [
            name
            for name in ITEMS
            if name in {*items, *(p for item in items for p in ITEMS[item].parents)}
        ]

        def predict(model: LakeModel) -> Outcome:
            return (
                Outcome(state=None, stored=model.stored | data_of(order))
                if gives_up
                else model.ingest(branch, order)
            )

        self.perform(
            "ingest",
            which,
            lambda lake: self.items.ingest(lake, branch, order, gives_up=gives_up),
            predict,
            kill,
        )

    @rule(
        which=LAKE,
        pick=PICK,
        items=SOME,
        name=st.sampled_from(NAMES),
        value=st.sampled_from([1, 1, 2, "red", "red", True, None]),
        kill=KILL,
    )
    def label(
        self, which: str, pick: int, items: list[str], name: str, value: Any, kill: int | None
    ) -> None:
        branch = self.branch_of(which, pick)
        items = self.some_of(self.models[which].rows(branch), items)
        if not items:
            return
        self.perform(
            "label",
            which,
            lambda lake: lake.label(self.items.ids(items), {name: value}, "label", branch=branch),
            lambda model: model.label(branch, items, {name: value}),
            kill,
        )

    @rule(which=LAKE, pick=PICK, items=SOME, with_descendants=st.booleans(), kill=KILL)
    def withdraw(
        self, which: str, pick: int, items: list[str], with_descendants: bool, kill: int | None
    ) -> None:
        branch = self.branch_of(which, pick)
        items = self.some_of(self.models[which].rows(branch), items)
        if not items:
            return

        def run(lake: Lake) -> None:
            ids = self.items.ids(items)
            more = lake.descendants(ids, at=branch) if with_descendants else ()
            lake.withdraw([*ids, *more], "withdraw", branch=branch)

        self.perform(
            "withdraw",
            which,
            run,
            lambda model: model.withdraw(branch, items, with_descendants=with_descendants),
            kill,
        )

    @precondition(
        lambda self: all(any(self.models[which].refs().values()) for which in self.written)
    )
    @rule(which=LAKE, items=SOME, with_descendants=st.booleans(), kill=KILL)
    def erase(self, which: str, items: list[str], with_descendants: bool, kill: int | None) -> None:
        items = self.some_of(
            {name for rows in self.models[which].refs().values() for name in rows}, items
        )
        self.perform(
            "erase",
            which,
            lambda lake: lake.erase(
                self.items.ids(items), "erase", with_descendants=with_descendants
            ),
            lambda model: model.erase(items, with_descendants=with_descendants),
            kill,
        )

    @precondition(
        lambda self: any(self.models[which].head.tags.keys() < {*TAGS} for which in self.written)
    )
    @rule(which=LAKE, new=PICK, pick=PICK, back=st.integers(0, 4), kill=KILL)
    def tag(self, which: str, new: int, pick: int, back: int, kill: int | None) -> None:
        name = self.name(which, TAGS, new)
        at = self.at(which, pick, back)
        self.perform(
            "tag",
            which,
            lambda lake: lake.tag(name, at=at),
            lambda model: model.tag(name, at),
            kill,
        )

    @precondition(
        lambda self: any(
            self.models[which].head.branches.keys() < {MAIN, *BRANCHES} for which in self.written
        )
    )
    @rule(which=LAKE, new=PICK, pick=PICK, back=st.integers(0, 4), kill=KILL)
    def branch(self, which: str, new: int, pick: int, back: int, kill: int | None) -> None:
        name = self.name(which, BRANCHES, new)
        at = self.at(which, pick, back)
        self.perform(
            "branch",
            which,
            lambda lake: lake.branch(name, at=at),
            lambda model: model.branch(name, at),
            kill,
        )

    @precondition(lambda self: any(len(self.refs(which)) > 1 for which in self.written))
    @rule(which=LAKE, pick=PICK, discard=st.booleans(), kill=KILL)
    def delete(self, which: str, pick: int, discard: bool, kill: int | None) -> None:
        refs = [ref for ref in self.refs(which) if ref != MAIN] or ["one"]
        name = refs[pick % len(refs)]
        is_tag = name in self.models[which].head.tags
        self.perform(
            "delete",
            which,
            lambda lake: (lake.delete_tag if is_tag else lake.delete_branch)(name, discard=discard),
            lambda model: model.delete(name, discard=discard),
            kill,
        )

    @precondition(lambda self: any(self.models[which].mergeable() for which in self.written))
    @rule(which=LAKE, pick=PICK, kill=KILL)
    def merge(self, which: str, pick: int, kill: int | None) -> None:
        """Mostly branches that both went on."""
        pairs = self.models[which].mergeable()
        if not pairs or pick == 0:
            pairs = [*itertools.permutations(sorted({*self.models[which].head.branches, "one"}), 2)]
        into, branch = pairs[pick % len(pairs)]
        self.perform(
            "merge",
            which,
            lambda lake: lake.merge(branch, "merge", into=into),
            lambda model: model.merge(into, branch),
            kill,
        )

    @precondition(lambda self: any(self.models[which].has_old_data() for which in self.written))
    @rule(which=LAKE, back=st.integers(1, 6), kill=KILL)
    def expire(self, which: str, back: int, kill: int | None) -> None:
        up_to = len(self.models[which].versions) - 1 - back
        if up_to < 0:
            return
        self.perform(
            "expire",
            which,
            lambda lake: expire(lake, up_to),
            lambda model: model.expire(up_to),
            kill,
        )

    @precondition(lambda self: any(self.has_garbage(which) for which in self.written))
    @rule(which=LAKE, kill=KILL)
    def gc(self, which: str, kill: int | None) -> None:
        self.perform(
            "gc", which, lambda lake: collect(lake, grace=NOW), lambda model: model.collect(), kill
        )
        if kill is None:
            self.collect(which)

    def has_garbage(self, which: str) -> bool:
        return self.has_leftovers[which] or self.models[which].stored > self.models[which].needed()

    def collect(self, which: str) -> None:
        """`gc` leaves nothing that is not needed, and nothing to act on."""
        self.perform(
            "collect", which, lambda lake: collect(lake, grace=NOW), lambda model: model.collect()
        )
        self.has_leftovers[which] = False
        assert is_healthy(doctor(self.lakes[which], grace=NOW))
        assert self.models[which].unfinished() == frozenset()

    @precondition(lambda self: self.models[HERE].head is not self.models[THERE].head)
    @rule(to=st.sampled_from([HERE, THERE]), kill=KILL)
    def transfer(self, to: str, kill: int | None) -> None:
        """Push and pull."""
        self.is_sound = False
        source, model = self.models[HERE if to == THERE else THERE], self.models[to]
        try:
            after = model.transfer(source)
        except Refused:
            after = None

        def run(lake: Lake) -> object:
            return transfer(self.lakes[HERE if to == THERE else THERE], lake, bars=no_bar)

        was_killed, refusal = self.run(to, run, kill)
        self.tally[
            f"transfer {'was killed' if was_killed else 'was refused' if refusal else 'committed'}"
        ] += 1
        assert was_killed or (refusal is not None) == (after is None), refusal
        head = self.lakes[to].catalog.head()
        if after is not None:
            assert head == len(after.versions) - 1 or was_killed
            self.models[to] = after.copied(head)
        there = self.stored(to)
        assert there >= model.stored
        assert there == (model if after is None else after).stored or was_killed
        self.models[to].stored = there
        self.check(to)
        self.check_findings(to)
        if was_killed and kill is not None and kill % 2:
            self.transfer(to, None)
        self.is_sound = True

    @precondition(lambda self: self.models[HERE].head is not self.models[THERE].head)
    @rule()
    def clone(self) -> None:
        """The other lake is given up for a new clone of this one."""
        self.is_sound = False
        source = self.models[HERE]
        self.places[THERE] = self.place()
        self.lakes[THERE], _ = clone(self.lakes[HERE], self.places[THERE], bars=no_bar)
        self.models[THERE] = source.copied(len(source.versions) - 1)
        self.models[THERE].stored = source.needed()
        self.has_leftovers[THERE] = False
        self.check(THERE)
        self.is_sound = True

    @precondition(lambda self: any(len(self.refs(which)) > 1 for which in self.written))
    @rule(which=LAKE, kind=st.sampled_from(["tags", "branches"]), every=st.booleans(), pick=PICK)
    def lose_refs(self, which: str, kind: str, every: bool, pick: int) -> None:
        """The files of refs are lost, which only repeat what the log says."""
        files = sorted((self.lakes[which].refs.root / kind).glob("*.json"))
        for path in files if every else files[pick % len(files) :][:1] if files else ():
            path.unlink()
            self.has_leftovers[which] = True
        self.lakes[which] = Lake.open(self.places[which])
        self.check(which)

    def common(self) -> int:
        """How many versions both lakes have."""
        pairs = zip(self.models[HERE].versions, self.models[THERE].versions, strict=False)
        return sum(one is other for one, other in pairs)

    def replaceable(self, kind: str) -> list[Place]:
        """What is needed here that the other lake has, too: files of the catalog, or objects."""
        lake, other = self.lakes[HERE], self.lakes[THERE]
        if kind == "objects":
            needed = self.models[HERE].needed() & self.models[THERE].stored
            names = sorted(name for name, data in self.items.objects.items() if data in needed)
            return [lake.objects.path(name) for name in names]
        if kind == "entries":
            return [
                lake.catalog.path / "_delta_log" / f"{version:020d}.json"
                for version in range(self.common())
            ]
        files = (other.catalog.entry(version)[1] for version in range(self.common()))
        return [lake.catalog.path / name for names in files for name in names]

    @rule(
        kind=st.sampled_from(["objects", "entries", "rows"]),
        is_lost=st.booleans(),
        pick=PICK,
        kill=KILL,
    )
    def heal(self, kind: str, is_lost: bool, pick: int, kill: int | None) -> None:
        """Something is lost here, or changes, that the other lake has, older or newer: it is taken
        from there."""
        paths = self.replaceable(kind)
        if not paths:
            return
        self.is_sound = False
        path = paths[pick % len(paths)]
        if is_lost or path.suffix == ".zarr":
            Objects.remove(path)
        else:
            overwrite(path, b"changed")
        self.lakes[HERE] = Lake.found(self.places[HERE])
        was_killed, refusal = self.run(
            HERE, lambda lake: heal(lake, self.lakes[THERE], bars=no_bar), kill
        )
        assert refusal is None, refusal
        if was_killed:
            heal(Lake.found(self.places[HERE]), self.lakes[THERE], bars=no_bar)
        self.tally[f"heal {kind} {'again after a kill' if was_killed else 'done'}"] += 1
        self.lakes[HERE] = Lake.open(self.places[HERE])
        assert self.stored(HERE) == self.models[HERE].stored
        self.check(HERE)
        self.check_findings(HERE)
        self.is_sound = True

    @rule(which=LAKE, pick=PICK, back=st.integers(0, 2))
    def look_back(self, which: str, pick: int, back: int) -> None:
        lake, model, before, after = (
            self.lakes[which],
            self.models[which],
            self.at(which, pick, back),
            MAIN,
        )
        self.check_rows(lake, before, model.rows(before))
        old, new = model.rows(before).keys(), model.rows(after).keys()
        found = difference(lake, before, after)
        assert set(found.added["name"].to_pylist()) == new - old
        assert set(found.removed["name"].to_pylist()) == old - new


RULES = frozenset(
    {
        "ingest",
        "label",
        "withdraw",
        "erase",
        "tag",
        "branch",
        "delete",
        "merge",
        "expire",
        "gc",
        "transfer",
        "clone",
    }
    | {"lose_refs", "heal", "look_back"}
)
"""Names of the operations."""


def machine_of(among: Collection[str], *, in_bucket: str | None = None) -> type[LakeMachine]:
    """The machine with some of its operations, all on one lake where these are not all: so
    sequences go deeper."""

    def undrawn(name: str) -> Callable[..., None]:
        return lambda self, *arguments: getattr(LakeMachine, name)(self, *arguments)

    others: dict[str, Any] = {name: undrawn(name) for name in RULES - frozenset(among)}
    written = (HERE,) if others else LakeMachine.written
    return type(
        "MachineOfSome", (LakeMachine,), {**others, "in_bucket": in_bucket, "written": written}
    )


def try_machine(
    machine: type[LakeMachine], *, examples: int, steps: int, number: int, shrinking: bool = False
) -> None:
    """Run a machine on drawn operations.

    Args:
        examples: sequences of operations.
        steps: operations of each at most.
        number: seed of what is drawn.
        shrinking: whether a sequence that finds something is made shorter, which takes long.

    Raises:
        AssertionError, FlagdataError: as it finds something.
    """
    drawn = settings(
        max_examples=examples,
        stateful_step_count=steps,
        deadline=None,
        database=None,
        phases=[Phase.generate, *([Phase.shrink] if shrinking else [])],
        report_multiple_bugs=False,
        suppress_health_check=[
            HealthCheck.too_slow,
            HealthCheck.data_too_large,
            HealthCheck.filter_too_much,
        ],
    )
    with warnings.catch_warnings():
        warnings.filterwarnings(
            "ignore", "unclosed file", ResourceWarning
        )  # a process that dies closes none
        run_state_machine_as_test(seed(number)(machine), settings=drawn)
