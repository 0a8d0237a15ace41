"""Order and quality: what is wrong with samples is found where it is, and only there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from flagdata.dataset.truth import TruthSeries
from flagdata.errors import InputError, UsageError
from flagdata.findings import Severity
from flagdata.ingest.anemometer.reading import Reading
from flagdata.ingest.anemometer.recipe import QualityRules
from flagdata.ingest.anemometer.samples import quality, zero
from flagdata.ingest.anemometer.samples.order import in_order
from flagdata.rng import stream
from flagdata.schema import SampleFlag
from flagdata.signals import Sensor, WindLog, WindSeries

S = 1_000_000_000
T0 = 1_777_636_800 * S
Read = Callable[..., WindLog]


def reading(
    time: object, *, step: int = 1, rules: QualityRules | None = None, sensor: Sensor | None = None, **channels: object
) -> Reading:
    at = np.asarray(time, dtype=np.int64)
    return Reading(
        time=at,
        channels={name: np.asarray(v, dtype=np.float64) for name, v in channels.items()},
        flags=np.zeros(len(at), dtype=np.uint16),
        line=np.arange(2, len(at) + 2),
        sensor=sensor or Sensor(name="test"),
        step=step,
        rules=rules or QualityRules(),
    )


def kinds(found: Sequence[object]) -> list[str]:
    return [f.kind for f in found]  # type: ignore[attr-defined]


def gusts(n: int, *, rate: float = 10, decimals: int = 2) -> np.ndarray:
    """Positive, autocorrelated and rounded, as an instrument shows wind."""
    noise = stream(5, "gusts").normal(0, 1, n)
    smooth = np.convolve(noise, np.ones(round(rate)) / np.sqrt(rate), mode="same")
    return np.round(6 + smooth, decimals)


@pytest.mark.parametrize("decimals", [0, 1, 2])
def test_wind_that_is_only_coarsely_shown_is_not_stale(decimals: int) -> None:
    n = 20_000
    flags, found = quality.stale(reading(T0 + np.arange(n) * (S // 10), wind_speed=gusts(n, decimals=decimals)))
    # repeats by chance are flagged with a probability of about 1e-3 a log: none in this one
    assert not flags.any()
    assert found == ()


@pytest.mark.parametrize("length", [60, 600])
def test_a_frozen_reading_is_stale_from_its_second_row(length: int) -> None:
    speed = gusts(5000)
    speed[1000 : 1000 + length] = 7.77
    flags, found = quality.stale(reading(T0 + np.arange(5000) * (S // 10), wind_speed=speed))
    assert np.flatnonzero(flags).tolist() == list(range(1001, 1000 + length))
    assert found[0].value == pytest.approx((length - 1) / 10)
    assert found[0].count == length - 1


def test_a_moving_direction_shows_that_a_steady_speed_is_not_stale() -> None:
    n = 2000
    direction = stream(6, "direction").uniform(0, 6, n)
    log = reading(T0 + np.arange(n) * S, wind_speed=np.full(n, 3.0), wind_direction=direction)
    assert not quality.stale(log)[0].any()


@pytest.mark.parametrize("changing", [0, 5, 20])
def test_a_sensor_frozen_for_all_or_most_of_a_log_is_stale(changing: int) -> None:
    n = 200
    speed = np.concatenate([gusts(20)[:changing], np.full(n - changing, 4.0)])
    log = reading(T0 + np.arange(n) * S, wind_speed=speed, wind_direction=np.full(n, 4.7))
    flags, found = quality.stale(log)
    assert np.flatnonzero(flags).tolist() == list(range(changing + 1, n))
    assert kinds(found) == ["stale-repeats"]
    assert found[0].value == pytest.approx(n - changing - 1)
    assert "wind_speed and wind_direction" in found[0].what


def test_a_fast_log_that_stands_for_less_than_a_minute_is_judged_by_chance_alone() -> None:
    # 50 s of 203 Hz at one value, as an idle sensor shows, and nothing else to compare with
    log = reading(T0 + np.arange(10_000) * (S // 200), wind_speed=np.full(10_000, 3.0))
    assert not quality.stale(log)[0].any()


def test_calm_is_not_stale() -> None:
    log = reading(T0 + np.arange(300) * S, wind_speed=np.zeros(300))
    flags, found = quality.dead_zone(log)
    assert kinds(found) == ["dead-zone"]
    assert not quality.stale(log.with_findings((), flags=flags))[0].any()


@pytest.mark.parametrize(("interval", "resolution"), [(1.0, 0.1), (1.0, 0.5), (60.0, 0.1), (600.0, 0.5), (0.05, 0.01)])
def test_light_wind_of_the_night_is_not_stale_beside_the_gusts_of_the_day(interval: float, resolution: float) -> None:
    """Gusts of 20 % with a memory of 5 s about a mean of 1.2 m/s at night and up to 5.2 m/s by day."""
    n = 20_000
    rho = np.exp(-interval / 5)
    noise = stream(11, "night", round(interval * 100)).normal(0, np.sqrt(1 - rho**2), n)
    gust = lfilter([1.0], [1.0, -rho], noise)
    mean = 1.2 + 4 * np.clip(np.sin(2 * np.pi * np.arange(n) / n), 0, None)
    speed = np.round(mean * (1 + 0.2 * gust) / resolution) * resolution
    flags, _ = quality.stale(reading(T0 + np.arange(n) * round(interval * S), wind_speed=np.abs(speed)))
    # runs of a light wind are correlated, which the bound leaves out: a few rows of 20,000 may be taken for stale
    assert int((flags != 0).sum()) < 100


def test_a_frozen_reading_is_stale_though_another_kind_of_wind_goes_on_between() -> None:
    n = 2000
    relative, theoretical = gusts(n), gusts(n) + 1
    relative[500:600] = 9.99
    both = {name: np.full(2 * n, np.nan) for name in ("apparent_wind_speed", "theoretical_wind_speed")}
    both["apparent_wind_speed"][::2], both["theoretical_wind_speed"][1::2] = relative, theoretical
    flags, found = quality.stale(reading(T0 + np.arange(2 * n) * (S // 10), **both))
    assert np.flatnonzero(flags).tolist() == list(range(1002, 1200, 2))
    assert [f.count for f in found] == [99]


def test_a_recipe_may_say_how_long_a_reading_may_stand() -> None:
    speed = [3.0] * 30 + [4.0, 5.0] * 10
    log = reading(T0 + np.arange(50) * S, wind_speed=speed, rules=QualityRules(stale_after=60))
    assert not quality.stale(log)[0].any()
    log = reading(T0 + np.arange(50) * S, wind_speed=speed, rules=QualityRules(stale_after=10))
    assert int((quality.stale(log)[0] != 0).sum()) == 29


def test_jitter_of_stamps_is_no_gap_and_a_dropout_is() -> None:
    step = stream(7, "jitter").uniform(4e6, 6e6, 2000)
    time = T0 + np.cumsum(step).astype(np.int64)
    assert quality.gaps(reading(time, wind_speed=np.ones(2000))) == ()
    time[1000:] += 433_000_000
    found = quality.gaps(reading(time, wind_speed=np.ones(2000)))
    assert (found[0].count, found[0].where) == (1, "line 1002")
    assert found[0].value == pytest.approx(0.438, abs=0.0011)


def test_one_sample_lost_of_a_steady_log_is_a_gap() -> None:
    time = np.delete(T0 + np.arange(100) * S, 50)
    assert quality.gaps(reading(time, wind_speed=np.ones(99)))[0].value == pytest.approx(2.0)


def test_a_gap_tells_its_interval_apart_from_the_time_lost_in_it() -> None:
    time = T0 + S * np.array([0, 1, 2, 3, 11, 12, 13, 14])
    (gap,) = quality.gaps(reading(time, wind_speed=np.ones(8)))
    assert gap.what == (
        "1 interval longer than the usual 1 s, 7.000 s lost in all; "
        "the longest interval, 8.000 s, ends at the line named"
    )


@pytest.mark.parametrize("offset", [-0.35, 0.2])
def test_the_zero_offset_of_an_idle_stretch_is_found_within_its_resolution(offset: float) -> None:
    idle = np.round(offset + stream(8, "idle").normal(0, 0.005, 3000), 2)
    speed = np.concatenate([idle, offset + gusts(3000)])
    found = zero.estimate(T0 + np.arange(6000) * (S // 100), speed)
    assert found is not None
    assert found.offset == pytest.approx(offset, abs=0.01)
    # the gusts may pass through the idle band for moments, no more
    assert int(found.idle.sum()) == pytest.approx(3000, abs=10)
    assert found.seconds == pytest.approx(30, abs=2)


def test_steady_wind_is_no_zero_offset() -> None:
    speed = np.round(8 + stream(9, "steady").normal(0, 0.005, 3000), 2)
    assert zero.estimate(T0 + np.arange(3000) * (S // 100), speed) is None


def test_a_log_that_is_never_idle_shows_no_zero_offset() -> None:
    assert zero.estimate(T0 + np.arange(6000) * (S // 100), gusts(6000) - 5.5) is None


def test_a_zero_offset_is_reported_but_not_applied_unless_asked() -> None:
    speed = np.concatenate([np.full(2000, 0.3), gusts(2000)])
    log = reading(T0 + np.arange(4000) * (S // 100), wind_speed=speed)
    told = zero.settle(log, "report")
    assert told.channels["wind_speed"].tolist() == speed.tolist()
    assert [f.value for f in told.findings if f.kind == "zero-offset"] == [pytest.approx(0.3)]
    done = zero.settle(log, "estimate")
    assert done.channels["wind_speed"] == pytest.approx(speed - 0.3)
    assert bool(np.all(done.flags[:2000] == SampleFlag.DEAD_ZONE))


def test_the_least_speed_of_a_coarse_instrument_stays_as_calm_air_does() -> None:
    steps = stream(6, "coarse").integers(0, 8, 400)
    speed = 0.447 * np.concatenate([steps, np.ones(40), steps])
    least, higher = (
        quality.stale(replace(idle_then_gusts(0.0), time=np.arange(len(speed)) * 10**9, line=np.arange(len(speed)),
                              flags=np.zeros(len(speed), dtype=np.uint16), channels={"wind_speed": values}))
        for values in (speed, np.where(np.arange(len(speed)) // 40 == 10, 5 * speed, speed))
    )  # fmt: skip
    assert least[1] == ()
    assert [found.kind for found in higher[1]] == ["stale-repeats"]


def test_a_steady_breeze_below_which_the_wind_often_falls_is_no_calm_air() -> None:
    steady = np.round(0.7 + stream(8, "steady").normal(0, 0.005, 3000), 2)
    speed = np.concatenate([steady, np.abs(gusts(3000) - np.median(gusts(3000)))])
    assert np.mean(speed < 0.6) > 0.1
    assert zero.estimate(np.arange(6000) * 10_000_000, speed) is None


def idle_then_gusts(offset: float) -> Reading:
    """20 s idle at `offset`, then gusts that begin 0.4 m/s above it; a hundred rows a second."""
    speed = np.concatenate([np.full(2000, offset), [offset + 0.4], offset + gusts(1999)])
    return reading(T0 + np.arange(4000) * (S // 100), wind_speed=speed)


@pytest.mark.parametrize("choice", [-0.35, -0.34, "estimate"])
def test_a_zero_offset_that_was_subtracted_is_no_warning(choice: float | str) -> None:
    done = zero.settle(idle_then_gusts(-0.35), choice)  # type: ignore[arg-type]
    (about,) = [f for f in done.findings if f.kind == "zero-offset"]
    assert about.severity is Severity.NOTE
    assert about.fix is None
    assert "not subtracted" not in about.what
    assert about.value == pytest.approx(-0.35)


def test_a_zero_offset_that_the_one_given_does_not_settle_is_said_with_what_is_left() -> None:
    done = zero.settle(idle_then_gusts(-0.35), -0.1)
    (about,) = [f for f in done.findings if f.kind == "zero-offset"]
    assert about.severity is Severity.WARNING
    assert "-0.250 m/s in calm air" in about.what


@pytest.mark.parametrize("choice", [-0.35, "estimate"])
def test_the_jump_out_of_a_calm_is_the_threshold_of_a_sensor_that_states_none(choice: float | str) -> None:
    done = zero.settle(idle_then_gusts(-0.35), choice)  # type: ignore[arg-type]
    assert done.sensor.threshold == pytest.approx(0.4)
    # a minute of such a calm may hide anything below the jump: a rectangular 0 to 0.4 m/s
    calm = done.take(np.arange(2000))
    sensor = replace(calm.sensor, accuracy=0.0)
    series = WindSeries(time=calm.time, channels=calm.channels, flags=calm.flags, sensor=sensor)
    assert TruthSeries.of(series).before(int(calm.time[-1])).sigma_sensor == pytest.approx(0.4 / np.sqrt(3))


def test_a_threshold_that_the_recipe_states_stays() -> None:
    log = replace(idle_then_gusts(-0.35), sensor=Sensor(name="cup", threshold=0.6))
    assert zero.settle(log, "estimate").sensor.threshold == 0.6


def test_a_calm_that_still_reads_below_zero_gives_no_threshold() -> None:
    assert zero.settle(idle_then_gusts(-0.35), "report").sensor.threshold is None


def test_a_flutter_well_below_the_nyquist_limit_is_not_flagged() -> None:
    rules = QualityRules(frame_rate_of=("flutter_frequency",))
    frequency = np.tile([4.0, 4.333, 4.667, 5.0], 50)
    log = reading(T0 + np.arange(200) * (S // 30), flutter_frequency=frequency, rules=rules)
    assert not quality.at_nyquist(log)[0].any()


def test_a_flutter_beside_the_nyquist_limit_is_flagged_with_its_alias() -> None:
    # at 60 frames a second: 29.5 Hz cannot be told from 60 - 29.5 = 30.5 Hz or 89.5 Hz
    rules = QualityRules(frame_rate_of=("flutter_frequency",))
    frequency = np.where(np.arange(300) < 200, 6.0, 29.5)
    log = reading(T0 + np.arange(300) * (S // 60), flutter_frequency=frequency, rules=rules)
    flags, found = quality.at_nyquist(log)
    assert np.flatnonzero(flags).tolist() == list(range(200, 300))
    assert "30.5 or 89.5 Hz" in found[0].what


def test_rows_of_one_stamp_are_spread_over_its_step() -> None:
    # four a second, the log begins with the last two of a second and ends with the first of another
    stamps = T0 + S * np.array([0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3])
    log = in_order(reading(stamps, step=S, wind_speed=np.arange(11.0)), where="x")
    quarter = S // 4
    assert (log.time - T0).tolist() == [quarter * k for k in (2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12)]
    assert bool(np.all(log.flags == SampleFlag.TIME_UNSURE))


def test_order_is_kept_and_nothing_lost_when_rows_come_a_little_late() -> None:
    time = T0 + S * np.array([0, 1, 3, 2, 4])
    log = in_order(reading(time, wind_speed=[0.0, 1.0, 3.0, 2.0, 4.0]), where="x")
    assert log.channels["wind_speed"].tolist() == [0, 1, 2, 3, 4]
    assert log.flags.tolist() == [0, 0, SampleFlag.TIME_UNSURE, 0, 0]


def test_the_fewest_possible_rows_are_left_out_for_wild_stamps() -> None:
    time = T0 + S * np.arange(100)
    time[[20, 50, 51]] += np.array([10**6, -(10**6), -(10**6)]) * S
    log = in_order(reading(time, wind_speed=np.arange(100.0)), where="x")
    assert sorted(set(range(100)) - set(log.channels["wind_speed"].astype(int))) == [20, 50, 51]
    assert [f.count for f in log.findings if f.kind == "time-backwards"] == [3]


@pytest.mark.parametrize("offset", [0.1, "estimate"])
def test_a_zero_offset_of_what_has_no_speed_is_refused(read: Read, offset: float | str) -> None:
    head = '"TOA5","a"\r\n"TIMESTAMP","Ux","Uy"\r\n"TS","m/s","m/s"\r\n"","",""\r\n'
    with pytest.raises(UsageError, match="components"):
        read(head + '"2026-05-01 12:00:00",3,4\r\n', zone="UTC", zero_offset=offset)


def test_an_azimuth_for_a_vane_is_refused(read: Read) -> None:
    text = "time,wind_speed,wind_direction\n2026-05-01T12:00:00Z,3,90\n"
    with pytest.raises(UsageError, match="rotation"):
        read(text, azimuth=1.0)


def test_a_zone_that_the_stamps_do_not_need_is_said(read: Read) -> None:
    log = read("time,wind_speed\n2026-05-01T12:00:00Z,3\n", zone="+02:00")
    assert [f.kind for f in log.findings] == ["zone-not-needed"]
    assert log.series.time.tolist() == [T0]


def test_sonic_components_give_speed_and_direction(read: Read) -> None:
    head = (
        '"TOA5","a","b","c","d","e","f","g"\r\n"TIMESTAMP","RECORD","Ux","Uy","Uz"\r\n'
        '"TS","RN","m/s","m/s","m/s"\r\n"","","","",""\r\n'
    )
    rows = '"2026-05-01 12:00:00",0,3,4,0\r\n"2026-05-01 12:00:00.1",1,5,0,0\r\n'
    # the array points east (90°): wind along +x comes from east; y is to the left of x, so wind along +y comes from
    # 90° less
    log = read(head + rows, zone="UTC", azimuth=np.pi / 2)
    assert log.series.channels["wind_speed"] == pytest.approx([5.0, 5.0])
    assert np.degrees(log.series.channels["wind_direction"]) == pytest.approx([90 - 53.130102, 90.0])


@pytest.mark.parametrize(
    ("header", "row", "why"),
    [
        ("wind_speed", "", "200 missing"),
        ("wind_speed,wind_direction", ",270", "200 missing"),
        ("wind_speed", "1e30", "200 out of range"),
        ("wind_speed", "-0.3", "200 out of range"),
    ],
)
def test_a_log_without_one_usable_wind_is_refused(read: Read, header: str, row: str, why: str) -> None:
    rows = "".join(f"2026-05-01T12:{i // 60:02d}:{i % 60:02d}Z,{row}\n" for i in range(200))
    with pytest.raises(
        InputError, match=rf"nothing to measure: not one value of the wind in 200 rows .*\({why}\)"
    ) as caught:
        read(f"time,{header}\n{rows}")
    assert caught.value.fix


def test_a_log_without_one_usable_wind_is_kept_for_what_else_it_measured(read: Read) -> None:
    rows = "".join(f"2026-05-01T12:{i // 60:02d}:{i % 60:02d}Z,,{20 + i % 3}\n" for i in range(200))
    log = read(f"time,wind_speed,air_temperature\n{rows}")
    (finding,) = [f for f in log.findings if f.kind == "no-usable-wind"]
    assert (finding.severity, finding.count) == (Severity.ERROR, 200)
    assert "air_temperature" in finding.what


@pytest.mark.parametrize(
    ("speed", "direction", "says"),
    [
        (gusts(40), np.zeros(40), "a vane that is stuck"),
        (np.zeros(40), np.zeros(40), "columns that were never filled"),
        (gusts(40), np.linspace(0, 1, 40), ""),
        (np.full(40, 3.0), np.ones(40), ""),  # `stale` tells readings that repeat
        (gusts(12), np.zeros(12), ""),  # a short log may hold one direction
    ],
)
def test_a_direction_that_stays_while_the_speed_varies_is_told(
    speed: np.ndarray, direction: np.ndarray, says: str
) -> None:
    log = reading(T0 + np.arange(len(speed)) * 60 * S, wind_speed=speed, wind_direction=direction)
    _, found = quality.one_direction(log)
    assert kinds(found) == (["direction-stays"] if says else [])
    assert says in " ".join(one.what for one in found)
