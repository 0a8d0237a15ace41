"""Drift from the parts of a long recording."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from flagdata.align import LagEstimate, LagSearch, MotionSeries, clock_line, estimate_offset
from flagdata.align.drift import ClockLine
from flagdata.core.rng import stream
from flagdata.errors import InputError
from flagdata.record.signals import WindAverage
from tests.flagdata.align.conftest import scene

SECOND = 1_000_000_000
SEARCH = LagSearch(surrogates=60)


def both(motion: MotionSeries, wind: WindAverage) -> tuple[LagEstimate, ClockLine]:
    generator = stream(0, "chance")
    whole = estimate_offset(motion, wind, search=SEARCH, generator=generator)
    return whole, clock_line(motion, wind, whole, search=SEARCH, generator=generator)


@pytest.mark.parametrize("drift", [-2e-4, 0.0, 2e-4])
def test_two_hours_show_a_drift_of_two_parts_in_ten_thousand(drift: float) -> None:
    motion, wind = scene(
        seed=11, offset=20.0, duration=7200.0, drift=drift, apart=1.5, flag_noise=0.3
    )
    _, line = both(motion, wind)
    assert len(line.parts) >= 6
    assert not line.findings
    assert (
        abs(line.drift - drift) < 2.5 * line.sigma_drift
    )  # one of three tests in eighty would fail by chance
    assert line.sigma_drift < 1e-4
    middle = (line.origin - (motion.time[0] + motion.time[-1]) / 2) / SECOND
    assert line.offset + line.drift * -middle == pytest.approx(20.0, abs=0.5)


def test_ten_minutes_leave_the_drift_to_quartz() -> None:
    whole, line = both(*scene(seed=3, offset=20.0, apart=1.5, flag_noise=0.3))
    assert (line.drift, line.sigma_drift) == (0.0, 3e-5)
    assert (line.offset, line.sigma_offset, line.origin) == (whole.offset, whole.sigma, whole.at)
    assert line.parts == ()


def test_a_clock_that_was_set_on_the_way_is_found_out() -> None:
    motion, wind = scene(seed=12, offset=20.0, duration=5400.0, apart=1.0, flag_noise=0.2)
    late = motion.time > motion.time[0] + 3600 * SECOND
    set_back = replace(motion, time=np.where(late, motion.time + 4 * SECOND, motion.time))
    _, line = both(set_back, wind)
    assert [finding.kind for finding in line.findings] == ["crooked-clock"]


def test_there_is_no_drift_about_a_refused_offset() -> None:
    motion, wind = scene(seed=4, turbulence=0.005)
    whole = estimate_offset(motion, wind, search=SEARCH, generator=stream(0, "chance"))
    with pytest.raises(InputError, match="refused"):
        clock_line(motion, wind, whole, search=SEARCH, generator=stream(0, "chance"))
