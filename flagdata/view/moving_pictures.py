"""What moves in an artifact, as JPEGs with their instants: frames of records, and drawings of
meshes and markers."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from flagdata.core.arrays import AnyArray, FloatArray
from flagdata.core.schema import Kind
from flagdata.errors import LimitError
from flagdata.export.export_source import FILMED, entry_of
from flagdata.lake import Lake
from flagdata.lake.marker_sequences import read_markers
from flagdata.lake.mesh_sequences import read_meshes
from flagdata.record import Record
from flagdata.record.signals import Instants
from flagdata.record.writer import encode_jpeg

DRAWN = frozenset({Kind.MESHES, Kind.MARKERS})
"""Kinds that are drawn, from sequences that are read whole."""
_DRAWN_BYTES = 256 << 20
_SIDE = 320  # px of a drawing
_ROOM = 0.06  # of it, left on each side
_CLOTH, _SHADE, _GROUND, _INK = 225, 150, 250, 60
_AZIMUTH, _HEIGHT = np.radians(-60.0), np.radians(20.0)
"""From where a drawing is looked at: obliquely from in front, and from above."""


@dataclass(frozen=True, kw_only=True)
class FilmStrip:
    """Pictures in order.

    Attributes:
        times: (n,) instants on the common clock [UTC ns], or since the start of a simulation.
        jpegs: gives `count` pictures from an index on.
        record: that they are from; `None` where they are drawn.
        wind_span: first and last instant of the wind that belongs to it [UTC ns].
    """

    times: Instants
    jpegs: Callable[[int, int], list[bytes]]
    record: Record | None = None
    wind_span: tuple[int, int] | None = None

    def __len__(self) -> int:
        return len(self.times)


def film_of(
    lake: Lake, row: Mapping[str, Any], opened: Callable[[str], Record]
) -> FilmStrip | None:
    """Finds what moves in an artifact; `None` where nothing does.

    Args:
        opened: gives the record of an object.

    Raises:
        NotFoundError: its object is not there.
        CorruptError: its object is damaged.
        LimitError: a sequence that is too long to be drawn.
    """
    name, kind = row["object"], row["kind"]
    if name is None:
        return None
    if kind in FILMED:
        entry = entry_of(row, opened(name))
        if not entry.count:
            return None
        first = entry.first
        return FilmStrip(
            times=entry.frame_times,
            jpegs=lambda at, count: entry.record.jpegs(first + at, count),
            record=entry.record,
            wind_span=entry.wind_span,
        )
    if kind not in DRAWN:
        return None
    if (size := lake.objects.size(name)) > _DRAWN_BYTES:
        raise LimitError(
            f"a sequence of {size} B is not drawn",
            where=row["artifact"],
            fix="export a part of it, and look at that",
        )
    return _meshes(lake, name) if kind == Kind.MESHES else _markers(lake, name)


def _meshes(lake: Lake, name: str) -> FilmStrip:
    sequence = read_meshes(lake.object_path(name))
    project = _camera(sequence.positions.reshape(-1, 3))

    def drawn(index: int) -> bytes:
        mesh = sequence.frame(index)
        return _jpeg(_cloth(project(mesh.positions), mesh.positions, mesh.faces))

    return FilmStrip(
        times=sequence.time,
        jpegs=lambda at, count: [drawn(index) for index in range(at, at + count)],
    )


def _markers(lake: Lake, name: str) -> FilmStrip:
    sequence = read_markers(lake.object_path(name))
    project = _camera(sequence.positions.reshape(-1, 3))

    def drawn(index: int) -> bytes:
        image = Image.new("L", (_SIDE, _SIDE), _GROUND)
        pen = ImageDraw.Draw(image)
        points = project(sequence.positions[index])
        for x, y, _ in points[np.isfinite(points).all(axis=1)].tolist():
            pen.ellipse((x - 2, y - 2, x + 2, y + 2), fill=_INK)
        return _jpeg(image)

    return FilmStrip(
        times=sequence.time,
        jpegs=lambda at, count: [drawn(index) for index in range(at, at + count)],
    )


def _camera(points: AnyArray) -> Callable[[AnyArray], FloatArray]:
    """Places points (n, 3) [m], z up, on a square picture that holds all of the given ones: (n, 3)
    x, y [px], depth."""
    forth = np.array([-np.sin(_AZIMUTH), np.cos(_AZIMUTH), 0.0])  # along the picture's x
    away = np.array(
        [np.cos(_AZIMUTH) * np.cos(_HEIGHT), np.sin(_AZIMUTH) * np.cos(_HEIGHT), np.sin(_HEIGHT)]
    )
    axes = np.stack([forth, np.cross(away, forth), away])
    axes[1] *= -1 if axes[1][2] > 0 else 1  # the picture's y points down
    flat = points[np.isfinite(points).all(axis=1)] @ axes.T
    low, high = (flat.min(axis=0), flat.max(axis=0)) if len(flat) else (np.zeros(3), np.ones(3))
    scale = _SIDE * (1 - 2 * _ROOM) / max(float((high - low)[:2].max()), 1e-9)
    middle = (low + high)[:2] / 2

    def place(points: AnyArray) -> FloatArray:
        projected = points @ axes.T
        projected[:, :2] = (projected[:, :2] - middle) * scale + _SIDE / 2
        return projected

    return place


def _cloth(corners: FloatArray, positions: AnyArray, faces: NDArray[np.int32]) -> Image.Image:
    """Triangles from the farthest to the nearest, lighter where they face the viewer."""
    image = Image.new("L", (_SIDE, _SIDE), _GROUND)
    pen = ImageDraw.Draw(image)
    first, second, third = (positions[faces[:, corner]].astype(np.float64) for corner in range(3))
    normal = np.cross(second - first, third - first)
    length = np.linalg.norm(normal, axis=1)
    facing = (
        np.abs(normal @ np.array([np.cos(_AZIMUTH), np.sin(_AZIMUTH), 0.5]))
        / np.maximum(length, 1e-12)
        / 1.12
    )
    gray = (_CLOTH - _SHADE * (1 - facing)).astype(int)
    order = np.argsort(corners[faces, 2].mean(axis=1))
    for face, value in zip(corners[faces[order], :2].tolist(), gray[order].tolist(), strict=True):
        pen.polygon([tuple(point) for point in face], fill=value)
    return image


def _jpeg(image: Image.Image) -> bytes:
    return encode_jpeg(np.asarray(image))


def thumbnail(film: FilmStrip, *, side: int) -> bytes:
    """Draws the middle picture of a film, as a JPEG of at most `side` pixels either way."""
    (picture,) = film.jpegs(len(film) // 2, 1)
    with Image.open(io.BytesIO(picture)) as image:
        image.thumbnail((side, side))
        out = io.BytesIO()
        image.convert("L").save(out, "jpeg", quality=82)
    return out.getvalue()
