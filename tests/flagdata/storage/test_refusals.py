"""What a store refuses is named as what it is, with the remedy of that: not as the network's or the
credentials'."""

from __future__ import annotations

import socket
import ssl
import time
from collections.abc import Callable
from email.utils import formatdate
from pathlib import Path
from typing import Any

import pytest
from deltalake import DeltaTable
from deltalake.exceptions import DeltaError

from flagdata.errors import FlagdataError
from flagdata.lake import Lake
from flagdata.storage import DeniedError, RemotePath, StoreError, connection, refusal, requests
from flagdata.storage.refusals import CredentialsError, NoBucketError
from tests.flagdata.storage.conftest import Answering
from tests.program import invoke
from tests.s3 import SECRETS, refusing

REQUESTS: dict[str, Callable[[RemotePath], object]] = {
    "get": RemotePath.read_bytes,
    "head": RemotePath.stat,
    "create": lambda place: place.create(b"1"),
    "put": lambda place: place.write_bytes(b"1"),
    "replace": lambda place: place.replace_if('"1"', b"1"),
    "list": lambda place: list(place.rglob("*")),
    "folder": lambda place: list(place.iterdir()),
    "delete": RemotePath.unlink,
    "range": lambda place: place.read_range(0, 1),
}
"""All that the client asks a store for."""
ABROAD = {"x-amz-bucket-region": "eu-west-1"}
NAMED = {
    "another region, by the code": (
        refusing(
            400,
            "AuthorizationHeaderMalformed",
            "expecting 'us-west-2'",
            rest="<Region>us-west-2</Region>",
        ),
        "us-west-2",
        "AWS_REGION=us-west-2",
    ),
    "another region, by the end point": (
        refusing(
            301, "PermanentRedirect", rest="<Endpoint>case.s3-us-west-2.amazonaws.com</Endpoint>"
        ),
        "another region",
        "AWS_REGION",
    ),
    "another region, without a body": ((301, ABROAD, b""), "eu-west-1", "AWS_REGION=eu-west-1"),
    "another region, as a denial": ((403, ABROAD, b""), "eu-west-1", "AWS_REGION=eu-west-1"),
    "a clock that is off": (refusing(403, "RequestTimeTooSkewed"), "clock", "clock"),
    "a clock that is off, without a code": (
        (403, {"Date": formatdate(time.time() - 1500, usegmt=True)}, b""),
        "min ahead of the store",
        "clock",
    ),
    "expired credentials": (refusing(400, "ExpiredToken"), "expired", "AWS_SESSION_TOKEN"),
    "another's token": (refusing(400, "InvalidToken"), "token", "AWS_SESSION_TOKEN"),
    "an unknown key": (refusing(403, "InvalidAccessKeyId"), "access key", "AWS_ACCESS_KEY_ID"),
    "a wrong secret": (
        refusing(403, "SignatureDoesNotMatch"),
        "secret key",
        "AWS_SECRET_ACCESS_KEY",
    ),
    "a key service that does not permit it": (
        refusing(
            403,
            "AccessDenied",
            "User: me is not authorized to perform: kms:Decrypt on resource: key",
        ),
        "key service",
        "kms:Decrypt",
    ),
    "a disabled key of the key service": (
        refusing(400, "KMS.DisabledException"),
        "key service",
        "key",
    ),
    "too many requests": (refusing(503, "SlowDown"), "request rate", "fewer"),
    "too many requests, by the state": ((429, {}, b""), "request rate", "fewer"),
    "a store that fails": (refusing(500, "InternalError"), "store failed", "later"),
    "a gateway that fails": ((502, {}, b"<html>bad gateway</html>"), "store failed", "later"),
    "a redirection": ((307, {}, b""), "another end point", "AWS_REGION"),
    "what the store lacks": (
        refusing(501, "NotImplemented"),
        "cannot do this",
        "another store|use a store",
    ),
    "names in hosts": (
        refusing(403, "SecondLevelDomainForbidden"),
        "host",
        "AWS_VIRTUAL_HOSTED_STYLE_REQUEST",
    ),
    "an archive": (refusing(403, "InvalidObjectState"), "archive", "storage class"),
    "a full store": (refusing(507, "XMinioStorageFull"), "no room", "space"),
}


UNTRUSTED = ssl.SSLCertVerificationError(1, "self-signed certificate")
UNTRUSTED.verify_message = "self-signed certificate"


@pytest.mark.parametrize("request_name", REQUESTS)
@pytest.mark.parametrize("cause", NAMED)
def test_each_cause_is_named_with_its_remedy_whatever_was_asked_for(
    answering: Answering, cause: str, request_name: str
) -> None:
    answer, what, fix = NAMED[cause]
    place = answering(answer)
    begun = time.monotonic()
    with pytest.raises(StoreError) as caught:
        REQUESTS[request_name](place)
    assert time.monotonic() - begun < 20
    assert what in str(caught.value.strerror)
    assert any(word in caught.value.fix for word in fix.split("|"))
    assert not any(secret in f"{caught.value} {caught.value.fix}" for secret in SECRETS.values())


