"""Servers of object storage on loopback: moto's, which keeps what it promises, and one that does
not."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from http.client import HTTPConnection
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Thread
from typing import ClassVar
from urllib.request import Request, urlopen

BUCKET = "bucket"
_SERVER = """
import functools, logging, threading
from moto.moto_server.werkzeug_app import DomainDispatcherApplication
from moto.server import ThreadedMotoServer
from werkzeug.serving import WSGIRequestHandler
# Whose host it is: else all folders of moto are listed twice for each request, half of the time that one takes.
whose = DomainDispatcherApplication.get_backend_for_host
DomainDispatcherApplication.get_backend_for_host = functools.cache(whose)
WSGIRequestHandler.disable_nagle_algorithm = True  # else each answer waits 40 ms for the client's acknowledgement
logging.getLogger("werkzeug").setLevel(logging.ERROR)
server = ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
server.start()
print("http://%s:%d" % server.get_host_and_port(), flush=True)
threading.Event().wait()
"""
_READ_ONLY = """
import sys, threading
from tests.s3 import ReadOnly, serving
ReadOnly.store = sys.argv[1]
with serving(ReadOnly) as address:
    print(address, flush=True)
    threading.Event().wait()
"""
SECRETS = {
    "AWS_ACCESS_KEY_ID": "AKIAEXAMPLEEXAMPLE01",
    "AWS_SECRET_ACCESS_KEY": "secret/of/nobody+0123456789",
    "AWS_SESSION_TOKEN": "token-of-nobody-0123456789",
}
"""Credentials that a server on loopback takes."""


@contextmanager
def moto() -> Iterator[str]:
    """The address of moto's server, with an empty bucket; in a process of its own, since the Delta
    library keeps Python's lock while it waits for an answer."""
    with process(_SERVER) as address:
        urlopen(Request(f"{address}/{BUCKET}", method="PUT")).close()
        yield address


@contextmanager
def read_only(store: str) -> Iterator[str]:
    """The address of a server that passes reads on to another one; in a process of its own, as
    moto's."""
    with process(_READ_ONLY, store.removeprefix("http://")) as address:
        yield address


@contextmanager
def process(program: str, *arguments: str) -> Iterator[str]:
    """The address that a server in a process of its own prints."""
    command = [sys.executable, "-c", program, *arguments]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, cwd=Path(__file__).parents[1]
    ) as process:
        assert process.stdout is not None
        try:
            yield process.stdout.readline().decode().strip()
        finally:
            process.kill()


class Careless(BaseHTTPRequestHandler):
    """A store that takes the conditions of puts and ignores them, as `rclone serve s3` does."""

    disable_nagle_algorithm = True

    objects: ClassVar[dict[str, bytes]] = {}

    def do_PUT(self) -> None:
        self.objects[self.path] = self.rfile.read(int(self.headers["Content-Length"]))
        self._answer(200, b"")

    def do_GET(self) -> None:
        if "list-type" in self.path:
            self._answer(
                200, b"<ListBucketResult><IsTruncated>false</IsTruncated></ListBucketResult>"
            )
        elif self.path in self.objects:
            self._answer(200, self.objects[self.path])
        else:
            self._answer(404, b"")

    do_HEAD = do_GET  # noqa: N815

    def do_POST(self) -> None:
        asked = self.rfile.read(int(self.headers["Content-Length"]))
        keys = re.findall(rb"<Key>.*?</Key>", asked)
        self._answer(
            200,
            b"<DeleteResult><Deleted>%s</Deleted></DeleteResult>"
            % b"</Deleted><Deleted>".join(keys),
        )

    def _answer(self, status: int, content: bytes) -> None:
        self.send_response(status)
        self.send_header("Content-Length", str(len(content)))
        self.send_header("Last-Modified", "Fri, 27 Nov 2026 10:00:00 GMT")
        self.send_header("ETag", '"1"')
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(content)

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002 — as the library names it
        pass


class Denying(Careless):
    """A store that refuses every request, and repeats in its answer what was sent to it."""

    def do_PUT(self) -> None:
        sent = self.headers.get("Authorization", "") + self.headers.get("x-amz-security-token", "")
        self._answer(
            403,
            f"<Error><Code>SignatureDoesNotMatch</Code><Message>The signature of {sent} does not "
            "match</Message>"
            f"<AWSAccessKeyId>{sent}</AWSAccessKeyId></Error>".encode(),
        )

    do_GET = do_HEAD = do_POST = do_PUT  # noqa: N815


