"""Cloth of a simulation or of a tracker as a place sees it, without a picture."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.errors import InputError
from measure.observables.drawing import drawn
from measure.observables.silhouettes import Silhouettes

_DRAWN = 120.0
"""Pixels of the flag's length in silhouettes that are drawn of geometry."""


@dataclass(frozen=True, kw_only=True)
class View:
    """Where a camera stands.

    Attributes:
        azimuth: horizontal angle from the wind's heading to the camera's axis, counter-clockwise
            from above [rad]: π/2 looks across the wind, and the air goes to the right. As
            `RenderParameters.camera_angle`.
        elevation: of the axis above the horizontal [rad]: positive looks up at the flag.
        distance: from the middle of the flag, which the axis goes through [m]; infinite for a
            parallel projection.
    """

    azimuth: float = math.pi / 2
    elevation: float = 0.0
    distance: float = math.inf

    def __post_init__(self) -> None:
        if not abs(self.elevation) < math.radians(80) or not self.distance > 0:
            raise InputError(
                f"the elevation is {math.degrees(self.elevation):.0f}° and the distance "
                f"{self.distance:g} m",
                where="view",
                fix="give an elevation below 80° and a distance above 0",
            )

    def axes(self, heading: float) -> FloatArray:
        """Returns (3, 3) rows: the picture's right, its up, and the direction of view, in a wind
        that goes to `heading`."""
        around, up = heading + self.azimuth, self.elevation
        forward = [math.cos(around) * math.cos(up), math.sin(around) * math.cos(up), math.sin(up)]
        right = [math.sin(around), -math.cos(around), 0.0]
        return np.array([right, np.cross(right, forward), forward])


@dataclass(frozen=True, kw_only=True, eq=False)
class ClothWindow:
    """A window of cloth in the plane of a picture.

    Attributes:
        times: (n,) ascending [s].
        points: (n, vertex, 2) in metres at the hoist's distance, as someone measures who knows the
            flag's height: x to the right, z up, from any origin; `seen_from` takes the middle of
            the hoist.
        faces: (face, 3) vertex indices.
        hoist: (k,) vertices along the hoist, from its upper end to its lower one; 2 or more.
        free: (m,) vertices along the free edge, likewise.
        length, height: of the flat flag [m].

    Raises:
        InputError: shapes that disagree, values that are not finite, vertices that are not there.
    """

    times: FloatArray
    points: FloatArray
    faces: IntArray
    hoist: IntArray
    free: IntArray
    length: float
    height: float

    def __post_init__(self) -> None:
        n, vertices = len(self.times), self.points.shape[1] if self.points.ndim == 3 else 0
        if self.points.shape != (n, vertices, 2) or n < 2 or not np.isfinite(self.points).all():
            raise InputError(
                f"points of shape {self.points.shape} at {n} instants, all finite: "
                f"{np.isfinite(self.points).all()}",
                where="cloth",
                fix="give finite points (n, vertex, 2) at two instants or more",
            )
        for name, indices in (
            ("hoist", self.hoist),
            ("free edge", self.free),
            ("faces", self.faces),
        ):
            if indices.size < 2 or indices.min() < 0 or indices.max() >= vertices:
                raise InputError(
                    f"vertices of the {name} that are not there",
                    where="cloth",
                    fix="give their indices",
                )

    @cached_property
    def side(self) -> float:
        """1 where the flag flies to the right, −1 to the left."""
        x = self.points[..., 0]
        return 1.0 if x[:, self.free].mean() >= x[:, self.hoist].mean() else -1.0

    @cached_property
    def middle_of_hoist(self) -> FloatArray:
        """(n, 2) midway between the hoist's ends: what a person finds on the pole [m]."""
        return (self.points[:, self.hoist[0]] + self.points[:, self.hoist[-1]]) / 2

    @cached_property
    def free_edge(self) -> FloatArray:
        """(n, 2) mean of the free edge: away from the middle of the hoist, and above it [m]."""
        return self._from_hoist(self.points[:, self.free].mean(axis=1))

    @cached_property
    def middle(self) -> FloatArray:
        """(n, 2) centroid of the middle third of the silhouette's area [m from the hoist, as
        `free_edge`]."""
        return self.silhouettes.middle_of(1 / 3, 2 / 3)

    @cached_property
    def silhouettes(self) -> Silhouettes:
        """Its outlines, drawn at `_DRAWN` pixels of the flag's length."""
        scale = _DRAWN / self.length
        turned = (
            (self.points - self.middle_of_hoist.mean(axis=0)) * np.array([self.side, -1.0]) * scale
        )
        low = np.floor(turned.min(axis=(0, 1))) - 2
        width, high = (np.ceil(turned.max(axis=(0, 1))) - low + 3).astype(int).tolist()
        masks = drawn(turned - low, self.faces, width=width, height=high)
        return Silhouettes(
            times=self.times,
            masks=masks,
            scale=scale,
            hoist=-low,
            length=self.length,
            height=self.height,
        )

    def _from_hoist(self, places: FloatArray) -> FloatArray:
        return (places - self.middle_of_hoist) * np.array([self.side, 1.0])


