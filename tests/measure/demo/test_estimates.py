"""What the demonstration's report says of the wind read off its film: by how much it is off, and why."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from measure.demo.estimates import Series
from measure.estimate.series import Agreement, Beside


def series(wind: list[float], logged: list[float], *, refused: bool = False) -> Series:
    off = np.array(wind) - np.array(logged)
    agreement = Agreement(
        count=len(wind), bounded=0, bias=float(off.mean()), rmse=float(np.sqrt((off**2).mean())), interval=(1.0, 2.0),
        covered=0.5,
    )  # fmt: skip
    values = np.array(wind, dtype=np.float64)
    beside = Beside(
        time=np.arange(len(wind), dtype=float), wind=values, low=values - 1.0, high=values + 1.0, p=np.ones(len(wind)),
        logged=np.array(logged), minute=np.array(logged), window=agreement,
    )  # fmt: skip
    verdict = SimpleNamespace(
        strange=np.array([True, *[False] * (len(wind) - 1)]), refused=refused, refusing=2, window_p=wind
    )
    measured: Any = SimpleNamespace(verdict=verdict, model="wave")
    return Series(measured=cast(Any, measured), beside=beside)


@pytest.mark.parametrize("refused", [False, True])
def test_the_caption_says_how_far_the_readings_are_off_and_why(refused: bool) -> None:
    """Readings 1.5 m/s below the anemometer, rising and falling with it exactly."""
    text = series([2.5, 3.5, 4.5, 3.5], [4.0, 5.0, 6.0, 5.0], refused=refused).sentence
    assert "1.5 m/s too low in the mean" in text
    assert "correlation 1.00" in text
    assert "n = 4 windows" in text
    assert "drawn by plain formulas" in text
    assert "1 of 4 windows" in text


def test_readings_that_never_change_have_no_correlation() -> None:
    text = series([6.0, 6.0, 6.0], [4.0, 5.0, 6.0]).sentence
    assert "1.0 m/s too high" in text
    assert "correlation" not in text
