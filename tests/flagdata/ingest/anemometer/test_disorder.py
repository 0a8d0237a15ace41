"""Rows in another order than they were logged in are sorted; a clock that was set back is still told as such."""

from __future__ import annotations

import datetime as dt
from collections.abc import Callable, Sequence

import numpy as np
import pytest

from flagdata.errors import TimeError, UsageError
from flagdata.findings import Finding, Severity
from flagdata.ingest.anemometer.instants.clock import ClockChoice
from flagdata.ingest.anemometer.instants.disorder import longest_rise, sorting, turned_about
from flagdata.rng import stream
from flagdata.signals import WindLog

Read = Callable[..., WindLog]
START = dt.datetime(2026, 5, 1)  # noqa: DTZ001
N = 300
SPEEDS = np.round(stream(8, "disorder").uniform(2, 9, N), 2)


def log(rows: Sequence[int], *, site: Callable[[int], str] | None = None) -> str:
    """The rows of a log of 10 min by their numbers, as a turbine's table has them."""
    heading = "Timestamp,Wind speed (m/s)\n" if site is None else "Turbine,Timestamp,Wind speed (m/s)\n"
    text = heading
    for row in rows:
        stamp = START + dt.timedelta(minutes=10 * row)
        text += f"{'' if site is None else site(row) + ','}{stamp},{SPEEDS[row]}\n"
    return text


def blocks(order: Sequence[int], *, size: int = 50) -> list[int]:
    return [row for block in order for row in range(block * size, (block + 1) * size)]


def told(found: WindLog, kind: str) -> Finding:
    (one,) = [finding for finding in found.findings if finding.kind == kind]
    return one


SHUFFLED = stream(9, "disorder").permutation(N).tolist()


@pytest.mark.parametrize(
    ("rows", "displaced"),
    [
        (SHUFFLED, None),
        (blocks([5, 4, 3, 2, 1, 0]), 250),
        (blocks([3, 0, 4, 1, 2, 5]), 100),
        (blocks([1, 0], size=150), 150),
        ([row for block in range(6) for row in range(block * 50 + 49, block * 50 - 1, -1)], None),
        ([*range(100), 105, *range(101, 105), 100, *range(106, N)], 2),
    ],
)
def test_rows_out_of_order_are_sorted_and_counted(read: Read, rows: list[int], displaced: int | None) -> None:
    found = read(log(rows), zone="UTC")
    assert found.series.channels["wind_speed"].tolist() == SPEEDS.tolist()
    assert set(np.diff(found.series.time)) == {600_000_000_000}
    assert not found.series.flags.any()
    finding = told(found, "rows-sorted")
    assert finding.severity is Severity.WARNING
    assert displaced in (None, finding.count)
    assert "--clock first" in (finding.fix or "")
    assert not [f for f in found.findings if f.kind in ("time-backwards", "clock-set-back", "gaps")]


def test_rows_written_twice_in_a_disordered_file_are_reported(read: Read) -> None:
    found = read(log([*SHUFFLED[:150], *SHUFFLED[40:60], *SHUFFLED[150:]]), zone="UTC")
    assert len(found.series) == N
    assert told(found, "duplicate-rows").count == 20


def test_wall_clock_rows_are_sorted_before_daylight_saving_is_told(read: Read) -> None:
    # Amsterdam, 25 October: a fixed zone's hours do not repeat, and the place's do once, here without a second pass
    found = read(log(blocks([5, 4, 3, 2, 1, 0])), zone="Europe/Amsterdam")
    assert found.series.time[0] == np.datetime64("2026-04-30T22:00", "ns").astype(np.int64)
    assert set(np.diff(found.series.time)) == {600_000_000_000}


@pytest.mark.parametrize("back", [6, 3, 30])
def test_a_clock_that_was_set_back_is_no_disorder(read: Read, back: int) -> None:
    again = iter(SPEEDS)  # the rows after the jump bring readings of their own
    lines = log([*range(150), *range(150 - back, N - back)]).splitlines()
    text = "\n".join([lines[0], *(f"{line.rpartition(',')[0]},{next(again)}" for line in lines[1:])]) + "\n"
    found = read(text, zone="UTC")
    assert told(found, "clock-set-back").value == -back * 600
    assert not [f for f in found.findings if f.kind == "rows-sorted"]


def test_the_users_word_goes_before_the_evidence(read: Read) -> None:
    rows = blocks([1, 0], size=150)
    assert told(read(log(rows), zone="UTC", clock="first"), "clock-set-back").count == 150
    # a month between two parts that were joined the wrong way round may also be a clock that was set back
    text = log(range(150, 294)) + log(range(144)).partition("\n")[2].replace("2026-05-01", "2026-04-01")
    with pytest.raises(TimeError, match="--clock sort"):
        read(text, zone="UTC")
    found = read(text, zone="UTC", clock="sort")
    assert found.series.channels["wind_speed"].tolist() == [*SPEEDS[:144], *SPEEDS[150:294]]
    assert told(found, "rows-sorted").severity is Severity.NOTE


def test_sorting_what_is_in_order_is_said_to_be_unused(read: Read) -> None:
    assert "--clock sort is not used" in told(read(log(range(N)), zone="UTC", clock="sort"), "clock-not-set").what
    with pytest.raises(UsageError, match="order in which they came"):
        read(
            "".join(f"$GPZDA,12000{s},01,05,2026,00,00\n$WIMWV,10.0,R,{3 + s % 3},M,A\n" for s in range(9)),
            clock="sort",
        )


@pytest.mark.parametrize("choice", ["first", "last", None])
def test_a_single_stamp_of_another_year_is_no_row_out_of_order(choice: ClockChoice | None) -> None:
    for place in (0, 10, 59):
        time = np.arange(60) * 600_000_000_000 + 1_777_593_600_000_000_000
        time[place] = 315_532_800_000_000_000
        assert sorting(time, choice) is None


