"""The offset estimated from motion and wind: recovered, covered by its interval, refused where it is unknowable."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from flagdata.align.lag import LagEstimate, LagSearch, estimate_offset
from flagdata.align.motion import MotionSeries
from flagdata.rng import stream
from flagdata.signals import WindAverage

Scenes = Callable[..., tuple[MotionSeries, WindAverage]]


def estimate(pair: tuple[MotionSeries, WindAverage], **changes: float) -> LagEstimate:
    return estimate_offset(*pair, search=LagSearch(**changes), generator=stream(0, "chance"))  # type: ignore[arg-type]


def refusals(found: LagEstimate) -> set[str]:
    return {finding.kind for finding in found.findings if finding.severity == "error"}


@pytest.mark.parametrize("offset", [-97.4, -12.3, 0.0, 31.7, 118.0])
def test_offset_of_a_gusty_ten_minutes_is_recovered_within_half_a_second(scene: Scenes, offset: float) -> None:
    found = estimate(scene(seed=3, offset=offset, apart=1.5, flag_noise=0.3))
    assert found.accepted, found.reasons
    assert found.offset == pytest.approx(offset, abs=0.5)  # the acceptance bound
    assert found.interval[0] <= offset <= found.interval[1]


def test_steady_wind_is_refused(scene: Scenes) -> None:
    found = estimate(scene(seed=4, turbulence=0.005))
    assert not found.accepted
    assert refusals(found) == {"steady-wind"}
