"""Kinds of wind that share a stream: rate and gaps are of each; and speeds that stay at zero."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from flagdata.core.rng import stream
from flagdata.core.schema import SampleFlag
from flagdata.errors import InputError
from flagdata.ingest import Reading, ingest_wind
from flagdata.ingest.anemometer.log_reading import streams
from flagdata.ingest.anemometer.samples import rules
from flagdata.lake import Lake
from flagdata.record.signals import Sensor
from tests.flagdata.ingest.anemometer.cases import sentence
from tests.flagdata.ingest.anemometer.conftest import read

S = 1_000_000_000
T0 = 1_777_636_800 * S


def burst_stream(seconds: range, speed: Callable[[int], float]) -> str:
    """Each second a ZDA, then MWD, MWV R and MWV T right after each other, then sentences of
    something else."""
    lines: list[str] = []
    for s in seconds:
        lines.append(sentence(f"GPZDA,12{s // 60:02d}{s % 60:02d},01,05,2026,00,00"))
        lines.append(sentence(f"WIMWD,{s % 360}.0,T,,M,{speed(s):.1f},N,{speed(s) * 0.5144:.2f},M"))
        lines.append(sentence(f"WIMWV,{(s * 7) % 360}.0,R,{speed(s):.1f},N,A"))
        lines.append(sentence(f"WIMWV,{(s * 5) % 360}.0,T,{speed(s):.1f},N,A"))
        lines += [sentence(f"IIHDG,{(s + k) % 360}.0,,,,") for k in range(40)]
    return "\n".join(lines) + "\n"


def test_three_sentences_in_a_burst_a_second_are_one_hertz_each_without_a_gap(
    log_file, tmp_path: Path
) -> None:
    path = log_file(burst_stream(range(600), lambda s: 8 + s % 7))
    lake = Lake.create(tmp_path / "lake")
    report = ingest_wind(lake, path).report
    assert report["samples"] == 1800
    assert report["rate"] == pytest.approx(1.0, rel=1e-3)
    assert report["longest_gap"] == pytest.approx(1.0, abs=0.01)
    assert "gaps" not in [finding["kind"] for finding in report["findings"]]


def test_a_gap_of_one_kind_of_wind_is_named_with_it() -> None:
    n = 400
    time = np.concatenate([np.arange(n) * S, np.arange(n) * S + S // 50])
    relative, over_ground = np.full(2 * n, np.nan), np.full(2 * n, np.nan)
    relative[:n], over_ground[n:] = 5.0, 6.0
    order = np.argsort(time)
    keep = order[~((order >= n + 100) & (order < n + 130))]
    reading = Reading(
        time=T0 + time[keep],
        channels={"apparent_wind_speed": relative[keep], "wind_speed": over_ground[keep]},
        flags=np.zeros(len(keep), dtype=np.uint16),
        line=np.arange(len(keep)) + 1,
        sensor=Sensor(name="x"),
        step=1,
    )
    (gap,) = rules.gaps(reading).findings
    assert gap.value == pytest.approx(31.0)
    assert " of wind_speed " in gap.what


def test_channels_that_share_rows_are_one_kind_whatever_is_missing() -> None:
    speed = np.array([1.0, np.nan, 3.0, np.nan])
    direction = np.array([np.nan, 1.0, 1.0, np.nan])
    ((names, rows),) = streams(
        {"wind_speed": speed, "wind_direction": direction, "air_temperature": speed}
    )
    assert set(names) == {"wind_speed", "wind_direction"}
    assert rows.tolist() == [0, 1, 2, 3]


def test_an_apparent_wind_that_stays_at_zero_is_no_calm() -> None:
    text = burst_stream(range(300), lambda s: 0.0 if s >= 100 else 8.0 + s % 7)
    found = read(text)
    kinds = {f.what.split()[0]: f for f in found.findings if f.kind == "stays-at-zero"}
    assert set(kinds) == {"apparent_wind_speed", "theoretical_wind_speed"}
    assert kinds["apparent_wind_speed"].count == 200
    apparent = np.isfinite(found.series.channels["apparent_wind_speed"])
    assert int(((found.series.flags & SampleFlag.STALE) != 0)[apparent].sum()) == 200


def test_a_moment_of_calm_past_a_boat_is_left_alone() -> None:
    found = read(burst_stream(range(300), lambda s: 0.0 if 100 <= s < 130 else 8.0 + s % 7))
    assert "stays-at-zero" not in [f.kind for f in found.findings]


def test_a_mast_whose_log_never_reads_anything_but_zero_is_reported() -> None:
    rows = "".join(f"2026-05-01T12:{i // 60:02d}:{i % 60:02d}Z,{{}}\n" for i in range(200))
    zero = read("time,wind_speed\n" + rows.format(*["0.0"] * 200))
    assert [f.count for f in zero.findings if f.kind == "stays-at-zero"] == [200]
    night = np.where(np.arange(200) < 150, 0.0, np.round(stream(9, "mast").uniform(1, 3, 200), 2))
    calm = read("time,wind_speed\n" + rows.format(*night))
    assert "stays-at-zero" not in [f.kind for f in calm.findings]


POSITION = "time,wind_speed,wind_direction,Latitude,Longitude\n"


def track(metres: float, n: int = 120) -> str:
    """Northwards by `metres`, at 52°N."""
    return POSITION + "".join(
        f"2026-05-01T12:{i // 60:02d}:{i % 60:02d}Z,{4 + i % 5},{i},{52 + metres / 111_195 * i / n:.7f},4.5\n"
        for i in range(n)
    )


def test_a_table_from_a_platform_given_as_moving_holds_apparent_wind() -> None:
    found = read(
        "time,wind_speed\n2026-05-01T12:00:00Z,3\n2026-05-01T12:00:01Z,4\n", platform="moving"
    )
    assert found.series.channels["apparent_wind_speed"].tolist() == [3.0, 4.0]
    assert "wind_speed" not in found.series.channels
    assert "apparent-wind-only" in [f.kind for f in found.findings]


def test_positions_that_move_make_a_tables_wind_apparent() -> None:
    found = read(track(2000))
    assert "wind_speed" not in found.series.channels
    (finding,) = [f for f in found.findings if f.kind == "apparent-wind-only"]
    # the middle nine tenths of 119/120 of 2 km
    assert "over 1785 m" in finding.what


def test_positions_that_only_scatter_are_those_of_a_mast() -> None:
    assert "wind_speed" in read(track(20)).series.channels


def test_a_platform_given_as_fixed_may_not_move() -> None:
    assert "fixed-platform" in [f.kind for f in read(track(20), platform="fixed").findings]
    with pytest.raises(InputError, match="--platform moving"):
        read(track(2000), platform="fixed")


TOA5 = (
    '"TOA5","mast","CR1000","1","OS","prog","1","table"\n"TIMESTAMP","RECORD","WS_ms_Avg"\n"TS","RN","m/s"\n'
    '"","","Avg"\n'
)


def test_every_format_takes_a_platform() -> None:
    rows = "".join(f'"2026-05-01 12:{i:02d}:00",{i},{3 + i % 4}\n' for i in range(30))
    found = read(TOA5 + rows, platform="moving", zone="UTC")
    assert found.format == "toa5"
    assert "apparent_wind_speed" in found.series.channels


def test_wind_over_ground_from_a_platform_that_moves_is_taken_by_its_users_word() -> None:
    log = read(track(2000), platform="corrected")
    assert "wind_speed" in log.series.channels
    assert "computed-true-wind" in [finding.kind for finding in log.findings]
