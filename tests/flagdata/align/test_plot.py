"""The picture of an alignment: drawn for what was accepted and for what was refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from flagdata.align import LagSearch, MotionSeries, check, clock_line, draw, estimate_offset
from flagdata.align.methods import Evidence
from flagdata.align.session_chart import session_panels, stretches
from flagdata.answer.charts import Line, Shade
from flagdata.core.rng import stream
from flagdata.errors import ConflictError, InputError
from flagdata.record.signals import WindAverage
from flagdata.timebase import NANOSECONDS
from tests.flagdata.align.conftest import scene
from tests.refusals import unrefused


def evidence(pair: tuple[MotionSeries, WindAverage]) -> Evidence:
    search, generator = LagSearch(surrogates=60), stream(0, "chance")
    motion, wind = pair
    estimate = estimate_offset(motion, wind, search=search, generator=generator)
    line = (
        clock_line(motion, wind, estimate, search=search, generator=generator)
        if estimate.is_accepted
        else None
    )
    return Evidence(
        motion=motion, wind=wind, estimate=estimate, line=line, response=search.response
    )


def size(path: Path) -> tuple[int, int]:
    with Image.open(path) as image:
        # Something was drawn: more than background and text.
        assert len(np.unique(np.asarray(image.convert("L")))) > 20
        return image.size


def test_an_accepted_and_a_refused_estimate_are_drawn(tmp_path: Path) -> None:
    draw(
        evidence(scene(seed=3, offset=9.0, apart=1.5, flag_noise=0.3)),
        tmp_path / "good.png",
        title="cam and mast",
    )
    draw(evidence(scene(seed=3, turbulence=0.005)), tmp_path / "steady.png", title="cam and mast")
    draw(evidence(scene(seed=3, duration=90.0)), tmp_path / "short.png", title="cam and mast")
    assert (
        size(tmp_path / "good.png")
        == size(tmp_path / "steady.png")
        == size(tmp_path / "short.png")
        == (1200, 1080)
    )


def test_a_measured_drift_adds_its_own_panel(tmp_path: Path) -> None:
    draw(
        evidence(scene(seed=11, duration=5400.0, apart=1.5, flag_noise=0.3)),
        tmp_path / "long.png",
        title="long",
    )
    assert size(tmp_path / "long.png") == (1200, 1368)


def test_files_that_cannot_be_drawn_say_so_before_anything_is_searched(tmp_path: Path) -> None:
    cases = [("lag.xyz", "no picture of format"), ("nowhere/lag.png", "no such folder")]
    assert not unrefused(lambda name: check(tmp_path / name), cases, InputError)


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_an_earlier_picture_is_replaced_and_another_file_is_not(
    suffix: str, tmp_path: Path
) -> None:
    path, found = tmp_path / f"lag{suffix}", evidence(scene(seed=3, turbulence=0.005))
    draw(found, path, title="steady")
    draw(found, path, title="still steady")
    path.write_bytes(b"theirs")
    with pytest.raises(ConflictError):
        draw(found, path, title="steady")
    assert path.read_bytes() == b"theirs"


def test_a_session_shows_when_film_and_log_ran_in_clock_time_with_their_gaps() -> None:
    """A log of 10 min at 1 Hz that lacks its fifth minute; a film of minutes 2 to 3 and 8 to 11."""
    start = 1_790_000_000 * NANOSECONDS
    minute = 60 * NANOSECONDS
    log = np.arange(601) * NANOSECONDS + start
    log = log[(log <= start + 4 * minute) | (log > start + 5 * minute)]
    wind = WindAverage(
        time=log,
        speed=np.full(len(log), 5.0),
        sigma=np.zeros(len(log)),
        direction=np.full(len(log), np.nan),
        count=np.ones(len(log), dtype=np.int32),
        period=1.0,
    )
    step = NANOSECONDS // 25
    frames = start + np.concatenate(
        [np.arange(2 * minute, 3 * minute, step), np.arange(8 * minute, 11 * minute, step)]
    )
    assert [round((end - begin) / NANOSECONDS) for begin, end in stretches(frames)] == [60, 180]
    when, blowing = session_panels(frames, wind, clock="the log's clock")
    assert when.title == "both ran for 3.0 min; film: 1 gap; log: 1 gap"
    assert len([mark for mark in blowing.marks if isinstance(mark, Shade)]) == 2
    (line,) = (mark for mark in blowing.marks if isinstance(mark, Line))
    assert int(np.isnan(line.y).sum()) == 1
    assert blowing.x.label == "the log's clock, 2026-09-21, UTC"
    assert list(blowing.x.texts) == ["14:14", "14:16", "14:18", "14:20", "14:22", "14:24"]
