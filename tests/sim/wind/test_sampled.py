"""Sampled winds: linear between samples, and at their ends what the caller said."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from flagdata.errors import InputError, UsageError
from sim.wind import Beyond, Even, SampledWind
from sim.wind.sampled import Times
from tests.refusals import unrefused

EVEN = Even(start=-1.0, period=0.5, count=4)
UNEVEN = (-1.0, -0.5, 0.0, 0.5)
SAMPLES = torch.arange(24, dtype=torch.float64).reshape(4, 3, 2) ** 2


def blown(times: Times, beyond: Beyond = Beyond.HOLD) -> SampledWind:
    return SampledWind(times=times, samples=SAMPLES, beyond=beyond)


@pytest.mark.parametrize("times", [EVEN, UNEVEN], ids=["even", "uneven"])
def test_a_wind_is_that_of_its_samples_the_last_included_and_linear_between(times: Times) -> None:
    wind = blown(times)
    for time, sample in zip(UNEVEN, SAMPLES, strict=True):
        torch.testing.assert_close(wind.velocity(time), sample, rtol=0, atol=0)
    expected = [
        np.interp(0.3, UNEVEN, SAMPLES[:, axis, member]) for axis in range(3) for member in range(2)
    ]
    np.testing.assert_allclose(wind.velocity(0.3).ravel(), expected, rtol=1e-14)


@pytest.mark.parametrize("times", [EVEN, UNEVEN], ids=["even", "uneven"])
def test_beyond_its_samples_a_wind_holds_or_is_refused(times: Times) -> None:
    torch.testing.assert_close(blown(times).velocity(-7.0), SAMPLES[0], rtol=0, atol=0)
    torch.testing.assert_close(blown(times).velocity(7.0), SAMPLES[3], rtol=0, atol=0)
    for time in (-1.1, 0.6):
        with pytest.raises(UsageError, match=r"known from -1 to 0\.5 s"):
            blown(times, Beyond.REFUSE).velocity(time)
    torch.testing.assert_close(
        blown(times, Beyond.REFUSE).velocity(0.5), SAMPLES[3], rtol=0, atol=0
    )


def test_samples_that_make_no_wind_are_refused() -> None:
    cases = [
        ((0.0, 1.0, 1.0, 2.0), SAMPLES, "do not increase"),
        (Even(start=0.0, period=0.0, count=4), SAMPLES, "do not increase"),
        (EVEN, SAMPLES[:3], "for 4 times"),
        (EVEN, SAMPLES * torch.nan, "not finite"),
    ]
    assert not unrefused(
        lambda times, samples: SampledWind(times=times, samples=samples, beyond=Beyond.HOLD),
        cases,
        InputError,
    )
