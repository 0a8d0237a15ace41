"""Small files that state, or unpack to, what no machine holds: each made by hand, read by the
command that takes it."""

from __future__ import annotations

import gzip
import json
import shutil
import struct
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from mcap.writer import CompressionType, Writer
from PIL import Image

from flagdata.lake import Lake
from tests.studies.hostile.campaign import Subject, command
from tests.studies.hostile.inputs import made as made_file
from tests.studies.hostile.lakes import READERS, made
from tests.studies.hostile.mutations import NUMBER, places
from tests.studies.hostile.recipes import FORMS, SQUARE
from tests.studies.hostile.sound import sound

_STARTS = ["--start", "2026-05-01T10:00:00Z"]
_PIXELS = [*_STARTS, "--sequence-fps", "25"]
_ZEROS = 1 << 20


def _packed(size: int, *, wbits: int = 15) -> bytes:
    """So many zeros, packed."""
    coder = zlib.compressobj(9, zlib.DEFLATED, wbits)
    whole = [coder.compress(bytes(_ZEROS)) for _ in range(size // _ZEROS)]
    return b"".join([*whole, coder.compress(bytes(size % _ZEROS)), coder.flush()])


def _png(path: Path, *, side: int, depth: int = 8) -> None:
    """A black picture, whole."""
    rows = _packed((side * depth // 8 + 1) * side)
    parts = [
        (b"IHDR", struct.pack(">IIBBBBB", side, side, depth, 0, 0, 0, 0)),
        (b"IDAT", rows),
        (b"IEND", b""),
    ]
    path.write_bytes(
        b"\x89PNG\r\n\x1a\n"
        + b"".join(
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
            for kind, data in parts
        )
    )


def _tiff(path: Path) -> None:
    """A picture of 100,000 by 100,000 in one strip that is not there."""
    tags = [(256, 4, 100_000), (257, 4, 100_000), (258, 3, 8), (259, 3, 1), (262, 3, 1), (273, 4, 8), (277, 3, 1),
            (278, 4, 100_000), (279, 4, 4_000_000_000)]  # fmt: skip
    entries = b"".join(struct.pack("<HHII", tag, kind, 1, value) for tag, kind, value in tags)
    path.write_bytes(b"II*\0\x08\0\0\0" + struct.pack("<H", len(tags)) + entries + bytes(4))


def _sized_gif(path: Path) -> None:
    Image.new("L", (8, 8)).save(path, "GIF")
    data = bytearray(path.read_bytes())
    struct.pack_into("<HH", data, 6, 65_535, 65_535)
    path.write_bytes(data)


def _counted_film(path: Path) -> None:
    """A film that states four milliards of frames, and of samples of its tables."""
    data = bytearray(made_file("film.mp4"))
    for box in (b"stts", b"stsz", b"stsc", b"ctts"):
        at = data.find(box)
        if at > 0:
            struct.pack_into(">I", data, at + (12 if box == b"stsz" else 8), 0xFFFF_FFF0)
    path.write_bytes(data)


def _long_frames(path: Path) -> None:
    """A film whose frames last for years."""
    data = bytearray(made_file("film.mp4"))
    at = data.find(b"stts")
    struct.pack_into(">I", data, at + 16, 0x7FFF_FFFF)
    path.write_bytes(data)


def _table(path: Path) -> None:
    """Sixty million rows of zeros, which Parquet packs to little."""
    schema = pa.schema(
        [(name, pa.int64()) for name in ("marker", "u", "v", "x", "y", "z", "frame")]
    )
    with pq.ParquetWriter(path, schema, compression="zstd", use_dictionary=True) as writer:
        block = pa.table(
            {name: np.zeros(1_000_000, dtype=np.int64) for name in schema.names}, schema=schema
        )
        for _ in range(60):
            writer.write_table(block)


def _book(path: Path, rows: str, *, strings: str = "") -> None:
    sheet = (
        "<worksheet "
        f'xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><sheetData>{rows}'
    )
    name = "http://schemas.openxmlformats.org"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(
            "[Content_Types].xml",
            f'<Types xmlns="{name}/package/2006/content-types"><Default Extension="xml" '
            'ContentType="application/xml"/>'
            "</Types>",
        )
        archive.writestr(
            "xl/workbook.xml",
            f'<workbook xmlns="{name}/spreadsheetml/2006/main" '
            f'xmlns:r="{name}/officeDocument/2006/relationships">'
            '<sheets><sheet name="a" sheetId="1" r:id="rId1"/></sheets></workbook>',
        )
        archive.writestr(
            "xl/_rels/workbook.xml.rels",
            f'<Relationships xmlns="{name}/package/2006/relationships"><Relationship Id="rId1" '
            f'Type="{name}/officeDocument/2006/relationships/worksheet" '
            'Target="worksheets/sheet1.xml"/>'
            "</Relationships>",
        )
        archive.writestr("xl/worksheets/sheet1.xml", f"{sheet}</sheetData></worksheet>")
        if strings:
            archive.writestr("xl/sharedStrings.xml", strings)


def _far(path: Path) -> None:
    _book(
        path,
        '<row r="1"><c r="A1"><v>1</v></c></row><row r="1048576"><c '
        'r="XFD1048576"><v>1</v></c></row>',
    )


def _blank(path: Path) -> None:
    """Many million empty cells."""
    row = "".join(
        f'<row r="{k}"><c r="A{k}"/><c r="AZ{k}"><v>1</v></c></row>' for k in range(1, 400_000)
    )
    _book(path, row)


def _zipped_names(path: Path) -> None:
    """A workbook beside fifty thousand empty members."""
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("xl/workbook.xml", "<workbook/>")
        for k in range(50_000):
            archive.writestr(f"{k}", b"")


def _lying_mcap(packing: CompressionType) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        with path.open("wb") as stream:
            writer = Writer(stream, compression=packing, chunk_size=1 << 40, enable_crcs=False)
            writer.start()
            channel = writer.register_channel(topic="/a", message_encoding="json", schema_id=0)
            writer.add_message(channel, 1, b'{"x": 1}', 1)
            for k in range(6):
                writer.add_message(channel, k + 2, bytes(1 << 27), k + 2)
            writer.finish()
        data = bytearray(path.read_bytes())
        true = struct.pack("<Q", 6 * ((1 << 27) + 31) + 31 + 8)
        for at in (data.find(true), data.rfind(true)):
            if at > 0:
                struct.pack_into("<Q", data, at, 1000)
        path.write_bytes(data)

    return write


def _honest_mcap(path: Path) -> None:
    """A chunk of 120 MiB in one message, which it states."""
    with path.open("wb") as stream:
        writer = Writer(stream, compression=CompressionType.ZSTD, chunk_size=1 << 40)
        writer.start()
        channel = writer.register_channel(topic="/a", message_encoding="json", schema_id=0)
        writer.add_message(channel, 1, b'{"x": "' + bytes(120 << 20) + b'"}', 1)
        writer.finish()


def _json_depth(path: Path) -> None:
    path.write_text('{"a":' * 500_000 + "1" + "}" * 500_000)


def _deep_lines(path: Path) -> None:
    path.write_text(
        '{"time": "2026-05-01T10:00:00Z", "wind_speed (m/s)": '
        + "[" * 60_000
        + "]" * 60_000
        + "}\n"
    )


def _long_line(path: Path) -> None:
    path.write_bytes(b"time,wind_speed (m/s)\n" + b"1," * (64 << 20))


def _wide_numbers(path: Path) -> None:
    rows = "".join(f"2026-05-01T10:00:{k:02d}Z,{'9' * 5000}\n" for k in range(60))
    path.write_text("time,wind_speed (m/s)\n" + rows)


def _years_apart(path: Path) -> None:
    path.write_text(
        "time,wind_speed "
        "(m/s)\n0001-01-01T00:00:00Z,5.0\n2026-05-01T10:00:00Z,5.1\n2262-04-11T00:00:00Z,5.2\n"
    )


def _zipped_text(path: Path) -> None:
    part = gzip.compress(b"2026-05-01T10:00:00Z,5.0\n" * 1_000_000)
    path.write_bytes(gzip.compress(b"time,wind_speed (m/s)\n") + part * 30)


def _zipped_zeros(path: Path) -> None:
    path.write_bytes(_packed(64 << 20, wbits=31) * 48)


def _netcdf(path: Path) -> None:
    """NetCDF-3 whose one dimension has four milliards of values."""

    def name(text: bytes) -> bytes:
        return struct.pack(">I", len(text)) + text + bytes(-len(text) % 4)

    head = b"CDF\x01" + struct.pack(">I", 0)
    dims = struct.pack(">II", 10, 1) + name(b"time") + struct.pack(">I", 0x7FFF_FFFF)
    unit = struct.pack(">II", 12, 1) + name(b"units") + struct.pack(">I", 2)
    unit += name(b"seconds since 2026-01-01")
    variable = (
        name(b"time") + struct.pack(">II", 1, 0) + unit + struct.pack(">III", 6, 0xFFFF_FFF8, 200)
    )
    path.write_bytes(head + dims + bytes(8) + struct.pack(">II", 11, 1) + variable + bytes(100))


def _obj(text: str) -> Callable[[Path], None]:
    def write(folder: Path) -> None:
        folder.mkdir()
        for k in range(2):
            (folder / f"{k:04d}_00.obj").write_text(text)
        (folder / "conf.json").write_text(
            '{"frame_time": 0.04, "frame_steps": 8, "wind": {"velocity": [3, 4, 0]}}'
        )

    return write


def _conf(path: Path) -> None:
    _obj(SQUARE)(path)
    (path / "conf.json").write_text(
        '{"frame_time": 1e-308, "frame_steps": 1' + "0" * 300 + ', "wind": {"velocity": [1e308]}}'
    )


def _lerobot(path: Path) -> None:
    (path / "meta").mkdir(parents=True)
    (path / "meta" / "info.json").write_text(
        json.dumps(
            {
                "codebase_version": "v3.0",
                "fps": 10**30,
                "total_episodes": 10**18,
                "total_frames": 10**18,
                "chunks_size": 10**18,
                "features": {"observation.images.a": {"dtype": "video", "shape": [10**9] * 3}},
                "data_path": "data/{chunk_index:03d}.parquet",
                "video_path": "videos/{chunk_index:0999999999d}.mp4",
            }
        )
    )


def _beside(
    name: str, write: Callable[[Path], object], *options: str, doctor: bool = False
) -> Subject:
    """A file that `ingest` is given, with and without --sniff."""

    plain = name.replace(" ", "-")

    def act(_: Any, folder: Path) -> None:
        path = sound(plain, write)
        Lake.create(folder / "lake")
        verbs: list[list[object]] = [
            ["ingest", path, "--sniff", "--json"],
            ["ingest", path, "--lake", folder / "lake", *options, "--json"],
        ]
        if doctor:
            verbs += [
                ["doctor", path],
                ["recover", path, folder / "new.mcap", "--lake", folder / "lake"],
            ]
        errors: list[Exception] = []
        for words in verbs:
            try:
                command(*words)
            except Exception as error:  # noqa: BLE001  of several commands the worst is reported
                errors.append(error)
        if errors:
            raise max(
                errors, key=lambda error: getattr(error, "kind", "unforeseen") == "unforeseen"
            )

    return Subject(name=name, examples=places, act=act, prepare=lambda: sound(plain, write))


def _folder(write: Callable[..., object], suffix: str, **options: int) -> Callable[[Path], None]:
    def fill(folder: Path) -> None:
        folder.mkdir()
        write(folder / f"0000.{suffix}", **options)
        for k in (1, 2):
            shutil.copy(folder / f"0000.{suffix}", folder / f"{k:04d}.{suffix}")

    return fill


def _in_lake(name: str, harm: Callable[[Path], None]) -> Subject:
    """A lake one file of which states a huge number."""

    def act(_: Any, folder: Path) -> None:
        lake = folder / "lake"
        shutil.copytree(made(), lake)
        harm(lake)
        errors: list[Exception] = []
        for words in READERS:
            shutil.rmtree(folder / "out", ignore_errors=True)
            try:
                command(
                    *(folder / "out" if word == "out" else word for word in words), "--lake", lake
                )
            except Exception as error:  # noqa: BLE001  of several commands the worst is reported
                errors.append(error)
        if errors:
            raise max(
                errors, key=lambda error: getattr(error, "kind", "unforeseen") == "unforeseen"
            )

    return Subject(name=name, examples=places, act=act, prepare=made)


def _shapes(lake: Path) -> None:
    """Arrays of meshes of a million millions of values that nothing fills."""
    for path in lake.rglob("zarr.json"):
        content = json.loads(path.read_text())
        if content.get("node_type") == "array":
            content["shape"] = [100_000 for _ in content["shape"]]
            path.write_text(json.dumps(content))
    for path in lake.rglob("zarr.json"):
        content = json.loads(path.read_text())
        arrays = content.get("consolidated_metadata", {}) or {}
        for array in arrays.get("metadata", {}).values():
            if array.get("node_type") == "array":
                array["shape"] = [100_000 for _ in array["shape"]]
        path.write_text(json.dumps(content))


def _versions(lake: Path) -> None:
    for path in (lake / "refs").rglob("*"):
        if path.is_file():
            path.write_text(path.read_text().replace("1", "1" + "0" * 25))


def _sizes(lake: Path) -> None:
    for path in (lake / "catalog" / "_delta_log").glob("*.json"):
        lines = [json.loads(line) for line in path.read_text().splitlines()]
        for line in lines:
            if "add" in line:
                line["add"]["size"] = 10**25
                line["add"]["stats"] = '{"numRecords": 1' + "0" * 30 + "}"
        path.write_text("".join(json.dumps(line) + "\n" for line in lines))


def _recipes() -> list[Subject]:
    """Recipes with one number for all numbers."""

    def subject(form: str, huge: bytes) -> Subject:
        text, read = FORMS[form]

        def act(_: Any, folder: Path) -> None:
            read(NUMBER.sub(huge, text.encode()).decode(), folder)

        return Subject(name=f"{form}, all numbers {huge.decode()[:12]}", examples=places, act=act)

    huge = (b"100000000000000000000", b"1e308", b"nan", b"1000000000")
    return [
        subject(form, value)
        for form in ("scene", "data set", "scene made ready", "training")
        for value in huge
    ]


def subjects() -> list[Subject]:
    """All of them."""
    square = SQUARE.replace("f 1/1 2/2 3/3", "f {}/1 2/2 3/3")
    return [
        _beside("png of 16,000 px", _folder(_png, "png", side=16_000), *_PIXELS),
        _beside("png of 9,000 px in 16 bits", _folder(_png, "png", side=9_000, depth=16), *_PIXELS),
        _beside("tiff of 100,000 px", _folder(_tiff, "tiff"), *_PIXELS),
        _beside("sized.gif", _sized_gif, *_STARTS),
        _beside("counted.mp4", _counted_film, *_STARTS),
        _beside("years.mp4", _long_frames, *_STARTS),
        _beside("markers.parquet", _table, "--rate", "25"),
        _beside("far.xlsx", _far, "--zone", "UTC"),
        _beside("blank.xlsx", _blank, "--zone", "UTC"),
        _beside("names.xlsx", _zipped_names, "--zone", "UTC"),
        _beside("lz4.mcap", _lying_mcap(CompressionType.LZ4), doctor=True),
        _beside("zstd.mcap", _lying_mcap(CompressionType.ZSTD), doctor=True),
        _beside("honest.mcap", _honest_mcap, doctor=True),
        _beside("depth.json", _json_depth),
        _beside("depth.jsonl", _deep_lines),
        _beside("line.csv", _long_line),
        _beside("numbers.csv", _wide_numbers),
        _beside("years.csv", _years_apart),
        _beside("text.csv.gz", _zipped_text),
        _beside("zeros.csv.gz", _zipped_zeros),
        _beside("huge.nc", _netcdf),
        _beside("index", _obj(square.format(10**18))),
        _beside("index backward", _obj(square.format(-(10**18)))),
        _beside("coordinates", _obj(SQUARE.replace("v 1", "v 1e308") + "v 1e400 nan inf\n")),
        _beside("polygon", _obj(SQUARE + "f " + " ".join(["1/1"] * 2_000_000) + "\n")),
        _beside("conf", _conf),
        _beside("lerobot", _lerobot),
        _in_lake("shapes of meshes", _shapes),
        _in_lake("versions of refs", _versions),
        _in_lake("sizes in the log", _sizes),
        *_recipes(),
    ]
