"""Mesh sequences in Zarr v3: write-once folders that xarray opens, and that come back as frozen
typed sequences.

A store of one topology holds `positions (time, vertex, xyz)`, `faces (face, corner)`, `rest
(vertex, uv)`, `time`. A store whose topology changes from frame to frame ("ragged") holds the
frames' vertices and faces one after another, `positions (vertex, xyz)`, `faces (face, corner)`,
`rest (vertex, uv)`, and where each frame begins: `vertex_offset (edge)` and `face_offset (edge)`,
one more than frames. Face indices count within their own frame.

There is no settled convention for moving meshes in Zarr: the Zarr Vectors draft of the Allen
Institute is chunked in space, PhysicsNeMo writes `mesh_pos (time, vertex, 3)`. Where conventions of
xarray's world apply, attributes follow
them: CF 1.11 for the time axis and units, UGRID 1.0 (`cf_role`, `start_index`) for the
connectivity.

The same arrays give the same bytes (with the same zarr and blosc), so equal sequences are stored
once. Positions are chunked by whole frames, about 1 MiB a chunk, up to 64 chunks a shard file;
within a chunk x, y and z come one after the other and bytes of equal weight together before zstd.
Simulated flags take 77 % of their raw size so, and 90 % with Zarr's defaults.
"""

from __future__ import annotations

import json
import math
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from flagdata.core.arrays import AnyArray, Float32Array, IntArray
from flagdata.core.files.durable import HEAL, disk_errors
from flagdata.core.html import table
from flagdata.core.provenance import canonical
from flagdata.core.schema import CHANNELS
from flagdata.errors import ConflictError, CorruptError, FlagdataError, InputError, LimitError
from flagdata.timebase import NANOSECONDS

if TYPE_CHECKING:
    import xarray as xr
    import zarr

MESHES_FORMAT = 1
ARRAY_BYTES = 1 << 36
"""Most bytes of an array that are read at once."""
CHUNK_BYTES = 1 << 32
"""Most bytes of a chunk or a shard."""
CHUNKS = 1 << 22
"""Most chunks of an array."""
_CHUNK = 1 << 20  # B
_CHUNKS_A_SHARD = 64
_HEAD = "flagdata_meshes"

Indices = NDArray[np.int32]
Instants = IntArray


@dataclass(frozen=True, kw_only=True)
class Mesh:
    """One frame: positions (vertex, 3) [m], faces (face, 3) vertex indices, rest (vertex, 2) [m],
    time [ns]."""

    time: int
    positions: Float32Array
    faces: Indices
    rest: Float32Array


class _Moving(ABC):
    """A sequence's length, and how it is shown."""

    time: Instants
    attributes: Mapping[str, Any]

    @abstractmethod
    def frame(self, index: int) -> Mesh:
        """Returns the mesh at one time; negative indices count from the end."""

    def __len__(self) -> int:
        return len(self.time)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({self._description()})"

    def _repr_html_(self) -> str:
        return table(
            self._description(), {name: str(value) for name, value in self.attributes.items()}
        )

    def _description(self) -> str:
        seconds = (int(self.time[-1]) - int(self.time[0])) / NANOSECONDS if len(self) else 0.0
        first = self.frame(0)
        return (
            f"{len(self)} frames in {seconds:.2f} s, {len(first.rest)} vertices, "
            f"{len(first.faces)} faces"
        )


@dataclass(frozen=True, kw_only=True, repr=False)
class MeshSequence(_Moving):
    """A moving mesh of one topology.

    Attributes:
        time: (n,) UTC nanoseconds, or since the start of a simulation; strictly increasing.
        positions: (n, vertex, 3) float32 [m], right-handed, z up; finite.
        faces: (face, 3) int32, counter-clockwise seen from the front.
        rest: (vertex, 2) float32 material coordinates [m].
        attributes: what else is known, JSON values (parameters of the simulation, source).

    Raises:
        InputError: shapes that disagree, values that are not finite, indices out of range, time
            that does not increase.
    """

    time: Instants
    positions: Float32Array
    faces: Indices
    rest: Float32Array
    attributes: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        _check(self.time, self.positions, self.faces, self.rest, self.attributes)
        if self.positions.ndim != 3 or self.positions.shape[::2] != (len(self.time), 3):
            raise _wrong(
                f"positions have shape {self.positions.shape} for {len(self.time)} times",
                "(time, vertex, 3)",
            )
        if self.rest.shape != (self.positions.shape[1], 2):
            raise _wrong(
                f"rest has shape {self.rest.shape} for {self.positions.shape[1]} vertices",
                "(vertex, 2)",
            )
        _check_faces(self.faces, self.positions.shape[1], "faces")

    def frame(self, index: int) -> Mesh:
        """Returns the mesh at one time; negative indices count from the end."""
        return Mesh(
            time=int(self.time[index]),
            positions=self.positions[index],
            faces=self.faces,
            rest=self.rest,
        )


