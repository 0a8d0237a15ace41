"""Parts of a film in which the picture's edge cuts the flag off."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from flagdata.core.arrays import UInt8Array
from flagdata.ingest.films.film_array import Frames
from measure.film import ConditionedFilm, WindowReader
from measure.film.conditioned_film import CutOff
from tests.measure.estimate.conftest import RATE
from tests.models.conditioning.test_conditioning import WIDTH, Drawn

TIMES = np.arange(40) / 10


def cut(*frames: int, enough: float = 1.5) -> CutOff:
    """A sample at 10 Hz whose right edge cuts the flag off in these frames."""
    found = np.zeros((len(TIMES), 4), bool)
    found[list(frames), 2] = True
    return CutOff(times=TIMES, cut=found, enough=enough)


def test_a_film_is_left_out_where_it_is_cut_off_if_the_rest_is_long_enough() -> None:
    partly = cut(*range(10, 20))
    assert partly.partly
    assert [time for time in TIMES if partly.left_out(float(time))] == pytest.approx(TIMES[10:21])
    assert not partly.left_out(0.85)
    assert partly.left_out(0.95)
    (finding,) = partly.findings()
    assert "the right edge in 25%" in finding.what
    assert "left out" in finding.what


def test_a_piece_that_is_shorter_than_what_is_needed_does_not_leave_the_rest_out() -> None:
    """Frames 20 to 39 are whole, 1.9 s."""
    assert cut(*range(10, 20), enough=1.9).partly
    short = cut(*range(10, 20), enough=2.0)
    assert not short.partly
    assert not short.left_out(1.5)
    assert not cut(*range(40), enough=0.1).partly


@pytest.mark.parametrize(("scale", "step"), [(1.0, None), (4.0, None), (1.0, 3.0)])
def test_the_piece_that_windows_need_holds_one_wherever_it_begins(
    scale: float, step: float | None
) -> None:
    model: Any = SimpleNamespace(front_end=SimpleNamespace(rate=25.0, frames=30))
    film = ConditionedFilm(
        Frames(time=np.arange(500) / RATE, images=np.zeros((500, 8, 8), np.uint8))
    )
    layout = WindowReader(film, model, [scale], step=step).layout
    starts = np.array([layout.start(index) for index in range(layout.count)])
    for begin in np.linspace(0.0, 2 * layout.step, 50):
        assert ((starts >= begin) & (starts + layout.length <= begin + film.piece + 1e-9)).any()


def test_a_film_that_is_cut_off_all_the_time_keeps_its_frames_and_says_so() -> None:
    always = cut(*range(0, 40, 5))
    assert not any(always.left_out(float(time)) for time in TIMES)
    (finding,) = always.findings()
    assert "left out" not in finding.what
    assert finding.value == pytest.approx(0.2)


def test_a_whole_flag_is_not_reported() -> None:
    assert cut().findings() == ()
    assert not cut().left_out(1.0)


def read(images: UInt8Array) -> ConditionedFilm:
    made = ConditionedFilm(Frames(time=np.arange(len(images)) / RATE, images=images))
    assert list(made.frames(0.0, 10.0))
    return made


def test_a_flag_beyond_the_right_edge_is_reported_and_a_whole_one_near_it_is_not() -> None:
    beyond = Drawn(flags=((WIDTH - 60, 50, 80, 56),)).frames()
    near = Drawn(flags=((WIDTH - 84, 50, 80, 56),)).frames()
    (finding,) = [one for one in read(beyond).findings() if one.kind.endswith("cut-off")]
    assert "the right edge" in finding.what
    assert not [one for one in read(near).findings() if one.kind.endswith("cut-off")]
