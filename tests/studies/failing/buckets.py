"""Commands on a lake in a bucket that are killed, while requests fail:
`python -m tests.studies failing-buckets --out FILE`.

Each verb that writes to a lake is killed at so many of its requests to the store, spread evenly, in
turn before the store has the request and after it has done it. 5 % of the requests meet a fault:
they are answered by an error, cut off before or after the store has acted or within the answer, or
answered late. Then the command is given again, beside faults, and the lake is examined, collected
and examined again: a copy on disk, and at every fifth point the lake in the bucket, too.

Results stay in FILE, a JSON file, verb after verb, so that a campaign may be stopped and given
again; beside it a page of the same name shows them.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import shutil
import signal
import tempfile
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from datetime import timedelta
from functools import partial
from http.client import HTTPConnection
from pathlib import Path
from typing import Any

from flagdata.core.findings import Severity
from flagdata.lake import Lake, collect, doctor, object_names, verify
from flagdata.lake.objects import SUMS
from flagdata.storage import RemotePath, connection
from tests.evidence import circumstances
from tests.s3 import BUCKET, SECRETS, moto
from tests.studies.failing.forked import Child, invoked, stand_in
from tests.studies.failing.scenes import Scene
from tests.studies.failing.store import FAULTY, LOST, PATIENCE, failing, planned
from tests.studies.failing.verbs import SCENES, State, Verb, state

POINTS = 20
MAKING = 3600
"""Seconds that a scene may take to be made."""
NOW = timedelta(0)
_KILLED = -signal.SIGKILL
_ORPHAN = b"of an ingest that was given up"


def copied(address: str, folder: Path) -> set[str]:
    """Copy a lake's files out of the bucket, where they are looked at in a tenth of the time; the
    names of all that is there. Of folders without their sums, which count as absent, nothing is
    copied, nor what lies in staging."""
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
    left = [
        f"staging: {name}"
        for name in names
        if name.startswith("staging/") and name != "staging/made"
    ]
    left += [
        f"a folder without its sums: {name}"
        for name in names - _files(folder)
        if not name.startswith("staging/")
    ]
    after = doctor(lake if remotely else Lake.open(folder), grace=NOW)
    left += [f"{one.kind}: {one.what}" for one in after if one.severity is not Severity.NOTE]
    return {
        "errors": errors,
        "left": left,
        "collected": len(collected.objects) + len(collected.leftovers),
    }


def _files(folder: Path) -> set[str]:
    """Names of the files of a copied lake, with those of the sums that were not copied."""
    files = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    return files | {
        f"{'/'.join(name.split('/')[:2])}/{SUMS}" for name in files if name[:4] in ("zarr", "mode")
    }


def damaged(whole: Path, hurt: Path) -> dict[str, bytes | None]:
    """What differs between the files of a lake and those of the same lake with damage; `None` of
    what is missing."""
    found: dict[str, bytes | None] = {}
    for path in (one for one in whole.rglob("*") if one.is_file()):
        name = path.relative_to(whole)
        content = (hurt / name).read_bytes() if (hurt / name).exists() else None
        if content != path.read_bytes():
            found[f"/{name}"] = content
    return found


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
            one["Key"].removeprefix(prefix): client.get_object(Bucket=BUCKET, Key=one["Key"])[
                "Body"
            ].read()
            for one in listed
        }

    def put(self, prefix: str, *, damage: Mapping[str, bytes | None]) -> None:
        """A copy at a prefix, with other bytes for some of its files; `None` leaves one out."""
        connected = HTTPConnection(self._host)
        for key, content in {**self.template, **damage}.items():
            if content is None:
                continue
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
            "hurt": f"{lake}/hurt",
            "new": f"{lake}/new",
            "folder": str(self.scene.folder),
            "out": str(out),
            **self.scene.ids,
        }

    def _target(self, prefix: str) -> str:
        return self.verb.target.format(**self._places(prefix))

    def _put(self, prefix: str) -> None:
        """A copy of the lake, at what the verb writes to with the damage of the scene's lake of
        that name."""
        place = self.verb.target.strip("{}")
        if place == "new":
            place = "lake"
        self.bucket.put(
            f"{prefix}/{place}",
            damage=damaged(self.scene.folder / "lake", self.scene.folder / place),
        )

    def _state(self, target: str) -> State:
        copied(target, self.scratch / "copy")
        return state(self.scratch / "copy", deletes=self.verb.deletes)

    def _reports(self) -> bool:
        """Whether doctor reports of the copied lake what the verb leaves if it is cut off."""
        copy = self.scratch / "copy"
        found = (
            doctor(Lake.open(copy), grace=NOW)
            if self.verb.unfinished and (copy / "lake.json").exists()
            else ()
        )
        return bool(self.verb.unfinished & {one.kind for one in found})

    def whole(self) -> tuple[State, State, int]:
        """The state before and after the verb without a fault, and how many requests it made."""

        def work() -> tuple[State, State, int, int]:
            target = self._target("whole")
            before = self._state(target)
            planned(self.proxy)
            code = invoked(self.given("whole"))
            count = planned(self.proxy)["count"]
            return before, self._state(target), count, code

        self._put("whole")
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
        self._put(prefix)

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
            return invoked(self.given(prefix))

        def second() -> dict[str, Any]:
            faults = planned(self.proxy)["faults"]
            target = self._target(prefix)
            middle = self._state(target)
            reported = self._reports()
            planned(self.proxy, share=FAULTY, lost=LOST, seed=1000 * number + call + 1)
            again = (
                self.verb.again if self.verb.again and middle != frozenset({("no lake",)}) else None
            )
            code = invoked(self.given(prefix, again))
            faults = Counter(faults) + Counter(planned(self.proxy)["faults"])
            end = self._state(target)
            seen = examine(target, self.scratch / "copy", remotely=number % 5 == 0)
            return {
                "faults": faults,
                "middle": middle,
                "reported": reported,
                "again": code,
                "end": end,
                **seen,
            }

        code, ended, said = Child(first, self.scratch / prefix / "first").ended()
        failed, found, told = Child(second, self.scratch / prefix / "second").ended()
        self.bucket.remove(prefix)
        shutil.rmtree(self.scratch / prefix, ignore_errors=True)
        if failed:
            return {
                "wrong": [f"the examination failed ({failed}): {told[-1500:]}"],
                "killed": code == _KILLED,
            }
        objects = {
            entry for entry in before | after if entry[0] == "object"
        }  # others are left by what was killed

        def own(seen: State) -> State:
            return frozenset(entry for entry in seen if entry[0] != "object" or entry in objects)

        middle, end = own(found["middle"]), own(found["end"])
        staying = before & after
        wrong = [
            f"lost: {sorted(staying - seen)[:3]}" for seen in (middle, end) if not staying <= seen
        ]
        if code == 0:
            wrong += _reported(ended, said, middle, before, after, one_step=self.verb.one_step)
        elif code != _KILLED:
            wrong.append(f"report: ended by {code}: {said[-800:]}")
        elif self.verb.one_step and middle not in (before, after):
            wrong.append(f"report: a part is published: {sorted(middle ^ before)[:4]}")
        if self.verb.unfinished and middle not in (before, after) and not found["reported"]:
            wrong.append("silent: it has begun what it has not done, and doctor reports nothing")
        if found["again"] and middle != after:
            wrong.append(f"repeat: exit code {found['again']}: {told[-800:]}")
        if end != after:
            wrong.append(f"repeat: ends otherwise: {sorted(end ^ after)[:4]} {told[-500:]}")
        wrong += [f"unhealthy: {error}" for error in found["errors"]] + [
            f"left: {one}" for one in found["left"]
        ]
        return {
            "wrong": wrong,
            "killed": code == _KILLED,
            "published": middle == after,
            "faults": found["faults"],
            "rows": len(staying) + (len(after - before) if code == 0 and not ended else 0),
            "collected": found["collected"],
        }


def _reported(
    code: int, said: str, middle: State, before: State, after: State, *, one_step: bool
) -> list[str]:
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
    return wrong + [
        f"report: {word}: {said[-1500:]}" for word in ("Traceback", "unforeseen") if word in said
    ]


def tried(trials: Trials, *, points: int) -> dict[str, Any]:
    """The trials of a verb, and what they found."""
    begun = time.monotonic()
    before, after, total = trials.whole()
    counts: Counter[str] = Counter()
    faults: Counter[str] = Counter()
    kinds: Counter[str] = Counter()
    examples: list[str] = []
    for number, call in enumerate(
        (total - 1) * point // max(points - 1, 1) for point in range(points)
    ):
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
    """Try verbs, those whose results are not known yet where none is named, and return all
    results."""
    known: dict[str, Any] = json.loads(results.read_text()) if results.exists() else {}
    for name, value in (
        *SECRETS.items(),
        ("AWS_REGION", "us-east-1"),
        ("FLAGDATA_CACHE", str(scratch / "cache")),
    ):
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
            code, scene, said = Child(
                partial(make, folder), scratch / "made", longest=MAKING
            ).ended()
            assert code == 0, said
            bucket = Bucket(store)
            code, cloned, said = Child(
                lambda folder=folder, group=group: invoked(
                    ["clone", str(folder / "lake"), f"s3://{BUCKET}/template-{group}"]
                ),
                scratch / "cloned",
            ).ended()
            assert (code, cloned) == (0, 0), said
            bucket.take(f"template-{group}")
            bucket.template[f"/mcap/{hashlib.sha256(_ORPHAN).hexdigest()}.mcap"] = _ORPHAN
            for path in (
                folder / "lake" / "mcap"
            ).iterdir():  # what was withdrawn, which a clone does not take
                bucket.template.setdefault(f"/mcap/{path.name}", path.read_bytes())
            for name in wanted:
                verb = verbs[name]
                if verb.stand_in is not None:
                    stand_in(verb.stand_in, scene.ids["kept"])
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
                print(  # noqa: T201
                    name,
                    {key: value for key, value in known[name].items() if key != "circumstances"},
                    flush=True,
                )
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
        "silent",
        "wrong reports",
        "repeats that fail",
        "unhealthy",
        "left after gc",
        "faults",
    )
    shown = {
        "lost": "lost",
        "silent": "silent",
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
        lines.append(
            f"| {name} | {' | '.join(map(str, cells))} | {found['circumstances']['code_version']} |"
        )
    faults: Counter[str] = Counter()
    for found in known.values():
        faults.update(found["faults"])
    lines += [
        "",
        "Faults: " + ", ".join(f"{name} {count}" for name, count in sorted(faults.items())) + ".",
    ]
    if known:
        where = next(iter(known.values()))["circumstances"]
        lines += [
            "",
            (
                f"{where['processor']}, {where['cores']} cores; Python {where['python']}; moto's "
                "server."
            ),
        ]
    return "\n".join([*lines, ""])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help="verbs; those without a result if none is named")
    parser.add_argument("--out", type=Path, required=True, help="JSON file of the results")
    parser.add_argument(
        "--points", type=int, default=POINTS, help="points at which each verb is killed"
    )
    given = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="buckets-") as place:
        campaign(given.names, given.out, points=given.points, scratch=Path(place))