def test_the_longest_rise_is_the_longest() -> None:
    assert longest_rise(np.array([3, 1, 2, 9, 4, 5])).tolist() == [1, 2, 4, 5]


UNEVEN = np.cumsum(stream(10, "disorder").integers(1, 9, N)).tolist()
"""Minutes of rows that come when something happens: sorted or not, their steps differ from the usual one."""
GAPPY = [row + 4 * (row // 10) for row in range(N)]
"""Minutes of rows with an interval behind every tenth."""


def at_minutes(minutes: Sequence[int], rows: Sequence[int]) -> str:
    lines = [f"{START + dt.timedelta(minutes=minutes[row])},{SPEEDS[row]}\n" for row in rows]
    return "Timestamp,Wind speed (m/s)\n" + "".join(lines)


def moved(first: int, count: int, to: int) -> list[int]:
    rows = [row for row in range(N) if not first <= row < first + count]
    return [*rows[:to], *range(first, first + count), *rows[to:]]


@pytest.mark.parametrize(
    ("minutes", "rows", "kind"),
    [
        (UNEVEN, moved(100, 1, 104), "time-backwards"),
        (UNEVEN, moved(100, 8, 130), "time-backwards"),
        (UNEVEN, moved(100, 40, 160), "clock-set-back"),
        (UNEVEN, moved(200, 30, 100), "clock-set-back"),
        (GAPPY, moved(100, 3, 105), "time-backwards"),
        (GAPPY, blocks([0, 3, 1, 2, 4, 5]), "clock-set-back"),
    ],
)
def test_blocks_that_sorting_would_put_in_their_place_are_left_to_the_user(
    minutes: list[int], rows: list[int], kind: str, read: Read
) -> None:
    text = at_minutes(minutes, rows)
    finding = told(read(text, zone="UTC"), kind)
    assert "--clock sort" in (finding.fix or "")
    found = read(text, zone="UTC", clock="sort")
    assert found.series.channels["wind_speed"].tolist() == SPEEDS.tolist()
    assert ((found.series.time - found.series.time[0]) // 60_000_000_000).tolist() == [
        minute - minutes[0] for minute in minutes
    ]


@pytest.mark.parametrize("size", [-7, -30, -61])
def test_sorting_is_not_offered_where_a_clock_was_set_back(size: int, read: Read) -> None:
    minutes = [minute + (size if row >= 150 else 0) for row, minute in enumerate(UNEVEN)]
    found = read(at_minutes(minutes, range(N)), zone="UTC")
    assert not [f for f in found.findings if "--clock sort" in (f.fix or "")]


def test_sorting_is_not_offered_for_a_stamp_far_from_all_others(read: Read) -> None:
    minutes = [minute if row != 150 else -600_000 for row, minute in enumerate(UNEVEN)]
    finding = told(read(at_minutes(minutes, range(N)), zone="UTC"), "time-backwards")
    assert finding.fix is None


def test_many_of_few_rows_out_of_order_are_not_left_out_but_the_way_to_sort_them_is_told(read: Read) -> None:
    seconds = (100, 140, 180, 330, 370, 540, 550, 570, 220, 260, 410, 450, 490, 530, 590, 780, 30, 830, 70, 110)
    rows = "".join(f"2026-05-01 11:{s // 60:02d}:{s % 60:02d},{3 + at % 5}.5\n" for at, s in enumerate(seconds))
    text = f"time,wind speed (m/s)\n{rows}"
    with pytest.raises(TimeError, match="8 rows would have to go") as caught:
        read(text, zone="UTC")
    assert "--clock sort" in caught.value.fix
    assert "from 2026-05-01T11:13:50Z to 2026-05-01T11:01:10Z" in caught.value.what  # the latest row before it
    assert "--clock first" in caught.value.fix
    found = read(text, zone="UTC", clock="sort")
    assert len(found.series.time) == len(seconds)
    assert bool((np.diff(found.series.time) > 0).all())


def test_a_word_on_the_clock_is_offered_only_where_it_would_have_the_rows_read(read: Read) -> None:
    """So many steps back are of no clock that was set."""
    seconds = np.cumsum([17, 61, 23, 140, 9, 88, 35, 201, 47, 12] * 4)[np.argsort((7 * np.arange(40)) % 41)]
    rows = "".join(
        f"2026-05-01 {s // 3600:02d}:{s // 60 % 60:02d}:{s % 60:02d},{3 + at % 5}.5\n" for at, s in enumerate(seconds)
    )
    text = f"time,wind speed (m/s)\n{rows}"
    for clock in (None, "first"):
        with pytest.raises(TimeError, match="rows would have to go") as caught:
            read(text, zone="UTC", clock=clock)
        assert "--clock first" not in caught.value.fix
        assert caught.value.fix.startswith("if all stamps are right and only the rows are out of order: --clock sort")
        assert "split" not in caught.value.fix
    assert len(read(text, zone="UTC", clock="sort").series.time) == 40


@pytest.mark.parametrize(
    ("before", "after", "turned"),
    [
        ("2020-12-01T20:00", "2020-01-12T21:00", True), ("2020-01-31T23:00", "2020-01-02T00:00", True),
        ("2020-01-31T23:00", "2020-01-20T00:00", False),
        ("2020-03-10T12:00", "2020-03-10T11:00", False), ("2020-03-10T12:00", "2019-03-10T12:00", False),
    ],
)  # fmt: skip
def test_stamps_follow_once_day_and_month_are_turned_about(before: str, after: str, turned: bool) -> None:
    first, second = (int(np.datetime64(text, "ns").astype(np.int64)) for text in (before, after))
    assert turned_about(first, second) == turned
