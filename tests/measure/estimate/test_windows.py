"""Windows of a film: which frames stand for which instants, and what is left out."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from flagdata.errors import InputError, UsageError
from measure.estimate.windows import cut, findings_of, lay_out


def numbered(times: NDArray[np.float64]) -> list[tuple[float, NDArray[np.uint8]]]:
    """Frames whose gray is their number."""
    return [(float(time), np.full((2, 2), k, dtype=np.uint8)) for k, time in enumerate(times)]


def shown(window: NDArray[np.uint8]) -> list[int]:
    return window[:, 0, 0].tolist()


def test_windows_follow_each_other_and_do_not_overlap() -> None:
    layout = lay_out(frames=10, spacings=(0.04,), rate=25.0, duration=34 / 25, step=None)
    windows = list(cut(numbered(np.arange(35) / 25), layout))
    assert [shown(window.clips[0]) for window in windows] == [list(range(k, k + 10)) for k in (0, 10, 20)]


def test_each_size_of_flag_has_its_own_spacing_from_the_same_start() -> None:
    layout = lay_out(frames=5, spacings=(0.04, 0.08), rate=50.0, duration=1.0, step=None)
    first = next(cut(numbered(np.arange(51) / 50), layout))
    assert shown(first.clips[0]) == [0, 2, 4, 6, 8]
    assert shown(first.clips[1]) == [0, 4, 8, 12, 16]


def test_a_frame_is_the_nearest_in_time() -> None:
    layout = lay_out(frames=4, spacings=(0.05,), rate=30.0, duration=1.0, step=None)
    first = next(cut(numbered(np.arange(31) / 30), layout))
    expected = [int(np.argmin(np.abs(np.arange(31) / 30 - instant))) for instant in 0.05 * np.arange(4)]
    assert shown(first.clips[0]) == expected
    assert first.worst <= 0.5 / 30 + 1e-12


def test_uneven_stamps_are_no_gap_and_a_missing_frame_is() -> None:
    times = np.arange(41) / 25
    uneven = times + 0.005 * np.sin(np.arange(41))
    layout = lay_out(frames=10, spacings=(0.04,), rate=25.0, duration=1.6, step=None)
    assert len(list(cut(numbered(uneven), layout))) == layout.count == 4
    windows = list(cut(numbered(np.delete(times, 14)), layout))
    assert [window.index for window in windows] == [0, 2, 3]
    findings = findings_of(layout, found=3, worst=0.0, repeats=0, rate=25.0)
    assert {finding.kind: finding.count for finding in findings}["windows-left-out"] == 1


def test_frames_that_are_shown_twice_are_counted() -> None:
    layout = lay_out(frames=26, spacings=(0.04,), rate=24.0, duration=1.1, step=None)
    window = next(cut(numbered(np.arange(28) / 24), layout))
    assert window.repeats == 1


def test_a_part_of_the_film_begins_and_ends_as_given() -> None:
    layout = lay_out(frames=5, spacings=(0.04,), rate=25.0, duration=4.0, step=0.04, first=1.0, last=1.4)
    windows = list(cut(numbered(np.arange(101) / 25), layout))
    assert shown(windows[0].clips[0])[0] == 25
    assert shown(windows[-1].clips[0])[-1] == 35


def test_the_error_of_too_short_a_film_states_the_length_needed() -> None:
    with pytest.raises(InputError, match=r"at least 1\.16 s, 30 frames"):
        lay_out(frames=30, spacings=(0.04,), rate=25.0, duration=1.0, step=None)


@pytest.mark.parametrize("part", [(3.0, 2.0), (9.0, None), (-1.0, 2.0)])
def test_a_part_that_the_film_does_not_have_is_refused(part: tuple[float, float | None]) -> None:
    with pytest.raises(UsageError, match="of a film of 4"):
        lay_out(frames=5, spacings=(0.04,), rate=25.0, duration=4.0, step=None, first=part[0], last=part[1])
