"""A direction of 0 at the lowest speeds alone is calm air; one at any other speed is north."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flagdata.signals import WindLog

Read = Callable[..., WindLog]


def rows(speeds: list[float], directions: list[int]) -> str:
    lines = [f"2026-05-01T12:{at:02d}:00Z,{v},{d}" for at, (v, d) in enumerate(zip(speeds, directions, strict=True))]
    return "\n".join(["time,WS [m/s],WD [deg]", *lines]) + "\n"


def test_zeros_below_every_other_speed_are_calm(read: Read) -> None:
    speeds = [0.1, 0.6, 0.0, 0.9, 0.1, 1.2, 0.0] + [0.3 + 0.1 * at for at in range(30)]
    directions = [0, 260, 0, 110, 0, 250, 0] + [110 + 5 * at for at in range(30)]
    log = read(rows(speeds, directions))
    calm = np.array([v <= 0.1 for v in speeds])
    np.testing.assert_array_equal(np.isnan(log.series.channels["wind_direction"]), calm)
    assert [f.count for f in log.findings if f.kind == "calm-without-direction"] == [4]


def test_zeros_at_other_speeds_or_in_few_rows_are_north(read: Read) -> None:
    plain = [0.3 + 0.1 * at for at in range(30)]
    for speeds, directions in (
        ([0.1, 0.1, 0.0, 2.0, *plain], [0, 0, 0, 0] + [110 + 5 * at for at in range(30)]),
        ([0.1, 0.1, 0.0, *plain], [0, 0, 0] + [110 + 5 * at for at in range(30)]),
    ):
        log = read(rows(speeds, directions))
        assert np.isfinite(log.series.channels["wind_direction"]).all()
        assert "calm-without-direction" not in {f.kind for f in log.findings}
