"""The observed cloth in motion against the two predictions, thinned to what a page can carry.

Positions travel as 16-bit integers, little-endian, base64: the observed ones, and the errors of
either model on a scale of their own, so that an error of a tenth of a millimetre is not lost beside
a cloth of metres. A marker missing in a frame is `MISSING`.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jinja2.utils import htmlsafe_json_dumps
from markupsafe import Markup, escape

from flagdata.answer.answer import Figure
from flagdata.core.arrays import FloatArray, IntArray
from flagdata.pages.render import text_of
from measure.report.error_maps import on_a_line, triangles
from measure.verdict.verdict_record import Residual

MISSING = -32768
_REACH = 32767
_FRAMES = 60
_MARKERS = 260
_VISIBLE = 0.12  # of the cloth's size: what the largest errors are enlarged to
FACTORS = (1, 2, 5, 10, 20, 50, 100)
ELEVATION = math.pi / 9
_HALF = 150.0  # of a panel
_GAP = 10.0
_HEAD = 22.0  # above the panels, for their names
_FILLED = 0.86  # of a panel, by the observed cloth; the rest is for errors
VIEW = {
    "elevation": ELEVATION,
    "half": _HALF,
    "gap": _GAP,
    "head": _HEAD,
    "filled": _FILLED,
    "missing": MISSING,
    "reach": _REACH,
}
"""What the player has to know of the projection and of the packing."""


@dataclass(frozen=True, kw_only=True)
class MotionClip:
    """One recording's stretch, ready for the page.

    Attributes:
        recording: its name.
        held_out: whether neither model was fitted to it.
        rate: frames a second.
        frames, markers: how many are shown.
        of_frames, of_markers: how many the verdict holds.
        edges: (edge, 2) pairs of markers that are joined.
        observed, before, after: (frame, marker, xyz) [m], about the mean; predictions as they are,
            not as errors. `after` is None where no effect was named.
        azimuth: of the view at the start [rad].
        factor: by which errors are enlarged at the start.
    """

    recording: str
    held_out: bool
    rate: float
    frames: int
    markers: int
    of_frames: int
    of_markers: int
    edges: IntArray
    observed: FloatArray
    before: FloatArray
    after: FloatArray | None
    azimuth: float
    factor: int

    @property
    def radius(self) -> float:
        """Half a panel's width [m]: the circle about the upright through the mean that holds the
        observed cloth."""
        return _finite_reach(np.linalg.norm(self.observed[..., :2], axis=-1))

    @property
    def rise(self) -> float:
        """How far the observed cloth reaches up or down in any view of the player's elevation
        [m]."""
        return _finite_reach(self.observed[..., 2]) * math.cos(ELEVATION) + self.radius * math.sin(
            ELEVATION
        )


def pack_clip(clip: MotionClip) -> dict[str, Any]:
    """Packs a stretch for the player, JSON values."""
    size = _finite_reach(clip.observed)
    errors = [p - clip.observed for p in (clip.before, clip.after) if p is not None]
    reach = max((_finite_reach(e) for e in errors), default=1.0)
    return {
        "recording": clip.recording,
        "rate": clip.rate,
        "frames": clip.frames,
        "markers": clip.markers,
        "edges": clip.edges.ravel().tolist(),
        "size": size,
        "reach": reach,
        "radius": clip.radius,
        "rise": clip.rise,
        "azimuth": clip.azimuth,
        "factor": clip.factor,
        "observed": _pack_values(clip.observed, size),
        "errors": [_pack_values(e, reach) for e in errors],
    }


def moving_figure(residuals: Sequence[Residual], *, after: str) -> Figure | None:
    """Makes the player of all recordings that hold a stretch, unseen ones first; None where none
    does.

    Args:
        after: what the model after is called, "with lift".
    """
    clips = [clip for clip in map(motion, residuals) if clip is not None]
    clips = sorted(clips, key=lambda clip: not clip.held_out)
    if not clips:
        return None
    first = clips[0]
    enlarged = (
        f"with the errors enlarged {first.factor} times at the start"
        if first.factor > 1
        else "with the errors as they are"
    )
    thinned = [
        f"{clip.recording}: {clip.frames} of {clip.of_frames} frames, {clip.markers} of "
        f"{clip.of_markers} markers shown."
        for clip in clips
        if clip.markers < clip.of_markers or clip.frames < clip.of_frames
    ]
    caption = (
        f"Grey: the cloth as observed. In colour: predicted from the frames before, {enlarged}."
    )
    return Figure(
        title="The cloth in motion",
        content=_player(clips, after),
        caption=" ".join([caption, *thinned]),
    )


_STYLE = """
#motion { --mesh: #9aa5ab; max-width: 52rem; } #motion.single { max-width: 26rem; }
@media screen and (prefers-color-scheme: dark) { #motion { --mesh: #6d7a81; } }
#motion svg { display: block; width: 100%; height: auto; overflow: visible; }
#motion text { font: 11px system-ui, sans-serif; fill: var(--ink); }
#motion .mesh { fill: none; stroke-width: .9; stroke: var(--mesh); }
#motion .mesh.before { stroke: var(--log); } #motion .mesh.after { stroke: var(--film); }
#motion .controls { display: flex; flex-wrap: wrap; gap: .4rem 1rem; align-items: center;
  font-size: .85rem; margin: .4rem 0; }
