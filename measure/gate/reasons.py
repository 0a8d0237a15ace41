"""Why a clip is refused: the kinds, each with its sentence and what to do about it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Fault:
    """Attributes:
    sentence: what was found and what it may mean, without a final stop; the figure follows it.
    fix: what the user can do.
    of_motion: whether it concerns the moving region, and so needs one.
    of_flags: whether it is a fault of flags only, and none of cloth that hangs.
    """

    sentence: str
    fix: str
    of_motion: bool = False
    of_flags: bool = False


REASONS: dict[str, Fault] = {
    "scene-cut": Fault(
        sentence="the picture changes at once, as where two scenes are joined",
        fix="choose a part of the film between two such places, three frames from each, by --start "
        "and --end",
    ),
    "too-few-frames": Fault(sentence="there are too few frames", fix="give a longer film"),
    "low-frame-rate": Fault(
        sentence="there are too few frames a second", fix="film at 25 frames a second or more"
    ),
    "repeated-frames": Fault(
        sentence="many frames look alike, as in a film that loops, stands still or was made with "
        "fewer frames a second",
        fix="give a film whose frames are all different, as the camera wrote it",
    ),
    "too-dark": Fault(
        sentence="the picture may be too dark, too even or too noisy to show cloth",
        fix="film by daylight, or expose longer",
    ),
    "no-motion": Fault(
        sentence="no motion like a flag's was found",
        fix="crop to the flag, or choose a part of the film in which it flies",
    ),
    "unlike-cloth": Fault(
        sentence="what changes is finer than cloth's folds, and may be another thing, as leaves or "
        "water",
        fix="make sure that the crop shows a flag on a pole and little else that moves",
        of_motion=True,
    ),
    "upside-down": Fault(
        sentence="the film may be upside down: the free end of what moves is higher than its "
        "hoist, and the edge that "
        "stands still there ends at what moves instead of going on below it",
        fix="turn the film: ffmpeg -i FILM -vf hflip,vflip TURNED; or correct the rotation that "
        "its file states",
        of_motion=True,
        of_flags=True,
    ),
    "on-its-side": Fault(
        sentence="the film may lie on its side, as a level edge stands still along the bottom of "
        "what moves",
        fix="if so, turn the film: ffmpeg -i FILM -vf transpose=1 TURNED, with transpose=2 where "
        "it then is upside "
        "down; or correct the rotation that its file states",
        of_motion=True,
        of_flags=True,
    ),
    "second-pole": Fault(
        sentence="two flags may overlap in the picture, as a second upright edge stands still "
        "inside what moves and "
        "goes on below it",
        fix="film from where no other flag or post is before or behind the flag",
        of_motion=True,
        of_flags=True,
    ),
    "no-pole": Fault(
        sentence="what moves may be no flag on a pole, as no upright edge stands still beside it",
        fix="make sure that a flag on its pole is in the picture, and crop to both",
        of_motion=True,
        of_flags=True,
    ),
    "hangs-from-above": Fault(
        sentence="what moves may hang from a bar or a line, or the film may lie on its side: a "
        "level edge stands still "
        "along its top",
        fix="film a flag whose one side is at a pole; turn a film that lies on its side: ffmpeg -i "
        "FILM -vf "
        "transpose=1 TURNED, with transpose=2 where it then is upside down",
        of_motion=True,
        of_flags=True,
    ),
    "moving-camera": Fault(
        sentence="the camera may move: its motion could not be followed",
        fix="film from a tripod, with something that stands still in the picture",
    ),
    "cut-off": Fault(
        sentence="motion reaches the picture's edge, so that a part of what moves may lie outside",
        of_motion=True,
        fix="film so that the whole flag is in the picture, or choose another by --flag",
    ),
    "no-background": Fault(
        sentence="the picture may show too little but what moves",
        of_motion=True,
        fix="film from farther away, so that the whole flag and its surroundings are in the "
        "picture",
    ),
    "another-shape": Fault(
        sentence="what moves is longer than the flag that was given, and may be another thing",
        of_motion=True,
        fix="check --flag-size: length along the wind times height along the pole",
    ),
    "scale": Fault(
        sentence="what moves fills less or more of the picture than the flags of the training",
        fix="film from nearer, so that the flag spans 100 pixels or more",
        of_motion=True,
    ),
    "few-windows": Fault(
        sentence="an answer would rest on a small part of the film",
        fix="give the part in which the whole flag flies and no frame is missing, by --start and "
        "--end",
    ),
    "no-hoist": Fault(
        sentence="what moves may be no flag on a pole, as no hoist was found, the upright edge "
        "that it is attached to",
        fix="film a flag and its pole from the side, so that the whole hoist is in the picture",
        of_motion=True,
        of_flags=True,
    ),
    "several-flags": Fault(
        sentence="more than one region moves",
        fix="choose one by --flag, or crop to it",
        of_motion=True,
    ),
}
"""By kind, in the order in which they are stated: what is wrong with the recording before what
follows from it."""
