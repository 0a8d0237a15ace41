"""Tables of observables of any spacing, unit and clock, as recordings."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from flagdata.align import given
from flagdata.core.rng import stream
from flagdata.core.stated import parse
from flagdata.errors import InputError, UnknownNameError, UsageError
from flagdata.record.signals import Sensor, WindSeries
from flagdata.timebase import NANOSECONDS
from measure.cloth import OBSERVED, Observed, constant_wind, of_table
from measure.cloth.table_clock import declared_clock, estimated_clock
from measure.cloth.tables_of_observables import Beside, rows_of
from measure.cloth.tables_of_observables import read_table as read
from measure.film import FlagSize

SIZE = FlagSize(length=2.0, height=0.5)
START = 1_780_000_000


def _write(path: Path, heading: str, rows: list[list[float | str]], *, comma: str = ",") -> Path:
    path.write_text("\n".join([heading, *(comma.join(map(str, row)) for row in rows)]) + "\n")
    return path


def _one(path: Path, **options: Beside) -> Observed:
    (found,) = of_table(path, SIZE, **options)
    return found


def _column(found: Observed, name: str) -> list[float]:
    return found.readings[:, OBSERVED.index(name)].tolist()


def test_rows_of_half_a_second_are_averaged_into_windows_and_deviations_in_squares(
    tmp_path: Path,
) -> None:
    """Window k has the rows 5k … 5k + 4."""
    rows: list[list[float | str]] = [
        [0.25 + 0.5 * n, 5.0, 0.1 * (n // 5) + 0.01 * (n % 5), 3.0 if n % 5 else 1.0]
        for n in range(60)
    ]
    found = _one(_write(tmp_path / "t.csv", "time,wind,droop,amplitude-up", rows))
    assert _column(found, "droop") == pytest.approx([0.1 * k + 0.02 for k in range(12)])
    assert _column(found, "amplitude-up") == pytest.approx([math.sqrt((1 + 4 * 9) / 5)] * 12)
    assert [one.kind for one in found.findings] == ["short-rows"]


def test_rows_of_ten_seconds_are_longer_windows(tmp_path: Path) -> None:
    rows: list[list[float | str]] = [[5.0 + 10 * n, 4.0 + n, 0.1 * n] for n in range(5)]
    found = _one(_write(tmp_path / "t.csv", "time,wind,droop", rows))
    assert _column(found, "droop") == pytest.approx(
        np.repeat([0.0, 0.1, 0.2, 0.3, 0.4], 4).tolist()
    )
    assert found.duration == 50.0
    assert found.log.averaging == 10.0


def test_a_window_that_rows_hardly_cover_has_no_value_and_the_others_are_where_they_were(
    tmp_path: Path,
) -> None:
    rows: list[list[float | str]] = [[0.5 + n, 5.0, n] for n in range(30) if not 10 <= n < 14]
    found = _one(_write(tmp_path / "t.csv", "time,wind,frequency", rows))
    own = _column(found, "frequency")
    assert [math.isnan(value) for value in own] == [k in (4, 5) for k in range(12)]
    assert own[6] == pytest.approx((15 + 16 + 17 / 2) / 2.5)


@pytest.mark.parametrize(
    ("heading", "factor"),
    [
        ("droop [deg]", math.pi / 180),
        ("droop (°)", math.pi / 180),
        ("Droop", 1.0),
        ("amplitude_up [cm]", 0.01 / 0.5),
        ("middle speed [km/h]", 1 / 3.6 / 2.0),
        ("extension [%]", 0.01),
        ("frequency / Hz", 1.0),
        ("extension [m]", 1 / 2.0),
    ],
)
def test_a_unit_in_a_heading_is_converted(tmp_path: Path, heading: str, factor: float) -> None:
    """Of a flag of 2 m by 0.5 m: amplitudes are counted in heights, speeds and extensions in
    lengths."""
    rows: list[list[float | str]] = [[2500.0 * n, 18.0, 3.0] for n in range(12)]
    found = _one(_write(tmp_path / "t.csv", f"time [ms],wind [km/h],{heading}", rows))
    name = (
        heading.split(" [")[0]
        .split(" (")[0]
        .split(" /")[0]
        .lower()
        .replace("_", "-")
        .replace(" ", "-")
    )
    assert _column(found, name) == pytest.approx([3.0 * factor] * 12)
    assert found.speed == pytest.approx(5.0)


def test_semicolons_decimal_commas_and_stamps_are_read(tmp_path: Path) -> None:
    rows: list[list[float | str]] = [
        [f"2026-05-01T12:00:{2.5 * n:04.1f}Z", "5,5", f"0,{n + 10}", "0,02"] for n in range(12)
    ]
    path = _write(tmp_path / "t.csv", "time;wind;droop;droop-sigma [deg]", rows, comma=";")
    found = _one(path)
    assert found.speed == pytest.approx(5.5)
    assert _column(found, "droop")[:2] == pytest.approx([0.10, 0.11])
    assert found.sigma[0] == pytest.approx(math.radians(0.02))
    assert read(path, SIZE).origin == 1_777_636_800 * NANOSECONDS


def test_rows_against_wind_are_recordings_of_one_place_each_in_its_own_wind(tmp_path: Path) -> None:
    rows: list[list[float | str]] = [
        [4.0, 60, 24.0, 2.0],
        [6.0, 25, 13.0, 1.0],
        [10.0, 20, 7.0, ""],
    ]
    found = of_table(
        _write(tmp_path / "t.csv", "wind,duration,droop [deg],droop-sigma [deg]", rows), SIZE
    )
    assert [one.speed.tolist() for one in found] == [[4.0] * 16, [6.0] * 10, [10.0] * 8]
    assert [_column(one, "droop")[-1] for one in found] == pytest.approx(
        [math.radians(d) for d in (24, 13, 7)]
    )
    assert [float(one.sigma[0]) for one in found] == pytest.approx(
        [math.radians(d) for d in (2, 1, 0)]
    )
    assert len({one.place for one in found}) == 1
    assert len({one.source for one in found}) == 3
    # Three steady winds are not one.
    assert constant_wind(found) == ()
    assert constant_wind(found[:1])[0].kind == "constant-wind"
    counted = of_table(_write(tmp_path / "c.csv", "wind,count,droop", [[4.0, 9, 0.3]]), SIZE)
    assert counted[0].duration == 22.5


_TEN = [[2.5 * n, 5.0, 0.3] for n in range(10)]


@pytest.mark.parametrize(
    ("heading", "rows", "said"),
    [
        ("time,wind,droop,colour", [[*row, 1] for row in _TEN], "columns colour are not known"),
        ("time,droop,frequency", _TEN, "no column wind"),
        ("time,wind,asymmetry", _TEN, "no column is an observable"),
        ("time,wind,droop [Hz]", _TEN, "the unit Hz of droop, which is in rad"),
        ("time,wind,middle-speed [m]", _TEN, "the unit m of middle-speed, which is in 1/s"),
        ("time,wind,droop [bananas]", _TEN, "bananas"),
        ("time,wind,droop", [*_TEN, _TEN[0]], "a time that is not after the one before it"),
        ("time,wind,droop", [*_TEN, ["", 5.0, 0.3]], "rows without a time"),
        ("time,wind,droop", [*_TEN, [25.0, 5.0, "much"]], "'much' is no number"),
        ("time,wind,droop,Droop [deg]", [[*row, 1] for row in _TEN], "columns droop stand twice"),
        ("time,wind,droop,duration", [[*row, 1] for row in _TEN], "columns time and duration"),
        ("wind,droop,extension", _TEN, "rows against wind with no column duration and count"),
        ("wind,duration,droop", [[5.0, 7.5, 0.3]], "a row lasts 7.5 s in a wind of 5 m/s"),
        ("wind,duration,droop", [[0.0, 60.0, 0.3]], "a row lasts 60 s in a wind of 0 m/s"),
    ],
)
def test_what_does_not_say_what_its_rows_are_of_is_refused(
    tmp_path: Path, heading: str, rows: list[list[float | str]], said: str
) -> None:
    with pytest.raises((InputError, UnknownNameError)) as caught:
        of_table(_write(tmp_path / "t.csv", heading, rows), SIZE)
    assert said in str(caught.value)


def _gusts(seconds: int) -> tuple[np.ndarray, np.ndarray]:
    """Times [s] and a wind of random gusts of some seconds, 10 values a second."""
    rng = stream(7, "tests", "beside")
    times = np.arange(10 * seconds) / 10
    wander = np.convolve(rng.standard_normal(len(times) + 60), np.hanning(61), mode="valid")
    return times, 6.0 + wander / wander.std()


def _series(times: np.ndarray, speed: np.ndarray) -> WindSeries:
    return WindSeries(
        time=np.round((START + times) * NANOSECONDS).astype(np.int64),
        channels={"wind_speed": speed},
        flags=np.zeros(len(times), dtype=np.uint16),
        sensor=Sensor(name="sonic", averaging=0.0, distance_constant=0.0),
    )


@pytest.mark.parametrize("spacing", [0.2, 2.5])
def test_a_table_whose_clock_is_off_is_joined_by_what_follows_the_wind(
    tmp_path: Path, spacing: float
) -> None:
    """The droop falls with the wind that blew 0.3 s before; the table's clock is 11.4 s behind the
    log's."""
    times, speed = _gusts(1200)
    at = np.arange(20.0, 1100.0, spacing)
    smooth = np.array(
        [speed[(times >= t - spacing / 2) & (times < t + spacing / 2)].mean() for t in at - 0.3]
    )
    rows: list[list[float | str]] = [
        [START + t - 11.4, 1.2 - 0.1 * u] for t, u in zip(at.tolist(), smooth.tolist(), strict=True)
    ]
    table = rows_of(_write(tmp_path / "t.csv", "time,droop", rows), SIZE)
    (segment,) = estimated_clock(
        table, _series(times, speed), names=("log", "t"), seed="x"
    ).segments
    assert segment.offset == pytest.approx(11.4, abs=0.1)
    assert abs(segment.offset - 11.4) < 2 * segment.sigma_offset < 0.6