#motion .controls[hidden] { display: none; }
#motion label { display: inline-flex; gap: .4rem; align-items: center; }
#motion button { min-width: 5rem; font: inherit; padding: .2rem .6rem; }
#motion select { max-width: 12rem; } #motion input { width: 8rem; }
@media print { #motion .controls { display: none; } }
"""
_CONTROLS = Markup(
    '<div class="controls" hidden>'
    '<button type="button" data-control="play">Play</button>'
    '<label>recording <select data-control="recording">{recordings}</select></label>'
    '<label>frame <input type="range" min="0" max="1" value="0" data-control="frame"></label>'
    '<label>view from <input type="range" min="-180" max="180" value="0" data-control="turn" '
    'aria-label="direction of view in degrees"></label>'
    '<label>errors <select data-control="factor">{factors}</select></label>'
    '<label>speed <select data-control="speed"><option value="1">1</option>'
    '<option value="0.25" selected>1/4</option><option value="0.1">1/10</option></select></label>'
    "</div>"
)
_OPTION = Markup('<option value="{}"{}>{}</option>')


def _player(clips: Sequence[MotionClip], after: str) -> Markup:
    """Writes the player as a part of a page, with its style, data and script."""
    stills = [still(clip, after) for clip in clips]
    listed = [
        pack_clip(clip) | {"still": str(drawn)} for clip, drawn in zip(clips, stills, strict=True)
    ]
    names = [f"{clip.recording}{', unseen' if clip.held_out else ''}" for clip in clips]
    recordings = [_OPTION.format(number, "", name) for number, name in enumerate(names)]
    factors = [
        _OPTION.format(f, Markup(" selected") if f == clips[0].factor else "", f"× {f}")
        for f in FACTORS
    ]
    controls = _CONTROLS.format(
        recordings=Markup("").join(recordings), factors=Markup("").join(factors)
    )
    data = htmlsafe_json_dumps(
        {"view": VIEW, "list": listed}, allow_nan=False, separators=(",", ":")
    )
    return Markup(
        '<style>{}</style><div id="motion"{}><div class="stage">{}</div>{}</div>'
        '<script type="application/json" id="motion-data">{}</script><script>{}</script>'
    ).format(
        Markup(_STYLE),
        Markup(' class="single"') if clips[0].after is None else "",
        stills[0],
        controls,
        data,
        Markup(text_of("measure.report", "motion.js")),
    )


def motion(residual: Residual) -> MotionClip | None:
    """Makes the stretch a residual holds, its markers thinned evenly; None where it holds none, or
    no times."""
    observed, before, after = (
        _array(p) for p in (residual.observed, residual.before, residual.after)
    )
    rate = _rate(residual.times)
    if observed.size == 0 or before.shape != observed.shape or math.isnan(rate):
        return None
    chosen = _spread(observed.shape[1], _MARKERS)
    part = slice(0, _FRAMES)
    uv = np.asarray(residual.markers, dtype=np.float64).reshape(-1, 2)[chosen]
    shown_positions = observed[part][:, chosen]
    centre = np.array([_centre(shown_positions[..., i]) for i in range(3)])
    shown_positions = shown_positions - centre
    first = before[part][:, chosen] - centre
    return MotionClip(
        recording=residual.recording,
        held_out=residual.held_out,
        rate=rate,
        frames=len(shown_positions),
        markers=len(chosen),
        of_frames=len(observed),
        of_markers=observed.shape[1],
        edges=_edges(uv),
        observed=shown_positions,
        before=first,
        after=after[part][:, chosen] - centre if after.shape == observed.shape else None,
        azimuth=_azimuth(shown_positions),
        factor=_enlargement(shown_positions, first),
    )


def still(stretch: MotionClip, after_label: str) -> Markup:
    """Draws the first frame as the player draws it: one panel a model, the observed cloth under the
    prediction.

    The view is from the side, turned and raised a little; `motion.js` uses the same projection.
    """
    panels = [("base model", "before", stretch.before)]
    if stretch.after is not None:
        panels.append((after_label, "after", stretch.after))
    scale = _HALF * _FILLED / stretch.radius
    tall = stretch.rise * scale / _FILLED
    parts = []
    for number, (heading, kind, predicted) in enumerate(panels):
        enlarged = stretch.observed[0] + stretch.factor * (predicted[0] - stretch.observed[0])
        centre = (_HALF * (2 * number + 1) + _GAP * number, tall + _HEAD)
        parts.append(
            f'<text x="{centre[0] - _HALF + 8:g}" y="14">{escape(heading)}</text>'
            '<path class="mesh observed" '
            f'd="{_wires(stretch.observed[0], stretch, scale, centre)}"/>'
            f'<path class="mesh {kind}" d="{_wires(enlarged, stretch, scale, centre)}"/>'
        )
    width = 2 * _HALF * len(panels) + _GAP * (len(panels) - 1)
    return Markup(
        f'<svg role="img" viewBox="0 0 {width:g} {2 * tall + _HEAD + 4:g}" aria-label="'
        f'Observed cloth and predictions, a frame of {escape(stretch.recording)}">'
        f"{''.join(parts)}</svg>"
    )


def _wires(
    points: FloatArray, stretch: MotionClip, scale: float, centre: tuple[float, float]
) -> str:
    """Writes path data of the edges between markers (marker, xyz), as seen from `stretch.azimuth`
    and `ELEVATION`."""
    x, y, z = points.T
    right = x * math.cos(stretch.azimuth) + y * math.sin(stretch.azimuth)
    away = -x * math.sin(stretch.azimuth) + y * math.cos(stretch.azimuth)
    up = z * math.cos(ELEVATION) + away * math.sin(ELEVATION)
    across, down = centre[0] + scale * right, centre[1] - scale * up
    finite = np.isfinite(across) & np.isfinite(down)
    return "".join(
        f"M{across[a]:.1f} {down[a]:.1f}L{across[b]:.1f} {down[b]:.1f}"
        for a, b in stretch.edges.tolist()
        if finite[a] and finite[b]
    )


def _azimuth(observed: FloatArray) -> float:
    """Computes the direction [rad] of the cloth's longest horizontal extent, turned by a sixth of a
    right angle."""
    flat = observed[..., :2].reshape(-1, 2)
    flat = flat[np.isfinite(flat).all(axis=1)]
    x, y = (
        np.linalg.svd(flat - flat.mean(axis=0), full_matrices=False)[2][0]
        if len(flat) > 1
        else (1.0, 0.0)
    )
    return (math.atan2(y, x) + math.pi / 12 + math.pi / 2) % math.pi - math.pi / 2


def _edges(uv: FloatArray) -> IntArray:
    """Lists edges (edge, 2): the sides of the triangles over the markers, or neighbours along a
    line."""
    if on_a_line(uv):
        order = np.argsort(np.linalg.norm(uv - uv[:1], axis=1))
        return np.stack([order[:-1], order[1:]], axis=1).astype(np.int64)
    sides = triangles(uv)[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    return np.unique(np.sort(sides, axis=1), axis=0)


def _enlargement(observed: FloatArray, predicted: FloatArray) -> int:
    """Chooses the largest factor that keeps nearly all errors within a part of the cloth's size."""
    errors = np.linalg.norm(predicted - observed, axis=-1)
    errors = errors[np.isfinite(errors)]
    typical = float(np.quantile(errors, 0.99)) if errors.size else 0.0
    if typical <= 0:
        return 1
    room = _VISIBLE * 2 * _finite_reach(observed) / typical
    return max((f for f in FACTORS if f <= room), default=1)


def _array(frames: Sequence[Sequence[Sequence[float]]]) -> FloatArray:
    return np.asarray(frames, dtype=np.float64).reshape(
        len(frames), len(frames[0]) if frames else 0, 3
    )


def _spread(count: int, most: int) -> IntArray:
    return np.unique(np.linspace(0, count - 1, min(count, most)).round().astype(np.int64))


def _centre(values: FloatArray) -> float:
    finite = values[np.isfinite(values)]
    return float(finite.mean()) if finite.size else 0.0


def _finite_reach(values: FloatArray) -> float:
    finite = np.abs(values[np.isfinite(values)])
    return float(finite.max()) if finite.size and finite.max() > 0 else 1.0


def _rate(times: Sequence[float]) -> float:
    """Frames a second, from the median step."""
    steps = np.diff(np.asarray(times, dtype=np.float64))
    steps = steps[np.isfinite(steps) & (steps > 0)]
    return float(1 / np.median(steps)) if steps.size else math.nan


def _pack_values(values: FloatArray, reach: float) -> str:
    scaled = np.where(np.isfinite(values), values / reach * _REACH, MISSING)
    return base64.b64encode(scaled.round().astype("<i2").tobytes()).decode("ascii")
