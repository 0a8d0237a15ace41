"""Why a film cannot be measured, by what was counted while it was made fit: each reason with a
figure to be checked.

The reasons are in the order of `REASONS`: a fault of the recording comes before the faults that it
brings about.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

from flagdata.core.findings import Finding, Severity
from measure.gate.reasons import REASONS
from measure.gate.watch import FilmWatch
from models.conditioning import Conditioning, Follower
from models.conditioning.outline import CERTAIN, UPRIGHT, Hoist
from models.conditioning.standing import Box, Inside, Line
from models.conditioning.stills import HALVED

COUNTED = frozenset(
    {
        "scene-cut",
        "low-frame-rate",
        "repeated-frames",
        "too-dark",
        "moving-camera",
        "cut-off",
        "scale",
    }
)
"""Kinds of faults that are counted here, and while the frames are read: no statistic of a window
need look for them."""
_REPEATED = 0.5
"""Share of frames that look like an earlier one, above which a film loops or stands still. Lower
refuses flags that swing in a regular way."""
_DARK, _FLAT = 35.0, 4.0
"""Gray levels: of the brightest hundredth of the picture, and of the contrast, below which it is
too dark."""
_NOISY = 0.35
"""Noise of a pixel over the picture's contrast, above which cloth is lost in it. Higher lets films
through whose cloth cannot be separated from noise; lower refuses films in dim light."""
_LOST = 0.1
"""Share of frames in which the background is not found, above which the camera's motion is
unknown."""
_RESTING = 100
"""Pixels of the small copies with an edge at rest, below which nothing in the picture stands
still."""
_AT_EDGE = 0.08
"""Share of the film in which one edge of the picture cuts the cloth off, above which it cannot be
measured. Higher measures flags of which a part is missing."""
_GRAIN = 0.38
"""See `FilmWatch.grain`: of nine films of whole flags the least was 0.51, of a tree 0.28."""
_SMALL = 40.0
"""Pixels of the film that the cloth's places span at least."""
_POLE = 0.5
"""Height of an upright line of edges at rest beside the cloth's places, in heights of them, below
which there is no
pole: a hoist is as long as its flag is high, and a flag visits places of twice its height at most.
Of 49 films of flags the least was 0.67, of water 0.46, of wind turbines 0.27."""
_BAR, _OVER = 1.0, 1.5
"""Length of a level line along the cloth's top, in widths of its places, and the same over the
height of the pole, from both of which on it hangs from a bar; along its bottom, from which on the
film lies on its side. Of these films none had more than 1.0 and more than 0.71 together, a flag
that hangs from a line had 1.23 and 2.4."""
_SECOND, SUSPECTED = 0.5, 1 / 3
"""Height of what moves along which an upright line inside it is at rest, in heights of it: of one
that goes on below what moves, from which on it is a second pole, and of any, from which on it may
be one. Of 37 films of one flag the first was 0.26 at most; the second was 0.30 at most but for
upright stripes. Lower refuses flags that now and then sink before an upright edge of the
background."""
_HELD = 0.7
"""Share of the hoist that has cloth beside it, below which nothing is attached to it. Of 69 films
of flags the least was 0.82, of fire, birds and cars beside a post 0.41 to 0.57."""
_SHORT, _LONG = 0.35, 1.1
"""Heights of the hoist over that of what moves: the places of a flag are as high as its hoist at
least, and a limp one of 2:1 hangs down by its length too. Of these films it was 0.38 to 0.89, of
palms 0.31 and 0.33, of crowds 1.28 and 1.71."""
_UP = math.radians(2.0)
"""Angle by which the free end is higher than the hoist, from which on the cloth droops upwards."""
_REACHES, _ENDS = 0.15, 0.15
"""How far the pole of a film that is upside down reaches above what moves at least, and below it at
most, in heights of it."""
_PADDED = 1 / 3
"""Share of the square about the cloth that lies beyond the picture, above which too little but
cloth is shown. Of films of whole flags the most was 0.2."""
_STRETCHED = 1.3
"""Width over height of the cloth's places, in the stated length over height, above which it is no
flag of this shape: folds, slack and a slanting view all make a flag shorter."""


