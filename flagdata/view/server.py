"""The socket of the page, and who may ask: this machine alone, by the whole address, and only to read.

The server listens on loopback. Its address has a part that is drawn anew at each start, without which no page is shown:
other users of the machine, and pages of others in the user's browser, do not know it. The header Host must be the
server's own, so that a name on the web that leads here is refused. Answers forbid the browser everything that does not
come from this server.
"""

from __future__ import annotations

import secrets
from email.message import Message
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import cast

from flagdata.errors import NotFoundError, RefusedError, UsageError
from flagdata.lake import Lake
from flagdata.view.media import Media
from flagdata.view.pages import Site
from flagdata.view.routes import Answer, answer, refusal

HOST = "127.0.0.1"
_PATIENCE = 30.0  # s, for a request to arrive
_POLICY = (
    "default-src 'none'; img-src 'self'; style-src 'self'; script-src 'self'; connect-src 'self'; form-action 'self'; "
    "base-uri 'none'; frame-ancestors 'none'"
)
HEADERS = {
    "Content-Security-Policy": _POLICY,
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cache-Control": "no-store",
}
"""Sent with each answer; nothing is kept, since what is erased from the lake must not stay in a browser."""


class Server(ThreadingHTTPServer):
    """Serves the page of a lake.

    Args:
        lake: that is shown.
        port: on loopback; 0 takes a free one.

    Raises:
        OSError: the port is taken.
    """

    daemon_threads = True

    def __init__(self, lake: Lake, *, port: int = 0) -> None:
        super().__init__((HOST, port), _Asked)
        self.site = Site(lake=lake, media=Media(lake), base=f"/{secrets.token_urlsafe(12)}/")

    @property
    def hosts(self) -> frozenset[str]:
        """What the header Host may be."""
        return frozenset(f"{name}:{self.server_address[1]}" for name in (HOST, "localhost"))

    @property
    def address(self) -> str:
        """Of the overview."""
        return f"http://{HOST}:{self.server_address[1]}{self.site.base}"


def respond(server: Server, method: str, target: str, headers: Message) -> Answer:
    """The answer to a request, or the refusal of one that may not be made.

    Args:
        target: path and query of the address.
    """
    if set(headers.get_all("Host", [""])) - server.hosts:
        error = RefusedError("this server is asked for by another name", fix=f"open it at {HOST}")
        return refusal(_nowhere(server), error, HTTPStatus.FORBIDDEN)
    if headers.get("Sec-Fetch-Site", "none") not in ("none", "same-origin"):
        error = RefusedError("another page led here", fix="open the address that flagdata view printed")
        return refusal(_nowhere(server), error, HTTPStatus.FORBIDDEN)
    if not secrets.compare_digest(target[: len(server.site.base)].encode(), server.site.base.encode()):
        error = NotFoundError("nothing is here", fix="open the whole address that flagdata view printed")
        return refusal(_nowhere(server), error)
    if method not in ("GET", "HEAD"):
        error = UsageError("the page of a lake can only be read", fix="change the lake by flagdata's commands")
        return refusal(server.site, error, HTTPStatus.METHOD_NOT_ALLOWED)
    return answer(server.site, target)


def _nowhere(server: Server) -> Site:
    """The site without its address, for those who do not know it."""
    return Site(lake=server.site.lake, media=server.site.media, base="/")


class _Asked(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "flagdata", ""
    timeout = _PATIENCE

    def do_GET(self) -> None:
        found = respond(cast(Server, self.server), self.command, self.path, self.headers)
        self.send_response(found.status)
        self.send_header("Content-Type", found.media_type)
        self.send_header("Content-Length", str(len(found.content)))
        for name, value in HEADERS.items():
            self.send_header(name, value)
        if found.status is HTTPStatus.METHOD_NOT_ALLOWED:
            self.send_header("Allow", "GET, HEAD")
        if self.command not in ("GET", "HEAD"):  # what it carries is not read
            self.send_header("Connection", "close")
            self.close_connection = True
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(found.content)

    do_HEAD = do_POST = do_PUT = do_DELETE = do_PATCH = do_OPTIONS = do_GET  # noqa: N815

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002 — as the library names it
        """Nothing: the terminal is the user's, and addresses hold the key."""