def test_a_log_beside_a_table_is_on_its_clock_with_the_offsets_uncertainty(tmp_path: Path) -> None:
    times = np.arange(0.0, 60.0, 0.1)
    rows: list[list[float | str]] = [[START + 5.0 + 0.5 * n, 0.3] for n in range(60)]
    path = _write(tmp_path / "t.csv", "time,droop", rows)
    clock = declared_clock(rows_of(path, SIZE), parse("2.0±0.25"), names=("log", "t"))
    found = _one(path, wind_log=Beside(series=_series(times, 5.0 + times / 10), clock=clock))
    # The first row's span begins at 4.75 s of the table's clock, which is 6.75 s of the log's.
    assert found.speed[0] == pytest.approx(5.0 + (6.75 + 1.25) / 10, abs=0.01)
    assert found.log.clock == pytest.approx(0.25, rel=1e-3)
    assert found.log.moved(1.0).cut(2.5, 20.0).clock == found.log.clock
    assert found.log.moved(1.0).mean_speed(np.array([1.0]), np.array([2.0])) == pytest.approx(
        found.log.mean_speed(np.array([0.0]), np.array([1.0]))
    )
    with pytest.raises(UsageError, match=r"as in 0\.3±0\.1"):
        declared_clock(rows_of(path, SIZE), parse("2.0"), names=("log", "t"))
    own = _write(
        tmp_path / "own.csv", "time,wind,droop", [[START + 2.5 * n, 5.0, 0.3] for n in range(10)]
    )
    with pytest.raises(InputError, match="in one of them"):
        _one(
            own,
            wind_log=Beside(
                series=_series(times, times),
                clock=given("a", "b", start=0, end=9, offset=0, sigma=1),
            ),
        )
