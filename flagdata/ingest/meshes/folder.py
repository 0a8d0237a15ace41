"""ArcSim output folders: `NNNN_00.obj` a frame, and `conf.json` with the scene that made them."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.core.arrays import IntArray
from flagdata.core.files.regular_files import check_input, is_beside
from flagdata.core.numbered import Ordinal, gap
from flagdata.errors import InputError, LimitError, NotFoundError
from flagdata.ingest.meshes.others import FIX
from flagdata.ingest.meshes.wavefront import Obj, obj_text, read_obj
from flagdata.lake.mesh_sequences import MeshSequence, RaggedMeshSequence
from flagdata.recipes.documents import SIZE_LIMIT, from_json
from flagdata.timebase import NANOSECONDS

FRAME_LIMIT = 100_000
_LATEST = 1e9
"""Latest frame [s]: the times of a sequence are counted in nanoseconds."""
_LAST = 2**53
"""Highest number of a frame: its time is a float's multiple of it."""
_ONLY = Ordinal.read("0")
"""The number of a folder's one cloth."""
_FRAME = re.compile(r"(\d{4,})_(\d{2,})\.obj")
_CONFIGURATION = "conf.json"


def read_json(path: Path) -> dict[str, Any]:
    """Reads a JSON object with `//` comments, as ArcSim's files have.

    Raises:
        NotFoundError: no such file.
        InputError: not such a file.
        LimitError: larger than any scene.
    """
    check_input(path, limit=SIZE_LIMIT)
    text = path.read_text(encoding="utf-8-sig", errors="replace")
    # A string, kept, or a comment up to the end of its line, dropped.
    bare = re.sub(
        r'"(?:[^"\\]|\\.)*"|//[^\n]*', lambda m: m[0] if m[0].startswith('"') else "", text
    )
    try:
        content = from_json(bare)
    except ValueError as error:
        raise InputError(
            f"the file is not JSON: {error}", where=str(path), fix="correct the file"
        ) from None
    if not isinstance(content, dict):
        raise InputError(
            "the file holds no JSON object", where=str(path), fix="give a file of the form {…}"
        )
    return content


def read_folder(
    path: Path,
    *,
    rate: float | None = None,
    metre: float = 1.0,
    progress: Callable[[int], object] | None = None,
) -> MeshSequence | RaggedMeshSequence:
    """Reads a sequence of one cloth; ragged if the topology changes. Frame n is at n frame times
    from 0.

    The frames are the files `NNNN_00.obj`; in a folder without such, all `.obj` files, which must
    then differ in one number only ("flag_001.obj"). The rest shape is their texture coordinates, in
    metres.

    Args:
        rate: frames a second [Hz]; None for 1/`frame_time` of conf.json.
        metre: how many metres the unit of the positions has. Texture coordinates are not touched.
        progress: called with 1 for each frame.

    Raises:
        NotFoundError: no folder, no frames, or neither rate nor conf.json.
        InputError: frames missing in between, several cloths, a malformed file or frame time, no
            texture coordinates.
        LimitError: more than `FRAME_LIMIT` frames.
    """
    if not path.is_dir():
        raise NotFoundError(
            "there is no such folder", where=str(path), fix="name the folder with the .obj files"
        )
    numbered = frame_files(path)
    configured = (path / _CONFIGURATION).is_file()
    if rate is None and not configured:
        raise NotFoundError(
            f"no {_CONFIGURATION}, so that the frame rate is not known",
            where=str(path),
            fix="give it by --rate",
        )
    configuration = read_json(path / _CONFIGURATION) if configured else None
    frame_time = _frame_time(configuration or {}, path) if rate is None else 1 / rate
    frames: list[Obj] = []
    for _, entry in numbered:
        frame = read_obj(entry)
        if not frame.textured:
            raise InputError(
                "no texture coordinates (vt), so that the rest shape is not known",
                where=str(entry),
                fix="export the mesh with texture coordinates in metres",
            )
        frames.append(frame)
        if progress is not None:
            progress(1)
    return _sequence(
        frames, [n for n, _ in numbered], frame_time, metre, configuration, where=str(path)
    )


