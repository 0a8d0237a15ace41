"""Hostile films, logs, meshes, marker tables, records and sets of a challenge, each read by what
takes it."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import pyarrow as pa
import pyarrow.parquet
from hypothesis import strategies as st

from flagdata.core.provenance import file_hash
from flagdata.lake import Lake
from tests.compat.make_lake import write_record
from tests.damage import damaged, damages, edited, edits
from tests.studies.challenge.filing import Filing, file, note_opening, read
from tests.studies.challenge.folder import ChallengeFolder, data_hash, read_set, write_set
from tests.studies.hostile.campaign import Subject, command
from tests.studies.hostile.recipes import SQUARE
from tests.studies.hostile.sound import sound

_CODECS = {"mp4": "libx264", "mkv": "libx264", "mov": "mjpeg", "avi": "mjpeg", "ts": "libx264"}
_LOG = "\n".join(
    ["time,wind_speed (m/s),wind_direction (deg)"]
    + [f"2026-05-01T12:00:{k:02d}+02:00,{5 + k % 7 / 10:.2f},{200 + k % 9}" for k in range(60)]
)
_LOGS = {
    "log.csv": _LOG,
    "log.tsv": _LOG.replace(",", "\t"),
    "log.nmea": "\n".join(
        f"$GPZDA,1200{k:02d}.00,01,05,2026,00,00\n$WIMWV,{200 + k % 9},T,{5 + k % 7 / 10:.1f},M,A"
        for k in range(40)
    ),
    "log.json": json.dumps(
        [
            {"time": f"2026-05-01T10:00:{k:02d}Z", "wind_speed": 5 + k % 7 / 10, "unit": "m/s"}
            for k in range(40)
        ]
    ),
    "log.xml": "<log>"
    + "".join(
        f'<r time="2026-05-01T10:00:{k:02d}Z" speed_ms="{5 + k % 7 / 10}"/>' for k in range(40)
    )
    + "</log>",
    "log.dat": '"TOA5","s","CR6","1","2","3","4","T"\n"TIMESTAMP","RECORD","WS_ms_Avg","WindDir"\n'
    '"TS","RN","meters/second","Deg"\n"","","Avg","Smp"\n'
    + "".join(
        f'"2026-05-01 10:00:{k:02d}",{k},{5 + k % 7 / 10},{200 + k % 9}\n' for k in range(40)
    ),
}
_MARKERS = "\n".join(
    [
        "marker,u,v,x,y,z,frame",
        *(f"{m},{m % 3},{m // 3},0.1,0.2,0.3,{f}" for f in range(3) for m in range(9)),
    ]
)
_CLOTHS = (
    "film,fabric,area_weight,bending_stiffness,wind_level,wind_speed,wind_sigma\n"
    "film.mp4,felt,0.24,3e-5,,2.4,0.3\n"
)
ABOUT: dict[str, Any] = {
    "flag": {
        "width": 1.5,
        "height": 1.0,
        "material": "camel-ponte-roma",
        "pins": [[0.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
        "pin_stiffness": 1e4,
        "gravity": [0.0, 0.0, -9.81],
    },
    "rate": 25.0,
    "noise": 0.001,
    "recordings": [
        {"name": "a", "wind": {"times": [0.0, 0.4], "velocity": [[4.0, 0.0, 0.0], [4.0, 0.0, 0.0]]}}
    ],
}

_ARRAYS = ["markers.npy", "a.npy"]
_NAMES = ["film.mp4", "log.csv", "cloths.csv", "markers.csv", "scene.toml", "record.mcap"]
WORDS = st.sampled_from(
    [
        "",
        "nan",
        "inf",
        "-inf",
        "1e308",
        "-1e400",
        "9" * 400,
        "-0.0",
        "\x00",
        "\ufeff",
        "\u202e",
        '"',
        "'",
        '""',
        "\r",
        ";",
        ",,,,",
        "\t",
        "<",
        "&amp;",
        "]",
        "}",
        "0001-01-01T00:00:00Z",
        "9999-12-31T23:59:59Z",
        "2026-02-30",
        "x" * 70_000,
        "1" + "0" * 30,
        "٣",
        "½",
        "=cmd|' /C calc'!A0",
        "1,5",
        "$",
    ],
)
PLACES = st.floats(0, 1, exclude_max=True)
rewordings = st.lists(
    st.tuples(
        st.sampled_from(("word", "line", "doubled", "before", "swapped")), PLACES, PLACES, WORDS
    ),
    min_size=1,
    max_size=4,
)
"""What is done to a text, one after another: a word or a line replaced, lines doubled, put before
or swapped."""


def reworded(text: str, changes: list[tuple[str, float, float, str]]) -> str:
    """The text with those changes; words are what commas, blanks and quotes leave."""
    lines = text.split("\n")
    for kind, place, other, word in changes:
        row, second = int(place * len(lines)), int(other * len(lines))
        if kind == "word":
            separator = next((sign for sign in (",", "\t", " ") if sign in lines[row]), ",")
            cells = lines[row].split(separator)
            cells[int(other * len(cells))] = word
            lines[row] = separator.join(cells)
        elif kind == "line":
            lines[row] = word
        elif kind == "doubled":
            lines[row:row] = lines[row : row + 1 + int(other * 40)]
        elif kind == "before":
            lines.insert(row, word)
        else:
            lines[row], lines[second] = lines[second], lines[row]
    return "\n".join(lines)


def reencoded(example: Any, text: str) -> bytes:
    """The text after a rewording in an encoding, then with its bytes damaged."""
    changes, encoding, damage = example
    data = reworded(text, changes).encode(encoding, "replace")
    return data if damage is None else damaged(data, damage)


texts = st.tuples(
    rewordings,
    st.sampled_from(["utf-8", "utf-8", "utf-8", "utf-16", "latin-1"]),
    st.one_of(*[st.none()] * 3, damages),
)


def made(name: str) -> bytes:
    """A sound file of that name."""
    return sound(name, _write).read_bytes()


def _write(path: Path) -> None:
    kind = path.suffix[1:]
    if kind in _CODECS:
        write_film(path, _CODECS[kind])
    elif kind == "mcap":
        write_record(path)
    elif kind == "parquet":
        rows = [line.split(",") for line in _MARKERS.split("\n")]
        columns = dict(zip(rows[0], zip(*rows[1:], strict=True), strict=True))
        arrays = {
            n: list(v) if n == "marker" else [int(float(x)) for x in v] for n, v in columns.items()
        }
        pyarrow.parquet.write_table(pa.table(arrays), path)


def write_film(path: Path, codec: str) -> None:
    with av.open(str(path), "w") as container:
        container.metadata["creation_time"] = "2026-05-01T10:00:00Z"
        stream = container.add_stream(codec, rate=25)
        stream.width, stream.height, stream.pix_fmt = (
            64,
            48,
            "yuvj420p" if codec == "mjpeg" else "yuv420p",
        )
        stream.codec_context.time_base = Fraction(1, 25)
        stream.codec_context.thread_count = 1
        column, row = np.meshgrid(np.arange(64), np.arange(48))
        for k in range(40):
            bar = np.abs(column - 32 - 12 * np.sin(row / 9 + k / 4)) < 4
            frame = av.VideoFrame.from_ndarray(
                (40 + row + 150 * bar).astype(np.uint8), format="gray"
            )
            frame = frame.reformat(format=stream.pix_fmt, threads=1)
            frame.pts = k
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))


def _ingested(path: Path, *options: object) -> None:
    lake = Lake.create(path.parent / "lake")
    command("ingest", path, "--sniff", "--json")
    command("ingest", path, "--lake", lake.path, "--json", *options)


def _file(name: str, *options: object) -> Subject:
    def act(damage: Any, folder: Path) -> None:
        path = folder / name
        path.write_bytes(damaged(made(name), damage))
        _ingested(path, *options)

    return Subject(name=name, examples=damages, act=act)


def _text(name: str, text: str, *options: object) -> Subject:
    def act(example: Any, folder: Path) -> None:
        path = folder / name
        path.write_bytes(reencoded(example, text))
        _ingested(path, *options)

    return Subject(name=name, examples=texts, act=act)


def _pictures(example: Any, folder: Path) -> None:
    place, damage = example
    pictures = folder / "pictures"
    pictures.mkdir()
    with av.open(io.BytesIO(made("film.mov"))) as container:
        for k, packet in enumerate(p for p in container.demux(video=0) if p.size):
            (pictures / f"{k:04d}.jpg").write_bytes(bytes(packet))
    names = sorted(pictures.iterdir())
    victim = names[int(place * len(names))]
    victim.write_bytes(damaged(victim.read_bytes(), damage))
    _ingested(pictures, "--sequence-fps", "25", "--start", "2026-05-01T10:00:00Z")


def _meshes(example: Any, folder: Path) -> None:
    place, change, configuration = example
    run = folder / "run"
    run.mkdir()
    for k in range(3):
        (run / f"{k:04d}_00.obj").write_text(SQUARE.replace("1", f"1.{k}", 2))
    content: Any = {"frame_time": 0.04, "frame_steps": 8, "wind": {"velocity": [3, 4, 0]}}
    (run / "conf.json").write_text(
        json.dumps(edited(content, configuration) if configuration else content)
    )
    victim = run / f"{int(place * 3):04d}_00.obj"
    victim.write_bytes(reencoded(change, victim.read_text()))
    _ingested(run)


def _replaced(kind: str) -> Callable[[Any, Path], None]:
    """A source that is no file: a folder, a device or a pipe in its place."""

    def act(name: str, folder: Path) -> None:
        import os

        path = folder / name
        if kind == "pipe":
            os.mkfifo(path)
        elif kind == "folder":
            path.mkdir()
        else:
            path.symlink_to("/dev/zero")
        if name == "cloths.csv":
            command("declare-cloths", path, "--lake", Lake.create(folder / "lake").path)
        elif name.endswith(".toml"):
            command("simulate", path, "--lake", Lake.create(folder / "lake").path)
        else:
            _ingested(path)

    return act


def _cloths(example: Any, folder: Path) -> None:
    (folder / "film.mp4").write_bytes(made("film.mp4"))
    (folder / "cloths.csv").write_bytes(reencoded(example, _CLOTHS))
    command(
        "declare-cloths",
        folder / "cloths.csv",
        "--lake",
        Lake.create(folder / "lake").path,
        "--json",
    )


def _recovered(damage: Any, folder: Path) -> None:
    path = folder / "cut.mcap"
    path.write_bytes(damaged(made("record.mcap"), damage))
    command("recover", path, folder / "saved.mcap", "--lake", folder)


def write_small_set(folder: Path) -> None:
    """A set of one recording of six markers in ten frames."""
    markers = np.stack([np.tile([0.1, 0.7, 1.4], 2), np.repeat([0.2, 0.8], 3)], axis=1)
    track = np.zeros((10, 6, 3), dtype=np.float32)
    track[..., [0, 2]] = markers
    write_set(folder, about=ABOUT, markers=markers, positions={"a": track})


def _set(example: Any, folder: Path) -> None:
    edit, victim, damage = example
    target = folder / "set-001"
    write_small_set(target)
    if edit:
        (target / "set.json").write_text(json.dumps(edited(ABOUT, edit)))
    if victim:
        (target / victim).write_bytes(damaged((target / victim).read_bytes(), damage))
    read_set(target)


def _challenge(example: Any, folder: Path) -> None:
    """A challenge of one set with a filed verdict, its public files with other values; the
    verdict's hash fits."""
    name, edit = example
    whole = ChallengeFolder(folder / "challenge")
    write_small_set(whole.data("set-001"))
    data = data_hash(whole.data("set-001"))
    whole.public.write_text(
        json.dumps({"title": "t", "sets": {"set-001": {"data": data, "commitment": "0" * 64}}})
    )
    refusal = {"kind": "bad-input", "what": "w", "where": None, "fix": "f"}
    file(
        whole, Filing(name="set-001", data=data, seed=1, verdict=None, refusal=refusal, seconds=1.0)
    )
    note_opening(whole, ["set-001"])
    path = whole.path / name
    path.write_text(json.dumps(edited(json.loads(path.read_text()), edit)))
    whole.verdict_hash("set-001").write_text(file_hash(whole.verdict("set-001")) + "\n")
    whole.experiment(whole.chosen(())[0])
    read(whole, "set-001")


