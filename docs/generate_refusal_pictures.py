"""Pictures of the faults on the page of refusals, each of a film that is refused for that very
reason.

`python -m docs.generate_refusal_pictures` spoils two seconds of the film that comes with the
package, as a careless recording would, writes docs/pictures/refusals/REASON.webp, and below each on
the page what the program says of it.
"""

from __future__ import annotations

import base64
import io
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from itertools import islice
from pathlib import Path
from typing import Any

import av
import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

import flagdata
from flagdata.core.findings import Severity
from flagdata.core.rng import stream
from flagdata.errors import RefusedError
from flagdata.ingest.films.film_array import Frames
from measure.estimate.measurement_pictures import steps
from measure.film.conditioned_film import ConditionedFilm
from measure.film.similarity import FlagSize, sizes
from tests.drawn import no_flag

Film = NDArray[np.uint8]
"""(n, HEIGHT, WIDTH, 3), or of another height and width."""
PAGE = Path(__file__).with_name("refusals.md")
FOLDER = PAGE.with_name("pictures") / "refusals"
MOST_BYTES = 250_000
"""What all pictures may weigh."""
WIDTH, HEIGHT, COUNT, RATE = 240, 180, 50, 25.0
_SKY = np.array([176, 184, 190], np.uint8)
_CLOTH = (slice(30, 120), slice(84, 180))
"""Rows and columns that the cloth visits."""
_POLE = np.array([(179, 36), (186, 36), (193, HEIGHT), (185, HEIGHT)], np.int32)
"""Corners of the pole [px]."""
_ASIDE = 50
"""Distance of the poles of two flags that overlap [px]."""
_LOOP = 13
"""Frames."""
_WIDE, _GAP = 304, 4
"""Width of a picture of two frames, and what is between them [px]."""


@cache
def plain() -> Film:
    """The film's first two seconds."""
    with av.open(str(flagdata.example().film)) as film:
        frames = [frame.to_ndarray(format="rgb24") for frame in islice(film.decode(video=0), COUNT)]
    return _resized(np.stack(frames).astype(np.uint8), WIDTH, HEIGHT)


def _noisy(film: NDArray[Any], sigma: float = 1.0) -> Film:
    """With a camera's noise [gray levels]."""
    noise = stream(1, "refusals").normal(0, sigma, film.shape)
    return np.clip(np.rint(film + noise), 0, 255).astype(np.uint8)


def _resized(film: Film, width: int, height: int) -> Film:
    """Averaged to another size."""
    shown = np.empty((len(film), height, width, 3), np.uint8)
    for to, one in zip(shown, film, strict=True):
        cv2.resize(one, (width, height), dst=to, interpolation=cv2.INTER_AREA)
    return shown


def _cloth(film: Film) -> NDArray[np.bool_]:
    """(n, HEIGHT, WIDTH) where the cloth is: it is red, violet or black, and what is behind it is
    none of these."""
    red, green, blue = (film[:, *_CLOTH, k].astype(int) for k in range(3))
    own = (
        (red - green > 8)
        | (film[:, *_CLOTH].max(axis=-1) < 70)
        | ((blue - green > 12) & (red > green))
    )
    found = np.zeros(film.shape[:3], bool)
    for place, one in zip(found, own, strict=True):
        clean = cv2.morphologyEx(one.astype(np.uint8), cv2.MORPH_OPEN, np.ones((2, 2)))
        place[_CLOTH] = cv2.morphologyEx(clean, cv2.MORPH_CLOSE, np.ones((5, 5))) > 0
    return found