@dataclass(frozen=True, kw_only=True, repr=False)
class RaggedMeshSequence(_Moving):
    """A moving mesh whose topology changes, as remeshing simulators write it.

    Attributes:
        time: (n,) as in `MeshSequence`.
        positions: (all vertices, 3) float32 [m], frame after frame.
        faces: (all faces, 3) int32, indices within their own frame.
        rest: (all vertices, 2) float32 [m].
        vertex_offset, face_offset: (n + 1,) int64; frame i has rows offset[i] to offset[i + 1].
        attributes: as in `MeshSequence`.

    Raises:
        InputError: as in `MeshSequence`, or offsets that do not fit.
    """

    time: Instants
    positions: Float32Array
    faces: Indices
    rest: Float32Array
    vertex_offset: Instants
    face_offset: Instants
    attributes: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        _check(self.time, self.positions, self.faces, self.rest, self.attributes)
        if (
            self.positions.ndim != 2
            or self.positions.shape[1] != 3
            or self.rest.shape != (len(self.positions), 2)
        ):
            shapes = f"positions {self.positions.shape}, rest {self.rest.shape}"
            raise _wrong(
                f"shapes that do not fit: {shapes}", "(all vertices, 3) and (all vertices, 2)"
            )
        _check_offsets(self.vertex_offset, len(self.time), len(self.positions), "vertex_offset")
        _check_offsets(self.face_offset, len(self.time), len(self.faces), "face_offset")
        for i in range(len(self.time)):
            frame_faces = self.faces[self.face_offset[i] : self.face_offset[i + 1]]
            _check_faces(
                frame_faces,
                int(self.vertex_offset[i + 1] - self.vertex_offset[i]),
                f"faces of frame {i}",
            )

    def frame(self, index: int) -> Mesh:
        """Returns the mesh at one time; negative indices count from the end."""
        i = range(len(self.time))[index]
        vertices = slice(self.vertex_offset[i], self.vertex_offset[i + 1])
        faces = slice(self.face_offset[i], self.face_offset[i + 1])
        return Mesh(
            time=int(self.time[i]),
            positions=self.positions[vertices],
            faces=self.faces[faces],
            rest=self.rest[vertices],
        )


def write_meshes(path: Path, sequence: MeshSequence | RaggedMeshSequence) -> None:
    """Write a sequence as a new Zarr folder; to be put into a lake by `Transaction.put`.

    Raises:
        ConflictError: something is at `path` already.
        FlagdataError: no space, no permission.
    """
    import zarr

    if path.exists():
        raise ConflictError(
            "a file or folder is there already",
            where=str(path),
            fix="give a path at which nothing is yet",
        )
    ragged = isinstance(sequence, RaggedMeshSequence)
    with disk_errors("writing meshes", path):
        group = zarr.open_group(path, mode="w-", zarr_format=3)
        attributes = {
            "Conventions": "CF-1.11 UGRID-1.0",
            _HEAD: {"format": MESHES_FORMAT, "layout": "ragged" if ragged else "fixed"},
            "attributes": dict(sequence.attributes),
        }
        group.update_attributes(json.loads(canonical(attributes)))
        write_array(group, "time", sequence.time, ("time",))
        if ragged:
            write_array(group, "positions", sequence.positions, ("vertex", "xyz"))
            write_array(group, "vertex_offset", sequence.vertex_offset, ("edge",))
            write_array(group, "face_offset", sequence.face_offset, ("edge",))
        else:
            write_array(group, "positions", sequence.positions, CHANNELS["positions"].dims)
        write_array(group, "faces", sequence.faces, CHANNELS["faces"].dims)
        write_array(group, "rest", sequence.rest, CHANNELS["rest"].dims)


