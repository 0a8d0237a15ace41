"""Commands on a lake in a bucket that are killed, while requests fail:
`python -m tests.studies failing-buckets --out FILE`.

Each verb that writes to a lake is killed at so many of its requests to the store, spread evenly, in turn before the
store has the request and after it has done it. 5 % of the requests meet a fault: they are answered by an error, cut off
before or after the store has acted or within the answer, or answered late. Then the command is given again, beside
faults, and the lake is examined, collected and examined again: a copy on disk, and at every fifth point the lake in the
bucket, too.

Results stay in FILE, a JSON file, verb after verb, so that a campaign may be stopped and given again; beside it a page
of the same name shows them.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import pickle
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from datetime import timedelta
from functools import partial
from http.client import HTTPConnection
from importlib import import_module
from pathlib import Path
from typing import Any

from flagdata.cli import main
from flagdata.findings import Severity
from flagdata.lake import Lake, collect, doctor, labels_of, object_names, verify
from flagdata.lake.objects import SUMS
from flagdata.storage import RemotePath, connection
from tests.evidence import circumstances
from tests.s3 import BUCKET, SECRETS, moto
from tests.studies.failing import slow
from tests.studies.failing.commands import Scene, made_scene
from tests.studies.failing.store import FAULTY, LOST, PATIENCE, failing, planned
from tests.studies.failing.worker import SHARED

POINTS = 20
LONGEST = 180
"""Seconds after which a command counts as hanging."""
MAKING = 3600
"""Seconds that a scene may take to be made."""
NOW = timedelta(0)
_KILLED = -signal.SIGKILL
_ORPHAN = b"of an ingest that was given up"
State = frozenset[tuple[str, ...]]


@dataclass(frozen=True, kw_only=True)
class Verb:
    """A command that writes to a lake in a bucket.

    Attributes:
        arguments: {lake} stands for the lake's address, {new} for one where nothing is, {folder} for the scene's
            folder, {out} for one of the trial's own, other names in braces for the scene's ids.
        one_step: whether it changes all or nothing.
        deletes: whether data go, so that the state is of objects too.
        target: what it writes to, {lake} or {new}.
        again: what goes on where it was killed, if that is another command.
        stand_in: as of `tests.studies.failing.trial.Command`.
    """

    arguments: tuple[str, ...]
    one_step: bool = True
    deletes: bool = False
    target: str = "{lake}"
    again: tuple[str, ...] | None = None
    stand_in: str | None = None


_LAKE = ("--lake", "{lake}")
CORE = {
    "init": Verb(arguments=("init", "{new}"), target="{new}"),
    "clone": Verb(
        arguments=("clone", "{folder}/ahead", "{new}"),
        target="{new}",
        one_step=False,
        again=("push", "{new}", "--lake", "{folder}/ahead"),
    ),
    "push": Verb(arguments=("push", "{lake}", "--lake", "{folder}/ahead"), one_step=False),
    "pull": Verb(arguments=("pull", "{folder}/ahead", *_LAKE), one_step=False),
    "ingest camera": Verb(arguments=("ingest", "{folder}/second.mp4", *_LAKE)),
    "ingest wind": Verb(arguments=("ingest", "{folder}/second.csv", *_LAKE)),
    "ingest meshes": Verb(arguments=("ingest", "{folder}/meshes", "--rate", "25", *_LAKE)),
    "ingest markers": Verb(arguments=("ingest", "{folder}/markers.csv", *_LAKE)),
    "ingest record": Verb(arguments=("ingest", "{folder}/record.mcap", *_LAKE)),
    "align": Verb(
        arguments=(
            "align",
            "{camera}",
            "{wind}",
            "--by",
            "given",
            "--clock-offset",
            "0",
            "--offset-sigma",
            "0.2",
            *_LAKE,
        )
    ),
    "realign": Verb(
        arguments=("realign", "{recording}", "--by", "given", "--clock-offset", "0", "--offset-sigma", "0.3", *_LAKE)
    ),
    "declare": Verb(arguments=("declare", "{camera}", "--speed", "3", "--sigma", "0.2", *_LAKE)),
    "declare-cloths": Verb(arguments=("declare-cloths", "{folder}/cloths.csv", *_LAKE), one_step=False),
    "label": Verb(arguments=("label", "{camera}", "operator=me", *_LAKE)),
    "tag": Verb(arguments=("tag", "v1", *_LAKE)),
    "tag --delete": Verb(arguments=("tag", "v0", "--delete", *_LAKE)),
    "branch": Verb(arguments=("branch", "more", *_LAKE)),
    "branch --delete": Verb(arguments=("branch", "side", "--delete", "--discard", *_LAKE), one_step=False),
    "merge": Verb(arguments=("merge", "side", *_LAKE)),
    "withdraw": Verb(arguments=("withdraw", "{single}", "-m", "wrong", *_LAKE)),
    "withdraw --everywhere": Verb(
        arguments=("withdraw", "{single}", "--everywhere", "-m", "wrong", *_LAKE), one_step=False, deletes=True
    ),
    "gc": Verb(arguments=("gc", "--older-than", "0s", *_LAKE), one_step=False, deletes=True),
    "expire": Verb(arguments=("expire", "--keep", "1", *_LAKE), one_step=False, deletes=True),
    "simulate": Verb(arguments=("simulate", "{folder}/small.toml", "--workers", "1", *_LAKE)),
}


def core(folder: Path) -> Scene:
    """Make the scene of the commands of the core, with markers, a record and a lake ahead beside it."""
    from flagdata.ingest import ingest_camera

    scene = made_scene(folder)
    (folder / "markers.csv").write_text(
        "time,marker,u,v,x,y,z\n"
        + "".join(f"{k / 25},m{m},{m},0,{m},{k / 100},0\n" for k in range(30) for m in range(3))
    )
    shutil.copytree(folder / "lake", folder / "ahead")
    ahead = Lake.open(folder / "ahead")
    film = ingest_camera(ahead, folder / "film.mp4").artifact
    (folder / "record.mcap").write_bytes(ahead.object_path(str(film.object)).read_bytes())
    ahead.tag("later")
    return scene


_OF_A_TRIAL = {
    "{folder}/lake": "{lake}",
    "{folder}/out": "{out}",
    "{folder}/report": "{out}-report",
    "{folder}/answer": "{out}-answer",
}


def _slow(make: Callable[[Path], Scene], names: Sequence[str]) -> tuple[Callable[[Path], Scene], dict[str, Verb]]:
    """A scene of commands that take long, with those of them that write to its lake."""
    commands = next(found for scene, found in slow.SCENES.values() if scene is make)
    verbs = {}
    for name in names:
        given = commands[name].arguments
        for there, here in _OF_A_TRIAL.items():
            given = tuple(part.replace(there, here) for part in given)
        verbs[name] = Verb(arguments=given, one_step=commands[name].one_step, stand_in=commands[name].stand_in)
    return make, verbs


SCENES: Mapping[str, tuple[Callable[[Path], Scene], Mapping[str, Verb]]] = {
    "core": (core, CORE),
    "train": _slow(slow.train_scene, ["train"]),
    "measure": _slow(slow.measure_scene, ["measure"]),
    "build": _slow(slow.build_scene, ["build"]),
    "loop": _slow(slow.loop_scene, ["close-loop"]),
}


def copied(address: str, folder: Path) -> set[str]:
    """Copy a lake's files out of the bucket, where they are looked at in a tenth of the time; the names of all that is
    there. Of folders without their sums, which count as absent, nothing is copied, nor what lies in staging."""
    shutil.rmtree(folder, ignore_errors=True)
    place = RemotePath.parse(address)
    names = {name for name, _ in place.names()}
    whole = {name.removesuffix(f"/{SUMS}") for name in names if name.endswith(f"/{SUMS}")}
    for name in names:
        parts = name.split("/")
        inside = parts[0] not in ("zarr", "model") or "/".join(parts[:2]) in whole
        if inside and parts[0] != "staging" and parts[-1] != SUMS:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes((place / name).read_bytes())
    return names


def state(folder: Path, *, deletes: bool) -> State:
    """What a copied lake shows: rows by branch, with their labels, tags and branches; and its objects."""
    if not (folder / "lake.json").exists():
        return frozenset({("no lake",)})
    lake = Lake.open(folder)
    found: set[tuple[str, ...]] = {("lake",)}
    for branch in ("main", *lake.refs.branches()):
        found.add(("branch", branch))
        rows = lake.rows(at=branch)
        labels = labels_of(rows)
        found |= {("row", branch, one, str(labels.get(one))) for one in rows["artifact"].to_pylist()}
    found |= {("tag", name) for name in lake.refs.tags()}
    if deletes:
        found |= {("object", stored.name) for stored in lake.objects}
    return frozenset(found)


def examine(address: str, folder: Path, *, remotely: bool) -> dict[str, Any]:
    """What is wrong with a lake, and what a collection leaves in it that is not to be there.

    Args:
        folder: where it was copied to.
        remotely: whether the lake in the bucket is examined, too.
    """
    lake, local = Lake.open(address), Lake.open(folder)
    found = [*doctor(local, grace=NOW), *verify(local, object_names(local))]
    if remotely:
        found += [*doctor(lake, grace=NOW), *verify(lake, object_names(lake))]
    errors = [f"{one.kind}: {one.what}" for one in found if one.severity is Severity.ERROR]
    collected = collect(lake, grace=NOW)
    names = copied(address, folder)
    left = [f"staging: {name}" for name in names if name.startswith("staging/") and name != "staging/made"]
    left += [f"a folder without its sums: {name}" for name in names - _files(folder) if not name.startswith("staging/")]
    after = doctor(lake if remotely else Lake.open(folder), grace=NOW)
    left += [f"{one.kind}: {one.what}" for one in after if one.severity is not Severity.NOTE]
    return {"errors": errors, "left": left, "collected": len(collected.objects) + len(collected.leftovers)}


def _files(folder: Path) -> set[str]:
    """Names of the files of a copied lake, with those of the sums that were not copied."""
    files = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    return files | {f"{'/'.join(name.split('/')[:2])}/{SUMS}" for name in files if name[:4] in ("zarr", "mode")}


def _invoked(arguments: Sequence[str]) -> int:
    try:
        main(list(arguments))
    except SystemExit as ended:
        return int(ended.code or 0)
    return 0


class Child:
    """A forked process, which may use a store; its parent must not."""

    def __init__(self, work: Callable[[], object], folder: Path, *, longest: int = LONGEST) -> None:
        self._folder = folder
        folder.mkdir(parents=True, exist_ok=True)
        self.pid = os.fork()
        if self.pid == 0:
            os.setsid()
            for name, stream in (("stdout", 1), ("stderr", 2)):
                os.dup2(os.open(folder / name, os.O_CREAT | os.O_WRONLY | os.O_TRUNC), stream)
            signal.signal(signal.SIGALRM, signal.SIG_DFL)
            signal.alarm(longest)
            code = 70
            try:
                result = work()
                (folder / "result").write_bytes(pickle.dumps(result))
                code = 0
            except BaseException:  # noqa: BLE001 — the parent gets it
                traceback.print_exc()
            sys.stdout.flush()
            sys.stderr.flush()
            (folder / "modules").write_text("\n".join(n for n in sys.modules if n.partition(".")[0] in SHARED))
            os._exit(code)

    def ended(self) -> tuple[int, Any, str]:
        """Its exit code, what it gave, and what it wrote to stderr."""
        code = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])
        result = self._folder / "result"
        given = pickle.loads(result.read_bytes()) if code == 0 else None
        modules = self._folder / "modules"
        for name in modules.read_text().split() if modules.exists() else ():
            import_module(name)
        said = (self._folder / "stderr").read_text(errors="replace")
        shutil.rmtree(self._folder)
        return code, given, said


class Bucket:
    """Copies of a lake in a bucket of moto's, for trials."""

    def __init__(self, store: str) -> None:
        self._host = store.removeprefix("http://")
        self.template: dict[str, bytes] = {}

    def take(self, prefix: str) -> None:
        """Keep what is at a prefix as what copies are made of."""
        import boto3

        client = boto3.client("s3", endpoint_url=f"http://{self._host}", region_name="us-east-1")
        listed = client.list_objects_v2(Bucket=BUCKET, Prefix=f"{prefix}/").get("Contents", [])
        self.template = {
            one["Key"].removeprefix(prefix): client.get_object(Bucket=BUCKET, Key=one["Key"])["Body"].read()
            for one in listed
        }

    def put(self, prefix: str) -> None:
        """A copy at a prefix."""
        connected = HTTPConnection(self._host)
        for key, content in self.template.items():
            connected.request("PUT", f"/{BUCKET}/{prefix}{key}", content)
            connected.getresponse().read()
        connected.close()

    def remove(self, prefix: str) -> None:
        """Delete all at a prefix."""
        import boto3

        client = boto3.client("s3", endpoint_url=f"http://{self._host}", region_name="us-east-1")
        listed = client.list_objects_v2(Bucket=BUCKET, Prefix=f"{prefix}/").get("Contents", [])
        for first in range(0, len(listed), 1000):
            keys = [{"Key": one["Key"]} for one in listed[first : first + 1000]]
            client.delete_objects(Bucket=BUCKET, Delete={"Objects": keys})


