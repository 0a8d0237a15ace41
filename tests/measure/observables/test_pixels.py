"""Observables of pictures of cloth whose motion is a formula: a painted film in which the true
silhouette is known."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from flagdata.core.arrays import BoolArray, FloatArray, UInt8Array
from measure.observables import OBSERVABLES, ClothWindow, FilmWindow, table_of
from measure.observables.watching import Watched
from models.conditioning import HALVED, Outliner, condition_film, halve_picture
from tests.measure.observables.shapes import HEIGHT, LENGTH, window

SIDE = 300
SCALE = 100.0
"""Pixels a metre."""
HOIST = np.array([70.0, 130.0])
"""Middle of the hoist [px]."""
POLE = 6


def waving(u: FloatArray, v: FloatArray, t: float) -> tuple[FloatArray, ...]:
    """A flag that droops, swings and carries a wave; its threads turn with it, by half its droop at
    the free edge."""
    angle = 0.3 + 0.12 * math.sin(2 * math.pi * 1.5 * t) + 0.05 * math.sin(2 * math.pi * 0.7 * t)
    wave = 0.08 * u / LENGTH * np.sin(2 * np.pi * (u / 1.2 - 1.9 * t))
    turned = 0.5 * angle * u / LENGTH
    return (
        u * math.cos(angle) + v * np.sin(turned),
        wave,
        v * np.cos(turned) - u * math.sin(angle) + wave,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Painted:
    cloth: ClothWindow
    frames: UInt8Array
    silhouettes: BoolArray
    """(n, SIDE / HALVED, SIDE / HALVED)."""


def painted(*, contrast: float, seconds: float = 2.6, house: bool = False) -> Painted:
    """A film of it before a bright sky, or before a house with dark windows behind its free end:
    cloth darker by a contrast [gray levels], shaded by its wave; a dark pole."""
    cloth = window(waving, seconds=seconds)
    rng = np.random.default_rng(4)
    sky = np.linspace(200, 170, SIDE)[:, None] + cv2.GaussianBlur(
        rng.normal(0, 40, (SIDE, SIDE)), (0, 0), 6
    )
    if house:
        for row, column in ((row, column) for row in range(60, 260, 20) for column in (200, 230)):
            sky[row : row + 16, column : column + 12] = 60
    sky[60:, int(HOIST[0]) - POLE : int(HOIST[0])] = 60
    places = HOIST + cloth.points * np.array([1.0, -1.0]) * SCALE
    fixed = np.rint((places * 4 - 0.5) * 16).astype(np.int32)
    frames, masks = [], []
    for t, corners in zip(cloth.times, fixed, strict=True):
        large = np.repeat(np.repeat(sky, 4, axis=0), 4, axis=1).astype(np.float32)
        mask = np.zeros(large.shape, np.uint8)
        for triangle in corners[cloth.faces]:
            u = (triangle[:, 0].mean() / 64 - HOIST[0]) / SCALE
            shade = 175 - contrast + 15 * math.sin(2 * math.pi * (u / 1.2 - 1.9 * t))
            cv2.fillConvexPoly(large, triangle, shade, shift=4)
            cv2.fillConvexPoly(mask, triangle, 255, shift=4)
        picture = cv2.resize(large, (SIDE, SIDE), interpolation=cv2.INTER_AREA)
        frames.append(
            np.clip(np.rint(picture + rng.normal(0, 1.0, picture.shape)), 0, 255).astype(np.uint8)
        )
        masks.append(
            halve_picture(
                np.asarray(cv2.resize(mask, (SIDE, SIDE), interpolation=cv2.INTER_AREA), np.uint8)
            )
            > 127
        )
    return Painted(cloth=cloth, frames=np.stack(frames), silhouettes=np.stack(masks))


@dataclass(frozen=True, kw_only=True, eq=False)
class Seen:
    painted: Painted
    masks: BoolArray
    expected: FloatArray
    outliner: Outliner
    window: FilmWindow


@pytest.fixture(scope="module")
def seen() -> Seen:
    film = painted(contrast=90.0)
    found = condition_film(film.frames, film.cloth.times, size=SIDE)
    small = np.stack([halve_picture(frame) for frame in found.frames])
    outliner = Outliner.of(small)
    assert outliner is not None
    masks, expected = outliner.masks(small)
    scale = float(outliner.hoist[1, 1] - outliner.hoist[0, 1]) / HEIGHT
    own = FilmWindow(
        times=film.cloth.times,
        frames=small,
        masks=masks,
        shown=expected > 0.9,
        scale=scale,
        hoist=outliner.hoist,
        side=outliner.side,
        length=LENGTH,
        height=HEIGHT,
    )
    return Seen(painted=film, masks=masks, expected=expected, outliner=outliner, window=own)


def test_masks_are_the_silhouettes(seen: Seen) -> None:
    """Within a pixel of the halved picture along an outline of some 250 px about 4800 px: an
    overlap of 0.95."""
    true, found = seen.painted.silhouettes, seen.masks
    overlap = (true & found).sum(axis=(1, 2)) / (true | found).sum(axis=(1, 2))
    assert np.median(overlap) > 0.95
    assert overlap.min() > 0.88
    assert seen.outliner.side == 1.0


def test_the_expected_agreement_is_what_is_reached(seen: Seen) -> None:
    """Dice's coefficient, to 0.03 in the median."""
    true, found = seen.painted.silhouettes, seen.masks
    reached = 2 * (true & found).sum(axis=(1, 2)) / (true.sum(axis=(1, 2)) + found.sum(axis=(1, 2)))
    assert np.median(np.abs(seen.expected - reached)) < 0.03