def read_meshes(
    path: Path, *, first: int = 0, count: int | None = None
) -> MeshSequence | RaggedMeshSequence:
    """Frames `first` to `first + count` of a stored sequence (to the end if `None`), reading no
    others.

    Raises:
        CorruptError: not such a store, damaged, or of a newer format.
        LimitError: arrays or chunks larger than this module's limits.
        InputError: frames that it does not have.
    """
    group = _open(path)
    layout = _layout(group, path)
    with store_errors(path, _DAMAGED):
        frames = int(group["time"].shape[0])  # type: ignore[union-attr]
    last = frames if count is None else first + count
    if not 0 <= first < last <= frames:
        raise InputError(
            f"frames {first} to {last} of {frames}", where=str(path), fix="ask for frames it has"
        )
    with store_errors(path, _DAMAGED):
        part = partial(read_part, group, where=str(path))
        time = part("time", first, last)
        attributes: dict[str, Any] = dict(group.attrs["attributes"])  # type: ignore[arg-type]
        if layout == "fixed":
            return MeshSequence(
                time=time,
                positions=part("positions", first, last),
                faces=part("faces", None, None),
                rest=part("rest", None, None),
                attributes=attributes,
            )
        vertices = part("vertex_offset", first, last + 1)
        faces = part("face_offset", first, last + 1)
        return RaggedMeshSequence(
            time=time,
            positions=part("positions", vertices[0], vertices[-1]),
            faces=part("faces", faces[0], faces[-1]),
            rest=part("rest", vertices[0], vertices[-1]),
            vertex_offset=vertices - vertices[0],
            face_offset=faces - faces[0],
            attributes=attributes,
        )


def open_meshes(path: Path) -> xr.Dataset:
    """Opens the store as an xarray dataset; arrays are read when they are used. `time` is decoded
    to datetime64[ns].

    Raises:
        CorruptError: not such a store, or of a newer format.
    """
    import xarray as xr

    _layout(_open(path), path)
    with store_errors(path, _DAMAGED):
        return xr.open_zarr(path, consolidated=False, chunks=None)


_RESTORE = f"run flagdata verify; import the sequence again, or {HEAL}"
_DAMAGED = "the mesh store is damaged"


def _open(path: Path) -> zarr.Group:
    from flagdata.lake.sized_chunks import open_group

    with store_errors(path, "this is not a Zarr store"):
        return open_group(path)


def check_format(head: Any, newest_format: int, path: Path, *, noun: str) -> dict[str, Any]:
    """Reads the head of a store of meshes or markers in its attributes, of a format that is known.

    Raises:
        CorruptError: there is none, or it is of a newer format.
    """
    if not isinstance(head, dict) or not isinstance(head.get("format"), int):
        raise CorruptError(
            f"this is a Zarr store, but not of {noun}",
            where=str(path),
            fix="open it with zarr or xarray",
        )
    if head["format"] > newest_format:
        raise CorruptError(
            f"its format {head['format']} is newer than this flagdata's, {newest_format}",
            where=str(path),
            fix="install the newer flagdata",
        )
    return head


def _layout(group: zarr.Group, path: Path) -> str:
    with store_errors(path, "this is not a Zarr store"):
        head = check_format(group.attrs.get(_HEAD), MESHES_FORMAT, path, noun="meshes")
    if head.get("layout") not in ("fixed", "ragged"):
        raise CorruptError(
            "this is a Zarr store, but not of meshes",
            where=str(path),
            fix="open it with zarr or xarray",
        )
    return head["layout"]


@contextmanager
def store_errors(path: Path, problem: str, *, fix: str = _RESTORE) -> Iterator[None]:
    """Turns whatever a damaged or foreign Zarr store makes its reader raise into one error.

    Raises:
        CorruptError: for any exception inside the block but a LimitError.
    """
    try:
        yield
    except (LimitError, CorruptError):
        raise
    except FlagdataError as error:
        raise CorruptError(
            f"{problem}; its reader says: {error.what}", where=str(path), fix=fix
        ) from error
    except Exception as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        raise CorruptError(
            f"{problem}; its reader says: {reason[:300]}", where=str(path), fix=fix
        ) from error