def frame_files(path: Path) -> list[tuple[int, Path]]:
    """Lists the frames of a folder with their numbers, in order.

    Raises:
        NotFoundError: there are none.
        InputError: numbers missing in between or twice, several cloths, or names that are no
            sequence.
        LimitError: more than `FRAME_LIMIT`.
    """
    entries = sorted(
        entry for entry in path.iterdir() if entry.is_file() and not is_beside(entry.name)
    )
    frames_of_cloths = [
        (Ordinal.read(m[1]), Ordinal.read(m[2]), entry)
        for entry in entries
        if (m := _FRAME.fullmatch(entry.name)) is not None
    ]
    if not frames_of_cloths:
        frames_of_cloths = _number_frames(
            [entry for entry in entries if entry.suffix.lower() == ".obj"], path
        )
    if len(frames_of_cloths) > FRAME_LIMIT:
        raise LimitError(
            f"the folder has {len(frames_of_cloths)} frames",
            where=str(path),
            fix=f"at most {FRAME_LIMIT} are read",
        )
    cloths = {cloth for _, cloth, _ in frames_of_cloths}
    if cloths != {_ONLY}:
        raise InputError(
            f"{len(cloths)} cloths, numbered {', '.join(f'{c:02d}' for c in sorted(cloths))}",
            where=str(path),
            fix="keep one cloth's files, NNNN_00.obj, in a folder",
        )
    ordered = sorted((number, entry) for number, _, entry in frames_of_cloths)
    numbers = [number for number, _ in ordered]
    if (missing := gap(numbers)) is not None:
        raise InputError(
            f"{missing.count} frames are missing, the first after frame {missing.after:04d}",
            where=str(path),
            fix="copy them, or cut there; number the files 1, 2, 3, … if their numbers do not "
            "count frames",
        )
    if len(set(numbers)) < len(numbers):
        twice = next(a for a, b in pairwise(numbers) if a == b)
        raise InputError(
            "there are two files for one frame",
            where=f"{path}, frame {twice:04d}",
            fix="keep one of them",
        )
    frames = [
        (frame, entry) for number, entry in ordered if (frame := number.up_to(_LAST)) is not None
    ]
    if len(frames) < len(ordered):
        raise LimitError(
            f"the last frame is numbered {numbers[-1]}, beyond {_LAST}",
            where=str(path),
            fix="number the frames from 0 or 1 on",
        )
    return frames


