"""Power cuts beside every verb that writes: `python -m tests.studies power-cut [VERB …] [--out
FILE]`.

Each verb runs once while its calls are recorded. From these follow the states in which a power cut
at any moment may leave the disk (`disk.py`); of the distinct ones some are drawn. Each is examined
in a folder of its own: what had been acknowledged before the verb began is there, and where the cut
came after its answer all that it answered; what is damaged is named with a remedy, which is typed
and heals; and the verb, given again, ends as if nothing had happened.

Results stay in FILE, a JSON file, verb after verb, so that a run may be stopped and given again;
beside it a page of the same name shows them.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import shutil
import tempfile
import time
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import timedelta
from functools import partial
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.core.findings import Finding, Severity
from flagdata.errors import FlagdataError
from flagdata.lake import Lake, collect, doctor, object_names, read_refs, verify, verify_catalog
from flagdata.lake.lake_layout import STORES
from tests.evidence import circumstances
from tests.program import Ended, invoke
from tests.studies.failing import disk
from tests.studies.failing.campaign import kept_scene
from tests.studies.failing.disk import Disk, Tree, read, write
from tests.studies.failing.forked import Child, stand_in
from tests.studies.failing.recorder import Recorder
from tests.studies.failing.scenes import Scene
from tests.studies.failing.verbs import OUTSIDE, SCENES, UNREADABLE, State, Verb, state

POINTS = 10
"""States of each verb that are examined."""
LONGEST = 600
"""Seconds after which an examination counts as hanging."""
MAKING = 3600
_ROUNDS = 4  # of looking at a lake and typing the remedies that are named
# calls of a verb at most before and after which the power is cut; of more so many are drawn
_CUTS = 300
_ROOT = Path(__file__).parents[3]
_OUT = "out"
"""With which all begins that a verb writes outside of a lake, caches aside."""
_PROGRAM = """
import sys
from tests.program import invoke
from tests.studies.failing.forked import stand_in
stand_in(*sys.argv[1:3])
from flagdata.cli import main
main(sys.argv[3:])
"""
_COMMAND = re.compile(r"flagdata (gc|heal|pull|verify|recover)\b")
_DELETE = re.compile(r"\bdelete (?:it|the file|what is there)\b")
ALL = {
    **SCENES,
    "core": (SCENES["core"][0], {**SCENES["core"][1], **OUTSIDE}),
}
"""Scenes, each with its verbs."""


@dataclass(frozen=True, kw_only=True)
class Cut:
    """A state that a power cut may leave.

    Attributes:
        call: the number of calls before it.
        answered: whether the verb had answered.
        kind, ordered, tree: as of `disk.State`.
    """

    call: int
    answered: bool
    kind: str
    ordered: bool
    tree: Tree


def look(path: Path) -> list[Finding]:
    """What doctor and verify say of a lake that a user has to act on."""
    try:
        lake = Lake.open(path)
        marked = read_refs(lake)
        found = [
            *doctor(lake),
            *verify_catalog(lake, marked),
            *verify(lake, object_names(lake, marked), marked),
        ]
    except FlagdataError as error:
        found = [
            Finding(
                kind=error.kind,
                severity=Severity.ERROR,
                what=error.what,
                where=str(error.where),
                fix=error.fix,
            )
        ]
    return [finding for finding in dict.fromkeys(found) if finding.severity is not Severity.NOTE]


def typed(finding: Finding, path: Path, backup: Path) -> Iterator[tuple[str, ...]]:
    """The commands that a finding's remedy names, in its order: "delete" stands for deleting what
    it is about."""
    fix = finding.fix or ""
    for match in sorted(
        [*_COMMAND.finditer(fix), *_DELETE.finditer(fix)], key=lambda match: match.start()
    ):
        verb = match[1] if match.re is _COMMAND else "delete"
        if verb in ("heal", "pull"):
            yield verb, str(backup), "--lake", str(path)
        elif verb == "delete" and finding.where is not None:
            yield verb, finding.where
        elif verb in ("gc", "verify"):
            yield verb, "--lake", str(path)


def heal(path: Path, backup: Path) -> tuple[list[Finding], list[str], list[Finding]]:
    """What is found in a lake, the verbs that were typed since a remedy names them, and what is
    found then."""
    first = found = look(path)
    done: set[tuple[str, ...]] = set()
    for _ in range(_ROUNDS):
        commands = [
            next((c for c in typed(one, path, backup) if c not in done), ()) for one in found
        ]
        if not any(commands):
            break
        for command in dict.fromkeys(filter(None, commands)):
            done.add(command)
            if command[0] != "delete":
                invoke(*command)
            elif Path(command[1]).is_dir():
                shutil.rmtree(command[1])
            else:
                Path(command[1]).unlink(missing_ok=True)
        found = look(path)
    return first, [command[0] for command in done], found


@dataclass(frozen=True, kw_only=True)
class Trials:
    """Power cuts beside one verb.

    Attributes:
        backup: a copy of the lake before the verb.
        before, after: what the lake shows before and after the verb, undisturbed.
        first, last: the whole folder then.
        cuts: every distinct state.
    """

    verb: Verb
    scene: Scene
    scratch: Path
    before: State
    after: State
    first: Tree
    last: Tree
    calls: int
    cuts: Sequence[Cut]

    @classmethod
    def of(
        cls, verb: Verb, scene: Scene, recorder: Recorder, scratch: Path, rng: np.random.Generator
    ) -> Trials:
        """Run a verb and enumerate the states.

        Raises:
            AssertionError: it fails, or its calls do not give what it leaves.
        """
        folder = scratch / "whole"
        shutil.copytree(scene.folder, folder, symlinks=True)
        model, first = Disk(folder), read(folder)
        arguments = given(verb.arguments, folder, scene)
        program = ("-m", "flagdata", *arguments)
        if verb.stand_in is not None:
            program = ("-c", _PROGRAM, verb.stand_in, scene.ids["kept"], *arguments)
        done = recorder.record(program, folder, cwd=_ROOT)
        assert done.code == 0, done.stderr
        chosen = set(range(len(done.calls) + 1))
        if len(chosen) > _CUTS:
            drawn = rng.choice(done.answered, _CUTS, replace=False).tolist()
            chosen = {*drawn, *range(done.answered, len(done.calls) + 1)}
        cuts: dict[int, Cut] = {}
        for number in range(len(done.calls) + 1):
            if number in chosen:
                answered = number >= done.answered
                for one in model.states(rng):
                    cut = Cut(
                        call=number,
                        answered=answered,
                        kind=one.kind,
                        ordered=one.ordered,
                        tree=one.tree,
                    )
                    key = hash(frozenset(one.tree.items()))
                    if key not in cuts or (answered and not cuts[key].answered):
                        cuts[key] = cut
            if number < len(done.calls):
                model.make(done.calls[number])
        last = read(folder)
        assert model.seen() == last, "files were changed by calls that are not recorded"
        target = verb.target.format(**places(folder))

        def states() -> tuple[State, State]:
            old = verb.target.format(**places(scene.folder))
            return state(Path(old), deletes=verb.deletes), state(Path(target), deletes=verb.deletes)

        code, found, said = Child(states, scratch / "states").ended()
        assert code == 0, said
        shutil.rmtree(folder)
        return cls(
            verb=verb,
            scene=scene,
            scratch=scratch,
            before=found[0],
            after=found[1],
            first=first,
            last=last,
            calls=len(done.calls),
            cuts=tuple(cuts.values()),
        )

    def drawn(self, points: int, rng: np.random.Generator) -> list[Cut]:
        """So many of the cuts: of each kind in turn, one after the answer and one before it."""
        groups: dict[tuple[bool, str], list[Cut]] = {}
        for place in rng.permutation(len(self.cuts)):
            cut = self.cuts[place]
            groups.setdefault((cut.answered, cut.kind), []).append(cut)
        sides = [
            [group for (side, _), group in groups.items() if side is answered]
            for answered in (True, False)
        ]
        order = [group for pair in zip_longest(*sides, fillvalue=[]) for group in pair]
        turns = (
            group[turn] for turn in range(len(self.cuts)) for group in order if turn < len(group)
        )
        return [cut for cut, _ in zip(turns, range(points), strict=False)]

    def examine(self, cut: Cut, folder: Path) -> dict[str, Any]:
        """In a process of its own: a state, what was found in it, typed against it, and what is
        wrong with it."""
        write(cut.tree, folder)
        target = Path(self.verb.target.format(**places(folder)))
        backup = self.scene.folder / "lake"
        wrong = [*self._outside(cut)]
        if self.verb.deletes and cut.answered:
            wrong += self._back(cut)
        there = (target / "lake.json").exists() or self.verb.target == "{lake}"
        begun = self._own(state(target, deletes=self.verb.deletes))
        first, commands, left = heal(target, backup) if there else ([], [], [])
        wrong += [f"not healed: {one.kind}: {one.what} (fix: {one.fix})" for one in left]
        healed = self._own(state(target, deletes=self.verb.deletes))
        if (
            self.verb.unfinished
            and begun not in (UNREADABLE, self.before, self.after)
            and not first
        ):
            wrong.append("silent: it has begun what it has not done, and nothing is found")
        if cut.answered and (undone := self.verb.unfinished & {one.kind for one in first}):
            wrong.append(f"lost: answered, and not done: {sorted(undone)}")
        if healed == UNREADABLE:
            wrong.append("lost: the lake cannot be read")
        elif cut.answered and self.after - healed:
            wrong.append(f"lost: answered, and not there: {sorted(self.after - healed)[:4]}")
        elif cut.answered and healed - self.after:
            wrong.append(f"erasure: answered, and still there: {sorted(healed - self.after)[:4]}")
        elif lost := (self.before & self.after) - healed:
            wrong.append(f"lost: {sorted(lost)[:4]}")
        elif self.verb.one_step and healed not in (self.before, self.after):
            wrong.append(f"a part is published: {sorted(healed ^ self.before)[:4]}")
        ended, more = self._again(folder, healed)
        commands += more
        end = self._own(state(target, deletes=self.verb.deletes))
        if ended.code and healed != self.after:
            wrong.append(f"repeat: exit code {ended.code}: {ended.err[-600:]}")
        elif end != self.after:
            wrong.append(f"repeat: ends otherwise: {sorted(end ^ self.after)[:4]}")
        later = heal(target, backup)[2]
        wrong += [f"unhealthy after the repeat: {one.kind}: {one.what}" for one in later]
        if not later and end != UNREADABLE:
            wrong += self._collected(target)
        return {
            "wrong": wrong,
            "found": sorted({one.kind for one in first}),
            "typed": sorted(commands),
        }

    def _own(self, seen: State) -> State:
        """Without objects that no version before or after has: what is left of the verb that was
        cut off."""
        known = self.before | self.after
        return frozenset(one for one in seen if one[0] != "object" or one in known)

    def _outside(self, cut: Cut) -> Iterator[str]:
        """What is wrong with files outside of lakes: each is as before or as after, and as after
        once it answered."""
        for path in cut.tree.keys() | self.last.keys():
            parts = path.split("/")
            if not parts[0].startswith(_OUT) or any(part.startswith(".") for part in parts):
                continue
            right = (
                [self.last.get(path, b"")]
                if cut.answered
                else [self.first.get(path, b""), self.last.get(path, b"")]
            )
            missing = path not in cut.tree
            if missing and (path in self.first or cut.answered) and path in self.last:
                yield f"output: {path} is not there"
            elif not missing and (
                cut.tree[path] not in right or (path not in self.first and path not in self.last)
            ):
                yield f"output: {path} is cut off"

    def _back(self, cut: Cut) -> Iterator[str]:
        """What the verb had answered that it deleted, and is there."""
        for path in cut.tree.keys() & self.first.keys() - self.last.keys():
            if path.split("/")[0] == "lake" and path.split("/")[1] in STORES:
                yield f"erasure: {path} is back"

    def _again(self, folder: Path, healed: State) -> tuple[Ended, list[str]]:
        """Give the verb again; where it says that what is there has to go, do that and give it once
        more."""
        again = self.verb.again if self.verb.again and healed != frozenset({("no lake",)}) else None
        command = given(again or self.verb.arguments, folder, self.scene)
        ended = invoke(*command)
        if ended.code and "delete what is there" in " ".join(ended.err.split()):
            shutil.rmtree(self.verb.target.format(**places(folder)))
            return invoke(*command), ["delete"]
        return ended, []

    def _collected(self, target: Path) -> Iterator[str]:
        """What is wrong once all that no version needs was collected."""
        collect(Lake.open(target), grace=timedelta(0))
        if state(target, deletes=False) != frozenset(
            one for one in self.after if one[0] != "object"
        ):
            yield "collected: rows went"
        for one in doctor(Lake.open(target), grace=timedelta(0)):
            if one.severity is not Severity.NOTE:
                yield f"left: {one.kind}: {one.what}"


def places(folder: Path) -> dict[str, str]:
    """What a verb's places are in a folder."""
    inside = {name: f"{folder}/{name}" for name in ("lake", "hurt", "new")}
    return {**inside, "folder": str(folder), "out": f"{folder}/{_OUT}"}