def test_a_houses_windows_are_not_cloth() -> None:
    film = painted(contrast=90.0, house=True)
    found = condition_film(film.frames, film.cloth.times, size=SIDE)
    small = np.stack([halve_picture(frame) for frame in found.frames])
    outliner = Outliner.of(small)
    assert outliner is not None
    masks, _ = outliner.masks(small)
    true = film.silhouettes
    overlap = (true & masks).sum(axis=(1, 2)) / (true | masks).sum(axis=(1, 2))
    assert np.median(overlap) > 0.93
    assert (masks & ~true)[:, :, 90:].mean() < 0.02  # beyond 180 px, where the windows are


def test_a_mirrored_film_shows_the_mirrored_cloth(seen: Seen) -> None:
    film = seen.painted
    found = condition_film(film.frames[:, :, ::-1].copy(), film.cloth.times, size=SIDE)
    small = np.stack([halve_picture(frame) for frame in found.frames])
    outliner = Outliner.of(small)
    assert outliner is not None
    assert outliner.side == -1.0
    masks, _ = outliner.masks(small)
    true = film.silhouettes[:, :, ::-1]
    assert np.median((true & masks).sum(axis=(1, 2)) / (true | masks).sum(axis=(1, 2))) > 0.93


def test_a_picture_in_which_nothing_moves_shows_no_hoist(seen: Seen) -> None:
    """And fewer than ten pictures show nothing all the time."""
    still = np.repeat(seen.window.frames[:1], 20, axis=0)
    still[:, :, 38:] = 180
    assert Outliner.of(still) is None
    assert Outliner.of(seen.window.frames[:9]) is None


def test_the_hoist_is_where_the_pole_ends(seen: Seen) -> None:
    """To a pixel of the halved picture along the wind, and to 4 % of the height, which gives the
    scale."""
    ends = (HOIST + np.array([[0.0, -HEIGHT / 2], [0.0, HEIGHT / 2]]) * SCALE) / HALVED
    np.testing.assert_allclose(seen.outliner.hoist[:, 0], ends[:, 0], atol=1.0)
    np.testing.assert_allclose(
        seen.outliner.hoist[:, 1], ends[:, 1], atol=0.04 * HEIGHT * SCALE / HALVED
    )


@pytest.mark.parametrize("name", list(OBSERVABLES))
def test_pixels_agree_with_geometry(seen: Seen, name: str) -> None:
    """Within twice the stated sigma of one window, before the bias is taken off, which is that of
    films less clean. Pixels may not show a wave that geometry shows, and no other."""
    pixels, geometry = (
        OBSERVABLES[name].of_film(seen.window),
        OBSERVABLES[name].of_cloth(seen.painted.cloth),
    )
    if geometry.reason is not None:
        assert pixels.reason == geometry.reason
        return
    if pixels.reason is not None:
        assert (name.partition("-")[0], pixels.reason) == ("wave", "no-wave")
        assert math.isnan(pixels.value)
        return
    assert abs(OBSERVABLES[name].pixels(seen.window) - geometry.value) < 2 * OBSERVABLES[name].sigma


def test_a_film_without_outlines_gives_reasons_and_no_number(seen: Seen) -> None:
    lost = replace(seen.window, shown=np.zeros(len(seen.window.times), bool))
    for observable in OBSERVABLES.values():
        reading = observable.of_film(lost)
        assert math.isnan(reading.value)
        assert reading.reason == "no-silhouette"


def test_a_table_counts_what_was_not_shown_and_reads_back(seen: Seen, tmp_path: Path) -> None:
    import pyarrow.parquet as pq
    import zarr

    watched = Watched(starts=np.array([0.0, 2.5]), windows=(seen.window, None), seconds=2.5)
    table = table_of(watched, film="painted", length=LENGTH, height=HEIGHT)
    assert table.unseen("droop") == {"no-silhouette": 1}
    path = tmp_path / "table.parquet"
    path.write_bytes(table.parquet())
    columns = pq.read_table(path)
    assert columns["droop"].to_pylist() == [pytest.approx(table.values("droop")[0]), None]
    assert columns["droop-reason"].to_pylist() == [None, "no-silhouette"]
    assert columns.schema.field("droop").metadata[b"unit"] == b"rad"
    table.write_zarr(tmp_path / "table.zarr")
    group = zarr.open_group(tmp_path / "table.zarr", mode="r")
    stored = np.asarray(group["droop"])
    assert stored[0] == pytest.approx(table.values("droop")[0])
    assert math.isnan(stored[1])
    assert group["droop"].attrs["unit"] == "rad"
