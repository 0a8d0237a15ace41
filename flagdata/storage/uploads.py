"""Uploads in parts that were never finished: no listing of a bucket shows their parts, and its
owner pays for them.

A process that was killed leaves them. `doctor` names them, `gc` aborts them; a rule of the bucket
(AbortIncompleteMultipartUpload) does so too.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from xml.etree import ElementTree as ET

from flagdata.storage.refusals import refusal_of
from flagdata.storage.requests import Answer, send_request

_PAGES = 1000
"""Most pages of a listing that are read, of 1,000 uploads each."""
_LISTED, _GONE = 200, (200, 204, 404)


@dataclass(frozen=True, kw_only=True)
class Upload:
    """An upload that was begun.

    Attributes:
        key: of the object that it would have become.
        identity: by which the store knows it.
        begun: when, by the store's clock [s since 1970].
    """

    bucket: str
    key: str
    identity: str
    begun: float

    def __str__(self) -> str:
        return f"s3://{self.bucket}/{self.key}"

    def abort(self) -> None:
        """Deletes its parts, if it is still there.

        Raises:
            StoreError: the store did not.
        """
        answer = send_request(
            self.bucket, {"uploadId": self.identity}, method="DELETE", key=self.key
        )
        if not isinstance(answer, Answer) or answer.status not in _GONE:
            raise refusal_of(
                answer, bucket=self.bucket, where=str(self), needs="s3:AbortMultipartUpload"
            )


def list_unfinished(bucket: str, prefix: str) -> list[Upload]:
    """Lists the unfinished uploads whose keys begin so, by key.

    Raises:
        StoreError: the store did not list them; some cannot.
    """
    return sorted(_list_uploads(bucket, prefix), key=lambda upload: (upload.key, upload.begun))


def _list_uploads(bucket: str, prefix: str) -> Iterator[Upload]:
    marks: dict[str, str] = {}
    for _ in range(_PAGES):
        answer = send_request(bucket, {"uploads": "", "prefix": prefix, **marks})
        page = _page(answer)
        if page is None:
            raise refusal_of(
                answer,
                bucket=bucket,
                where=f"s3://{bucket}/{prefix}",
                needs="s3:ListBucketMultipartUploads",
            )
        for entry in page.findall("{*}Upload"):
            upload = _upload(bucket, entry)
            if upload is not None and upload.key.startswith(prefix):
                yield upload
        following = {
            "key-marker": _text(page, "NextKeyMarker"),
            "upload-id-marker": _text(page, "NextUploadIdMarker"),
        }
        if _text(page, "IsTruncated") != "true" or following == marks:
            return
        marks = following


def _page(answer: object) -> ET.Element | None:
    """Parses a page of the listing, if the answer is one."""
    if not isinstance(answer, Answer) or answer.status != _LISTED:
        return None
    try:
        root = ET.fromstring(answer.body)
    except ET.ParseError:
        return None
    return root if root.tag.rpartition("}")[2] == "ListMultipartUploadsResult" else None


def _upload(bucket: str, entry: ET.Element) -> Upload | None:
    try:
        begun = datetime.fromisoformat(_text(entry, "Initiated")).timestamp()
    except ValueError:  # not the time that a store writes: as old as can be
        begun = 0.0
    key, identity = _text(entry, "Key"), _text(entry, "UploadId")
    return (
        Upload(bucket=bucket, key=key, identity=identity, begun=begun) if key and identity else None
    )


def _text(element: ET.Element, name: str) -> str:
    return element.findtext(f"{{*}}{name}") or ""