@dataclass(frozen=True, kw_only=True)
class Trials:
    """Trials of one verb."""

    verb: Verb
    scene: Scene
    bucket: Bucket
    proxy: str
    scratch: Path

    def given(self, prefix: str, arguments: Sequence[str] | None = None) -> list[str]:
        places = self._places(prefix)
        return [part.format(**places) for part in arguments or self.verb.arguments]

    def _places(self, prefix: str) -> dict[str, str]:
        lake = f"s3://{BUCKET}/{prefix}"
        out = self.scratch / prefix.replace("/", "-") / "out"
        return {
            "lake": f"{lake}/lake",
            "new": f"{lake}/new",
            "folder": str(self.scene.folder),
            "out": str(out),
            **self.scene.ids,
        }

    def _target(self, prefix: str) -> str:
        return self.verb.target.format(**self._places(prefix))

    def _state(self, target: str) -> State:
        copied(target, self.scratch / "copy")
        return state(self.scratch / "copy", deletes=self.verb.deletes)

    def whole(self) -> tuple[State, State, int]:
        """The state before and after the verb without a fault, and how many requests it made."""

        def work() -> tuple[State, State, int, int]:
            target = self._target("whole")
            before = self._state(target)
            planned(self.proxy)
            code = _invoked(self.given("whole"))
            count = planned(self.proxy)["count"]
            return before, self._state(target), count, code

        self.bucket.put("whole/lake")
        code, result, said = Child(work, self.scratch / "whole").ended()
        assert code == 0, said
        before, after, count, code = result
        assert code == 0, said
        assert before != after, f"it changed nothing: {said}"
        self.bucket.remove("whole")
        return before, after, count

    def killed(self, number: int, call: int, before: State, after: State) -> dict[str, Any]:
        """One trial: what happened, and what was wrong."""
        prefix, answered = f"trial-{number}", number % 2 == 1
        self.bucket.put(f"{prefix}/lake")

        def first() -> int:
            planned(
                self.proxy,
                kill=call,
                answered=answered,
                group=os.getpid(),
                share=FAULTY,
                lost=LOST,
                seed=1000 * number + call,
            )
            return _invoked(self.given(prefix))

        def second() -> dict[str, Any]:
            faults = planned(self.proxy)["faults"]
            target = self._target(prefix)
            middle = self._state(target)
            planned(self.proxy, share=FAULTY, lost=LOST, seed=1000 * number + call + 1)
            again = self.verb.again if self.verb.again and middle != frozenset({("no lake",)}) else None
            code = _invoked(self.given(prefix, again))
            faults = Counter(faults) + Counter(planned(self.proxy)["faults"])
            end = self._state(target)
            seen = examine(target, self.scratch / "copy", remotely=number % 5 == 0)
            return {"faults": faults, "middle": middle, "again": code, "end": end, **seen}

        code, ended, said = Child(first, self.scratch / prefix / "first").ended()
        failed, found, told = Child(second, self.scratch / prefix / "second").ended()
        self.bucket.remove(prefix)
        shutil.rmtree(self.scratch / prefix, ignore_errors=True)
        if failed:
            return {"wrong": [f"the examination failed ({failed}): {told[-1500:]}"], "killed": code == _KILLED}
        objects = {entry for entry in before | after if entry[0] == "object"}  # others are left by what was killed

        def own(seen: State) -> State:
            return frozenset(entry for entry in seen if entry[0] != "object" or entry in objects)

        middle, end = own(found["middle"]), own(found["end"])
        staying = before & after
        wrong = [f"lost: {sorted(staying - seen)[:3]}" for seen in (middle, end) if not staying <= seen]
        if code == 0:
            wrong += _reported(ended, said, middle, before, after, one_step=self.verb.one_step)
        elif code != _KILLED:
            wrong.append(f"report: ended by {code}: {said[-800:]}")
        elif self.verb.one_step and middle not in (before, after):
            wrong.append(f"report: a part is published: {sorted(middle ^ before)[:4]}")
        if found["again"] and middle != after:
            wrong.append(f"repeat: exit code {found['again']}: {told[-800:]}")
        if end != after:
            wrong.append(f"repeat: ends otherwise: {sorted(end ^ after)[:4]} {told[-500:]}")
        wrong += [f"unhealthy: {error}" for error in found["errors"]] + [f"left: {one}" for one in found["left"]]
        return {
            "wrong": wrong,
            "killed": code == _KILLED,
            "published": middle == after,
            "faults": found["faults"],
            "rows": len(staying) + (len(after - before) if code == 0 and not ended else 0),
            "collected": found["collected"],
        }


