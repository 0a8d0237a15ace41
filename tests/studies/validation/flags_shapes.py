"""Pictures of cloth in space: shaded faces, seen from a distance without perspective, z up."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from flagdata.core.arrays import FloatArray, IntArray
from sim.cloth.scene import flag
from tests.studies.validation.flags_runs import CAMEL, RATE, Ensemble

SHOWN = (2.0, 4.0, 6.0, 8.0, 10.0)
INSTANTS = (0.5, 1.0, 8.0, 8.3, 12.0)
_FRONT, _BACK = np.array([0.80, 0.42, 0.20]), np.array([0.30, 0.50, 0.68])
_LIGHT = np.array([-0.7, -0.55, 0.45])
_AMBIENT = 0.3


@dataclass(frozen=True, kw_only=True)
class View:
    """Looking at the origin from an azimuth (from +x towards +y) and an elevation [rad]; lengths
    stay metres."""

    azimuth: float
    elevation: float

    @property
    def axes(self) -> FloatArray:
        """(3, 3) rows: right, up, towards the eye."""
        a, e = self.azimuth, self.elevation
        toward = np.array([math.cos(e) * math.cos(a), math.cos(e) * math.sin(a), math.sin(e)])
        right = np.array([-math.sin(a), math.cos(a), 0.0])
        return np.stack([right, np.cross(toward, right), toward])

    def seen(self, points: NDArray[np.floating]) -> FloatArray:
        """(…, 3) as right, up and towards the eye [m]."""
        return np.asarray(points, dtype=np.float64) @ self.axes.T


# From the side of negative y, so that the wind (+x) blows to the right, turned and raised enough to
# see depth.
SIDE = View(azimuth=math.radians(-68), elevation=math.radians(16))


def draw_cloth(
    axes: Axes, position: NDArray[np.floating], faces: IntArray, view: View = SIDE
) -> None:
    """The faces from far to near, lit from the viewer's upper left; the two sides of the cloth
    differ in colour.

    Args:
        position: (vertex, 3) [m].
        faces: (face, 3).
    """
    corners = np.asarray(position, dtype=np.float64)[faces]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    front = normal @ view.axes[2] > 0
    smooth = _smoothed(normal, faces, len(position))
    facing = np.where(front[:, None], smooth, -smooth)
    light = _AMBIENT + (1 - _AMBIENT) * np.clip(facing @ (_LIGHT / np.linalg.norm(_LIGHT)), 0, 1)
    colour = np.where(front[:, None], _FRONT, _BACK) * light[:, None] * 1.15
    seen = view.seen(corners)
    order = np.argsort(seen[..., 2].mean(axis=1))
    paint = np.clip(colour[order], 0, 1)
    axes.add_collection(
        PolyCollection(seen[order][..., :2], facecolors=paint, edgecolors=paint, linewidths=0.25)
    )


def _smoothed(normal: FloatArray, faces: IntArray, count: int) -> FloatArray:
    """(face, 3) unit normals, each the mean of the means at its corners."""
    at_vertices = np.zeros((count, 3))
    for corner in faces.T:
        np.add.at(at_vertices, corner, normal)
    mean = at_vertices[faces].mean(axis=1)
    return mean / np.maximum(np.linalg.norm(mean, axis=1, keepdims=True), 1e-12)


def _line(axes: Axes, *points: tuple[float, float, float], **style: float | str) -> None:
    seen = SIDE.seen(np.array(points))
    axes.plot(seen[:, 0], seen[:, 1], **style)  # type: ignore[arg-type]


def _furniture(
    axes: Axes, position: NDArray[np.floating], held: tuple[int, int], wind: float
) -> None:
    """The held corners, the line between them, the ground-plane axes, a metre, and the wind."""
    _line(axes, (0, 0, -0.75), (0, 0, 1.25), color="#999999", lw=0.8, zorder=0)
    corners = SIDE.seen(position[list(held)])
    axes.plot(corners[:, 0], corners[:, 1], "o", color="black", ms=2.5)
    start, end = SIDE.seen(np.array([[-0.55, 0, 1.12], [-0.55 + 0.045 * wind, 0, 1.12]]))[:, :2]
    axes.annotate(
        "",
        xy=tuple(end),
        xytext=tuple(start),
        arrowprops={"arrowstyle": "-|>", "color": "#1f5f8b", "lw": 1.4},
    )
    axes.set(xlim=(-0.6, 1.5), ylim=(-0.78, 1.3), aspect="equal")
    axes.axis("off")


def _compass(axes: Axes) -> None:
    """Directions x (with the wind), y and z, and a length of 0.5 m."""
    origin = np.array([0.7, 0.0, 0.45])
    for name, step in (("x", (0.5, 0, 0)), ("y", (0, 0.5, 0)), ("z", (0, 0, 0.5))):
        start, end = SIDE.seen(np.stack([origin, origin + step]))[:, :2]
        axes.annotate(
            "",
            xy=tuple(end),
            xytext=tuple(start),
            arrowprops={"arrowstyle": "-|>", "color": "#444444", "lw": 0.8},
        )
        axes.text(
            *(end + 0.06 * (end - start)),
            name,
            fontsize=8,
            color="#444444",
            ha="center",
            va="center",
        )


def draw_shapes(ensemble: Ensemble, path: Path) -> None:
    """A row for each wind, a column for each instant, of each wind's first replicate."""
    scene = flag(material=CAMEL, wind_speed=0.0)
    figure = Figure(figsize=(2.05 * len(INSTANTS), 2.0 * len(SHOWN) + 0.8), layout="constrained")
    panels = figure.subplots(len(SHOWN), len(INSTANTS))
    for axes, instant in zip(panels[0], INSTANTS, strict=True):
        axes.set_title(f"t = {instant:g} s", fontsize=9)
    for row, wind in zip(panels, SHOWN, strict=True):
        group = int(np.flatnonzero(ensemble.values == wind)[0])
        for axes, instant in zip(row, INSTANTS, strict=True):
            position = ensemble.first[round(instant * RATE), ..., group]
            draw_cloth(axes, position, scene.mesh.faces)
            _furniture(
                axes, position, (scene.handles.vertices[0], scene.handles.vertices[-1]), wind
            )
        row[0].text(
            0.02, 0.80, f"{wind:g} m/s", transform=row[0].transAxes, fontsize=10, color="#1f5f8b"
        )
    _compass(panels[0, -1])
    figure.suptitle(
        "A 1.5 × 1.0 m flag of Camel Ponte Roma (0.284 kg/m², d = 0.25 ms), self-contact on; wind "
        "towards +x (arrow, "
        "in proportion).\nHeld at two hoist corners (dots), at rest across the wind at t = 0; "
        "blue: the side "
        "that faced the wind then.\nView from −y, 22° to the lee and 16° above; axes (upper right) "
        "0.5 m long; shading "
        "smoothed.",
        fontsize=9,
    )
    figure.savefig(path, dpi=78)
