"""One command with one failing call: what it reported against what it did, and what it left."""

from __future__ import annotations

import shutil
import signal
from collections import Counter
from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from datetime import timedelta
from pathlib import Path
from typing import Any

from flagdata.core.findings import Finding, Severity
from flagdata.lake import Lake, doctor, object_names, read_refs, verify, verify_catalog
from flagdata.lake.lake_layout import STAGING, STORES
from tests.studies.failing.groups import PUBLISHING, kinds
from tests.studies.failing.injector import Done, Fault, Injector

_DELETING = tuple(f"fsync /lake/{folder} " for folder in (*STORES, STAGING))
"""Calls that force a deletion to the disk. A command that deletes puts nothing in these folders."""


@dataclass(frozen=True, kw_only=True)
class Command:
    """A command that writes.

    Attributes:
        arguments: {folder} stands for the folder that it works in, other names in braces for the
            scene's ids.
        state: what it changes in that folder; equal states have equal content.
        lake: the lake that must stay healthy, in that folder; it may be absent.
        stand_in: "module:function" that puts something in the place of its computing, called with
            the scene's id "kept" in the process that it is forked from.
        again: what goes on where it was killed and that lake is there; `None` is the same once
            more.
        one_step: whether it changes all or nothing; else what it has done before an error stays,
            and a repeat goes on.
        deletes: whether data go; where the disk does not flush a folder of them, it must end in an
            error.
        compares: whether it reads again all that it leaves: what the disk refuses then is an error
            though all is done, or a finding and exit code 3.
        unfinished: kinds of the findings by which doctor reports what it has not done yet; none
            where it begins nothing that it would have to finish.
    """

    arguments: tuple[str, ...]
    state: Callable[[Path], object]
    lake: str = "lake"
    again: tuple[str, ...] | None = None
    stand_in: str | None = None
    one_step: bool = True
    deletes: bool = False
    compares: bool = False
    unfinished: frozenset[str] = frozenset()

    def given(self, folder: Path, ids: Mapping[str, str]) -> list[str]:
        return [argument.format(folder=folder, **ids) for argument in self.arguments]

    def given_again(self, folder: Path, ids: Mapping[str, str]) -> list[str]:
        there = (folder / self.lake / "lake.json").exists()
        return replace(
            self, arguments=self.again if self.again and there else self.arguments
        ).given(folder, ids)


@dataclass(frozen=True, kw_only=True)
class Whole:
    """A command without a fault: the state before and after it, and its calls."""

    before: object
    after: object
    done: Done

    @property
    def published(self) -> int:
        """The number of the call that published last."""
        return max(
            (n for n, call in enumerate(self.done.trace) if call.startswith(PUBLISHING)), default=0
        )


