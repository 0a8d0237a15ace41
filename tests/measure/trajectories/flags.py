"""Flags whose motion is known in closed form, without stretch, for tests of reading and
checking."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from flagdata.core.arrays import FloatArray
from measure.trajectories import Hold, Known, Observation, Setup, WindTrack, sheet
from sim.cloth.material import named_material
from sim.cloth.mesh import grid

WIDTH, HEIGHT, RATE = 1.2, 0.8, 50.0
SETUP = Setup(
    outline=sheet(WIDTH, HEIGHT), material=named_material("camel-ponte-roma"), pins=Hold.HOIST
)
WIND = WindTrack.constant((5.0, 0.0, 0.0))
_GRAIN = 400  # steps of the integral along u


def unrolled(u: FloatArray, times: FloatArray) -> FloatArray:
    """(frame, point, 2) a curve in the x–y plane whose direction is a travelling wave that grows
    from the hoist. Its arc length is u exactly, since it is the integral of a unit vector."""
    s = np.linspace(0.0, WIDTH, _GRAIN + 1)
    angle = 0.9 * (s / WIDTH) * np.sin(2 * np.pi * (1.5 * times[:, None] - s / 1.1))
    middle = (angle[:, 1:] + angle[:, :-1]) / 2
    step = s[1] - s[0]
    x = np.concatenate(
        [np.zeros((len(times), 1)), np.cumsum(np.cos(middle) * step, axis=1)], axis=1
    )
    y = np.concatenate(
        [np.zeros((len(times), 1)), np.cumsum(np.sin(middle) * step, axis=1)], axis=1
    )
    return np.stack([np.stack([np.interp(u, s, row) for row in part]) for part in (x, y)], axis=-1)


def flutter(rest: FloatArray, times: FloatArray) -> FloatArray:
    """(frame, marker, 3) a flag that streams along +x, flutters along y, and droops: sheared down
    by a fifth of u, held all along its hoist at x = y = 0. Lengths are kept along v and, to 2 %,
    along u."""
    plane = unrolled(rest[:, 0], times)
    z = rest[:, 1] - 0.2 * rest[:, 0]
    return np.concatenate([plane, np.broadcast_to(z, plane.shape[:2])[..., None]], axis=-1)


def markers(columns: int = 9, rows: int = 6) -> FloatArray:
    """(marker, 2) the corners of a grid over the flag."""
    return grid(width=WIDTH, height=HEIGHT, columns=columns, rows=rows).rest


def flag(
    *, seconds: float = 4.0, noise: float = 0.0, seed: int = 0, name: str = "flag"
) -> Observation:
    """A recording of it, with white noise [m] on every coordinate."""
    rest, times = markers(), np.arange(round(seconds * RATE)) / RATE
    positions = flutter(rest, times)
    positions = positions + noise * np.random.default_rng(seed).standard_normal(positions.shape)
    return Observation(
        name=name, markers=rest, positions=positions, times=times, known=Known(wind=WIND)
    )


def write_tracks(path: Path, *names: str, frames: int = 40) -> Path:
    """A table of recordings of so many frames, z up, in metres."""
    seen = flag(noise=0.5e-3, seed=1, seconds=2.2)
    lines = ["recording,frame,marker,u,v,x,y,z"]
    for name in names:
        for frame, at in enumerate(seen.positions[:frames]):
            for marker, ((u, v), (x, y, z)) in enumerate(zip(seen.markers, at, strict=True)):
                lines.append(f"{name},{frame},m{marker},{u:.6f},{v:.6f},{x:.6f},{y:.6f},{z:.6f}")
    path.write_text("\n".join(lines) + "\n")
    return path
