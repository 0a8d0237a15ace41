"""The centre line of a drawn sheet, whose heights are known."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

from flagdata.core.arrays import FloatArray, UInt8Array
from flagdata.core.rng import stream
from flagdata.errors import InputError, UsageError
from tests.studies.validation.paper_flag.edge import (
    EdgeOptions,
    EdgeTrack,
    Seen,
    line_in,
    scatter,
    track_edge,
)

ROWS, COLUMNS = 240, 320


def drawn(height: FloatArray, *, thickness: float = 2.0, smear: float = 0.0) -> FloatArray:
    """A bright picture with a dark line: a Gaussian profile, its place averaged over an even motion
    of `smear` rows."""
    rows = np.arange(ROWS)[:, None]
    places = [0.0] if smear == 0 else np.linspace(-smear / 2, smear / 2, 41)
    dark = sum(np.exp(-(((rows - height - place) / thickness) ** 2) / 2) for place in places) / len(
        places
    )
    return 250 - 200.0 * np.nan_to_num(dark)


def picture(values: FloatArray, noise: float = 0.0, *names: int) -> UInt8Array:
    grain = noise * stream(3, "grain", *names).standard_normal(values.shape)
    return np.clip(np.rint(values + grain), 0, 255).astype(np.uint8)


def sheet(phase: float = 0.0) -> FloatArray:
    x = np.arange(COLUMNS)
    return 120.3 + 30 * (x / COLUMNS) ** 2 * np.sin(phase - 6 * x / COLUMNS)


def tracked(images: list[UInt8Array], rate: float = 1000.0) -> EdgeTrack:
    found = [line_in(image, EdgeOptions()) for image in images]
    height, width, seen = (np.stack([one[part] for one in found]) for part in range(3))
    return EdgeTrack(
        time=np.arange(len(images)) / rate, height=height, width=width, seen=seen.astype(np.uint8)
    )


def test_a_line_is_found_to_a_fraction_of_a_pixel() -> None:
    height, _, seen = line_in(picture(drawn(sheet())), EdgeOptions())
    assert (seen == Seen.LINE).all()
    # Rounding to whole grays (σ 0.29) over ~9 pixels of a line 200 deep: some hundredths of a
    # pixel; the floor that is subtracted is symmetrical only to half a pixel, which adds as much.
    assert np.abs(height - sheet()).max() < 0.1


def test_the_stated_error_is_the_error_that_was_made() -> None:
    phases = np.linspace(0, 6, 12)
    track = tracked([picture(drawn(sheet(p)), 4.0, i) for i, p in enumerate(phases)])
    made = np.sqrt(np.mean((track.height - np.stack([sheet(p) for p in phases])) ** 2))
    # From 12 × 300 columns the spread is known to some percent; a third covers the parts of the
    # error that neighbouring columns share.
    assert np.median(scatter(track)) == pytest.approx(made, rel=0.33)


def test_a_line_smeared_by_even_motion_is_where_it_was_at_mid_exposure() -> None:
    height, width, seen = line_in(
        picture(drawn(np.full(COLUMNS, 100.4), smear=20.0)), EdgeOptions()
    )
    assert (seen == Seen.LINE).all()
    assert np.abs(height - 100.4).max() < 0.1  # a symmetrical band: rounding alone
    assert np.median(width) > 18


def test_what_cannot_be_located_is_flagged_and_left_out() -> None:
    height = sheet()
    height[200:230] = np.nan  # faded
    values = drawn(height)
    values[:, 250:270] -= 180 * np.exp(
        -(((np.arange(ROWS)[:, None] - 60) / 2.0) ** 2) / 2
    )  # a second line, far off
    values[:, :12] = drawn(np.full(12, 200.0))  # the holder
    measured, _, seen = line_in(picture(values), EdgeOptions(bridge=40))
    assert (seen[200:230] == Seen.NOTHING).all()
    assert (seen[:12] == Seen.APART).all()
    assert set(np.unique(seen[250:270])) <= {Seen.DOUBLE, Seen.LINE}
    assert (np.isnan(measured) == (seen != Seen.LINE)).all()
    assert np.abs(measured - sheet())[seen == Seen.LINE].max() < 0.1


def test_a_band_wider_than_allowed_is_no_line() -> None:
    _, _, seen = line_in(
        picture(drawn(np.full(COLUMNS, 100.0), smear=50.0)), EdgeOptions(widest=30.0)
    )
    assert (seen == Seen.SMEARED).all()


def test_an_empty_picture_shows_nothing() -> None:
    _, _, seen = line_in(np.full((ROWS, COLUMNS), 250, np.uint8), EdgeOptions())
    assert (seen == Seen.NOTHING).all()


def test_options_that_find_nothing_are_refused() -> None:
    with pytest.raises(UsageError, match="finds nothing"):
        EdgeOptions(floor=1.5)


def film(path: Path, frames: int, frequency: float, rate: float = 1000.0) -> None:
    """A clip whose container says 60 fps."""
    with av.open(str(path), "w") as container:
        video = container.add_stream(
            "libx264", rate=60, options={"crf": "12", "preset": "veryfast"}
        )
        video.width, video.height, video.pix_fmt = COLUMNS, ROWS, "yuv420p"
        video.codec_context.time_base = Fraction(1, 60)
        for number in range(frames):
            image = picture(drawn(sheet(2 * np.pi * frequency * number / rate)))
            frame = av.VideoFrame.from_ndarray(image, format="gray").reformat(format="yuv420p")
            frame.pts = number
            container.mux(video.encode(frame))
        container.mux(video.encode())


def test_a_clip_is_tracked_at_the_cameras_true_rate(tmp_path: Path) -> None:
    film(tmp_path / "clip.mp4", 20, 25.0)
    track = track_edge(tmp_path / "clip.mp4", true_rate=1000.0)
    assert track.rate == pytest.approx(1000, rel=1e-6)
    assert track.share(Seen.LINE) > 0.99
    expected = np.stack([sheet(2 * np.pi * 25.0 * i / 1000) for i in range(20)])
    error = (track.height - expected)[track.seen == Seen.LINE]
    # Lossy compression adds to the rounding: a quarter of a pixel for single heights.
    assert np.sqrt(np.mean(error**2)) < 0.1
    assert np.abs(error).max() < 0.5
    assert len(track_edge(tmp_path / "clip.mp4", true_rate=1000.0, rate=200.0).time) == 4


def test_a_single_picture_is_no_clip(tmp_path: Path) -> None:
    film(tmp_path / "one.mp4", 1, 10.0)
    with pytest.raises(InputError, match="fewer than two"):
        track_edge(tmp_path / "one.mp4", true_rate=1000.0)
