"""ArcSim's runs as motions in time: the cloth of a film.

The runs are stored at 25 Hz. Between their frames the vertices follow splines of the fifth degree,
so that all films of a run show one motion whatever their rate; it has nothing above 12.5 Hz, and
what moved faster is folded into it. Of the vertices' velocity at 7 m/s 5 % of the power lies above
8 Hz, and half way between two frames the spline lacks 0.8 %.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import make_interp_spline

from flagdata.core.arrays import FloatArray, IntArray

RATE = 25.0
DENSITY = 0.284
"""Area weight of the cloth of all runs, Camel Ponte Roma [kg/m²]."""
LENGTH, HEIGHT = 1.5, 1.0
UNDISTURBED = (
    *(
        f"jittered/{name}_w{wind}"
        for name in ("null", "full-hoist-attached", "wind-turned-10deg", "wind-varies-20pct-0.5hz")
        for wind in (3, 5, 7)
    ),
    "flag_w4_dt5",
    "flag_w4_dt05",
    "flag_w8_dt5",
)
"""Runs in which nothing acts that a flag in the wind has not; the wind of some is turned, or varies
about its mean."""
OTHER_AIR = tuple(f"jittered/pressure-x1.6_w{wind}" for wind in (3, 5, 7))
"""Runs in air that is 1.6 times as dense."""
_FROM_REST = {"flag_w4_dt05": 2.0, "flag_w4_dt5": 4.0, "flag_w8_dt5": 4.0}
"""Start of what is filmed of runs that began at rest [s]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Motion:
    """A run.

    Attributes:
        positions: (frame, vertex, 3) at 25 Hz [m].
        faces: (face, 3).
        rest: (vertex, 2), length along the flag and height [m].
        wind: its speed [m/s].
    """

    positions: FloatArray
    faces: IntArray
    rest: FloatArray
    wind: float

    @property
    def duration(self) -> float:
        """[s]."""
        return (len(self.positions) - 1) / RATE

    @property
    def uv(self) -> FloatArray:
        """(vertex, 2) on the flag's picture, from the hoist and from below."""
        return (self.rest - self.rest.min(axis=0)) / np.ptp(self.rest, axis=0)

    def at(self, times: FloatArray) -> FloatArray:
        """(n, vertex, 3) at instants (n,) from its first frame [s]."""
        first = max(0, int(times.min() * RATE) - 10)
        last = min(len(self.positions), int(times.max() * RATE) + 12)
        known = np.arange(first, last) / RATE
        return np.asarray(make_interp_spline(known, self.positions[first:last], k=5)(times))


def read(folder: Path, name: str) -> Motion:
    """A run of the reference data, `arcsim/NAME.npz`."""
    with np.load(folder / "arcsim" / f"{name}.npz") as content:
        if "q" in content:
            positions, wind = content["q"] * 1e-4, content["wind"]
        else:
            positions = content["positions"][round(_FROM_REST[name] * RATE) :].astype(np.float64)
            wind = np.array(json.loads(str(content["scene"]))["wind"]["velocity"], dtype=np.float64)
        return Motion(
            positions=positions,
            faces=content["faces"].astype(np.int64),
            rest=content["rest"].astype(np.float64),
            wind=float(np.linalg.norm(wind)),
        )
