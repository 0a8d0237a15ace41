"""The socket of the page, and who may ask: this machine alone, by the whole address, and only to
read.

The server listens on loopback. Its address has a part that is drawn anew at each start, without
which no page is shown: other users of the machine, and pages of others in the user's browser, do
not know it. The header Host must be the server's own, so that a name on the web that leads here is
refused. Answers forbid the browser everything that does not come from this server.

From an address to an answer, without a socket: which pages there are, and what an error looks like.

No part of an address becomes a path: artifacts are named by their ids, versions by refs that the
lake looks up.
"""

from __future__ import annotations

import json
import re
import secrets
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from email.message import Message
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, cast
from urllib.parse import parse_qs, urlsplit

from flagdata.core.console import foreseen
from flagdata.errors import (
    ConflictError,
    FlagdataError,
    InputError,
    LimitError,
    NotFoundError,
    RefusedError,
    TimeError,
    UsageError,
)
from flagdata.lake import Lake
from flagdata.view import pages
from flagdata.view.media import Media
from flagdata.view.pages import Site

_FIELDS = 8
_STATUS: tuple[tuple[type[FlagdataError], HTTPStatus], ...] = (
    (NotFoundError, HTTPStatus.NOT_FOUND),
    (UsageError, HTTPStatus.BAD_REQUEST),
    (LimitError, HTTPStatus.BAD_REQUEST),
    (TimeError, HTTPStatus.BAD_REQUEST),
    (InputError, HTTPStatus.BAD_REQUEST),
    (ConflictError, HTTPStatus.CONFLICT),
)


@dataclass(frozen=True, kw_only=True)
class ServerAnswer:
    """What goes back: status, media type and bytes."""

    status: HTTPStatus
    media_type: str
    content: bytes


Route = Callable[[Site, tuple[str, ...], Mapping[str, str]], ServerAnswer]
"""Answers a request: the site at its version, the parts of the path in brackets, the fields of the
query."""


def answer(site: Site, target: str) -> ServerAnswer:
    """Answers a request for an address.

    Args:
        site: at the head of main.
        target: path and query of the address.
    """
    try:
        site, function, groups, fields = _route_of(site, target)
        return function(site, groups, fields)
    except Exception as error:  # noqa: BLE001  every error is a page
        return refusal(site, foreseen(error))


def refusal(site: Site, error: FlagdataError, status: HTTPStatus | None = None) -> ServerAnswer:
    """Renders the page of an error.

    Args:
        status: by the kind of the error if `None`.
    """
    if status is None:
        kinds = (answer_status for kind, answer_status in _STATUS if isinstance(error, kind))
        status = next(kinds, HTTPStatus.INTERNAL_SERVER_ERROR)
    return _html(pages.problem(replace(site, at=None), error, status), status)


def _route_of(site: Site, target: str) -> tuple[Site, Route, tuple[str, ...], Mapping[str, str]]:
    try:
        address = urlsplit(target)
        query = parse_qs(address.query, max_num_fields=_FIELDS, errors="strict")
    except ValueError:
        raise UsageError("an address that cannot be read", fix="go back to the overview") from None
    if not address.path.startswith(site.base):
        raise NotFoundError(
            "nothing is here", fix="open the whole address that flagdata view printed"
        )
    path = address.path.removeprefix(site.base)
    fields = {name: values[-1] for name, values in query.items()}
    for pattern, function in _ROUTES.items():
        if match := re.fullmatch(pattern, path, flags=re.ASCII):
            return replace(site, at=fields.get("at")), function, match.groups(), fields
    raise NotFoundError("there is no such page", fix="go back to the overview")


def _overview(site: Site, groups: tuple[str, ...], fields: Mapping[str, str]) -> ServerAnswer:
    page = fields.get("page", "0")
    if not re.fullmatch("[0-9]{1,9}", page, flags=re.ASCII):
        raise UsageError(f"{page!r} is no number of a page", fix="go back to the overview")
    return _html(
        pages.overview(site, kind=fields.get("kind"), name=fields.get("name"), page=int(page))
    )


def _query(site: Site, groups: tuple[str, ...], fields: Mapping[str, str]) -> ServerAnswer:
    text, error = pages.sql(site, fields.get("sql"))
    return _html(text, HTTPStatus.OK if error is None else HTTPStatus.BAD_REQUEST)


def _artifact(site: Site, groups: tuple[str, ...], fields: Mapping[str, str]) -> ServerAnswer:
    return _html(pages.artifact(site, groups[0]))


def _thumbnail(site: Site, groups: tuple[str, ...], fields: Mapping[str, str]) -> ServerAnswer:
    return ServerAnswer(
        status=HTTPStatus.OK,
        media_type="image/jpeg",
        content=site.media.thumbnail(site.row(groups[0])),
    )


def _frames(site: Site, groups: tuple[str, ...], fields: Mapping[str, str]) -> ServerAnswer:
    content = site.media.frames(site.row(groups[0]), int(groups[1]))
    return ServerAnswer(
        status=HTTPStatus.OK, media_type="application/octet-stream", content=content
    )


