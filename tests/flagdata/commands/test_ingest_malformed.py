"""Malformed sources: refused with what and fix, and the lake as it was; or read, as far as they can
be."""

from __future__ import annotations

import gzip
import io
import os
import struct
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from flagdata.errors import FlagdataError
from flagdata.ingest import classify, ingest_camera, ingest_wind
from flagdata.lake import Lake
from flagdata.record import Record
from tests.confirming import CONFIRMED


def _state(lake: Lake) -> list[tuple[str, int]]:
    files = (p for p in lake.path.rglob("*") if p.is_file() and "staging" not in p.parts)
    return sorted((str(p), p.stat().st_size) for p in files)


def _ingest(lake: Lake, path: Path) -> bool:
    """Whether the source was taken; a refusal must be complete and leave nothing behind."""
    before = _state(lake)
    refusal: FlagdataError | None = None
    try:
        kind = classify(path)
        result = (
            ingest_camera(lake, path)
            if kind.kind == "camera"
            else ingest_wind(lake, path, confirm=CONFIRMED)
        )
    except FlagdataError as error:
        refusal = error
    else:
        assert result.artifact.object is not None
        record = Record.open(lake.object_path(result.artifact.object))
        assert record.frame_count or record.wind() is not None
    if refusal is not None:
        assert refusal.what, path
        assert refusal.fix, path
        assert _state(lake) == before, path
    return refusal is None


def _png(width: int, height: int) -> bytes:
    """A PNG that claims a size it has no data for."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return (
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        )

    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", header)
        + chunk(b"IDAT", zlib.compress(b"\0" * 1000))
        + chunk(b"IEND", b"")
    )


def _zipped(data: bytes) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("log.csv", data)
    return out.getvalue()


def _log(rows: list[str], header: str = "time,wind_speed (m/s)") -> bytes:
    return "\n".join([header, *rows, ""]).encode()


def hopeless(video: bytes) -> Iterator[tuple[str, bytes]]:
    """Sources of which nothing can be read."""
    rows = [f"2026-05-01T12:00:{k:02d}Z,5.0" for k in range(60)]
    yield "empty", b""
    yield "one-byte", b"\0"
    yield "newlines", b"\n" * 1000
    yield "zeros", b"\0" * 100_000
    yield "noise", np.random.default_rng(0).bytes(100_000)
    yield "bomb.gz", gzip.compress(b"\0" * 50_000_000)
    yield "bomb.zip", _zipped(b"0" * 50_000_000)
    yield "huge.png", _png(100_000, 100_000)
    yield "wide.png", _png(2**31 - 1, 1)
    yield "one-line", b"5.0," * 5_000_000
    yield "no-zone", _log([row.replace("Z", "") for row in rows])
    yield "all-nan", _log([row.replace("5.0", "NaN") for row in rows])
    yield "all-empty", _log([row.replace("5.0", "") for row in rows])
    yield "all-words", _log([row.replace("5.0", "breezy") for row in rows])
    yield "all-infinite", _log([row.replace("5.0", "inf") for row in rows])
    yield "bad-stamps", _log([row.replace("2026-05-01", "2026-13-41") for row in rows])
    yield "far-stamps", _log([row.replace("2026", "9999") for row in rows])
    yield "no-rows", _log([])
    yield "utf-16-without-bom", _log(rows).decode().encode("utf-16-le")
    yield "ebcdic", _log(rows).decode().encode("cp500")
    yield "other-header", _log(rows, header="when,how_hard")
    yield "mcap", b"\x89MCAP0\r\n" + b"\0" * 100
    yield "video-head", video[:100]
    yield "video-zeroed", video[:32] + b"\0" * (len(video) - 32)
    for share in range(1, 10):
        yield f"video-without-index-{share}", video[: len(video) * share // 20]


def test_hopeless_sources_are_refused_and_the_lake_is_unchanged(
    tmp_path: Path, video: Path
) -> None:
    lake = Lake.create(tmp_path / "lake")
    for name, data in hopeless(video.read_bytes()):
        path = tmp_path / name
        path.write_bytes(data)
        assert not _ingest(lake, path), f"{name} was taken"


def test_damaged_bytes_of_a_video_never_end_in_anything_else(tmp_path: Path, video: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    whole = video.read_bytes()
    rng = np.random.default_rng(21)
    taken = 0
    for number in range(12):
        data = bytearray(whole)
        for place in rng.integers(0, len(data), rng.integers(1, 40)):
            data[place] = rng.integers(0, 256)
        path = tmp_path / f"{number}.mp4"
        path.write_bytes(bytes(data))
        taken += _ingest(lake, path)
    assert lake.rows().num_rows == taken


def _mutations(text: str, rng: np.random.Generator) -> Iterator[str]:
    lines = text.splitlines()
    body = lines[1:]
    snippets = [
        "",
        "NaN",
        "-5.0",
        "1e999",
        "--",
        ",",
        ",,,,",
        '"',
        "\0",
        "é",
        "12:61:00",
        "2026-05-01",
        "∞",
        "0x1F",
        "1,5",
    ]

    def joined(rows: list[str]) -> str:
        return "\n".join([lines[0], *rows, ""])

    for _ in range(8):
        rows = list(body)
        for place in rng.integers(0, len(rows), 5):
            rows[place] = rows[place][: rng.integers(0, len(rows[place]))]
        yield joined(rows)
    for snippet in snippets:
        for share in (1, 3):
            rows = list(body)
            for place in range(0, len(rows), share):
                cells = rows[place].split(",")
                cells[rng.integers(0, len(cells))] = snippet
                rows[place] = ",".join(cells)
            yield joined(rows)
    yield joined(body[::-1])
    yield joined([*body, *body])
    yield joined([row for row in body for _ in range(2)])
    yield joined(list(rng.permutation(body)))
    yield text.replace("\n", "\r")
    yield text.replace(",", ";")
    yield text.replace(",", "\t")
    yield text.replace("+02:00", "+25:00")
    yield text.replace("+02:00", " Mars/Olympus")
    yield text.replace("2026", "0001")
    for _ in range(10):
        characters = list(text)
        for place in rng.integers(0, len(characters), 20):
            characters[place] = chr(rng.integers(0, 256))
        yield "".join(characters)


def test_damaged_logs_never_end_in_anything_else(tmp_path: Path, wind_log: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    count = 0
    for number, text in enumerate(_mutations(wind_log.read_text(), np.random.default_rng(22))):
        path = tmp_path / f"{number}.csv"
        path.write_bytes(text.encode("latin-1" if number % 2 else "utf-8", errors="replace"))
        _ingest(lake, path)
        count += 1
    assert count >= 50


def test_pipes_and_devices_are_refused_at_once(tmp_path: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    os.mkfifo(tmp_path / "pipe")
    assert not _ingest(lake, tmp_path / "pipe")
    assert not _ingest(lake, Path("/dev/zero"))


def test_names_that_are_no_text_are_shown_and_do_no_harm(tmp_path: Path, wind_log: Path) -> None:
    lake = Lake.create(tmp_path / "lake")
    path = Path(os.fsdecode(os.fsencode(tmp_path) + b"/caf\xe9.csv"))
    path.write_bytes(wind_log.read_bytes())
    assert _ingest(lake, path)
    assert lake.rows().to_pylist()[0]["source_name"] == "caf\\xe9.csv"
