"""Mutated files of every kind that comes in: films, pictures, logs, workbooks, MCAP, bags, meshes,
markers, LeRobot."""

from __future__ import annotations

import base64
import datetime as dt
import gzip
import importlib
import io
import json
import shutil
import zipfile
from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
from hypothesis import strategies as st
from mcap.writer import CompressionType, Writer
from PIL import Image

from flagdata.lake import Lake
from tests.studies.hostile.campaign import Subject, command
from tests.studies.hostile.inputs import write_film
from tests.studies.hostile.lakes import made as sound_lake
from tests.studies.hostile.mutations import inside, mutated, mutations, places
from tests.studies.hostile.recipes import SQUARE
from tests.studies.hostile.sound import sound

START = "2026-05-01T10:00:00Z"
_NOON = 1_777_636_800_000_000_000  # 2026-05-01T12:00:00Z
_FRAME = Fraction(1, 25)
_ROS2 = Path(__file__).parents[2] / "flagdata" / "ingest" / "mcap" / "ros2.mcap"
_FILMS = {
    "film.mp4": "libx264",
    "film.mov": "mjpeg",
    "film.mkv": "ffv1",
    "film.avi": "mjpeg",
    "film.ts": "libx264",
    "film.webm": "libvpx",
    "film.mpg": "mpeg2video",
    "film.m4v": "mpeg4",
}
_STILLS = {"png": "PNG", "jpg": "JPEG", "tiff": "TIFF", "webp": "WEBP", "bmp": "BMP"}
_ROWS = [[f"2026-05-01 12:00:{k:02d}", 5 + k % 7 / 10, 200 + k % 9] for k in range(60)]
_CSV = "time,wind_speed (m/s),wind_direction (deg)\n" + "".join(
    f"{t}Z,{v},{d}\n" for t, v, d in _ROWS
)
_TEXTS = {
    "log.csv": _CSV,
    "log.jsonl": "".join(
        json.dumps({"time": f"{t}Z", "wind_speed (m/s)": v}) + "\n" for t, v, _ in _ROWS
    ),
    "log.json": json.dumps(
        [{"time": f"{t}Z", "wind_speed": v, "unit": "m/s"} for t, v, _ in _ROWS]
    ),
    "log.xml": "<log>"
    + "".join(f'<r time="{t}Z" speed_ms="{v}"/>' for t, v, _ in _ROWS)
    + "</log>",
    "log.nmea": "\n".join(
        f"$GPZDA,1200{k:02d}.00,01,05,2026,00,00\n$WIMWV,{200 + k},T,5.1,M,A" for k in range(40)
    ),
    "log.html": "<html><table>"
    + "".join(f"<tr><td>{t}<td>{v}</tr>" for t, v, _ in _ROWS)
    + "</table></html>",
    "log.rtf": "{\\rtf1 " + _CSV + "}",
    "markers.csv": "\n".join(
        [
            "marker,u,v,x,y,z,frame",
            *(f"{m},{m % 3},{m // 3},0.1,0.2,0.3,{f}" for f in range(3) for m in range(9)),
        ]
    ),
    "mesh.ply": "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float "
    "y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 "
    "1 2\n",
    "mesh.stl": "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 "
    "0\nendloop\nendfacet\n"
    "endsolid a\n",
    "drive.bag": "#ROSBAG V2.0\nE\x00\x00\x00",
}


def _grays() -> list[np.ndarray]:
    column = np.arange(64)
    return [
        (
            40 + 150 * (np.abs(column - 32 - 12 * np.sin(np.arange(48)[:, None] / 9 + k / 4)) < 4)
        ).astype(np.uint8)
        for k in range(12)
    ]


def _text(path: Path) -> None:
    path.write_text(_TEXTS[path.name])


def _film(path: Path) -> None:
    write_film(path, _FILMS[path.name])


def _fragmented(path: Path) -> None:
    with av.open(
        str(path), "w", format="mp4", options={"movflags": "frag_keyframe+empty_moov"}
    ) as container:
        stream: Any = container.add_stream("libx264", rate=25)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        for gray in _grays():
            container.mux(
                stream.encode(
                    av.VideoFrame.from_ndarray(gray, format="gray").reformat(format="yuv420p")
                )
            )
        container.mux(stream.encode(None))


