"""Any sequence of operations shows what a plain model of dictionaries shows; tags never change; nothing dangles."""

from __future__ import annotations

import tempfile
from datetime import timedelta
from pathlib import Path

from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import Bundle, RuleBasedStateMachine, consumes, initialize, invariant, rule

from flagdata.findings import Severity
from flagdata.lake import Artifact, Lake
from flagdata.lake.collect import collect
from flagdata.lake.difference import difference
from flagdata.lake.health import doctor
from flagdata.schema import Kind

TEXTS = st.sampled_from([f"text {i}" for i in range(6)])


def artifact(text: str, name: str | None = None) -> Artifact:
    return Artifact(kind=Kind.WIND, name=text, object=name, recipe={"text": text})


class LakeModel(RuleBasedStateMachine):
    """`views` is what each branch and tag should show; `own` what was committed on each branch itself."""

    branches = Bundle("branches")
    refs = Bundle("refs")

    @initialize(target=branches)
    def begin(self) -> str:
        self.folder = tempfile.TemporaryDirectory()
        self.lake = Lake.create(Path(self.folder.name) / "lake")
        self.views: dict[str, set[str]] = {"main": set()}
        self.own: dict[str, set[str]] = {"main": set()}
        return "main"

    def teardown(self) -> None:
        self.folder.cleanup()

    @rule(branch=branches, text=TEXTS)
    def ingest(self, branch: str, text: str) -> None:
        with self.lake.transaction("ingest", branch=branch) as tx:
            path = tx.staging(".mcap")
            path.write_text(text)
            added = tx.add(artifact(text, tx.put(path)))
        assert added == (text not in self.views[branch])
        assert tx.result is not None
        assert len(tx.result.added) == added
        if added:
            self.views[branch].add(text)
            self.own[branch].add(text)

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

    @rule(branch=branches, text=TEXTS)
    def withdraw(self, branch: str, text: str) -> None:
        if text in self.own[branch]:
            self.lake.withdraw([artifact(text).id], "withdraw", branch=branch)
            self.own[branch].remove(text)
            self.views[branch].remove(text)

    @rule(target=refs, source=branches)
    def tag(self, source: str) -> str:
        name = f"tag-{len(self.views)}"
        self.lake.tag(name, at=source)
        self.views[name] = set(self.views[source])
        return name

    @rule(target=branches, source=st.one_of(branches, consumes(refs)))
    def branch(self, source: str) -> str:
        name = f"branch-{len(self.views)}"
        self.lake.branch(name, at=source)
        self.views[name] = set(self.views[source])
        self.own[name] = set()
        return name

    @rule()
    def collect(self) -> None:
        collect(self.lake, grace=timedelta(0))
        assert doctor(self.lake, grace=timedelta(0)) == ()

    @rule(one=branches, other=branches)
    def compare(self, one: str, other: str) -> None:
        found = difference(self.lake, one, other)
        assert set(found.added["name"].to_pylist()) == self.views[other] - self.views[one]
        assert set(found.removed["name"].to_pylist()) == self.views[one] - self.views[other]

    @invariant()
    def every_ref_shows_what_it_should(self) -> None:
        for ref, texts in getattr(self, "views", {}).items():
            names = self.lake.rows(at=ref)["name"].to_pylist()
            assert sorted(names) == sorted(texts)

    @invariant()
    def nothing_dangles(self) -> None:
        if hasattr(self, "lake"):
            findings = doctor(self.lake, grace=timedelta(0))
            assert [f for f in findings if f.severity is Severity.ERROR] == []


TestLakeModel = LakeModel.TestCase
TestLakeModel.settings = settings(
    max_examples=12, stateful_step_count=15, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck)
)