@pytest.mark.parametrize("cause", NAMED)
def test_the_catalogs_library_is_refused_for_the_same_causes(
    answering: Answering, cause: str
) -> None:
    answer, what, fix = NAMED[cause]
    answering(answer)
    with pytest.raises((DeltaError, OSError)) as caught:
        DeltaTable("s3://case/lake/catalog", storage_options=connection.delta_options())
    found = refusal(caught.value, bucket="case", where="s3://case/lake")
    assert what in str(found.strerror)
    assert any(word in found.fix for word in fix.split("|"))


@pytest.mark.parametrize(
    ("name", "action"),
    [
        ("get", "s3:GetObject"),
        ("head", "s3:ListBucket"),
        ("create", "s3:PutObject"),
        ("put", "s3:PutObject"),
        ("list", "s3:ListBucket"),
        ("folder", "s3:ListBucket"),
        ("delete", "s3:DeleteObject"),
    ],
)
def test_what_is_not_permitted_is_named_by_its_action(
    answering: Answering, name: str, action: str
) -> None:
    with pytest.raises(DeniedError) as caught:
        REQUESTS[name](answering(refusing(403, "AccessDenied")))
    assert action in caught.value.fix
    assert "clock" not in f"{caught.value} {caught.value.fix}"


def test_a_bucket_that_is_not_there_is_no_object_that_is_not_there(answering: Answering) -> None:
    with pytest.raises(NoBucketError, match="no bucket 'case'"):
        answering(refusing(404, "NoSuchBucket")).read_bytes()


def test_missing_credentials_are_named(
    answering: Answering, monkeypatch: pytest.MonkeyPatch
) -> None:
    place = answering(refusing(403, "AccessDenied"))
    for name in SECRETS:
        monkeypatch.delenv(name)
    connection.settings.cache_clear()
    monkeypatch.setenv("AWS_EC2_METADATA_DISABLED", "true")
    with pytest.raises(CredentialsError, match="no credentials") as caught:
        place.read_bytes()
    assert "AWS_PROFILE" in caught.value.fix


def test_a_command_ends_at_once_with_the_cause(answering: Answering) -> None:
    answering(refusing(403, "RequestTimeTooSkewed"))
    ended = invoke("ls", "--lake", "s3://case/lake")
    assert ended.code == 1
    assert "clock" in ended.err.partition("fix:")[2]


def test_an_answer_that_broke_off_is_one_of_a_store_that_answers_again(
    answering: Answering, monkeypatch: pytest.MonkeyPatch
) -> None:
    place, once, broken = answering((200, {}, b"")), requests._once, [True, True]

    def breaking(*arguments: Any) -> object:
        failed = requests.Unreachable(what="broke off", fix="check the network", broken=True)
        return failed if broken and broken.pop() else once(*arguments)

    monkeypatch.setattr(requests, "_once", breaking)
    lost = OSError("HTTP error: request or response body error")
    assert refusal(lost, bucket=place.bucket, where=str(place)).passing
    broken[:] = [True] * 9
    assert not refusal(lost, bucket=place.bucket, where=str(place)).passing


@pytest.mark.parametrize(
    ("reason", "what"),
    [
        (socket.gaierror(-2, "Name or service not known"), "has no address"),
        (UNTRUSTED, "not trusted"),
        (ssl.SSLError(1, "wrong version number"), "TLS"),
        (ConnectionRefusedError(), "refuses connections"),
        (TimeoutError(), "in time"),
        (OSError("cut"), "no answer"),
    ],
)
def test_what_keeps_a_request_from_the_store_is_named(
    answering: Answering, monkeypatch: pytest.MonkeyPatch, reason: OSError, what: str
) -> None:
    place = answering(None)
    monkeypatch.setattr(
        requests.urllib.request.OpenerDirector,
        "open",
        lambda *_, **__: (_ for _ in ()).throw(reason),
    )
    with pytest.raises(StoreError, match=what) as caught:
        place.read_bytes()
    assert "AWS_ENDPOINT_URL" in caught.value.fix


def test_a_name_without_address_and_a_closed_port_are_named_as_they_are(
    use_store: Callable[[str], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connection, "RETRIES", 1)
    for address, what in (
        ("http://store.invalid", "has no address"),
        ("http://127.0.0.1:1", "refuses connections"),
    ):
        use_store(address)
        with pytest.raises(FlagdataError, match=what):
            Lake.open("s3://bucket/lake")


def test_a_proxy_without_an_answer_is_named(
    use_store: Callable[[str], None], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(connection, "RETRIES", 1)
    use_store("http://store.example")
    monkeypatch.setenv("HTTP_PROXY", "http://user:hidden@127.0.0.1:1")
    monkeypatch.setenv("http_proxy", "http://user:hidden@127.0.0.1:1")
    for name in ("NO_PROXY", "no_proxy"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(FlagdataError, match="through the proxy") as caught:
        Lake.open("s3://bucket/lake")
    assert "HTTP_PROXY" in caught.value.fix
    assert "hidden" not in str(caught.value)
