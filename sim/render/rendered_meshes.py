"""What is rendered: a sequence of meshes on any device, of one topology or of a new one each
frame."""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import torch
from numpy.typing import ArrayLike
from torch import Tensor

from flagdata.errors import InputError
from flagdata.lake.mesh_sequences import MeshSequence, RaggedMeshSequence
from flagdata.timebase import NANOSECONDS


@dataclass(frozen=True, kw_only=True)
class Frame:
    """One mesh: positions (vertex, 3) [m], faces (face, 3) int64, uv (vertex, 2) in [0, 1], u
    rightwards, v upwards."""

    positions: Tensor
    faces: Tensor
    uv: Tensor


@dataclass(frozen=True, kw_only=True, eq=False)
class Meshes:
    """Meshes of all frames, one after another.

    Attributes:
        positions: (all vertices, 3) float32 [m], z up.
        faces: (all faces, 3) int64, counter-clockwise seen from the front, indices within their own
            frame.
        uv: (all vertices, 2) float32 place in the texture: (0, 0) is its lower left corner, (1, 1)
            its upper right one.
        vertex_offset, face_offset: frame i has rows offset[i] to offset[i + 1].
        anchor: (3,) the point that stands at `mesh_height` above the ground [m].
        heading: horizontal reference direction, counter-clockwise from +x [rad]: where the air goes
            to for a flag, the normal of a hanging cloth.
        rate: frames a second [Hz].

    Raises:
        InputError: shapes that disagree, values that are not finite, indices out of range, no
            frames.
    """

    positions: Tensor
    faces: Tensor
    uv: Tensor
    vertex_offset: tuple[int, ...]
    face_offset: tuple[int, ...]
    anchor: tuple[float, float, float]
    heading: float = 0.0
    rate: float = 25.0

    def __post_init__(self) -> None:
        shapes = (("positions", self.positions, 3), ("faces", self.faces, 3), ("uv", self.uv, 2))
        for name, values, width in shapes:
            if values.ndim != 2 or values.shape[1] != width:
                raise _wrong(f"{name} have shape {tuple(values.shape)}", f"(rows, {width})")
        if len(self.uv) != len(self.positions):
            raise _wrong(
                f"there are {len(self.uv)} texture places for {len(self.positions)} vertices",
                "one for each",
            )
        for name, values, dtype in (
            ("positions", self.positions, torch.float32),
            ("faces", self.faces, torch.int64),
            ("uv", self.uv, torch.float32),
        ):
            if values.dtype != dtype:
                raise _wrong(f"{name} are of type {values.dtype}", f"{dtype}")
        for name, offset, total in (
            ("vertex_offset", self.vertex_offset, len(self.positions)),
            ("face_offset", self.face_offset, len(self.faces)),
        ):
            rising = all(a < b for a, b in itertools.pairwise(offset))
            if len(offset) < 2 or offset[0] != 0 or offset[-1] != total or not rising:
                raise _wrong(
                    f"{name} does not fit {total} rows",
                    "from 0 to the rows, rising, at least one frame",
                )
        if len(self.vertex_offset) != len(self.face_offset):
            raise _wrong(
                "the offsets are of different numbers of frames", "one more than frames, for both"
            )
        if not (bool(self.positions.isfinite().all()) and bool(self.uv.isfinite().all())):
            raise _wrong(
                "a position or texture place is not finite",
                "finite ones; cut a sequence where it blew up",
            )
        finite = all(math.isfinite(v) for v in (*self.anchor, self.heading, self.rate))
        if not finite or self.rate <= 0:
            raise _wrong(
                "an anchor, heading or rate that makes no sense",
                "finite numbers, and a rate above 0",
            )
        faces, counts = (
            torch.tensor(o, device=self.device).diff()
            for o in (self.face_offset, self.vertex_offset)
        )
        most = torch.repeat_interleave(counts, faces)[:, None]
        wrong = torch.nonzero(((self.faces < 0) | (self.faces >= most)).any(dim=1)).flatten()
        if len(wrong):
            frame = sum(offset <= int(wrong[0]) for offset in self.face_offset) - 1
            raise _wrong(
                f"faces of frame {frame} name vertices outside 0 to {int(counts[frame]) - 1}",
                "indices within their frame",
            )

    def __len__(self) -> int:
        return len(self.vertex_offset) - 1

    @property
    def device(self) -> torch.device:
        return self.positions.device

    @cached_property
    def one_topology(self) -> bool:
        """Whether all frames have the same faces and texture places."""
        n = len(self)
        if (
            len(self.faces) != n * self.face_offset[1]
            or len(self.positions) != n * self.vertex_offset[1]
        ):
            return False
        even = all(
            offset == tuple(i * offset[1] for i in range(n + 1))
            for offset in (self.vertex_offset, self.face_offset)
        )
        if not even:
            return False
        faces, uv = self.faces.unflatten(0, (n, -1)), self.uv.unflatten(0, (n, -1))
        return bool((faces == faces[:1]).all()) and bool((uv == uv[:1]).all())

    def frame(self, index: int) -> Frame:
        """Returns the mesh of one frame; negative indices count from the end."""
        i = range(len(self))[index]
        vertices = slice(self.vertex_offset[i], self.vertex_offset[i + 1])
        faces = slice(self.face_offset[i], self.face_offset[i + 1])
        return Frame(
            positions=self.positions[vertices], faces=self.faces[faces], uv=self.uv[vertices]
        )

    def part(self, first: int, last: int) -> Meshes:
        """Frames `first` to `last`, the last not included."""
        vertices = slice(self.vertex_offset[first], self.vertex_offset[last])
        vertex_offset, face_offset = (
            offset[first : last + 1] for offset in (self.vertex_offset, self.face_offset)
        )
        return replace(
            self,
            positions=self.positions[vertices],
            uv=self.uv[vertices],
            faces=self.faces[face_offset[0] : face_offset[-1]],
            vertex_offset=tuple(offset - vertex_offset[0] for offset in vertex_offset),
            face_offset=tuple(offset - face_offset[0] for offset in face_offset),
        )

    @classmethod
    def fixed(
        cls,
        *,
        positions: Tensor,
        faces: Tensor,
        uv: Tensor,
        anchor: tuple[float, float, float],
        heading: float = 0.0,
        rate: float = 25.0,
    ) -> Meshes:
        """Frames (frame, vertex, 3) of one topology: faces (face, 3), uv (vertex, 2).

        Raises:
            InputError: see the class.
        """
        if positions.ndim != 3:
            raise _wrong(f"positions have shape {tuple(positions.shape)}", "(frame, vertex, 3)")
        frames, vertices, _ = positions.shape
        device = positions.device
        return cls(
            positions=positions.flatten(0, 1).float(),
            faces=faces.to(device, torch.int64).repeat(frames, 1),
            uv=uv.to(device).float().repeat(frames, 1),
            anchor=anchor,
            heading=heading,
            rate=rate,
            vertex_offset=tuple(range(0, frames * vertices + 1, vertices)) if vertices else (0,),
            face_offset=tuple(range(0, frames * len(faces) + 1, len(faces)))
            if len(faces)
            else (0,),
        )

    @classmethod
    def flag(
        cls,
        sequence: MeshSequence | RaggedMeshSequence,
        *,
        heading: float,
        device: torch.device | str = "cpu",
    ) -> Meshes:
        """Makes meshes of a stored flag: hoist at the least u; its upper corner in the first frame
        is the anchor.

        Args:
            heading: where the air goes to, counter-clockwise from +x [rad].
        """
        first = sequence.frame(0)
        hoist = first.rest[:, 0] <= first.rest[:, 0].min() + 1e-4
        top = np.flatnonzero(hoist)[np.argmax(first.rest[hoist, 1])]
        return cls._of(sequence, anchor=first.positions[top], heading=heading, device=device)

    @classmethod
    def hanging(
        cls,
        sequence: MeshSequence | RaggedMeshSequence,
        *,
        heading: float = 0.0,
        device: torch.device | str = "cpu",
    ) -> Meshes:
        """Makes meshes of a stored hanging cloth: the middle of its upper edge (greatest v) in the
        first frame is the anchor.

        Args:
            heading: the cloth's normal, counter-clockwise from +x [rad].
        """
        first = sequence.frame(0)
        edge = first.positions[first.rest[:, 1] >= first.rest[:, 1].max() - 1e-4]
        middle = (edge.min(axis=0) + edge.max(axis=0)) / 2
        middle[2] = edge[:, 2].max()
        return cls._of(sequence, anchor=middle, heading=heading, device=device)

    @classmethod
    def _of(
        cls,
        sequence: MeshSequence | RaggedMeshSequence,
        *,
        anchor: ArrayLike,
        heading: float,
        device: torch.device | str,
    ) -> Meshes:
        rest = np.asarray(sequence.rest, dtype=np.float64)
        low, span = rest.min(axis=0), np.ptp(rest, axis=0)
        if not (span > 0).all():
            raise _wrong("the rest coordinates have no extent", "material coordinates in metres")
        uv = torch.from_numpy((rest - low) / span).to(device, torch.float32)
        x, y, z = (float(v) for v in np.asarray(anchor))
        rate = NANOSECONDS / float(np.median(np.diff(sequence.time))) if len(sequence) > 1 else 25.0
        positions, faces = (
            torch.from_numpy(np.array(a)).to(device) for a in (sequence.positions, sequence.faces)
        )
        if isinstance(sequence, MeshSequence):
            return cls.fixed(
                positions=positions,
                faces=faces,
                uv=uv,
                anchor=(x, y, z),
                heading=heading,
                rate=rate,
            )
        return cls(
            positions=positions,
            faces=faces.long(),
            uv=uv,
            anchor=(x, y, z),
            heading=heading,
            rate=rate,
            vertex_offset=tuple(sequence.vertex_offset.tolist()),
            face_offset=tuple(sequence.face_offset.tolist()),
        )


def _wrong(message: str, wanted: str) -> InputError:
    return InputError(message, where="meshes", fix=f"give {wanted}")
