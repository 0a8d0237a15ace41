"""One recording as it came: tracked points, z up, in metres, and what its own description says of
the cloth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np

from flagdata.core.arrays import BoolArray, FloatArray, IntArray
from flagdata.core.findings import Finding
from flagdata.errors import InputError
from measure.trajectories.cloth_mesh import outline
from measure.trajectories.trajectory import WindTrack
from sim.cloth.air import AirForce
from sim.cloth.material import Material


class Up(StrEnum):
    """The axis of a recording that points away from the ground."""

    Z = "z"
    Y = "y"
    X = "x"
    MINUS_Z = "-z"
    MINUS_Y = "-y"
    MINUS_X = "-x"


# Rotations that bring each axis to +z; for ±y about x, for ±x about y, for −z about x.
_TURNS: Mapping[Up, tuple[tuple[int, int, int], ...]] = {
    Up.Z: ((1, 0, 0), (0, 1, 0), (0, 0, 1)),
    Up.Y: ((1, 0, 0), (0, 0, -1), (0, 1, 0)),
    Up.X: ((0, 0, -1), (0, 1, 0), (1, 0, 0)),
    Up.MINUS_Z: ((1, 0, 0), (0, -1, 0), (0, 0, -1)),
    Up.MINUS_Y: ((1, 0, 0), (0, 0, 1), (0, -1, 0)),
    Up.MINUS_X: ((0, 0, 1), (0, 1, 0), (-1, 0, 0)),
}


@dataclass(frozen=True, kw_only=True, eq=False)
class Known:
    """What a recording's own description says of the cloth; None where it is silent.

    Attributes:
        material: of the cloth.
        pins: (pin, 2) where it is held, in rest coordinates [m].
        stiffness: of each attachment on each axis [N/m].
        gravity: (x, y, z) [m/s²].
        air: the wind's force.
        wind: beside it.
    """

    material: Material | None = None
    pins: FloatArray | None = None
    stiffness: float | None = None
    gravity: tuple[float, float, float] | None = None
    air: AirForce | None = None
    wind: WindTrack | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class Observation:
    """Tracked points, before they are checked.

    Attributes:
        name: what reports call it.
        markers: (marker, 2) rest coordinates [m].
        positions: (frame, marker, 3) [m], z up; NaN where a point was not tracked.
        times: (frame,) [s], from 0.
        outline: (corner, 2) of the cloth in rest coordinates [m], where it is known.
        wind: beside it; None for that of `known`.
        noise: standard deviation of a coordinate [m]; None to estimate it.
        source: identity of the artifact it was read from; empty where there is none.
        known: from its description.
        findings: of reading it.
        seen: (frame, marker) whether each position was tracked, once gaps are filled; None where
            all were.
        session: one set-up at one place; None where nobody stated one.

    Raises:
        InputError: shapes that disagree, or times that are not finite or do not increase.
    """

    name: str
    markers: FloatArray
    positions: FloatArray
    times: FloatArray
    outline: FloatArray | None = None
    wind: WindTrack | None = None
    noise: float | None = None
    source: str = ""
    known: Known = field(default_factory=Known)
    findings: tuple[Finding, ...] = ()
    seen: BoolArray | None = None
    session: str | None = None

    def __post_init__(self) -> None:
        where = f"recording {self.name!r}"
        markers, frames = np.shape(self.markers), np.shape(self.times)
        if (
            len(markers) != 2
            or markers[1] != 2
            or np.shape(self.positions) != (*frames, markers[0], 3)
        ):
            raise InputError(
                f"{frames} times and markers {markers} do not fit positions of shape "
                f"{np.shape(self.positions)}",
                where=where,
                fix="give (frame,), (marker, 2) and (frame, marker, 3)",
            )
        if not np.isfinite(self.times).all() or (np.diff(self.times) <= 0).any():
            raise InputError(
                "its times do not increase", where=where, fix="sort the frames by time, each once"
            )

    def turned(self, up: Up) -> Observation:
        """Turns this recording, whose `up` axis pointed up, to z up; its wind and gravity are
        turned along."""
        if up is Up.Z:
            return self
        turn = np.array(_TURNS[up], dtype=np.float64)
        gravity, wind = self.known.gravity, self.known.wind
        description = replace(
            self.known,
            gravity=None if gravity is None else tuple((turn @ np.array(gravity)).tolist()),
            wind=None if wind is None else replace(wind, velocity=wind.velocity @ turn.T),
        )
        turned_wind = (
            None if self.wind is None else replace(self.wind, velocity=self.wind.velocity @ turn.T)
        )
        return replace(self, positions=self.positions @ turn.T, known=description, wind=turned_wind)


def from_arrays(
    *,
    name: str,
    positions: FloatArray,
    rest: FloatArray,
    rate: float,
    faces: IntArray | None = None,
    wind: WindTrack | None = None,
    noise: float | None = None,
    description: Known | None = None,
) -> Observation:
    """Makes a recording from arrays: positions (frame, marker, 3) [m] at `rate` [Hz], rest (marker,
    2) [m], z up.

    Args:
        faces: (face, 3) of a mesh whose vertices the markers are; its edge is the cloth's.

    Raises:
        InputError: shapes that disagree, or a rate that is not positive.
    """
    if not (np.isfinite(rate) and rate > 0):
        raise InputError(
            f"the rate is {rate!r} frames a second", where=f"recording {name!r}", fix="give Hz"
        )
    positions, rest = np.asarray(positions, dtype=np.float64), np.asarray(rest, dtype=np.float64)
    corners = None
    if faces is not None:
        corners = outline(rest, np.asarray(faces, dtype=np.int64), where=f"recording {name!r}")
    return Observation(
        name=name,
        markers=rest,
        positions=positions,
        times=np.arange(len(positions)) / rate,
        wind=wind,
        noise=noise,
        known=description or Known(),
        outline=corners,
    )