def _reported(code: int, said: str, middle: State, before: State, after: State, *, one_step: bool) -> list[str]:
    """What is wrong with the report of a command that ended."""
    wrong = []
    if code == 0 and middle != after:
        wrong.append(f"report: exit code 0, and not all is published: {sorted(middle ^ after)[:4]}")
    if code and middle == after:
        wrong.append(f"report: exit code {code}, and all is published: {said[-800:]}")
    if code and one_step and middle != before and middle != after:
        wrong.append(f"report: exit code {code}, and a part is published: {said[-800:]}")
    if code and "fix:" not in said:
        wrong.append(f"report: no fix is named: {said[-800:]}")
    return wrong + [f"report: {word}: {said[-1500:]}" for word in ("Traceback", "unforeseen") if word in said]


def tried(trials: Trials, *, points: int) -> dict[str, Any]:
    """The trials of a verb, and what they found."""
    begun = time.monotonic()
    before, after, total = trials.whole()
    counts: Counter[str] = Counter()
    faults: Counter[str] = Counter()
    kinds: Counter[str] = Counter()
    examples: list[str] = []
    for number, call in enumerate((total - 1) * point // max(points - 1, 1) for point in range(points)):
        found = trials.killed(number, call, before, after)
        counts.update(
            {
                "killed": found["killed"],
                "published when killed": found.get("published", False),
                "rows acknowledged": found.get("rows", 0),
                "leftovers collected": found.get("collected", 0),
                "wrong": bool(found["wrong"]),
            }
        )
        faults.update(found.get("faults", {}))
        kinds.update({one.partition(":")[0] for one in found["wrong"]})
        examples += [f"point {number}, request {call} of {total}: {one}" for one in found["wrong"]]
    faults.pop("killed", None)
    return {
        "requests": total,
        "points": points,
        **counts,
        "faults": dict(faults),
        "kinds": dict(kinds),
        "examples": examples[:6],
        "seconds": round(time.monotonic() - begun),
    }


def campaign(names: Sequence[str], results: Path, *, points: int, scratch: Path) -> dict[str, Any]:
    """Try verbs, those whose results are not known yet where none is named, and return all results."""
    known: dict[str, Any] = json.loads(results.read_text()) if results.exists() else {}
    for name, value in (*SECRETS.items(), ("AWS_REGION", "us-east-1"), ("FLAGDATA_CACHE", str(scratch / "cache"))):
        os.environ[name] = value
    connection.REQUEST_TIMEOUT = PATIENCE
    with ExitStack() as stack:
        store = stack.enter_context(moto())
        proxy = stack.enter_context(failing(store))
        os.environ["AWS_ENDPOINT_URL"] = proxy
        for group, (make, verbs) in SCENES.items():
            wanted = [name for name in verbs if (name in names if names else name not in known)]
            if not wanted:
                continue
            folder = scratch / group
            folder.mkdir()
            code, scene, said = Child(partial(make, folder), scratch / "made", longest=MAKING).ended()
            assert code == 0, said
            bucket = Bucket(store)
            code, cloned, said = Child(
                lambda folder=folder, group=group: _invoked(
                    ["clone", str(folder / "lake"), f"s3://{BUCKET}/template-{group}"]
                ),
                scratch / "cloned",
            ).ended()
            assert (code, cloned) == (0, 0), said
            bucket.take(f"template-{group}")
            bucket.template[f"/mcap/{hashlib.sha256(_ORPHAN).hexdigest()}.mcap"] = _ORPHAN
            for path in (folder / "lake" / "mcap").iterdir():  # what was withdrawn, which a clone does not take
                bucket.template.setdefault(f"/mcap/{path.name}", path.read_bytes())
            for name in wanted:
                verb = verbs[name]
                if verb.stand_in is not None:
                    module, _, function = verb.stand_in.partition(":")
                    getattr(import_module(module), function)(scene.ids["kept"])
                place = scratch / f"of-{name.replace(' ', '-')}"
                place.mkdir()
                trials = Trials(verb=verb, scene=scene, bucket=bucket, proxy=proxy, scratch=place)
                try:
                    found = tried(trials, points=points)
                except AssertionError as error:  # of one verb: the others are tried all the same
                    print(name, "could not be tried:", error, flush=True)  # noqa: T201
                    continue
                known[name] = {**found, "circumstances": circumstances(0)}
                shutil.rmtree(place)
                print(name, {key: value for key, value in known[name].items() if key != "circumstances"}, flush=True)  # noqa: T201
                results.write_text(json.dumps(known, indent=1, ensure_ascii=False) + "\n")
                results.with_suffix(".md").write_text(page(known))
    return known


def page(known: Mapping[str, Any]) -> str:
    """The results as Markdown."""
    columns = (
        "requests",
        "points",
        "killed",
        "published when killed",
        "rows acknowledged",
        "leftovers collected",
        "lost",
        "wrong reports",
        "repeats that fail",
        "unhealthy",
        "left after gc",
        "faults",
    )
    shown = {
        "lost": "lost",
        "wrong reports": "report",
        "repeats that fail": "repeat",
        "unhealthy": "unhealthy",
        "left after gc": "left",
    }
    about = " ".join((__doc__ or "").split("\n\n")[1].split())
    lines = [
        "# Commands on a bucket that are killed, beside faults",
        "",
        about,
        "",
        f"| verb | {' | '.join(columns)} | code |",
        f"|---{'|---:' * len(columns)}|---|",
    ]
    for name, found in known.items():
        cells = [
            sum(found["faults"].values())
            if column == "faults"
            else found["kinds"].get(shown[column], 0)
            if column in shown
            else found.get(column, 0)
            for column in columns
        ]
        lines.append(f"| {name} | {' | '.join(map(str, cells))} | {found['circumstances']['code_version']} |")
    faults: Counter[str] = Counter()
    for found in known.values():
        faults.update(found["faults"])
    lines += ["", "Faults: " + ", ".join(f"{name} {count}" for name, count in sorted(faults.items())) + "."]
    if known:
        where = next(iter(known.values()))["circumstances"]
        lines += ["", f"{where['processor']}, {where['cores']} cores; Python {where['python']}; moto's server."]
    return "\n".join([*lines, ""])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="verbs; those without a result if none is named")
    parser.add_argument("--out", type=Path, required=True, help="JSON file of the results")
    parser.add_argument("--points", type=int, default=POINTS, help="points at which each verb is killed")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="buckets-") as place:
        campaign(given.names, given.out, points=given.points, scratch=Path(place))
