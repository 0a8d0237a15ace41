"""A lake in a bucket under kills and faults: what was acknowledged is there, nothing dangles, no
answer is wrong.

Kills: in each trial two processes commit at once; one is ended by SIGKILL at its nth request to the
store, before it was sent or after it was answered, n in turn over all requests that a commit makes.
Then all that any process had acknowledged is looked for, and the lake examined.

Faults: three processes commit through a proxy that answers a share of the requests by an error,
closes the connection before or after the store has acted, or waits. rclone's server, which ignores
conditions, is refused: FLAGDATA_RCLONE names the program, or `make rclone` installs it.
"""

from __future__ import annotations

import hashlib
import json
import os
import random
import shutil
import signal
import subprocess
import time
import traceback
import uuid
from collections import Counter
from collections.abc import Callable, Iterable
from datetime import timedelta
from functools import partial
from http.client import HTTPConnection
from http.server import BaseHTTPRequestHandler
from pathlib import Path
from typing import Any, ClassVar

from flagdata.core.files.object_ranges import ObjectRanges
from flagdata.core.findings import Severity
from flagdata.core.provenance import code_version
from flagdata.core.schema import Kind
from flagdata.errors import RefusedError
from flagdata.lake import Artifact, Lake, collect, doctor, object_names, verify
from flagdata.storage import RemotePath
from tests.s3 import BUCKET, SECRETS, moto, serving

KILLS = 208
_GROUP = 26
_CALLS = 26  # requests of this package in a transaction of one record, at least
_FAULTY = 0.05
_COMMITS = 8  # of each process beside faults
_RANGES = 60  # read beside faults
_RCLONE = Path(__file__).resolve().parents[3] / ".venv-rclone" / "bin" / "rclone"
Say = Callable[[object], None]


def _write(pipe: int, said: object) -> None:
    os.write(pipe, json.dumps(said).encode() + b"\n")


class Child:
    """A forked process that uses the store, which its parent must not; what it says is read from a
    pipe."""

    def __init__(self, work: Callable[[Say], None]) -> None:
        self._reading, writing = os.pipe()
        self.pid = os.fork()
        if self.pid == 0:
            try:
                work(partial(_write, writing))
            except BaseException:  # noqa: BLE001 — the process ends here whatever happened
                _write(writing, {"raised": traceback.format_exc()})
            finally:
                os._exit(0)
        os.close(writing)

    def said(self) -> list[Any]:
        """All that it has said, once it has ended."""
        with os.fdopen(self._reading) as stream:
            lines = stream.read().splitlines()
        os.waitpid(self.pid, 0)
        said = [json.loads(line) for line in lines]
        raised = [line["raised"] for line in said if isinstance(line, dict) and "raised" in line]
        if raised:
            raise AssertionError(raised[0])
        return said


def commit(lake: Lake, text: str) -> str:
    """Commit a record or a folder of this text; its artifact's id."""
    with lake.transaction(f"ingest {text}") as transaction:
        path = transaction.staging(".zarr" if text.endswith("1") else ".mcap")
        if path.suffix == ".zarr":
            path.mkdir()
            (path / "zarr.json").write_text("{}")
            (path / "c").write_text(text)
        else:
            path.write_text(text)
        name = transaction.put(path)
        artifact = Artifact(
            kind=Kind.WIND, name=text, object=name, source_hash=name.partition("/")[2]
        )
        transaction.add(artifact)
    return artifact.id


def kill_at(call: int, *, answered: bool) -> None:
    """End this process at its nth request to the store."""
    asked, count = RemotePath._ask, [0]

    def counting(self: RemotePath, request: Any) -> Any:
        count[0] += 1
        mine = count[0] == call
        if mine and not answered:
            os.kill(os.getpid(), signal.SIGKILL)
        answer = asked(self, request)
        if mine:
            os.kill(os.getpid(), signal.SIGKILL)
        return answer

    RemotePath._ask = counting  # type: ignore[method-assign]


def examine(address: str, say: Say) -> None:
    lake = Lake.open(address)
    collect(lake, grace=timedelta(0))
    findings = [*doctor(lake, grace=timedelta(0)), *verify(lake, object_names(lake))]
    say(
        {
            "rows": lake.rows()["artifact"].to_pylist(),
            "errors": [f"{f.kind}: {f.what}" for f in findings if f.severity is not Severity.NOTE],
        }
    )


