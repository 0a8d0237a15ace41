"""A file's own statement of which command wrote it, with a hash of the rest: whether anybody changed it since.

The statement is a comment at the end of HTML, Markdown, SVG, TOML, Python and PDF, the last member of a JSON object,
and a text chunk of a PNG. Other formats carry none.
"""

from __future__ import annotations

import hashlib
import struct
import zlib
from pathlib import Path

_COMMENTS = {
    ".html": "<!-- {} -->\n",
    ".htm": "<!-- {} -->\n",
    ".md": "<!-- {} -->\n",
    ".svg": "<!-- {} -->\n",
    ".toml": "# {}\n",
    ".py": "# {}\n",
    ".pdf": "% {}\n",
}
_OBJECT_END = b"\n}\n"  # of JSON that is indented
_WORDS = "written by flagdata"
_TAIL = 512  # bytes at the end of a file that hold its statement
_PNG, _PNG_END = b"\x89PNG\r\n\x1a\n", 12  # signature; bytes of the last chunk


def signed(data: bytes, *, name: str, command: str) -> bytes:
    """The bytes of a file `name` with the statement that `flagdata COMMAND` wrote them.

    A format that has no place for it leaves them as they are."""
    block, end = _block(data, name, command, hashlib.sha256(data).hexdigest())
    at = len(data) - end
    return data[:at] + block + data[at:]


def is_signed(path: Path, *, command: str) -> bool:
    """Whether `flagdata COMMAND` wrote the file and nobody has changed it since.

    Raises:
        OSError: it cannot be read.
    """
    with path.open("rb") as stream:
        stream.seek(max(0, path.stat().st_size - _TAIL))
        if _WORDS.encode() not in stream.read():
            return False
    data = path.read_bytes()
    block, end = _block(data, path.name, command, "0" * 64)
    at = len(data) - end
    rest = data[: at - len(block)] + data[at:]
    return len(rest) < len(data) and signed(rest, name=path.name, command=command) == data


def _block(data: bytes, name: str, command: str, digest: str) -> tuple[bytes, int]:
    """The statement as bytes, and how many bytes of `data` stand behind it."""
    words = f"{_WORDS} {command}; SHA-256 of the rest {digest}"
    suffix = Path(name).suffix.lower()
    if suffix in _COMMENTS:
        return _COMMENTS[suffix].format(words).encode(), 0
    if suffix == ".json" and data.endswith(_OBJECT_END):
        return f',\n "written": "{words}"'.encode(), len(_OBJECT_END)
    if suffix == ".png" and data.startswith(_PNG):
        body = b"tEXtSoftware\0" + words.encode("latin-1")
        return struct.pack(">I", len(body) - 4) + body + struct.pack(">I", zlib.crc32(body)), _PNG_END
    return b"", 0