def seen_from(
    view: View,
    positions: NDArray[np.floating],
    *,
    times: FloatArray,
    faces: NDArray[np.integer],
    hoist: NDArray[np.integer],
    free: NDArray[np.integer],
    length: float,
    height: float,
    heading: float = 0.0,
) -> ClothWindow:
    """Projects cloth into the view of a camera.

    Args:
        view: the place.
        positions: (n, vertex, 3) [m], z up.
        times: (n,) [s].
        faces, hoist, free, length, height: see `ClothWindow`.
        heading: direction that the wind goes to, counter-clockwise from +x [rad].

    Raises:
        InputError: as `ClothWindow`, or cloth behind the camera.
    """
    upper, lower = int(hoist[0]), int(hoist[-1])
    ends = positions[:, [upper, lower]].mean(axis=(0, 1))
    # People aim at the flag's middle: from near by the hoist is then seen at another angle than the
    # axis'.
    aim = ends + length / 2 * np.array([math.cos(heading), math.sin(heading), 0.0])
    camera_frame = (np.asarray(positions, np.float64) - aim) @ view.axes(heading).T
    places = camera_frame[..., :2]
    if math.isfinite(view.distance):
        depth = view.distance + camera_frame[..., 2]
        if depth.min() < 0.05 * view.distance:
            raise InputError(
                "cloth reaches to the camera or behind it", where="view", fix="enlarge the distance"
            )
        places = places * (view.distance / depth)[..., None]
    # The hoist looks shorter from above or below and by its distance, and its known height is what
    # gives the scale.
    upright = (positions[:, upper, 2] - positions[:, lower, 2]).mean()
    places = places * (upright / (places[:, upper, 1] - places[:, lower, 1]).mean())
    places = places - places[:, [upper, lower]].mean(axis=(0, 1))
    return ClothWindow(
        times=times,
        points=places,
        faces=np.asarray(faces, np.int64),
        hoist=np.asarray(hoist, np.int64),
        free=np.asarray(free, np.int64),
        length=length,
        height=height,
    )


def edges_of(rest: NDArray[np.floating]) -> tuple[IntArray, IntArray]:
    """Finds hoist and free edge of a flat flag from their upper ends: vertices of least and of
    largest first coordinate.

    Args:
        rest: (vertex, 2) along the length and up along the hoist [m].
    """
    along, up = np.asarray(rest, np.float64).T
    tolerance = 1e-6 * max(1.0, float(np.ptp(along)))
    edges = []
    for side in (along <= along.min() + tolerance, along >= along.max() - tolerance):
        vertices = np.flatnonzero(side)
        edges.append(vertices[np.argsort(-up[vertices], kind="stable")].astype(np.int64))
    return edges[0], edges[1]