def killed(group: int) -> dict[str, int]:
    """Trials of the kills with a lake of their own, of which there are `KILLS // _GROUP`."""
    address = f"s3://{BUCKET}/kills-{group}"
    Child(lambda say: Lake.create(address) and None).said()
    acknowledged: set[str] = set()
    died = survivors = 0
    for trial in range(group * _GROUP, (group + 1) * _GROUP):
        call, answered = 1 + trial // 2 % _CALLS, trial % 2 == 1

        def victim(
            say: Say, trial: int = trial, call: int = call, answered: bool = answered
        ) -> None:
            lake = Lake.open(address)
            kill_at(call, answered=answered)
            say(commit(lake, f"victim {trial}"))

        def other(say: Say, trial: int = trial) -> None:
            say(commit(Lake.open(address), f"other {trial}"))

        first, second = Child(victim), Child(other)
        ended, beside = first.said(), second.said()
        died += not ended
        survivors += len(beside)
        acknowledged.update(ended, beside)
    (found,) = Child(lambda say: examine(address, say)).said()
    assert len(set(found["rows"])) == len(found["rows"])
    result = {
        "trials": _GROUP,
        "killed": died,
        "beside, ended": survivors,
        "acknowledged": len(acknowledged),
        "acknowledged and lost": len(acknowledged - set(found["rows"])),
        "findings of doctor and verify": len(found["errors"]),
    }
    print(group, result, found["errors"], flush=True)  # noqa: T201 — it takes long
    return result


