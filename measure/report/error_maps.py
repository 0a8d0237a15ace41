"""The error of one recording: over the material coordinates (u, v) of the cloth, or along the
markers where these lie on a line, in time and in frequency."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import LinearNDInterpolator
from scipy.spatial import Delaunay

from flagdata.answer.charts import Across, Axis, Cells, Chart, Colour, Dots, Line, Mark, Panel
from flagdata.core.arrays import FloatArray, IntArray
from measure.verdict.quantity import Display, display
from measure.verdict.verdict_record import Residual

_ACROSS = 90
"""Cells across a map."""
_LEAN = 1e-3
"""Shear that makes all diagonals of a regular grid run the same way."""
_SLIVER = 2e-2
"""Triangles smaller than this part of the median come of rounding, or of that shear, at straight
edges."""


@dataclass(frozen=True, kw_only=True)
class Shade:
    """What the colours of several maps mean: `low` to `high` [m]."""

    low: float
    high: float

    @property
    def in_unit(self) -> Display:
        """The unit of the numbers beside the colours."""
        return display((self.low, self.high), "m")

    @property
    def ends(self) -> tuple[float, float]:
        """Both in that unit."""
        return self.low * self.in_unit.factor, self.high * self.in_unit.factor


def size_shade(residuals: Sequence[Residual]) -> Shade:
    """Scales the errors of all recordings, before and after, from zero."""
    sizes = [v for r in residuals for v in (*r.in_space, *r.in_space_after)]
    return Shade(low=0.0, high=largest(sizes))


def mean_shade(residuals: Sequence[Residual]) -> Shade:
    """Scales the components of the mean errors of all recordings, symmetric about zero."""
    reach = largest([c for r in residuals for m in r.mean for c in m])
    return Shade(low=-reach, high=reach)


def residual_chart(residual: Residual, *, size: Shade, mean: Shade, after: str) -> Chart:
    """Draws the errors of one recording: root mean square over the cloth, of both models; the
    steady part of the base model's; in time; in frequency.

    Args:
        size, mean: colours of all recordings.
        after: what the model after is called, "with lift".
    """
    sizes = [("base model", residual.in_space)]
    if residual.in_space_after:
        sizes.append((after, residual.in_space_after))
    rows = [maps(residual.markers, sizes, size, "root mean square error")]
    if residual.mean:
        means = [(f"mean error in {axis}", [m[i] for m in residual.mean]) for i, axis in _AXES]
        rows.append(maps(residual.markers, means, mean, "mean error"))
    rows.append([in_time(residual, after=after), in_frequency(residual)])
    return Chart(rows=rows, heights=[2.7] * (len(rows) - 1) + [2.5])


_AXES = tuple(enumerate("xyz"))


def effect_chart(residual: Residual) -> Chart | None:
    """Draws where on the cloth what was added acts: by how much it moves what is predicted, on
    average over the stretch that the verdict holds; None where nothing was added."""
    before, after = (
        np.asarray(positions, dtype=np.float64) for positions in (residual.before, residual.after)
    )
    if not before.size or before.shape != after.shape:
        return None
    return moved_chart(residual.markers, after - before)


def moved_chart(markers: Sequence[Sequence[float]], moved: FloatArray) -> Chart:
    """Draws the mean of displacements (frame, marker, 3) [m] over the cloth, in each direction."""
    known = np.isfinite(moved)
    mean = np.where(known, moved, 0.0).sum(axis=0) / np.maximum(known.sum(axis=0), 1)
    mean[~known.any(axis=0)] = np.nan
    reach = largest(mean.ravel().tolist())
    parts = [(f"in {axis}", mean[:, i].tolist()) for i, axis in _AXES]
    shade = Shade(low=-reach, high=reach)
    return Chart(rows=[maps(markers, parts, shade, "mean change")], height=2.7)


def maps(
    markers: Sequence[Sequence[float]],
    parts: Sequence[tuple[str, Sequence[float]]],
    shade: Shade,
    meaning: str,
) -> list[Panel]:
    """Draws values at markers over the cloth, the colours' meaning beside the last.

    Args:
        markers: (marker, 2) [m].
        parts: title and values (marker,) [m] of each map.
    """
    places = np.asarray(markers, dtype=np.float64).reshape(-1, 2)
    draw = _profile if on_a_line(places) else _map
    labels = [""] * (len(parts) - 1) + [f"{meaning} [{shade.in_unit.unit}]"]
    return [
        draw(places, np.asarray(values, dtype=np.float64), shade, title, label)
        for (title, values), label in zip(parts, labels, strict=True)
    ]


def in_time(residual: Residual, *, after: str) -> Panel:
    """Draws the error against time, over the markers."""
    in_unit = display([*residual.in_time, *residual.in_time_after], "m")
    courses = [
        (residual.in_time, Colour.LOG, "base model"),
        (residual.in_time_after, Colour.FILM, after),
    ]
    marks = [
        Line(x=residual.times, y=np.asarray(course) * in_unit.factor, colour=colour, label=label)
        for course, colour, label in courses
        if course
    ]
    y = Axis(label=f"error [{in_unit.unit}]", limits=(0, None))
    return Panel(marks=marks, title="in time, over all markers", x=Axis(label="time [s]"), y=y)


def in_frequency(residual: Residual) -> Panel:
    """Draws the error's power spectral density, both axes logarithmic."""
    frequencies = np.asarray(residual.frequencies)
    marks = []
    for spectrum, colour in (
        (residual.spectrum, Colour.LOG),
        (residual.spectrum_after, Colour.FILM),
    ):
        power = np.asarray(spectrum)
        if len(power):
            shown = (frequencies > 0) & (power > 0)
            marks.append(Line(x=frequencies[shown], y=power[shown], colour=colour))
    return Panel(
        marks=marks,
        title="in frequency",
        x=Axis(label="frequency [Hz]", logarithmic=True),
        y=Axis(label="power spectral density [m²/Hz]", logarithmic=True),
    )


