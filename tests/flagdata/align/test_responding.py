"""By how much a flag is taken to follow the wind, and what of it the user states."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from flagdata.align import ClockOptions, LagSearch, Method, evidence, methods
from flagdata.align.methods import responding
from flagdata.errors import UsageError
from flagdata.timebase import NANOSECONDS


@pytest.mark.parametrize(
    ("wind", "response", "sigma"),
    [(0.0, 1.0, 0.3), (3.0, 1.0, 0.3), (6.0, 0.5, 0.25), (10.0, 0.3, 0.15), (20.0, 0.3, 0.15)],
)
def test_a_flag_follows_the_later_the_lighter_the_wind(
    wind: float, response: float, sigma: float
) -> None:
    assert responding(wind) == pytest.approx((response, sigma))


@pytest.mark.parametrize("lag", [1.0, 1.6])
def test_the_lag_of_simulated_flags_in_light_wind_lies_within_two_standard_errors(
    lag: float,
) -> None:
    response, sigma = responding(3.0)
    assert abs(lag - response) <= 2 * sigma + 1e-9


@pytest.mark.parametrize(
    ("stated", "expected"),
    [
        ({}, (1.0, 0.3)),
        ({"response": 0.7}, (0.7, 0.15)),
        ({"response_sigma": 0.2}, (1.0, 0.2)),
        ({"response": 0.7, "response_sigma": 0.05}, (0.7, 0.05)),
    ],
)
def test_what_the_user_states_counts(
    stated: dict[str, float], expected: tuple[float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    searched: list[LagSearch] = []

    def estimate(*given: Any, search: LagSearch, generator: object) -> Any:
        searched.append(search)
        return SimpleNamespace(is_accepted=False)

    times = np.array([0, 150]) * NANOSECONDS
    average = SimpleNamespace(speed=np.array([2.0, 4.0]), time=times, period=1.0)
    monkeypatch.setattr(
        methods, "wind_bins", lambda series: SimpleNamespace(average=average, sigma=0.1)
    )
    monkeypatch.setattr(methods, "estimate_offset", estimate)
    named = SimpleNamespace(id="a")
    pair = SimpleNamespace(
        series=lambda: None,
        motion=lambda progress: None,
        camera=named,
        wind=named,
        span=times.tolist(),
    )
    found = evidence(cast(Any, pair), ClockOptions(**cast(Any, stated)))
    assert (searched[0].response, searched[0].response_sigma) == pytest.approx(expected)
    assert found.response == pytest.approx(expected[0])


def test_a_response_is_refused_where_nothing_is_searched() -> None:
    with pytest.raises(UsageError, match="searches nothing"):
        ClockOptions(by=Method.GIVEN, offset=1.0, offset_sigma=0.1, response=0.5)


def test_another_stated_response_makes_another_recording() -> None:
    recipes = [ClockOptions(response=response).recipe() for response in (None, 0.3, 0.5)]
    assert recipes[0] != recipes[1] != recipes[2]
