"""Who may ask the server, and for what: this machine, by the whole address, to read."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from http.client import HTTPConnection, HTTPResponse
from urllib.request import urlopen

import pytest

from flagdata.lake import Lake
from flagdata.view import Server
from flagdata.view.server import HEADERS


@pytest.fixture
def server(lake: Lake) -> Iterator[Server]:
    with Server(lake) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield server
        server.shutdown()


def ask(
    server: Server, path: str, *, method: str = "GET", **headers: str
) -> tuple[HTTPResponse, bytes]:
    """The answer to a request with these headers, underscores as dashes."""
    connection = HTTPConnection("127.0.0.1", server.server_address[1], timeout=300)
    connection.putrequest(method, path, skip_host="Host" in headers)
    for name, value in headers.items():
        connection.putheader(name.replace("_", "-"), value)
    connection.endheaders()
    found = connection.getresponse()
    content = found.read()
    connection.close()
    return found, content


def test_it_listens_on_loopback_and_each_start_has_another_address(
    server: Server, lake: Lake
) -> None:
    assert server.server_address[0] == "127.0.0.1"
    with Server(lake) as other:
        assert other.site.base != server.site.base
    with urlopen(server.address) as found:
        assert found.status == 200
        assert b"No artifacts" in found.read()


def test_every_answer_forbids_what_is_not_of_this_server_and_is_not_kept(server: Server) -> None:
    for path in (
        server.site.base,
        f"{server.site.base}script.js",
        f"{server.site.base}nothing",
        "/",
    ):
        found, _ = ask(server, path)
        assert {name: found.headers[name] for name in HEADERS} == HEADERS
    assert "default-src 'none'" in HEADERS["Content-Security-Policy"]


@pytest.mark.parametrize(
    "host", ["evil.example", "evil.example:80", "127.0.0.1", "127.0.0.1.evil.example:1"]
)
def test_a_request_by_another_name_is_refused(server: Server, host: str) -> None:
    found, content = ask(server, server.site.base, Host=host)
    assert found.status == 403
    assert b"by another name" in content
    assert server.site.base.encode() not in content


def test_without_the_key_nothing_is_shown(server: Server) -> None:
    for path in ("/", "/query", f"/{'x' * 16}/", server.site.base[:-2], "/%2e%2e/"):
        found, content = ask(server, path)
        assert found.status == 404
        assert server.site.base.encode() not in content


def test_a_request_from_another_page_is_refused(server: Server) -> None:
    for origin in ("cross-site", "same-site"):
        assert ask(server, server.site.base, Sec_Fetch_Site=origin)[0].status == 403
    assert ask(server, server.site.base, Sec_Fetch_Site="same-origin")[0].status == 200


def test_it_can_only_be_read(server: Server) -> None:
    for method in ("POST", "PUT", "DELETE", "PATCH", "OPTIONS"):
        found, _ = ask(server, server.site.base, method=method)
        assert (found.status, found.headers["Allow"]) == (405, "GET, HEAD")
    found, content = ask(server, server.site.base, method="HEAD")
    assert (found.status, content) == (200, b"")
    assert int(found.headers["Content-Length"]) > 100


def test_the_command_prints_the_address_and_ends_by_an_interrupt(lake: Lake) -> None:
    command = [sys.executable, "-m", "flagdata", "view", "--lake", str(lake.path)]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None
        with urlopen(process.stdout.readline().strip()) as found:
            assert found.status == 200
        os.kill(process.pid, signal.SIGINT)
        assert process.wait(300) == 0