def _number_frames(entries: list[Path], path: Path) -> list[tuple[Ordinal, Ordinal, Path]]:
    """Frames of other programs: names that differ in one number."""
    if not entries:
        raise NotFoundError("there are no .obj files", where=str(path), fix=FIX)
    split = [re.split(r"(\d+)", entry.stem) for entry in entries]
    texts = {tuple(parts[::2]): entry.name for parts, entry in zip(split, entries, strict=True)}
    numbers = np.array([len(parts) // 2 for parts in split])
    if len(texts) > 1 or not numbers.all():
        odd = " and ".join(list(texts.values())[:2])
        raise InputError(
            f"the names of the .obj files are no sequence: {odd}",
            where=str(path),
            fix="name them alike, with one number that counts the frames",
        )
    columns = list(zip(*(map(Ordinal.read, parts[1::2]) for parts in split), strict=True))
    varying = [column for column in columns if len(set(column)) > 1] or columns[-1:]
    if len(varying) > 1:
        raise InputError(
            f"{len(varying)} numbers vary in the names, as in {entries[0].name} and "
            f"{entries[-1].name}: which of them "
            "counts the frames is not known",
            where=str(path),
            fix="name the files of one cloth alike, with one number that counts the frames",
        )
    return [(number, _ONLY, entry) for number, entry in zip(varying[0], entries, strict=True)]


def _frame_time(configuration: Mapping[str, Any], path: Path) -> float:
    frame_time = configuration.get("frame_time")
    if (
        isinstance(frame_time, bool)
        or not isinstance(frame_time, int | float)
        or not 0 < frame_time < 1e6
    ):
        raise InputError(
            f"frame_time is {frame_time!r}",
            where=str(path / _CONFIGURATION),
            fix="give seconds between frames",
        )
    return float(frame_time)


def _sequence(
    frames: list[Obj],
    numbers: list[int],
    frame_time: float,
    metre: float,
    configuration: Mapping[str, Any] | None,
    *,
    where: str,
) -> MeshSequence | RaggedMeshSequence:
    if numbers[-1] * frame_time > _LATEST:
        raise LimitError(
            f"frame {numbers[-1]} would be {numbers[-1] * frame_time:.3g} s after the first",
            where=where,
            fix="number the frames from 0 or 1 on",
        )
    time = np.array([round(n * frame_time * NANOSECONDS) for n in numbers], dtype=np.int64)
    attributes = (
        {"source": "obj"} if configuration is None else {"source": "arcsim", "scene": configuration}
    )
    first = frames[0]
    if all(
        np.array_equal(_sorted_faces(f.faces), _sorted_faces(first.faces))
        and np.array_equal(f.rest, first.rest)
        for f in frames
    ):
        return MeshSequence(
            time=time,
            positions=(np.stack([f.positions for f in frames]) * metre).astype(np.float32),
            faces=first.faces.astype(np.int32),
            rest=first.rest.astype(np.float32),
            attributes=attributes,
        )
    return RaggedMeshSequence(
        time=time,
        positions=(np.concatenate([f.positions for f in frames]) * metre).astype(np.float32),
        faces=np.concatenate([f.faces for f in frames]).astype(np.int32),
        rest=np.concatenate([f.rest for f in frames]).astype(np.float32),
        vertex_offset=np.cumsum([0, *(len(f.positions) for f in frames)]).astype(np.int64),
        face_offset=np.cumsum([0, *(len(f.faces) for f in frames)]).astype(np.int64),
        attributes=attributes,
    )


def _sorted_faces(faces: IntArray) -> IntArray:
    """Faces (face, 3) in one order, each from its least vertex on, with its orientation."""
    begin = faces.argmin(axis=1)[:, None]
    turned = np.take_along_axis(faces, (begin + np.arange(3)) % 3, axis=1)
    return turned[np.lexsort(turned.T[::-1])]


def write_folder(
    path: Path, sequence: MeshSequence | RaggedMeshSequence, *, scene: Mapping[str, Any]
) -> None:
    """Write a sequence as a new ArcSim output folder, which appears with the last of its files.

    Args:
        scene: what conf.json says; its `frame_time` must be the sequence's.

    Raises:
        ConflictError: there is something at `path` already.
        InputError: frames that are not evenly spaced by the scene's frame_time.
    """
    from flagdata.core.files.outputs import check_folder, fresh_folder

    check_folder(path)
    frame_time = scene.get("frame_time")
    expected = np.array(
        [round(i * float(frame_time or 0.0) * NANOSECONDS) for i in range(len(sequence))]
    )
    if not frame_time or np.abs(sequence.time - sequence.time[0] - expected).max() > 1:
        raise InputError(
            f"frames are not {frame_time!r} s apart",
            where="scene, frame_time",
            fix="give the sequence's frame time",
        )
    with fresh_folder(path) as folder:
        for index in range(len(sequence)):
            frame = sequence.frame(index)
            mesh = Obj(
                positions=frame.positions.astype(np.float64),
                faces=frame.faces.astype(np.int64),
                rest=frame.rest.astype(np.float64),
            )
            (folder / f"{index:04d}_00.obj").write_text(obj_text(mesh), encoding="utf-8")
        (folder / _CONFIGURATION).write_text(
            json.dumps(dict(scene), indent=1) + "\n", encoding="utf-8"
        )
