"""Requests of this package's own are signed as Amazon's library signs them."""

from __future__ import annotations

from datetime import UTC, datetime

import pytest
from botocore.auth import S3SigV4Auth
from botocore.awsrequest import AWSRequest
from botocore.credentials import Credentials

from flagdata.storage.requests import signed_headers

WHEN = datetime(2026, 11, 28, 6, 30, tzinfo=UTC)


@pytest.mark.parametrize("token", [None, "a-token"])
@pytest.mark.parametrize(
    ("method", "url", "query"),
    [
        ("GET", "https://s3.eu-west-1.amazonaws.com/bucket", "prefix=lake%2Fmcap&uploads="),
        ("DELETE", "http://127.0.0.1:9000/bucket/lake/mcap/a%2Bb.mcap", "uploadId=x%2Fy%3D"),
        ("HEAD", "https://bucket.s3.eu-west-1.amazonaws.com/", "location="),
    ],
)
def test_a_request_is_signed_as_amazons_library_signs_it(
    method: str, url: str, query: str, token: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    options = {
        "aws_access_key_id": "AKIDEXAMPLE",
        "aws_secret_access_key": "secret/key+",
        "aws_region": "eu-west-1",
    }
    options |= {"aws_session_token": token} if token else {}
    ours = signed_headers(method, url, query, options, when=WHEN)
    monkeypatch.setattr("botocore.auth.get_current_datetime", lambda: WHEN.replace(tzinfo=None))
    request = AWSRequest(method=method, url=f"{url}?{query}")
    S3SigV4Auth(Credentials("AKIDEXAMPLE", "secret/key+", token), "s3", "eu-west-1").add_auth(
        request
    )
    assert ours["Authorization"] == request.headers["Authorization"]


def test_without_keys_a_request_is_not_signed() -> None:
    assert "Authorization" not in signed_headers(
        "HEAD", "https://store/bucket", "", {"aws_region": "us-east-1"}, when=WHEN
    )
