"""The error over the cloth: maps over the material coordinates (u, v), or profiles where the
markers lie on a line."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup, escape
from matplotlib import colormaps
from PIL import Image
from scipy.interpolate import LinearNDInterpolator
from scipy.spatial import Delaunay

from flagdata.core.arrays import FloatArray, IntArray
from flagdata.pages.page_pictures import data_url
from measure.report.chart import Chart, Linear, drawing, room_beside
from measure.verdict.quantity import Display, display
from measure.verdict.verdict_record import Residual

_WIDTH = 300.0
_LEFT, _TOP, _BOTTOM = 46.0, 26.0, 40.0
_PIXELS = 150  # across a map; the browser smooths
_LEVELS = 255  # colours of a picture; one index more stands for none
_LEAN = 1e-3  # shear that makes all diagonals of a regular grid run the same way
# triangles smaller than this part of the median come of rounding, or of that shear, at straight
# edges
_SLIVER = 2e-2


@dataclass(frozen=True, kw_only=True)
class Shade:
    """What the colours of several maps mean: `low` to `high` [m] over a colour map of
    matplotlib."""

    low: float
    high: float
    colours: str

    def in_unit(self) -> Display:
        return display((self.low, self.high), "m")

    def picture(self, values: FloatArray) -> str:
        """Encodes a PNG of values (row, column) [m], the first row on top, as a URL; transparent
        where there is no value."""
        part = (values - self.low) / (self.high - self.low)
        indices = (
            np.where(np.isfinite(part), part * (_LEVELS - 1), _LEVELS).round().astype(np.uint8)
        )
        image = Image.frombytes("P", (indices.shape[1], indices.shape[0]), indices.tobytes())
        palette = (
            (255 * colormaps[self.colours](np.linspace(0, 1, _LEVELS))[:, :3])
            .round()
            .astype(np.uint8)
        )
        image.putpalette(palette.tobytes() + bytes(3))
        buffer = io.BytesIO()
        image.save(buffer, "PNG", transparency=_LEVELS)
        return data_url(buffer.getvalue(), "image/png")


def size_shade(residuals: Sequence[Residual]) -> Shade:
    """Scales the errors of all recordings, before and after, from zero."""
    return Shade(
        low=0.0,
        high=_largest([v for r in residuals for v in (*r.in_space, *r.in_space_after)]),
        colours="viridis",
    )


def mean_shade(residuals: Sequence[Residual]) -> Shade:
    """Scales the components of the mean errors of all recordings, symmetric about zero."""
    reach = _largest([c for r in residuals for m in r.mean for c in m])
    return Shade(low=-reach, high=reach, colours="RdBu_r")


def size_maps(residual: Residual, shade: Shade, after_label: str) -> list[tuple[str, Markup]]:
    """Draws (heading, chart) of the root mean square error over the cloth: of the base model, then
    of `after_label`."""
    parts = [("base model", residual.in_space)]
    if residual.in_space_after:
        parts.append((after_label, residual.in_space_after))
    return _maps(residual, parts, shade, "root mean square error")


def mean_maps(residual: Residual, shade: Shade) -> list[tuple[str, Markup]]:
    """Draws (heading, chart) of x, y and z of the base model's mean error over the cloth."""
    parts = [
        (f"mean error in {axis}", [m[i] for m in residual.mean]) for i, axis in enumerate("xyz")
    ]
    return _maps(residual, parts, shade, "mean error of the base model") if residual.mean else []


