"""Any sequence of operations shows what a plain model of commits shows: sets of texts with parents, merged as git does.

Tags and commits never change; nothing dangles; what gc deletes no ref shows.
"""

from __future__ import annotations

import itertools
import tempfile
from dataclasses import dataclass
from datetime import timedelta
from pathlib import Path

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from flagdata.lake import Artifact, Lake, collect, difference, doctor, is_healthy
from flagdata.schema import Kind

TEXTS = st.sampled_from([f"text {i}" for i in range(6)])
PICK = st.integers(0, 11)
NAMES = ("one", "two", "three")


def artifact(text: str, name: str | None = None) -> Artifact:
    return Artifact(kind=Kind.WIND, name=text, object=name, recipe={"text": text})


@dataclass(frozen=True)
class Commit:
    texts: frozenset[str]
    parents: tuple[int, ...]


class LakeModel(RuleBasedStateMachine):
    """`commits` as git has them; `lines` of each branch the commits it pointed to, its first the one it began from."""

    @initialize()
    def begin(self) -> None:
        self.folder = tempfile.TemporaryDirectory()
        self.lake = Lake.create(Path(self.folder.name) / "lake")
        self.commits = [Commit(frozenset(), ())]
        self.lines: dict[str, list[int]] = {"main": [0]}
        self.tags: dict[str, int] = {}
        self.named = 0
        self.known: list[tuple[str, int]] = []

    def teardown(self) -> None:
        self.folder.cleanup()

    def branch_of(self, pick: int) -> str:
        return sorted(self.lines)[pick % len(self.lines)]

    def texts(self, branch: str) -> frozenset[str]:
        return self.commits[self.lines[branch][-1]].texts

    def commit(self, branch: str, texts: frozenset[str], *others: int) -> None:
        self.commits.append(Commit(texts, (self.lines[branch][-1], *others)))
        self.lines[branch].append(len(self.commits) - 1)

    def ancestors(self, commit: int) -> set[int]:
        found, left = set(), [commit]
        while left:
            found.add(left[-1])
            left += self.commits[left.pop()].parents
        return found

    @rule(pick=PICK, text=TEXTS)
    def ingest(self, pick: int, text: str) -> None:
        branch = self.branch_of(pick)
        with self.lake.transaction("ingest", branch=branch) as tx:
            path = tx.staging(".mcap")
            path.write_text(text)
            added = tx.add(artifact(text, tx.put(path)))
        assert added == (text not in self.texts(branch))
        assert tx.result is not None
        assert len(tx.result.added) == added
        if tx.result.commit is not None:
            self.commit(branch, self.texts(branch) | {text})
            self.known.append((tx.result.commit, len(self.commits) - 1))

    @rule(text=TEXTS)
    def abandon(self, text: str) -> None:
        try:
            with self.lake.transaction("abandon") as tx:
                path = tx.staging(".mcap")
                path.write_text(text)
                tx.add(artifact(text, tx.put(path)))
                raise KeyboardInterrupt
        except KeyboardInterrupt:
            pass

    @rule(pick=PICK, which=PICK)
    def withdraw(self, pick: int, which: int) -> None:
        branch = self.branch_of(pick)
        texts = sorted(self.texts(branch))
        if texts:
            text = texts[which % len(texts)]
            self.lake.withdraw([artifact(text).id], "withdraw", branch=branch)
            self.commit(branch, self.texts(branch) - {text})

    @rule(pick=PICK)
    def tag(self, pick: int) -> None:
        branch = self.branch_of(pick)
        self.named += 1
        name = f"tag-{self.named}"
        self.lake.tag(name, at=branch)
        self.tags[name] = self.lines[branch][-1]

    @precondition(lambda self: len(self.lines) < 4)
    @rule(pick=PICK)
    def branch(self, pick: int) -> None:
        name = next(name for name in NAMES if name not in self.lines)  # a deleted one's, too
        sources = {**{b: line[-1] for b, line in self.lines.items()}, **self.tags}
        source = sorted(sources)[pick % len(sources)]
        self.lake.branch(name, at=source)
        self.lines[name] = [sources[source]]

    @precondition(lambda self: len(self.lines) > 1)
    @rule(pick=PICK)
    def delete_branch(self, pick: int) -> None:
        branches = sorted(self.lines.keys() - {"main"})
        name = branches[pick % len(branches)]
        self.lake.delete_branch(name, discard=True)
        del self.lines[name]

    @precondition(lambda self: self.tags)
    @rule(pick=PICK)
    def delete_tag(self, pick: int) -> None:
        name = sorted(self.tags)[pick % len(self.tags)]
        self.lake.delete_tag(name, discard=True)
        del self.tags[name]

    @precondition(lambda self: len(self.lines) > 1)
    @rule(one=PICK, other=PICK)
    def merge(self, one: int, other: int) -> None:
        into = self.branch_of(one)
        branches = sorted(self.lines.keys() - {into})
        branch = branches[other % len(branches)]
        ours, theirs = self.lines[into][-1], self.lines[branch][-1]
        common = self.ancestors(ours) & self.ancestors(theirs)
        bases = common - {older for newer in common for older in self.ancestors(newer) - {newer}}
        if len(bases) > 1:  # git would merge the bases first; which one is taken is not a law
            return
        (base,) = bases
        here, there, before = (self.commits[commit].texts for commit in (ours, theirs, base))
        stays = {text for text in there - before - here if self.stays_withdrawn(text, into, branch, base)}
        done = self.lake.merge(branch, "merge", into=into)
        if theirs in self.ancestors(ours):
            assert (done.commit, done.added, done.withdrawn) == (None, (), ())
            return
        added, withdrawn = there - before - here - stays, (before - there) & here
        assert set(done.added) == {artifact(text).id for text in added}
        assert set(done.withdrawn) == {artifact(text).id for text in withdrawn}
        assert done.left_out.keys() == {artifact(text).id for text in stays}
        assert done.commit is not None
        self.commit(into, (here - withdrawn) | added, theirs)
        self.known.append((done.commit, len(self.commits) - 1))

    def stays_withdrawn(self, text: str, into: str, branch: str, base: int) -> bool:
        """Whether the last commit since the base that took a text off `into` is later than the branch's own."""
        line = self.lines[into]
        taken = [
            after
            for before, after in itertools.pairwise(line)
            if after > base and text in self.commits[before].texts - self.commits[after].texts
        ]
        if not taken:
            return False
        then = [commit for commit in self.lines[branch][1:] if commit <= taken[-1]]
        return text in self.commits[then[-1] if then else self.lines[branch][0]].texts

    @rule()
    def collect(self) -> None:
        collect(self.lake, grace=timedelta(0))
        assert {finding.kind for finding in doctor(self.lake, grace=timedelta(0))} <= {"withdrawn-collected"}

    @precondition(lambda self: self.known)
    @rule(pick=PICK)
    def look_back(self, pick: int) -> None:
        commit, number = self.known[pick % len(self.known)]
        assert set(self.lake.rows(at=commit)["name"].to_pylist()) == self.commits[number].texts

    @rule(one=PICK, other=PICK)
    def compare(self, one: int, other: int) -> None:
        before, after = self.branch_of(one), self.branch_of(other)
        found = difference(self.lake, before, after)
        assert set(found.added["name"].to_pylist()) == self.texts(after) - self.texts(before)
        assert set(found.removed["name"].to_pylist()) == self.texts(before) - self.texts(after)

    @invariant()
    def every_ref_shows_what_it_should(self) -> None:
        shown = {**{b: self.texts(b) for b in self.lines}, **{t: self.commits[c].texts for t, c in self.tags.items()}}
        for ref, texts in shown.items():
            assert sorted(self.lake.rows(at=ref)["name"].to_pylist()) == sorted(texts)
        assert self.lake.refs.branches().keys() == self.lines.keys() - {"main"}
        assert self.lake.refs.tags().keys() == self.tags.keys()

    @invariant()
    def nothing_dangles(self) -> None:
        findings = doctor(self.lake, grace=timedelta(0))
        assert is_healthy([finding for finding in findings if finding.kind != "orphan"])


TestLakeModel = LakeModel.TestCase
TestLakeModel.settings = settings(
    max_examples=12, stateful_step_count=20, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck)
)