def _gif(path: Path) -> None:
    first, *others = map(Image.fromarray, _grays())
    first.save(path, save_all=True, append_images=others, duration=40)


def _pictures(kind: str, *, deep: bool = False) -> Callable[[Path], None]:
    def write(folder: Path) -> None:
        folder.mkdir()
        for k, gray in enumerate(_grays()):
            image = Image.fromarray(gray.astype(np.uint16) * 200) if deep else Image.fromarray(gray)
            image.save(folder / f"{k:04d}.{kind}", _STILLS[kind])

    return write


def _workbook(path: Path) -> None:
    book = importlib.import_module("openpyxl").Workbook()
    book.active.append(["time", "wind_speed (m/s)", "wind_direction (deg)"])
    for stamp, speed, direction in _ROWS:
        book.active.append([dt.datetime.fromisoformat(stamp), speed, direction])
    book.save(path)


def _opendocument(path: Path) -> None:
    rows = "".join(
        f"<table:table-row><table:table-cell>{v}</table:table-cell></table:table-row>"
        for _, v, _ in _ROWS
    )
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("mimetype", "application/vnd.oasis.opendocument.spreadsheet")
        archive.writestr(
            "content.xml", f"<office:document-content>{rows}</office:document-content>"
        )


def _netcdf(path: Path) -> None:
    xarray = importlib.import_module("xarray")
    speed = ("time", 5 + np.sin(np.arange(60.0)), {"standard_name": "wind_speed", "units": "m s-1"})
    time = ("time", np.arange(60.0), {"units": "seconds since 2026-05-01 10:00:00"})
    xarray.Dataset({"speed": speed}, coords={"time": time}).to_netcdf(path, engine="scipy")


