"""A drawn sheet that does not stretch, in pictures whose pixels are not square."""

from __future__ import annotations

import numpy as np
import pytest

from flagdata.core.rng import stream
from flagdata.errors import InputError
from tests.studies.validation.paper_flag.edge import EdgeTrack, Seen
from tests.studies.validation.paper_flag.stretch import arc_lengths, stretch

LENGTH, RATIO = 300.0, 0.5625


def inextensible(frames: int = 300) -> EdgeTrack:
    """Lines of `LENGTH` columns; rows are `RATIO` of a column; in a third of the frames the tip is
    smeared away."""
    rng = stream(5, "sheet")
    arc = np.linspace(0, LENGTH, 1201)
    heights = np.full((frames, 320), np.nan)
    for frame in range(frames):
        slope = 0.9 * (arc / LENGTH) * np.sin(0.31 * frame - 4 * arc / LENGTH)
        step = LENGTH / 1200
        x = np.concatenate([[0], np.cumsum(np.cos((slope[1:] + slope[:-1]) / 2)) * step])
        y = np.concatenate([[0], np.cumsum(np.sin((slope[1:] + slope[:-1]) / 2)) * step])
        columns = np.arange(320)
        lost = rng.uniform(5, 60) if frame % 3 == 0 else 0.0
        seen = columns <= x[-1] - lost
        heights[frame, seen] = (
            200
            + np.interp(columns[seen], x, y) / RATIO
            + 0.1 * rng.standard_normal(int(seen.sum()))
        )
    kinds = np.where(np.isfinite(heights), Seen.LINE, Seen.NOTHING).astype(np.uint8)
    return EdgeTrack(
        time=np.arange(frames) / 1000, height=heights, width=np.ones_like(heights), seen=kinds
    )


def test_the_ratio_at_which_paper_keeps_its_length_is_that_of_the_pixels() -> None:
    found = stretch(inextensible(), stream(1, "resample"))
    assert found.ratio == pytest.approx(
        RATIO, abs=0.03
    )  # the grid of ratios is 0.01; noise does the rest
    assert found.low <= RATIO + 0.02
    assert found.high >= RATIO - 0.02
    assert found.length == pytest.approx(LENGTH, rel=0.01)  # the last column is up to one short
    assert found.spread < found.spread_square / 3


def test_a_straight_line_is_as_long_as_it_is() -> None:
    columns = np.arange(101.0)
    track = EdgeTrack(
        time=np.arange(2.0),
        height=np.stack([columns, columns]) * 4 / 3,
        width=np.ones((2, 101)),
        seen=np.zeros((2, 101), np.uint8),
    )
    # 3 : 4 : 5; a running parabola leaves a straight line as it is.
    assert arc_lengths(track, np.ones(1))[:, 0] == pytest.approx([100 * 5 / 3] * 2, rel=1e-9)


def test_too_few_frames_are_refused() -> None:
    with pytest.raises(InputError, match="frames"):
        stretch(inextensible(60), stream(1, "resample"))
