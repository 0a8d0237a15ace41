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
    "no-motion": Reason(
        sentence="nothing in the picture moves like a flag",
        fix="crop to the flag, or choose a part of the film in which it flies",
    ),
    "cut-off": Reason(
        sentence="the picture's edge cuts through the moving cloth",
        of_motion=True,
        fix="crop or film so that the whole flag is in the frame",
    ),
    "moving-camera": Reason(
        sentence="the camera moves: the background shifts", fix="film from a tripod, or stabilise the film first"
    ),
    "repeated-frames": Reason(
        sentence="frames are repeated: the clip loops or stops for a part of it",
        fix="give a film whose frames are all different",
    ),
    "too-few-frames": Reason(sentence="there are too few frames", fix="give a longer film"),
    "low-frame-rate": Reason(
        sentence="frames look duplicated: the real frame rate is below the model's",
        fix="film at the model's rate or more",
    ),
    "too-dark": Reason(
        sentence="the picture is darker, flatter or noisier than the training clips",
        fix="film by daylight, or expose longer",
    ),
    "several-flags": Reason(sentence="more than one region moves", fix="crop to one flag", of_motion=True),
    "scale": Reason(
        sentence="the flag is larger or smaller in the picture than in the training clips",
        fix="crop so that the flag takes a half to most of the frame",
        of_motion=True,
    ),
    "unlike-cloth": Reason(
        sentence="the motion is unlike that of simulated cloth",
        fix="make sure that the crop shows a flag on a pole and little else that moves",
        of_motion=True,
    ),
}