def _mcap(packing: CompressionType, *, chunked: bool = True) -> Callable[[Path], None]:
    """Pictures and a wind in JSON without checksums, so that what is mutated is looked at."""

    def write(path: Path) -> None:
        with path.open("wb") as stream:
            writer = Writer(
                stream,
                compression=packing,
                enable_crcs=False,
                use_chunking=chunked,
                chunk_size=4096,
            )
            writer.start()
            channels = {
                name: writer.register_channel(
                    topic=topic,
                    message_encoding="json",
                    schema_id=writer.register_schema(name=name, encoding="jsonschema", data=b"{}"),
                )
                for topic, name in (("/camera", "foxglove.CompressedImage"), ("/wind", "own.Wind"))
            }
            for k, gray in enumerate(_grays()):
                at = _NOON + k * 40_000_000
                coded = io.BytesIO()
                Image.fromarray(gray).save(coded, "PNG")
                stamp = {"sec": at // 10**9, "nsec": at % 10**9}
                picture = {
                    "timestamp": stamp,
                    "format": "png",
                    "data": base64.b64encode(coded.getvalue()).decode(),
                }
                for name, message in (
                    ("foxglove.CompressedImage", picture),
                    ("own.Wind", {"timestamp": stamp, "speed": 5.0 + k}),
                ):
                    writer.add_message(channels[name], at, json.dumps(message).encode(), at)
            writer.finish()

    return write


def _bag(folder: Path) -> None:
    folder.mkdir()
    _mcap(CompressionType.ZSTD)(folder / "bag_0.mcap")
    (folder / "metadata.yaml").write_text(
        "rosbag2_bagfile_information:\n  version: 8\n  storage_identifier: mcap\n  "
        "relative_file_paths:\n"
        "    - bag_0.mcap\n"
    )


def _meshes(folder: Path) -> None:
    folder.mkdir()
    for k in range(3):
        (folder / f"{k:04d}_00.obj").write_text(SQUARE.replace("1", f"1.{k}", 2))
    (folder / "conf.json").write_text(
        json.dumps({"frame_time": 0.04, "frame_steps": 8, "wind": {"velocity": [3, 4]}})
    )


def _exported(form: str) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        command(
            "export", form, "--to", path, "--where", "kind = 'recording'", "--lake", sound_lake()
        )

    return write


def _files(path: Path) -> list[Path]:
    return [path] if path.is_file() else sorted(one for one in path.rglob("*") if one.is_file())


def _subject(
    name: str,
    write: Callable[[Path], object],
    commands: Sequence[Sequence[str]],
    *,
    title: str | None = None,
) -> Subject:
    """A file or folder, one file of which is mutated, and the commands that read it, each.

    Args:
        commands: of which FILE and LAKE stand for the file and for a new lake.
    """

    def act(example: Any, folder: Path) -> None:
        place, deeper, changes = example
        whole = sound(name, write)
        path = folder / name
        (shutil.copytree if whole.is_dir() else shutil.copy)(whole, path)
        files = _files(path)
        victim = files[int(place * len(files))]
        change = inside(victim.name) if deeper else mutated
        victim.write_bytes(change(victim.read_bytes(), changes))
        Lake.create(folder / "lake")
        words = {"FILE": path, "LAKE": folder / "lake", "NEW": folder / "new.mcap"}
        errors: list[Exception] = []
        for arguments in commands:
            try:
                command(*(words.get(word, word) for word in arguments))
            except Exception as error:  # noqa: BLE001  of several commands the worst is reported
                errors.append(error)
        if errors:
            raise max(
                errors, key=lambda error: getattr(error, "kind", "unforeseen") == "unforeseen"
            )

    return Subject(
        name=title or name,
        examples=st.tuples(places, st.booleans(), mutations),
        act=act,
        prepare=lambda: sound(name, write),
    )


def subjects() -> list[Subject]:
    """Every kind of file."""
    sniffed = ["ingest", "FILE", "--sniff", "--json"]
    ingested = ["ingest", "FILE", "--lake", "LAKE", "--json"]
    log = [sniffed, [*ingested, "--zone", "UTC"]]
    film = [sniffed, [*ingested, "--start", START]]
    folder = [sniffed, [*ingested, "--start", START, "--sequence-fps", "25"]]
    chosen = [*ingested, "--topic"]
    topics = [
        sniffed,
        [*chosen, "/camera"],
        [*chosen, "/wind", "--unit", "m/s"],
        ["doctor", "FILE"],
        ["recover", "FILE", "NEW", "--lake", "LAKE"],
    ]
    logs: dict[str, Callable[[Path], object]] = {
        "log.xlsx": _workbook,
        "log.ods": _opendocument,
        "log.nc": _netcdf,
        "log.csv.gz": lambda path: path.write_bytes(gzip.compress(_CSV.encode())),
        "wide.csv": lambda path: path.write_text(_CSV, encoding="utf-16"),
    }
    return [
        *(_subject(name, _film, film) for name in _FILMS),
        _subject("fragmented.mp4", _fragmented, film),
        _subject("film.gif", _gif, film),
        *(_subject(f"pictures-{kind}", _pictures(kind), folder) for kind in _STILLS),
        _subject("pictures-16", _pictures("png", deep=True), folder),
        *(
            _subject(name, _text, [sniffed, ingested] if name == "log.nmea" else log)
            for name in _TEXTS
            if name != "markers.csv"
        ),
        *(_subject(name, write, log) for name, write in logs.items()),
        _subject("markers.csv", _text, [sniffed, [*ingested, "--rate", "25"]]),
        _subject("packed.mcap", _mcap(CompressionType.LZ4), topics),
        _subject("zstd.mcap", _mcap(CompressionType.ZSTD), topics),
        _subject("plain.mcap", _mcap(CompressionType.NONE), topics),
        _subject("loose.mcap", _mcap(CompressionType.NONE, chunked=False), topics),
        _subject(
            "ros2.mcap",
            lambda path: shutil.copy(_ROS2, path),
            [
                sniffed,
                [*chosen, "/compressed"],
                ["doctor", "FILE"],
                ["recover", "FILE", "NEW", "--lake", "LAKE"],
            ],
        ),
        _subject("bag", _bag, [sniffed, [*chosen, "/camera"], ["doctor", "FILE"]]),
        _subject("meshes", _meshes, [sniffed, ingested]),
        _subject("lerobot", _exported("lerobot"), [sniffed, ingested, ["doctor", "FILE"]]),
        _subject(
            "exported.mcap",
            _exported("mcap"),
            [sniffed, ingested, ["doctor", "FILE"]],
            title="exported MCAP",
        ),
    ]
