"""Why a film cannot be measured, by what was counted while it was made fit: each reason with a figure to be checked.

The reasons are in the order of `REASONS`: a fault of the recording comes before the faults that it brings about.
"""

from __future__ import annotations

from collections.abc import Iterator

from flagdata.findings import Finding, Severity
from measure.gate.reasons import REASONS
from measure.gate.watch import FilmWatch
from models.conditioning import Conditioning, Follower

COUNTED = frozenset({"scene-cut", "low-frame-rate", "repeated-frames", "too-dark", "moving-camera", "cut-off", "scale"})
"""Kinds of faults that are counted here, and while the frames are read: no statistic of a window need look for them."""
_REPEATED = 0.5
"""Share of frames that look like an earlier one, above which a film loops or stands still."""
_DARK, _FLAT = 35.0, 4.0
"""Gray levels: of the brightest hundredth of the picture, and of the contrast, below which it is too dark."""
_NOISY = 0.35
"""Noise of a pixel over the picture's contrast, above which cloth is lost in it."""
_LOST = 0.1
"""Share of frames in which the background is not found, above which the camera's motion is unknown."""
_RESTING = 100
"""Pixels of the small copies with an edge at rest, below which nothing in the picture stands still."""
_AT_EDGE = 0.08
"""Share of the film in which one edge of the picture cuts the cloth off, above which it cannot be measured."""
_GRAIN = 0.38
"""See `FilmWatch.grain`: of nine films of whole flags the least was 0.51, of a tree 0.28."""
_SMALL = 40.0
"""Pixels of the film that the cloth's places span at least."""


def reasons(watch: FilmWatch, conditioning: Conditioning, follower: Follower) -> tuple[Finding, ...]:
    """Returns all reasons.

    Args:
        watch: that looked at all frames.
        conditioning: camera and flag.
        follower: that followed the camera through all frames.
    """
    of = {finding.kind: finding for finding in _all(watch, conditioning, follower)}
    return tuple(of[kind] for kind in REASONS if kind in of)


def _all(watch: FilmWatch, conditioning: Conditioning, follower: Follower) -> Iterator[Finding]:
    height, width = watch.shape
    region = conditioning.region
    box = None if region is None else tuple(edge / conditioning.scale for edge in region.box)
    cuts = watch.cuts()
    if cuts:
        times = "once" if len(cuts) == 1 else f"{len(cuts)} times"
        yield _reason("scene-cut", len(cuts), f"{times}, first at {cuts[0]:.2f} s")
    if watch.brightness < _DARK or watch.contrast < _FLAT:
        figure = f"its brightest hundredth has gray level {watch.brightness:.0f} of 255, its contrast is "
        yield _reason("too-dark", watch.brightness, f"{figure}{watch.contrast:.1f}")
    elif watch.noise > _NOISY * watch.contrast:
        figure = f"noise of {watch.noise:.1f} gray levels at a contrast of {watch.contrast:.1f}"
        yield _reason("too-dark", watch.noise / watch.contrast, figure)
    if region is None or box is None:
        spot = watch.spot()
        if 0 < spot < _SMALL:
            yield _reason("scale", spot, f"what moves spans {spot:.0f} px, {_SMALL:.0f} are needed")
        else:
            yield _reason("no-motion", 0.0, "no region of the picture changes as cloth does")
        return
    shares = (box[0] / width, box[1] / height, min(box[2] / width, 1.0), min(box[3] / height, 1.0))
    twins = watch.twins(shares)
    if twins > _REPEATED:
        yield _reason("repeated-frames", twins, f"{twins:.0%} of the frames look like another one")
    total = max(len(follower.path), 1)
    if follower.lost > _LOST * total:
        figure = f"in {follower.lost} of {total} frames the background was not found"
        yield _reason("moving-camera", follower.lost / total, figure)
    if edges := {name: share for name, share in conditioning.cut_share.items() if share > _AT_EDGE}:
        figure = ", ".join(f"the {name} edge in {share:.0%} of the frames" for name, share in edges.items())
        yield _reason("cut-off", max(edges.values()), figure)
    elif (
        not len(conditioning.camera.corners) and watch.resting() < _RESTING
    ):  # cloth that is cut off hides what stands still
        yield _reason("moving-camera", float(watch.resting()), "no edge in the picture stays in its place")
    span = max(box[2] - box[0], box[3] - box[1])
    if span < _SMALL:
        yield _reason("scale", span, f"it spans {span:.0f} px, {_SMALL:.0f} are needed")
    elif (grain := watch.grain(region.mask)) < _GRAIN:
        figure = f"averaged over a fortieth of the picture, {grain:.0%} of it is left, of cloth {_GRAIN:.0%} or more"
        yield _reason("unlike-cloth", grain, figure)


def _reason(kind: str, value: float, figure: str) -> Finding:
    reason = REASONS[kind]
    return Finding(
        kind=kind, severity=Severity.ERROR, what=f"{reason.sentence}: {figure}", value=float(value), fix=reason.fix
    )
