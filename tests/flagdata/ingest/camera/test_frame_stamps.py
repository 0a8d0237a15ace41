"""Stamps of imperfect files made into increasing instants."""

from __future__ import annotations

import re
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flagdata.errors import InputError
from flagdata.ingest import camera
from flagdata.ingest.camera.frame_stamps import StampRepair, nanoseconds, survey

MS = 1_000_000
PERIOD = 40 * MS


def repair(stamps: list[int | None]) -> tuple[list[tuple[int, int]], dict[str, int]]:
    """(index, stamp) of what was kept, in units of ms, and the findings' counts."""
    fix: StampRepair[int] = StampRepair(period=PERIOD)
    kept = []
    for index, stamp in enumerate(stamps):
        kept += fix.push(None if stamp is None else stamp * MS, index)
    kept += fix.finish()
    return [(index, stamp // MS) for stamp, index in kept], {
        f.kind: f.count for f in fix.findings()
    }


def test_good_stamps_pass_unchanged_and_unmentioned() -> None:
    kept, found = repair([0, 40, 80, 120])
    assert kept == [(0, 0), (1, 40), (2, 80), (3, 120)]
    assert found == {}


def test_a_frame_without_stamp_follows_its_predecessor_by_one_period() -> None:
    kept, found = repair([0, None, 80])
    assert kept == [(0, 0), (1, 40), (2, 80)]
    assert found == {"stamps-missing": 1}


def test_of_two_frames_with_one_stamp_the_later_is_left_out() -> None:
    kept, found = repair([0, 40, 40, 80])
    assert kept == [(0, 0), (1, 40), (3, 80)]
    assert found == {"stamps-duplicate": 1}


def test_a_single_stamp_far_ahead_is_the_one_left_out() -> None:
    kept, found = repair([0, 40, 5000, 120, 160])
    assert kept == [(0, 0), (1, 40), (3, 120), (4, 160)]
    assert found == {"stamps-disordered": 1}


def test_a_single_stamp_behind_is_the_one_left_out() -> None:
    kept, found = repair([0, 40, 80, 10, 160])
    assert kept == [(0, 0), (1, 40), (2, 80), (4, 160)]
    assert found == {"stamps-disordered": 1}


def test_of_two_in_the_wrong_order_the_one_nearer_to_its_own_place_stays() -> None:
    # Places by the period: 80 and 120 ms. 100 is 20 off its place, 85 is 35 off its own.
    kept, _ = repair([0, 40, 100, 85, 160])
    assert kept == [(0, 0), (1, 40), (2, 100), (4, 160)]
    # 118 is 38 off its place, 115 is 5 off its own.
    kept, _ = repair([0, 40, 118, 115, 160])
    assert kept == [(0, 0), (1, 40), (3, 115), (4, 160)]


def test_a_gap_forward_is_believed() -> None:
    kept, found = repair([0, 40, 10_000, 10_040])
    assert [stamp for _, stamp in kept] == [0, 40, 10_000, 10_040]
    assert found == {}


@given(st.lists(st.one_of(st.none(), st.integers(-10_000, 10_000)), max_size=80))
def test_whatever_comes_in_what_comes_out_increases_and_is_counted(
    stamps: list[int | None],
) -> None:
    kept, found = repair(stamps)
    times = [stamp for _, stamp in kept]
    indices = [index for index, _ in kept]
    assert all(b > a for a, b in pairwise(times))
    assert indices == sorted(set(indices))
    dropped = sum(count for kind, count in found.items() if kind != "stamps-missing")
    assert len(kept) + dropped == len(stamps)
    # Kept frames keep their own stamp.
    assert all(stamps[index] in (None, stamp) for index, stamp in kept)


@given(st.lists(st.integers(1, 3000), min_size=1, max_size=80))
def test_increasing_stamps_are_never_touched(steps: list[int]) -> None:
    stamps: list[int | None] = list(np.cumsum([0, *steps]).tolist())
    kept, found = repair(stamps)
    assert [stamp for _, stamp in kept] == stamps
    assert found == {}


def test_the_rate_of_rounded_stamps_is_exact_in_the_mean() -> None:
    # 29.97 Hz in Matroska: multiples of 1001/30 ms rounded to whole ms: steps of 33 and 34.
    stamps = np.array([round(Fraction(1001, 30) * i) for i in range(3001)])
    timing = survey(stamps, tick=Fraction(1, 1000), missing=0, fallback_rate=None)
    assert not timing.variable
    assert (timing.shortest, timing.longest) == (33, 34)
    # The end points are rounded to half a tick each, over 100 s.
    assert float(timing.rate) == pytest.approx(30000 / 1001, rel=1e-5)


def test_missing_frames_do_not_change_a_constant_rate() -> None:
    stamps = np.array([i for i in range(1000) if i % 100 not in (50, 51, 52)]) * 512
    timing = survey(stamps, tick=Fraction(1, 15360), missing=0, fallback_rate=None)
    assert not timing.variable
    assert timing.rate == 30
    assert timing.longest == 4 * 512


def test_a_rate_that_truly_varies_is_called_variable() -> None:
    steps = [23, 33, 43] * 40
    timing = survey(np.cumsum([0, *steps]), tick=Fraction(1, 1000), missing=0, fallback_rate=None)
    assert timing.variable
    assert (timing.shortest, timing.longest, timing.period) == (23, 43, 33)


def test_the_order_of_packets_does_not_matter() -> None:
    shown = np.arange(40) * 512
    coded = shown.reshape(-1, 4)[:, [0, 3, 1, 2]].ravel()
    assert survey(coded, tick=Fraction(1, 12800), missing=0, fallback_rate=None) == survey(
        shown, tick=Fraction(1, 12800), missing=0, fallback_rate=None
    )


def test_one_wild_stamp_changes_neither_origin_nor_span_nor_rate() -> None:
    stamps = np.arange(500) * 512
    stamps[250] = 10**9
    timing = survey(stamps, tick=Fraction(1, 12800), missing=0, fallback_rate=None)
    assert (timing.origin, timing.span, timing.rate) == (0, 499 * 512, 25)


def test_a_rate_is_never_made_up() -> None:
    with pytest.raises(InputError, match="two time stamps"):
        survey(np.array([77, 77]), tick=Fraction(1, 90_000), missing=3, fallback_rate=None)


def test_a_long_gap_does_not_bend_a_rate_of_rounded_stamps() -> None:
    # 29.97 Hz in whole ms, 1000 of 3000 frames missing in one piece: the median step, 33 ms, is 1.1
    # % off the mean.
    stamps = np.array([round(Fraction(1001, 30) * i) for i in range(3000) if not 1000 <= i < 2000])
    timing = survey(stamps, tick=Fraction(1, 1000), missing=0, fallback_rate=None)
    # Each of two pieces of 33 s has two rounded ends.
    assert float(timing.rate) == pytest.approx(30000 / 1001, rel=3e-5)
    assert not timing.variable


def test_a_file_of_one_frame_has_the_stated_rate_and_no_span() -> None:
    timing = survey(np.array([77]), tick=Fraction(1, 90_000), missing=0, fallback_rate=Fraction(50))
    assert (timing.origin, timing.span, timing.rate) == (77, 0, 50)


def test_the_packages_docstring_lists_every_kind_of_finding() -> None:
    # Findings are built by keyword, those of StampRepair from a table of kind: (severity, …).
    sources = [path.read_text() for path in Path(camera.__file__).parent.glob("*.py")]
    kinds = {
        kind
        for text in sources
        for kind in re.findall(r'(?:kind=|^ +)"([a-z]+(?:-[a-z]+)+)"[,:]', text, re.MULTILINE)
    }
    assert {"frames-missing", "clock-reset", "start-unsure"} <= kinds
    listed = set(re.findall(r"[a-z]+(?:-[a-z]+)+", camera.__doc__ or ""))
    assert kinds - listed == set()


def test_ticks_become_nanoseconds_without_accumulating_error() -> None:
    # 33-bit transport stream stamps: 2^33 ticks of 90 kHz are 95443.717688888… s.
    assert nanoseconds(2**33, tick=Fraction(1, 90_000), scale=Fraction(1)) == 95_443_717_688_889
    # A container that says 60 Hz for 1000 Hz: its frame 1000, at 16.667 s, was at 1 s.
    assert nanoseconds(256_000, tick=Fraction(1, 15_360), scale=Fraction(60, 1000)) == 1_000_000_000