class Passing(BaseHTTPRequestHandler):
    """Passes requests on to another store."""

    disable_nagle_algorithm = True

    store: ClassVar[str] = ""

    def do_GET(self) -> None:
        body = self.rfile.read(int(self.headers.get("Content-Length") or 0))
        connection = HTTPConnection(self.store, timeout=30)
        connection.request(self.command, self.path, body, headers=dict(self.headers))
        answer = connection.getresponse()
        content = answer.read()
        connection.close()
        self.send_response_only(answer.status)
        for name, value in answer.getheaders():
            if name.lower() not in ("connection", "transfer-encoding"):
                self.send_header(name, value)
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(content)

    do_HEAD = do_PUT = do_POST = do_DELETE = do_GET  # noqa: N815

    def refuse(self, status: int, code: str) -> None:
        """Answer without passing anything on."""
        self.rfile.read(int(self.headers.get("Content-Length") or 0))
        content = f"<Error><Code>{code}</Code><Message>{code}</Message></Error>".encode()
        self.send_response(status)
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(content)

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002 — as the library names it
        pass


class ReadOnly(Passing):
    """Refuses writes, as S3 does to keys that may only read; at /refused it says which."""

    refused: ClassVar[list[str]] = []

    def do_GET(self) -> None:
        if self.path != "/refused":
            super().do_GET()
            return
        said = "\n".join(self.refused).encode()
        self.send_response(200)
        self.send_header("Content-Length", str(len(said)))
        self.end_headers()
        self.wfile.write(said)

    def do_PUT(self) -> None:
        self.refused.append(f"{self.command} {self.path}")
        self.refuse(403, "AccessDenied")

    do_POST = do_DELETE = do_PUT  # noqa: N815


class Forbidding(Passing):
    """Forbids to list or to delete, as policies may."""

    forbidden: ClassVar[str] = ""

    def do_GET(self) -> None:
        deleting = self.command == "DELETE" or (self.command == "POST" and "delete" in self.path)
        if {"list": "list-type" in self.path, "delete": deleting}[self.forbidden]:
            self.refuse(403, "AccessDenied")
        else:
            super().do_GET()

    do_HEAD = do_PUT = do_POST = do_DELETE = do_GET  # noqa: N815


class Failing(Passing):
    """Fails at the parts of an upload, or where they are joined."""

    failing: ClassVar[str] = ""

    def do_PUT(self) -> None:
        mine = self.failing in self.path or (
            self.failing == "complete" and self.command == "POST" and "uploadId" in self.path
        )
        self.refuse(500, "InternalError") if mine else self.do_GET()

    do_POST = do_PUT  # noqa: N815


class Scripted(BaseHTTPRequestHandler):
    """A store that gives one answer to all requests; None closes the connection."""

    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True
    answer: ClassVar[tuple[int, dict[str, str], bytes] | None] = None
    asked: ClassVar[list[tuple[str, str]]] = []

    def do_GET(self) -> None:
        self.rfile.read(int(self.headers.get("Content-Length") or 0))
        self.asked.append((self.command, self.path))
        if self.answer is None:
            self.close_connection = True
            return
        status, headers, content = self.answer
        self.send_response_only(status)
        for name, value in headers.items():
            self.send_header(name, value)
        if "Date" not in headers:
            self.send_header("Date", self.date_time_string())
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(content)

    do_HEAD = do_PUT = do_POST = do_DELETE = do_GET  # noqa: N815

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002 — as the library names it
        pass


def refusing(
    status: int, code: str, message: str = "no", *, rest: str = ""
) -> tuple[int, dict[str, str], bytes]:
    """An answer of S3 that refuses a request."""
    text = f"<Error><Code>{code}</Code><Message>{message}</Message>{rest}</Error>"
    return status, {"Content-Type": "application/xml"}, text.encode()


class _Quiet(ThreadingHTTPServer):
    """Says nothing of clients that are gone."""

    def handle_error(self, request: object, client_address: object) -> None:
        if not isinstance(sys.exc_info()[1], ConnectionError):
            super().handle_error(request, client_address)  # type: ignore[arg-type]


@contextmanager
def serving(handler: type[BaseHTTPRequestHandler]) -> Iterator[str]:
    """The address of a server."""
    server = _Quiet(("127.0.0.1", 0), handler)
    Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_address[1]}"
    finally:
        server.shutdown()
        server.server_close()
