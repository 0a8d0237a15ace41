"""Simulated cloth as arrays: what `flagdata.simulate` returns."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from flagdata.core.arrays import Float32Array, FloatArray
from flagdata.core.html import table
from flagdata.errors import UsageError
from flagdata.timebase import NANOSECONDS

if TYPE_CHECKING:
    from flagdata.lake.mesh_sequences import MeshSequence, RaggedMeshSequence


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Simulated:
    """The members of a recipe that were simulated to the end, on one mesh but where the recipe
    remeshes them.

    Attributes:
        name: of the recipe.
        members: each as a mesh sequence, which `flagdata.render` films.
        parameters: name → (member,) what each drew or was given, SI: "wind_speed", "area_weight",
            "damping", …
        wind: (member, frame, 3) where the undisturbed air goes to [m/s], at each frame.
        failed: why a member is not there: its number → the reason.
    """

    name: str
    members: tuple[MeshSequence | RaggedMeshSequence, ...]
    parameters: Mapping[str, FloatArray]
    wind: FloatArray
    failed: Mapping[int, str]

    def __len__(self) -> int:
        return len(self.members)

    def __getitem__(self, member: int) -> MeshSequence | RaggedMeshSequence:
        return self.members[member]

    def __iter__(self) -> Iterator[MeshSequence | RaggedMeshSequence]:
        return iter(self.members)

    @property
    def _sequences(self) -> list[MeshSequence]:
        """The members, where each has one mesh.

        Raises:
            UsageError: a mesh that changes from frame to frame.
        """
        from flagdata.lake.mesh_sequences import MeshSequence

        fixed = [member for member in self.members if isinstance(member, MeshSequence)]
        if len(fixed) < len(self.members):
            raise UsageError(
                "the mesh changes from frame to frame, so that no single array has all of them",
                where=self.name,
                fix="take the meshes one by one: simulated[0].frame(0).positions",
            )
        return fixed

    @property
    def positions(self) -> Float32Array:
        """(member, frame, vertex, 3) [m], z up."""
        return np.stack([member.positions for member in self._sequences])

    @property
    def time(self) -> FloatArray:
        """(frame,) since the first frame that is kept [s]."""
        time = self.members[0].time
        return (time - time[0]) / NANOSECONDS

    @property
    def rest(self) -> Float32Array:
        """(vertex, 2) material coordinates [m]."""
        return self._sequences[0].rest

    @property
    def faces(self) -> NDArray[np.int32]:
        """(face, 3) vertices of each, counter-clockwise seen from the front."""
        return self._sequences[0].faces

    def _rows(self) -> dict[str, str]:
        first = self.members[0]
        frames, vertices = len(first), len(first.frame(0).rest)
        wind = self.parameters["wind_speed"]
        blown = (
            f"{wind[0]:g} m/s" if len(self) == 1 else f"{wind.min():.2f} to {wind.max():.2f} m/s"
        )
        rows = {
            "cloths": str(len(self)),
            "wind": blown,
            "frames": f"{frames} in {self.time[-1]:.2f} s",
        }
        failed = {f"member {index}": f"failed: {why}" for index, why in self.failed.items()}
        return {**rows, "vertices": str(vertices), **failed}

    def __repr__(self) -> str:
        return (
            f"Simulated({self.name}: "
            + ", ".join(f"{name} {value}" for name, value in self._rows().items())
            + ")"
        )

    def _repr_html_(self) -> str:
        return table(f"Simulated {self.name}", self._rows())
