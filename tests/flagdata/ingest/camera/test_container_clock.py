"""Counters that pass their end run on; clocks that start anew end the recording; wrong stamps are
neither."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

from flagdata.core.findings import Severity
from flagdata.ingest import propose_crop
from flagdata.ingest.camera.container_clock import Counter, restart
from tests.flagdata.ingest.camera.conftest import PLAIN, START, number_of, write_video
from tests.flagdata.ingest.camera.reading import grid_of, read

TICK = Fraction(1, 90_000)
PERIOD = 3600  # 25 Hz
B_FRAMES = {"preset": "veryfast", "crf": "12", "bf": "2", "g": "10"}
FULL = 1 << 33


def counted(
    stamps: list[int | None], *, length: int | None = FULL, tick: Fraction = TICK
) -> list[int | None]:
    counter = Counter(length=length, tick=tick)
    found = []
    for stamp in stamps:
        packet = av.Packet(1)
        packet.pts = stamp
        counter.run_on(packet)
        found.append(packet.pts)
    return found


@pytest.fixture
def take(tmp_path: Path) -> Callable[..., Path]:
    """Writes a transport stream of numbered frames whose clock begins at some time [s]."""

    def write(seconds: float, frames: int) -> Path:
        first = round(seconds * 90_000)
        return write_video(
            tmp_path / f"{seconds:g}-{frames}.ts",
            range(first, first + frames * PERIOD, PERIOD),
            tick=TICK,
            encoder=B_FRAMES,
            muxer={"mpegts_copyts": "1"},
        )

    return write


# Seconds at which the second take's clock begins; the first one's runs from 5000 s on for 0.8 s.
@pytest.mark.parametrize("second", [4000, 4998, 0])
def test_a_clock_that_starts_anew_ends_the_recording_and_is_no_wrap(
    second: int, tmp_path: Path, take: Callable[..., Path]
) -> None:
    joined = tmp_path / "joined.ts"
    joined.write_bytes(take(5000, 20).read_bytes() + take(second, 12).read_bytes())
    info, frames, found = read(joined, PLAIN)
    assert [number_of(f.image) for f in frames] == list(range(20))
    assert grid_of(frames, START) == list(range(20))
    assert info.duration == pytest.approx(19 * 0.04)
    reset = found["clock-reset"]
    assert (reset.severity, reset.where, reset.count) == (Severity.ERROR, "frame 20", 12)
    assert "after 0.80 s" in reset.what
    assert "--start" in (reset.fix or "")
    # FFmpeg marks a frame before the joint damaged, which is whole.
    assert not set(found) & {"corrupt-frames", "damaged-references", "frames-missing"}


def test_frames_of_the_second_clock_stay_out_when_it_passes_the_first(
    tmp_path: Path, take: Callable[..., Path]
) -> None:
    # The second clock begins 2 s before the first one's end and runs for 3 s.
    joined = tmp_path / "joined.ts"
    joined.write_bytes(take(100, 20).read_bytes() + take(98.8, 75).read_bytes())
    _, frames, found = read(joined, PLAIN)
    assert [number_of(f.image) for f in frames] == list(range(20))
    assert found["clock-reset"].count == 75


def test_a_wrap_within_reordered_frames_runs_on(take: Callable[..., Path]) -> None:
    _, frames, found = read(take((FULL - 10 * PERIOD) / 90_000, 20), PLAIN)
    assert [number_of(f.image) for f in frames] == list(range(20))
    assert grid_of(frames, START) == list(range(20))
    assert not set(found) & {"clock-reset", "frames-missing", "stamps-disordered"}


def test_the_motion_of_a_film_is_found_though_no_seek_finds_its_place(
    tmp_path: Path, take: Callable[..., Path]
) -> None:
    joined = tmp_path / "joined.ts"
    joined.write_bytes(take(5000, 20).read_bytes() + take(4000, 12).read_bytes())
    # Cells of 16 px: those of 1, 2, 4, 8 and 16, which change within 20 frames, are the first five
    # of the upper row.
    for film in (joined, take((FULL - 10 * PERIOD) / 90_000, 20)):
        box = propose_crop(film).box
        assert box.x == 0
        assert box.y == 0
        assert 64 <= box.width <= 96


def test_stamps_run_on_across_the_end_of_their_counter_in_both_directions() -> None:
    across: list[int | None] = [FULL - 7200, FULL - 3600, 3600, 0, None, 7200, FULL - 1, 10_800]
    assert counted(across) == [
        FULL - 7200,
        FULL - 3600,
        FULL + 3600,
        FULL,
        None,
        FULL + 7200,
        FULL - 1,
        FULL + 10_800,
    ]
    # Flash video counts 32 bits of milliseconds.
    assert counted([(1 << 32) - 40, 0, 40], length=1 << 32, tick=Fraction(1, 1000))[1:] == [
        1 << 32,
        (1 << 32) + 40,
    ]


def test_a_jump_that_is_no_frame_step_modulo_the_counter_is_left_as_it_is() -> None:
    jumps: list[int | None] = [
        0,
        3600,
        450_000_000,
        360_000_000,
        360_003_600,
        FULL // 2 + 360_000_000,
    ]
    assert counted(jumps) == jumps
    assert counted([FULL - 3600, 0], length=None) == [FULL - 3600, 0]


def test_a_restart_is_found_where_the_stamps_go_on_from_earlier_ones() -> None:
    first, second = np.arange(100) * PERIOD + 450_000_000, np.arange(50) * PERIOD + 360_000_000
    assert restart(np.concatenate([first, second]), tick=TICK) == 100
    assert restart(first, tick=TICK) is None
    assert restart(first[:1], tick=TICK) is None
    # Frames of a time lapse, one in 10 s, in the order of H.264 with three B-frames.
    lapse = (np.arange(40) * 900_000).reshape(-1, 4)[:, [3, 1, 0, 2]].ravel()
    assert restart(lapse, tick=TICK) is None


@pytest.mark.parametrize("offset", [-450_000_000, -180_000, 180_000, 1 << 33])
@pytest.mark.parametrize("length", [1, 3])
def test_a_few_wrong_stamps_are_no_restart(offset: int, length: int) -> None:
    stamps = np.arange(100) * PERIOD + 450_000_000
    stamps[50 : 50 + length] += offset
    assert restart(stamps, tick=TICK) is None
