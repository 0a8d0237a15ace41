"""The order of pictures is that of the recording, or refused; what their names state is how far
apart they are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from datetime import UTC, datetime, timedelta
from fractions import Fraction
from random import Random

import pytest

from flagdata.errors import InputError
from flagdata.ingest.camera.picture_names import Ordered, order_pictures

N = 24


def utc(*parts: int) -> datetime:
    return datetime(*parts, tzinfo=UTC)  # type: ignore[misc, arg-type]


LATE = utc(2026, 5, 1, 12, 0, 0, 520_000)


def placed(names: Sequence[str], rate: int = 25) -> tuple[list[int], list[int], Ordered]:
    """The numbers of `names`, which are in the right order, as they come out of a folder's; their
    places; and all."""
    mixed = list(range(len(names)))
    Random(1).shuffle(mixed)
    found = order_pictures([names[i] for i in mixed], rate=Fraction(rate), where="folder")
    return [mixed[i] for i in found.order], list(found.places), found


def clocked(
    pattern: str, start: datetime = LATE, *, step: float = 0.04, count: int = N
) -> list[str]:
    """Names by times `step` s apart; MS stands for the milliseconds in three digits."""
    times = [start + timedelta(milliseconds=round(1000 * step * k)) for k in range(count)]
    return [
        time.strftime(pattern).replace("MS", f"{time.microsecond // 1000:03d}") for time in times
    ]


def epochs(write: Callable[[int], str], count: int = 60) -> list[str]:
    """Names by nanoseconds since 1970, 40 ms apart and through full seconds."""
    return [write(1_305_031_102_175_304_000 + 40_000_000 * k) for k in range(count)]


@pytest.mark.parametrize(
    "names",
    [
        [f"{k}.png" for k in range(N)],
        [f"frame_{99_990 + k:05d}.png" for k in range(N)],
        [f"frame{k}_2x.png" for k in range(N)],
        [f"shot{k}_cam1.png" for k in range(N)],
        [f"_cam_1_{k + 100}.png" for k in range(N)],
        [f"IMG_{k}.PNG" if k % 2 else f"img_{k}.png" for k in range(N)],
        [f"shot1.{k:04d}.png" for k in range(N)],
        [f"video--{k:03d}.png" for k in range(N)],
        [f"f_{k}.png" for k in range(-12, 12)],
        ["flag.png", *(f"flag ({k}).png" for k in range(1, N))],
        [f"frame_{k:04d}_t{40 * k}.png" for k in range(N)],
        [f"20260501_{k:06d}.png" for k in range(75)],
        [f"IMG_20260501_120000_BURST{k:03d}.png" for k in range(N)],
        [f"{(520 + 40 * k) // 1000}.{(520 + 40 * k) % 1000:03d}.png" for k in range(N)],
        [f"{round(0.04 * k, 2)}.png" for k in range(40)],
        clocked("%Y%m%d_%H%M%S_MS.png"),
        clocked("%Y-%m-%dT%H-%M-%S.MS.png"),
        clocked("PXL_%Y%m%d_%H%M%SMS.jpg"),
        clocked("%Y%m%d%H%M%S%f.jpg"),
        clocked("%H-%M-%S-MS.jpg"),
        clocked("%Y%m%d%H%M%SMS.jpg", utc(2026, 5, 1, 12, 0, 59, 520_000)),
        clocked("%Y%m%d%H%M%SMS.jpg", utc(2026, 5, 1, 23, 59, 59, 520_000)),
        clocked("cap_%H%M%S.jpg", utc(2026, 5, 1, 12, 59, 50), step=1),
        clocked("%Y-%m-%d at %I.%M.%S %p.png", utc(2026, 5, 1, 12, 59, 50), step=1),
        clocked("%Y%m%d_%H%M%S.png", utc(2026, 4, 30, 23, 59, 50), step=1),
        epochs(lambda ns: f"{ns}.png"),
        epochs(lambda ns: f"{ns // 1000}.png"),
        epochs(lambda ns: f"{ns + ns // 1000 % 9001}.png"),  # with jitter
        epochs(lambda ns: f"{ns // 10**9}.{ns % 10**9 // 1000:06d}.png"),
        epochs(lambda ns: f"{ns // 10**9}_{ns % 10**9}.png"),  # without leading zeros
    ],
    ids=lambda names: names[0],
)
def test_pictures_are_in_the_order_of_recording_one_frame_apart(names: list[str]) -> None:
    order, places, _ = placed(names)
    assert order == places == list(range(len(names)))


@pytest.mark.parametrize(
    ("names", "places"),
    [
        ([f"f_{k}.png" for k in (0, 1, 2, 5, 6, 7)], [0, 1, 2, 5, 6, 7]),
        ([f"f_{k}.png" for k in (3, 17, 18, 40)], [0, 14, 15, 37]),
        ([f"f_{k}.png" for k in (0, 40, 80, 200, 240)], [0, 1, 2, 5, 6]),
        ([f"f_{k}.png" for k in (0, 41, 79, 120, 241, 279)], [0, 1, 2, 3, 6, 7]),  # times in ms
        (
            [name for k, name in enumerate(clocked("%Y%m%d_%H%M%S_MS.png")) if k not in (11, 12)],
            [*range(11), *range(13, N)],
        ),
        (
            [
                name
                for k, name in enumerate(epochs(lambda ns: f"{ns + ns // 1000 % 9001}.png"))
                if k != 7
            ],
            [*range(7), *range(8, 60)],
        ),
    ],
)
def test_what_is_missing_between_numbers_or_times_are_missing_frames(
    names: list[str], places: list[int]
) -> None:
    assert placed(names)[:2] == (list(range(len(names))), places)


@pytest.mark.parametrize(
    ("names", "why"),
    [
        ([f"cam{c}_{k:03d}.png" for c in (1, 2) for k in range(12)], "several numbers vary"),
        ([f"cam{k % 2}_{k:03d}.png" for k in range(N)], "several numbers vary"),
        ([f"{c:06d}_{k:04d}.png" for c in (1, 2) for k in range(12)], "several numbers vary"),
        ([f"{side}_{k:03d}.png" for side in ("left", "right") for k in range(12)], "of 2 kinds"),
        (["cover.png", *(f"f_{k}.png" for k in range(N))], "of 2 kinds"),
        ([f"f_{k:04x}.png" for k in range(N)], "of 7 kinds"),
        (["1.png", "01.png", "2.png"], "the same number"),
        (["IMG_1.jpg", "IMG_1.jpeg", "IMG_2.jpg"], "the same number"),
        (["f_1.png", "f_2.png", "f_2 (1).png"], "several numbers vary"),
        ([f"f_{k}.png" for k in range(-12, -2)], "negative"),
        ([f"take{1 + k // 12}.{k % 12 + 1}.png" for k in range(N)], "several numbers vary"),
        ([f"DSC_{k:04d}.JPG" for k in (*range(1, 10), *range(9990, 10_000))], "went on counting"),
        ([f"f_{k}.png" for k in (0, 37, 91, 120, 171)], "neither one nor even"),
        (clocked("%H-%M-%S-MS.png", utc(2026, 4, 30, 23, 59, 59, 520_000)), "midnight"),
        (
            [f"20260501_120000.{k}.png" if k > 9 else f"20260501_120001.{k}.png" for k in range(N)],
            "of several lengths",
        ),
        (
            [f"cam{c}_{name}" for c in (1, 2) for name in clocked("%Y%m%d_%H%M%S_MS.png")],
            "several numbers vary",
        ),
        (
            [f"{c}_{name}" for name in clocked("%Y%m%d_%H%M%S_MS.png") for c in ("a", "b")],
            "of 2 kinds",
        ),
        (clocked("%M-%S-MS.png"), "several numbers vary"),
        (
            [f"f_{k}.png" for k in (1, 2, 3, 10**30)],
            f"{10**30 - 4} frames are missing, the first after f_3.png",
        ),
        ([f"f_{k}.png" for k in (1, 2, 3, 2**63)], "the first after f_3.png"),
        ([f"f_{k}.png" for k in (10**60, 1 + 10**60)], "longer than any count"),
    ],
    ids=lambda one: one if isinstance(one, str) else one[0],
)
def test_names_that_leave_the_order_open_are_refused(names: list[str], why: str) -> None:
    with pytest.raises(InputError, match=why) as refused:
        placed(names)
    assert refused.value.where == "folder"


def test_a_long_number_that_all_names_have_is_passed_over() -> None:
    assert placed([f"scan{10**60}_{k}.png" for k in (7, 8, 10)])[:2] == ([0, 1, 2], [0, 1, 3])


def test_the_fix_of_a_refusal_gives_the_order() -> None:
    for fixed in (
        [f"left_{k:03d}.png" for k in range(12)],
        [f"f_{k}.png" for k in range(1, 6)],
        clocked("20260430_%H%M%S_MS.png", utc(2026, 4, 30, 12, 59, 59, 520_000)),
        [f"DSC_{k:05d}.JPG" for k in range(9990, 10_010)],
    ):
        assert placed(fixed)[0] == list(range(len(fixed)))


def test_a_burst_within_a_second_is_taken_evenly_and_says_so() -> None:
    burst = [f"0107_1007{15 + k // 3}-{k % 3:02d}-m.png" for k in range(12)]
    order, places, found = placed(burst)
    assert order == places == list(range(12))
    assert [finding.kind for finding in found.findings] == ["order-by-time"]
    second = [
        "IMG_20231115_170430.png",
        "IMG_20231115_170431.png",
        "IMG_20231115_170431 (1).png",
        "IMG_20231115_170432.png",
    ]
    assert placed(second, rate=2)[0] == [0, 1, 2, 3]


def test_a_rate_unlike_the_times_in_the_names_is_reported() -> None:
    ten = clocked("IMG_%Y%m%d_%H%M%S.jpg", step=10)
    kinds = {finding.kind: finding for finding in placed(ten)[2].findings}
    assert kinds["rate-unlike-names"].value == 230
    assert "rate-unlike-names" not in {
        finding.kind for finding in placed(clocked("%Y%m%d_%H%M%S_MS.png"))[2].findings
    }


def test_names_without_numbers_are_taken_by_name_and_one_picture_as_it_is() -> None:
    order, places, found = placed(["a.png", "b.png", "c.png"])
    assert (order, places, found.findings[0].kind) == ([0, 1, 2], [0, 1, 2], "order-by-name")
    assert placed(["7.png"])[:2] == ([0], [0])
