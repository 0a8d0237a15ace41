"""Uploads in parts that are cut off: aborted, or named and collected."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from flagdata.core.findings import Severity
from flagdata.lake import Lake, Lease, collect, doctor, garbage
from flagdata.storage import RemotePath, StoreError, Upload, connection
from flagdata.storage.path import BLOCK
from flagdata.storage.uploads import list_unfinished
from tests.flagdata.storage.conftest import Answering
from tests.program import invoke
from tests.s3 import Failing, Scripted, refusing, serving

NOW, DAY = timedelta(0), timedelta(days=1)


def root(lake: Lake) -> RemotePath:
    assert isinstance(lake.path, RemotePath)
    return lake.path


def begin(s3_server: str, key: str) -> str:
    """An upload of one part that nobody finishes; its identity."""
    import boto3

    client = boto3.client("s3", endpoint_url=s3_server, region_name="us-east-1")
    bucket = RemotePath.parse("s3://bucket").bucket
    identity = client.create_multipart_upload(Bucket=bucket, Key=key)["UploadId"]
    client.upload_part(Bucket=bucket, Key=key, UploadId=identity, PartNumber=1, Body=b"part")
    return identity


def test_an_upload_that_was_cut_off_is_named_by_doctor_and_aborted_by_gc(
    remote_lake: Lake, s3_server: str
) -> None:
    place = root(remote_lake) / "mcap" / f"{'0' * 64}.mcap"
    begin(s3_server, place.key)
    elsewhere = begin(s3_server, f"{root(remote_lake).key}-of-another-lake/mcap/x.mcap")
    (found,) = doctor(remote_lake, grace=DAY)
    assert (found.kind, found.severity, found.where) == (
        "upload-unfinished",
        Severity.WARNING,
        str(place),
    )
    assert [str(upload) for upload in garbage(remote_lake, grace=DAY).uploads] == [str(place)]
    assert doctor(remote_lake, grace=DAY) == (found,)  # a dry run aborts nothing
    ended = invoke("gc", "--lake", remote_lake.path)
    assert ended.code == 0
    assert str(place) in ended.out
    assert "1 unfinished upload aborted" in ended.err
    assert doctor(remote_lake, grace=NOW) == ()
    assert [upload.identity for upload in list_unfinished("bucket", root(remote_lake).key)] == [
        elsewhere
    ]


def test_an_upload_of_a_running_transaction_is_left_alone(
    remote_lake: Lake, s3_server: str
) -> None:
    name = f"mcap/{'1' * 64}"
    lease = Lease(remote_lake.staging)
    lease.hold(name)
    identity = begin(s3_server, f"{root(remote_lake).key}/{name}.mcap")
    assert doctor(remote_lake, grace=NOW) == ()
    collect(remote_lake, grace=NOW)
    assert [upload.identity for upload in root(remote_lake).uploads()] == [identity]
    lease.close()
    collect(remote_lake, grace=NOW)
    assert root(remote_lake).uploads() == []


def test_young_uploads_stay_for_the_grace_period_and_pages_are_read_to_the_end(
    answering: Answering,
) -> None:
    entry = (
        "<Upload><Key>lake/mcap/{}</Key><UploadId>{}</UploadId><Initiated>{}</Initiated></Upload>"
    )
    now = datetime.now(UTC)
    text = "".join(entry.format(n, n, (now - timedelta(hours=n)).isoformat()) for n in range(3))
    more = "<IsTruncated>true</IsTruncated><NextKeyMarker>lake/mcap/2</NextKeyMarker>"
    space = 'xmlns="http://s3.amazonaws.com/doc/2006-03-01/"'
    answering(
        (
            200,
            {},
            f"<ListMultipartUploadsResult {space}>{text}{more}</ListMultipartUploadsResult>".encode(),
        )
    )
    found = list_unfinished("case", "lake/")
    assert [upload.begun for upload in found if upload.key.endswith("1")] == pytest.approx(
        [now.timestamp() - 3600] * 2, abs=1
    )
    assert [path.count("key-marker=lake%2Fmcap%2F2") for _, path in Scripted.asked] == [
        0,
        1,
    ]  # no endless listing


@pytest.mark.parametrize(
    "answer", [refusing(403, "AccessDenied"), refusing(501, "NotImplemented"), (200, {}, b"<html>")]
)
def test_a_store_that_does_not_list_uploads_says_why(
    answering: Answering, answer: tuple[int, dict[str, str], bytes]
) -> None:
    with pytest.raises(StoreError) as caught:
        answering(answer).uploads()
    assert caught.value.fix


def test_where_uploads_may_not_be_listed_a_lake_is_examined_and_collected_all_the_same(
    remote_lake: Lake, monkeypatch: pytest.MonkeyPatch
) -> None:
    def denied(self: RemotePath) -> list[Upload]:
        raise StoreError(5, "s3:ListBucketMultipartUploads is not permitted", str(self))

    monkeypatch.setattr(RemotePath, "uploads", denied)
    (found,) = doctor(remote_lake, grace=NOW)
    assert (found.kind, found.severity) == ("uploads-unlisted", Severity.NOTE)
    ended = invoke("gc", "--lake", remote_lake.path)
    assert ended.code == 0
    assert "s3:ListBucketMultipartUploads is not permitted" in ended.err


@pytest.mark.parametrize("failing", ["partNumber", "complete"])
def test_an_upload_that_fails_leaves_no_parts(
    s3_server: str,
    use_store: Callable[[str], None],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    failing: str,
) -> None:
    monkeypatch.setattr(connection, "RETRIES", 1)
    (tmp_path / "film.mcap").write_bytes(bytes(2 * BLOCK + 1))
    key = f"lake-of-{failing}/film.mcap"
    earlier = begin(s3_server, key)
    with serving(Failing) as address:
        Failing.store, Failing.failing = s3_server.removeprefix("http://"), failing
        use_store(address)
        place = RemotePath.parse(f"s3://bucket/{key}")
        with pytest.raises(StoreError, match="store failed"):
            place.upload(tmp_path / "film.mcap")
        assert [upload.identity for upload in place.uploads()] == [earlier]  # another's stays
        assert not place.exists()