def given(arguments: Iterable[str], folder: Path, scene: Scene) -> list[str]:
    """A verb's arguments in a folder."""
    return [argument.format(**places(folder), **scene.ids) for argument in arguments]


def tried(trials: Trials, *, points: int, rng: np.random.Generator) -> dict[str, Any]:
    """Examine states of a verb, as many at the same time as there are processors."""
    begun = time.monotonic()
    cuts = trials.drawn(points, rng)
    counts: Counter[str] = Counter()
    kinds: Counter[str] = Counter()
    finding_kinds: Counter[str] = Counter()
    commands: Counter[str] = Counter()
    examples: list[str] = []
    at_once = len(os.sched_getaffinity(0))
    for start in range(0, len(cuts), at_once):
        running = []
        for number, cut in enumerate(cuts[start : start + at_once], start):
            folder = trials.scratch / str(number)
            running.append(
                (
                    cut,
                    folder,
                    Child(
                        partial(trials.examine, cut, folder),
                        trials.scratch / f"child-{number}",
                        longest=LONGEST,
                    ),
                )
            )
        for cut, folder, child in running:
            code, found, said = child.ended()
            shutil.rmtree(folder, ignore_errors=True)
            if code:
                found = {
                    "wrong": [f"the examination failed ({code}): {said[-1500:]}"],
                    "found": [],
                    "typed": [],
                }
            counts.update(
                {
                    "answered": cut.answered,
                    "with findings": bool(found["found"]),
                    "wrong": bool(found["wrong"]),
                    "wrong in order": bool(found["wrong"]) and cut.ordered,
                }
            )
            kinds.update({one.partition(":")[0] for one in found["wrong"]})
            finding_kinds.update(found["found"])
            commands.update(found["typed"])
            place = f"after call {cut.call} of {trials.calls}{', answered' if cut.answered else ''}"
            order = "ordered" if cut.ordered else "any order"
            examples += [
                f"{place}, {cut.kind} ({order}): {' '.join(one.split())}" for one in found["wrong"]
            ]
    return {
        "calls": trials.calls,
        "states": len(trials.cuts),
        "examined": len(cuts),
        **{name: counts[name] for name in ("answered", "with findings", "wrong", "wrong in order")},
        "kinds": dict(kinds),
        "findings": dict(finding_kinds),
        "typed": dict(commands),
        "examples": examples[:8],
        "seconds": round(time.monotonic() - begun),
    }


