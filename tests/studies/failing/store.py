"""A store that fails on purpose: a proxy before moto's server, in a process of its own.

`python -m tests.studies.failing.store ADDRESS` prints its address. A share of the requests meets a
fault, all answers are a little slow, and the process that a control request names is killed
(SIGKILL, with all that it started) at its nth request, before the store has it or after the store
has done it.
"""

from __future__ import annotations

import json
import os
import random
import signal
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from http.client import HTTPConnection
from http.server import BaseHTTPRequestHandler
from typing import Any
from urllib.request import Request, urlopen

from tests.s3 import process, serving

CONTROL = "/-/"
FAULTY = 0.05
"""Share of the requests that meet a fault."""
SLOW = 0.005
"""Seconds by which each answer is late."""
HELD = 2.0
"""Seconds for which an answer is held that comes too late."""
PATIENCE = 1.5
"""Seconds after which a request counts as failed, in place of the 30 s of the program."""
FAULTS = (
    "500",
    "503",
    "503",
    "cut before",
    "cut before",
    "lost answer",
    "lost answer",
    "cut body",
    "slow",
    "too late",
)
_OWN = ("content-length", "connection", "transfer-encoding")
LOST = 0.2
"""Share of the conditional puts whose answer is lost."""


@dataclass
class Plan:
    """What happens to requests from now on.

    Attributes:
        kill: number of the request, from 0, at which `group` is killed; −1 for none.
        answered: whether the store has done the request by then.
        share: of the requests that meets a fault.
        lost: share of the conditional puts whose answer is lost.
    """

    kill: int = -1
    answered: bool = False
    group: int = 0
    share: float = 0.0
    lost: float = 0.0
    seed: int = 0
    count: int = 0
    faults: Counter[str] = field(default_factory=Counter)


class Store:
    """What all requests share."""

    address = ""
    plan = Plan()
    draws = random.Random(0)
    guard = threading.Lock()

    @classmethod
    def drawn(cls, *, conditional: bool) -> tuple[int, str]:
        """The number of a request, and the fault that it meets."""
        with cls.guard:
            plan = cls.plan
            number, plan.count = plan.count, plan.count + 1
            lost = conditional and cls.draws.random() < plan.lost
            fault = (
                "lost answer"
                if lost
                else cls.draws.choice(FAULTS)
                if cls.draws.random() < plan.share
                else ""
            )
            if fault:
                plan.faults[f"{fault} of a conditional put" if lost else fault] += 1
            return number, fault


class Proxy(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True

    def do_GET(self) -> None:
        body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
        if self.path.startswith(CONTROL):
            self._control(body)
            return
        conditional = any(name in self.headers for name in ("If-None-Match", "If-Match"))
        number, fault = Store.drawn(conditional=conditional)
        plan = Store.plan
        if number == plan.kill and not plan.answered:
            self._end(plan)
            return
        if fault in ("500", "503"):
            self._answer(
                int(fault),
                {},
                b"<Error><Code>InternalError</Code><Message>failed</Message></Error>",
            )
            return
        if fault == "cut before":
            self.close_connection = True
            return
        status, headers, content = self._passed(body)
        if number == plan.kill:
            self._end(plan)
            return
        time.sleep({"too late": HELD, "slow": 0.5}.get(fault, SLOW))
        if fault == "lost answer":
            self.close_connection = True
            return
        with suppress(BrokenPipeError, ConnectionResetError):
            self._answer(status, headers, content, cut=fault == "cut body")

    do_HEAD = do_PUT = do_POST = do_DELETE = do_GET  # noqa: N815

    def _passed(self, body: bytes) -> tuple[int, dict[str, str], bytes]:
        connection = HTTPConnection(Store.address, timeout=60)
        connection.request(self.command, self.path, body, dict(self.headers))
        answer = connection.getresponse()
        content = answer.read()
        connection.close()
        return answer.status, dict(answer.getheaders()), content

    def _answer(
        self, status: int, headers: dict[str, str], content: bytes, *, cut: bool = False
    ) -> None:
        self.send_response_only(status)
        for name, value in headers.items():
            if name.lower() not in _OWN:
                self.send_header(name, value)
        head = self.command == "HEAD"
        self.send_header(
            "Content-Length", headers.get("Content-Length", "0") if head else str(len(content))
        )
        self.end_headers()
        if not head:
            self.wfile.write(content[: len(content) // 2] if cut else content)
        self.close_connection |= cut

    def _end(self, plan: Plan) -> None:
        plan.faults["killed"] += 1
        with suppress(ProcessLookupError):
            os.killpg(plan.group, signal.SIGKILL)
        self.close_connection = True

    def _control(self, body: bytes) -> None:
        before = Store.plan
        if self.command == "POST":
            Store.plan = Plan(**json.loads(body))
            Store.draws = random.Random(Store.plan.seed)
        said = json.dumps({"count": before.count, "faults": before.faults}).encode()
        self._answer(200, {}, said)

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002 — as the library names it
        pass


def planned(proxy: str, **plan: Any) -> dict[str, Any]:
    """Set what happens from now on; what has happened since this was done last."""
    with urlopen(
        Request(f"{proxy}{CONTROL}", data=json.dumps(plan).encode(), method="POST")
    ) as answer:
        return json.load(answer)


@contextmanager
def failing(store: str) -> Iterator[str]:
    """The address of a proxy before a store."""
    with process(
        "from tests.studies.failing.store import run; run()", store.removeprefix("http://")
    ) as address:
        yield address


def run() -> None:
    """Serve until the process is ended."""
    Store.address = sys.argv[1]
    with serving(Proxy) as address:
        sys.stdout.write(f"{address}\n")
        sys.stdout.flush()
        threading.Event().wait()
