"""Faults of a film are counted: drawn films of which it is known what is wrong, and how much of
it."""

from __future__ import annotations

import re
from collections.abc import Callable

import cv2
import numpy as np
import pytest

from flagdata.core.arrays import FloatArray, UInt8Array
from flagdata.core.findings import Finding
from flagdata.core.rng import stream
from measure.gate import REASONS, FilmWatch
from measure.gate.counted import reasons
from models.conditioning import Follower, conditioning_of
from tests.drawn import no_flag

Film = Callable[[UInt8Array, np.random.Generator], UInt8Array]
RATE, COUNT, HEIGHT, WIDTH = 25.0, 60, 180, 240
FLAG = (70, 50, 90, 60)
"""x, y, width and height at rest [px]."""


def drawn(
    *,
    box: tuple[int, int, int, int] = FLAG,
    scenery: bool = True,
    shift: FloatArray | None = None,
    noise: float = 1.0,
    pole: bool = True,
    bar: bool = False,
    droop: float = 0.0,
) -> UInt8Array:
    """(COUNT, HEIGHT, WIDTH): striped cloth on a pole, whose waves grow towards its free end and
    never come again.

    Args:
        scenery: whether the background has features.
        pole, bar: whether there is a pole at the cloth's side, a bar along its top.
        droop: of the cloth, as a slope.
        shift: (COUNT, 2) of all that is shown, to the right and down [px].
    """
    rng = stream(5, "drawn")
    rough = rng.uniform(40, 220, (HEIGHT // 10 + 4, WIDTH // 10 + 4))
    pad = 20
    high, wide = HEIGHT + 2 * pad, WIDTH + 2 * pad
    behind = (
        cv2.resize(rough, (wide, high), interpolation=cv2.INTER_CUBIC)
        if scenery
        else np.full((high, wide), 150.0)
    )
    rows, columns = np.mgrid[:high, :wide].astype(np.float64)
    x, y, width, height = box[0] + pad, box[1] + pad, box[2], box[3]
    if pole:
        behind[y - 6 :, x - 3 : x] = 20.0
    if bar:
        behind[y - 12 : y - 8, x - 10 : x + width + 10] = 20.0
    along = (columns - x) / width
    out = []
    for k in range(COUNT):
        time = k / RATE
        phases = [
            2 * np.pi * (a * along - b * time) for a, b in ((1.4, 2.3), (0.9, 1.31), (2.1, 3.77))
        ]
        down = (
            rows
            - y
            - droop * width * along
            - 0.07 * height * along * np.sum(np.sin(phases), axis=0)
        ) / height
        cloth = np.where((down * 4).astype(int) % 2, 200.0, 60.0) + 15 * np.sum(
            np.cos(phases), axis=0
        )
        picture = np.where((along >= 0) & (along < 1) & (down >= 0) & (down < 1), cloth, behind)
        dx, dy = (0.0, 0.0) if shift is None else shift[k]
        moved = cv2.warpAffine(
            picture,
            np.array([[1.0, 0.0, pad - dx], [0.0, 1.0, pad - dy]]),
            (WIDTH, HEIGHT),
            flags=cv2.INTER_CUBIC | cv2.WARP_INVERSE_MAP,
        )
        out.append(moved + rng.normal(0, noise, moved.shape))
    return np.clip(np.rint(out), 0, 255).astype(np.uint8)


def scenery() -> UInt8Array:
    """The same without cloth and pole."""
    return drawn(box=(0, 0, 1, 1), pole=False)


def counted(frames: UInt8Array, *, size: int = 120, **stated: float) -> list[Finding]:
    """The faults of a film at 25 Hz, as pictures of a size [px]."""
    found, watch = conditioning_of(frames, size=size), FilmWatch(rate=RATE)
    follower = Follower(found)
    for k, frame in enumerate(frames):
        watch.look(k / RATE, frame)
        follower.show(frame)
    return list(reasons(watch, found, follower, **stated))


def kinds(frames: UInt8Array) -> list[str]:
    return [fault.kind for fault in counted(frames)]


@pytest.fixture(scope="module")
def plain() -> UInt8Array:
    return drawn()


def test_a_whole_flag_before_a_background_has_no_fault(plain: UInt8Array) -> None:
    assert kinds(plain) == []
    assert kinds(drawn(noise=3.0)) == []


def test_faults_are_stated_in_the_order_of_the_table(plain: UInt8Array) -> None:
    dark = (plain[:, :, : FLAG[0] + FLAG[2] // 2] // 12).astype(np.uint8)
    found = kinds(dark)
    assert found[0] == "too-dark"
    assert found == sorted(found, key=list(REASONS).index)


def test_cloth_at_an_edge_is_counted_by_frames_and_named_by_its_edge(plain: UInt8Array) -> None:
    middle = FLAG[0] + FLAG[2] // 2
    (fault,) = counted(np.ascontiguousarray(plain[:, :, :middle]))
    assert fault.kind == "cut-off"
    assert fault.value is not None
    assert fault.value > 0.8
    assert f"the right edge in {fault.value:.0%} of the frames" in fault.what
    (mirrored,) = counted(np.ascontiguousarray(plain[:, :, :middle][:, :, ::-1]))
    assert "the left edge in" in mirrored.what


def test_a_cut_to_another_scene_has_its_instant(plain: UInt8Array) -> None:
    other = 255 - np.roll(plain, WIDTH // 3, axis=2)
    fault = counted(np.concatenate([plain[:25], other[25:]]))[0]
    assert (fault.kind, fault.value) == ("scene-cut", 1.0)
    assert "once, first at 1.00 s" in fault.what


def test_a_loop_is_counted_by_the_frames_that_look_like_others(plain: UInt8Array) -> None:
    rng = stream(3, "loop")
    looped = plain[np.arange(2 * COUNT) % 13].astype(np.float64) + rng.normal(
        0, 1, (2 * COUNT, *plain.shape[1:])
    )
    fault = next(
        fault
        for fault in counted(np.clip(looped, 0, 255).astype(np.uint8))
        if fault.kind == "repeated-frames"
    )
    assert fault.value == 1.0
    assert fault.what.endswith("100% of the frames look like another one")


def test_a_film_in_which_nothing_moves_and_one_that_is_black_say_so(plain: UInt8Array) -> None:
    noise = stream(4, "still").normal(0, 1, plain.shape)
    still = np.clip(plain[:1] + noise, 0, 255).astype(np.uint8)
    assert kinds(still) == ["no-motion"]
    assert kinds(np.clip(8 + noise, 0, 255).astype(np.uint8))[0] == "too-dark"


def test_a_camera_that_moves_before_an_even_background_is_named() -> None:
    path = np.stack(
        [14 * np.sin(2.6 * np.arange(COUNT) / RATE), 9 * np.cos(2 * np.arange(COUNT) / RATE)],
        axis=1,
    )
    assert kinds(drawn(shift=path, scenery=False))[0] == "moving-camera"
    assert kinds(drawn(scenery=False)) == []
    assert kinds(drawn(shift=0.3 * path)) == []


def test_a_flag_of_few_pixels_is_too_small() -> None:
    (fault,) = counted(drawn(box=(100, 60, 24, 18), noise=0.3))
    assert fault.kind == "scale"
    assert fault.value is not None
    assert 20 <= fault.value <= 36  # its length at rest, and the waves about it


def test_what_moves_as_finely_as_leaves_is_no_cloth() -> None:
    """Pixels that take one of two values by themselves: a pixel changes by half of their difference
    d on average, the mean of 36 by √(2/π) σ with σ = d √½/6."""
    leaves = scenery()
    leaves[:, 60:130, 70:170] = stream(6, "leaves").integers(0, 2, (COUNT, 70, 100)) * 120 + 60
    fault, no_pole = counted(leaves)
    assert (fault.kind, no_pole.kind) == ("unlike-cloth", "no-pole")
    stated, limit = re.findall(r"(\d+(?:\.\d)?)%", fault.what)
    assert float(stated) < float(limit)
    assert fault.value == pytest.approx(np.sqrt(2 / np.pi) * np.sqrt(0.5) / 6 / 0.5, abs=0.03)


def test_a_spot_of_a_few_pixels_is_too_small_rather_than_still() -> None:
    assert kinds(drawn(box=(100, 60, 12, 8), noise=0.3)) == ["scale"]


@pytest.mark.parametrize("film", [no_flag.water, no_flag.crowd, no_flag.rotor])
def test_what_moves_beside_no_pole_is_no_flag(film: Film) -> None:
    (fault,) = (
        fault
        for fault in counted(film(scenery(), stream(8, film.__name__)))
        if fault.kind not in ("repeated-frames", "unlike-cloth")
    )
    assert fault.kind == "no-pole"
    assert fault.value is not None
    assert fault.value < 0.45


def test_cloth_below_a_bar_hangs_and_a_flag_on_a_pole_beside_one_does_not() -> None:
    (fault,) = counted(no_flag.hung(scenery(), stream(8, "hung")), size=240)
    assert fault.kind == "hangs-from-above"
    assert fault.value is not None
    assert 1.3 < fault.value < 2.5  # the bar is 190 px long, what moves 85 to 110 px wide
    assert kinds(drawn(bar=True)) == []


def test_a_flag_that_fills_the_picture_shows_no_background() -> None:
    wide = drawn(box=(40, 70, 150, 50))
    assert kinds(wide) == []
    (fault,) = counted(np.ascontiguousarray(wide[:, 46:144, 24:208]))
    assert fault.kind == "no-background"
    assert fault.value is not None
    assert fault.value > 0.35


def test_an_outline_longer_than_the_flag_that_was_given_is_another_thing() -> None:
    wide = drawn(box=(40, 70, 150, 50))
    assert counted(wide, aspect=3.0) == []
    (fault,) = counted(wide, aspect=1.0)
    assert fault.kind == "another-shape"
    assert fault.value == pytest.approx(
        150 / 65, rel=0.15
    )  # the waves at the free end reach beyond the hoist's 50 px


def test_a_second_pole_before_the_cloth_is_another_flag_s_and_a_stripe_is_none(
    plain: UInt8Array,
) -> None:
    x, y, width, height = FLAG
    middle = slice(x + width // 2 - 3, x + width // 2 + 3)
    two, striped = plain.copy(), plain.copy()
    two[:, y - 8 :, middle] = 20
    striped[:, y + 4 : y + height - 6, middle] = 20
    (fault,) = counted(two)
    assert fault.kind == "second-pole"
    assert fault.value is not None
    assert (
        0.5 < fault.value < 0.9
    )  # the cloth is 60 px high, its places 74 or more; its dark stripes are like the pole
    assert f"along {fault.value:.0%} of its height" in fault.what
    assert kinds(striped) == []


def test_a_film_upside_down_has_its_pole_above_and_droops_upwards() -> None:
    """Slopes of 0.25 and 0.12: 14° and 7°."""
    for droop in (0.25, 0.12):
        film = drawn(box=(70, 50, 90, 60), droop=droop)
        assert kinds(film) == []
        (fault,) = counted(np.ascontiguousarray(film[:, ::-1, ::-1]))
        assert fault.kind == "upside-down"
        assert fault.value == pytest.approx(np.degrees(np.arctan(droop)), abs=3)


def test_a_flag_in_a_strong_wind_or_in_an_updraft_is_not_upside_down() -> None:
    assert kinds(drawn(droop=-0.2)) == []
    level = drawn()
    assert "upside-down" not in kinds(np.ascontiguousarray(level[:, ::-1, ::-1]))


@pytest.mark.parametrize(("turns", "kind"), [(1, "on-its-side"), (-1, "hangs-from-above")])
def test_a_film_on_its_side_has_a_level_pole(turns: int, kind: str) -> None:
    film = drawn(box=(70, 50, 90, 60), droop=0.1)
    fault = counted(np.ascontiguousarray(np.rot90(film, turns, axes=(1, 2))))[0]
    assert fault.kind == kind
    assert "its side" in fault.what


NO_FLAG: dict[Film, tuple[str, ...]] = {
    no_flag.wall: ("too-dark", "no-motion"),
    no_flag.scroll: ("cut-off",),
    no_flag.fire: ("no-pole",),
    no_flag.birds: ("no-pole", "no-background"),
    no_flag.curtain: ("no-pole", "hangs-from-above"),
    no_flag.umbrellas: ("no-background", "no-pole", "cut-off"),
    no_flag.leaves: ("no-pole", "unlike-cloth"),
}
"""A film without a flag → reasons that are true of it."""


@pytest.mark.parametrize("film", NO_FLAG)
def test_what_is_no_flag_is_refused_for_reasons_that_are_true_of_it(film: Film) -> None:
    faults = counted(film(scenery(), stream(21, film.__name__)))
    assert faults
    assert {fault.kind for fault in faults} <= set(NO_FLAG[film])
    assert all(" flag " not in fault.what.split(":")[0] or "may" in fault.what for fault in faults)


def test_what_has_no_hoist_is_no_flag_and_a_drawn_flag_has_one(plain: UInt8Array) -> None:
    """The palm's trunk and the houses behind it have upright edges beside the fronds, which
    `no-pole` takes for a pole; the fronds come from one point."""
    houses = drawn(box=(0, 0, 1, 1), pole=False)
    houses[:, 40:, 150:156] = 30
    (fault,) = counted(no_flag.palms(houses, stream(1, "palms")), size=300)
    assert fault.kind == "no-hoist"
    assert fault.value is not None
    assert fault.value < 0.5
    assert f"{fault.value:.1%}"[:3] in fault.what
    assert counted(plain, size=300) == []
