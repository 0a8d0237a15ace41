"""The one place where text becomes a path: an address of a storage, stream or machine is refused as
what it is.

A path library takes `s3://bucket/lake` for a folder `s3:` here. A lake may be there; all else is
read and written on a local disk.
"""

from __future__ import annotations

import re
from pathlib import Path

from flagdata.errors import UsageError
from flagdata.storage import Place, RemotePath

_ADDRESS = re.compile(
    r"([\w.-]+@)?(?P<scheme>[A-Za-z][\w.+-]+):(?P<rest>/.*)", re.DOTALL
)  # a drive has one letter
_STORAGE = (
    "object storage",
    "copy it to a local disk with the storage's own client, and give that path",
)
_STREAM = (
    "a live stream",
    "record it to a file first (ffmpeg -i ADDRESS -c copy film.mkv), and give that file",
)
_WEB = "a file on the web", "download it, and give the local file"
_KINDS = {
    **dict.fromkeys(
        ("s3", "s3a", "s3n", "gs", "gcs", "oss", "r2", "b2", "minio", "swift", "hdfs"), _STORAGE
    ),
    **dict.fromkeys(("az", "azure", "abfs", "abfss", "adl", "wasb", "wasbs"), _STORAGE),
    **dict.fromkeys(
        ("rtsp", "rtsps", "rtp", "srt", "rtmp", "rtmps", "udp", "tcp", "mms", "mmsh", "hls"),
        _STREAM,
    ),
    **dict.fromkeys(("http", "https", "ftp", "ftps", "dav", "davs"), _WEB),
}
_ELSEWHERE = "another machine or service", "copy or mount it, and give the local path"


def local_path(text: Path | str) -> Path:
    """Reads `text` as a path of a file or folder of this machine; nothing is looked up.

    Raises:
        UsageError: an address: a scheme or machine, a colon and a slash. A local path that looks
            like one can be given from the root on.
    """
    address = _ADDRESS.fullmatch(str(text))
    if address is None:
        return Path(text)
    scheme = address["scheme"].lower()
    if scheme == "file":
        message, fix = (
            "a file: address, not a path",
            f"give the path: /{address['rest'].lstrip('/')}",
        )
    else:
        noun, fix = _KINDS.get(scheme, _ELSEWHERE)
        message = f"the address of {noun}, not a local path"
    raise UsageError(message, where=str(text), fix=fix)


def lake_place(text: Place | str) -> Place:
    """Reads where a lake is: a folder of this machine, or `s3://bucket/prefix`.

    Raises:
        UsageError: any other address.
    """
    if str(text).lower().startswith("s3://"):
        return RemotePath.parse(str(text))
    return local_path(text if isinstance(text, Path) else str(text))
