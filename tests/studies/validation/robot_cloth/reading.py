"""Recordings of a cloth that a robot holds: nodes seen by a depth camera, and the pose of the
robot's tool.

`NAME_mesh.csv` has a row for each frame: a stamp in its third column [ns], then all x, all y and
all z of the nodes in the camera's optical frame [m]; the nodes are columns of the cloth from left
to right, each from top to bottom. `NAME_tcp.csv` has the tool's pose in the robot's frame, z up:
stamp, position and quaternion (x, y, z, w). `calibration_campose.csv` has the camera's pose in the
robot's frame, without a stamp. The format is that of the cloth recordings of tfm_matlab (A. Luque).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.errors import InputError, NotFoundError
from flagdata.timebase import NANOSECONDS

_STILL = 5e-3  # m: a tool that is nearer to where it began has not moved
_FIRST_NODE = 5  # column of the mesh file: after its stamps, frame and size
_STAMP = 2


@dataclass(frozen=True, kw_only=True, eq=False)
class Swing:
    """One recording, in the robot's frame, z up; times are since the tool's first pose, on the
    stamps' clock.

    Attributes:
        name: of it.
        side: nodes along each edge.
        times: (frame,) of the nodes [s].
        positions: (frame, side² nodes, 3) [m]; NaN where a node was not tracked.
        tool_times: (pose,) [s].
        tool: (pose, 3) where the tool is [m].
        turns: (pose, 3, 3) its rotation from its first pose.
    """

    name: str
    side: int
    times: FloatArray
    positions: FloatArray
    tool_times: FloatArray
    tool: FloatArray
    turns: FloatArray

    @property
    def hanging(self) -> FloatArray:
        """(node, 3) median places before the tool moves [m]."""
        moved = np.linalg.norm(self.tool - self.tool[0], axis=1) > _STILL
        until = self.tool_times[int(np.argmax(moved))] if moved.any() else np.inf
        still = self.times <= until
        seen = self.positions[still]
        if not np.isfinite(seen).all(axis=2).any(axis=0).all():
            raise InputError(
                "a node was never tracked before the tool moves",
                where=f"recording {self.name!r}",
                fix="take a recording that begins at rest",
            )
        return np.nanmedian(seen, axis=0)


def names(folder: Path, programme: str) -> tuple[str, ...]:
    """The repeats of a programme in a folder.

    Raises:
        NotFoundError: there are none.
    """
    found = tuple(
        sorted(
            path.name.removesuffix("_mesh.csv")
            for path in folder.glob(f"{programme}_rep*_mesh.csv")
        )
    )
    if not found:
        raise NotFoundError(
            "no recordings",
            where=f"{folder}, programme {programme}",
            fix="check folder and programme",
        )
    return found


def read(folder: Path, name: str) -> Swing:
    """A recording of the folder.

    Raises:
        NotFoundError: a file is not there.
        InputError: a file with other columns, fewer than two usable rows, or nodes that make no
            square.
    """
    camera = _rows(folder / "calibration_campose.csv", 8)[:, 1:].mean(axis=0)
    stamps, seen = _stamped(folder / f"{name}_mesh.csv")
    nodes = (seen.shape[1] - _FIRST_NODE) // 3
    side = round(nodes**0.5)
    if side < 2 or seen.shape[1] != _FIRST_NODE + 3 * side * side:
        raise InputError(
            f"{seen.shape[1] - _FIRST_NODE} coordinates are not those of a square of nodes",
            where=f"{name}_mesh.csv",
            fix="give all x, all y and all z of n × n nodes after five columns",
        )
    positions = seen[:, _FIRST_NODE:].reshape(len(seen), 3, nodes).transpose(0, 2, 1)
    positions = positions @ Rotation.from_quat(camera[3:]).as_matrix().T + camera[:3]
    tool_stamps, poses = _stamped(folder / f"{name}_tcp.csv")
    if poses.shape[1] != 11:
        raise InputError(
            f"{poses.shape[1]} columns",
            where=f"{name}_tcp.csv",
            fix="give stamp, position and quaternion",
        )
    rotations = Rotation.from_quat(poses[:, 7:])
    return Swing(
        name=name,
        side=side,
        times=(stamps - tool_stamps[0]) / NANOSECONDS,
        positions=positions,
        tool_times=(tool_stamps - tool_stamps[0]) / NANOSECONDS,
        tool=poses[:, 4:7],
        turns=(rotations * rotations[0].inv()).as_matrix(),
    )


def read_all(folder: Path, programmes: Sequence[str]) -> dict[str, list[Swing]]:
    """All repeats of programmes."""
    return {
        programme: [read(folder, name) for name in names(folder, programme)]
        for programme in programmes
    }


def _stamped(path: Path) -> tuple[IntArray, FloatArray]:
    """Stamps [ns], and the table, of rows whose stamps increase."""
    table = _rows(path, _FIRST_NODE + 1)
    stamps = np.genfromtxt(path, delimiter=",", skip_header=1, usecols=[_STAMP], dtype=np.int64)
    later = np.concatenate([[True], stamps[1:] > np.maximum.accumulate(stamps)[:-1]])
    return stamps[later], table[later]


def _rows(path: Path, least: int) -> FloatArray:
    if not path.is_file():
        raise NotFoundError(
            "no such file", where=str(path), fix="give the folder of the recordings"
        )
    table = np.genfromtxt(path, delimiter=",", skip_header=1)
    if table.ndim != 2 or len(table) < 2 or table.shape[1] < least:
        raise InputError(
            f"a table of shape {table.shape}",
            where=str(path),
            fix="see the format in the docstring",
        )
    return table
