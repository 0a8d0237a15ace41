"""Values that speak for a unit, or against the one that is stated."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from flagdata.ingest.anemometer.table import unitcheck
from flagdata.units import unit

WIND: NDArray[np.float64] = np.asarray(5 * np.abs(np.random.default_rng(7).weibull(2.0, 400)), dtype=np.float64)
"""m/s."""


def written(native: str, step: float, shown: str, digits: int) -> NDArray[np.float64]:
    """A wind measured in steps of a unit and written in another."""
    counts = np.round(WIND / unit(native).scale / step)
    return np.round(counts * step * unit(native).scale / unit(shown).scale, digits)


@pytest.mark.parametrize(
    ("native", "step", "shown", "digits"),
    [
        ("mph", 1.0, "km/h", 1), ("mph", 1.0, "m/s", 2), ("kn", 1.0, "m/s", 1), ("km/h", 1.0, "m/s", 2),
        ("m/s", 1.0, "km/h", 1), ("m/s", 0.1, "km/h", 2), ("m/s", 0.1, "mph", 2), ("kn", 1.0, "km/h", 1),
    ],
)  # fmt: skip
def test_multiples_of_a_converted_step_tell_the_unit_they_are_written_in(
    native: str, step: float, shown: str, digits: int
) -> None:
    found = unitcheck.from_resolution(written(native, step, shown, digits))
    assert found is not None
    assert found.unit == shown
    assert f"{step:g} {native}" in found.reason


@pytest.mark.parametrize("digits", [0, 1, 2, 6])
def test_decimal_steps_tell_no_unit(digits: int) -> None:
    assert unitcheck.from_resolution(np.round(WIND, digits)) is None
    assert unitcheck.from_resolution(np.round(3.6 * WIND, digits)) is None


def test_a_stated_unit_that_the_steps_contradict_is_doubted() -> None:
    found = unitcheck.contradiction(written("mph", 1.0, "km/h", 1), "m/s", span=600.0)
    assert found is not None
    assert (found.kind, "km/h" in found.what) == ("unit-doubtful", True)
    assert unitcheck.contradiction(written("mph", 1.0, "m/s", 2), "m/s", span=600.0) is None


def test_a_day_of_gales_in_metres_a_second_is_doubted_an_hour_is_not() -> None:
    gale = np.round(18 + 8 * np.random.default_rng(3).random(400), 1)
    assert unitcheck.contradiction(gale, "m/s", span=3600.0) is None
    found = unitcheck.contradiction(gale, "m/s", span=2 * 86_400.0)
    assert found is not None
    assert "km/h" in found.what
    assert unitcheck.contradiction(gale, "km/h", span=2 * 86_400.0) is None


def test_whole_numbers_of_another_unit_by_a_rounded_factor_are_of_the_stated_one() -> None:
    values = np.array([0.45, 0.9, 1.34, 1.79, 2.24, 2.68] * 4)  # 1 to 6 mph in m/s, the second as twice 0.45
    assert unitcheck.contradiction(values, "m/s", span=3600.0) is None
    assert unitcheck.contradiction(written("m/s", 0.1, "mph", 2), "m/s", span=3600.0) is not None