@dataclass(frozen=True, kw_only=True)
class _Film:
    """A film as it was counted; see `reasons`."""

    watch: FilmWatch
    conditioning: Conditioning
    follower: Follower
    aspect: float | None

    @cached_property
    def pole(self) -> float:
        """Returns the height of an upright edge at rest beside the cloth's places, in heights of
        them; see `_POLE`."""
        region, standing = self.conditioning.region, self.conditioning.standing
        return (
            0.0 if region is None else standing.beside(self.conditioning.framed_box(region)).length
        )

    @cached_property
    def inside(self) -> Inside:
        """Returns upright edges at rest inside what moves; see `_SECOND`."""
        region, standing = self.conditioning.region, self.conditioning.standing
        if region is None:
            return Inside(height=0.0, going_on=0.0)
        return standing.inside(self.conditioning.framed_box(region), self.conditioning.places)

    @property
    def box(self) -> tuple[float, float, float, float]:
        """Returns left, top, right and bottom of the cloth's places [px of the film]; zeros where
        none was found."""
        region = self.conditioning.region
        if region is None:
            return 0.0, 0.0, 0.0, 0.0
        left, top, right, bottom = (edge / self.conditioning.scale for edge in region.box)
        return left, top, right, bottom


Figure = tuple[float, str]
"""What was counted, and the words that state it."""
Rule = tuple[str, Callable[[_Film], Figure | None]]
"""The kind of a fault, and what shows it; None of a film without it."""


def _cuts(film: _Film) -> Figure | None:
    cuts = film.watch.cuts()
    if not cuts:
        return None
    times = "once" if len(cuts) == 1 else f"{len(cuts)} times"
    return len(cuts), f"{times}, first at {cuts[0]:.2f} s"


def _dark(film: _Film) -> Figure | None:
    brightness, contrast = film.watch.brightness, film.watch.contrast
    if not (brightness < _DARK or contrast < _FLAT):
        return None
    words = (
        f"its brightest hundredth has gray level {brightness:.0f} of 255, its contrast is "
        f"{contrast:.1f}"
    )
    return brightness, words


def _noisy(film: _Film) -> Figure | None:
    noise, contrast = film.watch.noise, film.watch.contrast
    if not noise > _NOISY * contrast:
        return None
    return noise / contrast, f"noise of {noise:.1f} gray levels at a contrast of {contrast:.1f}"


def _spot(film: _Film) -> Figure | None:
    spot = film.watch.spot()
    return (
        (spot, f"what moves spans {spot:.0f} px, {_SMALL:.0f} are needed")
        if 0 < spot < _SMALL
        else None
    )


def _still(film: _Film) -> Figure | None:
    return 0.0, "no region of the picture changes as cloth does"


def _twins(film: _Film) -> Figure | None:
    height, width = film.watch.shape
    left, top, right, bottom = film.box
    twins = film.watch.twins(
        (left / width, top / height, min(right / width, 1.0), min(bottom / height, 1.0))
    )
    return (
        (twins, f"{twins:.0%} of the frames look like another one") if twins > _REPEATED else None
    )


def _lost(film: _Film) -> Figure | None:
    lost, total = film.follower.lost, max(len(film.follower.path), 1)
    if not lost > _LOST * total:
        return None
    return lost / total, f"in {lost} of {total} frames the background was not found"


def _cut_off(film: _Film) -> Figure | None:
    edges = {name: share for name, share in film.conditioning.cut_share.items() if share > _AT_EDGE}
    if not edges:
        return None
    return max(edges.values()), ", ".join(
        f"the {name} edge in {share:.0%} of the frames" for name, share in edges.items()
    )


