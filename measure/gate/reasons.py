"""Why a clip is refused: the kinds, each with its sentence and what to do about it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Reason:
    """Attributes:
    sentence: what is said, without a final stop.
    fix: what the user can do.
    of_motion: whether it is about what moves, so that it is no reason where nothing does.
    """

    sentence: str
    fix: str
    of_motion: bool = False


REASONS: dict[str, Reason] = {
    "no-motion": Reason(
        sentence="nothing in the picture moves as a flag does",
        fix="crop to the flag, or choose a part of the film in which it flies",
    ),
    "cut-off": Reason(
        sentence="the picture's edge cuts through what moves",
        of_motion=True,
        fix="crop or film so that the whole flag is in the frame",
    ),
    "moving-camera": Reason(
        sentence="the camera moves: the background shifts", fix="film from a tripod, or stabilise the film first"
    ),
    "repeated-frames": Reason(
        sentence="frames are repeated: the clip loops or stands still for a part of it",
        fix="give a film whose frames are all different",
    ),
    "too-few-frames": Reason(sentence="there are too few frames", fix="give a longer film"),
    "low-frame-rate": Reason(
        sentence="frames are held: the true frame rate is lower than the model's",
        fix="film at the model's rate or more",
    ),
    "too-dark": Reason(
        sentence="the picture is darker, flatter or noisier than those known", fix="film by daylight, or expose longer"
    ),
    "several-flags": Reason(sentence="more than one region moves", fix="crop to one flag", of_motion=True),
    "scale": Reason(
        sentence="what moves is larger or smaller in the picture than the flags known",
        fix="crop so that the flag takes a half to most of the frame",
        of_motion=True,
    ),
    "unlike-cloth": Reason(
        sentence="what moves does not move as simulated cloth does",
        fix="make sure that the crop holds a flag on a pole and little else that moves",
        of_motion=True,
    ),
}