def colour_bar(shade: Shade, meaning: str) -> Markup:
    """Draws what the colours mean."""
    in_unit = shade.in_unit()
    scale = Linear(shade.low * in_unit.factor, shade.high * in_unit.factor, 12, 288)
    image = shade.picture(np.linspace(shade.low, shade.high, 128)[None, :])
    parts = [
        f'<image href="{image}" x="12" y="0" width="276" height="10" preserveAspectRatio="none"/>'
    ]
    for value, label in scale.ticks(room_beside):
        parts.append(f'<path class="tick" d="M{scale(value):.1f} 10v4"/>')
        parts.append(
            f'<text x="{scale(value):.1f}" y="26" text-anchor="middle">{escape(label)}</text>'
        )
    parts.append(
        f'<text class="label" x="150" y="43" text-anchor="middle">{escape(meaning)} '
        f"[{escape(in_unit.unit)}]</text>"
    )
    ends = f"{scale.low:.3g} to {scale.high:.3g} {in_unit.unit}"
    return drawing(300, 48, f"Colours of the {meaning}", ends, "".join(parts))


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


def _maps(
    residual: Residual, parts: Sequence[tuple[str, Sequence[float]]], shade: Shade, meaning: str
) -> list[tuple[str, Markup]]:
    markers = np.asarray(residual.markers, dtype=np.float64).reshape(-1, 2)
    draw = _profile if on_a_line(markers) else _map
    return [
        (
            heading,
            draw(markers, np.asarray(values, dtype=np.float64), shade, f"{meaning}, {heading}"),
        )
        for heading, values in parts
    ]


def _map(markers: FloatArray, values: FloatArray, shade: Shade, title: str) -> Markup:
    (left, bottom), (right, top) = markers.min(axis=0), markers.max(axis=0)
    across = _WIDTH - _LEFT - 14
    tall = float(np.clip(across * (top - bottom) / (right - left), 30, 320))
    finite = np.isfinite(values)
    chart = Chart(
        title=title,
        description="colours over the cloth",
        x=Linear(float(left), float(right), _LEFT, _LEFT + across),
        y=Linear(float(bottom), float(top), _TOP + tall, _TOP),
        x_label="u [m]",
        y_label="v [m]",
        width=_WIDTH,
        height=_TOP + tall + _BOTTOM,
    )
    if np.count_nonzero(finite) >= 4 and not on_a_line(markers[finite]):
        rows = max(2, round(_PIXELS * tall / across))
        grid = np.meshgrid(np.linspace(left, right, _PIXELS), np.linspace(top, bottom, rows))
        image = shade.picture(LinearNDInterpolator(markers[finite], values[finite])(*grid))
        chart.marks.append(
            f'<image href="{image}" x="{_LEFT:g}" y="{_TOP:g}" width="{across:.1f}" '
            f'height="{tall:.1f}" '
            'preserveAspectRatio="none"/>'
        )
    kinds = ("marker lost", "marker")
    for (u, v), is_finite in zip(markers.tolist(), finite.tolist(), strict=True):
        chart.marks.append(
            f'<circle class="{kinds[is_finite]}" cx="{chart.x(u):.1f}" cy="{chart.y(v):.1f}" '
            'r="1"/>'
        )
    return chart.svg()


def _profile(markers: FloatArray, values: FloatArray, shade: Shade, title: str) -> Markup:
    """Draws markers on a line: the value against the distance along it."""
    along = np.linalg.norm(markers - markers[:1], axis=1) if len(markers) else np.zeros(0)
    order = np.argsort(along)
    in_unit = shade.in_unit()
    chart = Chart(
        title=title,
        description="against the distance along the markers",
        x=Linear.over(along.tolist(), 50, 288),
        y=Linear(shade.low * in_unit.factor, shade.high * in_unit.factor, 150, _TOP),
        x_label="along the markers [m]",
        y_label=f"error [{in_unit.unit}]",
        width=_WIDTH,
        height=192,
    )
    if shade.low < 0:
        chart.line([chart.x.low, chart.x.high], [0.0, 0.0], "zero")
    chart.line(along[order].tolist(), (values[order] * in_unit.factor).tolist(), "before")
    return chart.svg()


def _largest(values: Sequence[float]) -> float:
    return max((abs(v) for v in values if math.isfinite(v)), default=0.0) or 1e-3