def triangles(markers: FloatArray) -> IntArray:
    """Triangulates markers (marker, 2) [m], (triangle, 3), without slivers; empty where they lie on
    a line."""
    if on_a_line(markers):
        return np.zeros((0, 3), dtype=np.int64)
    leaning = markers @ np.array([[1.0, 0.0], [_LEAN, 1.0]])
    faces = Delaunay(leaning).simplices.astype(np.int64)
    a, b, c = (markers[faces[:, i]] for i in range(3))
    area = np.abs((b - a)[:, 0] * (c - a)[:, 1] - (b - a)[:, 1] * (c - a)[:, 0])
    return faces[area > _SLIVER * np.median(area)]


def on_a_line(markers: FloatArray) -> bool:
    """Returns whether markers (marker, 2) span no area."""
    if len(markers) < 4:
        return True
    spread = np.linalg.svd(markers - markers.mean(axis=0), compute_uv=False)
    return bool(spread[1] <= 1e-6 * spread[0])


def _map(markers: FloatArray, values: FloatArray, shade: Shade, title: str, label: str) -> Panel:
    (left, bottom), (right, top) = markers.min(axis=0).tolist(), markers.max(axis=0).tolist()
    finite = np.isfinite(values)
    low, high = shade.ends
    marks: list[Mark] = []
    if np.count_nonzero(finite) >= 4 and not on_a_line(markers[finite]):
        rows = max(2, round(_ACROSS * (top - bottom) / (right - left)))
        grid = np.meshgrid(np.linspace(left, right, _ACROSS), np.linspace(bottom, top, rows))
        shown = LinearNDInterpolator(markers[finite], values[finite] * shade.in_unit.factor)(*grid)
        marks.append(
            Cells(
                values=shown,
                x=(left, right),
                y=(bottom, top),
                low=low,
                high=high,
                diverging=low < 0,
                label=label,
            )
        )
    marks.append(
        Dots(
            x=markers[:, 0],
            y=markers[:, 1],
            hollow=(~finite).tolist(),
            colour=Colour.INK,
            size=1.2,
        )
    )
    return Panel(marks=marks, title=title, x=Axis(label="u [m]"), y=Axis(label="v [m]"), equal=True)


def _profile(
    markers: FloatArray, values: FloatArray, shade: Shade, title: str, label: str
) -> Panel:
    """Draws markers on a line: the value against the distance along it."""
    along = np.linalg.norm(markers - markers[:1], axis=1) if len(markers) else np.zeros(0)
    order = np.argsort(along)
    marks: list[Mark] = [Across(y=0.0)] if shade.low < 0 else []
    marks.append(Line(x=along[order], y=values[order] * shade.in_unit.factor, colour=Colour.LOG))
    y = Axis(label=label or f"error [{shade.in_unit.unit}]", limits=shade.ends)
    return Panel(marks=marks, title=title, x=Axis(label="along the markers [m]"), y=y)


def largest(values: Sequence[float]) -> float:
    """Returns the largest size of finite values, or a millimetre where there is none."""
    return max((abs(v) for v in values if math.isfinite(v)), default=0.0) or 1e-3
