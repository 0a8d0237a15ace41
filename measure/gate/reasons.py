"""Why a clip is refused: the kinds, each with its sentence and what to do about it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Reason:
    """Attributes:
    sentence: for the message, without a final stop.
    fix: what the user can do.
    of_motion: whether it concerns the moving region, and so needs one.
    """

    sentence: str
    fix: str
    of_motion: bool = False


REASONS: dict[str, Reason] = {
    "scene-cut": Reason(
        sentence="the picture cuts to another scene",
        fix="choose a part of the film between two cuts by --start and --end",
    ),
    "too-few-frames": Reason(sentence="there are too few frames", fix="give a longer film"),
    "low-frame-rate": Reason(sentence="there are too few frames a second", fix="film at 25 frames a second or more"),
    "repeated-frames": Reason(
        sentence="frames are repeated", fix="give a film whose frames are all different, or one taken in better light"
    ),
    "too-dark": Reason(
        sentence="the picture is too dark, too flat or too noisy", fix="film by daylight, or expose longer"
    ),
    "no-motion": Reason(
        sentence="nothing in the picture moves like a flag",
        fix="crop to the flag, or choose a part of the film in which it flies",
    ),
    "unlike-cloth": Reason(
        sentence="the motion is unlike that of simulated cloth",
        fix="make sure that the crop shows a flag on a pole and little else that moves",
        of_motion=True,
    ),
    "moving-camera": Reason(
        sentence="the camera moves, and the background does not show how",
        fix="film from a tripod, with something that stands still in the picture",
    ),
    "cut-off": Reason(
        sentence="the picture's edge cuts through the moving cloth",
        of_motion=True,
        fix="film so that the whole flag is in the picture, or choose another by --flag",
    ),
    "scale": Reason(
        sentence="the flag is too small or too large in the picture",
        fix="film from nearer, so that the flag spans 100 pixels or more",
        of_motion=True,
    ),
    "several-flags": Reason(
        sentence="more than one region moves", fix="choose one by --flag, or crop to it", of_motion=True
    ),
}
"""By kind, in the order in which they are stated: what is wrong with the recording before what follows from it."""