def read_part(
    group: zarr.Group, name: str, first: int | None, last: int | None, *, where: str
) -> AnyArray:
    """Rows `first` to `last` of an array, once its size and its chunks are known to be within the
    limits.

    Raises:
        LimitError: more than `ARRAY_BYTES`, `CHUNK_BYTES` or `CHUNKS`.
        KeyError, TypeError: there is no such array.
    """
    import zarr

    array = group[name]
    if not isinstance(array, zarr.Array):
        raise TypeError(f"{name} is no array")
    shape = (
        (len(range(*slice(first, last).indices(array.shape[0]))), *array.shape[1:])
        if array.ndim
        else ()
    )
    blocks = [array.chunks] if array.shards is None else [array.chunks, array.shards]
    for message, size, most in (
        ("bytes", math.prod(shape) * array.dtype.itemsize, ARRAY_BYTES),
        (
            "bytes a chunk",
            max(math.prod(block) for block in blocks) * array.dtype.itemsize,
            CHUNK_BYTES,
        ),
        (
            "chunks",
            math.prod(
                -(-side // part) for side, part in zip(array.shape, array.chunks, strict=True)
            ),
            CHUNKS,
        ),
    ):
        if size > most:
            raise LimitError(
                f"{name} has {size} {message}", where=where, fix=f"at most {most} are read"
            )
    return np.asarray(array[first:last])


_ATTRIBUTES: dict[str, dict[str, Any]] = {
    "time": {
        "standard_name": "time",
        "units": "nanoseconds since 1970-01-01",
        "calendar": "proleptic_gregorian",
    },
    "faces": {"cf_role": "face_node_connectivity", "start_index": 0, "units": "1"},
    "vertex_offset": {"units": "1"},
    "face_offset": {"units": "1"},
}


def write_array(group: zarr.Group, name: str, values: AnyArray, dims: tuple[str, ...]) -> None:
    """Write an array of a moving mesh or of markers into a Zarr group: chunked by its first axis,
    with its units."""
    from zarr.codecs import BloscCodec, TransposeCodec

    rows = max(1, len(values))
    row_bytes = max(1, values.nbytes // rows)
    chunk = min(rows, max(1, _CHUNK // row_bytes))
    shard = min(_CHUNKS_A_SHARD, -(-rows // chunk)) * chunk
    rest = tuple(max(1, size) for size in values.shape[1:])
    attributes: dict[str, Any] = dict(_ATTRIBUTES.get(name, {}))
    if not attributes:
        channel = CHANNELS[name]
        attributes = {"units": channel.unit, "long_name": channel.about, "comment": channel.frame}
    array = group.create_array(
        name,
        shape=values.shape,
        dtype=values.dtype,
        chunks=(chunk, *rest),
        shards=(shard, *rest),
        filters=[TransposeCodec(order=(values.ndim - 1, *range(values.ndim - 1)))]
        if values.ndim > 1
        else None,
        compressors=BloscCodec(
            cname="zstd", clevel=5, shuffle="shuffle", typesize=values.dtype.itemsize
        ),
        fill_value=np.nan
        if values.dtype.kind == "f"
        else -1,  # so that a lost chunk cannot pass for data
        dimension_names=dims,
        attributes=attributes,
    )
    array[...] = values


def _wrong(problem: str, wanted: str) -> InputError:
    return InputError(problem, where="mesh sequence", fix=f"give {wanted}")


def _check(
    time: Instants,
    positions: Float32Array,
    faces: Indices,
    rest: Float32Array,
    attributes: Mapping[str, Any],
) -> None:
    arrays = (
        ("time", time, np.int64),
        ("positions", positions, np.float32),
        ("faces", faces, np.int32),
    )
    for name, values, dtype in (*arrays, ("rest", rest, np.float32)):
        if values.dtype != dtype:
            raise _wrong(f"{name} is of type {values.dtype}", f"{np.dtype(dtype)}")
    if time.ndim != 1 or len(time) == 0 or not bool(np.all(np.diff(time) > 0)):
        raise _wrong("time is empty or does not increase", "one increasing instant a frame")
    if not bool(np.isfinite(positions).all()) or not bool(np.isfinite(rest).all()):
        raise _wrong(
            "positions or rest coordinates that are not finite",
            "finite ones; cut a sequence where it blew up",
        )
    try:
        canonical(attributes)
    except (TypeError, ValueError) as error:
        raise _wrong(
            f"attributes that are not JSON: {error}", "text, finite numbers, lists and mappings"
        ) from None


def _check_faces(faces: Indices, vertices: int, noun: str) -> None:
    if faces.ndim != 2 or faces.shape[1] != 3:
        raise _wrong(f"{noun} have shape {faces.shape}", "(face, 3)")
    if faces.size and not 0 <= int(faces.min()) <= int(faces.max()) < vertices:
        raise _wrong(
            f"{noun} name vertices outside 0 to {vertices - 1}",
            "indices into the frame's vertices, from 0",
        )


def _check_offsets(offset: Instants, frames: int, total: int, name: str) -> None:
    fits = (
        offset.dtype == np.int64
        and offset.shape == (frames + 1,)
        and offset[0] == 0
        and offset[-1] == total
    )
    if not fits or bool(np.any(np.diff(offset) < 0)):
        raise _wrong(
            f"{name} does not fit {frames} frames and {total} rows",
            "int64 from 0 to the number of rows, rising",
        )


def write_plain(
    group: zarr.Group, name: str, values: AnyArray, dims: tuple[str, ...] | None = None
) -> None:
    """Write an array of a measurement into a Zarr group, in one chunk."""
    from zarr.codecs import BloscCodec

    array = group.create_array(
        name,
        shape=values.shape,
        dtype=values.dtype,
        chunks=tuple(max(1, n) for n in values.shape),
        dimension_names=dims,
        compressors=BloscCodec(cname="zstd", clevel=5, typesize=values.dtype.itemsize),
    )
    array[...] = values
