"""Resampling by time stamps."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flagdata.errors import UsageError
from flagdata.ingest.camera.grid import Pick, Resampler

MS = 1_000_000


def run(
    stamps: list[int], *, rate: Fraction, tolerance: int, tail: int = 0
) -> tuple[list[Pick[int]], Resampler[int]]:
    grid: Resampler[int] = Resampler(start=0, rate=rate, tolerance=tolerance, tail=tail)
    picks = [pick for index, stamp in enumerate(stamps) for pick in grid.push(stamp, index)]
    return [*picks, *grid.finish()], grid


def test_60_hz_to_25_hz_picks_the_nearest_frame_by_hand_arithmetic() -> None:
    # Grid 0, 40, …, 200 ms; frames every 16.667 ms: 40 / 16.667 = 2.4 → 2, 4.8 → 5, 7.2 → 7, 9.6 →
    # 10, 12.
    stamps = [round(i * 1e9 / 60) for i in range(13)]
    picks, grid = run(stamps, rate=Fraction(25), tolerance=20 * MS)
    assert [p.source for p in picks] == [0, 2, 5, 7, 10, 12]
    assert [p.time for p in picks] == [0, 40 * MS, 80 * MS, 120 * MS, 160 * MS, 200 * MS]
    # The worst is 0.4 of a frame period, 6.667 ms.
    assert grid.report.worst_error == pytest.approx(0.4 / 60 * 1e9, abs=1)
    assert (grid.report.sources, grid.report.used, grid.report.unused, grid.report.repeats) == (
        13,
        6,
        7,
        0,
    )


def test_an_instant_half_way_between_two_frames_takes_the_earlier() -> None:
    picks, _ = run([0, 30 * MS, 50 * MS, 70 * MS], rate=Fraction(25), tolerance=20 * MS)
    assert [(p.time, p.source) for p in picks] == [(0, 0), (40 * MS, 1)]


def test_instants_in_a_gap_are_left_out_and_counted() -> None:
    # Frames 0…3 and 8…9 at 40 ms: the instants of 4…7 have nothing within 30 ms.
    picks, grid = run(
        [i * 40 * MS for i in (0, 1, 2, 3, 8, 9)], rate=Fraction(25), tolerance=30 * MS
    )
    assert [p.time // (40 * MS) for p in picks] == [0, 1, 2, 3, 8, 9]
    assert (grid.report.left_out, grid.report.gaps, grid.report.first_left_out) == (4, 1, 4)
    assert grid.report.longest_gap == 200 * MS


def test_a_first_frame_that_is_late_by_just_the_tolerance_stands_for_the_start() -> None:
    picks, grid = run([20 * MS, 60 * MS], rate=Fraction(25), tolerance=20 * MS)
    assert [(p.time // MS, p.source) for p in picks] == [(0, 0), (40, 0)]
    picks, grid = run([21 * MS, 61 * MS], rate=Fraction(25), tolerance=20 * MS)
    assert [(p.time // MS, p.source) for p in picks] == [(40, 0)]
    assert (grid.report.left_out, grid.report.gaps, grid.report.longest_gap) == (1, 1, 21 * MS)


def test_a_slower_camera_repeats_frames_and_says_how_many() -> None:
    # 12.5 Hz onto 25 Hz: 0, 80, 160 ms; the instants 40 and 120 lie half-way and take the earlier.
    picks, grid = run([0, 80 * MS, 160 * MS], rate=Fraction(25), tolerance=60 * MS)
    assert [p.source for p in picks] == [0, 0, 1, 1, 2]
    assert grid.report.repeats == 2


def test_a_gap_of_two_hundred_years_costs_no_time() -> None:
    year = 31_556_952 * 1_000_000_000
    picks, grid = run([0, 200 * year], rate=Fraction(1000), tolerance=MS // 2)
    assert len(picks) == 2
    assert grid.report.left_out == 200 * 31_556_952 * 1000 - 1


def test_the_grid_does_not_drift_at_an_ntsc_rate() -> None:
    grid: Resampler[int] = Resampler(start=0, rate=Fraction(30000, 1001), tolerance=0, tail=0)
    # Frame 30000 of 29.97 Hz is at exactly 1001 s.
    assert grid.instant(30_000) == 1001 * 1_000_000_000
    # 1001/30000 s = 33.366666… ms, rounded to nanoseconds.
    assert grid.instant(1) == 33_366_667


def test_stamps_that_do_not_increase_are_refused() -> None:
    grid: Resampler[int] = Resampler(start=0, rate=Fraction(25), tolerance=MS, tail=0)
    list(grid.push(5, 0))
    with pytest.raises(UsageError, match="must increase"):
        list(grid.push(5, 1))


@given(
    first=st.one_of(st.just(0), st.integers(0, 100 * MS)),
    steps=st.lists(st.integers(1, 120 * MS), min_size=1, max_size=60),
    rate=st.sampled_from([Fraction(25), Fraction(30000, 1001), Fraction(7), Fraction(1000)]),
    tolerance=st.integers(0, 80 * MS),
    tail=st.integers(0, 30 * MS),
)
def test_each_instant_gets_the_nearest_frame_within_tolerance_or_none(
    first: int, steps: list[int], rate: Fraction, tolerance: int, tail: int
) -> None:
    stamps = [first]
    for step in steps:
        stamps.append(stamps[-1] + step)
    picks, grid = run(stamps, rate=rate, tolerance=tolerance, tail=tail)
    # The same by exhaustion: every instant against every frame, ties to the earlier.
    expected = []
    index = 0
    while (time := round(Fraction(index * 1_000_000_000) / rate)) <= stamps[-1] + tail:
        index += 1
        best = min(range(len(stamps)), key=lambda i: (abs(stamps[i] - time), i))
        if abs(stamps[best] - time) <= tolerance:
            expected.append((time, best, abs(stamps[best] - time)))
    # Python rounds halves to even, the grid rounds them up; none of these rates has an instant on a
    # half nanosecond but 30000/1001, whose instants are thirds.
    assert [(p.time, p.source, p.error) for p in picks] == expected
    assert grid.report.picks == len(expected)
    assert grid.report.used == len({source for _, source, _ in expected})
    assert grid.report.worst_error == max((error for *_, error in expected), default=0)


@given(steps=st.lists(st.integers(1, 90 * MS), min_size=1, max_size=80))
def test_kept_and_left_out_instants_are_all_instants(steps: list[int]) -> None:
    stamps = [0]
    for step in steps:
        stamps.append(stamps[-1] + step)
    picks, grid = run(stamps, rate=Fraction(25), tolerance=15 * MS)
    # Between the first and the last frame there are ⌊span / 40 ms⌋ + 1 instants; those after the
    # last pick that no later frame reaches are neither kept nor counted.
    times = [p.time for p in picks]
    assert all(b - a >= 40 * MS and (b - a) % (40 * MS) == 0 for a, b in pairwise(times))
    counted = grid.report.picks + grid.report.left_out
    total = stamps[-1] // (40 * MS) + 1
    assert total - 1 <= counted <= total
