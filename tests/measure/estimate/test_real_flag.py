"""A real flag, of which nobody knows the wind: what must hold of the answer all the same."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from flagdata.ingest.camera import CropBox, probe
from measure.estimate.combine import UNKNOWN
from measure.estimate.film import CameraFilm
from measure.estimate.gate import gate_of
from measure.estimate.measuring import Options, measure
from measure.estimate.similarity import FlagSize
from models import estimator

pytestmark = pytest.mark.reference
CLIP = "video/dyntex_flag_571c110.avi"  # 352 × 288 px, 25 Hz, 250 frames
SIZE = FlagSize(length=1.5, height=1.0)


def test_every_window_of_the_film_has_a_wind_in_the_range_that_was_assumed(reference_data: Path) -> None:
    film = CameraFilm(reference_data / CLIP)
    assert film.rate == pytest.approx(25.0)
    model = estimator.shipped()
    found = measure(film, model, gate=gate_of(model), dependence=UNKNOWN, options=Options(size=SIZE))
    assert len(found.windows) == 8
    winds = [window.quantity("wind_speed") for window in found.windows]
    assert all(0.0 <= wind.span.low < wind.span.high for wind in winds)
    assert all(wind.span.low < 10.0 for wind in winds)
    assert all(wind.span.high < 10.05 for wind in winds if wind.span.bound is None)


def test_the_largest_centred_square_is_what_is_seen_without_a_crop(reference_data: Path) -> None:
    whole = next(iter(CameraFilm(reference_data / CLIP).frames(0.0, 0.1)))[1]
    facts = probe(reference_data / CLIP)
    side = min(facts.width, facts.height)
    box = CropBox(x=(facts.width - side) // 2, y=(facts.height - side) // 2, width=side, height=side)
    np.testing.assert_array_equal(next(iter(CameraFilm(reference_data / CLIP, crop=box).frames(0.0, 0.1)))[1], whole)