def _npy(example: Any, folder: Path) -> None:
    """Headers of NumPy's files that state another shape or type."""
    header, victim = example
    write_small_set(folder / "set-001")
    data = (folder / "set-001" / victim).read_bytes()
    text = header.ljust(len(data) - 11 if len(data) < 130 else 117)[:117] + "\n"
    (folder / "set-001" / victim).write_bytes(
        b"\x93NUMPY\x01\x00" + len(text).to_bytes(2, "little") + text.encode() + data[128:]
    )
    read_set(folder / "set-001")


HEADERS = st.builds(
    lambda descr, order, shape: (
        f"{{'descr': {descr!r}, 'fortran_order': {order}, 'shape': {shape}, }}"
    ),
    st.sampled_from(["<f4", "<f8", "|O", "<U1000000", "<i8", "|V8", "<M8[ns]", "<c16", "|b1", "x"]),
    st.sampled_from(["False", "True", "None"]),
    st.sampled_from(
        [
            "(10, 6, 3)",
            "(6, 2)",
            "()",
            "(0,)",
            "(0, 6, 3)",
            "(1000000000000,)",
            "(10, 6, -3)",
            "(1 << 62, 6, 3)",
            "None",
        ]
    ),
)


def subjects() -> list[Subject]:
    """All that a user brings."""
    members = st.sampled_from(["markers.npy", "a.npy", "set.json"])
    return [
        *(_file(f"film.{kind}") for kind in _CODECS),
        Subject(name="folder of pictures", examples=st.tuples(PLACES, damages), act=_pictures),
        *(_text(name, text) for name, text in _LOGS.items()),
        Subject(
            name="folder of meshes",
            examples=st.tuples(PLACES, texts, st.one_of(st.none(), edits)),
            act=_meshes,
        ),
        _text("markers.csv", _MARKERS, "--rate", "25"),
        _file("markers.parquet", "--rate", "25"),
        _file("record.mcap"),
        Subject(name="recover", examples=damages, act=_recovered),
        Subject(name="declare-cloths", examples=texts, act=_cloths),
        Subject(
            name="set of a challenge",
            examples=st.tuples(st.one_of(st.none(), edits), members, damages),
            act=_set,
        ),
        Subject(
            name="set of a challenge, other values",
            examples=st.tuples(edits, st.none(), st.none()),
            act=_set,
        ),
        Subject(
            name="folder of a challenge",
            act=_challenge,
            examples=st.tuples(
                st.sampled_from(["challenge.json", "opened.json", "verdicts/set-001.json"]), edits
            ),
        ),
        Subject(
            name="header of NumPy", examples=st.tuples(HEADERS, st.sampled_from(_ARRAYS)), act=_npy
        ),
        *(
            Subject(
                name=f"{kind} in place of a file",
                act=_replaced(kind),
                examples=st.sampled_from(_NAMES),
            )
            for kind in ("folder", "pipe", "device")
        ),
    ]
