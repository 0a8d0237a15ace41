"""Why a clip is refused: the kinds, each with its sentence and what to do about it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, kw_only=True)
class Fault:
    """Attributes:
    brief: what was found, in a few words.
    sign: what follows it in a sentence: by what it was seen, or what it may come from.
    fix: what the user can do.
    of_motion: whether it concerns the moving region, and so needs one.
    of_flags: whether it is a fault of flags only, and none of cloth that hangs.
    """

    brief: str
    sign: str = ""
    fix: str
    of_motion: bool = False
    of_flags: bool = False

    @property
    def sentence(self) -> str:
        """What was found and what it may mean, without a final stop; the figure follows it."""
        return self.brief + self.sign


REASONS: dict[str, Fault] = {
    "scene-cut": Fault(
        brief="the picture changes at once",
        sign=", as where two scenes are joined",
        fix="choose a part of the film between two such places, three frames from each, by --start "
        "and --end",
    ),
    "too-few-frames": Fault(brief="there are too few frames", fix="give a longer film"),
    "low-frame-rate": Fault(
        brief="there are too few frames a second", fix="film at 25 frames a second or more"
    ),
    "repeated-frames": Fault(
        brief="many frames look alike",
        sign=", as in a film that loops, stands still or was made with fewer frames a second",
        fix="give a film whose frames are all different, as the camera wrote it",
    ),
    "too-dark": Fault(
        brief="the picture may be too dark, too even or too noisy to show cloth",
        fix="film by daylight, or expose longer",
    ),
    "no-motion": Fault(
        brief="no motion like a flag's was found",
        fix="crop to the flag, or choose a part of the film in which it flies",
    ),
    "unlike-cloth": Fault(
        brief="what changes is finer than cloth's folds, and may be another thing",
        sign=", as leaves or water",
        fix="make sure that the crop shows a flag on a pole and little else that moves",
        of_motion=True,
    ),
    "upside-down": Fault(
        brief="the film may be upside down",
        sign=": the free end of what moves is higher than its hoist, and the edge that "
        "stands still there ends at what moves instead of going on below it",
        fix="turn the film: ffmpeg -i FILM -vf hflip,vflip TURNED; or correct the rotation that "
        "its file states",
        of_motion=True,
        of_flags=True,
    ),
    "on-its-side": Fault(
        brief="the film may lie on its side",
        sign=", as a level edge stands still along the bottom of what moves",
        fix="if so, turn the film: ffmpeg -i FILM -vf transpose=1 TURNED, with transpose=2 where "
        "it then is upside "
        "down; or correct the rotation that its file states",
        of_motion=True,
        of_flags=True,
    ),
    "second-pole": Fault(
        brief="two flags may overlap in the picture",
        sign=", as a second upright edge stands still inside what moves and goes on below it",
        fix="film from where no other flag or post is before or behind the flag",
        of_motion=True,
        of_flags=True,
    ),
    "no-pole": Fault(
        brief="what moves may be no flag on a pole",
        sign=", as no upright edge stands still beside it",
        fix="make sure that a flag on its pole is in the picture, and crop to both",
        of_motion=True,
        of_flags=True,
    ),
    "hangs-from-above": Fault(
        brief="what moves may hang from a bar or a line, or the film may lie on its side",
        sign=": a level edge stands still along its top",
        fix="film a flag whose one side is at a pole; turn a film that lies on its side: ffmpeg -i "
        "FILM -vf "
        "transpose=1 TURNED, with transpose=2 where it then is upside down",
        of_motion=True,
        of_flags=True,
    ),
    "moving-camera": Fault(
        brief="the camera may move",
        sign=": its motion could not be followed",
        fix="film from a tripod, with something that stands still in the picture",
    ),
    "cut-off": Fault(
        brief="motion reaches the picture's edge, so that a part of what moves may lie outside",
        of_motion=True,
        fix="film so that the whole flag is in the picture, or choose another by --flag",
    ),
    "no-background": Fault(
        brief="the picture may show too little but what moves",
        of_motion=True,
        fix="film from farther away, so that the whole flag and its surroundings are in the "
        "picture",
    ),
    "another-shape": Fault(
        brief="what moves is longer than the flag that was given, and may be another thing",
        of_motion=True,
        fix="check --flag-size: length along the wind times height along the pole",
    ),
    "scale": Fault(
        brief="what moves fills less or more of the picture than the flags of the training",
        fix="film from nearer, so that the flag spans 100 pixels or more",
        of_motion=True,
    ),
    "few-windows": Fault(
        brief="an answer would rest on a small part of the film",
        fix="give the part in which the whole flag flies and no frame is missing, by --start and "
        "--end",
    ),
    "no-hoist": Fault(
        brief="what moves may be no flag on a pole",
        sign=", as no hoist was found, the upright edge that it is attached to",
        fix="film a flag and its pole from the side, so that the whole hoist is in the picture",
        of_motion=True,
        of_flags=True,
    ),
    "several-flags": Fault(
        brief="more than one region moves",
        fix="choose one by --flag, or crop to it",
        of_motion=True,
    ),
}
"""By kind, in the order in which they are stated: what is wrong with the recording before what
follows from it."""

UNCALIBRATED = {
    "another-picture": "the picture is of another shape than that of the calibration",
    "another-place": "the film may be from another place than the calibration",
    "another-framing": "the flag's hoist is not where it was in the picture",
    "another-size": "the flag is of another size than that of the calibration",
    "another-wind": "hardly any window reads a wind in which the flag was calibrated",
    "another-flag": "it may be another flag than that of the calibration",
}
"""Kind → why a reading model refuses a film that is not like those of its calibration, in a few
words."""
