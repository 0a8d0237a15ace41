"""Hostile lakes: files of refs, log, catalog and objects damaged, emptied, lost, or replaced by
what is no file."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path
from typing import Any

from hypothesis import strategies as st

from flagdata.lake import Lake
from tests.compat.make_lake import fill
from tests.damage import damaged, damages, edited, edits
from tests.studies.hostile.campaign import Subject, command
from tests.studies.hostile.sound import sound

PLACES = st.floats(0, 1, exclude_max=True)
PARTS = {
    "marker": ["lake.json"],
    "refs": ["refs"],
    "log": ["catalog/_delta_log"],
    "catalog": ["catalog"],
    "objects": ["mcap", "zarr"],
    "any file": [""],
}
LOSSES = st.sampled_from(["empty", "gone", "folder", "pipe", "device", "loop", "elsewhere", "twin"])
harms = st.lists(
    st.tuples(
        PLACES,
        st.one_of(
            st.tuples(st.just("bytes"), damages),
            st.tuples(st.just("values"), edits),
            st.tuples(st.just("file"), LOSSES),
        ),
    ),
    min_size=1,
    max_size=3,
)
"""Which file of a part, each by its place among them, and what is done to it."""
_TO = ["--to", "out", "--where"]
READERS: list[list[object]] = [
    ["ls", "--json"],
    ["ls", "--at", "v1"],
    ["log"],
    ["doctor"],
    ["doctor", "--deep", "--json"],
    ["verify", "--json"],
    ["show", "field", "--json"],
    ["query", "--where", "wind > 1", "--json"],
    ["query", "--sql", "select kind, count(*) from catalog group by kind"],
    ["diff", "v1", "main"],
    ["branch"],
    ["gc", "--dry-run", "--older-than", "0s"],
    ["export", "csv", *_TO, "kind = 'recording'"],
    ["export", "parquet", "--to", "out"],
    ["export", "webdataset", *_TO, "kind = 'clip'"],
    ["export", "mcap", *_TO, "kind = 'recording'"],
    ["export", "mp4", *_TO, "kind = 'recording'"],
    ["export", "obj", "--at", "simulated", *_TO, "kind = 'meshes'"],
]
WRITERS: list[list[object]] = [
    ["tag", "v2"],
    ["branch", "more"],
    ["merge", "simulated"],
    ["withdraw", "field", "-m", "wrong"],
    ["gc", "--older-than", "0s"],
    ["ingest", "log.csv"],
    ["init"],
]


def made() -> Path:
    """A sound lake."""
    return sound("lake", lambda path: fill(Lake.create(path)))


def _files(lake: Path, part: str) -> list[Path]:
    return sorted(
        path
        for name in PARTS[part]
        for path in ([lake / name] if (lake / name).is_file() else (lake / name).rglob("*"))
        if path.is_file() and not path.is_symlink()
    )


def harm(lake: Path, part: str, changes: list[Any]) -> None:
    """Do that damage to files of a part of the lake."""
    for place, (kind, what) in changes:
        files = _files(lake, part)
        if not files:
            return
        path = files[int(place * len(files))]
        data = path.read_bytes()
        if kind == "bytes":
            path.write_bytes(damaged(data, what))
        elif kind == "values":
            _other_values(path, data, what)
        else:
            _replace(path, lake, what)


def _other_values(path: Path, data: bytes, edit: Any) -> None:
    """Other values in a file of JSON, or in one of its lines; other files get their bytes cut in
    half."""
    try:
        lines = (
            [json.loads(line) for line in data.decode().splitlines()]
            if path.suffix == ".json"
            else []
        )
    except ValueError:
        try:
            lines = [json.loads(data)]
        except ValueError:
            lines = []
    if not lines:
        path.write_bytes(data[: len(data) // 2])
        return
    path.write_text("\n".join(json.dumps(line) for line in edited(lines, edit)))


def _replace(path: Path, lake: Path, by: str) -> None:
    data = path.read_bytes()
    path.unlink()
    if by == "empty":
        path.write_bytes(b"")
    elif by == "folder":
        path.mkdir()
    elif by == "pipe":
        os.mkfifo(path)
    elif by == "device":
        path.symlink_to("/dev/zero")
    elif by == "loop":
        path.symlink_to(path)
    elif by == "elsewhere":
        (lake.parent / "victim").write_bytes(data)
        path.symlink_to(lake.parent / "victim")
    elif by == "twin":
        path.write_bytes(data)
        os.link(path, path.with_name(f"{path.name} copy"))


def _act(part: str) -> Any:
    def act(example: Any, folder: Path) -> None:
        changes, commands = example
        lake = folder / "lake"
        shutil.copytree(made(), lake)
        (folder / "log.csv").write_text(
            "time,wind_speed (m/s)\n2026-05-01T12:00:00Z,5.0\n2026-05-01T12:00:01Z,5.1\n"
        )
        harm(lake, part, changes)
        errors: list[BaseException] = []
        for arguments in commands:
            given = [
                folder / str(word) if word in ("out", "log.csv") else word for word in arguments
            ]
            shutil.rmtree(folder / "out", ignore_errors=True)
            try:
                command(*given, *([lake] if arguments == ["init"] else ["--lake", lake]))
            except Exception as error:  # noqa: BLE001  of several commands the worst is reported
                errors.append(error)
        if errors:
            raise max(
                errors, key=lambda error: getattr(error, "kind", "unforeseen") == "unforeseen"
            )

    return act


def subjects() -> list[Subject]:
    """Every part of a lake, by readers and by writers."""
    return [
        Subject(
            name=f"{part}, {how}",
            act=_act(part),
            examples=st.tuples(harms, st.lists(st.sampled_from(commands), min_size=1, max_size=3)),
        )
        for part in PARTS
        for how, commands in (("read", READERS), ("written", WRITERS))
    ]
