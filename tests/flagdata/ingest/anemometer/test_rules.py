"""The rules of quality: what is wrong with samples is found where it is, and only there."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.signal import lfilter

from flagdata.core.findings import Severity
from flagdata.core.rng import stream
from flagdata.core.schema import SampleFlag
from flagdata.dataset import TruthSeries
from flagdata.errors import InputError, UsageError
from flagdata.ingest import QualityRules, Reading
from flagdata.ingest.anemometer import average
from flagdata.ingest.anemometer.samples import rules, zero
from flagdata.record.signals import Sensor, WindLog, WindSeries
from tests.flagdata.ingest.anemometer.conftest import made, read

S = 1_000_000_000
T0 = 1_777_636_800 * S


def kinds(found: Reading | WindLog) -> list[str]:
    return [one.kind for one in found.findings]


def flagged(found: Reading) -> list[int]:
    return np.flatnonzero(found.flags).tolist()


def gusts(n: int, *, rate: float = 10, decimals: int = 2) -> np.ndarray:
    """Positive, autocorrelated and rounded, as an instrument shows wind."""
    noise = stream(5, "gusts").normal(0, 1, n)
    smooth = np.convolve(noise, np.ones(round(rate)) / np.sqrt(rate), mode="same")
    return np.round(6 + smooth, decimals)


COARSE = 0.447 * np.concatenate(
    [stream(6, "coarse").integers(0, 8, 400), np.ones(40), np.tile([2, 5, 3, 1], 100)]
)
FREE: dict[str, tuple[np.ndarray, float, Mapping[str, object]]] = {
    # repeats by chance are flagged with a probability of about 1e-3 a log: none in these
    **{f"wind shown with {d} decimals": (gusts(20_000, decimals=d), 0.1, {}) for d in (0, 1, 2)},
    "a direction that moves beside a steady speed": (
        np.full(2000, 3.0),
        1,
        {"wind_direction": stream(6, "direction").uniform(0, 6, 2000)},
    ),
    # 50 s at one value, as an idle sensor shows, and nothing else to compare with
    "a fast log that stands for less than a minute": (np.full(10_000, 3.0), 0.005, {}),
    "a reading that its recipe lets stand": (
        np.array([3.0] * 30 + [4.0, 5.0] * 10),
        1,
        {"rules": QualityRules(stale_after=60)},
    ),
    "the least speed of a coarse instrument": (COARSE, 1, {}),
}
"""Speeds, their period [s] and what else is known."""


@pytest.mark.parametrize("name", FREE)
def test_what_chance_and_resolution_explain_is_not_stale(name: str) -> None:
    speed, period, more = FREE[name]
    found = rules.stale(made(period * np.arange(len(speed)), speed, **more))
    assert flagged(found) == []
    assert found.findings == ()


def frozen(length: int) -> np.ndarray:
    speed = gusts(5000)
    speed[1000 : 1000 + length] = 7.77
    return speed


HIGHER = np.where(np.arange(len(COARSE)) // 40 == 10, 9 * COARSE, COARSE)
STALE: dict[str, tuple[np.ndarray, float, Mapping[str, object], range]] = {
    "a minute": (frozen(60), 0.1, {}, range(1001, 1060)),
    "ten minutes": (frozen(600), 0.1, {}, range(1001, 1600)),
    **{
        f"all but {k} rows": (
            np.r_[gusts(20)[:k], np.full(200 - k, 4.0)],
            1,
            {"wind_direction": np.full(200, 4.7)},
            range(k + 1, 200),
        )
        for k in (0, 5, 20)
    },
    "longer than its recipe allows": (
        np.array([3.0] * 30 + [4.0, 5.0] * 10),
        1,
        {"rules": QualityRules(stale_after=10)},
        range(1, 30),
    ),
    "another than the least speed of a coarse instrument": (HIGHER, 1, {}, range(401, 440)),
}
"""Speeds that stand still: their period [s], what else is known, and the rows that repeat the one
before."""


@pytest.mark.parametrize("name", STALE)
def test_a_frozen_reading_is_stale_from_its_second_row(name: str) -> None:
    speed, period, more, rows = STALE[name]
    found = rules.stale(made(period * np.arange(len(speed)), speed, **more))
    assert flagged(found) == list(rows)
    assert [(one.kind, one.count, one.value) for one in found.findings] == [
        ("stale-repeats", len(rows), pytest.approx(len(rows) * period))
    ]
    assert ("wind_speed and wind_direction" in found.findings[0].what) == ("wind_direction" in more)


def test_calm_is_not_stale() -> None:
    calm = rules.dead_zone(made(np.arange(300), np.zeros(300)))
    assert kinds(calm) == ["dead-zone"]
    assert kinds(rules.stale(calm)) == ["dead-zone"]


@pytest.mark.parametrize(
    ("interval", "resolution"), [(1.0, 0.1), (1.0, 0.5), (60.0, 0.1), (600.0, 0.5), (0.05, 0.01)]
)
def test_light_wind_of_the_night_is_not_stale_beside_the_gusts_of_the_day(
    interval: float, resolution: float
) -> None:
    """Gusts of 20 % with a memory of 5 s about a mean of 1.2 m/s at night and up to 5.2 m/s by
    day."""
    n = 20_000
    rho = np.exp(-interval / 5)
    noise = stream(11, "night", round(interval * 100)).normal(0, np.sqrt(1 - rho**2), n)
    gust = np.asarray(lfilter([1.0], [1.0, -rho], noise))
    mean = 1.2 + 4 * np.clip(np.sin(2 * np.pi * np.arange(n) / n), 0, None)
    speed = np.round(mean * (1 + 0.2 * gust) / resolution) * resolution
    # runs of a light wind are correlated, which the bound leaves out: a few rows of 20,000 may be
    # taken for stale
    assert len(flagged(rules.stale(made(interval * np.arange(n), np.abs(speed))))) < 100


def test_a_frozen_reading_is_stale_though_another_kind_of_wind_goes_on_between() -> None:
    n = 2000
    both = np.full((2, 2 * n), np.nan)
    both[0, ::2], both[1, 1::2] = gusts(n), gusts(n) + 1
    both[0, 1000:1200:2] = 9.99
    winds = {"apparent_wind_speed": both[0], "theoretical_wind_speed": both[1]}
    found = rules.stale(made(0.1 * np.arange(2 * n), False, **winds))
    assert flagged(found) == list(range(1002, 1200, 2))
    assert [one.count for one in found.findings] == [99]


def test_jitter_of_stamps_is_no_gap_and_a_dropout_is() -> None:
    time = np.cumsum(stream(7, "jitter").uniform(0.004, 0.006, 2000))
    assert rules.gaps(made(time)).findings == ()
    time[1000:] += 0.433
    (gap,) = rules.gaps(made(time)).findings
    assert (gap.count, gap.where) == (1, "line 1002")
    assert gap.value == pytest.approx(0.438, abs=0.0011)
    (one,) = rules.gaps(made(np.delete(np.arange(100), 50))).findings
    assert one.value == pytest.approx(2.0)


def test_a_gap_names_its_interval_and_the_time_lost_in_it() -> None:
    (gap,) = rules.gaps(made([0, 1, 2, 3, 11, 12, 13, 14])).findings
    assert gap.what == (
        "1 interval longer than the usual 1 s, 7.000 s lost in all; "
        "the longest interval, 8.000 s, ends at the line named"
    )


@pytest.mark.parametrize(
    ("speed", "direction", "says"),
    [
        (gusts(40), np.zeros(40), "a vane that is stuck"),
        (np.zeros(40), np.zeros(40), "columns that were never filled"),
        (gusts(40), np.linspace(0, 1, 40), ""),
        (np.full(40, 3.0), np.ones(40), ""),  # `stale` reports readings that repeat
        (gusts(12), np.zeros(12), ""),  # a short log may hold one direction
    ],
)
def test_a_direction_that_stays_while_the_speed_varies_is_reported(
    speed: np.ndarray, direction: np.ndarray, says: str
) -> None:
    found = rules.one_direction(made(60 * np.arange(len(speed)), speed, wind_direction=direction))
    assert kinds(found) == (["direction-stays"] if says else [])
    assert says in " ".join(one.what for one in found.findings)


def intense(mean: float, intensity: float) -> np.ndarray:
    """Speeds of a mean and a turbulence intensity, both exact."""
    drawn = stream(0, "steady").normal(size=60)
    return mean * (1 + intensity * (drawn - drawn.mean()) / drawn.std())


@pytest.mark.parametrize(
    ("mean", "intensity", "step", "steady"),
    [
        (25, 0.001, 60, True),
        (17, 0.015, 60, True),
        (17, 0.04, 60, False),
        (8, 0.001, 5, False),
        (0.5, 0.001, 60, False),
    ],
)
def test_a_speed_that_hardly_varies_is_reported_unless_it_is_calm_or_the_log_short(
    mean: float, intensity: float, step: float, steady: bool
) -> None:
    assert (
        kinds(rules.steady(made(step * np.arange(60), intense(mean, intensity))))
        == ["steady-wind"] * steady
    )


def test_flutter_beside_the_nyquist_limit_is_flagged_with_its_alias_and_below_it_is_not() -> None:
    # at 60 frames a second 29.5 Hz cannot be distinguished from 60 - 29.5 = 30.5 Hz or 89.5 Hz
    own = QualityRules(frame_rate_of=("flutter_frequency",))
    frequency = np.where(np.arange(300) < 200, 6.0, 29.5)
    found = rules.at_nyquist(made(np.arange(300) / 60, flutter_frequency=frequency, rules=own))
    assert flagged(found) == list(range(200, 300))
    assert "30.5 or 89.5 Hz" in found.findings[0].what
    below = np.tile([4.0, 4.333, 4.667, 5.0], 50)
    assert not flagged(
        rules.at_nyquist(made(np.arange(200) / 30, flutter_frequency=below, rules=own))
    )


def test_rows_after_today_are_reported_and_kept() -> None:
    now = T0 + 3 * 86_400 * S
    found = rules.future(made([86_400, 3 * 86_400, 5 * 86_400]), now=now)
    assert [(one.kind, one.count, one.where) for one in found.findings] == [
        ("stamps-in-future", 1, "line 4")
    ]
    assert len(found.time) == 3


HEAD = "time,wind_speed,wind_direction,air_temperature,air_pressure,relative_humidity\n"


def table(*rows: str) -> str:
    """A plain table with a row a second: speed, direction [deg], temperature [°C], pressure [hPa],
    humidity [%]."""
    return HEAD + "".join(
        f"2026-05-01T12:00:{second:02d}Z,{row}\n" for second, row in enumerate(rows)
    )


def out_of_range(log: WindLog) -> list[tuple[int, str | None, str]]:
    return [(f.count, f.where, f.what) for f in log.findings if f.kind == "out-of-range"]


@pytest.mark.parametrize("speed", ["1e30", "-1e30", "1e308", "151", "999.9"])
def test_an_impossible_speed_is_flagged_reported_and_in_no_mean(speed: str) -> None:
    log = read(
        table(
            "4,10,20,1013,50", f"{speed},10,20,1013,50", "5,10,20,1013,50", f"{speed},10,20,1013,50"
        )
    )
    assert [bool(flag & SampleFlag.OUT_OF_RANGE) for flag in log.series.flags] == [
        False,
        True,
        False,
        True,
    ]
    ((count, where, what),) = out_of_range(log)
    assert (count, where, "wind_speed" in what) == (2, "line 3", True)
    assert average(log.series, 10.0).speed == pytest.approx(
        [4, 5]
    )  # bins that end at 12:00:00 and 12:00:10


@pytest.mark.parametrize(
    ("row", "channel"),
    [
        *((f"4,{angle},20,1013,50", "wind_direction") for angle in ("999", "361", "-181", "1e30")),
        ("4,10,999,1013,50", "air_temperature"),
        ("4,10,20,0,50", "air_pressure"),
        ("4,10,20,1013,400", "relative_humidity"),
    ],
)
def test_an_impossible_direction_or_air_is_left_out_and_leaves_the_wind_usable(
    row: str, channel: str
) -> None:
    log = read(table("4,10,20,1013,50", row))
    assert np.isfinite(log.series.channels[channel]).tolist() == [True, False]
    ((count, where, what),) = out_of_range(log)
    assert (count, where, channel in what) == (1, "line 3", True)
    assert not log.series.flags.any()  # the speed beside it is as good as ever


def test_signed_directions_and_full_circles_are_possible() -> None:
    log = read(table("4,-180,20,1013,50", "4,-90,20,1013,50", "4,360,20,1013,50"))
    assert np.degrees(log.series.channels["wind_direction"]) == pytest.approx([180, 270, 0])
    assert out_of_range(log) == []


RECIPE = """
name = "vane"
about = "a vane with a range"
source = "a test"
[time]
columns = ["time"]
format = "iso"
[channels.wind_speed]
column = "speed"
unit = "m/s"
range = [0, 60]
[channels.wind_direction]
column = "direction"
unit = "deg"
{vane}
[sensor]
name = "vane"
"""


@pytest.mark.parametrize(("vane", "turned"), [("rotation = 20", 10), ("offset = 45", 35)])
def test_a_recipe_narrows_what_is_possible_and_turns_a_vane_past_north(
    tmp_path: Path, vane: str, turned: float
) -> None:
    recipe = tmp_path / "vane.toml"
    recipe.write_text(RECIPE.format(vane=vane))
    rows = (
        "2026-05-01T12:00:00Z,59,350\n2026-05-01T12:00:01Z,61,350\n2026-05-01T12:00:02Z,1e9,350\n"
    )
    log = read("time,speed,direction\n" + rows, recipe=str(recipe))
    assert [count for count, _, _ in out_of_range(log)] == [2]  # each value is reported once
    assert np.degrees(log.series.channels["wind_direction"]) == pytest.approx([turned] * 3)


def test_an_impossible_angle_of_a_stream_is_left_out_and_reported() -> None:
    bodies = (
        "GPZDA,120000.00,01,05,2026,00,00",
        *(f"WIMWV,{at},R,5.0,M,A" for at in ("010.0", "999.0", "010.0")),
        "GPZDA,120004.00,01,05,2026,00,00",
    )
    log = read("".join(f"${body}\r\n" for body in bodies))
    angle = np.degrees(log.series.channels["apparent_wind_direction"])
    assert np.isnan(angle).tolist() == [False, True, False]
    assert [(count, where) for count, where, _ in out_of_range(log)] == [(1, "line 3")]


@pytest.mark.parametrize(
    ("header", "row", "why"),
    [
        ("wind_speed", "", "200 missing"),
        ("wind_speed,wind_direction", ",270", "200 missing"),
        ("wind_speed", "1e30", "200 out of range"),
        ("wind_speed", "-0.3", "200 out of range"),
    ],
)
def test_a_log_without_one_usable_wind_is_refused(header: str, row: str, why: str) -> None:
    rows = "".join(f"2026-05-01T12:{i // 60:02d}:{i % 60:02d}Z,{row}\n" for i in range(200))
    with pytest.raises(
        InputError, match=rf"nothing to measure: not one value of the wind in 200 rows .*\({why}\)"
    ) as caught:
        read(f"time,{header}\n{rows}")
    assert caught.value.fix


def test_a_log_without_one_usable_wind_is_kept_for_what_else_it_measured() -> None:
    rows = "".join(f"2026-05-01T12:{i // 60:02d}:{i % 60:02d}Z,,{20 + i % 3}\n" for i in range(200))
    log = read(f"time,wind_speed,air_temperature\n{rows}")
    (finding,) = [f for f in log.findings if f.kind == "no-usable-wind"]
    assert (finding.severity, finding.count) == (Severity.ERROR, 200)
    assert "air_temperature" in finding.what


@pytest.mark.parametrize("offset", [-0.35, 0.2])
def test_the_zero_offset_of_an_idle_stretch_is_found_within_its_resolution(offset: float) -> None:
    idle = np.round(offset + stream(8, "idle").normal(0, 0.005, 3000), 2)
    found = zero.estimate(
        T0 + np.arange(6000) * (S // 100), np.concatenate([idle, offset + gusts(3000)])
    )
    assert found is not None
    assert found.offset == pytest.approx(offset, abs=0.01)
    # the gusts may pass through the idle band for moments, no more
    assert int(found.idle.sum()) == pytest.approx(3000, abs=10)
    assert found.seconds == pytest.approx(30, abs=2)


NO_ZERO = {
    "steady wind": np.round(8 + stream(9, "steady").normal(0, 0.005, 6000), 2),
    "a log that is never idle": gusts(6000) - 5.5,
    "a steady breeze below which the wind often falls": np.concatenate(
        [
            np.round(0.7 + stream(8, "steady").normal(0, 0.005, 3000), 2),
            np.abs(gusts(3000) - np.median(gusts(3000))),
        ]
    ),
}


@pytest.mark.parametrize("name", NO_ZERO)
def test_what_is_no_calm_air_shows_no_zero_offset(name: str) -> None:
    assert zero.estimate(np.arange(6000) * 10_000_000, NO_ZERO[name]) is None


@pytest.fixture
def idle() -> Reading:
    """20 s idle at -0.35 m/s, then gusts that begin 0.4 m/s above it; a hundred rows a second."""
    return made(
        0.01 * np.arange(4000), -0.35 + np.concatenate([np.zeros(2000), [0.4], gusts(1999)])
    )


@pytest.mark.parametrize(
    ("choice", "shift", "severity", "says"),
    [
        ("report", 0, Severity.WARNING, "not subtracted"),
        ("estimate", 0.35, Severity.NOTE, "; subtracted"),
        (-0.35, 0.35, Severity.NOTE, "; subtracted"),
        (-0.34, 0.34, Severity.NOTE, "; subtracted"),
        (-0.1, 0.1, Severity.WARNING, "-0.250 m/s in calm air"),
    ],
)
def test_a_zero_offset_is_subtracted_only_where_asked_and_reported(
    choice: Any, shift: float, severity: Severity, says: str, idle: Reading
) -> None:
    done = zero.settle(idle, choice)
    assert done.channels["wind_speed"] == pytest.approx(idle.channels["wind_speed"] + shift)
    (about,) = [f for f in done.findings if f.kind == "zero-offset"]
    assert (about.severity, about.fix is None) == (severity, severity is Severity.NOTE)
    assert about.value == pytest.approx(-0.35)
    assert says in about.what
    settled = severity is Severity.NOTE
    assert bool(np.all(done.flags[:2000] == (SampleFlag.DEAD_ZONE if settled else 0)))
    # the jump out of a calm that reads 0 is the threshold of a sensor that states none
    assert done.sensor.threshold == (pytest.approx(0.4) if settled else None)
    stated = zero.settle(replace(idle, sensor=Sensor(name="cup", threshold=0.6)), choice)
    assert stated.sensor.threshold == 0.6


def test_a_log_that_is_idle_all_along_never_leaves_its_zero() -> None:
    found = zero.estimate(T0 + np.arange(3000) * (S // 100), np.full(3000, 0.2))
    assert found is not None
    assert (found.offset, bool(found.leaves.any()), bool(np.isnan(found.jump))) == (
        0.2,
        False,
        True,
    )


def test_a_cap_that_is_taken_off_once_is_no_dead_zone() -> None:
    """Two minutes at 0.04 m/s, then wind at once, of which the log has many readings below the
    first."""
    wind = np.concatenate([[2.1], np.abs(gusts(11_999) - np.median(gusts(11_999))) + 0.3])
    log = made(0.1 * np.arange(13_200), np.concatenate([np.full(1200, 0.04), wind]))
    done = zero.settle(log, "report")
    assert "dead-zone-jump" not in [finding.kind for finding in done.findings]
    assert done.sensor.threshold is None
    (about,) = [finding for finding in done.findings if finding.kind == "zero-offset"]
    assert about.what.endswith("; left as it is, within 0.05 m/s of zero")
    np.testing.assert_array_equal(done.channels["wind_speed"], log.channels["wind_speed"])


def test_a_minute_of_calm_may_hide_anything_below_the_jump_out_of_it(idle: Reading) -> None:
    calm = zero.settle(idle, "estimate").take(np.arange(2000))
    sensor = replace(calm.sensor, accuracy=0.0)
    series = WindSeries(time=calm.time, channels=calm.channels, flags=calm.flags, sensor=sensor)
    # a rectangular 0 to 0.4 m/s
    assert TruthSeries.of(series).before(int(calm.time[-1])).sigma_sensor == pytest.approx(
        0.4 / np.sqrt(3)
    )


@pytest.mark.parametrize("offset", [0.1, "estimate"])
def test_a_zero_offset_of_what_has_no_speed_is_refused(offset: float | str) -> None:
    head = '"TOA5","a"\r\n"TIMESTAMP","Ux","Uy"\r\n"TS","m/s","m/s"\r\n"","",""\r\n'
    with pytest.raises(UsageError, match="components"):
        read(head + '"2026-05-01 12:00:00",3,4\r\n', zone="UTC", zero_offset=offset)


def test_an_azimuth_for_a_vane_is_refused() -> None:
    text = "time,wind_speed,wind_direction\n2026-05-01T12:00:00Z,3,90\n"
    with pytest.raises(UsageError, match="rotation"):
        read(text, azimuth=1.0)


def test_sonic_components_give_speed_and_direction() -> None:
    head = (
        '"TOA5","a","b","c","d","e","f","g"\r\n"TIMESTAMP","RECORD","Ux","Uy","Uz"\r\n'
        '"TS","RN","m/s","m/s","m/s"\r\n"","","","",""\r\n'
    )
    rows = '"2026-05-01 12:00:00",0,3,4,0\r\n"2026-05-01 12:00:00.1",1,5,0,0\r\n'
    # the array points east (90°): wind along +x comes from east; y is to the left of x, so wind
    # along +y comes from 90° less
    log = read(head + rows, zone="UTC", azimuth=np.pi / 2)
    assert log.series.channels["wind_speed"] == pytest.approx([5.0, 5.0])
    assert np.degrees(log.series.channels["wind_direction"]) == pytest.approx(
        [90 - 53.130102, 90.0]
    )
