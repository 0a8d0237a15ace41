"""Requests that the client library does not make: signed by version 4 of Amazon's process, over the
standard library.

They list and abort uploads in parts, ask for the store's time, and find out why the client was
refused: the client's errors of requests without a body state neither code nor headers.
"""

from __future__ import annotations

import hashlib
import hmac
import os
import re
import socket
import ssl
import time
import urllib.request
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from email.utils import parsedate_to_datetime
from http.client import HTTPException, HTTPMessage
from typing import IO, Any
from urllib.error import HTTPError, URLError
from urllib.parse import quote, urlencode, urlsplit

from flagdata.storage.connection import CONNECT_TIMEOUT, redact_credentials, settings

_WAITS = (0.1, 0.3, 1.0, 2.0, 4.0)
"""Seconds before a request is sent again that the store, or the way to it, let fail."""
SHORTLY = _WAITS[:3]
"""The same where a user waits to hear why something failed."""
_PASSING = (408, 429, 500, 502, 503, 504)
_NOTHING = hashlib.sha256(b"").hexdigest()
_CODE = re.compile(rb"<Code>([\w.]+)</Code>")
_VIRTUAL = "AWS_VIRTUAL_HOSTED_STYLE_REQUEST"


@dataclass(frozen=True, kw_only=True)
class Answer:
    """What the store answered.

    Attributes:
        headers: by names in small letters.
        body: of the answer, of an error too.
    """

    status: int
    headers: Mapping[str, str]
    body: bytes

    @property
    def code(self) -> str | None:
        """The store's word for an error."""
        match = _CODE.search(self.body)
        return match[1].decode() if match and self.status >= 300 else None

    @property
    def date(self) -> datetime | None:
        """The store's clock."""
        try:
            return parsedate_to_datetime(self.headers["date"])
        except (KeyError, ValueError):
            return None


@dataclass(frozen=True, kw_only=True)
class Unreachable:
    """Why there was no answer.

    Attributes:
        fix: what can be done about it.
        broken: whether the store was reached, and broke off.
    """

    what: str
    fix: str
    broken: bool = False


class _Staying(urllib.request.HTTPRedirectHandler):
    """Follows no redirection: the signature is of one place."""

    def redirect_request(
        self,
        req: urllib.request.Request,
        fp: IO[bytes],
        code: int,
        msg: str,
        headers: HTTPMessage,
        newurl: str,
    ) -> None:
        return None


def send_request(
    bucket: str,
    query: Mapping[str, str],
    *,
    method: str = "GET",
    key: str = "",
    waits: Sequence[float] = _WAITS,
) -> Answer | Unreachable:
    """Sends a request for a bucket, or for a key of it, and returns the store's answer.

    Args:
        waits: before a request that failed in the store, or whose answer broke off, is sent again
            [s].
    """
    answer = _once(bucket, query, method, key)
    for wait in waits:
        if not (answer.broken if isinstance(answer, Unreachable) else answer.status in _PASSING):
            break
        time.sleep(wait)
        answer = _once(bucket, query, method, key)
    return answer


def _once(bucket: str, query: Mapping[str, str], method: str, key: str) -> Answer | Unreachable:
    url = _address(bucket, key)
    text = urlencode(sorted(query.items()), quote_via=quote, safe="-_.~")
    headers = signed_headers(method, url, text, settings(), when=datetime.now(UTC))
    request = urllib.request.Request(
        urlsplit(url)._replace(query=text).geturl(), method=method, headers=headers
    )
    try:
        with urllib.request.build_opener(_Staying).open(
            request, timeout=2 * CONNECT_TIMEOUT
        ) as answer:
            return _answer(answer.status, answer.headers, answer.read())
    except HTTPError as error:
        with error:
            return _answer(error.code, error.headers, error.read())
    except (OSError, HTTPException, ValueError) as error:
        return _unreachable(error.reason if isinstance(error, URLError) else error, url)