def resumed(file: Path, trials: Callable[[int], dict[str, int]] = killed) -> list[dict[str, int]]:
    """What each group of trials counted; groups that an earlier run of the same code ended are read
    from `file`."""
    version = code_version()
    known: dict[str, Any] = json.loads(file.read_text()) if file.exists() else {}
    done: list[dict[str, int]] = known["groups"] if known.get("code_version") == version else []
    for group in range(len(done), KILLS // _GROUP):
        done.append(trials(group))
        file.write_text(json.dumps({"code_version": version, "groups": done}))
    file.unlink()
    return done


def total(groups: Iterable[dict[str, int]]) -> dict[str, int]:
    """The sums of what `killed` counted."""
    found: Counter[str] = Counter()
    for group in groups:
        found.update(group)
    return dict(found)


class Faulty(BaseHTTPRequestHandler):
    """Passes requests on to a store; a share of them meets a fault."""

    store: ClassVar[str] = ""
    faults: ClassVar[dict[str, int]] = {}
    draws: ClassVar[random.Random] = random.Random(1)
    protocol_version = "HTTP/1.1"

    def _pass(self) -> None:
        body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
        fault = (
            self.draws.choice(("error", "cut before", "cut after", "slow"))
            if self.draws.random() < _FAULTY
            else ""
        )
        if fault:
            self.faults[fault] = self.faults.get(fault, 0) + 1
        if fault == "cut before":
            self.close_connection = True
            return
        if fault == "error":
            self._answer(503, {}, b"")
            return
        if fault == "slow":
            time.sleep(2.0)
        connection = HTTPConnection(self.store, timeout=60)
        connection.request(self.command, self.path, body, dict(self.headers))
        answer = connection.getresponse()
        content = answer.read()
        connection.close()
        if fault == "cut after":
            self.close_connection = True
            return
        self._answer(answer.status, dict(answer.getheaders()), content)

    do_GET = do_PUT = do_POST = do_HEAD = do_DELETE = _pass  # noqa: N815

    def _answer(self, status: int, headers: dict[str, str], content: bytes) -> None:
        self.send_response_only(status)
        for name, value in headers.items():
            if name.lower() not in ("content-length", "connection", "transfer-encoding"):
                self.send_header(name, value)
        length = headers.get("Content-Length", "0") if self.command == "HEAD" else str(len(content))
        self.send_header("Content-Length", length)
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(content)

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002 — as the library names it
        pass


def beside_faults(store: str, prefix: str) -> dict[str, Any]:
    """Commits, reads and a collection through the proxy."""
    Faulty.store = store.removeprefix("http://")
    with serving(Faulty) as proxy:
        os.environ["AWS_ENDPOINT_URL"] = proxy
        Child(lambda say: Lake.create(prefix) and None).said()
        writers = [Child(lambda say, w=w: _commits(prefix, w, say)) for w in range(3)]
        said = [line for writer in writers for line in writer.said()]
        (ranges,) = Child(lambda say: _ranges(prefix, say)).said()
        (found,) = Child(lambda say: examine(prefix, say)).said()
        wrong = [line for line in said if line["text"] != line["read"]]
        os.environ["AWS_ENDPOINT_URL"] = store
    acknowledged = {line["id"] for line in said}
    return {
        "share of requests": _FAULTY,
        "faults": dict(Faulty.faults),
        "acknowledged": len(acknowledged),
        "acknowledged and lost": len(acknowledged - set(found["rows"])),
        "rows": len(found["rows"]),
        "objects read wrongly": len(wrong),
        "ranges read": _RANGES,
        "ranges read wrongly": ranges,
        "findings of doctor and verify": found["errors"],
    }


def _ranges(address: str, say: Say) -> None:
    """Says how many ranges of a large object are not what was put."""
    draws = random.Random(2)
    data = draws.randbytes(6 << 20)
    place = RemotePath.parse(f"{address}/mcap/{hashlib.sha256(data).hexdigest()}.mcap")
    place.write_bytes(data)
    wrong = 0
    for _ in range(_RANGES):
        first, length = draws.randrange(len(data)), draws.randrange(1, 1 << 20)
        wrong += ObjectRanges(place).read(length, first) != data[first : first + length]
    place.unlink()
    say(wrong)


def _commits(address: str, writer: int, say: Say) -> None:
    lake = Lake.open(address)
    for number in range(_COMMITS):
        text = f"writer {writer} number {number}"
        identity = commit(lake, text)
        path = lake.object_path(str(lake.artifact(identity).object))
        read = (path / "c" if path.is_dir() else path).read_text()
        say({"id": identity, "text": text, "read": read})


def refused(program: str) -> bool:
    """Whether a lake on rclone's server is refused."""

    def attempt(say: Say) -> None:
        try:
            Lake.create(f"s3://{BUCKET}/lake")
        except RefusedError:
            say(True)

    folder = Path(os.environ["FLAGDATA_CACHE"]) / "rclone"
    (folder / BUCKET).mkdir(parents=True)
    command = [
        program,
        "serve",
        "s3",
        str(folder),
        "--addr",
        "127.0.0.1:8093",
        "--auth-key",
        f"{SECRETS['AWS_ACCESS_KEY_ID']},{SECRETS['AWS_SECRET_ACCESS_KEY']}",
    ]
    with subprocess.Popen(command) as server:
        time.sleep(3)
        os.environ["AWS_ENDPOINT_URL"] = "http://127.0.0.1:8093"
        os.environ.pop("AWS_SESSION_TOKEN")
        try:
            return Child(attempt).said() == [True]
        finally:
            server.kill()


def run(*, seed: int, out: Path) -> dict[str, Any]:
    """Kills, faults, and a store that ignores conditions."""
    code_version()  # asks git, once for all
    Faulty.draws = random.Random(seed)
    for name in [name for name in os.environ if name.startswith("AWS_")]:
        del os.environ[name]
    cache = out / f"cache-{uuid.uuid4().hex}"
    os.environ.update(SECRETS, AWS_REGION="us-east-1", FLAGDATA_CACHE=str(cache))
    results: dict[str, Any] = {"server": "moto, on loopback"}
    with moto() as address:
        os.environ["AWS_ENDPOINT_URL"] = address
        results["faults"] = beside_faults(address, f"s3://{BUCKET}/faults")
        results["kills"] = total(resumed(out / "object-storage-groups.json"))
    rclone = os.environ.get("FLAGDATA_RCLONE", str(_RCLONE))
    results["rclone refused"] = (
        refused(rclone) if Path(rclone).is_file() else "left out: there is no rclone"
    )
    shutil.rmtree(cache, ignore_errors=True)
    return results