def scene_cut(film: Film) -> Film:
    """The second half is of another place."""
    return np.concatenate([film[: COUNT // 2], film[COUNT // 2 :, :, ::-1] // 2 + 100])


def low_rate(film: Film) -> Film:
    """Every third frame."""
    return film[::3]


def repeated(film: Film) -> Film:
    """Half a second, again and again."""
    return film[np.arange(COUNT) % _LOOP]


def dark(film: Film) -> Film:
    """Under-exposed by a factor of 12."""
    return _noisy(film / 12)


def still(film: Film) -> Film:
    """One frame, with a camera's noise."""
    return _noisy(np.repeat(film[:1], COUNT, axis=0))


def tree(film: Film) -> Film:
    """A tree whose leaves move, where the flag was."""
    rng = stream(1, "refusals", "leaves")
    shown = np.repeat(film[:1], COUNT, axis=0)
    shown[:, 118:165, 124:134] = (70, 50, 35)
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    spots = [
        (130, 72, 52),
        (96, 92, 34),
        (160, 92, 36),
        (130, 50, 40),
        (104, 54, 32),
        (160, 54, 34),
    ]
    crown = np.any([np.hypot(columns - x, rows - y) < r for x, y, r in spots], axis=0)
    for frame in shown:
        light = rng.random((HEIGHT, WIDTH)) > 0.5
        leaves = np.where(light[..., None], (125, 165, 80), (60, 110, 45))
        frame[crown] = leaves[crown]
    return _noisy(shown)


def palm(film: Film) -> Film:
    """A palm in a storm, before a house."""
    shown = np.repeat(film[:1], COUNT, axis=0)
    shown[:, :, 70:] = _SKY
    shown[:, 50:, 150:] = (196, 178, 150)
    drawn = no_flag.palms(np.zeros(shown.shape[:3], np.uint8), stream(1, "refusals", "palm"))
    green = np.stack([drawn // 2, drawn, drawn // 3], axis=-1)
    return _noisy(np.where(drawn[..., None] > 0, green, shown))


def water(film: Film) -> Film:
    """A stream: waves that run across each other."""
    rng = stream(1, "refusals", "water")
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    bed = rows > 96 - 0.15 * columns + 4 * np.sin(columns / 9)
    waves = [rng.uniform((0.05, -0.3, 3, 0), (0.25, 0.3, 9, 6)) for _ in range(8)]
    shown = np.repeat(film[:1], COUNT, axis=0)
    for k, frame in enumerate(shown):
        height = sum(
            np.sin(a * columns + b * rows - w * k / RATE + phase) for a, b, w, phase in waves
        )
        frame[bed] = np.clip(
            np.array([70, 105, 125]) + 13 * np.asarray(height)[bed][:, None], 0, 255
        )
    return _noisy(shown)


def hung(film: Film) -> Film:
    """The picture turned, so that the pole lies above the cloth."""
    return np.ascontiguousarray(np.rot90(film, axes=(1, 2))[:, 20:176])


def upside_down(film: Film) -> Film:
    """The flag before the sky, drooping and swinging as in less wind, turned by half a turn."""
    behind = film[0].copy()
    behind[: _CLOTH[0].stop + 20] = _SKY
    cv2.fillConvexPoly(behind, _POLE, (120, 120, 125))
    shown = []
    for k, (one, own) in enumerate(zip(film, _cloth(film), strict=True)):
        slope = 0.25 + 0.1 * np.sin(5 * k / RATE)
        shear = np.array([[1.0, 0, 0], [-slope, 1, slope * _POLE[0, 0]]])
        moved, at = (
            cv2.warpAffine(part, shear, (WIDTH, HEIGHT)) for part in (one, own.astype(np.uint8))
        )
        shown.append(np.where(at[..., None] > 0, moved, behind))
    return _noisy(np.stack(shown)[:, ::-1, ::-1])


def on_its_side(film: Film) -> Film:
    """The picture turned, so that the pole lies below the cloth."""
    return np.ascontiguousarray(np.rot90(film, -1, axes=(1, 2))[:, 64:220])


def overlapping(film: Film) -> Film:
    """A second flag, half a second late, whose pole is before the first one's cloth."""
    pole = np.zeros((HEIGHT, WIDTH), np.uint8)
    cv2.fillConvexPoly(pole, _POLE, 1)
    other = np.roll(film, _LOOP, axis=0)
    own, other = (np.roll(one, -_ASIDE, axis=2) for one in (_cloth(other) | (pole > 0), other))
    return np.where(own[..., None], other, film)


def without_background(film: Film) -> Film:
    """A long flag and little else."""
    return _noisy(_resized(film, 2 * WIDTH, HEIGHT)[:, 10:134, 136:392])


def stretched(film: Film) -> Film:
    """A flag twice as long."""
    return _noisy(_resized(film, 2 * WIDTH, HEIGHT)[:, :, 100:420])


def moving_camera(film: Film) -> Film:
    """Cloth before an even sky, filmed by hand."""
    time = np.arange(COUNT) / RATE
    across, down = 18 * np.sin(2.6 * time), 12 * np.cos(2 * time)
    even = np.where(_cloth(film)[..., None], film, _SKY)
    moved = [
        cv2.warpAffine(
            one,
            np.array([[1.0, 0, x], [0, 1, y]]),
            (WIDTH, HEIGHT),
            borderMode=cv2.BORDER_REPLICATE,
        )
        for one, x, y in zip(even, across, down, strict=True)
    ]
    return _noisy(np.stack(moved))


def cut_off(film: Film) -> Film:
    """The picture begins in the middle of the cloth."""
    return np.ascontiguousarray(film[:, 20:140, WIDTH - 100 :])


def small(film: Film) -> Film:
    """A flag of 35 px."""
    return _noisy(_resized(film, 72, 54), 0.5)


def two_flags(film: Film) -> Film:
    """The flag twice beside itself, half a second late."""
    part = film[:, :, 40:204]
    return np.concatenate([part, np.roll(part, _LOOP, axis=0)], axis=2)


@dataclass(frozen=True, kw_only=True)
class Fault:
    """Attributes:
    made: of the film without the fault.
    shown: the frames that the picture has.
    rate: of the film [Hz].
    aspect: length over height of the flag as it is given; None where it is not.
    """

    made: Callable[[Film], Film]
    shown: tuple[int, ...] = (COUNT // 2,)
    rate: float = RATE
    aspect: float | None = None


FAULTS: Mapping[str, Fault] = {
    "scene-cut": Fault(made=scene_cut, shown=(COUNT // 2 - 1, COUNT // 2)),
    "low-frame-rate": Fault(made=low_rate, shown=(8, 9), rate=RATE / 3),
    "repeated-frames": Fault(made=repeated, shown=(8, 8 + _LOOP)),
    "too-dark": Fault(made=dark),
    "no-motion": Fault(made=still, shown=(0, COUNT - 1)),
    "unlike-cloth": Fault(made=tree),
    "upside-down": Fault(made=upside_down),
    "on-its-side": Fault(made=on_its_side),
    "second-pole": Fault(made=overlapping),
    "no-pole": Fault(made=water),
    "hangs-from-above": Fault(made=hung),
    "no-hoist": Fault(made=palm),
    "moving-camera": Fault(made=moving_camera, shown=(10, 35)),
    "cut-off": Fault(made=cut_off),
    "no-background": Fault(made=without_background),
    "another-shape": Fault(made=stretched, aspect=1.5),
    "scale": Fault(made=small),
    "several-flags": Fault(made=two_flags),
}
"""Reason → a film that has it. A film that is too short shows nothing."""


def images(reason: str) -> Film:
    """The film with that fault."""
    return FAULTS[reason].made(plain())


def looked_at(reason: str) -> ConditionedFilm:
    """The same, read to its end as `flagdata measure` reads it."""
    shown = images(reason)
    fault = FAULTS[reason]
    film = ConditionedFilm(
        Frames(images=shown, time=np.arange(len(shown)) / fault.rate), aspect=fault.aspect
    )
    for _ in film.frames(0.0, film.duration):
        pass
    return film


def found(film: ConditionedFilm) -> tuple[str, str]:
    """The kind of what the program says of it first, and its sentence; of several flags its
    warning.

    Raises:
        LookupError: it finds nothing wrong.
    """
    size, rng = FlagSize(length=1.5, height=1.0), np.random.default_rng()
    try:
        sizes(size, rate=film.rate, frames_rate=RATE, draws=1, generator=rng)
    except RefusedError as error:
        return "low-frame-rate", error.what
    for one in film.findings():
        if one.severity is Severity.ERROR or one.kind == "several-flags-found":
            return one.kind, one.what
    raise LookupError("the film has no fault")


def picture(reason: str, film: ConditionedFilm) -> Image.Image:
    """One frame, or two beside each other with their instants; of several flags the picture of the
    program's page."""
    if reason == "several-flags":
        url = steps(film)
        if url is None:
            raise LookupError("the film was not read")
        page = Image.open(io.BytesIO(base64.b64decode(url.partition(",")[2])))
        return page.resize((_WIDE, _WIDE * page.height // page.width))
    fault, shown = FAULTS[reason], images(reason)
    frames = [(f"{k / fault.rate:.2f} s", shown[k]) for k in fault.shown]
    wide = WIDTH if len(frames) == 1 else (_WIDE - _GAP) // 2
    high = wide * shown.shape[1] // shown.shape[2]
    whole = Image.new("RGB", ((wide + _GAP) * len(frames) - _GAP, high), "white")
    how = Image.Resampling.NEAREST if shown.shape[2] < WIDTH // 2 else Image.Resampling.LANCZOS
    for place, (label, frame) in enumerate(frames):
        left = place * (wide + _GAP)
        whole.paste(Image.fromarray(frame).resize((wide, high), how), (left, 0))
        if len(frames) > 1:
            ImageDraw.Draw(whole).text(
                (left + 4, 3), label, fill="white", stroke_width=2, stroke_fill="black"
            )
    return whole


def caption(reason: str) -> re.Pattern[str]:
    """Where the page has it: the picture, and the sentence below."""
    return re.compile(rf"(\(pictures/refusals/{reason}\.webp\)  \n)\*(.*)\*")


def main() -> None:
    """Write the pictures and their captions."""
    FOLDER.mkdir(exist_ok=True)
    page = PAGE.read_text(encoding="utf-8")
    for reason in FAULTS:
        film = looked_at(reason)
        picture(reason, film).save(FOLDER / f"{reason}.webp", quality=80, method=6)
        _, sentence = found(film)
        page = caption(reason).sub(lambda line, own=sentence: f"{line[1]}*{own}*", page)
    PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