def _restless(film: _Film) -> Figure | None:
    if len(film.conditioning.camera.corners) or film.watch.resting() >= _RESTING:
        return None
    return float(film.watch.resting()), "no edge in the picture stays in its place"


def _small(film: _Film) -> Figure | None:
    left, top, right, bottom = film.box
    span = max(right - left, bottom - top)
    return (span, f"it spans {span:.0f} px, {_SMALL:.0f} are needed") if span < _SMALL else None


def _fine(film: _Film) -> Figure | None:
    region = film.conditioning.region
    grain = math.inf if region is None else film.watch.grain(region.mask)
    if not grain < _GRAIN:
        return None
    words = (
        f"averaged over a fortieth of the picture, {_below(grain)} of it is left, of cloth "
        f"{_GRAIN:.0%} or more"
    )
    return grain, words


def _no_pole(film: _Film) -> Figure | None:
    if (
        _restless(film) is not None or not film.pole < _POLE
    ):  # where nothing stands still, a pole is no exception
        return None
    return (
        film.pole,
        f"the longest is {_below(film.pole)} as high as what moves, of flags {_POLE:.0%} or more",
    )


def _level(film: _Film, longest: Callable[[Box], Line]) -> Figure | None:
    """Compares a level edge at rest with what moves and with the pole, by `_BAR` and `_OVER`."""
    region = film.conditioning.region
    if region is None:
        return None
    length = longest(film.conditioning.framed_box(region)).length
    if not length >= max(_BAR, _OVER * film.pole):
        return None
    upright = f"the longest upright one beside it {film.pole:.2f} times as high"
    return length, f"it is {length:.2f} times as long as what moves is wide, {upright}"


def _hung(film: _Film) -> Figure | None:
    return _level(film, film.conditioning.standing.above)


def _on_its_side(film: _Film) -> Figure | None:
    return _level(film, film.conditioning.standing.below)


def _upside_down(film: _Film) -> Figure | None:
    region = film.conditioning.region
    if region is None or region.hoist == "top" or not region.droop < -_UP:
        return None
    box = film.conditioning.framed_box(region)
    pole = film.conditioning.standing.beside(box, (region.hoist,))
    room = (film.conditioning.size - box[3]) / (box[3] - box[1])
    if not (
        pole.length >= _POLE and pole.above >= _REACHES and pole.below <= _ENDS and room >= _REACHES
    ):
        return None
    up = -math.degrees(region.droop)
    return (
        up,
        f"by {up:.1f}°, and the edge reaches {pole.above:.2f} of the height of what moves above it",
    )


def _second(film: _Film) -> Figure | None:
    found = film.inside
    if not found.going_on >= _SECOND:
        return None
    return (
        found.going_on,
        (
            f"it runs along {found.going_on:.0%} of its height, in one flag along less than "
            f"{_SECOND:.0%}"
        ),
    )


def _without_hoist(film: _Film) -> Figure | None:
    """States what is wrong in the whole film, where nothing is right in a part of it either."""
    region = film.conditioning.region
    if region is None:
        return None
    _, top, _, bottom = film.conditioning.framed_box(region)
    figures = (_no_flags_hoist(hoist, height=bottom - top) for hoist in film.conditioning.hoists())
    whole = next(figures, None)
    return None if whole is None or any(figure is None for figure in figures) else whole


def _no_flags_hoist(hoist: Hoist, *, height: float) -> Figure | None:
    """States what is wrong with a hoist for what moves through so much of the picture [px]."""
    if hoist.certainty < CERTAIN:
        limits = f"of flags {CERTAIN:.0%} or more"
        return (
            hoist.certainty,
            f"one of its ends is placed with a certainty of {_below(hoist.certainty)}, {limits}",
        )
    if hoist.lean > UPRIGHT:
        lean, most = math.degrees(hoist.lean), math.degrees(UPRIGHT)
        return lean, f"what is most like one leans by {lean:.0f}°, of flags by {most:.0f}° at most"
    if hoist.held < _HELD:
        return (
            hoist.held,
            (
                f"cloth is beside {_below(hoist.held)} of what is most like one, of flags "
                f"{_HELD:.0%} "
                "or more"
            ),
        )
    share = HALVED * hoist.length / height
    if not _SHORT <= share <= _LONG:
        limits = f"of flags {_SHORT:g} to {_LONG:g} times"
        return share, f"what is most like one is {share:.2f} times as high as what moves, {limits}"
    return None


