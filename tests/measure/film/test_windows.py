"""Windows of a film: which frames stand for which instants, and what is left out."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

from flagdata.core.arrays import FloatArray, UInt8Array
from flagdata.core.findings import Finding
from flagdata.errors import InputError, UsageError
from measure.film import WindowReader, findings_of
from measure.film.windows import cut, lay_out
from models.conditioning import Distinct, Interpolator, TimedFrame
from tests.measure.gate.made import small_model


def numbered(times: FloatArray) -> list[tuple[float, UInt8Array]]:
    """Frames whose gray is their number."""
    return [(float(time), np.full((16, 16), k, dtype=np.uint8)) for k, time in enumerate(times)]


def shown(window: UInt8Array) -> list[int]:
    return window[:, 0, 0].tolist()


def test_windows_follow_each_other_and_do_not_overlap() -> None:
    layout = lay_out(frames=10, spacings=(0.04,), rate=25.0, duration=34 / 25, step=None)
    windows = list(cut(numbered(np.arange(35) / 25), layout))
    assert [shown(window.clips[0]) for window in windows] == [
        list(range(k, k + 10)) for k in (0, 10, 20)
    ]


def test_each_size_of_flag_has_its_own_spacing_from_the_same_start() -> None:
    layout = lay_out(frames=5, spacings=(0.04, 0.08), rate=50.0, duration=1.0, step=None)
    first = next(cut(numbered(np.arange(51) / 50), layout))
    assert shown(first.clips[0]) == [0, 2, 4, 6, 8]
    assert shown(first.clips[1]) == [0, 4, 8, 12, 16]


def test_a_frame_near_an_instant_shows_it_and_elsewhere_the_picture_is_interpolated() -> None:
    """At 30 Hz every fifth instant of 25 Hz is a frame, those beside it are 6.7 ms from one, the
    others 13.3 ms."""
    layout = lay_out(frames=6, spacings=(0.04,), rate=30.0, duration=1.0, step=None)
    ramp = [(k / 30, np.full((32, 32), 5 * k, dtype=np.uint8)) for k in range(31)]
    first = next(cut(ramp, layout))
    assert shown(first.clips[0]) == [
        0,
        5,
        12,
        18,
        25,
        30,
    ]  # instants are frames 0, 1.2, 2.4, 3.6, 4.8 and 6
    assert first.interpolated == 2


def test_a_moving_edge_is_interpolated_where_it_is_and_not_blended() -> None:
    """A bright square that moves by 8 px from frame to frame is 4 px further half way, as bright as
    it is."""
    pictures = np.full((2, 64, 64), 40, dtype=np.uint8)
    rows, columns = np.mgrid[0:24, 0:24]
    cloth = (120 + 60 * np.sin(rows / 3) * np.cos(columns / 4)).astype(np.uint8)
    pictures[0, 20:44, 16:40] = pictures[1, 20:44, 24:48] = cloth
    half = Interpolator().between((0.0, pictures[0]), (1.0, pictures[1]), 0.5)
    assert np.abs(half[22:42, 22:42].astype(int) - cloth[2:22, 2:22]).mean() < 6
    blended = pictures.mean(axis=0)
    assert np.abs(blended[22:42, 22:42] - cloth[2:22, 2:22]).mean() > 12


def test_of_a_film_slower_than_the_network_only_the_middle_fifth_between_frames_is_interpolated() -> (
    None
):
    layout = lay_out(frames=26, spacings=(0.04,), rate=24.0, duration=1.1, step=None)
    window = next(cut(numbered(np.arange(28) / 24), layout))
    places = 0.04 * 24 * np.arange(26)  # in frames of the film
    between = np.abs(places % 1 - 0.5) < 0.099
    assert window.interpolated == np.count_nonzero(between) > 0
    own = np.array(shown(window.clips[0]))
    assert own[~between].tolist() == np.round(places[~between]).astype(int).tolist()


def test_frames_that_repeat_the_one_before_are_left_out_and_counted() -> None:
    """A camera of 15 pictures a second in a file of 60: three of four frames repeat, but for noise
    of the coding."""
    rng = np.random.default_rng(5)
    own = rng.uniform(0, 255, (10, 16, 16))
    film = [
        (k / 60, (own[k // 4] + rng.uniform(-0.5, 0.5, (16, 16))).clip(0, 255).astype(np.uint8))
        for k in range(40)
    ]
    distinct = Distinct(film)
    kept = [time for time, _ in distinct]
    ends = [1, 2, 3, 37, 38, 39]  # there the picture changes on one side only
    assert kept == sorted(k / 60 for k in [*range(0, 40, 4), *ends])
    assert (distinct.frames, distinct.repeated) == (40, 24)


def test_a_still_film_and_ones_that_start_or_come_to_rest_have_no_repeated_frames() -> None:
    rng = np.random.default_rng(6)
    texture = rng.uniform(0, 255, (16, 16))
    still = [(k / 25, texture.astype(np.uint8)) for k in range(20)]
    slowing = [(k / 25, np.roll(texture, 1, 0) * np.exp(-k / 8) + 100) for k in range(40)]
    starting = [(time + 1.0, texture.astype(np.uint8)) for time, _ in still]
    starting += [(2.0 + k / 25, np.roll(texture, k + 1, 0).astype(np.uint8)) for k in range(20)]
    for film in (still, starting, [(time, picture.astype(np.uint8)) for time, picture in slowing]):
        distinct = Distinct(film)
        assert len(list(distinct)) == distinct.frames
        assert distinct.repeated == 0


def test_a_window_of_too_few_pictures_is_left_out() -> None:
    """15 pictures a second lie no further apart than some that are interpolated, but most would be
    made."""
    layout = lay_out(frames=20, spacings=(0.04,), rate=60.0, duration=2.0, step=None)
    assert not list(cut(numbered(np.arange(31) / 15), layout))
    gap = np.delete(np.arange(61) / 30, [20])  # one frame of 30 Hz is missing
    assert (
        len(
            list(
                cut(
                    numbered(gap),
                    lay_out(frames=20, spacings=(0.04,), rate=30.0, duration=2.0, step=None),
                )
            )
        )
        == 2
    )


def test_uneven_stamps_are_no_gap_and_a_missing_frame_is() -> None:
    times = np.arange(41) / 25
    uneven = times + 0.005 * np.sin(np.arange(41))
    layout = lay_out(frames=10, spacings=(0.04,), rate=25.0, duration=1.6, step=None)
    assert len(list(cut(numbered(uneven), layout))) == layout.count == 4
    lacks: dict[float, str] = {}
    windows = list(cut(numbered(np.delete(times, 14)), layout, lacks=lacks))
    assert [window.index for window in windows] == [0, 2, 3]
    assert lacks == {0.4: "80 ms lie between two pictures, and at most 70 ms can be interpolated"}
    findings = findings_of(layout, windows_read=3, interpolated=0, frames=40, repeated=0)
    assert {finding.kind: finding.count for finding in findings}["windows-left-out"] == 1


def test_of_a_film_whose_still_places_never_change_they_get_noise_and_the_cloth_does_not() -> None:
    """As a coder leaves them that skips what stands still: the cloth is in 4 of 16 columns."""
    pictures = [np.full((16, 16), 100, dtype=np.uint8) for _ in range(20)]
    for k, picture in enumerate(pictures):
        picture[:, :4] += k
    layout = lay_out(frames=10, spacings=(0.04,), rate=25.0, duration=19 / 25, step=None)
    first, second = (
        window.clips[0]
        for window in cut(list(zip(np.arange(20) / 25, pictures, strict=True)), layout)
    )
    assert first[:, 0, :4].tolist() == [[100 + k] * 4 for k in range(10)]
    assert 0.4 < first[:, :, 4:].std(axis=0).mean() < 0.8
    assert (first[:, :, 4:] != second[:, :, 4:]).any()


def test_a_part_of_the_film_begins_and_ends_as_given() -> None:
    layout = lay_out(
        frames=5, spacings=(0.04,), rate=25.0, duration=4.0, step=0.04, first=1.0, last=1.4
    )
    windows = list(cut(numbered(np.arange(101) / 25), layout))
    assert shown(windows[0].clips[0])[0] == 25
    assert shown(windows[-1].clips[0])[-1] == 35


def test_the_error_of_too_short_a_film_states_the_length_needed() -> None:
    with pytest.raises(InputError, match=r"at least 1\.16 s, 30 frames"):
        lay_out(frames=30, spacings=(0.04,), rate=25.0, duration=1.0, step=None)


@pytest.mark.parametrize("part", [(3.0, 2.0), (9.0, None), (-1.0, 2.0)])
def test_a_part_that_the_film_does_not_have_is_refused(part: tuple[float, float | None]) -> None:
    with pytest.raises(UsageError, match="which lasts 4"):
        lay_out(
            frames=5,
            spacings=(0.04,),
            rate=25.0,
            duration=4.0,
            step=None,
            first=part[0],
            last=part[1],
        )


def test_windows_further_apart_than_the_film_is_long_are_refused() -> None:
    with pytest.raises(UsageError, match=r"is 60 s, and 4\.00 s of film are used"):
        lay_out(frames=5, spacings=(0.04,), rate=25.0, duration=4.0, step=60.0)
    assert lay_out(frames=5, spacings=(0.04,), rate=25.0, duration=4.0, step=4.0).count == 1


def test_windows_nearer_than_the_films_frames_are_refused() -> None:
    for step in (0.02, 0.039):
        with pytest.raises(UsageError, match=r"and that between the film's frames 0\.04 s"):
            lay_out(frames=5, spacings=(0.04,), rate=25.0, duration=4.0, step=step)
    assert lay_out(frames=5, spacings=(0.04,), rate=25.0, duration=4.0, step=0.04).count > 90


class Filmed:
    """A film of numbered frames at a rate."""

    name, start = "numbered", None

    def __init__(self, rate: float, count: int) -> None:
        self.rate, self.duration = rate, (count - 1) / rate
        self._all = numbered(np.arange(count) / rate)

    def frames(self, first: float, last: float) -> Iterator[TimedFrame]:
        return (one for one in self._all if first - 1e-9 <= one[0] <= last + 1e-9)

    def findings(self) -> tuple[Finding, ...]:
        return ()


def test_a_film_is_read_once_by_its_windows_and_by_who_else_looks() -> None:
    """A network of 12 frames at 25 Hz: two windows from 0.4 s on, of which someone else sees the
    frames about them."""
    reader = WindowReader(Filmed(25.0, 60), small_model(), [1.0], first=0.4, last=1.4)
    looked: list[float] = []
    advanced: list[tuple[int, int]] = []
    reader.look = lambda time, _: looked.append(time)
    starts = []
    for window in reader.windows(lambda count, one: advanced.append((count, one))):
        assert len(advanced) == len(starts)  # a window counts when it is done
        starts.append(window.start)
    np.testing.assert_allclose(starts, [0.4, 0.88])
    assert advanced == [(reader.layout.count, 1)] * 2
    assert looked == sorted(set(looked))  # each frame once, in order
    assert looked[0] == pytest.approx(0.32)  # two frames before the part