def _series(site: Site, groups: tuple[str, ...], fields: Mapping[str, str]) -> ServerAnswer:
    return _json(site.media.series(site.row(groups[0])))


def _evidence(site: Site, groups: tuple[str, ...], fields: Mapping[str, str]) -> ServerAnswer:
    return _json(site.media.evidence(site.row(groups[0])))


def _style(site: Site, groups: tuple[str, ...], fields: Mapping[str, str]) -> ServerAnswer:
    return ServerAnswer(
        status=HTTPStatus.OK, media_type="text/css; charset=utf-8", content=pages.style()
    )


def _script(site: Site, groups: tuple[str, ...], fields: Mapping[str, str]) -> ServerAnswer:
    return ServerAnswer(
        status=HTTPStatus.OK, media_type="text/javascript; charset=utf-8", content=pages.script()
    )


def _icon(site: Site, groups: tuple[str, ...], fields: Mapping[str, str]) -> ServerAnswer:
    return ServerAnswer(status=HTTPStatus.OK, media_type="image/svg+xml", content=pages.ICON)


def _html(text: str, status: HTTPStatus = HTTPStatus.OK) -> ServerAnswer:
    return ServerAnswer(
        status=status,
        media_type="text/html; charset=utf-8",
        content=text.encode(errors="backslashreplace"),
    )


def _json(content: Mapping[str, Any]) -> ServerAnswer:
    text = json.dumps(content, allow_nan=False, ensure_ascii=False)
    return ServerAnswer(status=HTTPStatus.OK, media_type="application/json", content=text.encode())


_ARTIFACT_ID = "([0-9a-f]{32})"
_ROUTES: dict[str, Route] = {
    "": _overview,
    "query": _query,
    "style.css": _style,
    "script.js": _script,
    "icon.svg": _icon,
    f"artifact/{_ARTIFACT_ID}": _artifact,
    f"thumbnail/{_ARTIFACT_ID}": _thumbnail,
    f"frames/{_ARTIFACT_ID}/([0-9]{{1,9}})": _frames,
    f"series/{_ARTIFACT_ID}": _series,
    f"evidence/{_ARTIFACT_ID}": _evidence,
}
"""Pattern of an address behind the base → what answers it."""


HOST = "127.0.0.1"
_PATIENCE = 30.0  # s, for a request to arrive
_POLICY = (
    "default-src 'none'; img-src 'self'; style-src 'self'; script-src 'self'; connect-src 'self'; "
    "form-action 'self'; "
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
"""Sent with each answer; nothing is kept, since what is erased from the lake must not stay in a
browser."""


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


def respond(server: Server, method: str, target: str, headers: Message) -> ServerAnswer:
    """Answers a request, or refuses one that may not be made.

    Args:
        target: path and query of the address.
    """
    if set(headers.get_all("Host", [""])) - server.hosts:
        error = RefusedError("this server is asked for by another name", fix=f"open it at {HOST}")
        return refusal(_nowhere(server), error, HTTPStatus.FORBIDDEN)
    if headers.get("Sec-Fetch-Site", "none") not in ("none", "same-origin"):
        error = RefusedError(
            "another page led here", fix="open the address that flagdata view printed"
        )
        return refusal(_nowhere(server), error, HTTPStatus.FORBIDDEN)
    if not secrets.compare_digest(
        target[: len(server.site.base)].encode(), server.site.base.encode()
    ):
        error = NotFoundError(
            "nothing is here", fix="open the whole address that flagdata view printed"
        )
        return refusal(_nowhere(server), error)
    if method not in ("GET", "HEAD"):
        error = UsageError(
            "the page of a lake can only be read", fix="change the lake by flagdata's commands"
        )
        return refusal(server.site, error, HTTPStatus.METHOD_NOT_ALLOWED)
    return answer(server.site, target)


def _nowhere(server: Server) -> Site:
    """Returns the site without its address, for those who do not know it."""
    return Site(lake=server.site.lake, media=server.site.media, base="/")


class _Asked(BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"
    server_version, sys_version = "flagdata", ""
    timeout = _PATIENCE

    def do_GET(self) -> None:
        answer = respond(cast(Server, self.server), self.command, self.path, self.headers)
        self.send_response(answer.status)
        self.send_header("Content-Type", answer.media_type)
        self.send_header("Content-Length", str(len(answer.content)))
        for name, value in HEADERS.items():
            self.send_header(name, value)
        if answer.status is HTTPStatus.METHOD_NOT_ALLOWED:
            self.send_header("Allow", "GET, HEAD")
        if self.command not in ("GET", "HEAD"):  # what it carries is not read
            self.send_header("Connection", "close")
            self.close_connection = True
        self.end_headers()
        if self.command != "HEAD":
            self.wfile.write(answer.content)

    do_HEAD = do_POST = do_PUT = do_DELETE = do_PATCH = do_OPTIONS = do_GET  # noqa: N815

    def log_message(self, format: str, *args: object) -> None:  # noqa: A002 — the library's
        """Logs nothing: the terminal is the user's, and addresses hold the key."""