def campaign(
    names: Sequence[str],
    results: Path | None,
    *,
    points: int,
    seed: int,
    scenes: Path | None,
    scratch: Path,
) -> dict[str, Any]:
    """Try verbs, those whose results are not known yet where none is named, and return all results.

    Args:
        results: JSON file; `None` keeps none.
        scenes: folder in which scenes are kept; `None` makes them anew.
    """
    known: dict[str, Any] = json.loads(results.read_text()) if results and results.exists() else {}
    recorder = Recorder(scratch)
    for group, (make, verbs) in ALL.items():
        wanted = [name for name in verbs if (name in names if names else name not in known)]
        if not wanted:
            continue
        code, scene, said = Child(
            partial(kept_scene, scenes or scratch / "scenes", group, make),
            scratch / "made",
            longest=MAKING,
        ).ended()
        assert code == 0, said
        for name in wanted:
            rng = np.random.default_rng([seed, *name.encode()])
            place = scratch / f"of-{name.replace(' ', '-')}"
            place.mkdir()
            verb = verbs[name]
            trials = Trials.of(verb, scene, recorder, place, rng)
            if verb.stand_in is not None:
                stand_in(verb.stand_in, scene.ids["kept"])
            known[name] = {
                **tried(trials, points=points, rng=rng),
                "circumstances": circumstances(seed),
            }
            shutil.rmtree(place)
            print(  # noqa: T201
                name,
                {key: value for key, value in known[name].items() if key != "circumstances"},
                flush=True,
            )
            if results is not None:
                results.write_text(json.dumps(known, indent=1, ensure_ascii=False) + "\n")
                results.with_suffix(".md").write_text(page(known))
    return known