class Trials:
    """Trials of one command, each in a copy of the scene's folder.

    Attributes:
        whole: the command without a fault.
        failed: how many calls of each kind (`groups.kinds`) have failed. Threads do not make their
            calls in the same order each time, so that a number may meet another call than in
            `whole`.

    Raises:
        AssertionError: the command fails or changes nothing without any fault.
    """

    def __init__(
        self,
        command: Command,
        scene: Path,
        ids: Mapping[str, str],
        injector: Injector,
        scratch: Path,
    ) -> None:
        self._command, self._scene, self._ids = command, scene, ids
        self._injector, self._scratch = injector, scratch
        self._count = 0
        self.failed: Counter[str] = Counter()
        if command.stand_in is not None:
            injector.prepare(command.stand_in, ids["kept"])
        folder = self._copy()
        before = command.state(folder)
        done = injector.run(folder, command.given(folder, ids), traced=True)
        self.whole = Whole(before=before, after=command.state(folder), done=done)
        assert done.code == 0, done.stderr
        assert self.whole.after != before, "it changed nothing"
        shutil.rmtree(folder)

    def wrong(self, fault: Fault, *, repeated: bool) -> dict[str, Any] | None:
        """What is wrong with a command that met this fault; None where all is right.

        Args:
            repeated: whether a command that failed is given once more, without the fault.
        """
        command, folder = self._command, self._copy()
        done = self._injector.run(folder, command.given(folder, self._ids), fault, traced=True)
        met = (
            kinds(done.trace)[fault.call]
            if fault.call < len(done.trace)
            else "none: there were fewer"
        )
        self.failed[met] += 1
        state = command.state(folder)
        problems = (
            self._lost(done, state) if fault.kills else self._report_against(done, state, met)
        )
        found = _health(folder / command.lake)
        problems += _unhealthy(found, right=command.unfinished if done.code else ())
        if command.unfinished and state not in (self.whole.before, self.whole.after):
            reported = command.unfinished & {finding.kind for finding in found}
            problems += [
                "silent: it has begun what it has not done, and doctor reports nothing"
            ] * (not reported)
        if done.code and (repeated or fault.kills):
            again = self._repeat(folder)
            if (again.code and state != self.whole.after) or command.state(
                folder
            ) != self.whole.after:
                problems.append(f"the repeat fails or ends otherwise: {again.stderr}")
            problems += [
                f"after the repeat: {problem}"
                for problem in _unhealthy(_health(folder / command.lake))
            ]
        shutil.rmtree(folder)
        if not problems:
            return None
        return {
            "call": fault.call,
            "of": self.whole.done.calls,
            "stays": fault.stays,
            "was": met,
            "code": done.code,
            "after_publication": fault.call > self.whole.published,
            "problems": problems,
            "stderr": done.stderr,
        }

    def _repeat(self, folder: Path) -> Done:
        """Give the command again; where it says that what is there has to go, do that and give it
        once more."""
        again = self._injector.run(folder, self._command.given_again(folder, self._ids))
        if again.code and "delete what is there" in " ".join(again.stderr.split()):
            shutil.rmtree(folder / self._command.lake)
            return self._injector.run(folder, self._command.given(folder, self._ids))
        return again

    def _report_against(self, done: Done, state: object, met: str) -> list[str]:
        problems: list[str] = []
        command, seen = self._command, state == self.whole.after
        if command.deletes and met.startswith(_DELETING):
            problems += ["a deletion that the disk may undo is acknowledged"] * (done.code == 0)
        elif (done.code == 0) != seen and not (command.compares and seen):
            what = "all is" if seen else "nothing is" if state == self.whole.before else "a part is"
            problems.append(f"exit code {done.code}, and {what} published")
        elif done.code and command.one_step and state != self.whole.before:
            problems.append("a part is published")
        if done.code not in ((0, 1, 3) if command.compares else (0, 1)):
            problems.append(f"exit code {done.code}")
        if done.code and "fix:" not in done.stderr + done.stdout:
            problems.append("no fix is named")
        return problems + [
            word for word in ("Traceback", "unforeseen", "interrupted") if word in done.stderr
        ]

    def _lost(self, done: Done, state: object) -> list[str]:
        """What is wrong with a command that was killed: what was there before must be there, if it
        does not go."""
        problems = [] if done.code == -signal.SIGKILL else [f"exit code {done.code}, not killed"]
        if self._command.one_step and state not in (self.whole.before, self.whole.after):
            problems.append("a part is published")
        before, after = self.whole.before, self.whole.after
        if (
            isinstance(state, frozenset)
            and isinstance(before, frozenset)
            and isinstance(after, frozenset)
        ):
            problems += ["something is lost"] * (not before & after <= state)
        return problems

    def _copy(self) -> Path:
        self._count += 1
        folder = self._scratch / str(self._count)
        shutil.copytree(self._scene, folder, symlinks=True)
        return folder


def _health(path: Path) -> tuple[Finding, ...]:
    """What doctor and verify find in a lake, if there is one."""
    if not (path / "lake.json").exists():
        return ()
    lake = Lake.open(path)
    refs = read_refs(lake)
    return (
        *doctor(lake, grace=timedelta(0)),
        *verify_catalog(lake, refs),
        *verify(lake, object_names(lake, refs)),
    )


def _unhealthy(found: Iterable[Finding], *, right: Collection[str] = ()) -> list[str]:
    """The errors among findings, but those of kinds that are right before the command is given once
    more."""
    return [
        f"unhealthy: {finding.kind}: {finding.what}"
        for finding in found
        if finding.severity is Severity.ERROR and finding.kind not in right
    ]
