"""ArcSim output folders: `NNNN_00.obj` a frame, and `conf.json` with the scene that made them."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from flagdata.errors import ConflictError, InputError, LimitError, NotFoundError
from flagdata.ingest.meshes.obj import Obj, read_obj, write_obj
from flagdata.lake.meshes import MeshSequence, RaggedMeshSequence
from flagdata.timebase import NANOSECONDS

FRAME_LIMIT = 100_000
_FRAME = re.compile(r"(\d{4,})_(\d{2,})\.obj")
_CONFIGURATION = "conf.json"


def read_json(path: Path) -> dict[str, Any]:
    """A JSON object with `//` comments, as ArcSim's files have.

    Raises:
        NotFoundError: no such file.
        InputError: not such a file.
    """
    if not path.is_file():
        raise NotFoundError("no such file", where=str(path), fix="check the path")
    text = path.read_text(encoding="utf-8", errors="replace")
    # A string, kept, or a comment up to the end of its line, dropped.
    bare = re.sub(r'"(?:[^"\\]|\\.)*"|//[^\n]*', lambda m: m[0] if m[0].startswith('"') else "", text)
    try:
        content = json.loads(bare)
    except ValueError as error:
        raise InputError(f"not JSON: {error}", where=str(path), fix="correct the file") from None
    if not isinstance(content, dict):
        raise InputError("not a JSON object", where=str(path), fix="give a file of the form {…}")
    return content


def read_folder(path: Path) -> MeshSequence | RaggedMeshSequence:
    """A sequence of one cloth; ragged if the topology changes. Times count from 0 in steps of the scene's `frame_time`.

    Raises:
        NotFoundError: no folder, no frames, or no conf.json.
        InputError: frames missing in between, several cloths, a malformed file or frame time.
        LimitError: more than `FRAME_LIMIT` frames.
    """
    if not path.is_dir():
        raise NotFoundError("no such folder", where=str(path), fix="name the folder with the NNNN_00.obj files")
    found = sorted((int(m[1]), int(m[2]), entry) for entry in path.iterdir() if (m := _FRAME.fullmatch(entry.name)))
    if not found:
        raise NotFoundError("no NNNN_00.obj files", where=str(path), fix="name an ArcSim output folder")
    if len(found) > FRAME_LIMIT:
        raise LimitError(f"{len(found)} frames", where=str(path), fix=f"at most {FRAME_LIMIT} are read")
    cloths = {cloth for _, cloth, _ in found}
    if cloths != {0}:
        raise InputError(
            f"{len(cloths)} cloths, numbered {', '.join(f'{c:02d}' for c in sorted(cloths))}",
            where=str(path), fix="keep one cloth's files, NNNN_00.obj, in a folder",
        )  # fmt: skip
    numbers = [number for number, _, _ in found]
    missing = sorted(set(range(numbers[0], numbers[-1] + 1)) - set(numbers))
    if missing:
        raise InputError(
            f"{len(missing)} frames are missing", where=f"{path}, frame {missing[0]:04d}", fix="copy them, or cut there"
        )
    configuration = read_json(path / _CONFIGURATION)
    frame_time = configuration.get("frame_time")
    if isinstance(frame_time, bool) or not isinstance(frame_time, int | float) or not 0 < frame_time < 1e6:
        raise InputError(
            f"frame_time is {frame_time!r}", where=str(path / _CONFIGURATION), fix="give seconds between frames"
        )
    frames = [read_obj(entry) for _, _, entry in found]
    time = np.array([round(n * frame_time * NANOSECONDS) for n in numbers], dtype=np.int64)
    attributes = {"source": "arcsim", "scene": configuration}
    first = frames[0]
    fixed = all(np.array_equal(f.faces, first.faces) and np.array_equal(f.rest, first.rest) for f in frames)
    if fixed:
        return MeshSequence(
            time=time,
            positions=np.stack([f.positions for f in frames]).astype(np.float32),
            faces=first.faces.astype(np.int32),
            rest=first.rest.astype(np.float32),
            attributes=attributes,
        )
    return RaggedMeshSequence(
        time=time,
        positions=np.concatenate([f.positions for f in frames]).astype(np.float32),
        faces=np.concatenate([f.faces for f in frames]).astype(np.int32),
        rest=np.concatenate([f.rest for f in frames]).astype(np.float32),
        vertex_offset=np.cumsum([0, *(len(f.positions) for f in frames)]).astype(np.int64),
        face_offset=np.cumsum([0, *(len(f.faces) for f in frames)]).astype(np.int64),
        attributes=attributes,
    )


def write_folder(path: Path, sequence: MeshSequence | RaggedMeshSequence, *, scene: Mapping[str, Any]) -> None:
    """Write a sequence as an ArcSim output folder.

    Args:
        scene: what conf.json says; its `frame_time` must be the sequence's.

    Raises:
        ConflictError: there is something at `path` already.
        InputError: frames that are not evenly spaced by the scene's frame_time.
    """
    if path.exists():
        raise ConflictError("there is something already", where=str(path), fix="write to a new folder")
    frame_time = scene.get("frame_time")
    expected = np.array([round(i * float(frame_time or 0.0) * NANOSECONDS) for i in range(len(sequence))])
    if not frame_time or np.abs(sequence.time - sequence.time[0] - expected).max() > 1:
        raise InputError(
            f"frames are not {frame_time!r} s apart", where="scene, frame_time", fix="give the sequence's frame time"
        )
    path.mkdir(parents=True)
    for index in range(len(sequence)):
        frame = sequence.frame(index)
        mesh = Obj(
            positions=frame.positions.astype(np.float64),
            faces=frame.faces.astype(np.int64),
            rest=frame.rest.astype(np.float64),
        )
        write_obj(path / f"{index:04d}_00.obj", mesh)
    (path / _CONFIGURATION).write_text(json.dumps(dict(scene), indent=1) + "\n", encoding="utf-8")