def _padding_figure(film: _Film) -> Figure | None:
    height, width = film.watch.shape
    beyond = film.conditioning.square.beyond(width, height)
    if not beyond > _PADDED:
        return None
    return (
        beyond,
        (
            f"{beyond:.0%} of the square about it lie beyond the picture, {_PADDED:.0%} at most "
            "can be "
            "measured"
        ),
    )


def _stretching_figure(film: _Film) -> Figure | None:
    left, top, right, bottom = film.box
    if film.aspect is None or not right - left > _STRETCHED * film.aspect * (bottom - top):
        return None
    shape = (right - left) / (bottom - top)
    words = (
        f"it is {shape:.2f} times as wide as high, of the flag that was given {film.aspect:.2f} "
        "times at most"
    )
    return shape, words


def _below(share: float) -> str:
    """Writes a share in tenths of a percent, rounded down: below a limit it reads so."""
    return f"{math.floor(1000 * share) / 10:.1f}%"


_UNLIT: tuple[Rule, ...] = (("too-dark", _dark), ("too-dark", _noisy))
OF_PICTURES: tuple[tuple[Rule, ...], ...] = ((("scene-cut", _cuts),), _UNLIT)
"""Rules for every film. Of each row the first that finds its fault holds, since that hides or
brings about the next."""
_HIDING: tuple[Rule, ...] = (
    ("scene-cut", _cuts),
    *_UNLIT,
    ("moving-camera", _lost),
    ("scale", _small),
)
"""Each of these hides what stands still."""
WITHOUT_CLOTH: tuple[tuple[Rule, ...], ...] = ((("scale", _spot), ("no-motion", _still)),)
"""The same for films in which no cloth was found."""
OF_CLOTH: tuple[tuple[Rule, ...], ...] = (
    (("repeated-frames", _twins),),
    (
        ("cut-off", _cut_off),
        ("moving-camera", _restless),
    ),  # cloth that is cut off hides what stands still
    (
        *_HIDING,
        *(
            ("on-its-side", _on_its_side),
            ("no-pole", _no_pole),
            ("hangs-from-above", _hung),
            ("second-pole", _second),
        ),
        ("no-hoist", _without_hoist),
    ),
    (*_HIDING, ("upside-down", _upside_down)),
    (("no-background", _padding_figure),),
    (("another-shape", _stretching_figure),),
    (("scale", _small), ("unlike-cloth", _fine)),
)
"""The same for films of cloth."""


def reasons(
    watch: FilmWatch, conditioning: Conditioning, follower: Follower, *, aspect: float | None = None
) -> tuple[Finding, ...]:
    """Returns all reasons.

    Args:
        watch: that looked at all frames.
        conditioning: camera and flag.
        follower: that followed the camera through all frames.
        aspect: length over height of the flag as it was given; None where it was not.
    """
    film = _Film(watch=watch, conditioning=conditioning, follower=follower, aspect=aspect)
    of = {finding.kind: finding for finding in _faults(film)}
    return tuple(of[kind] for kind in REASONS if kind in of)


def _faults(film: _Film) -> Iterator[Finding]:
    for row in (*OF_PICTURES, *(WITHOUT_CLOTH if film.conditioning.region is None else OF_CLOTH)):
        for kind, look in row:
            if (figure := look(film)) is not None:
                value, words = figure
                what = f"{REASONS[kind].sentence}: {words}"
                yield Finding(
                    kind=kind,
                    severity=Severity.ERROR,
                    what=what,
                    value=float(value),
                    fix=REASONS[kind].fix,
                )
                break