def page(known: Mapping[str, Any]) -> str:
    """The results as Markdown."""
    shown_kinds = {
        "lost": ("lost",),
        "erasures undone": ("erasure",),
        "silent": ("silent",),
        "a part": ("a part is published",),
        "not healed": ("not healed",),
        "repeats that fail": ("repeat", "unhealthy after the repeat"),
        "outputs cut off": ("output",),
        "left or lost by gc": ("left", "collected"),
        "other": ("the examination failed",),
    }
    columns = (
        "calls",
        "states",
        "examined",
        "answered",
        "with findings",
        "wrong",
        "wrong in order",
    )
    about = " ".join((__doc__ or "").split("\n\n")[1].split())
    model = " ".join("".join((disk.__doc__ or "").split("\n\n", 1)[1:]).split())
    lines = [
        "# Power cuts beside every verb that writes",
        "",
        about,
        "",
        model,
        "",
        f"| verb | {' | '.join((*columns, *shown_kinds))} | typed | code |",
        f"|---{'|---:' * (len(columns) + len(shown_kinds))}|---|---|",
    ]
    total: Counter[str] = Counter()
    for name, found in known.items():
        numbers = {column: found[column] for column in columns}
        numbers |= {
            title: sum(found["kinds"].get(kind, 0) for kind in kinds)
            for title, kinds in shown_kinds.items()
        }
        total.update(numbers)
        typed_here = ", ".join(
            f"{command} {count}" for command, count in sorted(found["typed"].items())
        )
        code = found["circumstances"]["code_version"]
        lines.append(
            f"| {name} | {' | '.join(str(number) for number in numbers.values())} | {typed_here} | "
            f"{code} |"
        )
    lines.append(
        f"| **all** | {' | '.join(str(total[title]) for title in (*columns, *shown_kinds))} | | |"
    )
    examples = [
        f"- {name}, {example}" for name, found in known.items() for example in found["examples"]
    ]
    lines += ["", "## What was wrong", "", *examples] if examples else []
    if known:
        where = next(iter(known.values()))["circumstances"]
        versions = ", ".join(f"{name} {number}" for name, number in where["versions"].items())
        machine = f"{where['processor']}, {where['cores']} cores; Python {where['python']}"
        lines += ["", f"{machine}, {versions}; seed {where['seed']}."]
    return "\n".join([*lines, ""])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="verbs; those without a result if none is named")
    parser.add_argument("--out", type=Path, help="JSON file of the results; none is kept without")
    parser.add_argument(
        "--points", type=int, default=POINTS, help="states of each verb that are examined"
    )
    parser.add_argument(
        "--scenes", type=Path, help="folder that scenes are kept in; some take minutes to make"
    )
    parser.add_argument("--seed", type=int, default=1, help="of the states that are drawn")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="power-cut-") as scratch_folder:
        found_now = campaign(
            options.names,
            options.out,
            points=options.points,
            seed=options.seed,
            scenes=options.scenes,
            scratch=Path(scratch_folder).resolve(),
        )
    print(page(found_now))  # noqa: T201