def signed_headers(
    method: str,
    url: str,
    query: str,
    options: Mapping[str, str],
    *,
    when: datetime,
    service: str = "s3",
) -> dict[str, str]:
    """Signs the headers of a request without a body; without access keys those of one that nobody
    has signed.

    Args:
        query: as it is sent, its names in order.
        options: as of `settings`.

    Source: "Authenticating Requests (AWS Signature Version 4)", Amazon S3 API Reference.
    """
    parts = urlsplit(url)
    stamp = when.strftime("%Y%m%dT%H%M%SZ")
    headers = {
        "host": parts.netloc.rpartition("@")[2],
        "x-amz-content-sha256": _NOTHING,
        "x-amz-date": stamp,
    }
    if "aws_session_token" in options:
        headers["x-amz-security-token"] = options["aws_session_token"]
    if "aws_access_key_id" not in options or "aws_secret_access_key" not in options:
        return headers
    names = ";".join(sorted(headers))
    lines = "".join(f"{name}:{headers[name]}\n" for name in sorted(headers))
    canonical = f"{method}\n{parts.path or '/'}\n{query}\n{lines}\n{names}\n{_NOTHING}"
    scope = f"{stamp[:8]}/{options['aws_region']}/{service}/aws4_request"
    text = f"AWS4-HMAC-SHA256\n{stamp}\n{scope}\n{hashlib.sha256(canonical.encode()).hexdigest()}"
    secret = f"AWS4{options['aws_secret_access_key']}".encode()
    for part in scope.split("/"):
        secret = hmac.digest(secret, part.encode(), "sha256")
    signature = hmac.new(secret, text.encode(), "sha256").hexdigest()
    credential = f"{options['aws_access_key_id']}/{scope}"
    headers["Authorization"] = (
        f"AWS4-HMAC-SHA256 Credential={credential}, SignedHeaders={names}, Signature={signature}"
    )
    return headers


def _address(bucket: str, key: str) -> str:
    """Builds the URL of a key as the client writes it: behind the bucket's name, or at a host of
    the bucket's own."""
    options = settings()
    virtual = os.environ.get(_VIRTUAL, "").lower() in ("1", "true", "yes", "on")
    endpoint = options.get("aws_endpoint")
    if endpoint is None:
        amazon = f"s3.{options['aws_region']}.amazonaws.com"
        base = f"https://{bucket}.{amazon}" if virtual else f"https://{amazon}/{bucket}"
    else:
        base = endpoint.rstrip("/") if virtual else f"{endpoint.rstrip('/')}/{bucket}"
    return f"{base}/{quote(key)}" if key else f"{base}/" if virtual else base


def _answer(status: int, headers: Any, body: bytes) -> Answer:
    return Answer(
        status=status, headers={name.lower(): value for name, value in headers.items()}, body=body
    )


def _unreachable(reason: Any, url: str) -> Unreachable:
    """Explains what keeps a request from the store."""
    parts = urlsplit(url)
    host = parts.hostname or ""
    proxy = urllib.request.getproxies().get(parts.scheme)
    if proxy is not None and not urllib.request.proxy_bypass(host):
        message = (
            f"there was no answer of {host} through the proxy {redact_credentials(proxy)}: "
            f"{_one_line(reason)}"
        )
        variable = f"{parts.scheme.upper()}_PROXY"
        return Unreachable(
            what=message,
            fix=f"check {variable}, or name {host} in NO_PROXY to reach it without a proxy",
        )
    end_point = "check the end point (AWS_ENDPOINT_URL)"
    if isinstance(reason, socket.gaierror):
        return Unreachable(
            what=f"the name {host} has no address",
            fix=f"{end_point}, the region (AWS_REGION), and the network's DNS",
        )
    if isinstance(reason, ssl.SSLCertVerificationError):
        return Unreachable(
            what=f"the certificate of {host} is not trusted: {reason.verify_message}",
            fix="name the file of the authority that signed it in SSL_CERT_FILE, or check the end "
            "point"
            " (AWS_ENDPOINT_URL) and this machine's clock",
        )
    if isinstance(reason, ssl.SSLError):
        return Unreachable(
            what=f"{host} does not speak TLS: {_one_line(reason)}",
            fix=f"{end_point}: http:// or https://",
        )
    if isinstance(reason, ConnectionRefusedError):
        message = (
            f"{host} refuses connections to port "
            f"{parts.port or (443 if parts.scheme == 'https' else 80)}"
        )
        return Unreachable(what=message, fix=f"{end_point}, and that the store runs")
    if isinstance(reason, TimeoutError):
        return Unreachable(
            what=f"{host} did not answer in time", fix=f"{end_point}, the network and its firewall"
        )
    message = f"there was no answer of {host}: {_one_line(reason)}"
    broken = isinstance(reason, HTTPException | ConnectionError)
    return Unreachable(what=message, fix=f"{end_point} and the network", broken=broken)


def _one_line(reason: object) -> str:
    return redact_credentials(" ".join(str(reason).split()))[:200]
